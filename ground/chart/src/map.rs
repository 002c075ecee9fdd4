//! A map: shares or scores in rows and columns, as a table whose cells are shaded.
//!
//! In: names and values from 0 to 1. Out: an HTML table, which needs no script, wraps nothing and can be copied.

use std::fmt::Write;

use crate::page::escape;

/// Shares or scores in rows and columns, as shades with their values written in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// Names of the rows, from the top.
    pub rows: Vec<String>,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// `values[row][column]`, 0 white to 1 dark; what is not finite is left empty.
    pub values: Vec<Vec<f64>>,
}

/// Shades that a cell may have beyond none.
const SHADES: f64 = 10.0;

impl Map {
    pub(crate) fn html(&self) -> String {
        let mut text = String::from("<div class=\"wide\"><table class=\"map\">\n<thead><tr><td>");
        for name in &self.columns {
            // Writing to a string cannot fail.
            let _ = write!(text, "<th>{}", escape(name));
        }
        text += "\n<tbody>\n";
        for (name, values) in self.rows.iter().zip(&self.values) {
            let _ = write!(text, "<tr><th>{}", escape(name));
            for value in values {
                let shade = (SHADES * value.clamp(0.0, 1.0)).round();
                let _ = match value.is_finite() {
                    true => write!(text, "<td class=\"s{shade}\">{:.0}", 100.0 * value),
                    false => write!(text, "<td>"),
                };
            }
            text.push('\n');
        }
        text + "</table></div>\n"
    }
}
