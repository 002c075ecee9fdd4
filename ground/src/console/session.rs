//! A line, its recording and what is known from it: record first, show second.
//!
//! In: a [`Line`] and the words the user typed. Out: an up-to-date [`Model`]. Every received byte is in the recording
//! before it is parsed; a recording that fails is told of and does not stop the console, since the unit is still there.

use std::{io, time::Duration};

use super::{
    line::{Heard, Line},
    model::{Link, Model, Source},
    recording::Recording,
    stream::Stream,
    word::{self, Typed},
};

/// A console session without its screen.
pub struct Session<L> {
    /// What is known.
    pub model: Model,
    line: L,
    recording: Recording,
    stream: Stream,
}

impl<L: Line> Session<L> {
    /// A session on `line`, kept in `recording`.
    pub fn new(line: L, recording: Recording) -> Self {
        let mut model = Model::new(line.name(), &recording.path().to_string_lossy());
        model.recorded_bytes = recording.len_bytes();
        Session {
            model,
            line,
            recording,
            stream: Stream::default(),
        }
    }

    /// Waits at most about `wait` for the line, and takes in what it tells.
    pub fn hear(&mut self, wait: Duration) {
        let heard = self.line.hear(wait);
        let now = self.line.now();
        self.model.now = now;
        match heard {
            Heard::Silence => {}
            Heard::Bytes { at, bytes } => {
                let kept = self.recording.keep(&bytes);
                self.recorded(kept, "received bytes");
                for found in self.stream.read(&bytes) {
                    self.model.found(at, found);
                }
            }
            Heard::Plugged => self.linked(now, Link::Plugged, "plugged".into()),
            Heard::Unplugged(why) => {
                let text = format!("unplugged: {why}");
                self.linked(now, Link::Unplugged(why), text);
            }
            Heard::Ended if self.model.link == Link::Ended => {}
            Heard::Ended => self.linked(now, Link::Ended, "the run has ended".into()),
        }
    }

    /// Takes a typed line: sends it, or answers it here. Whether the user wants to end.
    pub fn typed(&mut self, line: &str) -> bool {
        match word::typed(line) {
            Typed::Send(words) => self.send(&words),
            Typed::Quit => return true,
            Typed::Answer(lines) => {
                let now = self.line.now();
                self.note(now, &format!("answered here {line}"));
                for text in lines {
                    self.model.say(now, Source::Console, text);
                }
            }
        }
        false
    }

    /// Sends a word as typed, with a line end: the unit passes over it, and it ends a half word at once.
    pub fn send(&mut self, word: &str) {
        let now = self.line.now();
        match self.line.say(format!("{word}\r\n").as_bytes()) {
            Ok(()) => {
                self.note(now, &format!("sent {word}"));
                self.model.sent(now, word);
            }
            Err(error) => {
                self.note(now, &format!("not sent {word}: {error}"));
                self.model
                    .say(now, Source::Console, format!("{word} was not sent: {error}"));
            }
        }
    }

    fn linked(&mut self, now: Duration, link: Link, text: String) {
        if let Some(found) = self.stream.cut() {
            self.model.found(now, found);
        }
        self.note(now, &text);
        self.model.link = link;
        self.model.say(now, Source::Console, text);
    }

    fn note(&mut self, now: Duration, text: &str) {
        let kept = self.recording.note(now, text);
        self.recorded(kept, "a note");
    }

    fn recorded(&mut self, kept: io::Result<()>, what: &str) {
        self.model.recorded_bytes = self.recording.len_bytes();
        if let Err(error) = kept {
            let text = format!("RECORDING FAILED, {what} not kept: {error}");
            if self.model.recording_failure.as_ref() != Some(&text) {
                self.model.say(self.model.now, Source::Console, text.clone());
            }
            self.model.recording_failure = Some(text);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, path::PathBuf, time::SystemTime};

    use emems::{mode::Mode, packet::encode, sample::Reading};

    use super::*;
    use crate::console::{
        line::{ChannelLine, UnitEnd, channel},
        recording::commands_path,
    };

    struct Bench {
        session: Session<ChannelLine>,
        unit: UnitEnd,
        path: PathBuf,
        _folder: tempfile::TempDir,
    }

    fn bench() -> Bench {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pad.log");
        let (line, unit) = channel("flying");
        let recording = Recording::open(&path, line.name(), SystemTime::UNIX_EPOCH).unwrap();
        Bench {
            session: Session::new(line, recording),
            unit,
            path,
            _folder: folder,
        }
    }

    impl Bench {
        fn says(&mut self, at_ms: u64, bytes: &[u8]) {
            self.unit.send(Duration::from_millis(at_ms), bytes).unwrap();
            self.session.hear(Duration::ZERO);
        }

        fn log(&self) -> Vec<&str> {
            self.session.model.log.iter().map(|line| line.text.as_str()).collect()
        }
    }

    #[test]
    fn a_command_reaches_the_unit_and_its_reply_the_log() {
        let mut bench = bench();
        bench.session.send("G_ST");
        assert_eq!(bench.unit.commands(), b"G_ST\r\n");
        bench.says(10, b">G_MT ok: WA");
        bench.says(20, b"IT\r\n");
        assert_eq!(bench.log(), ["G_ST", "G_MT ok: WAIT"]);
        assert_eq!(bench.session.model.mode, Some(Mode::Wait));
    }

    #[test]
    fn what_the_unit_would_not_answer_is_answered_here_and_not_sent() {
        let mut bench = bench();
        assert!(!bench.session.typed("g_st") && bench.session.typed("quit"));
        assert_eq!(bench.unit.commands(), b"");
        assert!(bench.log()[0].contains("case counts, the unit knows G_ST"));
        assert!(!bench.session.typed("G_ST"));
        assert_eq!(bench.unit.commands(), b"G_ST\r\n");
    }

    #[test]
    fn everything_heard_is_in_the_file_also_what_cannot_be_read() {
        let mut bench = bench();
        bench.says(200, b"\xFF\x00noise\n@00");
        assert_eq!(fs::read(&bench.path).unwrap(), b"\xFF\x00noise\n@00");
        assert_eq!(bench.session.model.recorded_bytes, 11);
    }

    #[test]
    fn the_console_goes_on_in_the_same_recording_after_a_replug() {
        let mut bench = bench();
        let packets: Vec<_> = (0..4).map(|counter| encode(&Reading::unread(counter))).collect();
        bench.says(200, &packets[0]);
        bench.says(400, &packets[1][..80]);
        bench.unit.unplug(Duration::from_millis(500), "pulled").unwrap();
        bench.session.hear(Duration::ZERO);
        assert_eq!(bench.session.model.link, Link::Unplugged("pulled".into()));
        bench.session.send("G_MV");
        assert_eq!(bench.unit.commands(), b"", "nothing is kept to act later");
        bench.unit.plug(Duration::from_millis(700)).unwrap();
        bench.session.hear(Duration::ZERO);
        // Plugged in within a packet, so that two halves would make a whole one.
        bench.says(800, &packets[2][80..]);
        bench.says(1000, &packets[3]);

        let tally = bench.session.model.tally;
        assert_eq!((tally.packets, tally.missed, tally.unread), (2, 2, 2));
        let kept = [&packets[0][..], &packets[1][..80], &packets[2][80..], &packets[3]].concat();
        assert_eq!(fs::read(&bench.path).unwrap(), kept);
        let notes = fs::read_to_string(commands_path(&bench.path)).unwrap();
        let notes: Vec<_> = notes.lines().skip(1).map(str::trim_start).collect();
        assert_eq!(
            notes,
            [
                "0.500000        236 unplugged: pulled",
                "0.500000        236 not sent G_MV: unplugged",
                "0.700000        236 plugged",
            ]
        );
    }

    #[test]
    fn the_end_of_a_run_is_told_once_and_what_was_heard_stays() {
        let Bench {
            mut session,
            unit,
            _folder,
            ..
        } = bench();
        unit.send(Duration::from_millis(200), &encode(&Reading::unread(7)))
            .unwrap();
        drop(unit);
        for _ in 0..3 {
            session.hear(Duration::ZERO);
        }
        assert_eq!(session.model.link, Link::Ended);
        assert_eq!(session.model.log.len(), 1);
        assert_eq!(session.model.reading, Some(Reading::unread(7)));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_told_of_and_the_unit_is_still_shown() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pad.log");
        std::os::unix::fs::symlink("/dev/full", &path).unwrap();
        let (line, unit) = channel("flying");
        let recording = Recording::open(&path, line.name(), SystemTime::UNIX_EPOCH).unwrap();
        let mut session = Session::new(line, recording);
        unit.send(Duration::ZERO, &encode(&Reading::unread(7))).unwrap();
        session.hear(Duration::ZERO);
        let failure = session.model.recording_failure.unwrap();
        assert!(
            failure.starts_with("RECORDING FAILED, received bytes not kept: "),
            "{failure}"
        );
        assert_eq!(session.model.reading, Some(Reading::unread(7)));
    }
}
