//! A flight as real vehicles make it: vibration, buffeting, thrust oscillation, and what these make of a gyro.
//!
//! In: a smooth flight. Out: the same with, in b,
//!
//! - force and rate that shake, as sums of tones between 5 and 120 Hz, each axis with its own; under thrust at the level asked for, in
//!   transonic flight twice that, gliding through air three tenths, on the re-entry half, in free fall nothing;
//! - a tone of the motor along x_b, of half the level;
//! - a false rate by what the gyros feel of force, [`Levels::rate_per_g`] for each g more than on the pad: the data sheet's 0.2 deg/s
//!   per g (ADIS16265, Table 1), of which a bench calibration leaves a tenth;
//! - a false rate in transonic flight, as vibration that is rectified or folded down leaves it.
//!
//! Levels after an ADIS16405 in an amateur rocket: its gyros had 0.34 deg/s of noise on the pad, 5 to 8 under thrust, 17 to 20 in
//! transonic flight, and a false rate of 16 to 20 deg/s for two seconds; acceleration from sample to sample 0.1 to 0.9 g.
//!
//! The shaking turns nothing that is told of the attitude: a tone of 5 deg/s at 10 Hz is a tenth of a degree.

use std::f64::consts::{SQRT_2, TAU};

use nalgebra::{Matrix3, Vector3};

use crate::{
    part::signal::Noise,
    truth::{Truth, TruthSource},
};

/// How rough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// [m/s2] root mean square of a component of force under thrust.
    pub force: f64,
    /// [rad/s] the same of rate.
    pub rate: f64,
    /// [rad/s] false rate for each g, standard deviation of each element of the matrix.
    pub rate_per_g: f64,
    /// [rad/s] false rate in transonic flight.
    pub rectified: f64,
}

const DEG: f64 = std::f64::consts::PI / 180.0;

impl Levels {
    /// A large sounding rocket.
    pub const ROUGH: Levels = Levels {
        force: 1.0,
        rate: 2.0 * DEG,
        rate_per_g: 0.02 * DEG,
        rectified: 2.0 * DEG,
    };
    /// A small one.
    pub const ROUGHER: Levels = Levels {
        force: 5.0,
        rate: 10.0 * DEG,
        rate_per_g: 0.02 * DEG,
        rectified: 10.0 * DEG,
    };
}

/// A tone of a component.
#[derive(Clone, Copy, Debug)]
struct Tone {
    /// [rad/s]
    omega: f64,
    /// \[rad\]
    phase: f64,
}

/// Tones of a component: their sum is near enough to normal.
const TONES: usize = 16;
/// \[Hz\] between these, evenly in the logarithm.
const BAND_HZ: (f64, f64) = (5.0, 120.0);
/// \[Hz\] of the motor.
const MOTOR_HZ: f64 = 55.0;
/// \[s\] after lift-off: when it is thrust, transonic, and back in air; as [`super::SoundingRocket`].
const THRUST_S: [(f64, f64); 2] = [(0.0, 12.0), (15.0, 38.2)];
const TRANSONIC_S: (f64, f64) = (6.0, 9.0);
const AIR_S: f64 = 53.0;
const ENTRY_S: (f64, f64) = (450.0, 520.0);

/// A flight, shaken.
pub struct Rough<T> {
    source: T,
    lift_off_s: f64,
    levels: Levels,
    force: [[Tone; TONES]; 3],
    rate: [[Tone; TONES]; 3],
    rate_by_force: Matrix3<f64>,
    rectified_b: Vector3<f64>,
    pad_force_b: Vector3<f64>,
}

impl<T: TruthSource> Rough<T> {
    /// A flight that lifts off `lift_off_s` after power-on, as rough as this seed has it.
    pub fn new(source: T, lift_off_s: f64, levels: Levels, seed: u64) -> Self {
        let noise = Noise::new(seed).stream(0x524F_5547);
        let tones = |first: u64| {
            std::array::from_fn(|axis| {
                let stream = noise.stream(first + axis as u64);
                std::array::from_fn(|k| Tone {
                    omega: TAU * BAND_HZ.0 * (BAND_HZ.1 / BAND_HZ.0).powf(stream.uniform(2 * k as u64)),
                    phase: TAU * stream.uniform(2 * k as u64 + 1),
                })
            })
        };
        let (by_g, direction) = (noise.stream(6), noise.stream(7));
        Rough {
            lift_off_s,
            levels,
            force: tones(0),
            rate: tones(3),
            rate_by_force: Matrix3::from_fn(|row, column| {
                by_g.normal(3 * row as u64 + column as u64) * levels.rate_per_g / 9.806_65
            }),
            rectified_b: Vector3::from_fn(|axis, _| direction.normal(axis as u64)).normalize() * levels.rectified,
            pad_force_b: source.at(0.0).force_b,
            source,
        }
    }

    /// Of the level under thrust.
    fn part(&self, flown_s: f64) -> f64 {
        let within = |(from, to): (f64, f64)| (from..to).contains(&flown_s);
        if within(TRANSONIC_S) {
            2.0
        } else if THRUST_S.into_iter().any(within) {
            1.0
        } else if (0.0..AIR_S).contains(&flown_s) {
            0.3
        } else if within(ENTRY_S) {
            0.5
        } else {
            0.0
        }
    }
}

/// Each component's sum of tones, of a mean square of one, and its derivative.
fn sums(tones: &[[Tone; TONES]; 3], t_s: f64) -> (Vector3<f64>, Vector3<f64>) {
    let amplitude = SQRT_2 / (TONES as f64).sqrt();
    let sum =
        |of: &dyn Fn(&Tone) -> f64| Vector3::from_fn(|axis, _| amplitude * tones[axis].iter().map(of).sum::<f64>());
    (
        sum(&|tone| (tone.omega * t_s + tone.phase).sin()),
        sum(&|tone| tone.omega * (tone.omega * t_s + tone.phase).cos()),
    )
}

impl<T: TruthSource> TruthSource for Rough<T> {
    fn at(&self, t_s: f64) -> Truth {
        let mut truth = self.source.at(t_s);
        let flown_s = t_s - self.lift_off_s;
        truth.rate_b += self.rate_by_force * (truth.force_b - self.pad_force_b);
        let part = self.part(flown_s);
        if part > 0.0 {
            let (shaken, _) = sums(&self.force, t_s);
            let (turned, turned_dot) = sums(&self.rate, t_s);
            truth.force_b += shaken * (part * self.levels.force);
            truth.force_b.x += 0.5 * part * self.levels.force * (TAU * MOTOR_HZ * t_s).sin();
            truth.rate_b += turned * (part * self.levels.rate);
            truth.rate_dot_b += turned_dot * (part * self.levels.rate);
        }
        if (TRANSONIC_S.0..TRANSONIC_S.1).contains(&flown_s) {
            truth.rate_b += self.rectified_b;
        }
        truth
    }

    fn duration_s(&self) -> Option<f64> {
        self.source.duration_s()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        environment::{Environment, World},
        motion::SoundingRocket,
    };

    fn flights() -> (World<SoundingRocket>, Rough<World<SoundingRocket>>) {
        let environment = Environment::alcantara();
        let smooth = World {
            motion: SoundingRocket::new(30.0, environment.gravity),
            environment,
        };
        (smooth.clone(), Rough::new(smooth, 30.0, Levels::ROUGH, 1))
    }

    /// Root mean square of a component of what is added.
    fn added(from_s: f64, of: impl Fn(&Truth) -> Vector3<f64>) -> f64 {
        let (smooth, rough) = flights();
        let times = (0..4000).map(|k| from_s + 0.001 * f64::from(k));
        let squares = times.map(|t_s| (of(&rough.at(t_s)) - of(&smooth.at(t_s))).norm_squared() / 3.0);
        (squares.sum::<f64>() / 4000.0).sqrt()
    }

    #[test]
    fn it_shakes_under_thrust_as_asked_for_and_not_in_free_fall() {
        let force = |from_s| added(from_s, |truth| truth.force_b);
        let rate = |from_s| added(from_s, |truth| truth.rate_b);
        assert!((0.8..1.25).contains(&force(55.0)), "{}", force(55.0));
        assert!(
            (0.8..1.25).contains(&(rate(55.0) / Levels::ROUGH.rate)),
            "{}",
            rate(55.0)
        );
        assert_eq!(force(200.0), 0.0);
        assert_eq!(force(10.0), 0.0);
    }

    #[test]
    fn what_is_left_of_a_gyros_g_shows_in_free_fall_by_the_pads_g() {
        let false_rate = added(200.0, |truth| truth.rate_b);
        assert!(
            (0.2..5.0).contains(&(false_rate / Levels::ROUGH.rate_per_g)),
            "{false_rate}"
        );
        assert_eq!(added(10.0, |truth| truth.rate_b), 0.0);
    }
}
