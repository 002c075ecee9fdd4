//! How large an effect was said to be, and how far the gap would shrink by that, against what they were.
//!
//! In: judged cases of one effect that was named right. Out: medians over them.

use super::{Judged, Line, Named, Verdict};

/// Effects of at least this ratio have a size that is known.
const SIZED_SNR: f64 = 30.0;

/// And of this a gap that shrinks.
const SHRUNK_SNR: f64 = 15.0;

/// Median of what is said of sizes: relative error, and what it lets the held-out gap shrink by against what it did.
pub(super) fn lines(judged: &[Judged]) -> [Line; 2] {
    let above = |snr: f64| judged.iter().filter(move |judged| judged.answer.snr_marginal >= snr);
    [
        median(
            "median error of the parameters [%], SNR >= 30",
            "<= 5",
            above(SIZED_SNR).filter_map(|judged| Some(100.0 * error(judged, named(judged)?)?)),
        ),
        median(
            "median of predicted less achieved shrink [points], SNR >= 15",
            "<= 3",
            above(SHRUNK_SNR).filter_map(|judged| {
                named(judged)?;
                let verdict = judged.verdict.as_ref()?;
                Some((predicted_percent(verdict)? - verdict.shrink.as_ref()?.percent?).abs())
            }),
        ),
    ]
}

/// Median part of the oracle's held-out shrink that a tool reaches.
pub(crate) fn efficiency(judged: &[Judged], oracle: &[Judged]) -> Line {
    let percent = |judged: &Judged| judged.verdict.as_ref()?.shrink.as_ref()?.percent;
    let of_one = judged
        .iter()
        .filter(|judged| judged.answer.ring == "R1" && judged.answer.snr_marginal >= SHRUNK_SNR);
    let parts = of_one.filter_map(|own| {
        let oracle = oracle.iter().find(|oracle| oracle.answer.case == own.answer.case)?;
        let best = percent(oracle).filter(|best| *best > 0.0)?;
        Some(percent(own).unwrap_or(0.0) / best)
    });
    median("median part of the oracle's shrink, SNR >= 15", ">= 0.97", parts)
}

fn median(what: &str, target: &'static str, values: impl Iterator<Item = f64>) -> Line {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    Line {
        what: what.into(),
        trials: values.len(),
        value: values.get(values.len() / 2).copied().unwrap_or(0.0),
        interval: None,
        target,
    }
}

/// The first cause of a case of one effect, if it is that.
fn named(judged: &Judged) -> Option<&Named> {
    let first = judged.verdict.as_ref()?.causes.first()?;
    let truth = judged.answer.effects.first()?;
    (judged.answer.ring == "R1" && truth.effect == first.effect).then_some(first)
}

/// Relative error of its parameters: the norm of what they are off by over that of what they are. What was not stated was said
/// to be nothing. `None` where the answer has none.
fn error(judged: &Judged, named: &Named) -> Option<f64> {
    let sizes = &judged.answer.effects.first()?.sizes;
    let stated = |parameter: &str, channel: &Option<String>| {
        let own = channel.as_ref().map(|channel| format!("{parameter}_{channel}"));
        let found = own.and_then(|own| named.parameters.get(&own));
        let is_common = channel.as_ref().is_none_or(|channel| named.channels.contains(channel));
        found
            .or_else(|| named.parameters.get(parameter).filter(|_| is_common))
            .map_or(0.0, |stated| stated.value)
    };
    let (off, whole) = sizes.iter().fold((0.0, 0.0), |(off, whole), size| {
        let miss = stated(&size.parameter, &size.channel) - size.value;
        (off + miss * miss, whole + size.value * size.value)
    });
    (whole > 0.0).then(|| f64::sqrt(off / whole))
}

/// \[%\] by which what a verdict states of its causes lets the held-out gap shrink: `p` parameters known to `SNR^2`, the sum of
/// their squares over their variances, leave `p / SNR^2` of the excess energy.
fn predicted_percent(verdict: &Verdict) -> Option<f64> {
    let floor = verdict.gap.floor;
    let before = verdict
        .shrink
        .as_ref()?
        .hold_before
        .filter(|before| *before > floor + 0.01)?;
    let parameters = || verdict.causes.iter().flat_map(|cause| cause.parameters.values());
    let known = parameters().filter(|stated| stated.sigma > 0.0);
    let energy: f64 = known.clone().map(|stated| (stated.value / stated.sigma).powi(2)).sum();
    let left = known.count() as f64 / energy;
    let (least, excess) = (floor * floor, before * before - floor * floor);
    (left < 1.0).then(|| 100.0 * (before - (least + excess * left).sqrt()) / (before - floor))
}
