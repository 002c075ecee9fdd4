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
    /// Most that an update has turned the attitude away from what the gyros said [rad].
    jump: f32,
}

const STEP_US: u64 = 20_000;
const STEP_S: f32 = 0.02;
/// [s] after the end of a window the state has its correction: four steps, and half of one for rounding.
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
            let sampled = |value_b: Vector3<f32>| {
                Some(Sampled {
                    value_b,
                    variance: 0.0,
                    at_us: self.at_us,
                })
            };
            let mut step = Step {
                at_us: self.at_us,
                covered_s: STEP_S,
                angle_b: rate_b * STEP_S,
                angle_variance: 0.0,
                rate_b,
                saturated: false,
                acc: sampled(self.q_nb.inverse_transform_vector(&Vector3::new(0.0, 0.0, -GRAVITY))),
                mag: sampled(self.q_nb.inverse_transform_vector(&Self::field_n())),
                lift_off: false,
            };
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

    /// [rad] error of the attitude.
    fn off(&self) -> f32 {
        angle_between(&self.filter.attitude(), &self.q_nb)
    }

    fn off_by_less_than(&self, most_deg: f32) {
        assert!(self.filter.aligned);
        assert!(self.off() < most_deg * DEG, "{} deg", self.off() / DEG);
    }

    /// [deg] standard deviation about the axis it knows least.
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

mod correction;
mod force;
mod hostile;
mod iron;
mod recovery;

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
fn a_bias_is_learnt_at_rest_and_the_matrix_in_motion() {
    let bias_b = Vector3::new(0.01, -0.02, 0.005);
    let mut world = World::new(tilted(), params());
    world.fly(30.0, Vector3::zeros(), |_, step| step.angle_b += bias_b * STEP_S);
    assert!((world.filter.bias_b - bias_b).norm() < 1e-4);
    // The gyros read one per cent high about z; half turns to either side show it.
    for turn in 0..40 {
        let rate_b = Vector3::new(0.3, 0.2, if turn % 4 < 2 { 1.5 } else { -1.5 });
        world.fly(4.0, rate_b, |_, step| {
            step.angle_b.z *= 1.01;
            step.angle_b += bias_b * STEP_S;
        });
    }
    world.off_by_less_than(1.0);
    let scale = world.filter.gyro_matrix[(2, 2)];
    assert!((scale - 0.01 / 1.01).abs() < 0.002, "{scale}");
}

#[test]
fn without_the_matrix_the_same_motion_costs_more() {
    let run = |params: Params| {
        let mut world = World::new(tilted(), params);
        world.fly(5.0, Vector3::zeros(), nothing);
        // To and fro, with pauses of another axis between: no bias does the same.
        for turn in 0..15 {
            let rate_b = Vector3::new(0.3, 0.2, [1.5, 0.0, -1.0][turn % 3]);
            world.fly(4.0, rate_b, |_, step| step.angle_b *= 1.01);
        }
        world.off()
    };
    let with = run(params());
    let without = run(Params {
        gyro_matrix_sd: 0.0,
        gyro_matrix_walk: 0.0,
        ..params()
    });
    assert!(with < 0.5 * without, "{with} {without}");
}

#[test]
fn shaking_is_not_taken_for_tilt() {
    // 5 m/s2 to and fro along north, at 0.8 Hz: single samples are tilted by 27 deg.
    let shaken = |t_s: f32, step: &mut Step, q_nb: &UnitQuaternion<f32>| {
        let acc_n = Vector3::new(5.0 * ComplexField::sin(5.0 * t_s), 0.0, 0.0);
        if let Some(acc) = &mut step.acc {
            acc.value_b += q_nb.inverse_transform_vector(&acc_n);
        }
    };
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::zeros(), nothing);
    let q_nb = world.q_nb;
    world.fly(60.0, Vector3::zeros(), |t_s, step| shaken(t_s, step, &q_nb));
    world.off_by_less_than(1.0);
}

#[test]
fn boost_and_free_fall_after_lift_off_do_not_move_it() {
    let mut world = World::new(tilted(), params());
    world.fly(10.0, Vector3::zeros(), nothing);
    world.jump = 0.0;
    // 12 g along the forward axis for 3.3 s, begun in the middle of a window, then free fall.
    world.fly(3.3, Vector3::new(0.3, 0.0, 0.0), |t_s, step| {
        step.lift_off = true;
        if t_s > 0.5 {
            step.acc.as_mut().unwrap().value_b.x += 12.0 * GRAVITY;
        }
    });
    world.fly(60.0, Vector3::new(0.3, 0.1, 0.0), |_, step| {
        step.lift_off = true;
        step.acc.as_mut().unwrap().value_b = Vector3::repeat(0.001);
    });
    assert!(world.jump < 1.0 * DEG, "{}", world.jump / DEG);
    world.off_by_less_than(1.0);
}

#[test]
fn after_lift_off_a_steady_push_is_not_taken_for_the_vertical() {
    let mut world = World::new(tilted(), params());
    world.fly(10.0, Vector3::zeros(), nothing);
    let q_nb = world.q_nb;
    // 1.15 g, tilted by 29 deg: near enough to one g for a shaken unit's mean, not for a sample in flight.
    world.fly(20.0, Vector3::zeros(), |_, step| {
        step.lift_off = true;
        step.acc.as_mut().unwrap().value_b += q_nb.inverse_transform_vector(&Vector3::new(5.5, 0.0, 0.0));
    });
    world.off_by_less_than(1.0);
}

#[test]
fn in_micro_gravity_the_field_bounds_what_it_can() {
    let mut world = World::new(tilted(), params());
    world.fly(10.0, Vector3::zeros(), nothing);
    let drift = Vector3::new(0.0, 0.003, 0.0);
    world.fly(120.0, Vector3::new(0.0, 0.2, 0.4), |_, step| {
        step.lift_off = true;
        step.acc = None;
        step.angle_b += drift * STEP_S;
    });
    // 0.003 rad/s for two minutes is 20 deg.
    world.off_by_less_than(5.0);
}

#[test]
fn a_magnetic_step_turns_the_heading_by_less_than_two_degrees() {
    let mut world = World::new(tilted(), params());
    world.fly(20.0, Vector3::zeros(), nothing);
    let q_nb = world.q_nb;
    for direction_n in [Vector3::y(), Vector3::x(), -Vector3::z()] {
        world.fly(30.0, Vector3::zeros(), |_, step| {
            step.mag.as_mut().unwrap().value_b += q_nb.inverse_transform_vector(&(direction_n * 20.0));
        });
        world.off_by_less_than(2.0);
        world.fly(10.0, Vector3::zeros(), nothing);
    }
}

#[test]
fn a_saturated_spin_is_recovered_from_within_a_minute() {
    let mut world = World::new(tilted(), params());
    world.fly(10.0, Vector3::zeros(), nothing);
    // 720 deg/s about forward, gyros that stop at 320.
    world.fly(20.0, Vector3::new(12.6, 0.0, 0.0), |_, step| {
        step.angle_b.x = 5.6 * STEP_S;
        step.rate_b.x = 5.6;
        step.saturated = true;
    });
    assert!(world.worst_sd_deg() > 30.0, "it must know that it does not know");
    world.fly(60.0, Vector3::new(0.1, 0.0, 0.0), nothing);
    world.off_by_less_than(5.0);
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

/// [rad/s] what the gyros of the next tests say of no rate at all.
const GYRO_BIAS_B: Vector3<f32> = Vector3::new(0.1 * DEG, -0.05 * DEG, 0.08 * DEG);

fn biased(step: &mut Step) {
    step.rate_b += GYRO_BIAS_B;
    step.angle_b += GYRO_BIAS_B * STEP_S;
}

#[test]
fn a_rest_that_begins_with_the_end_of_a_motion_teaches_no_wrong_bias() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::new(0.3, -0.2, 0.1), |_, step| biased(step));
    // Easing to a stop, a window long and within the bounds of rest.
    for index in 0..50 {
        let rate_b = Vector3::new(0.0, 0.0, 0.9 * DEG * (1.0 - index as f32 * STEP_S));
        world.fly(STEP_S, rate_b, |_, step| biased(step));
    }
    world.fly(6.0, Vector3::zeros(), |_, step| biased(step));
    let off_b = world.filter.bias_b - GYRO_BIAS_B;
    assert!(off_b.norm() < 0.02 * DEG, "{:?} deg/s", off_b / DEG);
}

#[test]
fn a_bias_that_every_rest_contradicts_is_given_up() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::zeros(), |_, step| biased(step));
    // As an upset in memory leaves it.
    world.filter.bias_b += Vector3::new(1.0 * DEG, 0.0, 0.0);
    world.fly(world.filter.params.recovery_s + 2.0, Vector3::zeros(), |_, step| {
        biased(step)
    });
    let off_b = world.filter.bias_b - GYRO_BIAS_B;
    assert!(off_b.norm() < 0.02 * DEG, "{:?} deg/s", off_b / DEG);
}

#[test]
fn a_few_noisy_samples_are_no_exact_bias() {
    let sd_after = |noise: f32| {
        let mut world = World::new(tilted(), params());
        world.fly(4.0, Vector3::zeros(), |_, step| {
            step.angle_variance = square(noise * STEP_S);
        });
        ComplexField::sqrt(world.filter.bias_covariance_b().trace() / 3.0)
    };
    // Fifty samples a window, three windows after the first.
    let noise = 1.0 * DEG;
    let expected = noise / ComplexField::sqrt(150.0_f32);
    assert!(
        (sd_after(noise) / expected - 1.0).abs() < 0.1,
        "{} {expected}",
        sd_after(noise)
    );
    assert!(sd_after(0.0) < 0.01 * DEG);
}
