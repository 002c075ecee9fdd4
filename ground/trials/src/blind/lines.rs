//! Judged cases as JSON lines: what of a deal is worth carrying to where many deals are scored together.
//!
//! In: judged cases. Out: `judged.jsonl`, a case a line, written whole or not at all; and from any number of such files of a folder the
//! cases again. Hashes were checked when the lines were written. A line that does not end is of a file that was cut, and an error.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{BlindError, VERDICT, files::entries};
use crate::{answer::Answer, score::Judged};

/// The file of a deal.
const LINES: &str = "judged.jsonl";

/// A line.
#[derive(Serialize, Deserialize)]
struct One {
    answer: Answer,
    channels: Option<usize>,
    /// As the diagnosis wrote it.
    verdict: Option<Value>,
}

/// Writes those of a deal; tells where.
///
/// # Errors
/// When a file cannot be read or written.
pub fn write(folder: &Path, judged: &[Judged]) -> Result<PathBuf, BlindError> {
    let path = folder.join(LINES);
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| BlindError::File { path, source }
    };
    let json = |path: &Path| {
        let path = path.to_owned();
        move |source| BlindError::Json { path, source }
    };
    let mut text = String::new();
    for case in judged {
        let verdict = folder.join(&case.answer.case).join(VERDICT);
        let one = One {
            answer: case.answer.clone(),
            channels: case.channels,
            verdict: match case.verdict {
                Some(_) => {
                    let written = fs::read_to_string(&verdict).map_err(failed(&verdict))?;
                    let mut written: Value = serde_json::from_str(&written).map_err(json(&verdict))?;
                    let error_deg = case.verdict.as_ref().and_then(|own| own.attitude.as_ref()?.error_deg);
                    if let (Some(attitude), Some(error_deg)) = (written.get_mut("attitude"), error_deg) {
                        // What the case's folder tells and its verdict cannot know.
                        attitude["error_deg"] = error_deg.into();
                    }
                    Some(written)
                }
                None => None,
            },
        };
        text.push_str(&serde_json::to_string(&one).map_err(json(&path))?);
        text.push('\n');
    }
    let unfinished = path.with_extension("jsonl.part");
    fs::write(&unfinished, text).map_err(failed(&unfinished))?;
    fs::rename(&unfinished, &path).map_err(failed(&path))?;
    Ok(path)
}

/// Cases of all files of JSON lines in a folder and in the folders in it; none where there are no such files.
///
/// # Errors
/// When one cannot be read.
pub fn read(folder: &Path) -> Result<Vec<Judged>, BlindError> {
    let mut paths = entries(folder)?;
    for inner in paths.clone().iter().filter(|path| path.is_dir()) {
        paths.extend(entries(inner)?);
    }
    let mut judged = Vec::new();
    for path in paths
        .iter()
        .filter(|path| path.extension().is_some_and(|end| end == "jsonl"))
    {
        let text = fs::read_to_string(path).map_err(|source| BlindError::File {
            path: path.clone(),
            source,
        })?;
        for line in text.lines() {
            let json = |source| BlindError::Json {
                path: path.clone(),
                source,
            };
            let one: One = serde_json::from_str(line).map_err(json)?;
            judged.push(Judged {
                answer: one.answer,
                channels: one.channels,
                verdict: one.verdict.map(serde_json::from_value).transpose().map_err(json)?,
            });
        }
    }
    Ok(judged)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score;

    #[test]
    fn lines_score_as_the_cases_do_and_a_cut_one_is_an_error() {
        let place = tempfile::tempdir().expect("a folder");
        let deal = place.path().join("deal");
        let verdict =
            "{\n \"causes\": [{\"effect\": \"gyro-bias\", \"probability\": 0.9}],\n \"none_of_these\": 0.1\n}";
        let cases: Vec<Judged> = ["R0", "R3", "R0"]
            .iter()
            .enumerate()
            .map(|(at, ring)| {
                let case = format!("T{at}");
                let said = at != 2;
                fs::create_dir_all(deal.join(&case)).expect("a folder");
                fs::write(deal.join(&case).join(VERDICT), verdict).expect("written");
                Judged {
                    answer: Answer {
                        case,
                        attitudes: Vec::new(),
                        ring: (*ring).to_owned(),
                        seed: 7,
                        effects: Vec::new(),
                        snr_marginal: 0.0,
                        source: None,
                    },
                    verdict: said.then(|| serde_json::from_str(verdict).expect("a verdict")),
                    channels: Some(28),
                }
            })
            .collect();
        let path = write(&deal, &cases).expect("written");
        assert_eq!(fs::read_to_string(&path).expect("lines").lines().count(), 3);
        let again = read(place.path()).expect("read");
        assert_eq!(score::table(&again), score::table(&cases));
        let text = fs::read_to_string(&path).expect("lines");
        fs::write(&path, &text[..text.len() - 9]).expect("cut");
        assert!(matches!(read(place.path()), Err(BlindError::Json { .. })));
    }
}
