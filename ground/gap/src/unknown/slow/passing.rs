//! When an effect that comes and goes is on, beside all that is open.
//!
//! In: the library. Out: for each hypothesis whose cause [passes](twin::effect::Page::passes) its columns in each of so many pieces of the
//! log, tried like any others, and of their normal equations the stretch in which it is likeliest: one, or one that comes again. Sums over
//! pieces say that of every stretch; having looked at so many costs the logarithm of their number, as in [`crate::search::once`] and
//! [`crate::search::periodic`].

use std::{iter::once, ops::Range};

use nalgebra::{DMatrix, DVector};

use super::{Beside, Seen, normal::Tried};
use crate::{
    input::windows::Span,
    library::hypotheses::Library,
    null::{evidence::Screen, interval::Interval, problem::Problem},
    unknown::binned::BINS,
};

/// Pieces of a log for a first look at every effect, and for a closer one at one.
pub const PIECES: [usize; 2] = [40, 300];

/// Phases into which a period is folded, at a first look and a closer one.
const PHASES: [usize; 2] = [20, 100];

/// Pieces of the shortest period, and how often the longest comes.
const SHORTEST: f64 = 4.0;
const FEWEST: f64 = 3.0;

/// Steps of frequency in which the last cycle moves by a period.
const STEPS: f64 = 4.0;

/// An effect whose time is sought.
pub(super) struct Passing {
    /// Its hypothesis.
    pub hypothesis: usize,
    /// Columns in the library.
    places: Vec<usize>,
    /// Whether it comes again and again.
    repeats: bool,
    /// Pieces of the log.
    pieces: usize,
}

/// Those of a library, or one of them, in so many pieces.
pub(super) fn passing(problem: &Problem, library: &Library, only: Option<usize>, pieces: usize) -> Vec<Passing> {
    let starts_s = problem.twin.starts_s();
    let all = library.hypotheses.iter().enumerate();
    all.filter(|(at, own)| {
        let effect = own.cause.effect;
        let is_steady = effect.variants(starts_s).len() == 1 || effect.repeats(own.cause.variant);
        only.is_none_or(|only| only == *at) && effect.page().passes && is_steady && !own.small().is_empty()
    })
    .map(|(hypothesis, own)| Passing {
        hypothesis,
        places: own.small().to_vec(),
        repeats: own.cause.effect.repeats(own.cause.variant),
        pieces,
    })
    .collect()
}

impl Passing {
    /// Its columns in each piece, in physical units at the means of a channel.
    pub fn tried<'a>(&'a self, problem: &'a Problem, library: &'a Library, seen: &'a [Seen]) -> Tried<'a> {
        let mut channels: Vec<usize> = (self.places.iter())
            .flat_map(|place| library.products.column(*place))
            .map(|(channel, _)| *channel)
            .collect();
        channels.sort_unstable();
        channels.dedup();
        let width = self.places.len();
        let of_channel = move |channel: usize| {
            let (binned, weights) = (&seen[channel].binned, &problem.frames[channel].weights);
            let mut columns = DMatrix::zeros(binned.bins.len(), self.pieces * width);
            for (at, place) in self.places.iter().enumerate() {
                let own = library.products.column(*place).iter();
                if let Some((_, values)) = own.clone().find(|(own, _)| *own == channel) {
                    let means = binned.means(|sample| values[sample] * weights[sample]);
                    for (row, (mean, bin)) in means.iter().zip(&binned.bins).enumerate() {
                        columns[(row, bin * self.pieces / BINS * width + at)] = *mean;
                    }
                }
            }
            columns
        };
        Tried {
            channels,
            width: self.pieces * width,
            of_channel: Box::new(of_channel),
        }
    }

    /// The stretch in which it is likeliest, with its normal equations and the nats that having looked costs.
    fn best(
        &self,
        information: &DMatrix<f64>,
        score: &DVector<f64>,
        sigmas: &[f64],
        near: Option<[f64; 3]>,
    ) -> Option<Found> {
        if self.repeats {
            self.again(information, score, sigmas, near)
        } else {
            self.one(information, score, sigmas, near)
        }
    }

    /// Once: of all stretches between pieces.
    fn one(
        &self,
        information: &DMatrix<f64>,
        score: &DVector<f64>,
        sigmas: &[f64],
        near: Option<[f64; 3]>,
    ) -> Option<Found> {
        let sums = Sums::new(information, score, sigmas.len());
        let count = self.pieces;
        let is_near = |at: usize, edge: f64| (at as f64 / count as f64 - edge).abs() <= 1.0 / PIECES[0] as f64;
        let pairs = (0..count).flat_map(|from| (from + 1..=count).map(move |to| from..to));
        let pairs = pairs.filter(|own| own.len() < count);
        let pairs = pairs.filter(|own| near.is_none_or(|[on, off, _]| is_near(own.start, on) && is_near(own.end, off)));
        let tried = pairs.filter_map(|own| {
            let screen = sums.screen(own.clone(), sigmas);
            Some((screen.of_any_size(once(0..sigmas.len()))?, own, screen))
        });
        let (_, own, screen) = tried.max_by(|one, other| one.0.total_cmp(&other.0))?;
        Some(Found {
            at: [
                own.start as f64 / count as f64,
                own.end as f64 / count as f64,
                f64::INFINITY,
            ],
            screen,
            price: ((PIECES[0] * (PIECES[0] + 1) / 2) as f64).ln(),
        })
    }

    /// Again and again: of all stretches of phases of all periods.
    fn again(
        &self,
        information: &DMatrix<f64>,
        score: &DVector<f64>,
        sigmas: &[f64],
        near: Option<[f64; 3]>,
    ) -> Option<Found> {
        let most = PIECES[0] as f64 / SHORTEST;
        let steps = ((most - FEWEST) * STEPS) as usize;
        let cycles: Vec<f64> = match near {
            None => (0..=steps).map(|step| FEWEST + step as f64 / STEPS).collect(),
            Some([_, _, cycles]) => (-8..=8).map(|step| cycles + f64::from(step) / (8.0 * STEPS)).collect(),
        };
        let width = sigmas.len();
        let phases = PHASES[usize::from(near.is_some())];
        // How far the edges may lie from those found at the first look.
        let reach = phases / PHASES[0];
        let mut best: Option<(f64, Found)> = None;
        for cycles in cycles {
            let folded = self.folded(information, score, cycles, width, phases);
            let of = |edge: f64| (edge * cycles * phases as f64).round() as usize;
            let (ons, longs) = match near {
                None => (0..phases, 1..phases),
                Some([on, off, _]) => {
                    let (on, long) = (of(on) % phases + phases, of(off - on));
                    let least = long.saturating_sub(2 * reach).max(1);
                    (on - reach..on + reach + 1, least..(long + 2 * reach + 1).min(phases))
                }
            };
            for on in ons {
                for long in longs.clone() {
                    let screen = folded.around(on % phases, long, sigmas);
                    let Some(evidence) = screen.of_any_size(once(0..width)) else {
                        continue;
                    };
                    if best.as_ref().is_none_or(|(most, _)| evidence > *most) {
                        let edges = [on % phases, on % phases + long].map(|edge| edge as f64 / phases as f64);
                        let found = Found {
                            at: [edges[0] / cycles, edges[1] / cycles, cycles],
                            screen,
                            price: ((steps * PHASES[0] * PHASES[0]) as f64).ln(),
                        };
                        best = Some((evidence, found));
                    }
                }
            }
        }
        best.map(|(_, found)| found)
    }

    /// Normal equations of each phase, of so many cycles a log.
    fn folded(
        &self,
        information: &DMatrix<f64>,
        score: &DVector<f64>,
        cycles: f64,
        width: usize,
        phases: usize,
    ) -> Sums {
        let parts: Vec<Vec<(usize, f64)>> = (0..self.pieces)
            .map(|piece| self.phases(piece, cycles, phases))
            .collect();
        let mut folded = DMatrix::zeros(phases * width, phases * width);
        let mut scores = DVector::zeros(phases * width);
        for (one, of_one) in parts.iter().enumerate() {
            for (phase, part) in of_one {
                let own = score.rows(one * width, width);
                scores.rows_mut(phase * width, width).axpy(*part, &own, 1.0);
            }
            for (other, of_other) in parts.iter().enumerate() {
                let own = information.view((one * width, other * width), (width, width));
                for (row, part) in of_one {
                    for (column, other_part) in of_other {
                        let mut sum = folded.view_mut((row * width, column * width), (width, width));
                        sum += own * (part * other_part);
                    }
                }
            }
        }
        Sums::new(&folded, &scores, width)
    }

    /// The phases that a piece is in, and which part of it each has.
    fn phases(&self, piece: usize, cycles: f64, phases: usize) -> Vec<(usize, f64)> {
        let [from, to] = [piece, piece + 1].map(|edge| edge as f64 / self.pieces as f64 * cycles * phases as f64);
        let of_phase = |at: usize| {
            let part = (to.min((at + 1) as f64) - from.max(at as f64)) / (to - from);
            (at % phases, part)
        };
        (from as usize..to.ceil() as usize)
            .map(of_phase)
            .filter(|(_, part)| *part > 0.0)
            .collect()
    }
}

/// A stretch.
struct Found {
    /// When it begins and ends, in parts of the log, and how often it comes in one.
    at: [f64; 3],
    screen: Screen,
    price: f64,
}

/// Normal equations added up over pieces: `information[a][b]` is that of all pieces before `a` with all before `b`.
struct Sums {
    width: usize,
    information: Vec<Vec<DMatrix<f64>>>,
    score: Vec<DVector<f64>>,
}

impl Sums {
    fn new(information: &DMatrix<f64>, score: &DVector<f64>, width: usize) -> Self {
        let pieces = score.len() / width.max(1);
        let none = DMatrix::zeros(width, width);
        let mut all = vec![vec![none; pieces + 1]; pieces + 1];
        let mut scores = vec![DVector::zeros(width)];
        for row in 0..pieces {
            for column in 0..pieces {
                let own = information.view((row * width, column * width), (width, width));
                let sum = &all[row][column + 1] + &all[row + 1][column] - &all[row][column] + own;
                all[row + 1][column + 1] = sum;
            }
            scores.push(&scores[row] + score.rows(row * width, width));
        }
        Self {
            width,
            information: all,
            score: scores,
        }
    }

    fn between(&self, one: &Range<usize>, other: &Range<usize>) -> DMatrix<f64> {
        let all = &self.information;
        &all[one.end][other.end] - &all[one.start][other.end] - &all[one.end][other.start]
            + &all[one.start][other.start]
    }

    fn screen(&self, own: Range<usize>, sigmas: &[f64]) -> Screen {
        let mut screen = Screen::zeros(sigmas.to_vec());
        screen.information = self.between(&own, &own);
        screen.score = &self.score[own.end] - &self.score[own.start];
        screen
    }

    /// Of `long` pieces from `on`, the first coming after the last.
    fn around(&self, on: usize, long: usize, sigmas: &[f64]) -> Screen {
        let pieces = self.score.len() - 1;
        if on + long <= pieces {
            return self.screen(on..on + long, sigmas);
        }
        let (end, start) = (on..pieces, 0..on + long - pieces);
        let mut screen = Screen::zeros(sigmas.to_vec());
        let cross = self.between(&end, &start);
        screen.information = self.between(&end, &end) + self.between(&start, &start) + &cross + cross.transpose();
        screen.score = &self.score[pieces] - &self.score[on] + &self.score[start.end];
        debug_assert_eq!(screen.score.len(), self.width);
        screen
    }
}

impl Beside {
    /// Of each effect that comes and goes: its hypothesis, when it is on, its normal equations then, the nats that having looked costs, and
    /// where that is in parts of the log, for a closer look `near` it.
    pub fn stretches(
        &self,
        library: &Library,
        near: Option<[f64; 3]>,
    ) -> Vec<(usize, Interval, Screen, f64, [f64; 3])> {
        let Some(marginal) = self.sums.without(0..0) else {
            return Vec::new();
        };
        let first = self.found.len() + self.asked.len();
        let [from_s, to_s] = self.span_s;
        let at_s = |part: f64| from_s + part * (to_s - from_s);
        let of_one = |(at, passing): (usize, &Passing)| {
            let (information, score) = marginal.of(first + at, 0);
            let sigmas: Vec<f64> = passing
                .places
                .iter()
                .map(|place| library.prior_sigmas[*place])
                .collect();
            let found = passing.best(&information, &score, &sigmas, near)?;
            let [on, off, cycles] = found.at;
            let open = |edge: f64, end: f64, beyond: f64| if edge == end { beyond } else { at_s(edge) };
            let on = if cycles.is_finite() {
                Interval {
                    stretch: Span {
                        from: at_s(on),
                        to: at_s(off),
                    },
                    every_s: Some((to_s - from_s) / cycles),
                }
            } else {
                Span {
                    from: open(on, 0.0, f64::NEG_INFINITY),
                    to: open(off, 1.0, f64::INFINITY),
                }
                .into()
            };
            Some((passing.hypothesis, on, found.screen, found.price, found.at))
        };
        self.passing.iter().enumerate().filter_map(of_one).collect()
    }
}
