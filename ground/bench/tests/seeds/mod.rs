//! The one place that knows where the source documents' tables and the practice cases lie: in `data/`.

use std::path::PathBuf;

use bench::table::Table;

/// A file of `data/`.
pub fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../data").join(name)
}

/// A table of it.
pub fn table(name: &str) -> Table {
    Table::open(&file(name)).expect("a table of data/")
}

/// Columns of a table as numbers, a row each.
pub fn numbers(table: &Table, columns: &[&str]) -> Vec<Vec<f64>> {
    let find = |name: &&str| table.column(name).unwrap_or_else(|| panic!("no column {name}"));
    let columns: Vec<usize> = columns.iter().map(find).collect();
    let number = |row, &column: &usize| table.required(row, column).expect("number");
    table
        .rows
        .iter()
        .map(|row| columns.iter().map(|column| number(row, column)).collect())
        .collect()
}
