//! Effects that come again and again, in a log without a reference: a transmitter with its beacon, a heater with its thermostat.
//!
//! In: a [`Space`], what motion and calibration leave of the residual there, and what was seen of each hypothesis. Out: of each that
//! [repeats](twin::effect::Effect::repeats) the stretch that comes again in which it explains most, taken into the library with columns that are
//! on in it alone, and seen anew. One that has none is seen no more: what is on always is another effect.
//!
//! Where the stretch lies is sought as beside a reference ([`crate::search::periodic`]). For a column `u_S` that is on in a stretch `S`,
//! `<u_S, r> = u_S'rest(r)` with [`Space::rest`], so the scores of all stretches are exact sums over samples. Of their information, `u_S'u_S` less
//! what the calibration takes, a motion imitates a part. A motion is told within some tenths of a second, and stretches are longer, so the
//! part that is left is taken for that of the column that is on always, `k = 1 - |Q'u|^2 / u'u`: columns times `sqrt(k)` and residuals over it have
//! these scores and that information. What the stretch that is found says is exact: `<u_S, u_S> = u_S'rest(u_S)`.
//!
//! Having looked at so many periods and edges costs the logarithm of their number, off the nats that it gains. That it comes again is one law of its
//! effect, as it is one law to begin at some instant: its prior odds are those of a law ([`as_a_law`]), and not of one instant among many.

use nalgebra::DVector;
use twin::effect::Cause;

use crate::{
    library::{
        column::{Column, Entries},
        hypotheses::{Hypothesis, Library},
    },
    null::interval::{Interval, begins_s},
    parity::{
        search::{Seen, seen_of},
        space::{Projected, Space},
    },
    search::{interval_sums::Residual, periodic},
};

/// Gives each hypothesis that repeats its stretch, or none.
pub fn take(space: &Space, library: &mut Library, residual: &Projected, seen: &mut Vec<Seen>) {
    let rest = space.rest(residual);
    let values: Vec<DVector<f64>> = rest.iter().map(|(_, values)| values.clone()).collect();
    let starts_s = space.problem.twin.starts_s();
    let span_s = starts_s
        .last()
        .zip(starts_s.first())
        .map_or(0.0, |(last, first)| last - first);
    let mut anew = |one: Seen| -> Option<Seen> {
        let at = one.hypothesis;
        if !repeats(&library.hypotheses[at]) {
            return Some(one);
        }
        let places = library.hypotheses[at].places.clone();
        let always: Vec<Entries> = places.iter().map(|place| library.products.column(*place)).collect();
        let sigmas: Vec<f64> = places.iter().map(|place| library.prior_sigmas[*place]).collect();
        let kept = space.kept_by_motion(&always, &sigmas).sqrt();
        if kept.is_nan() || kept <= 0.0 {
            return None;
        }
        let left: Vec<DVector<f64>> = values.iter().map(|values| values / kept).collect();
        let left = Residual::of(space.problem, &left);
        let (on, _) = periodic::again(space.problem, &left, &times(&always, kept), &sigmas)?;
        let columns: Vec<Entries> = always.iter().map(|column| within(space, column, on)).collect();
        let (information, score) = seen_of(space, &columns, &rest);
        let own = columns.into_iter().zip(sigmas);
        let places = own.map(|(column, sigma)| {
            library.prior_sigmas.push(sigma);
            library.products.push(space.problem, Column::of(column))
        });
        let places: Vec<usize> = places.collect();
        let hypothesis = &mut library.hypotheses[at];
        hypothesis.log_prior += as_a_law(hypothesis, starts_s);
        (hypothesis.places, hypothesis.span) = (places, Some(on));
        let mut own = Seen::summed(library, at, information, score);
        own.price = periodic::price(span_s);
        Some(own)
    };
    *seen = std::mem::take(seen).into_iter().filter_map(&mut anew).collect();
}

fn repeats(hypothesis: &Hypothesis) -> bool {
    hypothesis.cause.effect.repeats(hypothesis.cause.variant) && !hypothesis.small().is_empty()
}

/// What its prior odds lack: the library shares those of an effect among its variants, and one that begins at an instant has a variant for each.
fn as_a_law(hypothesis: &Hypothesis, starts_s: &[f64]) -> f64 {
    let cause = &hypothesis.cause;
    let variants = cause.effect.variants(starts_s);
    let begins = |variant: &&f64| {
        let variant = **variant;
        begins_s(
            &Cause {
                variant,
                ..cause.clone()
            },
            starts_s,
        )
        .is_some()
    };
    let instants = variants.iter().filter(begins).count();
    let laws = variants.len() - instants + usize::from(instants > 0);
    (variants.len() as f64 / laws as f64).ln()
}

fn times(columns: &[Entries], factor: f64) -> Vec<Entries> {
    let column = |own: &Entries| {
        own.iter()
            .map(|(channel, values)| (*channel, values * factor))
            .collect()
    };
    columns.iter().map(column).collect()
}

/// A column that is on in a stretch alone.
fn within(space: &Space, column: &Entries, on: Interval) -> Entries {
    let starts_s = space.problem.twin.starts_s();
    let of_channel = |(channel, values): &(usize, DVector<f64>)| {
        let rows = &space.problem.frames[*channel].series.rows;
        let is_on = rows.iter().map(|row| on.contains(starts_s[*row as usize]));
        let own = values
            .iter()
            .zip(is_on)
            .map(|(value, is_on)| if is_on { *value } else { 0.0 });
        (*channel, DVector::from_iterator(values.len(), own))
    };
    column.iter().map(of_channel).collect()
}
