//! `ground report reproductions`: every numeric table of the three source documents beside what this program makes of it.
//!
//! In: the documents' tables as CSV in one folder. Out: on the terminal a line a table; one page with each table's values
//! as printed and as had again, how near they must be, and where they differ or cannot be had, why. The documents are
//! Marinho (2017), Siqueira (2014) and the paper on dry-tuned gyros; the modules below hold one each.
//!
//! A line agrees when every value is as near as its printed digits or the stated reason allows. Differences are findings,
//! mostly errors of the tables: the tests beside this module hold each table to the number found.

pub mod allan;
pub mod marinho;
pub mod rotor;
pub mod siqueira;

use std::{
    io,
    path::{Path, PathBuf},
};

use chart::Block;

use crate::{
    report::five_digits,
    table::{Table, TableError},
};

/// Writes pages that are about no single run
#[derive(Clone, Debug, clap::Args)]
pub struct ReportArguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum What {
    Reproductions(Reproductions),
}

/// Every numeric table of the source documents beside what this program makes of it
#[derive(Clone, Debug, clap::Args)]
pub struct Reproductions {
    /// Folder with the documents' tables
    #[arg(long, value_name = "FOLDER", default_value = "data/golden")]
    sources: PathBuf,
    /// The page
    #[arg(
        long = "page",
        alias = "out",
        value_name = "FILE",
        default_value = "reports/reproductions.html"
    )]
    out: PathBuf,
}

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum ReproductionError {
    /// A table is absent or cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A table lacks a column.
    #[error("{file}: has no column {column}")]
    Column {
        /// The table.
        file: PathBuf,
        /// The column.
        column: String,
    },
    /// A calculation fails on the documents' numbers.
    #[error("{table}: {why}")]
    Calculation {
        /// The table.
        table: &'static str,
        /// What fails.
        why: String,
    },
    /// The page cannot be written.
    #[error("{file}: {error}")]
    Write {
        /// The page.
        file: PathBuf,
        /// Why.
        error: io::Error,
    },
}

/// One comparison: values as printed, as had again, and how far each may be off.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// What is compared, with its unit.
    pub what: String,
    /// As printed.
    pub printed: Vec<f64>,
    /// As had again.
    pub ours: Vec<f64>,
    /// Largest difference that still agrees.
    pub within: f64,
}

/// A table of a document.
#[derive(Clone, Debug, PartialEq)]
pub struct Reproduced {
    /// Its name in the document.
    pub table: &'static str,
    /// Comparisons; none where nothing of it can be had again.
    pub lines: Vec<Line>,
    /// How it was had again, what differs and why, or why it cannot be had.
    pub why: &'static str,
}

impl Line {
    /// A comparison of several values.
    pub fn new(what: impl Into<String>, printed: &[f64], ours: &[f64], within: f64) -> Self {
        Line {
            what: what.into(),
            printed: printed.to_vec(),
            ours: ours.to_vec(),
            within,
        }
    }

    /// Whether every value is near enough; what is no number never is.
    pub fn agrees(&self) -> bool {
        let near = |(printed, ours): (&f64, &f64)| (printed - ours).abs() <= self.within;
        self.printed.len() == self.ours.len() && self.printed.iter().zip(&self.ours).all(near)
    }
}

impl Reproduced {
    /// Lines that differ.
    pub fn differing(&self) -> usize {
        self.lines.iter().filter(|line| !line.agrees()).count()
    }

    /// In a few words.
    pub fn verdict(&self) -> String {
        match (self.differing(), self.lines.len()) {
            (_, 0) => "cannot be had".into(),
            (0, 1) => "agrees".into(),
            (0, of) => format!("all {of} agree"),
            (differing, of) => format!("{differing} of {of} differ"),
        }
    }

    fn blocks(&self) -> Vec<Block> {
        let mut blocks = vec![Block::Heading(self.table.into()), Block::Text(self.why.into())];
        // What is nothing beside the tolerance is rounding, and is shown as nothing.
        let value = |value: f64, within: f64| five_digits(if value.abs() < 1e-3 * within { 0.0 } else { value });
        let values = |values: &[f64], within| {
            let cells: Vec<String> = values.iter().map(|one| value(*one, within)).collect();
            cells.join("  ")
        };
        let row = |line: &Line| {
            let said = if line.agrees() { "agrees" } else { "differs" };
            vec![
                line.what.clone(),
                values(&line.printed, line.within),
                values(&line.ours, line.within),
                five_digits(line.within),
                said.into(),
            ]
        };
        if !self.lines.is_empty() {
            blocks.push(Block::Table {
                columns: ["what", "printed", "here", "within", "verdict"]
                    .map(String::from)
                    .to_vec(),
                rows: self.lines.iter().map(row).collect(),
            });
        }
        blocks
    }
}

/// The documents' tables.
pub struct Sources<'a>(pub &'a Path);

impl Sources<'_> {
    /// Columns of a table as numbers, a row each.
    ///
    /// # Errors
    /// When the table is absent or has other columns.
    pub fn numbers<const N: usize>(&self, name: &str, columns: [&str; N]) -> Result<Vec<[f64; N]>, ReproductionError> {
        let file = self.0.join(name);
        let table = Table::open(&file)?;
        let mut places = [0; N];
        for (place, column) in places.iter_mut().zip(columns) {
            *place = table.column(column).ok_or_else(|| ReproductionError::Column {
                file: file.clone(),
                column: column.into(),
            })?;
        }
        let mut rows = Vec::new();
        for row in &table.rows {
            let mut values = [0.0; N];
            for (value, place) in values.iter_mut().zip(places) {
                *value = table.required(row, place)?;
            }
            rows.push(values);
        }
        Ok(rows)
    }
}

/// Every table, in the documents' order.
///
/// # Errors
/// When a table is absent or cannot be read.
pub fn all(sources: &Sources<'_>) -> Result<Vec<Reproduced>, ReproductionError> {
    let mut all = marinho::tables(sources)?;
    all.extend(siqueira::tables(sources)?);
    all.extend(allan::tables(sources)?);
    all.extend(rotor::figures(sources)?);
    Ok(all)
}

/// Runs `ground report`.
///
/// # Errors
/// When the tables cannot be read or the page not written.
pub fn run(arguments: &ReportArguments) -> Result<(), ReproductionError> {
    let What::Reproductions(Reproductions { sources, out }) = &arguments.what;
    let all = all(&Sources(sources))?;
    for one in &all {
        println!("{:38} {}", one.table, one.verdict());
    }
    let overview = all.iter().map(|one| (one.table.to_string(), one.verdict())).collect();
    let mut blocks = vec![Block::Rows(overview)];
    blocks.extend(all.iter().flat_map(Reproduced::blocks));
    let page = chart::html(
        "Reproductions",
        "Every numeric table of Marinho (2017), Siqueira (2014) and the paper on dry-tuned gyros, as printed and as had \
         again here; where they differ or cannot be had, why.",
        &blocks,
    );
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
    let written = folder.map_or(Ok(()), std::fs::create_dir_all);
    written
        .and_then(|()| std::fs::write(out, page))
        .map_err(|error| ReproductionError::Write {
            file: out.clone(),
            error,
        })?;
    println!("{}", out.display());
    Ok(())
}

#[cfg(test)]
mod tests;
