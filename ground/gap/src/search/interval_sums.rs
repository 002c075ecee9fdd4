//! Sums over some of an effect's samples, from which follows how well it explains these if it is on in them alone.
//!
//! In: the columns of an effect, channel by channel ([`Touched`]). Out: [`Piece`]s, which add up: a stretch of time is the
//! difference of two that begin with the log, one that comes again the sum of its cycles.

use nalgebra::{DMatrix, DVector};

use crate::{
    library::products::Entries,
    null::{
        evidence::Screen,
        problem::{Frame, Problem},
    },
};

/// A channel that an effect touches.
pub struct Touched<'a> {
    /// The channel's samples.
    pub frame: &'a Frame,
    /// One residual a sample, in units of noise.
    pub residual: DVector<f64>,
    /// Which of the effect's columns are not zero here: of one with parameters for each plate, a plate's.
    places: Vec<usize>,
    /// These columns, a row a sample.
    slopes: DMatrix<f64>,
}

impl<'a> Touched<'a> {
    /// Every channel that an effect with these `slopes` touches, with its `residual`.
    pub fn all(problem: &'a Problem<'a>, slopes: &[Entries], residual: impl Fn(usize) -> DVector<f64>) -> Vec<Self> {
        let touched = |(channel, frame): (usize, &'a Frame)| {
            let own = |(place, entries): (usize, &Entries)| {
                let entry = entries.iter().find(|(index, _)| *index == channel);
                entry.map(|(_, values)| (place, values.clone()))
            };
            let (places, columns): (Vec<usize>, Vec<DVector<f64>>) = slopes.iter().enumerate().filter_map(own).unzip();
            (!places.is_empty()).then(|| Touched {
                frame,
                residual: residual(channel),
                places,
                slopes: DMatrix::from_columns(&columns),
            })
        };
        problem.frames.iter().enumerate().filter_map(touched).collect()
    }
}

/// Sums over some samples of the channels that an effect of so many parameters touches.
pub struct Piece {
    information: DMatrix<f64>,
    score: DVector<f64>,
    /// For each of these channels what its calibration can imitate of its columns.
    open: Vec<DMatrix<f64>>,
}

impl Piece {
    /// Over none.
    pub fn none(touched: &[Touched], width: usize) -> Self {
        let open = |own: &Touched| DMatrix::zeros(own.frame.nuisance.ncols(), own.places.len());
        Piece {
            information: DMatrix::zeros(width, width),
            score: DVector::zeros(width),
            open: touched.iter().map(open).collect(),
        }
    }

    /// Adds these samples of one channel, the `at`-th.
    pub fn add(&mut self, at: usize, touched: &Touched, samples: &[usize]) {
        let slopes = touched.slopes.select_rows(samples);
        let (information, score) = (
            slopes.tr_mul(&slopes),
            slopes.tr_mul(&touched.residual.select_rows(samples)),
        );
        for (row, to_row) in touched.places.iter().enumerate() {
            self.score[*to_row] += score[row];
            for (column, to_column) in touched.places.iter().enumerate() {
                self.information[(*to_row, *to_column)] += information[(row, column)];
            }
        }
        let mut open = touched.frame.nuisance.select_rows(samples).tr_mul(&slopes);
        touched.frame.solve_open(&mut open);
        self.open[at] += open;
    }

    /// With the samples of another.
    pub fn and(mut self, other: &Piece) -> Self {
        self.information += &other.information;
        self.score += &other.score;
        (self.open.iter_mut().zip(&other.open)).for_each(|(sum, open)| *sum += open);
        self
    }

    /// Without the samples of another.
    pub fn less(&self, other: &Piece) -> Self {
        let open = self.open.iter().zip(&other.open);
        Piece {
            information: &self.information - &other.information,
            score: &self.score - &other.score,
            open: open.map(|(all, open)| all - open).collect(),
        }
    }

    /// The normal equations of parameters with these prior sigmas. What the calibration takes up of the columns is taken off;
    /// what it takes up of a residual is taken off where `taken` says how much of it each channel's can, or is left to the caller.
    pub fn screen(&self, touched: &[Touched], sigmas: &[f64], taken: &[DVector<f64>]) -> Screen {
        let mut screen = Screen::zeros(sigmas.to_vec());
        screen.information.copy_from(&self.information);
        screen.score.copy_from(&self.score);
        for (at, (own, open)) in touched.iter().zip(&self.open).enumerate() {
            let (imitated, score) = (open.tr_mul(open), taken.get(at).map(|taken| open.tr_mul(taken)));
            for (row, to_row) in own.places.iter().enumerate() {
                screen.score[*to_row] -= score.as_ref().map_or(0.0, |score| score[row]);
                for (column, to_column) in own.places.iter().enumerate() {
                    screen.information[(*to_row, *to_column)] -= imitated[(row, column)];
                }
            }
        }
        screen
    }
}

#[cfg(test)]
mod tests {
    use twin::{
        environment::Environment,
        motion::Tumble,
        predict::{Scene, Twin, emems},
    };

    use super::*;
    use crate::input::{log::Series, reference::Reference, windows::Fit};

    const ROWS: usize = 100;

    /// Relative rounding of some thousand sums.
    const ROUNDING: f64 = 1e-9;

    fn wave(rate: f64) -> DVector<f64> {
        DVector::from_fn(ROWS, |row, _| (row as f64 * rate).sin())
    }

    #[test]
    fn two_halves_are_the_normal_equations_of_all_samples() {
        let environment = Environment::laboratory();
        let starts_s: Vec<f64> = (0..ROWS).map(|row| row as f64 * 0.2).collect();
        let scene = Scene::new(&Tumble::new(), &environment, 0.0, 20.0, 0.01);
        let twin = Twin::new(emems(|_| 0.0), environment, scene, starts_s).expect("no effect is named");
        let all = Series {
            rows: (0..ROWS as u32).collect(),
            values: vec![0.0; ROWS],
        };
        let fit = Fit {
            channels: vec![all; twin.unit().channels.len()],
        };
        let exact = Reference::default();
        let problem = Problem::new(&twin, &fit, &exact);
        // Two parameters, of which the first is in one of two channels.
        let slopes: [Entries; 2] = [vec![(3, wave(0.3))], vec![(3, wave(0.7)), (5, wave(1.1))]];
        let residual = |channel: usize| wave(0.05 * channel as f64);
        let sigmas = [2.0, 0.5];
        let mut expected = Screen::zeros(sigmas.to_vec());
        for (channel, places) in [(3, vec![0, 1]), (5, vec![1])] {
            let columns: Vec<DVector<f64>> =
                [vec![wave(0.3), wave(0.7)], vec![wave(1.1)]][usize::from(channel == 5)].clone();
            let effects = DMatrix::from_columns(&columns);
            expected.add(&places, &problem.frames[channel].normal(&effects, &residual(channel)));
        }
        let touched = Touched::all(&problem, &slopes, residual);
        let over = |samples: std::ops::Range<usize>| {
            let samples: Vec<usize> = samples.collect();
            let mut piece = Piece::none(&touched, slopes.len());
            (touched.iter().enumerate()).for_each(|(at, own)| piece.add(at, own, &samples));
            piece
        };
        let taken: Vec<DVector<f64>> = touched.iter().map(|own| own.frame.open_part(&own.residual)).collect();
        let (first, second) = (over(0..ROWS / 2), over(ROWS / 2..ROWS));
        let whole = first.and(&second);
        let found = whole.screen(&touched, &sigmas, &taken);
        let near = |found: f64, expected: f64| (found - expected).abs() < ROUNDING * expected.abs().max(1.0);
        assert!(near(
            found.log_evidence().expect("finite"),
            expected.log_evidence().expect("finite")
        ));
        assert!((found.information - expected.information).norm() < ROUNDING * ROWS as f64);
        let half = whole.less(&second).screen(&touched, &sigmas, &taken);
        let again = over(0..ROWS / 2).screen(&touched, &sigmas, &taken);
        assert!((half.information - again.information).norm() < ROUNDING * ROWS as f64);
        assert!((half.score - again.score).norm() < ROUNDING * ROWS as f64);
    }
}
