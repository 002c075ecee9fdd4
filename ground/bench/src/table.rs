//! Tables of numbers as laboratories write them.
//!
//! In: the bytes of a CSV, tab-separated or LabVIEW measurement (.lvm) file, in UTF-8 or Latin-1, with decimal points or
//! decimal commas, packed (.gz) or not. Out: a [`Table`], named columns of text cells that know their line, read as
//! numbers on demand.
//!
//! The separator is the one the line of column names is split by: tab before semicolon before comma. A comma is a
//! decimal comma only where it cannot be anything else: it does not separate or stands within quotes, and no other cell of
//! the file has a decimal point. A LabVIEW header says both itself. Cells may be quoted, with separators within and quotes
//! doubled; a quoted cell ends on its line.
//!
//! Refused, with file, line and column: rows with more or fewer cells than there are names (what a decimal comma does
//! to a comma-separated file), cells that are no number, `1.234,5` and files that mix both decimal marks, repeated
//! column names, and files beyond [`LARGEST`].

mod number;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

pub use number::Decimal;

/// \[bytes\] largest table that is read, unpacked: a day of the unit's packets is 67 MB.
pub const LARGEST: u64 = 1 << 30;

/// Where a file's meaning is not certain, and why.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{}{}: {why}", file.display(), at("line", *line), of_column(column))]
pub struct TableError {
    /// The file.
    pub file: PathBuf,
    /// Its line, from 1; 0 where the whole file is meant.
    pub line: usize,
    /// The column's name; empty where the whole line is meant.
    pub column: String,
    /// What is wrong, and what to do.
    pub why: String,
}

fn at(what: &str, number: usize) -> String {
    if number == 0 {
        String::new()
    } else {
        format!(", {what} {number}")
    }
}

fn of_column(name: &str) -> String {
    if name.is_empty() {
        String::new()
    } else {
        format!(", column {name}")
    }
}

/// Named columns of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The file it came from.
    pub file: PathBuf,
    /// Column names, without surrounding blanks.
    pub columns: Vec<String>,
    /// Rows, in the order of the file.
    pub rows: Vec<Row>,
    decimal: Decimal,
}

/// A row of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its line in the file, from 1.
    pub line: usize,
    /// Its cells, as many as there are columns.
    pub cells: Vec<String>,
}

impl Table {
    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read, or its meaning is not certain.
    pub fn open(file: &Path) -> Result<Self, TableError> {
        Self::parse(file, &bytes(file)?)
    }

    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// When their meaning is not certain.
    pub fn parse(file: &Path, bytes: &[u8]) -> Result<Self, TableError> {
        let fail = |line, why: &str| TableError {
            file: file.into(),
            line,
            column: String::new(),
            why: why.into(),
        };
        let text = decode(bytes);
        let lines: Vec<(usize, &str)> = text.lines().enumerate().map(|(k, line)| (k + 1, line)).collect();
        let header_ends = lines.iter().rposition(|(_, line)| line.contains("***End_of_Header***"));
        let (header, body) = lines.split_at(header_ends.map_or(0, |k| k + 1));
        let said = Said::by(header);
        let mut body = body
            .iter()
            .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
        let &(names_line, names) = body.next().ok_or_else(|| fail(0, "has no line of column names"))?;
        let separator = said.separator.unwrap_or_else(|| separator(names));
        let cells_of =
            |line, text| split(text, separator).ok_or_else(|| fail(line, "a quoted cell does not end on its line"));
        let columns: Vec<String> = cells_of(names_line, names)?;
        if let Some(name) = repeated(&columns) {
            return Err(fail(names_line, &format!("two columns are called \"{name}\"")));
        }
        if !columns.is_empty()
            && columns
                .iter()
                .all(|name| number::parse(name, Decimal::Either).is_some())
        {
            return Err(fail(
                names_line,
                "the first line holds numbers; it must name the columns",
            ));
        }
        let mut rows = Vec::new();
        for &(line, text) in body {
            let mut cells = cells_of(line, text)?;
            // LabVIEW ends lines with an empty comment column.
            while cells.len() > columns.len() && cells.last().is_some_and(String::is_empty) {
                cells.pop();
            }
            if header_ends.is_some() && cells.len() < columns.len() {
                cells.resize(columns.len(), String::new());
            }
            if cells.len() != columns.len() {
                let mut why = format!("has {} cells, the line of names has {}", cells.len(), columns.len());
                if separator == ',' && cells.len() > columns.len() {
                    why += "; if these are decimal commas, separate the columns by semicolons or tabs";
                }
                return Err(fail(line, &why));
            }
            rows.push(Row { line, cells });
        }
        let mut table = Table {
            file: file.into(),
            columns,
            rows,
            decimal: Decimal::Point,
        };
        table.decimal = match said.decimal {
            Some(decimal) => decimal,
            None if separator == ',' && !text.contains('"') => Decimal::Point,
            None => table.seen_decimal()?,
        };
        Ok(table)
    }

    /// The position of a column, whatever its letters' case.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.eq_ignore_ascii_case(name))
    }

    /// The number in a cell; `None` for an empty one, `-`, or `NaN`.
    ///
    /// # Errors
    /// When it is something else.
    pub fn number(&self, row: &Row, column: usize) -> Result<Option<f64>, TableError> {
        let cell = row.cells.get(column).map_or("", String::as_str);
        if cell.is_empty() || cell == "-" || cell.eq_ignore_ascii_case("nan") {
            return Ok(None);
        }
        let value = number::parse(cell, self.decimal).filter(|value| value.is_finite());
        value.map(Some).ok_or_else(|| {
            let why = format!("\"{cell}\" is no number with a decimal {}", self.decimal.name());
            self.error(row.line, column, &why)
        })
    }

    /// The number in a cell that must have one.
    ///
    /// # Errors
    /// When the cell is empty or no number.
    pub fn required(&self, row: &Row, column: usize) -> Result<f64, TableError> {
        self.number(row, column)?
            .ok_or_else(|| self.error(row.line, column, "is empty, and needed"))
    }

    /// An error about a cell of this table; line 0 for the whole column.
    pub fn error(&self, line: usize, column: usize, why: &str) -> TableError {
        TableError {
            file: self.file.clone(),
            line,
            column: self.columns.get(column).cloned().unwrap_or_default(),
            why: why.into(),
        }
    }

    /// What the cells say about the decimal mark; the first cell of each kind speaks.
    fn seen_decimal(&self) -> Result<Decimal, TableError> {
        let mut seen: Option<(Decimal, usize, usize)> = None;
        for row in &self.rows {
            for (column, cell) in row.cells.iter().enumerate() {
                if number::parse(cell, Decimal::Either).is_none() {
                    continue;
                }
                let Some(decimal) = number::marked(cell) else { continue };
                match seen {
                    Some((before, line, _)) if before != decimal => {
                        let why = format!(
                            "\"{cell}\" has a decimal {}, line {line} a decimal {}: write all numbers alike",
                            decimal.name(),
                            before.name()
                        );
                        return Err(self.error(row.line, column, &why));
                    }
                    Some(_) => {}
                    None => seen = Some((decimal, row.line, column)),
                }
            }
        }
        Ok(seen.map_or(Decimal::Point, |(decimal, ..)| decimal))
    }
}

/// The bytes of a file, unpacked if it is a gzip file.
///
/// # Errors
/// When it cannot be read, is beyond [`LARGEST`], or is a gzip bomb ([`packed`]).
pub fn bytes(file: &Path) -> Result<Vec<u8>, TableError> {
    packed::read(file, LARGEST).map_err(|error| TableError {
        file: file.into(),
        line: 0,
        column: String::new(),
        why: format!("cannot be read: {error}"),
    })
}

/// UTF-8 where it is, Latin-1 (whose bytes are the first 256 code points) where not.
fn decode(bytes: &[u8]) -> String {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    }
}

/// What a LabVIEW header says of the columns.
#[derive(Default)]
struct Said {
    separator: Option<char>,
    decimal: Option<Decimal>,
}

impl Said {
    fn by(header: &[(usize, &str)]) -> Self {
        let mut said = Said::default();
        for (_, line) in header {
            if let Some(value) = line.strip_prefix("Separator") {
                said.separator = Some(if value.contains("Comma") { ',' } else { '\t' });
            } else if let Some(value) = line.strip_prefix("Decimal_Separator") {
                let comma = value.trim_start_matches(['\t', ',']).is_empty() && value.ends_with(',');
                said.decimal = Some(if comma { Decimal::Comma } else { Decimal::Point });
            }
        }
        said
    }
}

fn separator(names: &str) -> char {
    // Every second part stands within quotes.
    let bare: String = names.split('"').step_by(2).collect();
    ['\t', ';'].into_iter().find(|&mark| bare.contains(mark)).unwrap_or(',')
}

/// The cells of a line; `None` where a quoted one does not end.
fn split(line: &str, separator: char) -> Option<Vec<String>> {
    if !line.contains('"') {
        return Some(line.split(separator).map(|cell| cell.trim().to_string()).collect());
    }
    if line.matches('"').count() % 2 == 1 {
        return None;
    }
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(u8::try_from(separator).ok()?)
        .has_headers(false)
        .buffer_capacity(line.len())
        .from_reader(line.as_bytes());
    let record = reader.records().next()?.ok()?;
    // A blank before the quote keeps it from being one to the reader.
    let bare = |cell: &str| match cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')) {
        Some(within) => within.trim().to_string(),
        None => cell.to_string(),
    };
    Some(record.iter().map(|cell| bare(cell.trim())).collect())
}

fn repeated(columns: &[String]) -> Option<&String> {
    let earlier = |k: usize| columns.iter().take(k);
    let mut named = columns.iter().enumerate().filter(|(_, name)| !name.is_empty());
    named
        .find(|(k, name)| earlier(*k).any(|other| other.eq_ignore_ascii_case(name)))
        .map(|(_, name)| name)
}
