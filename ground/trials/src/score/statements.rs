//! All that a verdict states, against the answer: names, that nothing is wrong, that what is left matters, how large that is.
//!
//! In: judged cases of all rings. Out: lines for the table. A name said is false if the answer has not got it, whether or not a flag is
//! raised beside it. A probability is counted for every name, for "nothing is wrong" (what is left of the names and of what matters,
//! `(1 - matters) prod (1 - p)`) and for "what is left matters".
//!
//! What is left matters where something is there that no name said covers, and that is larger than what a case cares about: half a
//! degree of attitude or a twentieth of the gap, as the trials measured it. Where they did not (deals up to seed 29113002), something
//! novel matters from [`MARGINAL_SNR`] on, and a cause that was not said is left out. A ratio of 8 alone is no matter: on 1,500 samples it
//! is a gap that grows by a fiftieth.
//!
//! The interval of what is left can be held against the held-out windows without an answer: their gap after the correction is
//! `sqrt(floor^2 + m/n s^2)` if `m` of `n` channels scatter by `s` sigma more than they should.

use super::{Answer, Judged, Line, MARGINAL_SNR, Verdict, WITHHELD, expected_calibration_error, share};
use crate::answer::Cause;

/// What a case cares about: \[deg\] of attitude, and growth of the gap.
const ATTITUDE_DEG: f64 = 0.5;
const GAP_GROWTH: f64 = 0.05;

/// Rings in the order of the table.
const RINGS: [&str; 9] = ["R0", "R0m", "R1", WITHHELD, "R3", "R4", "R5", "R6", "R7"];

/// Something stated with a probability, and whether it is so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Statement {
    pub(crate) what: What,
    pub(crate) probability: f64,
    pub(crate) is_so: bool,
}

/// What may be stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum What {
    Name,
    Clean,
    Matters,
}

/// Whether a name that is said is not in the answer; with an effect withheld its own name cannot be said.
pub(crate) fn has_false_name(answer: &Answer, verdict: &Verdict) -> bool {
    let is_there = |name: &str| answer.effects.iter().any(|truth| truth.effect == name);
    verdict.said().any(|cause| !is_there(&cause.effect))
}

/// Whether what is left matters; `None` where the trials do not know.
pub(crate) fn matters(answer: &Answer, verdict: &Verdict) -> Option<bool> {
    let is_said = |name: &str| verdict.said().any(|cause| cause.effect == name);
    let left = answer.effects.iter().filter(|truth| !is_said(&truth.effect));
    let each: Vec<Option<bool>> = left.map(|truth| is_more_than_the_bar(answer, truth)).collect();
    // One that matters decides; one that is not known leaves it open.
    match each.contains(&Some(true)) {
        true => Some(true),
        false => (!each.contains(&None)).then_some(false),
    }
}

/// Whether one thing that is wrong is more than a case cares about; `None` where the trials do not know.
fn is_more_than_the_bar(answer: &Answer, truth: &Cause) -> Option<bool> {
    match (truth.attitude_deg, truth.gap_growth) {
        (Some(attitude_deg), Some(growth)) => Some(attitude_deg > ATTITUDE_DEG || growth > GAP_GROWTH),
        _ => {
            let is_plain = truth.snr_marginal.unwrap_or(answer.snr_marginal) >= MARGINAL_SNR;
            (!truth.in_library && is_plain).then_some(true)
        }
    }
}

/// Whether anything that is wrong is.
fn is_any_more_than_the_bar(judged: &&Judged) -> bool {
    let answer = &judged.answer;
    let causes = answer.effects.iter();
    causes
        .filter_map(|truth| is_more_than_the_bar(answer, truth))
        .any(|is_so| is_so)
}

/// All statements of a case.
pub(crate) fn of(judged: &Judged) -> Vec<Statement> {
    let (answer, Some(verdict)) = (&judged.answer, &judged.verdict) else {
        return Vec::new();
    };
    let mut all: Vec<Statement> = (verdict.causes.iter())
        .map(|cause| Statement {
            what: What::Name,
            probability: cause.probability,
            is_so: answer.effects.iter().any(|truth| truth.effect == cause.effect),
        })
        .collect();
    let Some(remainder) = &verdict.remainder else {
        return all;
    };
    let nothing = verdict
        .causes
        .iter()
        .map(|cause| 1.0 - cause.probability)
        .product::<f64>();
    let is_plain = answer.effects.is_empty() || answer.snr_marginal >= MARGINAL_SNR;
    all.extend(is_plain.then_some(Statement {
        what: What::Clean,
        probability: (1.0 - remainder.matters) * nothing,
        is_so: answer.effects.is_empty(),
    }));
    all.extend(matters(answer, verdict).map(|is_so| Statement {
        what: What::Matters,
        probability: remainder.matters,
        is_so,
    }));
    all
}

/// Whether the interval of what is left holds what the held-out windows have left; `None` where it is not stated.
pub(crate) fn is_held(judged: &Judged) -> Option<bool> {
    let verdict = judged.verdict.as_ref()?;
    let (remainder, shrink) = (verdict.remainder.as_ref()?, verdict.shrink.as_ref()?);
    let (of, after) = (judged.channels? as f64, shrink.hold_after?);
    if remainder.channels.is_empty() {
        return None;
    }
    let part = remainder.channels.len() as f64 / of;
    let left = ((after * after - verdict.gap.floor * verdict.gap.floor).max(0.0) / part).sqrt();
    let [low, high] = remainder.sigma.interval_90;
    Some((low..=high).contains(&left))
}

/// Whether the outcome is one that the answer allows.
pub(crate) fn is_outcome_right(answer: &Answer, verdict: &Verdict) -> Option<bool> {
    let outcome = verdict.outcome.as_deref()?;
    let allowed: &[&str] = match answer.effects.as_slice() {
        [] => &["clean", "recalibrate"],
        [one] if !one.in_library || answer.ring == WITHHELD => &["unknown", "undecided", "partly-named"],
        [_] => &["named", "undecided", "recalibrate"],
        _ => &["named", "partly-named", "undecided"],
    };
    Some(allowed.contains(&outcome))
}

/// Mean square of what was stated less what is so.
fn brier(statements: &[Statement]) -> f64 {
    let off = statements
        .iter()
        .map(|one| (one.probability - f64::from(u8::from(one.is_so))).powi(2));
    off.sum::<f64>() / statements.len().max(1) as f64
}

/// The lines.
pub(super) fn lines(judged: &[Judged]) -> Vec<Line> {
    let ring = |name: &'static str| judged.iter().filter(move |judged| judged.answer.ring == name);
    let asked = |name: &str| match name {
        "R1" => "<= 0.01",
        "R3" | WITHHELD => "<= 0.03",
        "R0m" | "R7" => "<= 0.05",
        "R0" => "<= 0.02",
        _ => "",
    };
    let mut lines = Vec::new();
    for name in RINGS {
        lines.push(share(
            format!("{name}: false name, flag or not"),
            asked(name),
            ring(name),
            has_false_name,
            true,
        ));
    }
    let healthy = |name: &'static str| ring(name).filter(|judged| judged.answer.effects.is_empty());
    let is_flagged = |_: &Answer, verdict: &Verdict| verdict.remainder.as_ref().is_some_and(|own| own.matters >= 0.5);
    for (name, asked) in [
        ("R0", "<= 0.02"),
        ("R0m", "<= 0.05"),
        ("R5", "<= 0.2"),
        ("R7", "<= 0.2"),
    ] {
        lines.push(share(
            format!("{name}: nothing wrong, said to matter"),
            asked,
            healthy(name),
            is_flagged,
            true,
        ));
    }
    for (name, asked) in [("R0", ">= 0.98"), ("R0m", ">= 0.95"), ("R5", ""), ("R7", "")] {
        let is_clean = |answer: &Answer, verdict: &Verdict| is_outcome_right(answer, verdict).unwrap_or(false);
        lines.push(share(
            format!("{name}: nothing wrong, clean or recalibrate"),
            asked,
            healthy(name),
            is_clean,
            false,
        ));
    }
    let plain = |name: &'static str| ring(name).filter(|judged| judged.answer.snr_marginal >= MARGINAL_SNR);
    let known = plain("R7").filter(|judged| {
        judged.answer.effects.iter().all(|cause| cause.in_library) && !judged.answer.effects.is_empty()
    });
    let is_first = |answer: &Answer, verdict: &Verdict| {
        let first = verdict.causes.first();
        first.is_some_and(|first| first.effect == answer.effects[0].effect)
    };
    lines.push(share("R7: top-1", ">= 0.85", known.clone(), is_first, false));
    lines.push(share(
        "R7: top-1, of what matters",
        ">= 0.85",
        known.filter(is_any_more_than_the_bar),
        is_first,
        false,
    ));
    let novel = plain("R7")
        .chain(plain("R3"))
        .filter(|judged| judged.answer.effects.iter().any(|cause| !cause.in_library));
    lines.push(share(
        "R3, R7: novel, said to matter",
        "",
        novel.clone(),
        is_flagged,
        false,
    ));
    lines.push(share(
        "R3, R7: novel that matters, said to matter",
        ">= 0.92",
        novel.filter(is_any_more_than_the_bar),
        is_flagged,
        false,
    ));
    lines.push(share(
        "outcome allowed by the answer",
        "",
        judged
            .iter()
            .filter(|judged| judged.answer.effects.is_empty() || judged.answer.snr_marginal >= MARGINAL_SNR),
        |answer, verdict| is_outcome_right(answer, verdict).unwrap_or(false),
        false,
    ));
    let all: Vec<Statement> = judged.iter().flat_map(of).collect();
    let matters: Vec<Statement> = all.iter().copied().filter(|one| one.what == What::Matters).collect();
    let line = |what: &str, target, trials, value| Line {
        what: what.to_owned(),
        trials,
        value,
        interval: None,
        target,
    };
    lines.push(line("Brier of matters", "<= 0.1", matters.len(), brier(&matters)));
    let stated = all.iter().map(|one| (one.probability, one.is_so)).collect();
    lines.push(line(
        "ECE over all statements",
        "<= 0.03",
        all.len(),
        expected_calibration_error(stated),
    ));
    let held: Vec<bool> = judged.iter().filter_map(is_held).collect();
    let hits = held.iter().filter(|hit| **hit).count();
    lines.push(Line {
        interval: Some(crate::interval::clopper_pearson(hits, held.len())),
        ..line(
            "remainder's interval holds the held-out windows",
            "0.86 to 0.94",
            held.len(),
            hits as f64 / held.len().max(1) as f64,
        )
    });
    lines
}
