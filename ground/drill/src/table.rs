//! The table of a drill: on the terminal as it comes, and as CSV.

use std::{io, path::Path};

/// What became of a row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// Row of the catalogue.
    pub row: String,
    /// The fault.
    pub fault: String,
    /// How it was injected.
    pub injected: String,
    /// How often it struck; empty where tests tell.
    pub struck: String,
    /// What the unit did.
    pub did: String,
    /// Accepted, by test, or not accepted and why.
    pub verdict: String,
}

/// The head of the table.
pub const HEAD: [&str; 6] = ["row", "fault", "injected", "struck", "what the unit did", "verdict"];

impl Line {
    /// Its cells.
    pub fn cells(&self) -> [&str; 6] {
        [
            &self.row,
            &self.fault,
            &self.injected,
            &self.struck,
            &self.did,
            &self.verdict,
        ]
    }

    /// For programs, under the names of [`HEAD`].
    pub fn json(&self) -> serde_json::Value {
        let cells = HEAD.into_iter().zip(self.cells());
        cells
            .map(|(name, cell)| (name.to_string(), cell.into()))
            .collect::<serde_json::Map<_, _>>()
            .into()
    }

    /// Prints it.
    pub fn print(&self) {
        let struck = if self.struck.is_empty() { "-" } else { &self.struck };
        println!("{:4} {}  [{}]", self.row, self.fault, self.verdict);
        println!("     injected: {}; struck {struck}", self.injected);
        if !self.did.is_empty() {
            println!("     {}", self.did);
        }
    }
}

/// Keeps a table.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, lines: &[Line]) -> io::Result<()> {
    let mut writer = csv::Writer::from_path(path)?;
    writer.write_record(HEAD)?;
    for line in lines {
        writer.write_record(line.cells())?;
    }
    writer.flush()
}
