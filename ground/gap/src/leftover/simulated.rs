//! Logs simulated from a model: same motion, same holes, everything drawn that the model leaves to chance.
//!
//! In: the finished model's columns ([`Joint`]), its parameters, and what its effect on the scatter, if it names one, makes of
//! noise. Out: residuals a channel, in units of noise. The effects are in as large as they are, so that what the prior takes
//! off a large one is left over here too. Drawn are the calibration from its sigmas; white noise with
//! the tails of a Student law of ten degrees of freedom, for no sensor's noise is quite Gaussian; and the clocks of the
//! parts, by which a reading is older or younger than described in a saw-tooth over samples.

use nalgebra::DVector;
use rand_distr::{ChiSquared, Distribution, StandardNormal, Uniform};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::Rng};

use super::{View, codes::Counts, instrument::Played, shared::OF_PART};
use crate::{joint::Joint, on::phase};

/// Degrees of freedom of the noise's Student law: an excess kurtosis of one.
const TAILS: f64 = 10.0;

/// Part by which a clock inside a part may be off: an RC oscillator's few percent.
const OFF: f64 = 0.05;

/// Beats a sample between the two clocks below which the age drifts and does not scatter: that is the calibration's, whose
/// instant is open and may drift.
const SLOWEST: f64 = 0.1;

/// Draws after which any beat will do: a clock and a sampling that are as slow as each other have no other.
const TRIES: usize = 20;

/// Squares to which one of a sample is cut, in units of what is expected.
const FARTHEST: f64 = 16.0;

/// Variance of two ages that are a whole period apart, over that of ages evenly between them.
const AT_ONCE: f64 = 3.0;

/// Variance of a square of noise.
const OF_SQUARE: f64 = 2.0;

/// Variance of the part of its clock's scatter that a channel has, before anything is known of it: of a clock that may keep step,
/// and of one that cannot, which scatters evenly if it is as described.
const OF_PART_SHOWN: f64 = 1.0;
const OF_CLOCK: f64 = 0.05;

/// [units of noise] to which the zero of a channel is known.
const ZERO: f64 = 0.2;

/// When a part converts by its own clock.
#[derive(Clone, Debug)]
pub struct Clock {
    /// [s] between conversions.
    pub period_s: f64,
    /// [s] instant of each sample.
    pub instants_s: Vec<f64>,
    /// What a second of age adds to each sample, in units of noise.
    pub slopes: Vec<f64>,
}

/// A model's effect on the scatter.
#[derive(Clone, Copy)]
pub struct Disturb<'a> {
    /// The channels it is in.
    pub channels: &'a [usize],
    /// What it makes of noise, given as residuals a channel in units of noise; drawn from a seed.
    pub of: &'a dyn Fn(&mut [DVector<f64>], u64),
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

impl Clock {
    /// A clock that scatters a channel as much as what is `left` of it shows.
    pub fn as_shown(mut self, left: impl Iterator<Item = f64>) -> Self {
        let part = self.part_shown(left);
        self.slopes.iter_mut().for_each(|slope| *slope *= part.sqrt());
        self
    }

    /// Variance of a reading's age over that of one spread evenly over a period, by what is `left` of a channel: a clock that
    /// keeps step with the cycle scatters nothing, or, where it converts just when it is read, by a whole period. By least
    /// squares of the squares, each with the weight that its own scatter leaves it, and evenly where they tell little: what is a
    /// tenth of a thermometer's noise its squares do not show, and it is one line of its spectrum.
    pub fn part_shown(&self, left: impl Iterator<Item = f64>) -> f64 {
        let (mut along, mut energy) = (0.0, 0.0);
        for (slope, left) in self.slopes.iter().zip(left).filter(|(_, left)| left.is_finite()) {
            let even = (slope * self.period_s).powi(2) / 12.0;
            let weight = (1.0 + even).powi(-2);
            // One outlier is no scatter.
            let square = left.powi(2).min(FARTHEST * (1.0 + even));
            along += weight * even * (square - 1.0);
            energy += weight * even * even;
        }
        let open = if self.may_keep_step() { OF_PART_SHOWN } else { OF_CLOCK };
        let told = open / OF_SQUARE;
        ((1.0 + told * along) / (1.0 + told * energy)).clamp(0.0, AT_ONCE)
    }

    /// Whether it may convert a whole number of times a sample.
    fn may_keep_step(&self) -> bool {
        let beats = |rate: f64| (rate * self.step_s() / self.period_s).floor();
        beats(1.0 + OFF) > beats(1.0 - OFF)
    }

    /// [s] between samples.
    fn step_s(&self) -> f64 {
        self.instants_s.get(1).map_or(0.0, |second| second - self.instants_s[0])
    }

    /// Adds what a clock of unknown phase and rate makes of a channel. The mean age is the calibration's.
    fn age(&self, residual: &mut DVector<f64>, random: &mut Xoshiro256PlusPlus) {
        let mut between = |low: f64, high: f64| Uniform::new(low, high).map_or(low, |law| law.sample(&mut *random));
        let step_s = self.step_s();
        let begun = between(0.0, 1.0);
        let mut period_s = self.period_s;
        for _ in 0..TRIES {
            period_s = self.period_s * (1.0 + between(-OFF, OFF));
            let beat = (step_s / period_s).fract();
            if (SLOWEST..1.0 - SLOWEST).contains(&beat) {
                break;
            }
        }
        let ages_s: Vec<f64> = (self.instants_s.iter())
            .map(|t_s| phase(t_s / period_s + begun) * period_s)
            .collect();
        let mean_s = ages_s.iter().sum::<f64>() / ages_s.len().max(1) as f64;
        for ((residual, age_s), slope) in residual.iter_mut().zip(ages_s).zip(&self.slopes) {
            *residual += slope * (age_s - mean_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_xoshiro::rand_core::SeedableRng;

    use super::*;

    const SAMPLES: usize = 1500;

    /// How much of its clock's scatter a channel is taken to have that has so much of it.
    fn shown(part: f64) -> f64 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        let clock = Clock {
            period_s: 0.02,
            instants_s: (0..SAMPLES).map(|row| row as f64 * 0.2).collect(),
            slopes: (0..SAMPLES).map(|row| 200.0 * (row as f64 * 0.05).cos()).collect(),
        };
        let mut left = DVector::zeros(SAMPLES);
        clock.age(&mut left, &mut random);
        left *= part.sqrt();
        left.apply(|value| *value += Distribution::<f64>::sample(&StandardNormal, &mut random));
        let shown = clock.clone().as_shown(left.iter().copied());
        (shown.slopes[0] / clock.slopes[0]).powi(2)
    }

    #[test]
    fn a_clock_that_cannot_keep_step_is_spread_evenly_unless_much_says_otherwise() {
        let shown = |period_s: f64, slope: f64| {
            let clock = Clock {
                period_s,
                instants_s: (0..SAMPLES).map(|row| row as f64 * 0.2).collect(),
                slopes: vec![slope / period_s; SAMPLES],
            };
            clock.part_shown((0..SAMPLES).map(|_| 1.0))
        };
        assert!(shown(0.25, 1.0) > 0.8, "{}", shown(0.25, 1.0));
        assert!(shown(0.02, 1.0) < 0.2, "{}", shown(0.02, 1.0));
        // Twice the noise, and none of it there: no such clock.
        assert!(shown(0.25, 5.0) < 0.2, "{}", shown(0.25, 5.0));
    }

    #[test]
    fn a_clock_scatters_as_much_as_its_channel_shows() {
        // The squares of 1500 samples tell the part to a tenth.
        for part in [0.0, 0.5, 1.0, AT_ONCE] {
            let shown = shown(part);
            assert!((shown - part).abs() < 0.3, "{part} {shown}");
        }
    }
}
