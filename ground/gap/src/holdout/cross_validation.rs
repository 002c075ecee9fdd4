//! Does an effect predict data it was not fitted on? Cross-validation over contiguous blocks of the fit windows.
//!
//! In: the finished model. Out: for each of its effects a [`Key`]: how much better the model predicts left-out blocks with
//! the effect than without it, `sum of 1/2 (r_without^2 - r_with^2)`, with its standard error over [`BLOCKS`] blocks
//! (expected log predictive density; Vehtari, Gelman and Gabry 2017; blocks, because neighbouring rows are alike).
//!
//! Evidence is the first key, this is the second: where they disagree the smaller confidence holds. An effect that shows
//! in one block only (a shock, a lost packet) cannot be predicted from the others, so there it has no say; nor has it where the
//! calibration, refitted, predicts as well without the effect: a zero beyond what is known of zeros is told by its size alone.
//!
//! The calibration is refitted in every fold; the model is linear about the parameters found.

use nalgebra::DVector;
use rayon::prelude::*;
use statrs::function::erf::erfc;

use crate::{
    library::hypotheses::Library,
    null::{
        joint::{Columns, Joint},
        model::Model,
        problem::{Component, Problem},
    },
    thresholds::{EVENT, effect_margin},
};

/// Blocks, each left out in turn.
const BLOCKS: usize = 10;

/// What cross-validation says of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// \[nats\] by how much left-out blocks are better predicted.
    pub gain: f64,
    /// \[nats\] its standard error.
    pub error: f64,
}

impl Key {
    /// Probability that the gain is above zero.
    pub fn confidence(&self) -> f64 {
        if self.error > 0.0 {
            1.0 - 0.5 * erfc(self.gain / self.error / core::f64::consts::SQRT_2)
        } else {
            f64::from(u8::from(self.gain > 0.0))
        }
    }
}

/// A key for each effect of the model, in its order; `None` where it has no say.
pub fn keys(problem: &Problem, library: &Library, model: &Model) -> Vec<Option<Key>> {
    let blocks = blocks(problem);
    let with = errors(problem, library, model, &blocks);
    let key = |index: usize| {
        if is_event(problem, &model.components, index, &blocks) {
            return None;
        }
        let mut others = model.components.clone();
        others.remove(index);
        let without = errors(problem, library, &Model::around(problem, others), &blocks);
        key_of(&without, &with)
    };
    (0..model.components.len()).map(key).collect()
}

/// From the errors on each block, without the effect and with it.
fn key_of(without: &[Vec<DVector<f64>>], with: &[Vec<DVector<f64>>]) -> Option<Key> {
    let blocks = || without.iter().zip(with);
    let sum = |block: (&Vec<DVector<f64>>, &Vec<DVector<f64>>), of: fn(&DVector<f64>, &DVector<f64>) -> f64| -> f64 {
        block
            .0
            .iter()
            .zip(block.1)
            .map(|(without, with)| 0.5 * of(without, with))
            .sum()
    };
    let promised: f64 = blocks()
        .map(|block| sum(block, |without, with| (without - with).norm_squared()))
        .sum();
    if promised < effect_margin() {
        return None;
    }
    let gains: Vec<f64> = blocks()
        .map(|block| sum(block, |without, with| without.norm_squared() - with.norm_squared()))
        .collect();
    let count = gains.len() as f64;
    let gain: f64 = gains.iter().sum();
    let variance = gains.iter().map(|one| (one - gain / count).powi(2)).sum::<f64>() / (count - 1.0);
    Some(Key {
        gain,
        error: (count * variance).sqrt(),
    })
}

/// By channel, the block of each fitted sample.
fn blocks(problem: &Problem) -> Vec<Vec<usize>> {
    let rows = problem.fitted_rows();
    let block = |row: &u32| rows.partition_point(|one| *one < *row as usize) * BLOCKS / rows.len().max(1);
    let frames = problem.frames.iter();
    frames
        .map(|frame| frame.series.rows.iter().map(block).collect())
        .collect()
}

/// Whether most of an effect is in one block.
fn is_event(problem: &Problem, components: &[Component], index: usize, blocks: &[Vec<usize>]) -> bool {
    let mut energies = [0.0; BLOCKS];
    for (channel, apart) in problem.contribution(components, &[index]) {
        for (value, block) in apart.iter().zip(&blocks[channel]) {
            energies[*block] += value * value;
        }
    }
    let most = energies.iter().copied().fold(0.0, f64::max);
    most > EVENT * energies.iter().sum::<f64>()
}

/// The errors on each block, left out of the fit, channel by channel.
fn errors(problem: &Problem, library: &Library, model: &Model, blocks: &[Vec<usize>]) -> Vec<Vec<DVector<f64>>> {
    let mut sigmas = library.prior_sigmas[..library.reference].to_vec();
    for component in &model.components {
        let parameters = component.active.cause.parameters(problem.twin.unit());
        sigmas.extend(parameters.iter().map(|parameter| parameter.prior_sigma));
    }
    let fitted = &model.fitted;
    let about_zero: Vec<DVector<f64>> = (model.joint.columns().zip(&fitted.rest).zip(&fitted.nuisance))
        .map(|((columns, rest), nuisance)| rest + &*columns.nuisance * nuisance + &columns.effects * &fitted.parameters)
        .collect();
    let part = |block: usize, is_left_out: bool| -> (Vec<Columns>, Vec<DVector<f64>>) {
        let channels = model.joint.columns().zip(&about_zero).zip(blocks);
        let chosen = channels.map(|((columns, values), blocks)| {
            let rows: Vec<usize> = (0..blocks.len())
                .filter(|at| (blocks[*at] == block) == is_left_out)
                .collect();
            let columns = Columns {
                nuisance: columns.nuisance.select_rows(&rows).into(),
                effects: columns.effects.select_rows(&rows),
            };
            (columns, values.select_rows(&rows))
        });
        chosen.unzip()
    };
    let error = |block: usize| {
        let (columns, values) = part(block, false);
        let found = Joint::new(columns, &sigmas).fit(&values);
        let (columns, values) = part(block, true);
        let channels = columns.iter().zip(&values).zip(&found.nuisance);
        channels
            .map(|((columns, values), nuisance)| {
                values - &*columns.nuisance * nuisance - &columns.effects * &found.parameters
            })
            .collect()
    };
    (0..BLOCKS).into_par_iter().map(error).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The key of an effect that is worth so many nats in each block, beside an error of its own.
    fn key(nats: &[f64]) -> Option<Key> {
        let block = |worse: f64| vec![DVector::from_column_slice(&[3.0, (2.0 * worse.max(0.0)).sqrt()])];
        let without: Vec<_> = nats.iter().map(|nats| block(*nats)).collect();
        let with: Vec<_> = nats.iter().map(|nats| block(-nats)).collect();
        key_of(&without, &with)
    }

    #[test]
    fn a_steady_gain_is_believed_and_one_lucky_block_is_not() {
        let steady = key(&[2.0, 1.0, 3.0, 2.5, 1.5, 2.0, 1.0, 3.0, 2.0, 2.0]).expect("a say");
        assert!(
            (steady.gain - 20.0).abs() < 1e-9 && steady.confidence() > 0.999,
            "{steady:?}"
        );
        let mut lucky = [-0.1; 10];
        lucky[3] = 20.0;
        let lucky = key(&lucky).expect("a say");
        assert!(lucky.confidence() < 0.85, "{lucky:?}");
    }

    #[test]
    fn an_effect_that_predicts_worse_is_not_believed() {
        let worse = key(&[-1.0, -1.1, -1.0, -1.0]).expect("a say");
        assert!(worse.confidence() < 0.01, "{worse:?}");
    }

    #[test]
    fn an_effect_without_which_blocks_are_predicted_as_well_is_told_by_others() {
        assert_eq!(key(&[0.1, -0.1, 0.2, -0.1, 0.1]), None);
    }
}
