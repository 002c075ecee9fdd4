//! What a model leaves: is it what the twin's own noise and calibration would leave?
//!
//! In: the finished model's columns ([`Joint`]) and the residual. Out: [`Leftover`], a p-value for "this model is enough",
//! and the aspects of the residual that say otherwise, largest first. What is looked at is in [`aspects`].
//!
//! Each aspect is a sum of squares; its cube root is near Gaussian (Wilson and Hilferty 1931) and is put in units of its
//! spread over logs [`simulated`] from the model. Of an energy that an effect claims it is the logarithm: a law of values
//! "anywhere in the range" claims any of many orders of magnitude. The p-value counts how many of the simulated logs have as
//! large a largest aspect, so it is paid for having looked everywhere.

use nalgebra::DVector;
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use rayon::prelude::*;

use crate::{
    null::joint::{Fitted, Joint},
    thresholds::STANDS_OUT,
};

mod aspects;
mod calibrations;
mod clock;
mod codes;
mod common;
mod courses;
mod instrument;
mod label;
mod shapes;
mod simulated;
mod spectrum;
mod sums;
mod uniformity;
mod view;
use aspects::{Sights, coded};
pub use clock::Clock;
pub use codes::Codes;
use codes::{Counts, rarities};
pub use instrument::Instrument;
use label::Label;
pub use simulated::Disturb;
use simulated::Simulated;
pub(crate) use simulated::simulate;
pub use uniformity::Suspect;
use view::SEED;
pub use view::{LEVELS, Open, STRETCHES, View};

/// Simulated logs: fewest (p then has a floor of 1/101) and most.
const SIMULATIONS: [usize; 2] = [100, 200];

/// Mean cube root of an aspect below which the fit takes away whatever is there, and what is left is rounding (a square of
/// noise has 0.8).
const FITTED: f64 = 0.3;

/// Normal numbers drawn in all, so that long logs take bounded time.
const DRAWS: usize = 20_000_000;

/// Logs that are held at once, and as many that are drawn meanwhile.
const BATCH: usize = 4;

/// One aspect of a residual.
#[derive(Clone, Debug, PartialEq)]
pub struct Aspect {
    /// In words.
    pub what: String,
    /// The channels that it is of.
    pub channels: Vec<usize>,
    /// The named effect whose law it is of, where it is of one.
    pub effect: Option<String>,
    /// Standard deviations above what the model leaves, or on either side of what an effect on the scatter claims.
    pub size: f64,
}

/// Judgement of what is left.
#[derive(Clone, Debug, PartialEq)]
pub struct Leftover {
    /// Probability of as large a leftover if the model is enough.
    pub p: f64,
    /// Natural logarithm of that probability continued beyond the last simulated log by a Gumbel law, which is what the
    /// largest of many follows.
    pub log_tail: f64,
    /// Aspects above three, largest first.
    pub aspects: Vec<Aspect>,
    /// Probability of the largest of them being as large as it is on other windows too; `None` where it was not looked for.
    pub again: Option<f64>,
    /// Mean and spread of the largest aspect over the simulated logs.
    pub scale: [f64; 2],
}

impl Leftover {
    /// Probability that something else is needed, from its prior.
    pub fn unknown(&self, prior: f64) -> f64 {
        let again = self.again.map_or(1.0, |p| odds(p.ln()));
        prior / (prior + (1.0 - prior) * odds(self.log_p()) * again)
    }

    /// Energy of what is left, in squares of noise: what a Gaussian of that energy is as rare as.
    pub fn energy(&self) -> f64 {
        -2.0 * self.log_p()
    }

    /// Whether it speaks for anything: with a probability above 1/e it does not ([`odds`]).
    pub fn is_doubtful(&self) -> bool {
        odds(self.p.ln()) < 1.0
    }

    /// What of it speaks against an effect in some channels: its largest aspect in any of these that is not of another effect's law.
    /// Aspects below [`STANDS_OUT`] are not kept; where none is, all that is left speaks, and says little.
    pub fn against(&self, effect: Option<&str>, channels: &[usize]) -> Leftover {
        let is_its = |aspect: &Aspect| match &aspect.effect {
            Some(of) => Some(of.as_str()) == effect,
            None => aspect.channels.iter().any(|channel| channels.contains(channel)),
        };
        match self.aspects.iter().position(is_its) {
            Some(0) => self.clone(),
            None if self.aspects.is_empty() => self.clone(),
            Some(at) => {
                // The law of the largest of all aspects, which the largest of some stays below: this says too little rather than too much.
                let log_tail = log_tail(self.aspects[at].size, self.scale);
                Leftover {
                    p: log_tail.exp(),
                    log_tail,
                    aspects: self.aspects[at..].to_vec(),
                    again: None,
                    scale: self.scale,
                }
            }
            None => Leftover {
                p: 1.0,
                log_tail: 0.0,
                aspects: Vec::new(),
                again: None,
                scale: self.scale,
            },
        }
    }

    fn log_p(&self) -> f64 {
        self.log_tail.min(self.p.ln())
    }
}

/// Least odds of "enough" that a p-value leaves: it speaks against it by at most `-1 / (e p ln p)` (Sellke, Bayarri and Berger
/// 2001).
pub(crate) fn odds(log_p: f64) -> f64 {
    if log_p < -1.0 {
        (1.0 + log_p + (-log_p).ln()).exp()
    } else {
        1.0
    }
}

/// `ln P(largest >= size)` for a Gumbel law of this mean and spread.
fn log_tail(size: f64, [mean, spread]: [f64; 2]) -> f64 {
    let beta = spread * 6f64.sqrt() / std::f64::consts::PI;
    if beta <= 0.0 {
        return 0.0;
    }
    const EULER: f64 = 0.577_215_664_901_532_9;
    let y = (size - (mean - EULER * beta)) / beta;
    // ln(1 - exp(-exp(-y))): for large y simply -y.
    if y > 30.0 {
        -y
    } else {
        (-(-(-y).exp()).exp_m1()).max(f64::MIN_POSITIVE).ln()
    }
}

/// Judges the residuals of a model, whose named effects on readings are the `suspects`; `disturb` is what the one on the
/// scatter makes of noise.
pub fn judge(
    views: &[View],
    joint: &Joint,
    fitted: &Fitted,
    suspects: &[Suspect],
    disturb: Option<Disturb>,
) -> Leftover {
    let Sizes {
        labels,
        observed,
        simulated,
    } = Sizes::of(views, joint, fitted, suspects, disturb);
    let largest = |run: &Vec<f64>| run.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let seen = largest(&observed);
    let scale = moments(simulated.iter().map(largest));
    let beyond = simulated.iter().filter(|run| largest(run) >= seen).count();
    let mut aspects: Vec<Aspect> = (labels.iter().zip(observed))
        .map(|(label, size)| Aspect {
            what: label.what.clone(),
            channels: label.channels.clone(),
            effect: label.effect.clone(),
            size,
        })
        .filter(|aspect| aspect.size > STANDS_OUT)
        .collect();
    aspects.sort_by(|one, other| other.size.total_cmp(&one.size));
    Leftover {
        p: (1 + beyond) as f64 / (1 + simulated.len()) as f64,
        log_tail: log_tail(seen, [scale.0, scale.1]),
        scale: [scale.0, scale.1],
        aspects,
        again: None,
    }
}

/// Probability that one aspect of a residual is as large as it is if the model is enough: of one that was found on other
/// windows, which share nothing with these but the calibration. `None` of what that makes.
pub fn recurrence(views: &[View], joint: &Joint, fitted: &Fitted, suspects: &[Suspect], what: &str) -> Option<f64> {
    let sizes = Sizes::of(views, joint, fitted, suspects, None);
    let at = sizes.labels.iter().position(|label| label.what == what)?;
    if sizes.labels[at].is_of_calibration() {
        return None;
    }
    let beyond = sizes.simulated.iter().filter(|run| run[at] >= sizes.observed[at]);
    Some((1 + beyond.count()) as f64 / (1 + sizes.simulated.len()) as f64)
}

/// Every aspect in standard deviations.
struct Sizes {
    labels: Vec<Label>,
    observed: Vec<f64>,
    /// Of each simulated log.
    simulated: Vec<Vec<f64>>,
}

impl Sizes {
    fn of(views: &[View], joint: &Joint, fitted: &Fitted, suspects: &[Suspect], disturb: Option<Disturb>) -> Self {
        let sights = Sights::new(views, suspects, disturb.map_or(&[], |disturb| disturb.channels));
        let observed = sights.sums(fitted);
        let samples: usize = views.iter().map(|view| view.phase.len()).sum();
        let count = (DRAWS / samples.max(1)).clamp(SIMULATIONS[0], SIMULATIONS[1]);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let parameters = unshrunk(joint, &fitted.parameters);
        // Logs are drawn one after the other, for one case gives one verdict; what is looked at in some of them is meanwhile.
        let mut draw = |left: usize| -> Vec<Simulated> {
            let batch = (0..left.min(BATCH)).map(|_| simulate(views, joint, &parameters, disturb, &mut random));
            batch.collect()
        };
        let mut counts: Vec<Vec<Counts>> = Vec::with_capacity(count);
        let mut simulated: Vec<Vec<f64>> = Vec::with_capacity(count);
        let mut logs = draw(count);
        while !logs.is_empty() {
            let left = count - simulated.len() - logs.len();
            let look = |log: &Simulated| sights.sums(&joint.fit(&log.residuals));
            let (next, sums): (_, Vec<Vec<f64>>) = rayon::join(|| draw(left), || logs.par_iter().map(look).collect());
            simulated.extend(sums);
            counts.extend(std::mem::replace(&mut logs, next).into_iter().map(|log| log.counts));
        }
        let mut observed = observed;
        for (coded, view) in coded(views).enumerate() {
            let logged = view.codes.as_ref().map_or_else(Counts::default, Codes::counts);
            let of_channel: Vec<Counts> = counts.iter().map(|counts| counts[coded]).collect();
            let (rarities, rarity) = rarities(&of_channel, logged, view.phase.len());
            simulated
                .iter_mut()
                .zip(rarities)
                .for_each(|(sums, own)| sums.push(own));
            observed.push(rarity);
        }
        let labels = sights.labels();
        let root = |(value, label): (&f64, &Label)| match label.is_energy_claimed() {
            true => value.max(f64::MIN_POSITIVE).ln(),
            false => value.max(0.0).cbrt(),
        };
        let roots = |values: &[f64]| -> Vec<f64> { values.iter().zip(&labels).map(root).collect() };
        let simulated: Vec<Vec<f64>> = simulated.iter().map(|values| roots(values)).collect();
        let observed = roots(&observed);
        let spread = |(at, label): (usize, &Label)| {
            let values = simulated.iter().map(|run| run[at]);
            let is_there = |value: &f64| !label.may_be_none || *value > 0.0;
            moments(values.filter(is_there))
        };
        let spreads: Vec<(f64, f64)> = labels.iter().enumerate().map(spread).collect();
        let sizes = |run: &[f64]| -> Vec<f64> {
            (run.iter().zip(&spreads).zip(&labels))
                .map(|((value, (mean, spread)), label)| {
                    let is_none = label.may_be_none && *value == 0.0;
                    let size = if *mean > FITTED && *spread > 0.0 && !is_none {
                        (value - mean) / spread
                    } else {
                        0.0
                    };
                    if label.is_claimed { size.abs() } else { size }
                })
                .collect()
        };
        let (observed, simulated) = (sizes(&observed), simulated.iter().map(|run| sizes(run)).collect());
        Sizes {
            labels,
            observed,
            simulated,
        }
    }
}

/// The parameters as they were before the prior shrank them, nearly: the fit shrinks what it found once more, and by as much
/// they were larger.
fn unshrunk(joint: &Joint, found: &DVector<f64>) -> DVector<f64> {
    let alone: Vec<DVector<f64>> = joint.columns().map(|columns| &columns.effects * found).collect();
    found * 2.0 - joint.fit(&alone).parameters
}

fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let variance = values.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, variance.sqrt())
}

#[cfg(test)]
mod tests;
