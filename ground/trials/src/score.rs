//! Verdicts against answers.
//!
//! In: pairs of an [`Answer`] and the verdict.json given on its case. Out: the figures of the diagnosis with their
//! targets, each a proportion with its interval or a mean, overall and by size of the effect. A case without a verdict
//! counts against every figure it belongs to: a tool that gives up is not scored on what it liked.

use std::fmt::Write as _;

use serde::Deserialize;

use crate::{answer::Answer, interval::clopper_pearson};

/// What of verdict.json is scored; unknown fields are passed over.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Verdict {
    /// Causes, the likeliest first; none when the twin needs nothing or nothing is named.
    pub causes: Vec<Named>,
    /// Other names with their probability.
    pub alternatives: Vec<Named>,
    /// Sets that this motion cannot tell apart.
    pub indistinguishable: Vec<Vec<String>>,
    /// Probability that something outside the library is needed.
    pub none_of_these: f64,
    /// What became of the gap on the hold window.
    pub shrink: Option<Shrink>,
}

/// A name with its probability.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Named {
    /// The effect.
    pub effect: String,
    /// Where.
    pub channels: Vec<String>,
    /// How sure.
    pub probability: f64,
}

/// Shrinkage on the hold window.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Shrink {
    /// Of the gap above its floor.
    pub percent: Option<f64>,
}

/// A case with what was said about it.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The truth.
    pub answer: Answer,
    /// What was said; `None` if nothing was.
    pub verdict: Option<Verdict>,
}

/// Names are said from this probability on.
const SAID: f64 = 0.5;

/// Alternatives from this probability on belong to the declared set, which holds at most [`LARGEST_SET`] names.
const IN_SET: f64 = 0.05;
const LARGEST_SET: usize = 3;

/// Effects of at least this size are expected to be found.
const MARGINAL_SNR: f64 = 8.0;

impl Verdict {
    fn said(&self) -> impl Iterator<Item = &Named> {
        self.causes.iter().filter(|cause| cause.probability >= SAID)
    }

    fn is_unknown(&self) -> bool {
        self.none_of_these >= SAID
    }

    fn declared(&self) -> Vec<&str> {
        let mut set: Vec<&str> = self.causes.iter().take(1).map(|cause| cause.effect.as_str()).collect();
        for group in &self.indistinguishable {
            if set.first().is_some_and(|first| group.iter().any(|name| name == first)) {
                set.extend(group.iter().map(String::as_str));
            }
        }
        set.extend(
            self.alternatives
                .iter()
                .filter(|named| named.probability >= IN_SET)
                .map(|named| named.effect.as_str()),
        );
        let mut distinct: Vec<&str> = Vec::new();
        for name in set {
            if !distinct.contains(&name) {
                distinct.push(name);
            }
        }
        distinct
    }

    fn probability_of(&self, name: &str) -> f64 {
        let all = self.causes.iter().chain(&self.alternatives);
        all.filter(|named| named.effect == name)
            .map(|named| named.probability)
            .fold(0.0, f64::max)
    }
}

/// A line of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// What is counted.
    pub what: String,
    /// Cases counted.
    pub trials: usize,
    /// The figure: a share, or a mean.
    pub value: f64,
    /// 95 % interval, of shares.
    pub interval: Option<(f64, f64)>,
    /// What it should be.
    pub target: &'static str,
}

fn share<'a>(
    what: impl Into<String>,
    target: &'static str,
    of: impl Iterator<Item = &'a Judged>,
    is: impl Fn(&Answer, &Verdict) -> bool,
    without: bool,
) -> Line {
    let verdicts: Vec<bool> = of
        .map(|judged| {
            judged
                .verdict
                .as_ref()
                .map_or(without, |verdict| is(&judged.answer, verdict))
        })
        .collect();
    let hits = verdicts.iter().filter(|hit| **hit).count();
    Line {
        what: what.into(),
        trials: verdicts.len(),
        value: hits as f64 / verdicts.len().max(1) as f64,
        interval: Some(clopper_pearson(hits, verdicts.len())),
        target,
    }
}

/// The table of a set of judged cases.
pub fn table(judged: &[Judged]) -> Vec<Line> {
    let ring = |name: &'static str| judged.iter().filter(move |judged| judged.answer.ring == name);
    let one = || ring("R1").filter(|judged| judged.answer.snr_marginal >= MARGINAL_SNR);
    let truth = |answer: &Answer| {
        answer
            .effects
            .first()
            .map_or(String::new(), |cause| cause.effect.clone())
    };
    let gap = |_: &Answer, verdict: &Verdict| !verdict.causes.is_empty() || verdict.is_unknown();
    let top = |answer: &Answer, verdict: &Verdict| {
        verdict
            .causes
            .first()
            .is_some_and(|cause| cause.effect == truth(answer))
    };
    let in_set = |answer: &Answer, verdict: &Verdict| {
        let set = verdict.declared();
        set.len() <= LARGEST_SET && set.contains(&truth(answer).as_str())
    };
    let mut lines = vec![
        share("gap detected (one effect)", ">= 0.98", one(), gap, false),
        share(
            "false name, nothing wrong",
            "<= 0.02",
            ring("R0"),
            |_, verdict| verdict.said().next().is_some(),
            true,
        ),
        share(
            "unknown called, nothing wrong",
            "<= 0.02",
            ring("R0"),
            |_, verdict| verdict.is_unknown(),
            true,
        ),
        share("top-1", ">= 0.92", one(), top, false),
        share("truth in declared set of at most 3", ">= 0.97", one(), in_set, false),
        share(
            "false name, novel",
            "<= 0.05",
            ring("R3"),
            |_, verdict| verdict.said().next().is_some() && !verdict.is_unknown(),
            true,
        ),
        share(
            "none of these, novel",
            ">= 0.85",
            ring("R3"),
            |_, verdict| verdict.is_unknown(),
            false,
        ),
    ];
    for (stratum, least, most) in [
        ("8 to 15", 8.0, 15.0),
        ("15 to 50", 15.0, 50.0),
        ("above 50", 50.0, f64::INFINITY),
    ] {
        let within = one().filter(move |judged| (least..most).contains(&judged.answer.snr_marginal));
        lines.push(share(format!("top-1, SNR {stratum}"), "", within, top, false));
    }
    let mean = |what: &str, target, values: Vec<f64>| Line {
        what: what.into(),
        trials: values.len(),
        value: values.iter().sum::<f64>() / values.len().max(1) as f64,
        interval: None,
        target,
    };
    let with_verdict = |judged: &Judged, value: &dyn Fn(&Verdict) -> f64| judged.verdict.as_ref().map_or(0.0, value);
    let on_truth = one().map(|judged| with_verdict(judged, &|verdict| verdict.probability_of(&truth(&judged.answer))));
    lines.push(mean("mean probability on the truth", ">= 0.88", on_truth.collect()));
    let f1 = one().map(|judged| with_verdict(judged, &|verdict| localisation_f1(&judged.answer, verdict)));
    lines.push(mean("localisation F1 (channels)", ">= 0.90", f1.collect()));
    lines.push(mean(
        "calibration error (ECE)",
        "<= 0.05",
        vec![expected_calibration_error(one())],
    ));
    let mut shrinks: Vec<f64> = one()
        .filter(|judged| judged.answer.snr_marginal >= 15.0)
        .map(|judged| {
            with_verdict(judged, &|verdict| {
                verdict.shrink.as_ref().and_then(|shrink| shrink.percent).unwrap_or(0.0)
            })
        })
        .collect();
    shrinks.sort_by(f64::total_cmp);
    lines.push(Line {
        trials: shrinks.len(),
        value: shrinks.get(shrinks.len() / 2).copied().unwrap_or(0.0),
        ..mean("median held-out shrink [%], SNR >= 15", ">= 95", Vec::new())
    });
    lines.extend(two_effects(ring("R4").collect()));
    lines
}

/// Channels named against channels touched.
fn localisation_f1(answer: &Answer, verdict: &Verdict) -> f64 {
    let touched: Vec<&String> = answer.effects.iter().flat_map(|cause| &cause.channels).collect();
    let named: Vec<&String> = verdict
        .causes
        .iter()
        .take(1)
        .flat_map(|cause| &cause.channels)
        .collect();
    let both = named.iter().filter(|name| touched.contains(name)).count() as f64;
    2.0 * both / (touched.len() + named.len()).max(1) as f64
}

/// Mean distance between stated and observed share of right names, over ten bins of equal mass (gap.md, section 6).
fn expected_calibration_error<'a>(cases: impl Iterator<Item = &'a Judged>) -> f64 {
    const BINS: usize = 10;
    let mut stated: Vec<(f64, bool)> = cases
        .filter_map(|judged| {
            let cause = judged.verdict.as_ref()?.causes.first()?;
            Some((
                cause.probability,
                judged.answer.effects.iter().any(|truth| truth.effect == cause.effect),
            ))
        })
        .collect();
    stated.sort_by(|a, b| a.0.total_cmp(&b.0));
    let bin = stated.len().div_ceil(BINS).max(1);
    let error = |bin: &[(f64, bool)]| {
        let (said, right): (f64, f64) = bin.iter().fold((0.0, 0.0), |(said, right), (p, hit)| {
            (said + p, right + f64::from(u8::from(*hit)))
        });
        (said - right).abs()
    };
    stated.chunks(bin).map(error).sum::<f64>() / stated.len().max(1) as f64
}

fn two_effects(cases: Vec<&Judged>) -> [Line; 2] {
    let (mut named, mut right, mut there) = (0, 0, 0);
    for judged in &cases {
        let names: Vec<&str> = judged
            .verdict
            .iter()
            .flat_map(Verdict::said)
            .map(|cause| cause.effect.as_str())
            .collect();
        named += names.len();
        there += judged.answer.effects.len();
        right += judged
            .answer
            .effects
            .iter()
            .filter(|cause| names.contains(&cause.effect.as_str()))
            .count();
    }
    let line = |what: &str, target, trials: usize| Line {
        what: what.into(),
        trials,
        value: right as f64 / trials.max(1) as f64,
        interval: Some(clopper_pearson(right.min(trials), trials)),
        target,
    };
    [
        line("two effects: precision", ">= 0.92", named),
        line("two effects: recall", ">= 0.88", there),
    ]
}

/// The table as Markdown.
pub fn markdown(lines: &[Line]) -> String {
    let mut text = String::from("| figure | cases | value | 95 % interval | target |\n|---|---:|---:|---|---|\n");
    for line in lines {
        let interval = line
            .interval
            .map_or(String::new(), |(least, most)| format!("{least:.3} to {most:.3}"));
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {} | {:.3} | {interval} | {} |",
            line.what, line.trials, line.value, line.target
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Cause;

    fn judged(ring: &str, truth: &[&str], verdict: Option<&str>) -> Judged {
        let cause = |name: &&str| Cause {
            effect: name.to_string(),
            in_library: true,
            channels: vec!["g1".into()],
            strength: 1.0,
        };
        Judged {
            answer: Answer {
                case: "T".into(),
                ring: ring.into(),
                seed: 0,
                effects: truth.iter().map(cause).collect(),
                snr_marginal: 20.0,
            },
            verdict: verdict.map(|text| serde_json::from_str(text).expect("a verdict")),
        }
    }

    fn value(lines: &[Line], what: &str) -> f64 {
        lines.iter().find(|line| line.what == what).expect(what).value
    }

    const RIGHT: &str = r#"{"causes":[{"effect":"gyro-bias","channels":["g1"],"probability":0.9}],"none_of_these":0.02,
        "alternatives":[{"effect":"gyro-g2","probability":0.08}],"shrink":{"percent":97.0}}"#;
    const WRONG: &str = r#"{"causes":[{"effect":"gyro-g2","channels":["g1","g2"],"probability":0.9}],
        "indistinguishable":[["gyro-bias","gyro-g2"]],"none_of_these":0.0}"#;
    const UNKNOWN: &str = r#"{"causes":[],"none_of_these":0.9}"#;
    const NOTHING: &str = r#"{"causes":[],"none_of_these":0.01}"#;

    #[test]
    fn right_and_wrong_names_are_told_apart() {
        let lines = table(&[
            judged("R1", &["gyro-bias"], Some(RIGHT)),
            judged("R1", &["gyro-bias"], Some(WRONG)),
        ]);
        assert_eq!(value(&lines, "top-1"), 0.5);
        assert_eq!(value(&lines, "truth in declared set of at most 3"), 1.0);
        assert_eq!(value(&lines, "gap detected (one effect)"), 1.0);
        assert_eq!(value(&lines, "mean probability on the truth"), 0.45);
        assert!((value(&lines, "localisation F1 (channels)") - (1.0 + 2.0 / 3.0) / 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_name_where_there_is_none_is_false() {
        let lines = table(&[
            judged("R0", &[], Some(RIGHT)),
            judged("R0", &[], Some(NOTHING)),
            judged("R3", &["slow-tone"], Some(RIGHT)),
            judged("R3", &["slow-tone"], Some(UNKNOWN)),
        ]);
        assert_eq!(value(&lines, "false name, nothing wrong"), 0.5);
        assert_eq!(value(&lines, "unknown called, nothing wrong"), 0.0);
        assert_eq!(value(&lines, "false name, novel"), 0.5);
        assert_eq!(value(&lines, "none of these, novel"), 0.5);
    }

    #[test]
    fn giving_up_counts_against_the_tool() {
        let lines = table(&[
            judged("R0", &[], None),
            judged("R1", &["gyro-bias"], None),
            judged("R3", &["slow-tone"], None),
        ]);
        for (what, worst) in [
            ("false name, nothing wrong", 1.0),
            ("top-1", 0.0),
            ("false name, novel", 1.0),
            ("none of these, novel", 0.0),
        ] {
            assert_eq!(value(&lines, what), worst, "{what}");
        }
    }

    #[test]
    fn two_effects_are_counted_one_by_one() {
        let both = r#"{"causes":[{"effect":"gyro-bias","probability":0.9},{"effect":"lever-arm","probability":0.9}]}"#;
        let lines = table(&[
            judged("R4", &["gyro-bias", "hard-iron"], Some(both)),
            judged("R4", &["gyro-bias", "lever-arm"], Some(both)),
        ]);
        assert_eq!(value(&lines, "two effects: precision"), 0.75);
        assert_eq!(value(&lines, "two effects: recall"), 0.75);
    }
}
