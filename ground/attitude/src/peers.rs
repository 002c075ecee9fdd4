//! The filters of others beside ours, each from its own package, run by `peers/broad.py`.
//!
//! In: the CSV that the script prints; it is told what ours does to the rates' codes and does the same. Out: mean total
//! errors over the recordings, a filter a line. Where Python or a package is absent the table is ours alone, and says so.

use std::{
    collections::BTreeMap,
    path::Path,
    process::{Command, Stdio},
};

use crate::broad::{CUT_STEP_DEG, Line, REPORT, TUNE, mean_of};

/// The script, from the project's root.
const SCRIPT: &str = "peers/broad.py";

/// The interpreter: that of `peers/.venv` if it is there.
pub fn python() -> &'static str {
    const OWN: &str = "peers/.venv/bin/python";
    if Path::new(OWN).exists() { OWN } else { "python3" }
}

/// [deg] total error by filter, mode and recording.
pub type Totals = BTreeMap<String, BTreeMap<(String, String), f64>>;

/// Runs the script, or says why not.
pub fn run(mut python: Command, folder: &Path) -> Result<Totals, String> {
    // Its progress and its complaints go to the terminal as they come: it takes minutes.
    let output = python
        .arg(SCRIPT)
        .arg(folder)
        .arg(CUT_STEP_DEG.to_radians().to_string())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("{SCRIPT}: {error}"))?;
    if !output.status.success() {
        return Err(format!("{SCRIPT}: {}", output.status));
    }
    Ok(parse(&String::from_utf8_lossy(&output.stdout)))
}

/// Reads the script's CSV; lines of another shape are left out.
pub fn parse(csv: &str) -> Totals {
    let mut totals = Totals::new();
    for line in csv.lines().skip(1) {
        if let [filter, recording, mode, total, ..] = line.split(',').collect::<Vec<_>>()[..]
            && let Ok(total) = total.parse()
        {
            let key = (mode.to_string(), recording.to_string());
            totals.entry(filter.to_string()).or_default().insert(key, total);
        }
    }
    totals
}

/// Mean total errors: each mode over the recordings of tune and of report.
pub fn format(ours: &[Line], others: &Totals) -> String {
    let mut text = format!("\n{:<14}", "mean [deg]");
    for column in ["tune 285 Hz", "report", "tune 5 Hz", "report", "tune motion", "report"] {
        text += &format!("{column:>13}");
    }
    text += "\n";
    let mut line = |name: &str, values: [Option<f64>; 6]| {
        text += &format!("{name:<14}");
        for value in values {
            text += &value.map_or(format!("{:>13}", "-"), |value| format!("{value:>13.2}"));
        }
        text += "\n";
    };
    let columns = [
        (0, &TUNE[..]),
        (0, &REPORT[..]),
        (1, &TUNE[..]),
        (1, &REPORT[..]),
        (2, &TUNE[..]),
        (2, &REPORT[..]),
    ];
    line(
        "on one force",
        columns.map(|(mode, numbers)| {
            let mode = [0, 4, 2][mode];
            mean_of(ours, numbers, mode).map(|rmse| rmse.total_deg)
        }),
    );
    line(
        "this filter",
        columns.map(|(mode, numbers)| mean_of(ours, numbers, mode).map(|rmse| rmse.total_deg)),
    );
    for (filter, totals) in others {
        line(
            filter,
            columns.map(|(mode, numbers)| {
                let mode = ["full", "five", "motion"][mode];
                let found = numbers
                    .iter()
                    .map(|number| totals.get(&(mode.to_string(), number.to_string())).copied());
                let found: Option<Vec<f64>> = found.collect();
                found.map(|found| found.iter().sum::<f64>() / found.len() as f64)
            }),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_given_only_where_every_recording_was_run() {
        let mut csv = String::from("filter,recording,mode,total,heading,inclination\n");
        for number in TUNE {
            csv += &format!("VQF,{number},full,2.0,1.0,1.0\n");
        }
        csv += "VQF,01,full,7.0,1.0,1.0\nrubbish\n";
        let text = format(&[], &parse(&csv));
        let line = text.lines().find(|line| line.starts_with("VQF")).expect("a line");
        assert_eq!(
            line.split_whitespace().collect::<Vec<_>>(),
            ["VQF", "2.00", "-", "-", "-", "-", "-"]
        );
    }

    #[test]
    fn without_python_it_says_why() {
        let why = run(Command::new("no-such-python"), Path::new(".")).expect_err("there is none");
        assert!(why.contains(SCRIPT), "{why}");
    }
}
