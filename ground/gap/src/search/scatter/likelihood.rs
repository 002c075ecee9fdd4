//! The search for effects on the scatter.
//!
//! In: the problem, a model and what it leaves. Out: the effects that gain anything, best first. All are tried about the
//! model's calibration; of those that come near the best, the calibration that goes with them is then found by expectation
//! and maximisation ([`crate::search::recalibrated`]), also in channels where only the wrong one hid them.

use rayon::prelude::*;
use twin::effect::{Beneath, Effect, LIBRARY, Nature, Texture, View, logged_step, most_likely};

use super::{
    Scatter, blocks,
    screen::{Oddness, are_odd, is_coloured, is_odd, is_unsteady, louder_by_stretch, oddness, own_clock},
};
use crate::{
    null::{model::Model, problem::Problem},
    search::recalibrated::{as_described, recalibrated},
    thresholds::{RARE, REFERENCE_TAILS, SCATTER_NEAR, sigmas},
};

/// Steps of expectation and maximisation, and what one must bring \[nats\].
const STEPS: usize = 5;
const CONVERGED: f64 = 0.5;

/// Every effect on the scatter that gains anything, best first.
pub fn scatters(problem: &Problem, model: &Model, withheld: &[String]) -> Vec<Scatter> {
    let search = Search::new(problem, model);
    let is_offered = |effect: &&&dyn Effect| {
        let page = effect.page();
        page.nature == Nature::Spread && withheld.iter().all(|name| name != page.name)
    };
    // What is not white is no effect that stands for white noise, unless a calibration of its own makes it so.
    let sought = |effect: &&'static dyn Effect| {
        let variants = effect.variants(problem.twin.starts_s());
        let price = -((LIBRARY.len() * variants.len()) as f64).ln();
        let seek = |variant: f64, is_strict: bool| search.seek(*effect, variant, price, is_strict);
        let strictly = |variant: &f64| {
            let scatter = seek(*variant, true)?;
            let views = search.views(&scatter.channels, |channel| &search.near[channel]);
            // Where channels agree on a variant that each alone had to average over, more of them show it.
            let settled = effect.settled(&views).and_then(|variant| seek(variant, true));
            Some(settled.filter(|settled| settled.gain > scatter.gain).unwrap_or(scatter))
        };
        let found: Vec<Scatter> = variants.par_iter().filter_map(strictly).collect();
        let is_hidden = effect.page().texture.is_white() && found.is_empty();
        let hidden = variants.par_iter().filter(|_| is_hidden);
        let hidden: Vec<Scatter> = hidden.filter_map(|variant| seek(*variant, false)).collect();
        (found, hidden)
    };
    let offered: Vec<&&dyn Effect> = LIBRARY.iter().filter(is_offered).collect();
    let (found, hidden): (Vec<_>, Vec<_>) = offered.into_par_iter().map(sought).unzip();
    let [mut found, mut hidden] =
        [found, hidden].map(|of_effects| of_effects.into_iter().flatten().collect::<Vec<_>>());
    by_gain(&mut found);
    by_gain(&mut hidden);
    let least = found.first().map_or(0.0, |best| SCATTER_NEAR * best.gain);
    let mut names: Vec<&str> = Vec::new();
    let mut near: Vec<Scatter> = Vec::new();
    for scatter in found.iter().chain(&hidden) {
        let name = scatter.effect.page().name;
        if scatter.gain >= least && !names.contains(&name) {
            names.push(name);
            let shifted = scatter.effect.shifted(scatter.variant);
            let variants = [scatter.variant].into_iter().chain(shifted);
            near.extend(variants.filter_map(|variant| search.uncovered(scatter, variant)));
        }
    }
    found.extend(near);
    by_gain(&mut found);
    found
}

/// \[nats\] the log of some channels if nothing scatters otherwise than described.
fn nominal(views: &[View]) -> f64 {
    views.iter().map(View::nominal).sum()
}

fn by_gain(found: &mut [Scatter]) {
    found.sort_by(|one, other| other.gain.total_cmp(&one.gain));
}

/// What the search looks at, channel by channel.
struct Search<'a> {
    problem: &'a Problem<'a>,
    model: &'a Model,
    /// \[s\] instants.
    instants: Vec<Vec<f64>>,
    /// At every row; NaN where nothing was logged.
    measured: Vec<Vec<f64>>,
    /// Predicted, or nearer to what was measured where the reference may err.
    near: Vec<Vec<f64>>,
    /// The same for what stands out of its own time.
    standing_out: Vec<Vec<f64>>,
    /// The first with the calibration as described, where that was dragged far.
    described: Vec<Option<Vec<f64>>>,
    steps: Vec<f64>,
    odd: Vec<Oddness>,
    own_clock: Vec<f64>,
}

/// One block of channels under an effect.
struct Block {
    theta: Vec<f64>,
    /// \[nats\] over the nominal scatter with the model's calibration.
    gain: f64,
    beneath: Vec<Vec<Beneath>>,
}

impl<'a> Search<'a> {
    fn new(problem: &'a Problem<'a>, model: &'a Model) -> Self {
        let twin = problem.twin;
        let channels = 0..twin.unit().channels.len();
        let measured: Vec<Vec<f64>> = channels.clone().map(|channel| problem.measured(channel)).collect();
        let mut search = Search {
            problem,
            model,
            instants: channels.clone().map(|index| twin.instants_s(index)).collect(),
            near: Vec::new(),
            standing_out: Vec::new(),
            described: Vec::new(),
            steps: measured.iter().map(|measured| logged_step(measured)).collect(),
            measured,
            odd: Vec::new(),
            own_clock: Vec::new(),
        };
        let near = |texture: Texture| -> Vec<Vec<f64>> {
            let of = |channel: usize| search.near(channel, &model.predicted[channel], texture);
            channels.clone().map(of).collect()
        };
        (search.near, search.standing_out) = (near(Texture::Louder), near(Texture::Outliers));
        let described = |channel: usize| {
            let is_dragged = model.fitted.nuisance[channel].amax() > sigmas(RARE);
            is_dragged.then(|| search.near(channel, &as_described(problem, model, channel), Texture::Louder))
        };
        search.described = channels.clone().map(described).collect();
        search.odd = channels.clone().map(|channel| oddness(&search.view(channel))).collect();
        search.own_clock = channels.map(|channel| own_clock(&search.view(channel))).collect();
        search
    }

    /// What is predicted of a channel, as far as it may be held against it: effects know the sensor's own noise, and a reference
    /// that errs as well must not look like more of it, nor its worse times like blows.
    fn near(&self, channel: usize, predicted: &[f64], texture: Texture) -> Vec<f64> {
        let problem = self.problem;
        let (own, is_limited) = (
            problem.twin.unit().channels[channel].sigma(),
            problem.is_limited(channel),
        );
        // What errs slowly is no scatter, unless there is more of it.
        let part = |row: usize| match is_limited {
            true => own / problem.sigmas[channel][row],
            false => problem.own_part(channel, row),
        };
        let (mut near, measured) = (predicted.to_vec(), &self.measured[channel]);
        let rows: Vec<usize> = (problem.frames[channel].series.rows.iter())
            .map(|row| *row as usize)
            .collect();
        let mut held: Vec<f64> = rows
            .iter()
            .map(|row| part(*row) * (measured[*row] - predicted[*row]))
            .collect();
        if is_limited && texture == Texture::Outliers {
            // How much a reference errs is not alike at all times, and a blow stands out of its own time.
            let louder = louder_by_stretch(&held);
            held.iter_mut().zip(louder).for_each(|(held, louder)| *held /= louder);
        }
        rows.iter()
            .zip(held)
            .for_each(|(row, held)| near[*row] = measured[*row] - held);
        near
    }

    fn near_of(&self, effect: &dyn Effect, channel: usize) -> &Vec<f64> {
        match effect.page().texture {
            Texture::Outliers => &self.standing_out[channel],
            _ => &self.near[channel],
        }
    }

    fn view(&self, channel: usize) -> View<'_> {
        self.view_near(channel, &self.near[channel])
    }

    fn view_near<'b>(&'b self, channel: usize, near: &'b [f64]) -> View<'b> {
        View {
            channel: &self.problem.twin.unit().channels[channel],
            t_s: &self.instants[channel],
            predicted: near,
            measured: &self.measured[channel],
            step: self.steps[channel],
        }
    }

    fn views<'b>(&'b self, block: &[usize], near: impl Fn(usize) -> &'b Vec<f64>) -> Vec<View<'b>> {
        let view = |channel: &usize| self.view_near(*channel, near(*channel));
        block.iter().map(view).collect()
    }

    /// An effect in every block that gains by it, about the model's calibration; if strictly, where it may be.
    fn seek(&self, effect: &'static dyn Effect, variant: f64, price: f64, is_strict: bool) -> Option<Scatter> {
        let judged = |block: &[usize]| {
            let views = self.views(block, |channel| self.near_of(effect, channel));
            let sought = |views: &[View], open: f64| {
                let is_possible = !is_strict || self.is_possible(effect, views);
                let (theta, gain) = is_possible.then(|| most_likely(effect, variant, views))?;
                let beneath = effect.beneath(&theta, variant, views);
                let gain = gain + open;
                Some(Block { theta, gain, beneath })
            };
            let found = sought(&views, 0.0);
            // What an effect adds may have dragged the calibration so far that nothing fits it any more.
            if block.iter().all(|channel| self.described[*channel].is_none()) {
                return found;
            }
            let near = |channel: usize| {
                self.described[channel]
                    .as_ref()
                    .unwrap_or(self.near_of(effect, channel))
            };
            let described = self.views(block, near);
            let dragged = block.iter().filter(|channel| self.described[**channel].is_some());
            let open: f64 = dragged
                .map(|channel| 0.5 * self.model.fitted.nuisance[*channel].norm_squared())
                .sum();
            let again = sought(&described, open + nominal(&described) - nominal(&views));
            let tells = |block: &Block| !block.beneath.is_empty();
            match (found, again.filter(tells)) {
                (Some(found), Some(again)) if again.gain <= found.gain => Some(found),
                (found, again) => again.or(found),
            }
        };
        self.gathered(effect, variant, price, judged)
    }

    /// An effect with the calibration that goes with it, if it says what is beneath it. In blocks where it was not found it begins
    /// as in those where it was.
    fn uncovered(&self, found: &Scatter, variant: f64) -> Option<Scatter> {
        if found.beneath.is_empty() {
            return None;
        }
        let effect = found.effect;
        let judged = |block: &[usize]| {
            let place = |channel: &usize| found.channels.iter().position(|own| own == channel);
            let mut theta = found.thetas[block.first().and_then(place).unwrap_or(0)].clone();
            let before = self.views(block, |channel| self.near_of(effect, channel));
            let places: Option<Vec<usize>> = block.iter().map(place).collect();
            let mut beneath = match places.filter(|_| variant == found.variant) {
                Some(places) => places.iter().map(|place| found.beneath[*place].clone()).collect(),
                None => effect.beneath(&theta, variant, &before),
            };
            let mut best: Option<Block> = None;
            for _ in 0..STEPS {
                let refits: Vec<_> = (block.iter().zip(&beneath))
                    .map(|(channel, rows)| recalibrated(self.problem, self.model, *channel, rows))
                    .collect();
                let open: f64 = refits.iter().map(|refit| refit.gain).sum();
                let near: Vec<(usize, Vec<f64>)> = (block.iter().zip(&refits))
                    .map(|(channel, refit)| (*channel, self.near(*channel, &refit.predicted, effect.page().texture)))
                    .collect();
                let views: Vec<View> = near
                    .iter()
                    .map(|(channel, near)| self.view_near(*channel, near))
                    .collect();
                if !self.is_possible(effect, &views) {
                    break;
                }
                let (likeliest, gain) = most_likely(effect, variant, &views);
                let gain = gain + nominal(&views) - nominal(&before) + open;
                let brings = best.as_ref().map_or(f64::INFINITY, |best| gain - best.gain);
                theta = likeliest;
                beneath = effect.beneath(&theta, variant, &views);
                if brings > 0.0 {
                    best = Some(Block {
                        theta: theta.clone(),
                        gain,
                        beneath: beneath.clone(),
                    });
                }
                if brings < CONVERGED {
                    break;
                }
            }
            best
        };
        let variants = effect.variants(self.problem.twin.starts_s()).len();
        let price = -((LIBRARY.len() * variants) as f64).ln();
        self.gathered(effect, variant, price, judged)
    }

    /// Whether an effect may be what these scatter by: one that stands for white noise is not where neighbours are alike, and noise
    /// of another level not where it comes and goes.
    fn is_possible(&self, effect: &dyn Effect, views: &[View]) -> bool {
        let texture = effect.page().texture;
        let is_refuted =
            |view: &View| texture.is_white() && is_coloured(view) || texture == Texture::Louder && is_unsteady(view);
        !views.iter().any(is_refuted)
    }

    /// An effect in every block in which it gains more than it costs there, or alike in all sensors of a kind.
    fn gathered(
        &self,
        effect: &'static dyn Effect,
        variant: f64,
        price: f64,
        judged: impl Fn(&[usize]) -> Option<Block> + Sync,
    ) -> Option<Scatter> {
        let mut blocks = blocks::own(self.problem, effect);
        let of = blocks.len();
        let odd_in = |block: &[usize]| -> Vec<Oddness> { block.iter().map(|index| self.odd[*index]).collect() };
        let is_hidden = blocks::is_hidden(effect);
        blocks.retain(|block| is_hidden || is_odd(&odd_in(block)));
        let each = self.gathered_in(&blocks, of, effect, variant, price, &judged);
        let mut kinds = blocks::kinds(self.problem, effect);
        let of = kinds.len();
        let is_found = |index: &usize| each.as_ref().is_some_and(|each| each.channels.contains(index));
        kinds.retain(|block| (is_hidden || are_odd(&odd_in(block))) && !block.iter().all(is_found));
        let alike = self.gathered_in(&kinds, of, effect, variant, price, &judged);
        match (each, alike) {
            (Some(each), Some(alike)) if alike.gain <= each.gain => Some(each),
            (each, alike) => alike.or(each),
        }
    }

    /// An effect in every one of these blocks, of so many, in which it gains more than it costs there.
    fn gathered_in(
        &self,
        blocks: &[Vec<usize>],
        of: usize,
        effect: &'static dyn Effect,
        variant: f64,
        price: f64,
        judged: impl Fn(&[usize]) -> Option<Block> + Sync,
    ) -> Option<Scatter> {
        let mut scatter = Scatter {
            effect,
            variant,
            channels: Vec::new(),
            thetas: Vec::new(),
            gain: price,
            beneath: Vec::new(),
        };
        let found: Vec<Option<Block>> = blocks.par_iter().map(|block| judged(block)).collect();
        for (block, found) in blocks.iter().zip(found) {
            let Some(found) = found else {
                continue;
            };
            let samples_of = |index: &usize| self.problem.frames[*index].series.rows.len();
            let samples: usize = block.iter().map(samples_of).sum();
            let of_reference = block.iter().filter(|index| self.problem.is_limited(**index));
            let gain = found.gain
                - block.iter().map(|index| self.own_clock[*index]).sum::<f64>()
                - REFERENCE_TAILS * of_reference.map(samples_of).sum::<usize>() as f64;
            let price = 0.5 * (samples.max(1) as f64).ln() * found.theta.len() as f64 + 1.0 + (of as f64).ln();
            if gain > price {
                scatter.gain += gain - price;
                scatter.channels.extend(block);
                // A line has one frequency, and in each channel a size of its own.
                let is_line = blocks::is_hidden(effect) && variant > 0.0 && block.len() > 1;
                let own = |channel: &usize| match is_line {
                    true => most_likely(effect, variant, &self.views(&[*channel], |channel| &self.near[channel])).0,
                    false => found.theta.clone(),
                };
                scatter.thetas.extend(block.iter().map(own));
                scatter.beneath.extend(found.beneath);
            }
        }
        Some(scatter).filter(|scatter| !scatter.channels.is_empty() && scatter.gain > 0.0)
    }
}
