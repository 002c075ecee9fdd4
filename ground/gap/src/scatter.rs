//! Effects that change how readings scatter and not what they are: noise, stale samples, coarse steps, bursts.
//!
//! In: the [`Problem`] and what a model predicts with its calibration. Out: the [`Scatter`] that makes the log likeliest, with
//! the channels it is in. They are judged after the deterministic effects, whose misfit would look like noise, and those are
//! then searched anew with the noise as found ([`crate::problem::Problem::reweigh`]).
//!
//! A part that converts by its own clock scatters with the slope of what it measures in any case
//! ([`crate::open::instant_sigma_s`]); an effect counts only by what it says beyond that.
//!
//! A channel is counted in when its likelihood gains more than one parameter fitted to so many samples costs
//! (`1/2 ln n`, Schwarz 1978) and one nat for having been looked at.

use nalgebra::DVector;
use twin::{
    effect::{Effect, LIBRARY, Nature, Scope, View, logged_step, most_likely},
    part::signal::Noise,
    predict::Kind,
};

use crate::{open::instant_sigma_s, problem::Problem};

/// An effect on the scatter, where it is and how large.
#[derive(Clone)]
pub struct Scatter {
    /// Which.
    pub effect: &'static dyn Effect,
    /// Its variant.
    pub variant: f64,
    /// In which channels.
    pub channels: Vec<usize>,
    /// Parameters of each of them.
    pub thetas: Vec<Vec<f64>>,
    /// [nats] over the nominal scatter, prices paid.
    pub gain: f64,
}

impl Scatter {
    /// What it makes of noise: takes the residuals of a log that scatters as described, a vector a channel, and leaves those
    /// of one with the effect in their place. They are in units of noise; `predicted` holds every row.
    pub fn disturb(&self, problem: &Problem, predicted: &[Vec<f64>], residuals: &mut [DVector<f64>], noise: Noise) {
        let twin = problem.twin;
        let unit = twin.unit();
        let block_of = |channel: usize| match self.effect.page().scope {
            Scope::Channel => unit.channels[channel].name.as_str(),
            Scope::Plate => unit.channels[channel].group.as_str(),
            Scope::Unit => "",
        };
        let mut blocks: Vec<(&str, Vec<usize>)> = Vec::new();
        for (at, channel) in self.channels.iter().enumerate() {
            match blocks.iter_mut().find(|(name, _)| *name == block_of(*channel)) {
                Some((_, block)) => block.push(at),
                None => blocks.push((block_of(*channel), vec![at])),
            }
        }
        for (number, (_, block)) in blocks.iter().enumerate() {
            // Rows with what a unit of noise is there without the reference's part: an effect knows the sensor's alone.
            let rows_of = |channel: usize| {
                let frame = &problem.frames[channel];
                let units = frame
                    .weights
                    .iter()
                    .zip(frame.own.iter())
                    .map(|(weight, own)| weight * own);
                frame.series.rows.iter().map(|row| *row as usize).zip(units)
            };
            // Where nothing was logged something that is never read.
            let mut measured: Vec<Vec<f64>> = block.iter().map(|at| predicted[self.channels[*at]].clone()).collect();
            let instants: Vec<Vec<f64>> = block.iter().map(|at| twin.instants_s(self.channels[*at])).collect();
            for (measured, at) in measured.iter_mut().zip(block) {
                let channel = self.channels[*at];
                (rows_of(channel).zip(residuals[channel].iter()))
                    .for_each(|((row, unit), residual)| measured[row] += residual * unit);
            }
            let views: Vec<View> = (block.iter().zip(&measured).zip(&instants))
                .map(|((at, measured), t_s)| View {
                    channel: &unit.channels[self.channels[*at]],
                    t_s,
                    predicted: &predicted[self.channels[*at]],
                    measured,
                    step: 0.0,
                })
                .collect();
            let theta = &self.thetas[block[0]];
            let disturbed = self
                .effect
                .disturb(theta, self.variant, &views, noise.stream(number as u64));
            for (disturbed, at) in disturbed.iter().zip(block) {
                let channel = self.channels[*at];
                (rows_of(channel).zip(residuals[channel].iter_mut())).for_each(|((row, unit), residual)| {
                    *residual = (disturbed[row] - predicted[channel][row]) / unit;
                });
            }
        }
    }
}

/// [standard deviations] by which energy or tails of a residual must differ from the nominal for a second look.
const ODD: f64 = 2.0;

/// Whether a residual does not scatter as described. Only such a channel is looked at closely, which costs a thousand
/// likelihoods: no effect that leaves energy, tails and neighbours alone would gain its price.
fn is_odd(view: &View) -> bool {
    let sigma = view.channel.sigma();
    let standard: Vec<f64> = view.residuals().map(|(_, residual)| residual / sigma).collect();
    let samples = standard.len().max(1) as f64;
    let moment = |power: i32| standard.iter().map(|value| value.powi(power)).sum::<f64>() / samples;
    let alike = standard.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / samples;
    let root = samples.sqrt();
    (moment(2) - 1.0).abs() * root > ODD * 2f64.sqrt()
        || (moment(4) - 3.0).abs() * root > ODD * 96f64.sqrt()
        || alike.abs() * root > ODD
}

/// Correlation of neighbouring residuals from which a channel's misfit is no white noise, whatever its size. Louder noise
/// would otherwise swallow any effect the library does not have, and be believed.
const COLOURED: f64 = 0.2;

/// Effects that stand for white noise, for its outliers, or for errors of each sample's own.
const WHITE: [&str; 4] = ["noise-level", "packet-corruption", "shock", "sampling-jitter"];

/// Of those, effects that only make a sample scatter more: a reference that errs does so too.
const SHAPELESS: [&str; 3] = ["noise-level", "sampling-jitter", "packet-corruption"];

/// [robust standard deviations] to which residuals are cut before neighbours are compared: a blow rings for a few samples,
/// and these must not make the rest of the log look alike.
const CUT: f64 = 2.0;

/// Median of the absolute value of a standard normal variable.
const MEDIAN_OF_NORMAL: f64 = 0.6745;

/// [nats] what a part's own clock explains of a log.
fn own_clock(view: &View) -> f64 {
    let sigma_s = instant_sigma_s(view.channel);
    let is_polled = view.channel.bits.is_some() && view.channel.sensor != Kind::Thermometer;
    let jitter = twin::effect::by_name("sampling-jitter").filter(|_| is_polled && sigma_s > 0.0);
    jitter.map_or(0.0, |jitter| {
        (jitter.log_likelihood(&[sigma_s], 0.0, &[*view]) - view.nominal()).max(0.0)
    })
}

/// Whether neighbouring residuals are alike.
fn is_coloured(view: &View) -> bool {
    let mut rest: Vec<f64> = view.residuals().map(|(_, residual)| residual).collect();
    let mut sizes: Vec<f64> = rest.iter().map(|value| value.abs()).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return false;
    }
    let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
    let most = (CUT * median / MEDIAN_OF_NORMAL).max(f64::MIN_POSITIVE);
    rest.iter_mut().for_each(|value| *value = value.clamp(-most, most));
    let energy: f64 = rest.iter().map(|value| value * value).sum();
    let alike: f64 = rest.windows(2).map(|pair| pair[0] * pair[1]).sum();
    alike > COLOURED * energy
}

/// [nats a sample] that the tails of a reference's errors gain over normal scatter: those of a Student law of five degrees of
/// freedom, whose excess kurtosis of six is the largest that BROAD's recordings show, between blows. Its entropy is 1.3721 and
/// a normal law's of the same variance 1.4189.
const TAILS: f64 = 0.0468;

/// Every effect on the scatter that gains anything, best first. `predicted` holds every row of the log.
pub fn scatters(problem: &Problem, predicted: &[Vec<f64>], withheld: &[String]) -> Vec<Scatter> {
    let twin = problem.twin;
    let unit = twin.unit();
    let instants: Vec<Vec<f64>> = (0..unit.channels.len()).map(|index| twin.instants_s(index)).collect();
    let rows_of = |channel: usize| problem.frames[channel].series.rows.iter().map(|row| *row as usize);
    let measured: Vec<Vec<f64>> = (problem.frames.iter().enumerate())
        .map(|(channel, frame)| {
            let mut rows = vec![f64::NAN; twin.starts_s().len()];
            (rows_of(channel).zip(&frame.series.values)).for_each(|(row, value)| rows[row] = *value);
            rows
        })
        .collect();
    // Effects know the sensor's own noise: a reference that errs as well must not look like more of it.
    let near: Vec<Vec<f64>> = (measured.iter().zip(predicted).enumerate())
        .map(|(channel, (measured, predicted))| {
            let mut near = predicted.clone();
            let (own, is_limited) = (unit.channels[channel].sigma(), problem.is_limited(channel));
            // What errs slowly is no scatter, unless there is more of it.
            let part = |row: usize| match is_limited {
                true => own / problem.sigmas[channel][row],
                false => problem.own_part(channel, row),
            };
            rows_of(channel).filter(|row| part(*row) < 1.0).for_each(|row| {
                near[row] = measured[row] - part(row) * (measured[row] - predicted[row]);
            });
            near
        })
        .collect();
    let steps: Vec<f64> = measured.iter().map(|measured| logged_step(measured)).collect();
    let view = |index: &usize| View {
        channel: &unit.channels[*index],
        t_s: &instants[*index],
        predicted: &near[*index],
        measured: &measured[*index],
        step: steps[*index],
    };
    let odd: Vec<bool> = (0..unit.channels.len()).map(|index| is_odd(&view(&index))).collect();
    let own_clock: Vec<f64> = (0..unit.channels.len()).map(|index| own_clock(&view(&index))).collect();
    let mut found = Vec::new();
    for effect in LIBRARY {
        let page = effect.page();
        if page.nature != Nature::Spread || withheld.iter().any(|name| name == page.name) {
            continue;
        }
        let concerned: Vec<usize> = (0..unit.channels.len())
            .filter(|index| page.sensors.contains(&unit.channels[*index].sensor))
            .filter(|index| !(problem.is_limited(*index) && SHAPELESS.contains(&page.name)))
            .collect();
        let blocks: Vec<Vec<usize>> = match page.scope {
            Scope::Channel => concerned.iter().map(|index| vec![*index]).collect(),
            Scope::Plate => unit
                .groups()
                .iter()
                .map(|group| {
                    concerned
                        .iter()
                        .copied()
                        .filter(|index| unit.channels[*index].group == *group)
                        .collect()
                })
                .collect(),
            Scope::Unit => vec![concerned],
        };
        let variants = effect.variants(twin.starts_s());
        let count = LIBRARY.len() * variants.len();
        let seek = |variant: f64| {
            let mut scatter = Scatter {
                effect: *effect,
                variant,
                channels: Vec::new(),
                thetas: Vec::new(),
                gain: -(count as f64).ln(),
            };
            for block in blocks.iter().filter(|block| block.iter().any(|index| odd[*index])) {
                let views: Vec<View> = block.iter().map(view).collect();
                let samples: usize = block.iter().map(|index| problem.frames[*index].series.rows.len()).sum();
                if WHITE.contains(&page.name) && views.iter().any(is_coloured) {
                    continue;
                }
                let (theta, gain) = most_likely(*effect, variant, &views);
                let samples_of = |index: &usize| problem.frames[*index].series.rows.len() as f64;
                let of_reference = |index: &&usize| problem.is_limited(**index);
                let gain = gain
                    - block.iter().map(|index| own_clock[*index]).sum::<f64>()
                    - TAILS * block.iter().filter(of_reference).map(samples_of).sum::<f64>();
                let price = 0.5 * (samples.max(1) as f64).ln() * theta.len() as f64 + 1.0 + (blocks.len() as f64).ln();
                if gain > price {
                    scatter.gain += gain - price;
                    scatter.channels.extend(block);
                    scatter.thetas.extend(block.iter().map(|_| theta.clone()));
                }
            }
            Some(scatter).filter(|scatter| !scatter.channels.is_empty() && scatter.gain > 0.0)
        };
        for scatter in variants.iter().filter_map(|variant| seek(*variant)) {
            let views: Vec<View> = scatter.channels.iter().map(view).collect();
            // Where channels agree on a variant that each alone had to average over, more of them show it.
            let settled = effect.settled(&views).and_then(seek);
            found.push(settled.filter(|settled| settled.gain > scatter.gain).unwrap_or(scatter));
        }
    }
    found.sort_by(|one, other| other.gain.total_cmp(&one.gain));
    found
}
