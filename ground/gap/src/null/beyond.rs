//! Beyond what a reference and a field may be off: how many nats an effect is worth that these cannot have done.
//!
//! In: the problem, how reference and field err slowly ([`SlowErrors`]), a model, one of its effects. Out: by how many nats the model is
//! likelier with the effect than without, `(E(r_without) - E(r_with)) / 2`, where `E(r) = r'K^-1 r - b'(A + I)^-1 b`. `K` is the covariance
//! of white noise and of how reference and field [`wander`](super::wander), which [`super::whitening`] takes out. `A` and `b` are the inner products, in those units, of what is open, each column times its sigma, with
//! each other and with `r`: the calibration, the field and its [`gradient`], and the [`point`] whose position is told.
//!
//! A table that tilts slowly by two sigmas of the attitude is worth two nats here, however long the log is. The search has a coarser null,
//! for it asks thousands of times. There the point is not open: a lever arm of a centimetre would be ten sigmas of it and worth fifty nats,
//! however plain it is.
//!
//! A reference that is exact errs by nothing, and what the search says then stands. A column that is not finite at a sample says nothing there.

use nalgebra::{Cholesky, DMatrix, Dyn};
use twin::predict::{Column, Feel};

use crate::{
    input::case::SlowErrors,
    null::{
        gradient, point,
        problem::{Component, Problem},
        wander::{of_states, processes, sees},
        whitening::{Sample, Whitening, places},
    },
};

/// What is known of a log when nothing is wrong.
pub struct Beyond<'a> {
    problem: &'a Problem<'a>,
    /// Channel, sample and row of each sample, in the order of time.
    order: Vec<[usize; 3]>,
    whitening: Whitening,
    /// What is open, whitened, a sample a row.
    open: DMatrix<f64>,
    /// `A + I`, factored.
    factor: Cholesky<f64, Dyn>,
}

impl<'a> Beyond<'a> {
    /// Of a problem; `None` where the reference is exact.
    pub fn of(problem: &'a Problem<'a>, errors: &SlowErrors) -> Option<Self> {
        if errors.attitude_sigma_rad <= 0.0 {
            return None;
        }
        let twin = problem.true_twin();
        let channels = &twin.unit().channels;
        let mut order: Vec<[usize; 3]> = Vec::new();
        for (channel, frame) in problem.frames.iter().enumerate() {
            let rows = frame.series.rows.iter().enumerate();
            order.extend(rows.map(|(sample, row)| [channel, sample, *row as usize]));
        }
        order.sort_by_key(|[channel, _, row]| [*row, *channel]);
        let feels: Vec<Vec<Feel>> = (0..channels.len()).map(|channel| twin.feels(channel)).collect();
        let processes = processes(errors);
        let (at, _) = places(&processes);
        let sample = |[channel, _, row]: &[usize; 3]| Sample {
            t_s: twin.starts_s()[*row],
            sees: of_states(&sees(&channels[*channel], &feels[*channel][*row]), &at),
            variance: problem.white_sigma(*channel, *row).powi(2),
        };
        let samples: Vec<Sample> = order.iter().map(sample).collect();
        let whitening = Whitening::new(&processes, &samples);
        let point = point::columns(twin, &problem.instrument.accuracy);
        let gradient = gradient::columns(twin, errors);
        let columns: Vec<&Column> = (0..channels.len())
            .flat_map(|channel| problem.open(channel))
            .chain(&problem.reference)
            .chain(&gradient)
            .chain(&point)
            .collect();
        let mut open = DMatrix::zeros(order.len(), columns.len());
        for (mut into, column) in open.column_iter_mut().zip(&columns) {
            for (channel, rows) in &column.entries {
                for (value, [own, _, row]) in into.iter_mut().zip(&order) {
                    if own == channel && rows[*row].is_finite() {
                        *value = rows[*row] * column.sigma;
                    }
                }
            }
        }
        let open = whitening.whiten(&open);
        let factor = Cholesky::new(open.tr_mul(&open) + DMatrix::identity(columns.len(), columns.len()))?;
        Some(Beyond {
            problem,
            order,
            whitening,
            open,
            factor,
        })
    }

    /// \[nats\] that `model[of]` is worth.
    pub fn nats(&self, model: &[Component], of: usize) -> f64 {
        let mut others = model.to_vec();
        others.remove(of);
        let [without, with] = [others.as_slice(), model].map(|model| self.energy(model));
        0.5 * (without - with)
    }

    /// What a model leaves, in squares of noise.
    fn energy(&self, model: &[Component]) -> f64 {
        let predicted = self.problem.predictions(model);
        let rest = |[channel, sample, row]: &[usize; 3]| {
            self.problem.frames[*channel].series.values[*sample] - predicted[*channel][*row]
        };
        let rests = DMatrix::from_iterator(self.order.len(), 1, self.order.iter().map(rest));
        let white = self.whitening.whiten(&rests);
        let pull = self.open.tr_mul(&white.column(0));
        white.norm_squared() - pull.dot(&self.factor.solve(&pull))
    }
}

#[cfg(test)]
mod tests;
