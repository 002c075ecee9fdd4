//! Cases whose motion is withheld (ring R8): what is visible is named, what is not is not.
//!
//! In: judged cases. Out: lines for the table. An effect counts as visible by the dealer's own ratio without the motion, the better of each packet by itself and
//! of one course. Of a rocket only the former is known. What a log shows of an effect is held against the dealer's by the share that is left
//! without the motion, which does not depend on the size: the row of the verdict with the kind of place that was dealt.
//!
//! A motion converged if its attitude is off by no more than three of its sigmas; that it did not settle is a right answer too.

use super::{Answer, Judged, LARGEST_SET, Line, MARGINAL_SNR, Verdict, share, statements::has_false_name};
use crate::answer::Cause;

/// Below it nothing can be seen.
const INVISIBLE_SNR: f64 = 3.0;
/// From it on something may be.
const SMALL_SNR: f64 = 5.0;
/// Sigmas that an attitude may be off by.
const CONVERGED: f64 = 3.0;
/// Part by which a share may be off.
const SHARE_OFF: f64 = 0.15;

fn cause(answer: &Answer) -> Option<&Cause> {
    answer.effects.first()
}

/// The better ratio without the motion.
fn ratio(answer: &Answer) -> f64 {
    let (parity, course) = cause(answer).and_then(|cause| cause.snr_withheld).unwrap_or_default();
    parity.max(course.unwrap_or(0.0))
}

fn parity(answer: &Answer) -> f64 {
    cause(answer).and_then(|cause| cause.snr_withheld).unwrap_or_default().0
}

fn is_first(answer: &Answer, verdict: &Verdict) -> bool {
    let first = verdict.said().next();
    first
        .zip(cause(answer))
        .is_some_and(|(first, truth)| first.effect == truth.effect)
}

fn is_declared(answer: &Answer, verdict: &Verdict) -> bool {
    let set = verdict.declared();
    let is_in = cause(answer).is_some_and(|truth| set.contains(&truth.effect.as_str()));
    is_first(answer, verdict) || is_in && set.len() <= LARGEST_SET
}

/// Whether the share of an effect that is left by parity is as the dealer's; none where there is hardly anything to share.
fn is_share_right(judged: &Judged) -> Option<bool> {
    let (truth, verdict) = (cause(&judged.answer)?, judged.verdict.as_ref()?);
    let whole = truth.snr_marginal.unwrap_or(judged.answer.snr_marginal);
    let dealt = truth.snr_withheld?.0 / whole;
    if whole < MARGINAL_SNR || truth.snr_withheld?.0 < INVISIBLE_SNR {
        return None;
    }
    let plate = |channel: &String| channel.chars().find(char::is_ascii_digit);
    let is_one = truth.channels.iter().all(|own| plate(own) == plate(&truth.channels[0]));
    let places: &[&str] = if is_one { &["one"] } else { &["unit", "common", "each"] };
    let rows = verdict
        .visible
        .iter()
        .filter(|row| row.effect == truth.effect && row.with_reference > 0.0);
    let shares: Vec<f64> = (rows.filter(|row| places.contains(&row.place.as_str())))
        .map(|row| row.by_parity / row.with_reference)
        .collect();
    let is_near = |share: &f64| (share / dealt - 1.0).abs() < SHARE_OFF;
    (!shares.is_empty()).then(|| shares.iter().any(is_near))
}

/// Whether a motion converged, or was said not to have.
fn is_converged(_: &Answer, verdict: &Verdict) -> bool {
    verdict
        .attitude
        .as_ref()
        .is_some_and(|own| match (own.is_settled, own.error_deg, own.sigma_deg) {
            (false, ..) => true,
            (true, Some(error), Some(sigma)) => error <= CONVERGED * sigma,
            _ => false,
        })
}

/// The lines.
pub(super) fn lines(judged: &[Judged]) -> Vec<Line> {
    let all = || judged.iter().filter(|judged| judged.answer.ring == "R8");
    let with_cause = || all().filter(|judged| cause(&judged.answer).is_some());
    let visible = || with_cause().filter(|judged| ratio(&judged.answer) >= MARGINAL_SNR);
    let by_parity = || with_cause().filter(|judged| parity(&judged.answer) >= MARGINAL_SNR);
    let small = || with_cause().filter(|judged| (SMALL_SNR..MARGINAL_SNR).contains(&ratio(&judged.answer)));
    let invisible = || with_cause().filter(|judged| ratio(&judged.answer) < INVISIBLE_SNR);
    let healthy = || all().filter(|judged| cause(&judged.answer).is_none());
    let is_named = |_: &Answer, verdict: &Verdict| verdict.said().next().is_some();
    let mut lines = vec![
        share(
            "R8: visible at 8 and more, top-1 or declared set",
            ">= 0.85",
            visible(),
            is_declared,
            false,
        ),
        share("R8: visible at 8 and more, top-1", "", visible(), is_first, false),
        share(
            "R8: by parity at 8 and more, top-1 or declared set",
            ">= 0.85",
            by_parity(),
            is_declared,
            false,
        ),
        share("R8: visible at 5 to 8, top-1", ">= 0.5", small(), is_first, false),
        share("R8: nothing wrong, false name", "<= 0.05", healthy(), is_named, true),
        share("R8: with an effect, false name", "", with_cause(), has_false_name, true),
        share(
            "R8: not visible (below 3), something named",
            "<= 0.02",
            invisible(),
            is_named,
            true,
        ),
        share(
            "R8: motion converged, or said that it did not",
            ">= 0.98",
            all(),
            is_converged,
            false,
        ),
    ];
    let right: Vec<bool> = with_cause().filter_map(is_share_right).collect();
    let hits = right.iter().filter(|own| **own).count();
    lines.push(Line {
        what: "R8: share left by parity within 15 % of the dealer's".to_owned(),
        trials: right.len(),
        value: hits as f64 / right.len().max(1) as f64,
        interval: Some(crate::interval::clopper_pearson(hits, right.len())),
        target: "",
    });
    lines
}
