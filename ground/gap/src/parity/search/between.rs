//! Hypotheses moved to the value that explains most: when a step is, the frequency of a line, the time constant of a warm-up.
//!
//! In: hypotheses fitted, of which each has a value that was tried. Out: of each effect that comes near the likeliest, the best one with a value
//! between those tried ([`crate::search::between`]), and others of that effect with the value of the best. The library has their columns then.
//!
//! A step that is seconds off explains only a part, and a law that fits anything is then likelier. A line that is half a step off has turned over at
//! the end of a log, and the held-out windows refute it.

use super::{
    Chosen, Seen,
    fit::{Fit, Round, fit_alone, likeliest},
    rescore, seen_of,
};
use crate::{
    library::{
        column::Entries,
        hypotheses::{Library, columns_of},
    },
    null::{interval::begins_s, problem::Component},
    parity::space::{Projected, Space},
    search::between::{climbed, half_ways},
    thresholds::effect_margin,
};

/// Part of the best gain from which a value is moved, which bounds the time it takes. Assumed: a line half a step off still explains four tenths of what it
/// is, `(sin x/x)^2` at `x = pi/2`, and what other effects explain of it is hardly twice as much.
const NEAR: f64 = 0.5;

/// Moves what is near the likeliest, if that is likelier than nothing.
pub(super) fn move_near(
    space: &Space,
    library: &mut Library,
    rest: &Entries,
    round: &mut Round,
    seen: &mut [Seen],
    fits: &mut [(usize, Fit)],
) {
    let likely = |library: &Library, (at, fit): &(usize, Fit)| fit.gain + library.hypotheses[*at].log_prior;
    let best = fits.iter().map(|one| likely(library, one)).fold(0.0, f64::max);
    let most = fits.iter().map(|(_, fit)| fit.gain).fold(0.0, f64::max);
    let mut near: Vec<usize> = (0..fits.len())
        .filter(|at| best > 0.0 && fits[*at].1.gain >= NEAR * most)
        .collect();
    near.sort_by(|one, other| likely(library, &fits[*other]).total_cmp(&likely(library, &fits[*one])));
    // Of each effect that was moved, the value it had and the one it has.
    let mut moved: Vec<(&str, f64, f64)> = Vec::new();
    for at in near {
        let hypothesis = fits[at].0;
        let own = &library.hypotheses[hypothesis];
        let (effect, variant) = (own.effect(), own.cause.variant);
        let known = moved.iter().find(|(own, _, _)| *own == effect).copied();
        // Of an effect that was moved the others follow from where it was: places are compared at one value.
        let is_movable =
            own.span.is_none() && !own.small().is_empty() && known.is_none_or(|(_, from, _)| from == variant);
        let steps = half_ways(own, space.problem.twin.starts_s()).filter(|_| is_movable);
        let one = seen.iter_mut().find(|one| one.hypothesis == hypothesis);
        let Some((steps, one)) = steps.zip(one) else {
            continue;
        };
        own_columns(space, library, hypothesis);
        let mut to = |value: f64| {
            put(space, library, rest, one, value);
            round.forget(library.hypotheses[hypothesis].small());
            round.fit(library, one)
        };
        let gain = |fit: &Option<Fit>| fit.as_ref().map_or(f64::NEG_INFINITY, |fit| fit.gain);
        let value = match known {
            Some((_, _, value)) => value,
            None => {
                let begun = to(variant);
                climbed((variant, begun), steps, gain, |value, _| to(value)).0
            }
        };
        if let Some(fit) = to(value) {
            fits[at].1 = fit;
        }
        moved.push((effect, variant, value));
    }
}

/// Of each effect of a model the same at its place with the value that explains most here, if the evidence prefers it. `project` is what a
/// model leaves. Their hypotheses are of no use after that: what they were seen by is of another residual.
pub fn told_anew(
    space: &Space,
    library: &mut Library,
    model: &[Component],
    seen: &[Seen],
    project: &dyn Fn(&[Component]) -> Projected,
) -> Vec<Option<Chosen>> {
    let starts_s = space.problem.twin.starts_s();
    let mut anew = |at: usize| -> Option<Chosen> {
        let cause = &model[at].active.cause;
        // A ramp, or what comes again, has no value that could be another.
        let has_others = cause.effect.has_values_between() || begins_s(cause, starts_s).is_some();
        if !has_others || model[at].span.is_some() {
            return None;
        }
        let is_same = |one: &&Seen| {
            let own = &library.hypotheses[one.hypothesis];
            let is_its = own.effect() == cause.effect.page().name && own.cause.locality == cause.locality;
            is_its && own.span.is_none() && own.values_between(starts_s).is_some()
        };
        let mut same: Vec<Seen> = seen.iter().filter(is_same).cloned().collect();
        let mut without = model.to_vec();
        without.remove(at);
        let rest = space.rest(&project(&without));
        rescore(&mut same, library, &rest);
        let mut products = Vec::new();
        let mut round = Round::of(&[], &rest, &mut products)?;
        let fits = same
            .iter()
            .filter_map(|one| Some((one.hypothesis, round.fit(library, one)?)));
        let mut fits: Vec<(usize, Fit)> = fits.collect();
        move_near(space, library, &rest, &mut round, &mut same, &mut fits);
        let told = likeliest(library, &same, &fits)?;
        let one = same.iter_mut().find(|one| one.hypothesis == told.hypothesis)?;
        let value = library.hypotheses[told.hypothesis].cause.variant;
        own_columns(space, library, told.hypothesis);
        let mut at = |value: f64| {
            put(space, library, &rest, one, value);
            fit_alone(library, one).map_or(f64::NEG_INFINITY, |fit| fit.gain)
        };
        let [as_it_was, _] = [cause.variant, value].map(&mut at);
        (told.gain > as_it_was + effect_margin()).then_some(told)
    };
    (0..model.len()).map(&mut anew).collect()
}

/// Gives a hypothesis columns of its own: others share those of their value.
fn own_columns(space: &Space, library: &mut Library, hypothesis: usize) {
    let own = library.hypotheses[hypothesis].places.clone();
    let copied = own.into_iter().map(|place| {
        let (column, sigma) = (library.products.held(place).clone(), library.prior_sigmas[place]);
        library.prior_sigmas.push(sigma);
        library.products.push(space.problem, column)
    });
    let places: Vec<usize> = copied.collect();
    library.hypotheses[hypothesis].places = places;
}

/// Sees a hypothesis with another value; its columns are its own.
fn put(space: &Space, library: &mut Library, rest: &Entries, one: &mut Seen, value: f64) {
    let own = &mut library.hypotheses[one.hypothesis];
    own.cause.variant = value;
    let columns = columns_of(space.problem, &own.cause);
    let columns: Vec<Entries> = columns.iter().map(|column| column.entries()).collect();
    for (place, column) in own.places.clone().into_iter().zip(&columns) {
        library.products.renew(space.problem, place, column.clone());
    }
    let (information, score) = seen_of(space, &columns, rest);
    let before = (one.with_reference, one.price);
    *one = Seen::summed(library, one.hypothesis, information, score);
    (one.with_reference, one.price) = before;
}
