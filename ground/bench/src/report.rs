//! What a run says to people: is it good, what is wrong, what to do next; and a page with the residuals.
//!
//! In: findings of a calibration. Out: a [`Report`]: lines for the terminal and blocks for one HTML file. A run is good if
//! nothing is wrong; a remark does not make it bad.

use std::{fmt::Write, path::Path};

use chart::{Axis, Block, Figure, Layer, Marks, Panel};

/// Five significant digits, as the thesis prints them.
pub fn five_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-4..6).contains(&exponent) {
        let text = format!("{value:.*}", usize::try_from(4 - exponent).unwrap_or(0));
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').into()
        } else {
            text
        }
    } else {
        format!("{value:.4e}")
    }
}

/// Findings of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Title of the page.
    pub title: String,
    /// What is wrong, most important first.
    pub wrong: Vec<String>,
    /// What was noticed and does no harm.
    pub remarks: Vec<String>,
    /// What to do next.
    pub next: Vec<String>,
    /// Names of the columns of the table of results.
    pub columns: Vec<String>,
    /// The table of results.
    pub rows: Vec<Vec<String>>,
    /// Pictures and tables below it.
    pub blocks: Vec<Block>,
}

impl Report {
    /// For the terminal.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let widths: Vec<usize> = (0..self.columns.len())
            .map(|k| {
                self.rows
                    .iter()
                    .chain([&self.columns])
                    .filter_map(|row| row.get(k))
                    .map(|cell| cell.chars().count())
                    .max()
            })
            .map(Option::unwrap_or_default)
            .collect();
        // Writing to a string cannot fail.
        for row in [&self.columns].into_iter().chain(&self.rows) {
            let cells: Vec<String> = row
                .iter()
                .zip(&widths)
                .map(|(cell, width)| format!("{cell:>width$}"))
                .collect();
            let _ = writeln!(text, "{}", cells.join("  "));
        }
        for (head, lines) in [("wrong", &self.wrong), ("noticed", &self.remarks), ("next", &self.next)] {
            for line in lines {
                let _ = writeln!(text, "{head:8}{line}");
            }
        }
        let _ = writeln!(text, "{}", self.verdict());
        text
    }

    /// The answer in one line.
    pub fn verdict(&self) -> String {
        match self.wrong.len() {
            0 => "good".into(),
            1 => "not good: one thing is wrong".into(),
            many => format!("not good: {many} things are wrong"),
        }
    }

    /// For programs: the verdict, what is wrong, what was noticed, what to do, and the table.
    pub fn json(&self) -> serde_json::Value {
        let row = |row: &Vec<String>| -> serde_json::Value {
            let cells = self.columns.iter().zip(row);
            cells
                .map(|(name, cell)| (name.clone(), cell.as_str().into()))
                .collect::<serde_json::Map<_, _>>()
                .into()
        };
        serde_json::json!({
            "title": self.title,
            "good": self.wrong.is_empty(),
            "wrong": self.wrong,
            "noticed": self.remarks,
            "next": self.next,
            "rows": self.rows.iter().map(row).collect::<Vec<_>>(),
        })
    }

    /// Prints it, for people or for programs.
    pub fn print(&self, json: bool) {
        if json {
            println!("{}", self.json());
        } else {
            print!("{}", self.text());
        }
    }

    /// As a page.
    pub fn html(&self, about: &str) -> String {
        let list = |name: &str, lines: &[String]| {
            lines
                .iter()
                .map(|line| (name.to_string(), line.clone()))
                .collect::<Vec<_>>()
        };
        let mut rows = vec![("verdict".to_string(), self.verdict())];
        rows.extend(list("wrong", &self.wrong));
        rows.extend(list("noticed", &self.remarks));
        rows.extend(list("next", &self.next));
        let table = Block::Table {
            columns: self.columns.clone(),
            rows: self.rows.clone(),
        };
        let mut blocks = vec![Block::Rows(rows), table];
        blocks.extend(self.blocks.iter().cloned());
        chart::html(&self.title, about, &blocks)
    }

    /// Prints it, and writes the page where one was asked for.
    ///
    /// # Errors
    /// When the page cannot be written, with its name.
    pub fn finish(&self, page: Option<&Path>, about: &str, json: bool) -> Result<(), String> {
        self.print(json);
        if let Some(page) = page {
            self.write(page, about)?;
            if !json {
                println!("{}", page.display());
            }
        }
        Ok(())
    }

    /// Writes the page.
    ///
    /// # Errors
    /// When the file cannot be written, with its name.
    pub fn write(&self, file: &Path, about: &str) -> Result<(), String> {
        packets::output::replace_with(file, self.html(about))
            .map_err(|error| format!("{} cannot be written: {error}", file.display()))
    }

    /// Adds a picture, or a remark that it could not be drawn.
    pub fn picture(&mut self, figure: Result<Figure, chart::ChartError>) {
        match figure {
            Ok(figure) => self.blocks.push(Block::Figure(figure)),
            Err(error) => self.remarks.push(error.to_string()),
        }
    }
}

/// What a channel leaves over, as `(row, measured - predicted)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Leftover {
    /// The channel.
    pub channel: String,
    /// Rows of the fit.
    pub fitted: Vec<(f64, f64)>,
    /// The same rows, each predicted without it.
    pub left_out: Vec<(f64, f64)>,
}

/// Residuals of every channel against the row's number, fitted and left out.
///
/// # Errors
/// When the plotting library refuses.
pub fn residuals(title: &str, unit: &str, channels: &[Leftover]) -> Result<Figure, chart::ChartError> {
    let panel = |one: &Leftover| Panel {
        title: one.channel.clone(),
        x: Axis::linear("row"),
        y: Axis::linear(format!("measured − predicted [{unit}]")),
        layers: vec![
            Layer::new("in the fit", 0, Marks::Dots(one.fitted.clone())),
            Layer::new("left out", 1, Marks::Dots(one.left_out.clone())),
        ],
    };
    let panels: Vec<Panel> = channels.iter().map(panel).collect();
    Figure::of(title, 2, &panels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_five() {
        for (value, text) in [
            (2.46661e-5, "2.4666e-5"),
            (26_214.4, "26214"),
            (0.05, "0.05"),
            (0.0, "0"),
            (1_234_567.0, "1.2346e6"),
        ] {
            assert_eq!(five_digits(value), text);
        }
    }

    fn report() -> Report {
        Report {
            title: "run".into(),
            columns: vec!["channel".into(), "bias".into()],
            rows: vec![vec!["g1".into(), "-12.58".into()]],
            ..Report::default()
        }
    }

    #[test]
    fn nothing_wrong_is_good_and_remarks_do_not_change_it() {
        let mut report = report();
        report.remarks.push("row 7 repeats row 6".into());
        assert_eq!(
            report.text(),
            "channel    bias\n     g1  -12.58\nnoticed row 7 repeats row 6\ngood\n"
        );
        report.wrong.push("row 2 contradicts the data".into());
        assert!(report.text().ends_with("not good: one thing is wrong\n"));
    }

    #[test]
    fn programs_are_told_the_same() {
        let mut report = report();
        report.wrong.push("row 2 contradicts the data".into());
        let json = report.json();
        assert_eq!(json["good"], false);
        assert_eq!(json["wrong"][0], "row 2 contradicts the data");
        assert_eq!(json["rows"][0]["bias"], "-12.58");
    }

    #[test]
    fn the_page_holds_verdict_table_and_residuals_and_asks_for_nothing() {
        let mut report = report();
        let one = Leftover {
            channel: "g1".into(),
            fitted: vec![(1.0, 0.5), (2.0, -0.5)],
            left_out: vec![(1.0, 0.7)],
        };
        report.picture(residuals("Residuals", "counts", &[one]));
        let page = report.html("from run.csv");
        for part in ["verdict", "good", "-12.58", "<svg", "left out"] {
            assert!(page.contains(part), "{part}");
        }
        assert!(page.contains("default-src 'none'"), "it may not fetch anything");
    }
}
