//! A walk of gyros' zeros, found beside effects on readings, with what it leaves of these.
//!
//! In: the problem and effects. Out: the [`Walk`] that makes the log likeliest beside them, frames in which it is open, so
//! that a search finds what is there besides, and its [`Courses`] at every row, so that a fit follows it. A calibration that is fitted first has taken up half of a walk, and effects of
//! time and temperature the rest piece by piece; here calibration and walk are marginalised together.
//!
//! A walk of `s` per sqrt(s) over T seconds is its first Karhunen-Loeve terms, `sqrt 2 sin(x_k t/T)` of variance `s^2 T/x_k^2`
//! with `x_k = (k - 1/2) pi`. With these as further columns `S D` of the calibration, D their sigmas, the log gains
//! `1/2 b'D (I + D A D)^-1 D b - 1/2 ln |I + D A D|` nats, where `A = S'P S` and `b = S'P r` (Rasmussen and Williams 2006, 5.8 and
//! A.9), so a size costs one small factorisation.

use std::f64::consts::{PI, SQRT_2};

use nalgebra::{Cholesky, DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use twin::{
    effect::{Effect, LIBRARY, Texture},
    predict::Kind,
};

use crate::{
    null::{
        model::Courses,
        normal::{Normal, log_determinant},
        problem::{Component, Frame, Problem},
    },
    search::scatter::Scatter,
    thresholds::{SELDOM, WALK_FEWEST},
};

/// Terms of a walk. What they leave is 0.6 % of its power (the sum of `2/x_k^2` beyond), in five minutes that of periods
/// under 19 s.
const TERMS: usize = 32;

/// Sizes tried, in prior sigmas, and the factor between them.
const SIZES: (f64, f64) = (0.05, 200.0);
const STEP: f64 = 1.25;

/// Logarithm of the ratio of sizes that are one: a search is the same with either.
const NEAR: f64 = 0.4;

/// Walks of some gyros.
#[derive(Clone)]
pub struct Walk {
    /// Channels, and in each of them the walk [rad/s per sqrt(s)].
    pub channels: Vec<(usize, f64)>,
    /// \[nats\] over no walk, prices paid.
    pub gain: f64,
    effect: &'static dyn Effect,
}

impl Walk {
    /// The likeliest beside these effects as they are; `None` where none is, or where it is withheld.
    pub fn beside(problem: &Problem, components: &[Component], withheld: &[String]) -> Option<Self> {
        let effect = LIBRARY.iter().find(|effect| effect.page().texture == Texture::Walk)?;
        if withheld.iter().any(|name| name == effect.page().name) {
            return None;
        }
        let gyros = gyros(problem);
        let mut walk = Walk {
            channels: Vec::new(),
            gain: log_prior(),
            effect: *effect,
        };
        for channel in &gyros {
            let samples = problem.frames[*channel].series.rows.len();
            if samples < WALK_FEWEST {
                continue;
            }
            let normal = normal(problem, *channel, components);
            let typical = effect
                .page()
                .parameters
                .first()
                .map_or(0.0, |symbol| symbol.prior_sigma);
            let at = |size: f64| (size, gain(&normal.information, &normal.score, size));
            let sizes = std::iter::successors(Some(SIZES.0 * typical), |size| Some(size * STEP));
            let gains = sizes.take_while(|size| *size < SIZES.1 * typical).map(at);
            let best = gains.max_by(|one, other| one.1.total_cmp(&other.1)).map(|(size, _)| {
                // The top of the parabola through it and its neighbours.
                let [below, here, above] = [size / STEP, size, size * STEP].map(|size| at(size).1);
                let bend = below - 2.0 * here + above;
                let part = if bend < 0.0 { 0.5 * (below - above) / bend } else { 0.0 };
                at(size * STEP.powf(part.clamp(-0.5, 0.5)))
            });
            let price = price(samples, gyros.len());
            if let Some((size, gain)) = best.filter(|(_, gain)| *gain > price) {
                walk.gain += gain - price;
                walk.channels.push((*channel, size));
            }
        }
        Some(walk).filter(|walk| walk.gain > 0.0)
    }

    /// \[nats\] of a walk as large as this one over no walk, prices paid, where nothing else is there. With those of effects in frames in which it
    /// is [open](Self::open) they are the evidence of both together: that of `y` and `x` is that of `y` and that of `x` given `y`. A walk that
    /// takes the effects' place is larger and gains more alone, and leaves them less.
    pub fn alone(&self, problem: &Problem) -> f64 {
        let count = gyros(problem).len();
        let of = |(channel, size): &(usize, f64)| {
            let normal = normal(problem, *channel, &[]);
            gain(&normal.information, &normal.score, *size) - price(problem.frames[*channel].series.rows.len(), count)
        };
        log_prior() + self.channels.iter().map(of).sum::<f64>()
    }

    /// Whether what is there beside these effects has the spectrum of a walk, not only its slowness: the pull of its terms, made
    /// white from the slowest term on, has squares of one on the mean in every octave, all channels together.
    pub fn is_one(&self, problem: &Problem, components: &[Component]) -> bool {
        let mut whites = Vec::new();
        for (channel, size) in &self.channels {
            let normal = normal(problem, *channel, components);
            match white(&normal.information, &normal.score, *size) {
                Some(white) => whites.push(white),
                None => return false,
            }
        }
        let octaves = std::iter::successors(Some(1), |first| Some(2 * first)).take_while(|first| *first <= TERMS);
        let off = |first: usize| {
            let terms = first - 1..(2 * first - 1).min(TERMS);
            let count = (terms.len() * whites.len()) as f64;
            let energy: f64 = whites
                .iter()
                .flat_map(|white| &white.as_slice()[terms.clone()])
                .map(|term| term * term)
                .sum();
            // Near Gaussian (Wilson and Hilferty 1931).
            let spread = 2.0 / (9.0 * count);
            ((energy / count).cbrt() - (1.0 - spread)) / spread.sqrt()
        };
        let off: Vec<f64> = octaves.map(off).collect();
        let energy: f64 = off.iter().map(|off| off * off).sum();
        ChiSquared::new(off.len() as f64).is_ok_and(|law| law.sf(energy) > SELDOM)
    }

    /// Frames of the problem with it open.
    pub fn open(&self, problem: &Problem, mut frames: Vec<Frame>) -> Vec<Frame> {
        for (channel, size) in &self.channels {
            let mut shapes = shapes(problem, *channel, &frames[*channel]);
            let scaled = shapes.column_iter_mut().zip(sigmas(*size));
            scaled.for_each(|(mut shape, sigma)| shape *= sigma);
            frames[*channel].widen(&shapes);
        }
        frames
    }

    /// Its courses at every row, for a fit that follows it. Between the fitted samples they are what these make likeliest, and beyond them
    /// they stay where they were.
    pub fn courses(&self, problem: &Problem) -> Courses {
        let of = |(channel, size): &(usize, f64)| {
            let (frame, t_s) = (&problem.frames[*channel], problem.twin.instants_s(*channel));
            let (first, span_s) = span_s(frame, &t_s);
            let sigmas: Vec<f64> = sigmas(*size).collect();
            let course = |row: usize, term: usize| sigmas[term] * shape(term, (t_s[row] - first) / span_s, span_s);
            (*channel, DMatrix::from_fn(t_s.len(), TERMS, course))
        };
        self.channels.iter().map(of).collect()
    }

    /// Its channels.
    pub fn places(&self) -> Vec<usize> {
        self.channels.iter().map(|(channel, _)| *channel).collect()
    }

    /// Whether it is in the same channels as another, and much as large.
    pub fn is_near(&self, other: &Walk) -> bool {
        self.channels.len() == other.channels.len()
            && (self.channels.iter().zip(&other.channels))
                .all(|((own, size), (its, at))| own == its && (size / at).ln().abs() < NEAR)
    }

    /// It as an effect on the scatter.
    pub fn scatter(&self) -> Scatter {
        Scatter {
            effect: self.effect,
            variant: 0.0,
            channels: self.places(),
            thetas: self.channels.iter().map(|(_, size)| vec![*size]).collect(),
            gain: self.gain,
            beneath: Vec::new(),
        }
    }
}

/// `T^1/2 sqrt 2 sin(x_k t/T)` at the fitted samples of a channel, in units of this frame's white noise for one unit of `s/x_k`.
fn shapes(problem: &Problem, channel: usize, frame: &Frame) -> DMatrix<f64> {
    let t_s = problem.twin.instants_s(channel);
    let (first, span_s) = span_s(frame, &t_s);
    let parts: Vec<f64> = (frame.series.rows.iter())
        .map(|row| (t_s[*row as usize] - first) / span_s)
        .collect();
    frame.whites(DMatrix::from_fn(parts.len(), TERMS, |row, term| {
        shape(term, parts[row], span_s)
    }))
}

/// \[s\] the first fitted sample of a channel, and from there to the last.
fn span_s(frame: &Frame, t_s: &[f64]) -> (f64, f64) {
    let at = |row: Option<&u32>| row.map_or(0.0, |row| t_s[*row as usize]);
    let (first, last) = (at(frame.series.rows.first()), at(frame.series.rows.last()));
    (first, (last - first).max(f64::MIN_POSITIVE))
}

/// The shape of a term, this part of the seconds after the first sample; beyond the last as there.
fn shape(term: usize, part: f64, span_s: f64) -> f64 {
    span_s.sqrt() * SQRT_2 * (place(term) * part.clamp(0.0, 1.0)).sin()
}

/// `x_k` of the term at an index.
fn place(index: usize) -> f64 {
    (index as f64 + 0.5) * PI
}

/// Of the terms of a walk, over the square root of its seconds.
fn sigmas(size: f64) -> impl Iterator<Item = f64> {
    (0..TERMS).map(move |term| size / place(term))
}

/// Channels that may walk.
fn gyros(problem: &Problem) -> Vec<usize> {
    let channels = problem.twin.unit().channels.iter().enumerate();
    let gyros = channels.filter(|(_, channel)| channel.sensor == Kind::Gyro);
    gyros.map(|(index, _)| index).collect()
}

/// \[nats\] of a walk before anything was seen: it is one effect of the library.
fn log_prior() -> f64 {
    -(LIBRARY.len() as f64).ln()
}

/// \[nats\] that its size in one of so many gyros costs, of so many samples.
fn price(samples: usize, gyros: usize) -> f64 {
    0.5 * (samples as f64).ln() + 1.0 + (gyros as f64).ln()
}

/// Normal equations of a walk's terms in a channel beside effects.
fn normal(problem: &Problem, channel: usize, components: &[Component]) -> Normal {
    let frame = &problem.frames[channel];
    frame.normal(&shapes(problem, channel, frame), &problem.residual(channel, components))
}

/// \[nats\] by which a walk of this size makes a log likelier.
fn gain(information: &DMatrix<f64>, score: &DVector<f64>, size: f64) -> f64 {
    let sigmas = DVector::from_iterator(TERMS, sigmas(size));
    let own = DMatrix::from_fn(TERMS, TERMS, |row, column| {
        sigmas[row] * information[(row, column)] * sigmas[column] + f64::from(u8::from(row == column))
    });
    let pull = score.component_mul(&sigmas);
    Cholesky::new(own).map_or(f64::NEG_INFINITY, |factor| {
        0.5 * (pull.dot(&factor.solve(&pull)) - log_determinant(&factor))
    })
}

/// What pulls at the terms of a walk of this size, of variance one each if it is one, from the slowest on.
fn white(information: &DMatrix<f64>, score: &DVector<f64>, size: f64) -> Option<DVector<f64>> {
    let squares = DMatrix::from_diagonal(&DVector::from_iterator(TERMS, sigmas(size).map(|sigma| sigma * sigma)));
    let factor = Cholesky::new(information + information * squares * information)?;
    let mut white = score.clone();
    factor.l_dirty().solve_lower_triangular_mut(&mut white);
    Some(white)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        input::reference::Reference,
        null::{evidence::Screen, problem::tumbling},
    };

    const ROWS: usize = 200;

    /// Relative rounding of some thousand sums.
    const ROUNDING: f64 = 1e-9;

    /// \[nats\] of columns of one channel with these sigmas, over none of them.
    fn evidence(frame: &Frame, columns: &DMatrix<f64>, sigmas: Vec<f64>, residual: &DVector<f64>) -> f64 {
        let all: Vec<usize> = (0..sigmas.len()).collect();
        let mut screen = Screen::zeros(sigmas);
        screen.add(&all, &frame.normal(columns, residual));
        screen.log_evidence().expect("finite")
    }

    /// The evidence of a walk alone, and of an effect with that walk open, is that of both together. With a larger walk alone it is not.
    #[test]
    fn a_walk_alone_and_an_effect_beside_it_are_worth_what_both_together_are() {
        let twin = tumbling::twin(ROWS as u32);
        let course = |row: u32| 0.01 * (0.02 * f64::from(row)).sin() + 0.003 * (0.9 * f64::from(row)).sin();
        let fit = tumbling::log(&twin, course);
        let exact = Reference::default();
        let problem = Problem::new(&twin, &fit, &exact);
        let gyro = gyros(&problem)[0];
        let at = |size: f64| Walk {
            channels: vec![(gyro, size)],
            gain: 0.0,
            effect: LIBRARY[0],
        };
        let frame = &problem.frames[gyro];
        let residual = problem.residual(gyro, &[]);
        let effect = DMatrix::from_fn(ROWS, 1, |row, _| 0.3 * row as f64 / ROWS as f64);
        let size = 1e-3;
        let mut both = shapes(&problem, gyro, frame).insert_columns(TERMS, 1, 0.0);
        both.column_mut(TERMS).copy_from(&effect.column(0));
        let together = evidence(frame, &both, sigmas(size).chain([2.0]).collect(), &residual);
        let open = at(size).open(&problem, problem.frames.clone());
        let beside = evidence(&open[gyro], &effect, vec![2.0], &residual);
        let paid = log_prior() - price(ROWS, gyros(&problem).len());
        let sum = |size: f64| at(size).alone(&problem) - paid + beside;
        assert!(
            (sum(size) - together).abs() < ROUNDING * together.abs().max(1.0),
            "{} {together}",
            sum(size)
        );
        assert!((sum(3.0 * size) - together).abs() > 1.0);
    }
}
