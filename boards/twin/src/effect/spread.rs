//! How likely a log is, given what was predicted: for effects that change how readings scatter.
//!
//! In: a [`View`] of each channel, the prediction with calibration and deterministic effects already in it. Out: natural
//! logarithms of probabilities of what was logged, sample by sample, so that the models of two effects can be compared.
//! A logged value stands for the interval of one resolution around it: a count, or, where nothing rounds, a small part of
//! sigma, so that probabilities, of a value repeated to the last digit above all, are finite.

use super::Effect;
use crate::channel::Channel;

/// One channel's log against its prediction.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// The channel.
    pub channel: &'a Channel,
    /// \[s\] instants, one a cycle.
    pub t_s: &'a [f64],
    /// [physical unit] predicted.
    pub predicted: &'a [f64],
    /// [physical unit] logged; NaN for no sample.
    pub measured: &'a [f64],
    /// [physical unit] between two values that were logged, at least: [`logged_step`].
    pub step: f64,
}

/// What is known of a sample as it was before an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beneath {
    /// [physical unit] its mean; NaN for no sample.
    pub value: f64,
    /// How many samples with the noise of the sensor alone it is worth: 0 tells nothing.
    pub worth: f64,
}

/// [physical unit] between two values that a log can hold, 0 if all are alike. A file of physical units does not say that a part rounds, but
/// shows it: by the least distance between two values, or, where some were computed and not read, by the commonest from one sample to the
/// next. That is a step if a sample moves by it oftener than not at all, and if it and none are most moves up to half a step more.
pub fn logged_step(measured: &[f64]) -> f64 {
    let mut values: Vec<f64> = measured.iter().copied().filter(|value| value.is_finite()).collect();
    let mut moves: Vec<f64> = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    values.sort_by(f64::total_cmp);
    let steps = values
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|step| *step > 0.0);
    let least = steps.fold(f64::INFINITY, f64::min);
    if !least.is_finite() {
        return 0.0;
    }
    moves.sort_by(f64::total_cmp);
    let up_to = |most: f64| moves.partition_point(|moved| *moved < most);
    let same = up_to(0.5 * least);
    let coarser = up_to(FINER * least);
    let (mut common, mut most, mut from) = (least, same, coarser);
    for to in coarser..moves.len() {
        while moves[to] - moves[from] > 2.0 * least {
            from += 1;
        }
        if to + 1 - from > most {
            (common, most) = (0.5 * (moves[from] + moves[to]), to + 1 - from);
        }
    }
    if 2 * (same + most) > up_to(1.5 * common) {
        common
    } else {
        least
    }
}

/// Steps of a file in one of a part: a file that rounds to more than that hides the part's.
const FINER: f64 = 10.0;

/// Part of sigma that a log without rounding resolves.
const RESOLVED: f64 = 1e-4;
/// ln of a probability so small that the model is refuted by a few of them; keeps one sample from being infinitely so.
pub(super) const IMPOSSIBLE: f64 = -40.0;

impl View<'_> {
    /// [physical unit] between two values that can be logged.
    pub fn resolution(&self) -> f64 {
        if self.channel.bits.is_some() {
            self.channel.lsb
        } else {
            self.step.max(RESOLVED * self.channel.sigma())
        }
    }

    /// [physical unit] the least and the most it can log. A channel without a stated range has that of what it logged.
    pub fn limits(&self) -> [f64; 2] {
        let [low, high] = self.channel.range;
        if (high - low).is_finite() {
            return [low, high];
        }
        let logged = self.measured.iter().filter(|value| value.is_finite());
        logged.fold([-1.0, 1.0], |[low, high], &value| [low.min(value), high.max(value)])
    }

    /// [physical unit] between these.
    pub fn span(&self) -> f64 {
        let [low, high] = self.limits();
        high - low
    }

    /// Index, residual of every sample there is.
    pub fn residuals(&self) -> impl Iterator<Item = (usize, f64)> {
        let pairs = self.measured.iter().zip(self.predicted).enumerate();
        pairs
            .map(|(k, (measured, predicted))| (k, measured - predicted))
            .filter(|(_, residual)| residual.is_finite())
    }

    /// ln probability of a sample with this residual under a normal scatter of `sigma`.
    pub fn normal(&self, residual: f64, sigma: f64) -> f64 {
        self.normal_law(sigma)(residual)
    }

    /// The same of any residual: the logarithms are taken once.
    pub fn normal_law(&self, sigma: f64) -> impl Fn(f64) -> f64 {
        let (width, resolution) = ((sigma * core::f64::consts::TAU.sqrt()).ln(), self.resolution().ln());
        move |residual| -0.5 * (residual / sigma).powi(2) - width + resolution
    }

    /// ln probability that the unrounded value lies within `low` to `high` of its prediction.
    pub fn within(&self, low: f64, high: f64) -> f64 {
        let sigma = self.channel.noise_sigma.max(self.resolution() * RESOLVED) * core::f64::consts::SQRT_2;
        // Both tails from the side where they are small.
        let (low, high) = if low + high > 0.0 { (low, high) } else { (-high, -low) };
        let mass = 0.5 * (libm::erfc(low / sigma) - libm::erfc(high / sigma));
        if mass > 0.0 {
            mass.ln().max(IMPOSSIBLE)
        } else {
            IMPOSSIBLE
        }
    }

    /// ln probability of a sample by a law that gives it `mass` \[ln\]; where the law calls it impossible, what noise makes of it,
    /// if that is less. No law gains by samples that neither it nor noise explains.
    pub(super) fn explained(&self, mass: f64, residual: f64) -> f64 {
        // Of two impossible origins the mixture is as impossible, but for its ln 2.
        if mass > IMPOSSIBLE + 1.0 {
            mass
        } else {
            self.normal(residual, self.channel.sigma()).min(IMPOSSIBLE)
        }
    }

    /// [physical unit] at every row the mean of what becomes of the codes that its sensor may give.
    pub(super) fn mean_of_codes(&self, made: impl Fn(f64) -> f64) -> Vec<f64> {
        let lsb = self.channel.lsb;
        let reach = (4.0 * self.channel.noise_sigma / lsb).ceil();
        let mean = |predicted: &f64| {
            let middle = (predicted / lsb).round();
            let (mut sum, mut mass) = (0.0, 0.0);
            for away in -reach as i32..=reach as i32 {
                let code = middle + f64::from(away);
                let apart = code * lsb - predicted;
                let weight = self.within(apart - 0.5 * lsb, apart + 0.5 * lsb).exp();
                (sum, mass) = (sum + weight * made(code) * lsb, mass + weight);
            }
            if mass > 0.0 { sum / mass } else { *predicted }
        };
        self.predicted.iter().map(mean).collect()
    }

    /// Every sample as it was logged.
    pub fn as_logged(&self) -> Vec<Beneath> {
        self.each_worth(|_, _| 1.0)
    }

    /// Every sample as it was logged, worth so much, by its index and residual.
    pub(super) fn each_worth(&self, worth: impl Fn(usize, f64) -> f64) -> Vec<Beneath> {
        let pairs = self.measured.iter().zip(self.predicted).enumerate();
        pairs
            .map(|(k, (measured, predicted))| Beneath {
                value: *measured,
                worth: worth(k, measured - predicted),
            })
            .collect()
    }

    /// ln probability of the log of this channel if nothing is wrong.
    pub fn nominal(&self) -> f64 {
        let law = self.normal_law(self.channel.sigma());
        self.residuals().map(|(_, residual)| law(residual)).sum()
    }
}

/// ln((1 - p) exp(usual) + p exp(unusual)).
pub(super) fn mixed(p: f64, usual: f64, unusual: f64) -> f64 {
    mixture(p)(usual, unusual)
}

/// The same of any two: the logarithms of `p` are taken once.
pub(super) fn mixture(p: f64) -> impl Fn(f64, f64) -> f64 {
    let (rarely, often) = (p.ln(), (-p).ln_1p());
    move |usual, unusual| {
        let (usual, unusual) = (often + usual, rarely + unusual);
        let most = usual.max(unusual);
        if most == f64::NEG_INFINITY {
            most
        } else {
            most + ((usual - most).exp() + (unusual - most).exp()).ln()
        }
    }
}

/// Probability of the unusual one of [`mixed`].
pub(super) fn unusual_part(p: f64, usual: f64, unusual: f64) -> f64 {
    let odds = (-p).ln_1p() + usual - p.ln() - unusual;
    if odds.is_nan() { 0.0 } else { 1.0 / (1.0 + odds.exp()) }
}

/// Relative sizes at which the search for the best parameter begins.
const SIZES: [f64; 9] = [1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0];
/// Golden sections after it: a thousandth of the interval.
const SECTIONS: usize = 16;

/// The most likely parameters of an effect that changes the scatter of these channels, which share them, and how much
/// likelier the log is with it than without \[ln\].
pub fn most_likely(effect: &dyn Effect, variant: f64, views: &[View]) -> (Vec<f64>, f64) {
    let nominal: f64 = views.iter().map(View::nominal).sum();
    let Some(symbol) = effect.page().parameters.first() else {
        return (Vec::new(), effect.log_likelihood(&[], variant, views) - nominal);
    };
    let of = effect.likelihood(variant, views);
    let likelihood = |theta: f64| of(&[theta]) - nominal;
    let signs: &[f64] = if symbol.signed { &[1.0, -1.0] } else { &[1.0] };
    let mut best = (0.0, 0.0);
    for sign in signs {
        let at = |size: f64| sign * size * symbol.prior_sigma * effect.reach(variant);
        let tried: Vec<f64> = SIZES.iter().map(|&size| likelihood(at(size))).collect();
        let top = (0..SIZES.len())
            .max_by(|&i, &j| tried[i].total_cmp(&tried[j]))
            .unwrap_or(0);
        let (mut low, mut high) = (
            SIZES[top.saturating_sub(1)].ln(),
            SIZES[(top + 1).min(SIZES.len() - 1)].ln(),
        );
        for _ in 0..SECTIONS {
            let (first, second) = (low + 0.382 * (high - low), low + 0.618 * (high - low));
            if likelihood(at(first.exp())) > likelihood(at(second.exp())) {
                high = second
            } else {
                low = first
            }
        }
        let theta = at((0.5 * (low + high)).exp());
        let gain = likelihood(theta);
        if gain > best.1 {
            best = (theta, gain);
        }
    }
    (vec![best.0], best.1)
}

/// Step \[ln\] by which a parameter is moved to see how sharply the likelihood falls off.
const SHARPNESS_STEP: f64 = 0.02;

/// Sigma of a parameter of such an effect: by the observed information about the logarithm of its size, in its own unit, and as
/// large as itself where these channels say nothing of it.
pub fn sigma_of(effect: &dyn Effect, variant: f64, views: &[View], theta: f64) -> f64 {
    let of = effect.likelihood(variant, views);
    let at = |by: f64| of(&[theta * by.exp()]);
    let bend = at(SHARPNESS_STEP) - 2.0 * at(0.0) + at(-SHARPNESS_STEP);
    theta.abs() / (-bend / SHARPNESS_STEP.powi(2)).max(1.0).sqrt()
}
