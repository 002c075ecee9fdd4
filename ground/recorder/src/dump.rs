//! `ground dump`: the recorder, pulled over the umbilical.
//!
//! In: the line, and the file of an earlier, interrupted dump if there is one. Out: that file: every whole frame as it
//! came, with its packet, so that `ground decode` reads its packets and `ground recover` its records. Pages that came
//! damaged or not at all are asked for again. Whatever happens to the line or to this program, what is in the file stays,
//! and the next run goes on from there.

use std::{
    collections::BTreeSet,
    fs::OpenOptions,
    io::{self, Read, Write},
    path::PathBuf,
    time::Duration,
};

use emems::{
    flight_log::{dump, record},
    mode::Cause,
};
use indicatif::{ProgressBar, ProgressStyle};

use crate::log::{self, Log, frames};

/// Seconds of silence after which the line is given up.
const SILENT_S: u32 = 10;
/// How often a page that does not come is asked for.
const ROUNDS: usize = 5;
/// Bytes that wait to be a frame: a packet, the longest frame, and some talk.
const WINDOW: usize = 4096;

/// Pulls the recorder's content over the umbilical into a file
///
/// Interrupted, it goes on where it was when called again with the same file. Damaged pages are asked for again. At the end
/// it says which launch rail and site the latest boot took.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:\n  ground dump /dev/ttyUSB0 flight.dump\n  ground recover flight.dump > flight.csv")]
pub struct DumpArguments {
    /// Serial port
    pub port: String,
    /// Where to keep what comes; an earlier dump of the same log is completed
    pub file: PathBuf,
    /// First page
    #[arg(long, default_value_t = 0)]
    pub first: u32,
    /// How many pages; all that are used if it is not given
    #[arg(long)]
    pub count: Option<u32>,
}

/// Why a dump was not completed.
#[derive(Debug, thiserror::Error)]
pub enum DumpError {
    /// The port cannot be opened.
    #[error("{port}: {source}")]
    Port {
        /// Which.
        port: String,
        /// Why.
        source: serialport::Error,
    },
    /// The line or the file fails.
    #[error("{0}: run it again to go on")]
    Line(#[from] io::Error),
    /// Nothing comes.
    #[error("the unit has been silent for {SILENT_S} s: is it in WAIT? Run it again to go on")]
    Silent,
    /// The unit refuses.
    #[error("the unit says: {0}")]
    Refused(String),
}

/// Runs `ground dump`.
///
/// # Errors
/// When the port, the line or the file fails, or the unit refuses; what came before is kept.
pub fn run(arguments: &DumpArguments) -> Result<(), DumpError> {
    let port = serialport::new(&arguments.port, 115_200).timeout(Duration::from_secs(1));
    let mut line = port.open().map_err(|source| DumpError::Port {
        port: arguments.port.clone(),
        source,
    })?;
    let mut file = OpenOptions::new()
        .read(true)
        .append(true)
        .create(true)
        .open(&arguments.file)?;
    let mut before = Vec::new();
    file.read_to_end(&mut before)?;
    let bar = ProgressBar::new(0);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos} of {len} pages, {eta} left") {
        bar.set_style(style);
    }
    let range = arguments.first
        ..arguments
            .count
            .map_or(u32::MAX, |count| arguments.first.saturating_add(count));
    let pulled = pull(&mut line, &before, &mut file, range, |at, of| {
        bar.set_length(of.into());
        bar.set_position(at.into());
    })?;
    bar.finish_and_clear();
    println!(
        "{} pages, {} with records, {} of them from before; {} empty or unreadable on the chip",
        pulled.pages, pulled.with_records, pulled.from_before, pulled.without
    );
    // What was just written; one that cannot be read again is whole all the same.
    if let Ok(log) = std::fs::read(&arguments.file)
        .map_err(drop)
        .and_then(|bytes| log::read(&bytes).map_err(drop))
    {
        print!("{}", taken(&log));
    }
    Ok(())
}

/// Which launch rail and site the latest boot took at last, a line each, as far as the records that were pulled say.
fn taken(log: &Log) -> String {
    let Some(boot) = log.latest_boot() else {
        return String::new();
    };
    let (mut rail, mut site) = (None, None);
    for change in log.changes_of(boot) {
        match change.cause {
            Cause::RailTaken(taken) => rail = Some(taken.to_string()),
            Cause::SiteTaken(taken) => site = Some(taken.to_string()),
            _ => {}
        }
    }
    let none = || {
        format!(
            "none taken by boot {}, the latest, as far as these pages say",
            boot.number
        )
    };
    let [rail, site] = [rail, site].map(|taken| taken.unwrap_or_else(none));
    format!("launch rail: {rail}\nlaunch site: {site}\n")
}

/// What a dump came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pulled {
    /// Pages asked for.
    pub pages: u32,
    /// Pages of which a whole record is in the file.
    pub with_records: u32,
    /// Of those, how many were in it already.
    pub from_before: u32,
    /// Pages that gave none however often they were asked for: blank, repeated or torn.
    pub without: u32,
}

/// Pulls `range` of the log's pages; `before` is what an earlier run kept, `file` takes the rest.
///
/// # Errors
/// As [`run`].
pub fn pull<L: Read + Write>(
    line: &mut L,
    before: &[u8],
    file: &mut dyn Write,
    range: std::ops::Range<u32>,
    mut progress: impl FnMut(u32, u32),
) -> Result<Pulled, DumpError> {
    let mut session = Session {
        line,
        window: Vec::new(),
    };
    let mut have: BTreeSet<u32> = frames(before).map(|(page, _)| page).collect();
    let from_before = have.range(range.clone()).count() as u32;
    let used = session.pages_used()?;
    let end = range.end.min(used);
    for _ in 0..ROUNDS {
        let missing = stretches(&have, range.start..end);
        if missing.is_empty() {
            break;
        }
        for stretch in missing {
            session.ask(&format!("G_LR{:06X}{:06X}", stretch.start, stretch.end - stretch.start))?;
            session.listen("dump ends", |page, bytes| {
                if have.insert(page) || bytes.len() > WINDOW {
                    progress(page.saturating_sub(range.start), end - range.start);
                }
                file.write_all(bytes)?;
                file.flush()
            })?;
        }
    }
    let with_records = have.range(range.start..end.max(range.start)).count() as u32;
    let pages = end.saturating_sub(range.start);
    Ok(Pulled {
        pages,
        with_records,
        from_before: from_before.min(with_records),
        without: pages - with_records,
    })
}

/// Stretches of pages that are not there.
fn stretches(have: &BTreeSet<u32>, range: std::ops::Range<u32>) -> Vec<std::ops::Range<u32>> {
    let mut stretches = Vec::new();
    let mut from = range.start;
    for page in have.range(range.clone()).copied().chain([range.end]) {
        if page > from {
            stretches.push(from..page);
        }
        from = page + 1;
    }
    stretches
}

struct Session<'a, L> {
    line: &'a mut L,
    window: Vec<u8>,
}

impl<L: Read + Write> Session<'_, L> {
    fn ask(&mut self, words: &str) -> io::Result<()> {
        self.line.write_all(words.as_bytes())?;
        self.line.flush()
    }

    /// How many pages the unit says are used.
    fn pages_used(&mut self) -> Result<u32, DumpError> {
        self.ask("G_ST")?;
        let reply = self.listen("G_ST recorder ", |_, _| Ok(()))?;
        let number = reply.split_whitespace().nth(2).and_then(|number| number.parse().ok());
        number.ok_or(DumpError::Refused(reply))
    }

    /// Takes frames until a reply begins with `until`; that reply.
    fn listen(&mut self, until: &str, mut take: impl FnMut(u32, &[u8]) -> io::Result<()>) -> Result<String, DumpError> {
        let mut silent_s = 0;
        let mut piece = [0; 1024];
        loop {
            while let Some(end) = self.window.iter().position(|byte| *byte == b'\n') {
                let through: Vec<u8> = self.window.drain(..=end).collect();
                if let Some((page, record)) = frames(&through).next() {
                    let mut bytes = record::packet(&record)
                        .map(|packet| packet.to_vec())
                        .unwrap_or_default();
                    bytes.extend(dump::encode(page, &record));
                    take(page, &bytes)?;
                } else if let Some(start) = through.iter().position(|byte| *byte == b'>') {
                    let reply = String::from_utf8_lossy(&through[start + 1..]).trim_end().to_owned();
                    if reply.starts_with(until) {
                        return Ok(reply);
                    }
                    if reply.starts_with("G_LR no") {
                        return Err(DumpError::Refused(reply));
                    }
                }
            }
            // Without a line end for so long it is no frame.
            let surplus = self.window.len().saturating_sub(WINDOW);
            self.window.drain(..surplus);
            match self.line.read(&mut piece) {
                Ok(0) => silent_s += 1,
                Ok(count) => {
                    silent_s = 0;
                    self.window.extend_from_slice(&piece[..count]);
                }
                Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock) => {
                    silent_s += 1
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
            if silent_s >= SILENT_S {
                return Err(DumpError::Silent);
            }
        }
    }
}

#[cfg(test)]
mod tests;
