use std::collections::VecDeque;

use emems::{
    calibration::{Ranges, Set, load::Arriving},
    command::{Heard, Parser},
    mode::{Action, Mode, Reply, State},
    unit::Settings,
};

use super::*;

/// The unit's own parser, modes and loading, on a line that spoils what it is told to.
struct Unit {
    parser: Parser,
    state: State,
    arriving: Arriving,
    set: Set,
    says: VecDeque<u8>,
    heard: usize,
    /// Which bytes to the unit are lost, by number.
    lost: Vec<usize>,
    /// What a byte of the unit becomes, by its number.
    garbled: Option<usize>,
    said: usize,
}

fn ranges() -> Ranges {
    Ranges::of(&Settings::NOMINAL)
}

fn own(unit: u32) -> Set {
    let mut set = Set::nominal(ranges());
    set.identity.unit = unit;
    set.identity.set = 3;
    set.gyro[1].bias_counts = -20.25;
    set
}

impl Unit {
    fn new() -> Self {
        Unit {
            parser: Parser::default(),
            state: State::default(),
            arriving: Arriving::default(),
            set: Set::nominal(ranges()),
            says: VecDeque::new(),
            heard: 0,
            lost: Vec::new(),
            garbled: None,
            said: 0,
        }
    }

    fn say(&mut self, text: &str) {
        // A packet, as with G_MT, between two lines.
        self.says
            .extend(format!(">{text}\r\n@0000{}#", "7".repeat(150)).bytes());
    }

    fn obey(&mut self, command: Command) {
        match self.state.command(command, 0) {
            Reply::Done(Action::Calibration(Command::SetWord { place, bytes })) => {
                self.arriving.take(place, bytes);
            }
            Reply::Done(Action::Calibration(Command::LoadSet)) => {
                match self.arriving.set(ranges(), self.set.identity.unit) {
                    Ok(set) => {
                        self.set = set;
                        self.say(&format!(
                            "G_CL ok: set {} of unit {}",
                            set.identity.set, set.identity.unit
                        ));
                    }
                    Err(why) => self.say(&format!("G_CL no: {why}")),
                }
            }
            Reply::Done(Action::Calibration(_)) => {
                for (line, bytes) in self.set.encode().chunks(32).enumerate() {
                    let hex: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
                    self.say(&format!("G_CR {:04X} {hex}", 8 * line));
                }
            }
            Reply::Confirm(_) => match self.arriving.set(ranges(), self.set.identity.unit) {
                Ok(_) => self.say("G_CL: send G_CK within 10 s"),
                Err(why) => self.say(&format!("G_CL no: {why}")),
            },
            _ if command == Command::LoadSet => self.say("G_CL no: only in WAIT"),
            _ => {}
        }
    }
}

impl Write for Unit {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for byte in bytes {
            self.heard += 1;
            if self.lost.contains(&self.heard) {
                continue;
            }
            if let Some(Heard::Command(command)) = self.parser.hear(*byte, 0) {
                self.obey(command);
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Unit {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let Some(mut byte) = self.says.pop_front() else {
            return Err(io::ErrorKind::TimedOut.into());
        };
        self.said += 1;
        if self.garbled == Some(self.said) {
            byte = b'?';
        }
        bytes[0] = byte;
        Ok(1)
    }
}

#[test]
fn a_set_is_sent_used_and_read_back() {
    let mut unit = Unit::new();
    assert_eq!(
        send(&mut unit, &own(7).encode()).expect("used"),
        "G_CL ok: set 3 of unit 7"
    );
    assert_eq!(unit.set, own(7));
}

#[test]
fn lost_letters_are_sent_again() {
    for lost in [1, 9, 700, 16 * WORDS, 16 * WORDS + 2] {
        let mut unit = Unit::new();
        unit.lost = vec![lost];
        send(&mut unit, &own(0).encode()).expect("used");
        assert_eq!(unit.set, own(0), "letter {lost}");
    }
}

#[test]
fn a_line_read_back_garbled_is_asked_for_again() {
    let mut unit = Unit::new();
    unit.garbled = Some(3_000);
    send(&mut unit, &own(0).encode()).expect("used");
}

#[test]
fn the_unit_keeps_its_set_when_it_refuses_or_flies() {
    let mut unit = Unit::new();
    unit.set = own(5);
    let error = send(&mut unit, &own(9).encode()).expect_err("another unit's");
    assert_eq!(error.to_string(), "the unit says: G_CL no: of unit 9, this is unit 5");
    assert_eq!(unit.set, own(5));
    let mut flying = Unit::new();
    flying.state.lift_off(true);
    assert_eq!(flying.state.mode, Mode::Flight);
    let error = send(&mut flying, &own(0).encode()).expect_err("in flight");
    assert!(error.to_string().contains("only in WAIT"), "{error}");
    assert_eq!(flying.set, Set::nominal(ranges()));
}

#[test]
fn silence_and_a_set_that_is_not_used_are_said() {
    let mut dead = io::Cursor::new(Vec::new());
    let error = send(&mut dead, &own(0).encode()).expect_err("silent");
    assert!(matches!(error, SendError::Silent("G_CL")), "{error}");
    // One that says yes and means no.
    struct Liar(Unit);
    impl Write for Liar {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if bytes == b"G_CL" {
                self.0.say("G_CL ok: set 3 of unit 0");
                return Ok(4);
            }
            self.0.write(bytes)
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    impl Read for Liar {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            self.0.read(bytes)
        }
    }
    let error = send(&mut Liar(Unit::new()), &own(0).encode()).expect_err("differs");
    // Byte 12 is where the number of the set begins, 3 for 0.
    assert!(matches!(error, SendError::Differs(12)), "{error}");
}
