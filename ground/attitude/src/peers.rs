//! The filters of others beside ours, each from its own package, run by `peers/broad.py`.
//!
//! In: the CSV that the script prints; it is told what ours does to the rates' codes and does the same. Out: mean total
//! errors over the recordings, a filter a line. Where Python or a package is absent the table is ours alone, and says so.

use std::{
    collections::BTreeMap,
    path::Path,
    process::{Command, Stdio},
};

use logs::recording::RecordingError;

use crate::broad::{self, CUT_STEP_DEG, GROUPS, Line, Mode, REPORT, TUNE, mean_of};

/// The script, from the project's root.
const SCRIPT: &str = "peers/broad.py";

/// The interpreter: that of `peers/.venv` if it is there.
pub fn python() -> &'static str {
    const OWN: &str = "peers/.venv/bin/python";
    if Path::new(OWN).exists() { OWN } else { "python3" }
}

/// \[deg\] total error by filter, mode and recording.
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

/// What a column of the table is called, the script's name of its mode, and ours.
const COLUMNS: [(&str, &str, Mode); 4] = [
    ("285 Hz", "full", Mode::Full),
    ("5 Hz", "five", Mode::FiveHz),
    ("one force", "single", Mode::FiveHzOneForce),
    ("motion", "motion", Mode::FromMotion),
];

/// Of a filter: the mean over those of `numbers` that ours ran on, where the filter has all of them.
fn mean(totals: &BTreeMap<(String, String), f64>, script: &str, numbers: &[&str], ours: &[Line]) -> Option<f64> {
    let ran = |number: &&&str| ours.iter().any(|(name, _)| name == **number);
    let total = |number: &&str| totals.get(&(script.to_string(), number.to_string())).copied();
    let found: Option<Vec<f64>> = numbers.iter().filter(ran).map(total).collect();
    let found = found.filter(|found| !found.is_empty())?;
    Some(found.iter().sum::<f64>() / found.len() as f64)
}

/// Mean total errors: each mode over the recordings of tune and of report.
pub fn format(ours: &[Line], others: &Totals) -> String {
    let mut text = format!("\n{:<14}", "mean [deg]");
    for (column, ..) in COLUMNS {
        text += &format!("{:>15}{:>10}", format!("tune {column}"), "report");
    }
    text += "\n";
    let mut line = |name: &str, values: Vec<Option<f64>>| {
        text += &format!("{name:<14}");
        for (value, width) in values.into_iter().zip([15, 10].into_iter().cycle()) {
            let value = value.map_or("-".to_string(), |value| format!("{value:.2}"));
            text += &format!("{value:>width$}");
        }
        text += "\n";
    };
    let cells = || {
        COLUMNS
            .iter()
            .flat_map(|column| [(column, &TUNE[..]), (column, &REPORT[..])])
    };
    let own = cells().map(|((.., mode), numbers)| mean_of(ours, numbers, *mode).map(|rmse| rmse.total_deg));
    line("this filter", own.collect());
    for (filter, totals) in others {
        let theirs = cells().map(|((_, script, _), numbers)| mean(totals, script, numbers, ours));
        line(filter, theirs.collect());
    }
    text
}

/// The mean total errors of each group of recordings beside those of the peer that is best in it.
pub fn format_groups(ours: &[Line], others: &Totals) -> String {
    let mut text = format!("\n{:<18}", "mean [deg]");
    for (column, ..) in COLUMNS {
        text += &format!("{column:>9} {:<16}", "best peer");
    }
    text = text.trim_end().to_string() + "\n";
    for (group, numbers) in GROUPS {
        let mut line = format!("{group:<18}");
        for (_, script, mode) in COLUMNS {
            let Some(own) = mean_of(ours, numbers, mode) else {
                continue;
            };
            let theirs = others
                .iter()
                .filter_map(|(filter, totals)| mean(totals, script, numbers, ours).map(|total| (total, filter)));
            let best = theirs.min_by(|one, other| one.0.total_cmp(&other.0));
            let best = best.map_or(String::new(), |(total, filter)| format!("{total:.2} {filter}"));
            line += &format!("{:>9.2} {best:<16}", own.total_deg);
        }
        text += line.trim_end();
        text += "\n";
    }
    text
}

/// Updates a second in one thread beside those of the peers whose speed the script measured, on the same recording.
pub fn format_speed(folder: &Path, others: &Totals) -> Result<String, RecordingError> {
    let mut text = String::new();
    for (filter, totals) in others {
        for ((_, number), theirs) in totals.iter().filter(|((mode, _), _)| mode == "speed") {
            if let Some(own) = broad::updates_a_second(folder, number)? {
                text += &format!(
                    "updates a second on recording {number}, one thread: this filter {own:.3e}, {filter} {theirs:.3e}, \
                     {:.2} times\n",
                    own / theirs
                );
            }
        }
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use logs::score::Rmse;

    use super::*;
    use crate::broad::MODES;

    #[test]
    fn means_are_given_only_where_every_recording_was_run() {
        let mut csv = String::from("filter,recording,mode,total,heading,inclination\n");
        for number in TUNE {
            csv += &format!("VQF,{number},full,2.0,1.0,1.0\n");
        }
        csv += "VQF,01,full,7.0,1.0,1.0\nrubbish\n";
        let ours: Vec<Line> = TUNE
            .iter()
            .chain(&REPORT)
            .map(|number| (number.to_string(), [None; MODES]))
            .collect();
        let text = format(&ours, &parse(&csv));
        let line = text.lines().find(|line| line.starts_with("VQF")).expect("a line");
        assert_eq!(
            line.split_whitespace().collect::<Vec<_>>(),
            ["VQF", "2.00", "-", "-", "-", "-", "-", "-", "-"]
        );
    }

    #[test]
    fn a_group_has_the_peer_that_is_best_in_it_beside_it() {
        let rmse = |total_deg| {
            Some(Rmse {
                total_deg,
                heading_deg: 0.0,
                inclination_deg: 0.0,
            })
        };
        let ours = vec![("24".to_string(), [rmse(1.5); MODES])];
        let csv = "filter,recording,mode,total,heading,inclination\nVQF,24,full,2.0,,\nMadgwick,24,full,1.25,,\nVQF,26,full,1,,\n";
        let text = format_groups(&ours, &parse(csv));
        let line = text.lines().find(|line| line.starts_with("tapping")).expect("a line");
        assert_eq!(
            line.split_whitespace().collect::<Vec<_>>(),
            ["tapping", "1.50", "1.25", "Madgwick", "1.50", "1.50", "1.50"]
        );
        assert!(text.lines().any(|line| line == "vibrating phone"), "{text}");
    }

    #[test]
    fn without_python_it_says_why() {
        let why = run(Command::new("no-such-python"), Path::new(".")).expect_err("there is none");
        assert!(why.contains(SCRIPT), "{why}");
    }
}
