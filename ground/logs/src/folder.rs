//! The folder a flight or a decoded log ends up in.
//!
//! In: bytes as they were, [`StreamEntry`]s, remarks, and at the end the figures. Out: packets.txt and umbilical.txt verbatim,
//! counts.csv, si.csv, derived.csv if there are derived frames, flight.mcap, log.txt, summary.txt, index.html. An existing folder is
//! never touched: a number is added to the name.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use chart::{Block, ChartError};
use packets::stream::sequence::Step;

use crate::{
    digest::StreamEntry,
    messages::Messages,
    plot::{self, Truth},
    record::Record,
    table,
};

/// Folders of one name that are tried before giving up.
const MOST_OF_A_NAME: u32 = 10_000;

/// The file of [`Messages`].
const MESSAGES: &str = "flight.mcap";

/// Files that a page leads to, where they are there, and what is in them. Not the answer to what was done to the unit.
const LINKED: [(&str, &str); 12] = [
    ("values in SI", "si.csv"),
    ("counts", "counts.csv"),
    ("derived frames", "derived.csv"),
    ("for Foxglove and PlotJuggler", MESSAGES),
    ("every column", "records.parquet"),
    ("packets as sent", "packets.txt"),
    ("umbilical", "umbilical.txt"),
    ("log", "log.txt"),
    ("summary", "summary.txt"),
    ("motion", "motion.csv"),
    ("unit", "unit.toml"),
    ("gap case", "case.toml"),
];

/// Why a folder could not be written.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It cannot be made.
    #[error("{path} cannot be created: {source}; choose another place with --out")]
    Create {
        /// Where.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Every name is taken.
    #[error(
        "{path} and {MOST_OF_A_NAME} numbered names after it exist; remove some or choose another place with --out"
    )]
    Taken {
        /// The name without a number.
        path: PathBuf,
    },
    /// A file in it cannot be written.
    #[error("{path} cannot be written: {source}; what is in the folder is what came before")]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A figure cannot be drawn.
    #[error(transparent)]
    Plot(#[from] ChartError),
}

/// Makes `parent/name`, or `parent/name-2` and so on if that exists.
///
/// # Errors
/// When it cannot be made.
pub fn make(parent: &Path, name: &str) -> Result<PathBuf, FolderError> {
    let fail = |path: &Path| {
        let path = path.to_owned();
        move |source| FolderError::Create { path, source }
    };
    fs::create_dir_all(parent).map_err(fail(parent))?;
    for number in 1..=MOST_OF_A_NAME {
        let path = parent.join(match number {
            1 => name.to_owned(),
            _ => format!("{name}-{number}"),
        });
        match fs::create_dir(&path) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|()| path.clone()).map_err(fail(&path)),
        }
    }
    Err(FolderError::Taken {
        path: parent.join(name),
    })
}

/// A folder being written.
pub struct Folder {
    path: PathBuf,
    cycle_s: f64,
    packets: Text,
    umbilical: Text,
    counts: Text,
    si: Text,
    derived: Text,
    log: Text,
    messages: Messages,
}

impl Folder {
    /// Makes `parent/name`, or `parent/name-2` and so on if that exists.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn create(parent: &Path, name: &str, cycle_s: f64) -> Result<Self, FolderError> {
        Folder::open(make(parent, name)?, cycle_s)
    }

    fn open(path: PathBuf, cycle_s: f64) -> Result<Self, FolderError> {
        let text = |name: &str, header: Option<String>| Text {
            path: path.join(name),
            header,
            file: None,
        };
        Ok(Folder {
            cycle_s,
            packets: text("packets.txt", None),
            umbilical: text("umbilical.txt", None),
            counts: text("counts.csv", Some(table::counts_header())),
            si: text("si.csv", Some(table::si_header())),
            derived: text("derived.csv", Some(table::derived_header())),
            log: text("log.txt", None),
            messages: Messages::create(&path.join(MESSAGES)).map_err(|source| failed(&path, source))?,
            path,
        })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Keeps bytes of the telemetry line.
    ///
    /// # Errors
    /// As for all below: when a file cannot be written.
    pub fn telemetry(&mut self, bytes: &[u8]) -> Result<(), FolderError> {
        self.packets.write(bytes)
    }

    /// Keeps bytes of the umbilical.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn umbilical(&mut self, bytes: &[u8]) -> Result<(), FolderError> {
        self.umbilical.write(bytes)
    }

    /// Keeps a line of the log.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn log(&mut self, at_s: f64, line: &str) -> Result<(), FolderError> {
        self.log.line(&format!("{at_s:12.6} {line}"))?;
        self.messages
            .log(at_s, line)
            .map_err(|source| failed(&self.path, source))
    }

    /// Keeps a remark on all of it.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn remark(&mut self, line: &str) -> Result<(), FolderError> {
        self.log.line(line)
    }

    /// Keeps what was found in the telemetry: rows, and remarks on what is missing or broken.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn entries(&mut self, entries: &[StreamEntry]) -> Result<(), FolderError> {
        for entry in entries {
            match entry {
                StreamEntry::Packet { number, reading, .. } => {
                    let t_s = *number as f64 * self.cycle_s;
                    self.counts.line(&table::counts_row(t_s, reading))?;
                    self.si.line(&table::si_row(t_s, reading))?;
                }
                StreamEntry::Derived(derived) => self.derived.line(&table::derived_row(derived))?,
                StreamEntry::Line { .. } | StreamEntry::Reject(_) => {}
            }
            let remark = remark(entry, self.cycle_s);
            if let Some(remark) = &remark {
                self.log.line(remark)?;
            }
            self.messages
                .entry(entry, self.cycle_s, remark.as_deref())
                .map_err(|source| failed(&self.path, source))?;
        }
        Ok(())
    }

    /// Writes page and summary, of these rows, and closes all files. In simulation the page has the error against the truth.
    ///
    /// # Errors
    /// When a file cannot be written or a figure drawn.
    pub fn finish(
        mut self,
        title: &str,
        about: &str,
        rows: &[(&'static str, String)],
        record: &Record,
        truth: Option<Truth>,
    ) -> Result<PathBuf, FolderError> {
        let named = rows
            .iter()
            .map(|(name, value)| (name.to_string(), value.clone()))
            .collect();
        let mut blocks = vec![Block::Rows(named), Block::Links(self.links())];
        blocks.extend(plot::blocks(record, self.cycle_s, truth)?);
        let html = chart::html(title, about, &blocks);
        for (name, content) in [("index.html", html), ("summary.txt", text_of(rows))] {
            let path = self.path.join(name);
            fs::write(&path, content).map_err(|source| FolderError::Write { path, source })?;
        }
        for text in [
            &mut self.packets,
            &mut self.umbilical,
            &mut self.counts,
            &mut self.si,
            &mut self.derived,
            &mut self.log,
        ] {
            text.close()?;
        }
        self.messages.finish().map_err(|source| failed(&self.path, source))?;
        Ok(self.path)
    }
}

impl Folder {
    /// Files that are there, or will be when this one is closed.
    fn links(&self) -> Vec<(String, String)> {
        let there = LINKED
            .iter()
            .filter(|(_, name)| *name == "summary.txt" || self.path.join(name).exists());
        there
            .map(|(what, name)| (format!("{what} ({name})"), name.to_string()))
            .collect()
    }
}

fn failed(folder: &Path, source: io::Error) -> FolderError {
    FolderError::Write {
        path: folder.join(MESSAGES),
        source,
    }
}

/// A summary as lines, names aligned.
pub fn text_of(rows: &[(&'static str, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0) + 2;
    rows.iter()
        .map(|(name, value)| format!("{name:width$}{value}\n"))
        .collect()
}

/// What is to be said about an entry besides its row.
pub fn remark(entry: &StreamEntry, cycle_s: f64) -> Option<String> {
    match entry {
        StreamEntry::Packet {
            number,
            step,
            offset,
            reading,
        } => {
            let what = match step {
                Step::First | Step::Next => return None,
                Step::Missed(1) => "1 packet missed before it".into(),
                Step::Missed(count) => format!("{count} packets missed before it"),
                Step::Repeated => "same counter as the packet before".into(),
                Step::Jumped => {
                    "the counter jumped: unit restarted, or streams joined; time goes on by one cycle".into()
                }
            };
            let (counter, t_s) = (reading.counter, *number as f64 * cycle_s);
            Some(format!("offset {offset}, packet {counter}, {t_s:.3} s: {what}"))
        }
        StreamEntry::Derived(_) => None,
        StreamEntry::Line { offset, text } => Some(format!("offset {offset}: the unit says: {text}")),
        StreamEntry::Reject(reject) => Some(reject.to_string()),
    }
}

/// A file that comes into being with its first byte.
struct Text {
    path: PathBuf,
    header: Option<String>,
    file: Option<BufWriter<File>>,
}

impl Text {
    fn line(&mut self, line: &str) -> Result<(), FolderError> {
        self.write(line.as_bytes())?;
        self.write(b"\n")
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), FolderError> {
        let written = match &mut self.file {
            Some(file) => file.write_all(bytes),
            None => File::create_new(&self.path).and_then(|file| {
                let mut file = BufWriter::new(file);
                if let Some(header) = &self.header {
                    writeln!(file, "{header}")?;
                }
                file.write_all(bytes)?;
                self.file = Some(file);
                Ok(())
            }),
        };
        written.map_err(|source| self.failed(source))
    }

    fn close(&mut self) -> Result<(), FolderError> {
        match self.file.take() {
            Some(mut file) => file.flush().map_err(|source| self.failed(source)),
            None => Ok(()),
        }
    }

    fn failed(&self, source: io::Error) -> FolderError {
        FolderError::Write {
            path: self.path.clone(),
            source,
        }
    }
}

#[cfg(test)]
mod tests {
    use emems::{packet::encode, sample::Reading};

    use super::*;
    use crate::digest::Digest;
    use packets::stream::sequence::CYCLE_S;

    fn read(folder: &Path, name: &str) -> String {
        fs::read_to_string(folder.join(name)).unwrap_or_default()
    }

    #[test]
    fn a_folder_holds_the_stream_verbatim_and_all_that_follows_from_it() {
        let place = tempfile::tempdir().expect("temporary folder");
        let mut folder = Folder::create(place.path(), "still-1", CYCLE_S).expect("folder");
        let stream = [
            b"?".as_slice(),
            &encode(&Reading::unread(1)),
            &encode(&Reading::unread(4)),
        ]
        .concat();
        let mut digest = Digest::default();
        let entries = digest.push(None, &stream);
        folder.telemetry(&stream).expect("telemetry");
        folder.entries(&entries).expect("entries");
        folder.log(0.25, "INFO up").expect("log");
        let (_, record) = digest.finish();
        let rows = record.summary.rows();
        let path = folder.finish("still", "", &rows, &record, None).expect("finish");
        assert_eq!(read(&path, "packets.txt").as_bytes(), stream);
        assert_eq!(read(&path, "counts.csv").lines().count(), 3);
        assert_eq!(read(&path, "si.csv").lines().count(), 3);
        assert_eq!(
            read(&path, "log.txt"),
            "offset 0, 1 bytes: not part of a frame\n\
             offset 157, packet 4, 0.800 s: 2 packets missed before it\n    0.250000 INFO up\n"
        );
        assert!(
            read(&path, "summary.txt").starts_with("packets                     2\nmissed                      2\n")
        );
        let page = read(&path, "index.html");
        assert!(page.contains("Accelerometers") && page.contains("href=\"si.csv\""));
        assert!(!page.contains("derived.csv"), "a link to nothing");
        assert!(!path.join("derived.csv").exists(), "no derived frames, no file");
    }

    #[test]
    fn an_existing_folder_is_left_alone_and_a_number_added() {
        let place = tempfile::tempdir().expect("temporary folder");
        let names: Vec<_> = (0..3)
            .map(|_| {
                Folder::create(place.path(), "rocket-1", CYCLE_S)
                    .expect("folder")
                    .path()
                    .to_owned()
            })
            .collect();
        let expected = ["rocket-1", "rocket-1-2", "rocket-1-3"].map(|name| place.path().join(name));
        assert_eq!(names, expected);
    }

    #[test]
    fn a_place_that_cannot_be_written_is_named() {
        let place = tempfile::NamedTempFile::new().expect("temporary file");
        let error = Folder::create(place.path(), "x", CYCLE_S)
            .err()
            .expect("a file is no folder");
        assert!(error.to_string().contains("choose another place with --out"), "{error}");
    }
}
