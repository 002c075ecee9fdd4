//! The one place that knows where the source documents' tables lie: beside the project.

use std::path::PathBuf;

use bench::table::Table;

/// A file beside the project; `None`, said once, where it is absent.
pub fn file(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared")
        .join(name);
    if path.is_file() {
        return Some(path);
    }
    println!("skipped: no {name} beside the project");
    None
}

/// A table of the sources.
pub fn table(name: &str) -> Option<Table> {
    Some(Table::open(&file(name)?).expect("a table of the sources"))
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
