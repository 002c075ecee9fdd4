//! Which sensors are at fault, and the three vectors without them.
//!
//! In, each cycle: a reading, what the calibration makes of it, and the time since the one before. Out: specific force,
//! field and rate in b with their covariances, and the [`SensorHealth`] word. In this order:
//!
//! ```text
//! counts ---repeat--> frozen --.
//! gyros ----gyros--> rate_b ---+--> lever arms, and how far plates may differ
//! accelerometers --triads--> force_b --.
//! magnetometers ---triads--> field_b --+--vector_rate--> which gyro, when their parity is off
//! ```
//!
//! Every disagreement is held against noise and, in motion, against what is not noise: the uncertainty of scales and
//! directions, times how far the vector is from where the disagreements were learned; sampling instants unsure by
//! [`ACC_TIMING_S`] and its like, times the rate; places unsure by [`Set::place_sigma`], times angular acceleration and
//! squared rate. So thresholds grow with rate, angular acceleration and calibration uncertainty, and are the noise's at
//! rest.
//!
//! Refuses nothing: an interval that is not above zero and below [`LONGEST_S`] is taken as a gap, across which there is no
//! angular acceleration. Whatever comes in, what goes out is finite. About 4 KiB of state, no loop longer than its axes.

mod consensus;
mod gyros;
mod health;
mod repeat;
#[cfg(test)]
mod tests;
mod trace;
mod triads;
mod vector_rate;
mod watch;

use nalgebra::{Matrix3, Vector3};

use crate::{
    calibration::{Channel, Measured, Set},
    geometry::{PLATES, TRIAD_AXES},
    redundancy::{Known, Solution},
    root::{reciprocal_root, root},
    sample::{Kind, Reading},
};

use gyros::Gyros;
pub use health::{SensorHealth, Verdict};
use repeat::Repeats;
use triads::{Apart, Triads};
use vector_rate::{Direction, RateError, VectorRate};

/// \[s\] standard deviation of an accelerometer's conversion within its 20 ms at 50 Hz: it has its own clock.
const ACC_TIMING_S: f32 = 0.0058;
/// \[s\] of a magnetometer's within 13.3 ms, as logs have it whose magnetometers measured by their own clocks; one that was asked is
/// far within.
const MAG_TIMING_S: f32 = 0.0039;
/// \[s\] of a gyro's within 3.9 ms.
const GYRO_TIMING_S: f32 = 0.0012;
/// \[s\] an interval longer than this is a gap.
const LONGEST_S: f32 = 1.0;
/// [m/s2] within which the force is gravity's, for all this module needs: 0.9 to 1.1 g.
const GRAVITY: core::ops::RangeInclusive<f32> = 8.8..=10.8;
/// [rad/s] rate about a direction no gyro is left for, four turns a second: saturated ones say only that it is above
/// 320 deg/s, and spin-stabilised rockets turn at two to four.
const UNKNOWN_RATE: f32 = 25.0;

/// A cycle's three vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vectors {
    /// [m/s2] specific force at the centre of rotation.
    pub force_b: Solution,
    /// \[uT\] magnetic field.
    pub field_b_ut: Solution,
    /// [rad/s] inertial rate.
    pub rate_b: Solution,
    /// What is not used, and why not decided.
    pub health: SensorHealth,
}

/// What sensors of one kind gave in one cycle.
struct Cycle<'a, const N: usize> {
    /// [unit] along each axis.
    values: &'a [f32; N],
    /// Axes that have a value.
    present: u16,
    /// Axes that repeat themselves.
    frozen: u16,
    /// \[s\] since the cycle before; `None` after a gap.
    dt_s: Option<f32>,
    /// Its disagreements are looked at in the next cycle.
    watched_later: bool,
}

/// All 28 axes under watch.
#[derive(Clone, Debug)]
pub struct Monitor {
    acc: Triads,
    mag: Triads,
    gyro: Gyros,
    vector_rate: VectorRate,
    acc_repeats: [Repeats<3>; PLATES],
    mag_repeats: [Repeats<3>; PLATES],
    gyro_repeats: [Repeats<1>; PLATES],
    /// \[m\] of the longest lever arm.
    arm: f32,
    last: Option<Turning>,
    /// [rad/s] known bias of the rate.
    bias_b: Vector3<f32>,
}

/// How the unit turned in a cycle.
#[derive(Clone, Copy, Debug)]
struct Turning {
    rate_b: Vector3<f32>,
    /// [rad/s] length of it.
    speed: f32,
    acceleration_b: Vector3<f32>,
    /// [rad/s] what it may turn about a direction no gyro is left for.
    missing: f32,
}

impl Monitor {
    /// Of a unit with these parameters, about which nothing is known yet. A new set makes a new monitor.
    #[inline(never)]
    pub fn new(set: &Set) -> Self {
        let [acc, mag, gyro] = set.uncertainty;
        let counts = |axis: &crate::calibration::Axis| axis.noise / axis.scale;
        let triad = |axes: &[crate::calibration::Axis; TRIAD_AXES], plate: usize| {
            Repeats::new(core::array::from_fn(|k| counts(&axes[3 * plate + k])))
        };
        let noise = set.gyro.iter().fold(0.0, |most: f32, axis| most.max(axis.noise));
        Monitor {
            acc: Triads::new(&set.acc, acc, ACC_TIMING_S),
            mag: Triads::new(&set.mag, mag, MAG_TIMING_S),
            gyro: Gyros::new(&set.gyro, gyro, GYRO_TIMING_S),
            vector_rate: VectorRate::new(RateError { noise, bias: gyro.bias }),
            acc_repeats: core::array::from_fn(|plate| triad(&set.acc, plate)),
            mag_repeats: core::array::from_fn(|plate| triad(&set.mag, plate)),
            gyro_repeats: core::array::from_fn(|plate| Repeats::new([counts(&set.gyro[plate])])),
            arm: set
                .place_b
                .iter()
                .fold(0.0, |most: f32, place_b| most.max(place_b.norm())),
            last: None,
            bias_b: Vector3::zeros(),
        }
    }

    /// Takes what a filter knows of the bias of `rate_b` [rad/s] and the standard deviation of a component of it. Without it
    /// the vectors are held against the calibration's biases, and small faults of gyros stay "not isolable".
    pub fn know_bias(&mut self, bias_b: Vector3<f32>, sigma: f32) {
        self.bias_b = bias_b;
        self.vector_rate.error.bias = sigma;
    }

    /// What is held of an axis.
    pub fn verdict(&self, channel: Channel) -> Verdict {
        let n = usize::from(channel.0);
        match channel.kind() {
            Kind::Accelerometer => self.acc.verdict(n),
            Kind::Magnetometer => self.mag.verdict(n - TRIAD_AXES),
            _ => self.gyro.verdict(channel.plate()),
        }
    }

    /// Takes a cycle: `measured` is what `set` made of `reading`, `dt_s` \[s\] the time since the one before.
    pub fn step(&mut self, set: &Set, reading: &Reading, measured: &Measured, dt_s: f32) -> Vectors {
        self.take(set, reading, measured, dt_s, false)
    }

    /// The same; `watched_later` leaves a third of the work to the next cycle. What accelerometers and magnetometers disagree
    /// by is then looked at before that cycle's vectors, which are the first it may change: only the health word is late.
    pub fn take(
        &mut self,
        set: &Set,
        reading: &Reading,
        measured: &Measured,
        dt_s: f32,
        watched_later: bool,
    ) -> Vectors {
        let dt_s = (dt_s > 0.0 && dt_s < LONGEST_S).then_some(dt_s);
        let present = measured.present;
        let rate_b = self.gyro.step(&Cycle {
            values: &measured.gyro,
            present: present.of(Kind::Gyro),
            frozen: frozen(
                &mut self.gyro_repeats,
                present.of(Kind::Gyro),
                &reading.gyro.map(|counts| [counts]),
            ),
            dt_s,
            watched_later: false,
        });
        let (turning, unsure) = self.turning(&rate_b, set, dt_s);
        let values = without_lever_arms(set, &measured.acc, &turning);
        let rate = turning.speed + turning.missing;
        self.acc.step(
            &Cycle {
                values: &values,
                present: present.of(Kind::Accelerometer),
                frozen: frozen(&mut self.acc_repeats, present.of(Kind::Accelerometer), &reading.acc_p),
                dt_s,
                watched_later,
            },
            &Apart { rate, by_place: unsure },
        );
        self.mag.step(
            &Cycle {
                values: &measured.mag,
                present: present.of(Kind::Magnetometer),
                frozen: frozen(&mut self.mag_repeats, present.of(Kind::Magnetometer), &reading.mag_p),
                dt_s,
                watched_later,
            },
            &Apart { rate, by_place: 0.0 },
        );
        self.settle_gyros(measured, rate, dt_s, rate_b.used);
        self.last = Some(turning);
        let health = SensorHealth::default()
            .unused(Kind::Accelerometer, 0xFFF & !self.acc.solution.used)
            .unused(Kind::Magnetometer, 0xFFF & !self.mag.solution.used)
            .unused(Kind::Gyro, 0xF & !rate_b.used)
            .with_if(SensorHealth::ACCELEROMETERS, self.acc.undecided)
            .with_if(SensorHealth::MAGNETOMETERS, self.mag.undecided)
            .with_if(SensorHealth::GYROS, self.gyro.suspect)
            .with_if(
                SensorHealth::CALIBRATION,
                measured.temperature_held || measured.beyond_validity,
            );
        Vectors {
            force_b: self.acc.solution,
            field_b_ut: self.mag.solution,
            rate_b,
            health,
        }
    }

    /// How the unit turns, and by how many m/s2 that leaves the accelerometers' lever arms unsure.
    fn turning(&self, rate_b: &Solution, set: &Set, dt_s: Option<f32>) -> (Turning, f32) {
        let change = match (self.last, dt_s) {
            (Some(last), Some(dt_s)) => Some((last, dt_s)),
            _ => None,
        };
        let turning = Turning {
            rate_b: rate_b.vector_b,
            speed: length(&rate_b.vector_b),
            acceleration_b: change.map_or(Vector3::zeros(), |(last, dt_s)| (rate_b.vector_b - last.rate_b) / dt_s),
            missing: if rate_b.known == Known::All { 0.0 } else { UNKNOWN_RATE },
        };
        let missing = turning.missing.max(self.last.map_or(0.0, |last| last.missing));
        // The difference quotient is the acceleration of half an interval ago, and has the noise of two rates.
        let lag = change.map_or(0.0, |(last, _)| {
            length(&(turning.acceleration_b - last.acceleration_b)) / 2.0
        });
        let noise = change.map_or(0.0, |(_, dt_s)| root(2.0 * rate_b.covariance_b.trace() / 3.0) / dt_s);
        let rate = turning.speed + missing;
        let squared = rate * rate;
        let unsure = set.place_sigma * (length(&turning.acceleration_b) + squared)
            + self.arm * (lag + noise + missing * (rate + missing));
        (turning, unsure)
    }

    fn settle_gyros(&mut self, measured: &Measured, rate: f32, dt_s: Option<f32>, gyros: u16) {
        // The vectors are asked which gyro it is once the parity says that it may be one: what was before says nothing.
        if !self.gyro.is_doubted() {
            self.vector_rate.pause();
            return;
        }
        let (force_b, field_b_ut) = (&self.acc.solution, &self.mag.solution);
        let still_gravity = GRAVITY.contains(&length(&force_b.vector_b));
        let directions = [
            direction(force_b, ACC_TIMING_S * rate).filter(|_| still_gravity && !self.acc.undecided),
            direction(field_b_ut, MAG_TIMING_S * rate).filter(|_| !self.mag.undecided),
        ];
        let without = self.gyro.without_each(&measured.gyro, gyros);
        let without = without.map(|rates_b| rates_b.map(|rate_b| rate_b - self.bias_b));
        let contradicted = self.vector_rate.step(without, dt_s, directions);
        if let Some(plate) = contradicted {
            self.gyro.blame(plate, Verdict::Disagreeing);
        }
    }
}

/// A solution as a direction, with the angle \[rad\] it turns by within its sampling instant's uncertainty.
fn direction(solution: &Solution, turned: f32) -> Option<Direction> {
    let per_length = reciprocal_root(solution.vector_b.norm_squared());
    let variance = solution.covariance_b.trace() * (per_length * per_length / 3.0) + turned * turned;
    (solution.known == Known::All && per_length > 0.0 && variance < 0.01).then(|| Direction {
        along_b: solution.vector_b * per_length,
        variance,
    })
}

fn length(vector: &Vector3<f32>) -> f32 {
    root(vector.norm_squared())
}

/// [m/s2] forces along the axes as at the centre: less `w' x r + w x (w x r)` of each plate's place.
fn without_lever_arms(set: &Set, along: &[f32; TRIAD_AXES], turning: &Turning) -> [f32; TRIAD_AXES] {
    let Turning {
        rate_b, acceleration_b, ..
    } = turning;
    // w x (w x r) = (w w' - w^2) r.
    let by_place = acceleration_b.cross_matrix() + rate_b * rate_b.transpose()
        - Matrix3::from_diagonal_element(rate_b.norm_squared());
    let at_place = set.place_b.map(|place_b| by_place * place_b);
    core::array::from_fn(|k| along[k] - set.acc[k].axis_b.dot(&at_place[k / 3]))
}

/// Axes of the sensors that repeat themselves, three bits or one a sensor. At the end of its range a healthy one does.
fn frozen<const N: usize>(repeats: &mut [Repeats<N>; PLATES], present: u16, counts: &[[i16; N]; PLATES]) -> u16 {
    let (mut axes, mut found) = ((1 << N) - 1, 0);
    for (repeats, counts) in repeats.iter_mut().zip(counts) {
        let read = (present & axes == axes).then_some(counts);
        if repeats.frozen(read) {
            found |= axes;
        }
        axes <<= N;
    }
    found
}
