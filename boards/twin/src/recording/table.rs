//! Columns of numbers from a CSV file, plain or gzipped.
//!
//! In: the file and the names of the columns that matter; all others are ignored, whatever they hold. An empty cell is
//! "no sample". Out: [`Series`] of columns that belong together. Refuses, with line and column, what is no number, NaN and
//! infinity, numbers beyond [`LARGEST_CELL`], time that stands or goes back, a ragged line, a vector that is empty in part, a damaged
//! gzip, more than [`MAX_ROWS`] lines or [`MAX_BYTES`], and a gzip bomb ([`packed`]), so that no file can exhaust memory or
//! patience.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use csv::{ByteRecord, ErrorKind, Reader, ReaderBuilder, Terminator, Trim};
use nalgebra::SVector;
use packed::{Limits, TooLarge, Unpacked};

use super::fault::{Fault, FileError};
use super::lines::BoundedLines;
use super::series::Series;

/// Most lines read: nearly two hours at 300 Hz, and 160 MB of memory.
pub const MAX_ROWS: usize = 2_000_000;
/// Most bytes read, after decompression: 256 a line.
pub const MAX_BYTES: u64 = 256 * MAX_ROWS as u64;

/// Largest magnitude of a cell: f64 holds every whole number up to some 1e16, and a difference of two beyond it may overflow.
const LARGEST_CELL: f64 = 1e15;
/// No sample. No file can hold it, since NaN is refused.
const EMPTY: f64 = f64::NAN;

/// The wanted columns of a file.
#[derive(Debug)]
pub struct Table {
    file: String,
    t_s: Vec<f64>,
    lines: Vec<u64>,
    columns: Vec<(String, Vec<f64>)>,
}

/// Samples with the lines they came from.
pub struct Located<const N: usize> {
    /// The samples.
    pub series: Series<N>,
    /// The line of each.
    pub lines: Vec<u64>,
}

impl<const N: usize> Located<N> {
    /// The samples replaced one by one, unless `each`, which is told the line, refuses one.
    pub fn try_map<E>(
        self,
        mut each: impl FnMut(u64, SVector<f64, N>) -> Result<SVector<f64, N>, E>,
    ) -> Result<Series<N>, E> {
        let mut lines = self.lines.into_iter();
        self.series
            .try_map(|value| each(lines.next().unwrap_or_default(), value))
    }
}

impl Table {
    /// Reads a file.
    pub fn open(path: &Path, wanted: &[&str]) -> Result<Self, FileError> {
        let file = path.display().to_string();
        match File::open(path) {
            Ok(opened) => Self::read(opened, &file, wanted),
            Err(error) => Err(FileError {
                file,
                fault: Fault::Unreadable {
                    reason: error.to_string(),
                },
            }),
        }
    }

    /// Reads the bytes of a file of that name.
    pub fn read(bytes: impl Read, file: &str, wanted: &[&str]) -> Result<Self, FileError> {
        let mut table = Self {
            file: file.to_owned(),
            t_s: Vec::new(),
            lines: Vec::new(),
            columns: Vec::new(),
        };
        match table.fill(bytes, wanted) {
            Ok(()) => Ok(table),
            Err(fault) => Err(table.error(fault)),
        }
    }

    /// The file as it was named.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Whether the header names this column.
    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|(name, _)| name == column)
    }

    /// The lines in which these columns, which belong together, are filled.
    pub fn series<const N: usize>(&self, names: [&str; N]) -> Result<Located<N>, FileError> {
        self.together(names).map_err(|fault| self.error(fault))
    }

    /// This fault, in this file.
    pub fn error(&self, fault: Fault) -> FileError {
        FileError {
            file: self.file.clone(),
            fault,
        }
    }

    fn together<const N: usize>(&self, names: [&str; N]) -> Result<Located<N>, Fault> {
        let mut columns = [&[][..]; N];
        for (column, name) in columns.iter_mut().zip(names) {
            let Some((_, cells)) = self.columns.iter().find(|(known, _)| known == name) else {
                return Err(Fault::MissingColumn {
                    column: name.to_owned(),
                    needed: names.join(","),
                });
            };
            *column = cells;
        }
        let (mut t_s, mut lines, mut values) = (Vec::new(), Vec::new(), Vec::new());
        for (row, (&at_s, &line)) in self.t_s.iter().zip(&self.lines).enumerate() {
            let value = SVector::<f64, N>::from_fn(|i, _| columns[i][row]);
            match value.iter().filter(|cell| cell.is_nan()).count() {
                0 => {
                    t_s.push(at_s);
                    lines.push(line);
                    values.push(value);
                }
                empty if empty == N => {}
                _ => {
                    return Err(Fault::PartlyEmpty {
                        line,
                        columns: names.join(","),
                    });
                }
            }
        }
        let found = t_s.len();
        let series = Series::new(t_s, values).ok_or(Fault::TooFewSamples {
            columns: names.join(","),
            found,
        })?;
        Ok(Located { series, lines })
    }

    fn fill(&mut self, bytes: impl Read, wanted: &[&str]) -> Result<(), Fault> {
        let plain = Unpacked::new(bytes, Limits::most(MAX_BYTES)).map_err(|error| Fault::Unreadable {
            reason: error.to_string(),
        })?;
        let gzipped = plain.is_gzip();
        // A line is counted when its end is read, so the last one gets an end too. Blank lines and the carriage returns of
        // Windows are trimmed away here and not by the reader, which would count neither.
        let mut text = ReaderBuilder::new()
            .terminator(Terminator::Any(b'\n'))
            .flexible(true)
            .trim(Trim::All)
            .from_reader(BoundedLines::new(plain).chain(&b"\n"[..]));
        self.rows(&mut text, wanted).map_err(|fault| match fault {
            Fault::Unreadable { .. } if gzipped => Fault::DamagedGzip {
                line: text.position().line().saturating_sub(1),
            },
            other => other,
        })
    }

    fn rows(&mut self, text: &mut Reader<impl Read>, wanted: &[&str]) -> Result<(), Fault> {
        let header = text.byte_headers().map_err(unreadable)?.clone();
        let time = place(&header, "t_s")?.ok_or_else(|| Fault::MissingColumn {
            column: "t_s".to_owned(),
            needed: "t_s".to_owned(),
        })?;
        let mut places = Vec::new();
        for name in wanted {
            if let Some(place) = place(&header, name)? {
                places.push(place);
                self.columns.push(((*name).to_owned(), Vec::new()));
            }
        }
        let mut record = ByteRecord::new();
        while text.read_byte_record(&mut record).map_err(unreadable)? {
            let line = text.position().line() - 1;
            if record.len() == 1 && header.len() > 1 && record[0].is_empty() {
                continue;
            }
            if record.len() != header.len() {
                return Err(Fault::RaggedLine {
                    line,
                    found: record.len(),
                    expected: header.len(),
                });
            }
            if self.t_s.len() == MAX_ROWS {
                return Err(too_long());
            }
            let t_s = number(&record, time, line, "t_s")?;
            match self.t_s.last() {
                _ if t_s.is_nan() => return Err(Fault::NoTime { line }),
                Some(&previous_s) if t_s <= previous_s => {
                    return Err(Fault::TimeNotIncreasing { line, t_s, previous_s });
                }
                _ => {}
            }
            self.t_s.push(t_s);
            self.lines.push(line);
            for ((name, cells), &place) in self.columns.iter_mut().zip(&places) {
                cells.push(number(&record, place, line, name)?);
            }
        }
        Ok(())
    }
}

/// Where the header names this column.
fn place(header: &ByteRecord, name: &str) -> Result<Option<usize>, Fault> {
    let mut places = header
        .iter()
        .enumerate()
        .filter(|(_, cell)| *cell == name.as_bytes())
        .map(|(place, _)| place);
    match (places.next(), places.next()) {
        (_, Some(_)) => Err(Fault::RepeatedColumn {
            column: name.to_owned(),
        }),
        (first, None) => Ok(first),
    }
}

/// The number in a cell, or [`EMPTY`].
fn number(record: &ByteRecord, place: usize, line: u64, column: &str) -> Result<f64, Fault> {
    let cell = record.get(place).unwrap_or_default();
    if cell.is_empty() {
        return Ok(EMPTY);
    }
    let quoted = || String::from_utf8_lossy(&cell[..cell.len().min(32)]).into_owned();
    match std::str::from_utf8(cell).ok().and_then(|text| text.parse::<f64>().ok()) {
        Some(number) if number.abs() <= LARGEST_CELL => Ok(number),
        Some(number) if number.is_finite() => Err(Fault::Beyond {
            line,
            column: column.to_owned(),
            text: quoted(),
            most: LARGEST_CELL,
        }),
        Some(_) => Err(Fault::NotFinite {
            line,
            column: column.to_owned(),
            text: quoted(),
        }),
        None => Err(Fault::NotANumber {
            line,
            column: column.to_owned(),
            text: quoted(),
        }),
    }
}

fn unreadable(error: csv::Error) -> Fault {
    match error.kind() {
        ErrorKind::Io(refused) if refused.kind() == io::ErrorKind::FileTooLarge => match TooLarge::of(refused) {
            Some(TooLarge::Ratio { ratio }) => Fault::GzipBomb { ratio },
            _ => too_long(),
        },
        _ => Fault::Unreadable {
            reason: error.to_string(),
        },
    }
}

fn too_long() -> Fault {
    Fault::TooLong {
        rows: MAX_ROWS,
        bytes: MAX_BYTES,
    }
}
