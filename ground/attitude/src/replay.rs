//! A recording through the filter that flies.
//!
//! In: rows, from where they begin and at which rate the filter runs. Out: the error against the reference wherever it
//! is scored. The filter is `emems::kalman`, in f32, bit for bit what the unit computes; only the gyros' integration
//! within a period is done here, in f64.
//!
//! A period's rotation is composed of the samples' rotations, each the mean of two rates. Field is the single sample at the
//! period's end, as the unit reads it once a packet. Specific force is the mean of a few samples evenly through the period,
//! each turned to its end, as the unit reads it ([`emems::increments::forces`]).

use emems::kalman::{Filter, Params, Sampled, Step};
use logs::{
    recording::Row,
    score::{Rmse, Score},
};
use nalgebra::{UnitQuaternion, Vector3};

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
    /// Samples of specific force in it, the one at its end among them.
    pub forces: usize,
}

impl Replay {
    /// The steps of the filter, each with the row that it ends at.
    pub fn steps<'a>(&self, rows: &'a [Row]) -> impl Iterator<Item = (Step, &'a Row)> + use<'a> {
        let replay = *self;
        let ends = (0..rows.len()).step_by(self.rows_per_step.max(1));
        ends.clone()
            .zip(ends.skip(1))
            .map(move |(from, to)| (replay.step(&rows[from..=to]), &rows[to]))
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

    /// The step from the first of `rows` to the last.
    fn step(&self, rows: &[Row]) -> Step {
        let (first, last) = (&rows[0], &rows[rows.len() - 1]);
        let at_us = micros(last.t_s);
        let covered_s = (last.t_s - first.t_s) as f32;
        let sampled = |value: Option<Vector3<f64>>, variance| {
            value.map(|value| Sampled {
                value_b: value.cast(),
                variance,
                scatter: 0.0,
                at_us,
            })
        };
        let (acc_b, count) = self.force(rows);
        Step {
            at_us,
            covered_s,
            angle_b: self.turned(rows).scaled_axis().cast(),
            angle_variance: self.noise.angle * covered_s,
            rate_b: uncut(&last.rate_b, self.cut_step).cast(),
            saturated: false,
            acc: sampled(acc_b, self.noise.acc / count),
            mag: sampled(last.mag_b, self.noise.mag),
            lift_off: false,
        }
    }

    /// How b turned from the first of `rows` to the last.
    fn turned(&self, rows: &[Row]) -> UnitQuaternion<f64> {
        rows.windows(2).fold(UnitQuaternion::identity(), |turned, pair| {
            let [before_b, after_b] = [&pair[0], &pair[1]].map(|row| uncut(&row.rate_b, self.cut_step));
            turned * UnitQuaternion::from_scaled_axis((before_b + after_b) * 0.5 * (pair[1].t_s - pair[0].t_s))
        })
    }

    /// Mean specific force in b at the last of `rows`, and of how many samples. `None` where the last was not read, as on
    /// the unit.
    fn force(&self, rows: &[Row]) -> (Option<Vector3<f64>>, f32) {
        let last = rows.len() - 1;
        let forces = self.forces.clamp(1, last.max(1));
        let before = (1..forces).filter_map(|part| {
            let rows = &rows[last * part / forces..];
            Some(self.turned(rows).inverse() * rows[0].acc_b?)
        });
        let (mut sum_b, mut count) = (Vector3::zeros(), 1.0);
        for acc_b in before {
            sum_b += acc_b;
            count += 1.0;
        }
        (rows[last].acc_b.map(|acc_b| (sum_b + acc_b) / count), count as f32)
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

/// \[s\] the filter's clock at the recording's zero: recordings may begin before theirs, the filter's clock may not.
pub const EPOCH_S: f64 = 1e6;

fn micros(t_s: f64) -> u64 {
    ((t_s + EPOCH_S) * 1e6).round() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit that turns at 2 rad/s, and is pushed in n for the middle third of a period.
    #[test]
    fn force_is_the_mean_through_the_period_turned_to_its_end() {
        let rate_b = Vector3::new(1.2, -0.8, 1.4);
        let force_n = |k: usize| Vector3::new(if (20..40).contains(&k) { 3.0 } else { 0.0 }, 0.0, -9.81);
        let q_nb = |k: usize| UnitQuaternion::from_scaled_axis(rate_b * (k as f64 / 300.0));
        let row = |k: usize| Row {
            t_s: k as f64 / 300.0,
            rate_b,
            acc_b: Some(q_nb(k).inverse() * force_n(k)),
            mag_b: None,
            reference_nb: None,
            scored: true,
        };
        let rows: Vec<Row> = (0..=60).map(row).collect();
        let force_b = |forces| {
            let replay = Replay {
                params: Params::ROOM,
                noise: Noise {
                    angle: 0.0,
                    acc: 3e-4,
                    mag: 0.1,
                },
                cut_step: 0.0,
                rows_per_step: 60,
                forces,
            };
            let (step, _) = replay.steps(&rows).next().expect("a period");
            step.acc.expect("force")
        };
        let at_end = |push: f64| q_nb(60).inverse() * Vector3::new(push, 0.0, -9.81);
        let (single, mean) = (force_b(1), force_b(3));
        assert!((single.value_b - at_end(0.0).cast()).norm() < 1e-5);
        assert!((mean.value_b - at_end(1.0).cast()).norm() < 1e-5, "{mean:?}");
        assert_eq!((single.variance, mean.variance), (3e-4, 3e-4 / 3.0));
    }

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
