//! How well an effect explains its samples if it is on in some of them only, for every stretch between some edges.
//!
//! In: the columns of an effect, channel by channel ([`Touched`]), and edges along an order of the samples: their time, or their phase in
//! a period. Out: [`Steps`], and with a residual [`Stretches`], the normal equations of every stretch. With `c_j` the effect's column on
//! before edge `j` only and `c` on always, a stretch has the column `c_off - c_on`, and one that goes over the end of the order
//! `c_off - c_on + c`. So the products of the `c_j` with each other and with the residual tell all stretches.
//!
//! Where noise is white, `c_i'c_j` is a sum over the samples before the earlier edge. In colour it is not. There slow errors leave of a step
//! little but its edges, and the whitened column of what is on always has no edge. So each `c_j` is made in physical units and then whitened.
//! The products with a residual are sums over samples in both cases ([`Frame::dual`]).

use nalgebra::{DMatrix, DVector};

use crate::{
    library::column::Entries,
    null::{
        evidence::Screen,
        problem::{Frame, Problem},
    },
};

/// What a residual says of each channel's samples.
pub struct Residual {
    /// In units of noise, without what the calibration takes up of it.
    left: Vec<DVector<f64>>,
    /// What each sample of a column in physical units makes of its inner product with that.
    dual: Vec<DVector<f64>>,
}

impl Residual {
    /// Of the residuals of every channel.
    pub fn of(problem: &Problem, rest: &[DVector<f64>]) -> Self {
        let frames = || problem.frames.iter();
        let left: Vec<DVector<f64>> = frames().zip(rest).map(|(frame, rest)| frame.left(rest)).collect();
        let dual = frames().zip(&left).map(|(frame, left)| frame.dual(left)).collect();
        Residual { left, dual }
    }
}

/// A channel that an effect touches.
pub struct Touched<'a> {
    channel: usize,
    /// The channel's samples.
    pub frame: &'a Frame,
    /// \[s\] when each sample was taken.
    pub instants_s: Vec<f64>,
    /// Which of the effect's columns are not zero here: of one with parameters for each plate, a plate's.
    places: Vec<usize>,
    /// These columns, a row a sample, in physical units.
    slopes: DMatrix<f64>,
}

impl<'a> Touched<'a> {
    /// Every channel that an effect with these `slopes`, in units of noise, touches.
    pub fn all(problem: &'a Problem<'a>, slopes: &[Entries]) -> Vec<Self> {
        let starts_s = problem.twin.starts_s();
        let touched = |(channel, frame): (usize, &'a Frame)| {
            let own = |(place, entries): (usize, &Entries)| {
                let entry = entries.iter().find(|(index, _)| *index == channel);
                entry.map(|(_, values)| (place, values.clone()))
            };
            let (places, columns): (Vec<usize>, Vec<DVector<f64>>) = slopes.iter().enumerate().filter_map(own).unzip();
            (!places.is_empty()).then(|| Touched {
                channel,
                frame,
                instants_s: (frame.series.rows.iter()).map(|row| starts_s[*row as usize]).collect(),
                places,
                slopes: frame.physical(DMatrix::from_columns(&columns)),
            })
        };
        problem.frames.iter().enumerate().filter_map(touched).collect()
    }

    /// What the calibration leaves of the residual.
    pub fn left<'r>(&self, residual: &'r Residual) -> &'r DVector<f64> {
        &residual.left[self.channel]
    }

    /// What parameters of the effect explain of each sample if it is on in some only.
    pub fn explained(&self, theta: &DVector<f64>, is_on: impl Fn(f64) -> bool) -> DVector<f64> {
        let own = DVector::from_iterator(self.places.len(), self.places.iter().map(|place| theta[*place]));
        let mut explained = &self.slopes * own;
        let off = explained
            .iter_mut()
            .zip(&self.instants_s)
            .filter(|(_, t_s)| !is_on(**t_s));
        off.for_each(|(value, _)| *value = 0.0);
        self.frame.left(&self.frame.white(explained))
    }

    /// For each edge and the end, the samples since the edge before; `passed` says how many edges are not after a sample.
    fn pieces(passed: &[usize], edges: usize) -> Vec<Vec<usize>> {
        let mut pieces = vec![Vec::new(); edges + 1];
        (passed.iter().enumerate()).for_each(|(sample, passed)| pieces[*passed].push(sample));
        pieces
    }

    /// Products with each other of the columns on before each edge and always, the calibration marginalised.
    fn products(&self, passed: &[usize], edges: usize) -> DMatrix<f64> {
        let width = self.places.len();
        let (mut products, mut open) = match &self.frame.colour {
            Some(_) => {
                let columns = self.before_edges(passed, edges);
                // A product of matrices goes by blocks, `tr_mul` by one column after another.
                let transposed = columns.transpose();
                let open = (&transposed * &*self.frame.nuisance).transpose();
                (transposed * columns, open)
            }
            None => {
                let (all, open_count) = ((edges + 1) * width, self.frame.nuisance.ncols());
                let (mut products, mut open) = (DMatrix::zeros(all, all), DMatrix::zeros(open_count, all));
                let (mut sum, mut open_sum) = (DMatrix::zeros(width, width), DMatrix::zeros(open_count, width));
                for (edge, samples) in Self::pieces(passed, edges).iter().enumerate() {
                    let mut slopes = self.slopes.select_rows(samples);
                    let weights = self.frame.weights.select_rows(samples);
                    slopes
                        .column_iter_mut()
                        .for_each(|mut column| column.component_div_assign(&weights));
                    sum += slopes.tr_mul(&slopes);
                    open_sum += self.frame.nuisance.select_rows(samples).tr_mul(&slopes);
                    let at = edge * width;
                    for later in (edge..=edges).map(|later| later * width) {
                        products.view_mut((at, later), (width, width)).copy_from(&sum);
                        products.view_mut((later, at), (width, width)).copy_from(&sum);
                    }
                    open.columns_mut(at, width).copy_from(&open_sum);
                }
                (products, open)
            }
        };
        self.frame.solve_open(&mut open);
        products -= open.transpose() * &open;
        products
    }

    /// The columns on before each edge, and always, in units of noise.
    fn before_edges(&self, passed: &[usize], edges: usize) -> DMatrix<f64> {
        let width = self.places.len();
        let mut columns = DMatrix::zeros(self.slopes.nrows(), (edges + 1) * width);
        for (sample, passed) in passed.iter().enumerate() {
            for at in passed * width..columns.ncols() {
                columns[(sample, at)] = self.slopes[(sample, at % width)];
            }
        }
        self.frame.whites(columns)
    }
}

/// The columns of an effect that is on before each of some edges, and always.
pub struct Steps {
    edges: usize,
    width: usize,
    /// Of each channel that the effect touches, how many edges are not after a sample.
    passed: Vec<Vec<usize>>,
    /// Products with each other, of each pair.
    information: Vec<DMatrix<f64>>,
}

impl Steps {
    /// Of an effect of so many parameters, at `edges` that rise; `order` says where along them an instant is.
    pub fn at(touched: &[Touched], width: usize, edges: &[f64], order: impl Fn(f64) -> f64) -> Self {
        let count = edges.len() + 1;
        let mut information = vec![DMatrix::zeros(width, width); count * count];
        let mut passed = Vec::with_capacity(touched.len());
        for own in touched {
            let of_sample = (own.instants_s.iter()).map(|t_s| {
                let place = order(*t_s);
                edges.partition_point(|edge| *edge <= place)
            });
            let of_channel: Vec<usize> = of_sample.collect();
            let products = own.products(&of_channel, edges.len());
            passed.push(of_channel);
            let own_width = own.places.len();
            for (pair, sum) in information.iter_mut().enumerate() {
                let (edge, other) = (pair / count * own_width, pair % count * own_width);
                for (row, to_row) in own.places.iter().enumerate() {
                    for (column, to_column) in own.places.iter().enumerate() {
                        sum[(*to_row, *to_column)] += products[(edge + row, other + column)];
                    }
                }
            }
        }
        Steps {
            edges: edges.len(),
            width,
            passed,
            information,
        }
    }

    /// With a residual, and the prior sigmas of the parameters.
    pub fn explaining(&self, touched: &[Touched], residual: &Residual, sigmas: &[f64]) -> Stretches<'_> {
        let mut score = vec![DVector::zeros(self.width); self.edges + 1];
        for (own, passed) in touched.iter().zip(&self.passed) {
            let dual = &residual.dual[own.channel];
            let mut since = DMatrix::<f64>::zeros(own.places.len(), self.edges + 1);
            for (column, slopes) in own.slopes.column_iter().enumerate() {
                for (passed, (slope, dual)) in passed.iter().zip(slopes.iter().zip(dual)) {
                    since[(column, *passed)] += slope * dual;
                }
            }
            for (column, place) in own.places.iter().enumerate() {
                let mut sum = 0.0;
                for (score, since) in score.iter_mut().zip(since.row(column).iter()) {
                    sum += since;
                    score[*place] += sum;
                }
            }
        }
        Stretches {
            steps: self,
            sigmas: sigmas.to_vec(),
            score,
        }
    }
}

/// The normal equations of an effect for every stretch between some edges.
pub struct Stretches<'a> {
    steps: &'a Steps,
    sigmas: Vec<f64>,
    /// Of the columns on before each edge and always, products with the residual.
    score: Vec<DVector<f64>>,
}

impl Stretches<'_> {
    /// On from one edge to another, or from one over the end of the order to one that is not after it.
    pub fn screen(&self, on: usize, off: usize) -> Screen {
        let all = self.steps.edges;
        self.sum(&[(off, 1.0), (on, -1.0), (all, f64::from(u8::from(off <= on)))])
    }

    /// On always.
    pub fn always(&self) -> Screen {
        self.sum(&[(self.steps.edges, 1.0)])
    }

    fn sum(&self, parts: &[(usize, f64)]) -> Screen {
        let mut screen = Screen::zeros(self.sigmas.clone());
        for (edge, sign) in parts.iter().filter(|(_, sign)| *sign != 0.0) {
            screen.score.axpy(*sign, &self.score[*edge], 1.0);
            for (other, other_sign) in parts.iter().filter(|(_, sign)| *sign != 0.0) {
                let products = &self.steps.information[edge * (self.steps.edges + 1) + other];
                screen.information += products * (sign * other_sign);
            }
        }
        screen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        input::reference::Reference,
        null::{colour::Colour, problem::tumbling, whitening::Process},
    };

    const ROWS: usize = 100;

    /// Relative rounding of some thousand sums.
    const ROUNDING: f64 = 1e-9;

    fn wave(rate: f64) -> DVector<f64> {
        DVector::from_fn(ROWS, |row, _| (row as f64 * rate).sin())
    }

    /// Two parameters, of which the first is in one of two channels, one white and one coloured.
    #[test]
    fn every_stretch_has_the_normal_equations_of_the_effect_switched_on_in_it() {
        let twin = tumbling::twin(ROWS as u32);
        let starts_s = twin.starts_s().to_vec();
        let fit = tumbling::log(&twin, |_| 0.0);
        let exact = Reference::default();
        let mut problem = Problem::new(&twin, &fit, &exact);
        let slow = Process::Alike {
            sigma: 3.0,
            alike_s: 4.0,
        };
        let seen = vec![vec![(0, 1.0)]; ROWS];
        let mut frames = problem.frames.clone();
        frames[5].tint(Colour::of(&wave(2.1), &starts_s, &[slow], &seen));
        problem.reframe(frames);
        let courses = [(0, 3, wave(0.3)), (1, 3, wave(0.7)), (1, 5, wave(1.1))];
        let slopes: Vec<Entries> = (0..2)
            .map(|place| {
                let own = courses.iter().filter(|(of, ..)| *of == place);
                own.map(|(_, channel, course)| (*channel, problem.frames[*channel].white(course.clone())))
                    .collect()
            })
            .collect();
        let rest: Vec<DVector<f64>> = (0..problem.frames.len())
            .map(|channel| wave(0.05 * channel as f64))
            .collect();
        let sigmas = [2.0, 0.5];
        let expected = |is_on: &dyn Fn(f64) -> bool| {
            let mut screen = Screen::zeros(sigmas.to_vec());
            for (channel, places) in [(3, vec![0, 1]), (5, vec![1])] {
                let frame = &problem.frames[channel];
                let own = courses.iter().filter(|(_, of, _)| *of == channel);
                let columns: Vec<DVector<f64>> = own
                    .map(|(.., course)| {
                        let on = starts_s.iter().map(|t_s| f64::from(u8::from(is_on(*t_s))));
                        frame.white(course.component_mul(&DVector::from_iterator(ROWS, on)))
                    })
                    .collect();
                screen.add(&places, &frame.normal(&DMatrix::from_columns(&columns), &rest[channel]));
            }
            screen
        };
        let touched = Touched::all(&problem, &slopes);
        let steps = Steps::at(&touched, sigmas.len(), &[3.0, 8.1, 14.0], |t_s| t_s);
        let stretches = steps.explaining(&touched, &Residual::of(&problem, &rest), &sigmas);
        let check = |found: Screen, expected: Screen| {
            assert!(
                (&found.information - &expected.information).norm() < ROUNDING * expected.information.norm(),
                "{} {}",
                found.information,
                expected.information
            );
            assert!((&found.score - &expected.score).norm() < ROUNDING * expected.score.norm().max(1.0));
        };
        check(stretches.always(), expected(&|_| true));
        check(stretches.screen(0, 2), expected(&|t_s| (3.0..14.0).contains(&t_s)));
        check(stretches.screen(1, 2), expected(&|t_s| (8.1..14.0).contains(&t_s)));
        check(stretches.screen(2, 0), expected(&|t_s| !(3.0..14.0).contains(&t_s)));
    }
}
