//! A log through the filter: what it estimated, step by step, and how it fared.
//!
//! In: steps. Out: [`Flight`], with TRIAD alone beside the filter, every innovation, and against a reference the mean,
//! standard deviation and root mean square of the error about each axis of b, as chapter 6 of the thesis has them.
//!
//! A reference may have another rate or start later: it is compared where it has a sample within half a step, and what
//! it does not cover is not scored.

use std::collections::BTreeMap;

use emems::{
    attitude::euler,
    kalman::{Filter, Innovation, Params, Quantity, Step},
    triad::{Sighting, triad},
};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    recording::Row,
    score::{Rmse, Score},
    whiteness::Check,
};

/// One step's estimate.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// [s] time of the step.
    pub t_s: f64,
    /// The filter's attitude.
    pub q_nb: UnitQuaternion<f64>,
    /// TRIAD's, from this step's vectors alone.
    pub triad_nb: Option<UnitQuaternion<f64>>,
    /// [rad] standard deviation of the attitude about north, east and down.
    pub sd_n: Vector3<f64>,
    /// [rad/s] gyro bias.
    pub bias_b: Vector3<f64>,
    /// What was compared in it.
    pub innovations: Vec<Innovation>,
}

/// A log, estimated.
#[derive(Clone, Debug, Default)]
pub struct Flight {
    /// Every step with an attitude.
    pub estimates: Vec<Estimate>,
    /// Steps refused, by reason.
    pub refused: BTreeMap<String, usize>,
    /// [s] when the attitude was found afresh.
    pub aligned_s: Vec<f64>,
}

/// Errors against a reference.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// [deg] mean error about each axis of b.
    pub mean_deg: Vector3<f64>,
    /// [deg] its standard deviation.
    pub sd_deg: Vector3<f64>,
    /// Root mean squares.
    pub rmse: Rmse,
    /// Root mean squares of TRIAD alone, where it has an attitude.
    pub triad: Option<Rmse>,
    /// Samples compared.
    pub count: usize,
}

impl Flight {
    /// Estimates a log.
    pub fn of(params: Params, steps: impl IntoIterator<Item = Step>) -> Self {
        let mut filter = Filter::new(params);
        let mut flight = Flight::default();
        for step in steps {
            let outcome = filter.step(&step);
            let t_s = step.at_us as f64 * 1e-6;
            if let Some(refusal) = outcome.refusal {
                *flight.refused.entry(format!("{refusal:?}")).or_default() += 1;
            }
            if outcome.aligned {
                flight.aligned_s.push(t_s);
            }
            if filter.aligned {
                let variances = filter.attitude_covariance_n().diagonal();
                flight.estimates.push(Estimate {
                    t_s,
                    q_nb: filter.attitude().cast(),
                    triad_nb: alone(&step),
                    sd_n: variances.map(|variance| f64::from(variance).sqrt()),
                    bias_b: filter.bias_b.cast(),
                    innovations: outcome.innovations.to_vec(),
                });
            }
        }
        flight
    }

    /// With its times moved by `by_s` [s].
    pub fn shifted(mut self, by_s: f64) -> Self {
        for t_s in self
            .estimates
            .iter_mut()
            .map(|estimate| &mut estimate.t_s)
            .chain(&mut self.aligned_s)
        {
            *t_s += by_s;
        }
        self
    }

    /// Normalised residuals of a quantity in the order they came, accepted ones only: the gate's tail is not theirs.
    pub fn residuals(&self, quantity: Quantity) -> Vec<f64> {
        let all = self.estimates.iter().flat_map(|estimate| &estimate.innovations);
        all.filter(|record| record.quantity == quantity && record.accepted)
            .map(|record| f64::from(record.residual) / f64::from(record.variance).sqrt())
            .collect()
    }

    /// Size, whiteness and shape of each quantity's innovations.
    pub fn checks(&self) -> Vec<(Quantity, Check)> {
        use Quantity::*;
        let all = [Bias, Velocity, FieldEast, FieldMeridian];
        all.into_iter()
            .filter_map(|quantity| Some((quantity, Check::of(&self.residuals(quantity))?)))
            .collect()
    }

    /// Against the rows of a reference; `None` where they never meet.
    pub fn compare(&self, reference: &[Row]) -> Option<Comparison> {
        let (mut score, mut triad) = (Score::default(), Score::default());
        let mut errors: Vec<Vector3<f64>> = Vec::new();
        for pair in self.estimates.windows(2) {
            let (estimate, near_s) = (&pair[1], (pair[1].t_s - pair[0].t_s) / 2.0);
            let Some(row) = nearest(reference, estimate.t_s).filter(|row| (row.t_s - estimate.t_s).abs() <= near_s)
            else {
                continue;
            };
            let (Some(reference_nb), true) = (row.reference_nb, row.scored) else {
                continue;
            };
            score.add(&estimate.q_nb, &reference_nb);
            if let Some(triad_nb) = estimate.triad_nb {
                triad.add(&triad_nb, &reference_nb);
            }
            errors.push((reference_nb.inverse() * estimate.q_nb).scaled_axis());
        }
        let count = errors.len();
        let mean = errors.iter().sum::<Vector3<f64>>() / count as f64;
        let square = errors
            .iter()
            .map(|error| (error - mean).map(|part| part * part))
            .sum::<Vector3<f64>>();
        Some(Comparison {
            mean_deg: mean.map(f64::to_degrees),
            sd_deg: (square / count as f64).map(|variance| variance.sqrt().to_degrees()),
            rmse: score.rmse()?,
            triad: triad.rmse(),
            count,
        })
    }
}

impl Estimate {
    /// [deg] roll, pitch, yaw.
    pub fn euler_deg(&self) -> [f64; 3] {
        let euler = euler(&self.q_nb.cast());
        [euler.roll, euler.pitch, euler.yaw].map(|angle| f64::from(angle).to_degrees())
    }
}

/// The row nearest to a time; rows are in order.
fn nearest(rows: &[Row], t_s: f64) -> Option<&Row> {
    let after = rows.partition_point(|row| row.t_s < t_s);
    let around = [after.checked_sub(1), Some(after)]
        .into_iter()
        .flatten()
        .filter_map(|at| rows.get(at));
    around.min_by(|a, b| (a.t_s - t_s).abs().total_cmp(&(b.t_s - t_s).abs()))
}

/// TRIAD on one step's vectors, north being magnetic.
fn alone(step: &Step) -> Option<UnitQuaternion<f64>> {
    let sighting = |seen_b, known_n| Sighting {
        seen_b,
        known_n,
        seen_sd: 0.01,
        known_sd: 0.0,
    };
    let down = sighting(-step.acc?.value_b, Vector3::z());
    Some(
        triad(&down, &sighting(step.mag?.value_b, Vector3::x()))
            .ok()?
            .q_nb
            .cast(),
    )
}
