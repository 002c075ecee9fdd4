//! Whoever watches a flight: keeps every byte, decodes the telemetry as it comes, passes the umbilical on.
//!
//! In: what both lines and the log say. Out: the folder, the figures, and commands to the unit. A folder that cannot be
//! written stops the flight, and so do an interrupt and a console that was closed.

use std::time::Duration;

use logs::{
    digest::{Digest, StreamEntry},
    folder::{Folder, FolderError},
    record::Record,
};
use twin::{
    part::Nanos,
    run::{Bench, Flow},
};

use crate::{interrupt::Interrupt, progress::Progress};

/// \[ns\] when the words before a flight are said: the unit has long booted.
const ASK_AT: Nanos = 300_000_000;

/// Whoever sits at the umbilical of a flying unit.
pub trait Umbilical: Send {
    /// Takes what the unit said, or nothing but the time; whether anybody still listens.
    fn hears(&self, at: Duration, bytes: &[u8]) -> bool;

    /// What was said to the unit since the last call; never waits.
    fn commands(&self) -> Vec<u8>;
}

/// What is left of a watched flight.
pub struct Seen {
    /// The folder, still open.
    pub folder: Folder,
    /// What a page says of it.
    pub record: Record,
    /// Virtual time flown.
    pub flown: Duration,
    /// Wall time it took.
    pub took: Duration,
}

/// Watches one flight.
pub struct Watch {
    folder: Folder,
    digest: Digest,
    progress: Progress,
    console: Option<Box<dyn Umbilical>>,
    words: Vec<u8>,
    interrupt: Interrupt,
    packets: u64,
    flown: Nanos,
    failed: Option<FolderError>,
    closed: bool,
}

impl Watch {
    /// Before take-off, with what is said to the unit once it listens. With a console, the umbilical is the console's to keep.
    pub fn new(
        folder: Folder,
        digest: Digest,
        progress: Progress,
        console: Option<Box<dyn Umbilical>>,
        words: Vec<u8>,
        interrupt: Interrupt,
    ) -> Self {
        Watch {
            folder,
            digest,
            progress,
            console,
            words,
            interrupt,
            packets: 0,
            flown: 0,
            failed: None,
            closed: false,
        }
    }

    /// After landing.
    ///
    /// # Errors
    /// When the folder could not be written at some time.
    pub fn finish(self) -> Result<Seen, FolderError> {
        let took = self.progress.finish();
        if let Some(error) = self.failed {
            return Err(error);
        }
        let mut folder = self.folder;
        let (rest, record) = self.digest.finish();
        folder.entries(&rest)?;
        Ok(Seen {
            folder,
            record,
            flown: Duration::from_nanos(self.flown),
            took,
        })
    }

    fn keep(&mut self, kept: Result<(), FolderError>) {
        if let Err(error) = kept {
            self.failed.get_or_insert(error);
        }
    }

    fn tell_console(&mut self, at: Nanos, bytes: &[u8]) {
        if let Some(console) = &self.console {
            self.closed |= !console.hears(Duration::from_nanos(at), bytes);
        }
    }
}

impl Bench for Watch {
    fn telemetry(&mut self, at: Nanos, bytes: &[u8]) {
        let entries = self.digest.push(Some(1e-9 * at as f64), bytes);
        let packets = entries
            .iter()
            .filter(|entry| matches!(entry, StreamEntry::Packet { .. }));
        self.packets += packets.count() as u64;
        let kept = self
            .folder
            .telemetry(bytes)
            .and_then(|()| self.folder.entries(&entries));
        self.keep(kept);
    }

    fn umbilical(&mut self, at: Nanos, bytes: &[u8]) {
        if self.console.is_some() {
            self.tell_console(at, bytes);
        } else {
            let kept = self.folder.umbilical(bytes);
            self.keep(kept);
        }
    }

    fn log(&mut self, at: Nanos, line: &str) {
        let kept = self.folder.log(1e-9 * at as f64, line);
        self.keep(kept);
    }

    fn commands(&mut self, now: Nanos) -> Vec<u8> {
        let mut commands = Vec::new();
        if now >= ASK_AT {
            commands.append(&mut self.words);
        }
        if let Some(console) = &self.console {
            commands.extend(console.commands());
        }
        commands
    }

    fn advanced(&mut self, now: Nanos) -> Flow {
        self.flown = now;
        self.progress.advanced(now, self.packets);
        self.tell_console(now, &[]);
        if self.closed || self.failed.is_some() || self.interrupt.is_raised() {
            Flow::Stop
        } else {
            Flow::Continue
        }
    }
}

#[cfg(test)]
mod tests {
    use emems::{packet::encode, sample::Reading};

    use super::*;
    use packets::stream::sequence::CYCLE_S;
    use std::sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    };

    const MILLISECOND: Nanos = 1_000_000;

    fn watch(place: &std::path::Path, console: Option<Box<dyn Umbilical>>, words: &[u8]) -> Watch {
        let folder = Folder::create(place, "test-1", CYCLE_S).expect("folder");
        let progress = Progress::start(Duration::from_secs(60), false, true);
        Watch::new(
            folder,
            Digest::default(),
            progress,
            console,
            words.to_vec(),
            Interrupt::default(),
        )
    }

    /// Says one word again and again.
    #[derive(Clone, Default)]
    struct Console {
        heard: Arc<Mutex<Vec<u8>>>,
        closed: Arc<AtomicBool>,
    }

    impl Umbilical for Console {
        fn hears(&self, _: Duration, bytes: &[u8]) -> bool {
            self.heard.lock().expect("heard").extend(bytes);
            !self.closed.load(Ordering::Relaxed)
        }

        fn commands(&self) -> Vec<u8> {
            b"G_ST".to_vec()
        }
    }

    #[test]
    fn packets_are_timed_by_their_last_byte() {
        let place = tempfile::tempdir().expect("temporary folder");
        let mut watch = watch(place.path(), None, b"");
        for (counter, at) in [(0, 14 * MILLISECOND), (1, 214 * MILLISECOND + 50_000)] {
            let packet = encode(&Reading::unread(counter));
            watch.telemetry(at - 1, &packet[..155]);
            watch.telemetry(at, &packet[155..]);
        }
        let seen = watch.finish().expect("seen");
        assert_eq!(seen.record.summary.period_s.count, 1);
        assert!(
            (seen.record.summary.period_s.mean - 0.200_05).abs() < 1e-12,
            "{:?}",
            seen.record.summary.period_s
        );
    }

    #[test]
    fn words_are_said_once_and_not_before_the_unit_listens() {
        let place = tempfile::tempdir().expect("temporary folder");
        let mut watch = watch(place.path(), None, b"G_DL");
        assert_eq!(watch.commands(MILLISECOND), b"");
        assert_eq!(watch.commands(ASK_AT), b"G_DL");
        assert_eq!(watch.commands(ASK_AT + MILLISECOND), b"");
    }

    #[test]
    fn a_console_hears_the_umbilical_speaks_and_ends_the_flight_when_closed() {
        let place = tempfile::tempdir().expect("temporary folder");
        let console = Console::default();
        let mut watch = watch(place.path(), Some(Box::new(console.clone())), b"");
        watch.umbilical(7 * MILLISECOND, b">up\n");
        assert_eq!(*console.heard.lock().expect("heard"), b">up\n");
        assert_eq!(watch.commands(8 * MILLISECOND), b"G_ST");
        assert_eq!(watch.advanced(9 * MILLISECOND), Flow::Continue);
        console.closed.store(true, Ordering::Relaxed);
        assert_eq!(watch.advanced(10 * MILLISECOND), Flow::Stop);
    }

    #[test]
    fn a_folder_that_cannot_be_written_stops_the_flight_and_is_named() {
        let place = tempfile::tempdir().expect("temporary folder");
        let mut watch = watch(place.path(), None, b"");
        std::fs::write(watch.folder.path().join("packets.txt"), "not ours").expect("write");
        watch.telemetry(MILLISECOND, b"@");
        assert_eq!(watch.advanced(MILLISECOND), Flow::Stop);
        let error = watch.finish().err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains("packets.txt cannot be written"), "{error}");
    }
}
