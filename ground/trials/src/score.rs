//! Verdicts against answers.
//!
//! In: pairs of an [`Answer`] and the verdict.json given on its case. Out: the figures of the diagnosis with their
//! targets, each a proportion with its interval or a mean, overall and by size of the effect. A case without a verdict
//! counts against every figure it belongs to: a tool that gives up is not scored on what it liked.

use std::{collections::BTreeSet, fmt::Write as _};

pub mod page;
mod sizes;
pub(crate) mod statements;
mod verdict;
mod withheld;

pub(crate) use sizes::efficiency;
use verdict::LARGEST_SET;
pub use verdict::{Named, Remainder, Shrink, Stated, Verdict};

use crate::{answer::Answer, interval::clopper_pearson};

/// A case with what was said about it.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The truth.
    pub answer: Answer,
    /// What was said; `None` if nothing was.
    pub verdict: Option<Verdict>,
    /// Channels of its unit that have an axis, where that is known.
    pub channels: Option<usize>,
}

/// Effects of at least this size are expected to be found.
const MARGINAL_SNR: f64 = 8.0;

/// Ring of the cases whose effects were withheld from the library: the right verdict is "none of these".
pub const WITHHELD: &str = "R2";

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
            ring("R3").filter(|judged| judged.answer.snr_marginal >= MARGINAL_SNR),
            |_, verdict| verdict.is_unknown(),
            false,
        ),
    ];
    let withheld = || ring(WITHHELD).filter(|judged| judged.answer.snr_marginal >= MARGINAL_SNR);
    lines.push(share(
        "false name, withheld",
        "<= 0.05",
        withheld(),
        |_, verdict| verdict.said().next().is_some() && !verdict.is_unknown(),
        true,
    ));
    lines.push(share(
        "none of these, withheld",
        ">= 0.90",
        withheld(),
        |_, verdict| verdict.is_unknown(),
        false,
    ));
    lines.push(share(
        "90 % set holds the truth",
        "0.88 to 0.97",
        one(),
        |answer, verdict| verdict.credible(0.9).contains(&Some(truth(answer).as_str())),
        false,
    ));
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
    let f1 = |cell: fn(&str) -> &str| {
        one()
            .map(|judged| with_verdict(judged, &|verdict| localisation_f1(&judged.answer, verdict, cell)))
            .collect()
    };
    lines.push(mean("localisation F1 (sensors)", ">= 0.90", f1(sensor_of)));
    lines.push(mean("localisation F1 (channels)", "", f1(|channel| channel)));
    let first = first_names(one());
    lines.push(Line {
        trials: first.len(),
        value: expected_calibration_error(first),
        ..mean("calibration error (ECE)", "<= 0.05", Vec::new())
    });
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
    lines.extend(sizes::lines(judged));
    lines.extend(several_effects("R4", [">= 0.95", ">= 0.90"], ring("R4").collect()));
    lines.extend(several_effects("R6", [">= 0.90", ">= 0.80"], ring("R6").collect()));
    lines.extend(statements::lines(judged));
    lines.extend(withheld::lines(judged));
    lines
}

/// The sensor of a channel: `a3` of `a3x`, which is what localisation is counted over.
fn sensor_of(channel: &str) -> &str {
    channel.trim_end_matches(['x', 'y', 'z'])
}

/// Cells named against cells touched.
fn localisation_f1(answer: &Answer, verdict: &Verdict, cell: fn(&str) -> &str) -> f64 {
    let cells = |channels: &mut dyn Iterator<Item = &String>| -> BTreeSet<String> {
        channels.map(|channel| cell(channel).to_owned()).collect()
    };
    let touched = cells(&mut answer.effects.iter().flat_map(|cause| &cause.channels));
    let named = cells(&mut verdict.causes.iter().take(1).flat_map(|cause| &cause.channels));
    let both = touched.intersection(&named).count() as f64;
    2.0 * both / (touched.len() + named.len()).max(1) as f64
}

/// First names with their probability, and whether they are right.
fn first_names<'a>(cases: impl Iterator<Item = &'a Judged>) -> Vec<(f64, bool)> {
    cases
        .filter_map(|judged| {
            let cause = judged.verdict.as_ref()?.causes.first()?;
            let is_right = judged.answer.effects.iter().any(|truth| truth.effect == cause.effect);
            Some((cause.probability, is_right))
        })
        .collect()
}

/// Mean distance between stated and observed share of what is so, over ten bins of equal mass.
fn expected_calibration_error(mut stated: Vec<(f64, bool)>) -> f64 {
    const BINS: usize = 10;
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

fn several_effects(ring: &str, targets: [&'static str; 2], cases: Vec<&Judged>) -> [Line; 2] {
    let (mut named, mut right) = (0, 0);
    let (mut there, mut found) = (0, 0);
    for judged in &cases {
        // One effect in two places is one name, as it is one in the answer.
        let names: BTreeSet<&str> = judged
            .verdict
            .iter()
            .flat_map(Verdict::said)
            .map(|cause| cause.effect.as_str())
            .collect();
        named += names.len();
        for cause in &judged.answer.effects {
            let is_named = names.contains(cause.effect.as_str());
            let is_seen = cause.snr_marginal.is_none_or(|ratio| ratio >= MARGINAL_SNR);
            right += usize::from(is_named);
            there += usize::from(is_seen);
            found += usize::from(is_named && is_seen);
        }
    }
    let line = |what: &str, target, right: usize, trials: usize| Line {
        what: format!("{ring}: {what}"),
        trials,
        value: right as f64 / trials.max(1) as f64,
        interval: Some(clopper_pearson(right.min(trials), trials)),
        target,
    };
    [
        line("precision", targets[0], right, named),
        line("recall", targets[1], found, there),
    ]
}

/// The tables of several tools side by side as Markdown; intervals are those of the first.
pub fn markdown(tools: &[(String, Vec<Line>)]) -> String {
    let Some(((first, lines), others)) = tools.split_first() else {
        return String::new();
    };
    let names: String = others.iter().map(|(name, _)| format!(" {name} |")).collect();
    let rules = "---:|".repeat(others.len());
    let mut text =
        format!("| figure | cases | {first} | 95 % interval | target |{names}\n|---|---:|---:|---|---|{rules}\n");
    for (at, line) in lines.iter().enumerate() {
        let interval = line
            .interval
            .map_or(String::new(), |(least, most)| format!("{least:.3} to {most:.3}"));
        let beside: String = others
            .iter()
            .map(|(_, lines)| {
                lines
                    .get(at)
                    .filter(|line| line.trials > 0)
                    .map_or(" |".to_owned(), |line| format!(" {:.3} |", line.value))
            })
            .collect();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {} | {:.3} | {interval} | {} |{beside}",
            line.what, line.trials, line.value, line.target
        );
    }
    text
}

#[cfg(test)]
mod tests;
