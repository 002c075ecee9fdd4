//! A recording through the filter that flies.
//!
//! In: rows, from where they begin and at which rate the filter runs. Out: the error against the reference wherever it
//! is scored. The filter is `emems::kalman`, in f32, bit for bit what the unit computes; only the gyros' integration
//! within a period is done here, in f64.
//!
//! A period's rotation is composed of the samples' rotations, each the mean of two rates. Specific force and field are
//! the single samples at the period's end, as the unit reads them once a packet.

use emems::kalman::{Filter, Params, Sampled, Step};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    recording::Row,
    score::{Rmse, Score},
};

/// White noise of the sensors, per component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// [rad^2/s] of the rates: angle random walk.
    pub angle: f32,
    /// [(m/s2)^2] of specific force.
    pub acc: f32,
    /// [uT^2] of the field.
    pub mag: f32,
}

/// How a recording is replayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replay {
    /// Parameters of the filter.
    pub params: Params,
    /// Noise of the sensors.
    pub noise: Noise,
    /// [rad/s] step of the rates' codes where they were cut towards zero; 0 where they were rounded.
    pub cut_step: f64,
    /// Rows in a period of the filter.
    pub rows_per_step: usize,
}

impl Replay {
    /// The steps of the filter, each with the row that it ends at.
    pub fn steps<'a>(&self, rows: &'a [Row]) -> impl Iterator<Item = (Step, &'a Row)> + use<'a> {
        let (noise, cut_step) = (self.noise, self.cut_step);
        let ends = (0..rows.len()).step_by(self.rows_per_step.max(1));
        ends.clone()
            .zip(ends.skip(1))
            .map(move |(from, to)| (step(&rows[from..=to], &noise, cut_step), &rows[to]))
    }

    /// Errors of the filter over `rows`.
    pub fn score(&self, rows: &[Row]) -> Option<Rmse> {
        let mut filter = Filter::new(self.params);
        let mut score = Score::default();
        for (step, row) in self.steps(rows) {
            filter.step(&step);
            if let (true, true, Some(reference_nb)) = (filter.aligned, row.scored, row.reference_nb) {
                score.add(&filter.attitude().cast(), &reference_nb);
            }
        }
        score.rmse()
    }
}

/// The step from the first of `rows` to the last.
fn step(rows: &[Row], noise: &Noise, cut_step: f64) -> Step {
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    let turned = rows.windows(2).fold(UnitQuaternion::identity(), |turned, pair| {
        let angle: Vector3<f64> =
            (uncut(&pair[0].rate_b, cut_step) + uncut(&pair[1].rate_b, cut_step)) * 0.5 * (pair[1].t_s - pair[0].t_s);
        turned * UnitQuaternion::from_scaled_axis(angle)
    });
    let at_us = micros(last.t_s);
    let covered_s = (last.t_s - first.t_s) as f32;
    let sampled = |value: Option<Vector3<f64>>, variance| {
        value.map(|value| Sampled {
            value_b: value.cast(),
            variance,
            at_us,
        })
    };
    Step {
        at_us,
        covered_s,
        angle_b: turned.scaled_axis().cast(),
        angle_variance: noise.angle * covered_s,
        rate_b: uncut(&last.rate_b, cut_step).cast(),
        saturated: false,
        acc: sampled(last.acc_b, noise.acc),
        mag: sampled(last.mag_b, noise.mag),
        lift_off: false,
    }
}

/// The middle of what a code that was cut towards zero stands for: half a step further out, zero itself being the middle of
/// both sides. Otherwise a bias looks half a step smaller at rest than it is in motion.
fn uncut(rate_b: &Vector3<f64>, step: f64) -> Vector3<f64> {
    rate_b.map(|rate| {
        if rate.abs() > 0.5 * step {
            rate + (0.5 * step).copysign(rate)
        } else {
            rate
        }
    })
}

/// [s] the filter's clock at the recording's zero: recordings may begin before theirs, the filter's clock may not.
pub const EPOCH_S: f64 = 1e6;

fn micros(t_s: f64) -> u64 {
    ((t_s + EPOCH_S) * 1e6).round() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_rate_has_the_same_mean_at_rest_and_in_motion() {
        const STEP: f64 = 0.1;
        let mean = |middle: f64| {
            let cut = (0..1000).map(|k| middle + (f64::from(k) / 500.0 - 1.0) * 2.0 * STEP);
            let codes = cut.map(|rate| (rate / STEP).trunc() * STEP);
            let all = codes.map(|code| uncut(&Vector3::new(code, -code, 0.0), STEP));
            all.sum::<Vector3<f64>>() / 1000.0
        };
        for middle in [0.0, 0.03, 0.31, -0.52] {
            let found = mean(middle);
            let off = (found - Vector3::new(middle, -middle, 0.0)).norm();
            assert!(off < 0.01 * STEP, "{middle}: {found}");
        }
    }
}
