//! A unit on a port, in the hands of a person: what the procedure asks for is printed, and seen in the data.
//!
//! In: a line. Out: the evidence, and the bytes. Ctrl-C ends it, and what was heard is judged.

use std::{io, time::Duration};

use flight::interrupt::Interrupt;

use super::{
    heard,
    pose::{POSES, TURNS},
    procedure::{Ask, Patience, Procedure},
    rig::Run,
};
use crate::console::{
    line::{Heard, Line},
    stream::Stream,
};

/// Longest wait for the line.
const WAIT: Duration = Duration::from_millis(20);

/// Runs the test.
///
/// # Errors
/// When the terminal cannot be written.
pub fn run(line: &mut impl Line, interrupt: &Interrupt, out: &mut impl io::Write) -> io::Result<Run> {
    let mut procedure = Procedure::new(Patience::PERSON);
    let mut stream = Stream::default();
    let mut bytes = Vec::new();
    let mut over = false;
    while !over && !interrupt.is_raised() {
        match line.hear(WAIT) {
            Heard::Bytes { at, bytes: piece } => {
                bytes.extend(&piece);
                for found in stream.read(&piece) {
                    procedure.heard(at.as_secs_f64(), heard(found.item));
                }
            }
            Heard::Unplugged(why) => {
                stream.cut();
                writeln!(out, "unplugged: {why}")?;
            }
            Heard::Ended => over = true,
            Heard::Silence | Heard::Plugged => {}
        }
        for ask in procedure.tick(line.now().as_secs_f64()) {
            let (done, all) = procedure.progress();
            let mut ask_for = |text: &str| writeln!(out, "[{:2} of {all}] {text}", done + 1);
            match ask {
                // A word that cannot be said is said again, and missed at last.
                Ask::Say(words) => drop(line.say(words.as_bytes())),
                Ask::Pose(pose) => ask_for(POSES[pose].ask)?,
                Ask::Turn(turn) => ask_for(TURNS[turn].ask)?,
                Ask::LiftOff(true) => ask_for("close the lift-off line to ground (PC6)")?,
                Ask::LiftOff(false) => ask_for("open the lift-off line again")?,
                Ask::Tell(text) => ask_for(&text)?,
                Ask::Done => over = true,
            }
        }
    }
    Ok(Run {
        evidence: procedure.finish(),
        bytes,
    })
}
