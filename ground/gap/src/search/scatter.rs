//! Effects that change how readings scatter and not what they are: noise, stale samples, coarse steps, bursts.
//!
//! In: the [`Problem`] and what a model predicts with its calibration. Out: the [`Scatter`] that makes the log likeliest, with
//! the channels it is in. They are judged after the deterministic effects, whose misfit would look like noise, and those are
//! then searched anew with the noise as found ([`crate::null::problem::Problem::reframe`]).
//!
//! A part that converts by its own clock scatters with the slope of what it measures in any case
//! ([`crate::null::calibration::instant_sigma_s`]); an effect counts only by what it says beyond that.
//!
//! Each is judged with the calibration that goes with it ([`crate::search::recalibrated`]).
//!
//! A channel is counted in when its likelihood gains more than one parameter fitted to so many samples costs
//! (`1/2 ln n`, Schwarz 1978) and one nat for having been looked at.

mod blocks;
mod likelihood;
mod screen;

use nalgebra::DVector;
use twin::{
    effect::{Beneath, Effect, Scope, View, logged_step, sigma_of},
    part::signal::Noise,
};

pub use self::likelihood::scatters;
use crate::{
    null::{
        model::Model,
        problem::{Frame, Problem},
    },
    search::recalibrated::{of_samples, recalibrated},
};

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
    /// \[nats\] over the nominal scatter, prices paid.
    pub gain: f64,
    /// What each of them was before it, at every row; nothing where it does not say.
    pub beneath: Vec<Vec<Beneath>>,
}

/// Least worth of a sample: numbers stay finite.
const WORTHLESS: f64 = 1e-9;

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

    /// Sigmas of the parameters, for readings that are `predicted` without it, at every row. Channels of one value tell of it
    /// together; of a line each has an amplitude, known in n samples to the noise over the root of n/2.
    pub fn sigmas(&self, problem: &Problem, predicted: &[Vec<f64>]) -> Vec<Vec<f64>> {
        if self.is_line() {
            let samples = |channel: &usize| problem.frames[*channel].series.rows.len().max(1) as f64;
            let sigmas = self.channels.iter().zip(&self.thetas);
            return sigmas
                .map(|(channel, thetas)| vec![(2.0 / samples(channel)).sqrt(); thetas.len()])
                .collect();
        }
        let logged = |channel: &usize| (problem.twin.instants_s(*channel), problem.measured(*channel));
        let logged: Vec<(Vec<f64>, Vec<f64>)> = self.channels.iter().map(logged).collect();
        let of = |thetas: &Vec<f64>| -> Vec<f64> {
            let alike = (self.channels.iter().zip(&logged).zip(&self.thetas)).filter(|(_, other)| *other == thetas);
            let views: Vec<View> = alike
                .map(|((channel, (t_s, measured)), _)| View {
                    channel: &problem.twin.unit().channels[*channel],
                    t_s,
                    predicted: &predicted[*channel],
                    measured,
                    step: logged_step(measured),
                })
                .collect();
            let sigma = |theta: &f64| sigma_of(self.effect, self.variant, &views, *theta);
            thetas.iter().map(sigma).collect()
        };
        self.thetas.iter().map(of).collect()
    }

    /// Whether it is a line of one frequency, of some amplitude in each channel.
    fn is_line(&self) -> bool {
        blocks::is_hidden(self.effect) && self.variant > 0.0
    }

    /// Whether it says what the samples of a channel were before it.
    pub fn tells_of(&self, channel: usize) -> bool {
        let told = self.channels.iter().zip(&self.beneath);
        told.into_iter().any(|(own, _)| *own == channel)
    }

    /// The problem's frames with what was there before it, for a search after everything else.
    pub fn uncovered(&self, problem: &Problem) -> Vec<Frame> {
        let mut frames = problem.frames.clone();
        for (channel, rows) in self.channels.iter().zip(&self.beneath) {
            let noise = of_samples(problem, *channel, rows, |beneath, _| {
                beneath.worth.max(WORTHLESS).sqrt().recip()
            });
            let values = of_samples(problem, *channel, rows, |beneath, _| beneath.value);
            frames[*channel].series.values = values.as_slice().to_vec();
            frames[*channel].reweigh(&noise);
        }
        frames
    }

    /// What the sensors of its channels read by themselves, with the calibration that goes with it, given the model that it was
    /// found beside.
    pub fn recalibrated(&self, problem: &Problem, beside: &Model) -> Vec<(usize, Vec<f64>)> {
        let told = self.channels.iter().zip(&self.beneath);
        told.map(|(channel, rows)| (*channel, recalibrated(problem, beside, *channel, rows).predicted))
            .collect()
    }

    /// What a channel logs on the whole, where its sensor reads `predicted`.
    pub fn expected(&self, problem: &Problem, channel: usize, predicted: &[f64]) -> Vec<f64> {
        let (t_s, measured) = (problem.twin.instants_s(channel), problem.measured(channel));
        let view = View {
            channel: &problem.twin.unit().channels[channel],
            t_s: &t_s,
            predicted,
            measured: &measured,
            step: logged_step(&measured),
        };
        self.effect.expected(self.variant, &view)
    }
}
