//! Tables of numbers as text: each reader refuses with the file named, or gives as many cells a row as there are columns,
//! and finite numbers only.

use std::path::Path;

use attitude::counts;
use bench::table::Table;
use logs::recording;

const FILE: &str = "fuzz.csv";

/// The target.
pub fn csv(bytes: &[u8]) {
    match Table::parse(Path::new(FILE), bytes) {
        Ok(table) => {
            for row in &table.rows {
                assert_eq!(row.cells.len(), table.columns.len(), "line {}", row.line);
                for column in 0..table.columns.len() {
                    match table.number(row, column) {
                        Ok(value) => assert!(value.is_none_or(f64::is_finite), "line {}", row.line),
                        Err(error) => assert!(error.to_string().starts_with(FILE), "{error}"),
                    }
                }
            }
        }
        Err(error) => assert!(error.to_string().starts_with(FILE), "{error}"),
    }
    match recording::parse(FILE, bytes) {
        Ok(rows) => {
            assert!(rows.is_sorted_by(|before, after| before.t_s < after.t_s));
            for row in &rows {
                let vectors = [Some(row.rate_b), row.acc_b, row.mag_b];
                assert!(
                    vectors
                        .iter()
                        .flatten()
                        .all(|vector| vector.iter().all(|value| value.is_finite()))
                );
                assert!(row.reference_nb.is_none_or(|q_nb| (q_nb.norm() - 1.0).abs() < 1e-9));
            }
        }
        Err(error) => assert!(error.to_string().starts_with(FILE), "{error}"),
    }
    if let Err(error) = counts::parse(FILE, bytes) {
        assert!(error.to_string().starts_with(FILE), "{error}");
    }
}
