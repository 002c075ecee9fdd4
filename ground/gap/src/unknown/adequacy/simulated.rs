//! Logs simulated from a model: same motion, same holes, everything drawn that the model leaves to chance.
//!
//! In: the finished model's columns ([`Joint`]), its parameters, and what its effect on the scatter, if it names one, makes of
//! noise. Out: residuals a channel, in units of noise. The effects are in as large as they are, so that what the prior takes
//! off a large one is left over here too. Drawn are the calibration from its sigmas; white noise with
//! the tails of a Student law of ten degrees of freedom, for no sensor's noise is quite Gaussian; and the clocks of the
//! parts, by which a reading is older or younger than described in a saw-tooth over samples.

use nalgebra::DVector;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::Rng};

use super::{calibrations::OF_PART, codes::Counts, instrument::Played, view::View};
use crate::null::joint::Joint;

/// Degrees of freedom of the noise's Student law: an excess kurtosis of one.
const TAILS: f64 = 10.0;

/// [units of noise] to which the zero of a channel is known.
const ZERO: f64 = 0.2;

/// A model's effect on the scatter.
#[derive(Clone, Copy)]
pub struct Disturb<'a> {
    /// The channels it is in.
    pub channels: &'a [usize],
    /// What it makes of noise, given as residuals a channel in units of noise; drawn from a seed.
    pub of: &'a (dyn Fn(&mut [DVector<f64>], u64) + Sync),
}

/// One log.
pub struct Simulated {
    /// Per channel, in units of noise.
    pub residuals: Vec<DVector<f64>>,
    /// How often each bit is set, of each channel that sends codes.
    pub counts: Vec<Counts>,
}

/// Draws one.
pub fn simulate(
    views: &[View],
    joint: &Joint,
    parameters: &DVector<f64>,
    disturb: Option<Disturb>,
    random: &mut Xoshiro256PlusPlus,
) -> Simulated {
    let spread = ChiSquared::new(TAILS);
    // A Student variable of n degrees has variance n / (n - 2).
    let unit = (TAILS - 2.0).sqrt();
    let is_seen = views.iter().any(|view| view.instrument.is_some());
    let played = is_seen.then(|| Played::draw(random));
    let mut residuals: Vec<DVector<f64>> = Vec::new();
    for columns in joint.columns() {
        residuals.push(DVector::from_fn(columns.nuisance.nrows(), |_, _| {
            let normal: f64 = StandardNormal.sample(&mut *random);
            spread
                .as_ref()
                .map_or(normal, |spread| normal * unit / spread.sample(&mut *random).sqrt())
        }));
    }
    // Of what a sensor reads by itself the zero is known to a part of its noise, and codes are made before anything is fitted.
    for residual in &mut residuals {
        let zero: f64 = StandardNormal.sample(&mut *random);
        residual.add_scalar_mut(ZERO * zero);
    }
    if let Some(disturb) = disturb {
        (disturb.of)(&mut residuals, random.next_u64());
    }
    let coded = views.iter().zip(&residuals);
    let counts = coded.filter_map(|(view, residual)| view.codes.as_ref().map(|codes| codes.counts_with(residual)));
    let counts = counts.collect();
    let mut drawn: Vec<DVector<f64>> = Vec::new();
    for ((residual, columns), view) in residuals.iter_mut().zip(joint.columns()).zip(views) {
        let own = DVector::from_fn(columns.nuisance.ncols(), |_, _| StandardNormal.sample(&mut *random));
        let open = of_part(view, own, views, &drawn);
        if let Some((instrument, played)) = view.instrument.as_ref().zip(played.as_ref()) {
            (residual.iter_mut().enumerate()).for_each(|(sample, own)| *own = instrument.err(sample, *own, played));
        }
        residual.gemv(1.0, &columns.nuisance, &open, 1.0);
        residual.gemv(1.0, &columns.effects, parameters, 1.0);
        drawn.push(open);
        if let Some(clock) = &view.clock {
            clock.age(residual, random);
        }
    }
    Simulated { residuals, counts }
}

/// What is open of a channel, with what its part has once for all of its channels as the first of them has it.
fn of_part(view: &View, mut own: DVector<f64>, views: &[View], drawn: &[DVector<f64>]) -> DVector<f64> {
    let Some((first, of_first)) = views.get(view.part).zip(drawn.get(view.part)) else {
        return own;
    };
    for (value, open) in own
        .iter_mut()
        .zip(&view.open)
        .filter(|(_, open)| OF_PART.contains(&open.name.as_str()))
    {
        if let Some(place) = first.open.iter().position(|first| first.name == open.name) {
            *value = of_first[place];
        }
    }
    own
}
