use core::f32::consts::PI;

use nalgebra::ComplexField;

use super::*;
use crate::attitude::{Euler, angle_between, from_euler, renormalised};

const DEG: f32 = PI / 180.0;
const GRAVITY: f32 = 9.806_65;
const FIELD: Reference = Reference::known(40.0, 60.0 * DEG, 0.0);

/// An ideal unit in an ideal world, 50 steps a second: what it is told can be changed step by step.
struct World {
    q_nb: UnitQuaternion<f32>,
    at_us: u64,
    filter: Filter,
    /// Most that an update has turned the attitude away from what the gyros said \[rad\].
    jump: f32,
}

const STEP_US: u64 = 20_000;
const STEP_S: f32 = 0.02;
/// \[s\] after the end of a window the state has its correction: four steps, and half of one for rounding.
const CORRECTED_S: f32 = 4.5 * STEP_S;

impl World {
    fn new(q_nb: UnitQuaternion<f32>, params: Params) -> Self {
        World {
            q_nb,
            at_us: 1_000_000,
            filter: Filter::new(params),
            jump: 0.0,
        }
    }

    fn field_n() -> Vector3<f32> {
        Vector3::new(20.0, 0.0, 34.641_016)
    }

    /// Turns at `rate_b` for `duration_s`; `change` has the last word on every step.
    fn fly(&mut self, duration_s: f32, rate_b: Vector3<f32>, mut change: impl FnMut(f32, &mut Step)) -> Outcome {
        let mut last = Outcome::default();
        let steps = (duration_s / STEP_S) as u32;
        for index in 0..steps {
            self.at_us += STEP_US;
            self.q_nb = renormalised(self.q_nb * from_rotation_vector(rate_b * STEP_S));
            let mut step = self.step(rate_b);
            change(index as f32 * STEP_S, &mut step);
            let (before, was_aligned) = (self.off(), self.filter.aligned);
            let outcome = self.filter.step(&step);
            assert!(self.filter.is_finite() && self.filter.iron.is_finite(), "at {index}");
            if was_aligned {
                self.jump = self.jump.max(self.off() - before);
            }
            if outcome != Outcome::default() {
                last = outcome;
            }
        }
        last
    }

    /// What an ideal unit has of this instant.
    fn step(&self, rate_b: Vector3<f32>) -> Step {
        let sampled = |value_b: Vector3<f32>| {
            Some(Sampled {
                value_b,
                variance: 0.0,
                scatter: 0.0,
                at_us: self.at_us,
            })
        };
        Step {
            at_us: self.at_us,
            covered_s: STEP_S,
            angle_b: rate_b * STEP_S,
            angle_variance: 0.0,
            rate_b,
            saturated: false,
            acc: sampled(self.q_nb.inverse_transform_vector(&Vector3::new(0.0, 0.0, -GRAVITY))),
            mag: sampled(self.q_nb.inverse_transform_vector(&Self::field_n())),
            lift_off: false,
        }
    }

    /// \[rad\] error of the attitude.
    fn off(&self) -> f32 {
        angle_between(&self.filter.attitude(), &self.q_nb)
    }

    fn off_by_less_than(&self, most_deg: f32) {
        assert!(self.filter.aligned);
        assert!(self.off() < most_deg * DEG, "{} deg", self.off() / DEG);
    }

    /// \[deg\] standard deviation about the axis it knows least.
    fn worst_sd_deg(&self) -> f32 {
        ComplexField::sqrt(self.filter.attitude_covariance_n().diagonal().max()) / DEG
    }
}

fn params() -> Params {
    Params {
        field: FIELD,
        ..Params::ROOM
    }
}

fn tilted() -> UnitQuaternion<f32> {
    from_euler(Euler {
        roll: 0.4,
        pitch: -0.7,
        yaw: 2.0,
    })
}

fn nothing(_: f32, _: &mut Step) {}

/// [rad/s] what biased gyros say of no rate at all.
const GYRO_BIAS_B: Vector3<f32> = Vector3::new(0.1 * DEG, -0.05 * DEG, 0.08 * DEG);

fn biased(step: &mut Step) {
    step.rate_b += GYRO_BIAS_B;
    step.angle_b += GYRO_BIAS_B * STEP_S;
}

mod compared;
mod correction;
mod disturbed;
mod force;
mod given;
mod gyros;
mod hostile;
mod iron;
mod nose;
mod propagated;
mod recovery;
mod resumed;
mod settled;

#[test]
fn at_rest_it_aligns_within_a_window_and_stays() {
    let mut world = World::new(tilted(), params());
    let first = world.fly(1.0, Vector3::zeros(), nothing);
    assert!(first.aligned);
    world.off_by_less_than(0.01);
    world.fly(60.0, Vector3::zeros(), nothing);
    world.off_by_less_than(0.01);
}

#[test]
fn begun_in_motion_it_aligns_too() {
    let mut world = World::new(tilted(), params());
    world.fly(2.0, Vector3::new(1.0, -2.0, 0.5), nothing);
    world.off_by_less_than(0.1);
}

#[test]
fn every_scalar_compared_leaves_a_record() {
    let mut world = World::new(tilted(), params());
    world.fly(1.0, Vector3::zeros(), nothing);
    let outcome = world.fly(1.0 + CORRECTED_S, Vector3::zeros(), nothing);
    let quantities: heapless::Vec<Quantity, 7> = outcome.innovations.iter().map(|record| record.quantity).collect();
    use Quantity::*;
    assert_eq!(
        quantities,
        [Bias, Bias, Bias, Velocity, Velocity, FieldEast, FieldMeridian]
    );
    for record in &outcome.innovations {
        assert!(
            record.accepted && record.variance > 0.0 && record.test_ratio < 1e-3,
            "{record:?}"
        );
    }
}

#[test]
fn slot_times_and_delays_are_taken_off() {
    // The field is sampled 8 ms after the gyros and is 15 ms old; at 3 rad/s its age is 2.6 deg.
    let rate_b = Vector3::new(0.0, 0.0, 3.0);
    let run = |mag_s: f32| {
        let mut world = World::new(
            UnitQuaternion::identity(),
            Params {
                delays: Delays {
                    mag_s,
                    ..params().delays
                },
                ..params()
            },
        );
        world.fly(60.0, rate_b, |_, step| {
            let mag = step.mag.as_mut().unwrap();
            mag.at_us += 8_000;
            mag.value_b = from_rotation_vector(rate_b * (0.008 - 0.015)).inverse_transform_vector(&mag.value_b);
        });
        world.off() / DEG
    };
    assert!(run(0.015) < 0.1, "{}", run(0.015));
    assert!(run(0.0) > 1.0, "{}", run(0.0));
}
