//! Effects of the library as what a slow course is: columns that are tried beside all that is open.
//!
//! In: the library. Out: per effect its columns ([`Asked`]), and once they were tried the [`Screen`] of each of its hypotheses, whose
//! evidence is of the same samples, beside the same, as a slow course's Bayes factor.
//!
//! Effects that are there or not have no columns here. What only a faster sampling shows is averaged away.

use nalgebra::DMatrix;

use super::{Beside, Seen, normal::Tried};
use crate::{
    library::hypotheses::Library,
    null::{evidence::Screen, problem::Problem},
};

/// The columns of an effect, all its places and variants.
pub(super) struct Asked {
    /// Columns in the library, rising.
    places: Vec<usize>,
    /// Hypotheses that are made of them.
    hypotheses: Vec<usize>,
}

/// Of every effect of the library.
pub(super) fn asked(library: &Library) -> Vec<Asked> {
    let mut all: Vec<(&str, Asked)> = Vec::new();
    for (at, hypothesis) in library.hypotheses.iter().enumerate() {
        if hypothesis.small().is_empty() {
            continue;
        }
        if all.last().is_none_or(|(effect, _)| *effect != hypothesis.effect()) {
            let none = Asked {
                places: Vec::new(),
                hypotheses: Vec::new(),
            };
            all.push((hypothesis.effect(), none));
        }
        if let Some((_, asked)) = all.last_mut() {
            asked.hypotheses.push(at);
            asked.places.extend(hypothesis.small());
        }
    }
    let sorted = |(_, mut asked): (&str, Asked)| {
        asked.places.sort_unstable();
        asked.places.dedup();
        asked
    };
    all.into_iter().map(sorted).collect()
}

impl Asked {
    /// In physical units at the means of a channel.
    pub fn tried<'a>(&'a self, problem: &'a Problem, library: &'a Library, seen: &'a [Seen]) -> Tried<'a> {
        let places = self.places.iter();
        let mut channels: Vec<usize> = places.flat_map(|place| library.products.channels(*place)).collect();
        channels.sort_unstable();
        channels.dedup();
        let of_channel = move |channel: usize| {
            let (binned, weights) = (&seen[channel].binned, &problem.frames[channel].weights);
            let mut means = DMatrix::zeros(binned.bins.len(), self.places.len());
            for (place, mut into) in self.places.iter().zip(means.column_iter_mut()) {
                if let Some(values) = library.products.values(*place, channel) {
                    into.copy_from_slice(&binned.means(|sample| values[sample] * weights[sample]));
                }
            }
            means
        };
        Tried {
            channels,
            width: self.places.len(),
            of_channel: Box::new(of_channel),
        }
    }
}

impl Beside {
    /// Of each hypothesis that was tried, its index and its normal equations beside the whole model.
    pub fn effects(&self, library: &Library) -> Vec<(usize, Screen)> {
        let Some(marginal) = self.sums.without(&[]) else {
            return Vec::new();
        };
        let mut screens = Vec::new();
        for (at, asked) in self.asked.iter().enumerate() {
            let (information, score) = marginal.of(self.found.len() + at, 0);
            for hypothesis in &asked.hypotheses {
                let small = library.hypotheses[*hypothesis].small();
                let own: Vec<usize> = (small.iter())
                    .filter_map(|place| asked.places.binary_search(place).ok())
                    .collect();
                let mut screen = Screen::zeros(small.iter().map(|place| library.prior_sigmas[*place]).collect());
                screen.information = information.select_rows(&own).select_columns(&own);
                screen.score = score.select_rows(&own);
                screens.push((*hypothesis, screen));
            }
        }
        screens
    }
}
