//! What the console knows: the unit as last heard, and everything said on the line.
//!
//! In: what was [`Found`] in the stream and when, words sent, the line going and coming. Out: a [`Model`] that a view
//! shows as it stands. It reads no clock and does no I/O.
//!
//! The unit's mode is what the unit last said, in a reply or a derived frame, never what was asked of it.

use std::{collections::VecDeque, time::Duration};

use emems::{
    command::{COMMANDS, Command},
    estimate::Estimate,
    mode::Mode,
    sample::Reading,
};

use super::{
    history::History,
    stream::{Found, Item},
};
use packets::{
    channel,
    stream::sequence::{Sequence, Step},
};

/// Lines of the log kept.
const LOG_LINES: usize = 2000;

/// Unreadable bytes shown in the log at most.
const SHOWN_BYTES: usize = 24;

/// Silence after which packets have stopped: one cycle at 1 Hz and some.
const STOPPED_AFTER: Duration = Duration::from_millis(1500);

/// Whether the unit is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Link {
    /// Nobody knows yet.
    Unknown,
    /// It is.
    Plugged,
    /// It is not: why.
    Unplugged(String),
    /// Its run is over.
    Ended,
}

/// Who a line of the log comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The unit's reply.
    Unit,
    /// A word that was sent.
    Sent,
    /// The console itself.
    Console,
    /// The line: bytes that are unreadable.
    Unread,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLine {
    /// On the line's clock.
    pub at: Duration,
    /// Who says it.
    pub source: Source,
    /// What.
    pub text: String,
}

/// Packets, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Whole packets.
    pub packets: u64,
    /// Packets missing between them by their counters.
    pub missed: u64,
    /// Damaged places in the stream.
    pub unread: u64,
    /// Whole derived frames.
    pub derived: u64,
}

/// What the console knows.
pub struct Model {
    /// Name of the line.
    pub line: String,
    /// The line's time.
    pub now: Duration,
    /// Whether the unit is there.
    pub link: Link,
    /// Mode as last reported.
    pub mode: Option<Mode>,
    /// Newest reading.
    pub reading: Option<Reading>,
    /// What the newest derived frame says of the attitude.
    pub estimate: Option<Estimate>,
    /// Readings for plots.
    pub history: History,
    /// Counted packets.
    pub tally: Tally,
    /// Replies, words sent and events, oldest first.
    pub log: VecDeque<LogLine>,
    /// Where the received bytes are kept, how many, and why some are not.
    pub recording: String,
    /// Bytes in the recording.
    pub recorded_bytes: u64,
    /// Why the recording has a hole.
    pub recording_failure: Option<String>,
    sequence: Sequence,
}

impl Model {
    /// Nothing heard yet on `line`.
    pub fn new(line: &str, recording: &str) -> Self {
        Model {
            line: line.to_owned(),
            now: Duration::ZERO,
            link: Link::Unknown,
            mode: None,
            reading: None,
            estimate: None,
            history: History::default(),
            tally: Tally::default(),
            log: VecDeque::new(),
            recording: recording.to_owned(),
            recorded_bytes: 0,
            recording_failure: None,
            sequence: Sequence::default(),
        }
    }

    /// Takes something found in the stream.
    pub fn found(&mut self, at: Duration, found: Found) {
        match found.item {
            Item::Packet(reading) => self.packet(at, *reading),
            Item::Reply(text) => {
                self.mode = mode_reported(&text).or(self.mode);
                self.say(at, Source::Unit, text);
            }
            Item::Derived(derived) => {
                self.tally.derived += 1;
                self.mode = Some(derived.mode);
                self.estimate = Some(derived.estimate);
            }
            Item::Unread { bytes, why } => {
                self.tally.unread += 1;
                let shown = bytes.get(..SHOWN_BYTES).unwrap_or(&bytes).escape_ascii();
                let text = format!("{} unreadable bytes at {}: {why}: {shown}", bytes.len(), found.at);
                self.say(at, Source::Unread, text);
            }
        }
    }

    /// Takes a line for the log. Of damaged places in a row only the newest stays, so that noise hides no reply; the
    /// tally counts them all.
    pub fn say(&mut self, at: Duration, source: Source, text: String) {
        let noise = |line: &mut LogLine| source == Source::Unread && line.source == Source::Unread;
        self.log.pop_back_if(noise);
        self.log.push_back(LogLine { at, source, text });
        if self.log.len() > LOG_LINES {
            self.log.pop_front();
        }
    }

    /// Takes a word that was sent. Words that stop or start the packets on the umbilical make the next packet a first
    /// one: what the unit did not send was not missed.
    pub fn sent(&mut self, at: Duration, word: &str) {
        if COMMANDS
            .iter()
            .any(|entry| starts_or_stops(entry.command) && contains(word, entry.word))
        {
            self.sequence = Sequence::default();
        }
        self.say(at, Source::Sent, word.to_owned());
    }

    /// Packets come.
    pub fn receiving(&self) -> bool {
        let newest = self.history.newest();
        newest.is_some_and(|(at, _)| self.now.saturating_sub(*at) < STOPPED_AFTER)
    }

    fn packet(&mut self, at: Duration, reading: Reading) {
        self.tally.packets += 1;
        match self.sequence.number(reading.counter).1 {
            Step::Missed(count) => self.tally.missed += u64::from(count),
            Step::Jumped => {
                let text = format!(
                    "packet counter jumped to {:04X}: the unit was restarted?",
                    reading.counter
                );
                self.say(at, Source::Console, text);
            }
            Step::First | Step::Next | Step::Repeated => {}
        }
        self.history.push(at, channel::counts(&reading));
        self.reading = Some(reading);
    }
}

/// Whether a command may start or stop the packets on the umbilical.
fn starts_or_stops(command: Command) -> bool {
    use Command::*;
    match command {
        Flight | Wait | SendPackets | ConfirmErase | Dump | DumpRange { .. } | Stop => true,
        Erase
        | Record
        | Status
        | Version
        | Alignment
        | LeaveSafeMode
        | Help
        | DerivedOn
        | DerivedOff
        | SelfTest
        | SetWord { .. }
        | LoadSet
        | ForgetSet
        | ConfirmSet
        | Rail(_)
        | Site(_)
        | ReadSet => false,
    }
}

fn contains(text: &str, word: &[u8]) -> bool {
    text.as_bytes().windows(word.len()).any(|letters| letters == word)
}

/// The mode a reply reports: "mode FLIGHT: lift-off", "G_MV ok: FLIGHT", "G_ST WAIT task none ...", "lift-off: FLIGHT, ...".
/// Refusals ("G_MA no: only in WAIT") and the unit's help ("G_MT WAIT: ...") name modes too, and report none.
fn mode_reported(reply: &str) -> Option<Mode> {
    let mut words = reply.split(' ');
    let name = match (words.next()?, words.next()?) {
        ("G_ST", name) => name,
        ("lift-off:", name) => name.trim_end_matches(','),
        ("mode", name) => name.trim_end_matches(':'),
        (_, "ok:") => words.next()?,
        _ => return None,
    };
    [Mode::Wait, Mode::Flight].into_iter().find(|mode| mode.name() == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::console::stream::Why;

    const AT: Duration = Duration::from_secs(1);

    fn item(item: Item) -> Found {
        Found { at: 0, item }
    }

    fn packet(counter: u16) -> Found {
        item(Item::Packet(Box::new(Reading::unread(counter))))
    }

    fn reply(text: &str) -> Found {
        item(Item::Reply(text.into()))
    }

    fn model() -> Model {
        Model::new("pad", "pad.log")
    }

    #[test]
    fn the_mode_is_what_the_unit_said_last() {
        let mut model = model();
        model.sent(AT, "G_MV");
        let mut check = |text: &str, mode| {
            model.found(AT, reply(text));
            assert_eq!(model.mode, mode, "{text}");
        };
        check("G_MV: send G_MV within 10 s", None);
        check("G_MV ok: FLIGHT", Some(Mode::Flight));
        check("G_MA no: only in WAIT", Some(Mode::Flight));
        check("G_MT WAIT: packets to the umbilical", Some(Mode::Flight));
        check("G_ST WAIT task none recording 0 derived 0", Some(Mode::Wait));
        check("G_ST lift-off 0 micro-g 0 errors 0000 noise 0", Some(Mode::Wait));
        check("lift-off: FLIGHT, recording", Some(Mode::Flight));
        check("", Some(Mode::Flight));
    }

    #[test]
    fn packets_lost_on_the_line_are_missed_and_those_not_asked_for_are_not() {
        let mut model = model();
        for counter in [0xFFFE, 0xFFFF, 0, 3] {
            model.found(AT, packet(counter));
        }
        assert_eq!((model.tally.packets, model.tally.missed), (4, 2));
        model.sent(AT, "G_Mt");
        model.sent(AT, "G_MT");
        model.found(AT, packet(500));
        model.sent(AT, "G_ST");
        model.found(AT, packet(502));
        assert_eq!((model.tally.packets, model.tally.missed), (6, 3));
    }

    #[test]
    fn a_counter_that_starts_over_is_told_and_not_counted_as_missed() {
        let mut model = model();
        model.found(AT, packet(40_000));
        model.found(AT, packet(0));
        assert_eq!(model.tally.missed, 0);
        assert_eq!(
            model.log[0].text,
            "packet counter jumped to 0000: the unit was restarted?"
        );
    }

    #[test]
    fn unreadable_bytes_are_counted_and_shown_harmless() {
        let mut model = model();
        let unread = Item::Unread {
            bytes: b"\x1b[2J".to_vec(),
            why: Why::NoStart,
        };
        model.found(AT, Found { at: 156, item: unread });
        assert_eq!(model.tally.unread, 1);
        let text = "4 unreadable bytes at 156: begins with none of '@', '>', '$': \\x1b[2J";
        assert_eq!(model.log[0].text, text);
    }

    #[test]
    fn noise_hides_no_reply() {
        let mut model = model();
        model.found(AT, reply("G_ST"));
        for _ in 0..LOG_LINES {
            let why = Why::NoStart;
            model.found(AT, item(Item::Unread { bytes: vec![0xFF], why }));
        }
        let sources: Vec<_> = model.log.iter().map(|line| line.source).collect();
        assert_eq!(sources, [Source::Unit, Source::Unread]);
        assert_eq!(model.tally.unread, LOG_LINES as u64);
    }

    #[test]
    fn packets_have_stopped_after_a_second_and_a_half() {
        let mut model = model();
        assert!(!model.receiving());
        model.found(AT, packet(0));
        model.now = AT + Duration::from_millis(1400);
        assert!(model.receiving());
        model.now = AT + STOPPED_AFTER;
        assert!(!model.receiving());
    }

    #[test]
    fn the_log_is_bounded() {
        let mut model = model();
        for _ in 0..LOG_LINES + 5 {
            model.found(AT, reply("x"));
        }
        assert_eq!(model.log.len(), LOG_LINES);
    }
}
