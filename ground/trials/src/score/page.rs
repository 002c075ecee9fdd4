//! A deal's result as it is kept: one table of all cases, one page of figures.
//!
//! In: judged cases, the tools' tables, a name. Out: `NAME.csv`, a case a row, and `NAME.md`. Neither is written where it stands already: a
//! deal that was looked at is history. Lists in a cell are separated by semicolons; an empty cell is not known.

use std::{
    fs,
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use super::{Judged, Line, Verdict, markdown, statements};

/// Columns of the table.
const COLUMNS: [&str; 30] = [
    "case",
    "ring",
    "seed",
    "source",
    "effects",
    "ratio",
    "attitude_deg",
    "gap_growth",
    "outcome",
    "names",
    "probabilities",
    "none_of_these",
    "present",
    "matters",
    "remainder_sigma",
    "remainder_low",
    "remainder_high",
    "remainder_deg",
    "gap_floor",
    "hold_before",
    "hold_after",
    "is_answered",
    "has_false_name",
    "is_first_right",
    "does_matter",
    "is_interval_held",
    "ratio_by_parity",
    "ratio_of_course",
    "attitude_error_deg",
    "attitude_sigma_deg",
];

/// Writes both files into `folder`; tells where.
///
/// # Errors
/// When one stands already or cannot be written.
pub fn keep(
    folder: &Path,
    name: &str,
    judged: &[Judged],
    tools: &[(String, Vec<Line>)],
) -> Result<[PathBuf; 2], (PathBuf, io::Error)> {
    let [table, page] = ["csv", "md"].map(|end| folder.join(format!("{name}.{end}")));
    let new = |path: &Path, bytes: &[u8]| {
        let mut file = fs::File::create_new(path).map_err(|source| (path.to_owned(), source))?;
        file.write_all(bytes).map_err(|source| (path.to_owned(), source))
    };
    fs::create_dir_all(folder).map_err(|source| (folder.to_owned(), source))?;
    let rows = csv(judged).map_err(|source| (table.clone(), source))?;
    let text = format!(
        "# {name}\n\n{} cases; [each of them]({name}.csv). Figures of trials that were not there are left out.\n\n{}",
        judged.len(),
        markdown(&there(tools))
    );
    // The page first: it is the one whose name is refused if the deal was kept before.
    new(&page, text.as_bytes())?;
    new(&table, &rows)?;
    Ok([table, page])
}

/// The tables without lines that count nothing.
fn there(tools: &[(String, Vec<Line>)]) -> Vec<(String, Vec<Line>)> {
    let first = tools.first().map_or(&[][..], |tool| tool.1.as_slice());
    let kept: Vec<bool> = first.iter().map(|line| line.trials > 0).collect();
    tools
        .iter()
        .map(|(name, lines)| {
            let lines = lines
                .iter()
                .enumerate()
                .filter(|(at, _)| kept.get(*at).copied().unwrap_or(false));
            (name.clone(), lines.map(|(_, line)| line.clone()).collect())
        })
        .collect()
}

fn csv(judged: &[Judged]) -> io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS)?;
    for case in judged {
        writer.write_record(row(case))?;
    }
    writer.into_inner().map_err(|error| error.into_error())
}

fn row(judged: &Judged) -> [String; COLUMNS.len()] {
    let (answer, verdict) = (&judged.answer, judged.verdict.as_ref());
    let joined = |list: Vec<String>| list.join(";");
    let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.4}"));
    let of = |value: &dyn Fn(&Verdict) -> Option<f64>| number(verdict.and_then(value));
    let is = |value: Option<bool>| value.map_or(String::new(), |value| value.to_string());
    let most = |value: fn(&crate::answer::Cause) -> Option<f64>| {
        number(answer.effects.iter().filter_map(value).reduce(f64::max))
    };
    let left = |value: &dyn Fn(&super::verdict::Remainder) -> f64| of(&|verdict| verdict.remainder.as_ref().map(value));
    let shrink = |value: &dyn Fn(&super::Shrink) -> Option<f64>| of(&|verdict| verdict.shrink.as_ref().and_then(value));
    let first_right = (!answer.effects.is_empty()).then(|| {
        let first = verdict.and_then(|verdict| verdict.causes.first());
        first.is_some_and(|first| answer.effects.iter().any(|truth| truth.effect == first.effect))
    });
    let causes = |of: &dyn Fn(&super::Named) -> String| {
        joined(verdict.iter().flat_map(|verdict| &verdict.causes).map(of).collect())
    };
    [
        answer.case.clone(),
        answer.ring.clone(),
        answer.seed.to_string(),
        answer.source.clone().unwrap_or_default(),
        joined(answer.effects.iter().map(|truth| truth.effect.clone()).collect()),
        format!("{:.2}", answer.snr_marginal),
        most(|truth| truth.attitude_deg),
        most(|truth| truth.gap_growth),
        verdict.and_then(|verdict| verdict.outcome.clone()).unwrap_or_default(),
        causes(&|cause| cause.effect.clone()),
        causes(&|cause| format!("{:.4}", cause.probability)),
        of(&|verdict| Some(verdict.none_of_these)),
        left(&|own| own.present),
        left(&|own| own.matters),
        left(&|own| own.sigma.value),
        left(&|own| own.sigma.interval_90[0]),
        left(&|own| own.sigma.interval_90[1]),
        of(&|verdict| Some(verdict.remainder.as_ref()?.attitude_deg?.value)),
        of(&|verdict| Some(verdict.gap.floor)),
        shrink(&|own| own.hold_before),
        shrink(&|own| own.hold_after),
        verdict.is_some().to_string(),
        is(verdict.map(|verdict| statements::has_false_name(answer, verdict))),
        is(first_right),
        is(verdict.and_then(|verdict| statements::matters(answer, verdict))),
        is(statements::is_held(judged)),
        most(|truth| truth.snr_withheld.map(|own| own.0)),
        most(|truth| truth.snr_withheld.and_then(|own| own.1)),
        of(&|verdict| verdict.attitude.as_ref()?.error_deg),
        of(&|verdict| verdict.attitude.as_ref()?.sigma_deg),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Answer;

    #[test]
    fn a_deal_that_was_kept_is_not_written_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let case = Judged {
            answer: Answer {
                case: "T001".into(),
                attitudes: Vec::new(),
                ring: "R0".into(),
                seed: 1,
                effects: Vec::new(),
                snr_marginal: 0.0,
                source: Some("a recording, cut".into()),
            },
            verdict: serde_json::from_str(r#"{"causes":[{"effect":"gyro-bias","probability":0.9}],"outcome":"named"}"#)
                .ok(),
            channels: None,
        };
        let tools = [("diagnosis".to_owned(), super::super::table(std::slice::from_ref(&case)))];
        let [table, page] = keep(folder.path(), "one", std::slice::from_ref(&case), &tools).expect("kept");
        let mut reader = csv::Reader::from_path(&table).expect("a table");
        let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().expect("rows");
        assert_eq!(
            (rows.len(), rows[0].len(), &rows[0][3]),
            (1, COLUMNS.len(), "a recording, cut")
        );
        assert_eq!((&rows[0][9], &rows[0][22]), ("gyro-bias", "true"));
        let text = fs::read_to_string(&page).expect("a page");
        assert!(text.contains("| R0: false name, flag or not | 1 | 1.000 |") && !text.contains("| R7: top-1 |"));
        let (path, again) = keep(folder.path(), "one", &[case], &tools).expect_err("stands already");
        assert_eq!((path, again.kind()), (page, io::ErrorKind::AlreadyExists));
    }
}
