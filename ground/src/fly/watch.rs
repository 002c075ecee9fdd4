//! Whoever watches a flight: keeps every byte, decodes the telemetry as it comes, passes the umbilical on.
//!
//! In: what both lines and the log say. Out: the folder, the figures, and commands to the unit. A folder that cannot be
//! written stops the flight, and so does a console that was closed.

use std::time::Duration;

use emems::command::{Command, word_of};
use twin::{
    part::Nanos,
    run::{Bench, Flow},
};

use super::progress::Progress;
use crate::{
    console::line::UnitEnd,
    digest::{Digest, Entry},
    envelope::Envelope,
    folder::{Folder, FolderError},
    summary::Summary,
};

/// [ns] when derived frames are asked for: the unit has long booted.
const ASK_AT: Nanos = 300_000_000;

/// What is left of a watched flight.
pub struct Seen {
    /// The folder, still open.
    pub folder: Folder,
    /// The figures.
    pub summary: Summary,
    /// What plots show.
    pub envelope: Envelope,
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
    console: Option<UnitEnd>,
    ask_derived: bool,
    packets: u64,
    flown: Nanos,
    failed: Option<FolderError>,
    closed: bool,
}

impl Watch {
    /// Before take-off. With a console, the umbilical is the console's to keep.
    pub fn new(folder: Folder, progress: Progress, console: Option<UnitEnd>, ask_derived: bool) -> Self {
        Watch {
            folder,
            digest: Digest::default(),
            progress,
            console,
            ask_derived,
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
        let (rest, summary, envelope) = self.digest.finish();
        folder.entries(&rest)?;
        Ok(Seen {
            folder,
            summary,
            envelope,
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
            self.closed |= console.send(Duration::from_nanos(at), bytes).is_err();
        }
    }
}

impl Bench for Watch {
    fn telemetry(&mut self, at: Nanos, bytes: &[u8]) {
        let entries = self.digest.push(Some(1e-9 * at as f64), bytes);
        let packets = entries.iter().filter(|entry| matches!(entry, Entry::Packet { .. }));
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
        if self.ask_derived && now >= ASK_AT {
            self.ask_derived = false;
            commands.extend(word_of(Command::DerivedOn));
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
        if self.closed || self.failed.is_some() {
            Flow::Stop
        } else {
            Flow::Continue
        }
    }
}
