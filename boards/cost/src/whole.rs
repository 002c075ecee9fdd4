//! The whole estimation of a cycle, and two parts of it, at the unit's 5 Hz.
//!
//! In: nothing; a tumble, a rest and a spin of a unit with nominal parameters are computed here, in counts that flicker as those
//! of real parts do. Out: the static `CYCLES`: for each motion, ticks of calibration, of fault detection with the three
//! vectors, of the two readings of force before a cycle, and of the whole step, for every cycle.

use core::sync::atomic::{AtomicU32, Ordering};

use emems::{
    calibration::{Axis, Ranges, Set, Temperatures},
    estimate::Estimator,
    faults::Monitor,
    increments::{Fast, Increments, Integrator},
    sample::{Errors, Kind, Reading, Sample},
    unit::Settings,
};
use nalgebra::{ComplexField, UnitQuaternion, Vector3};

use super::counted::{motion, ticks};

/// Motions: tumble, rest, spin.
const MOTIONS: usize = 3;
/// Calibration, faults, readings of force, whole.
const PARTS: usize = 4;
/// Cycles of each: thirty seconds, after twenty in which the field is learnt.
const CYCLES_COUNTED: usize = 150;
const SETTLING: usize = 100;
/// Fast samples of the gyros in a cycle, and microseconds between them.
const FAST: usize = 20;
const FAST_US: u64 = 10_000;
/// After which of them the accelerometers are read between two cycles.
const READ_AT: [usize; 2] = [5, 12];

#[unsafe(no_mangle)]
static CYCLES: [AtomicU32; MOTIONS * PARTS * CYCLES_COUNTED] =
    [const { AtomicU32::new(0) }; MOTIONS * PARTS * CYCLES_COUNTED];

/// How a unit moves.
#[derive(Clone, Copy, PartialEq)]
enum Moves {
    Tumbles,
    Rests,
    /// After [`SETTLING`] cycles it lifts off, and spins up by half a turn a second in a second to three.
    Spins,
}

/// [rad/s] three turns a second, and [rad/s2] how it gets there.
const SPIN: f32 = 18.85;
const SPIN_UP: f32 = 3.14;

/// A unit that moves, or does not.
struct Unit {
    set: Set,
    moves: Moves,
    fast: usize,
    q_nb: UnitQuaternion<f32>,
    random: u32,
    integrator: Integrator,
}

impl Unit {
    fn new(moves: Moves) -> Self {
        let set = Set::nominal(Ranges::of(&Settings::NOMINAL));
        Unit {
            moves,
            fast: 0,
            q_nb: UnitQuaternion::identity(),
            random: 1,
            integrator: Integrator::new(set.ranges.nominal_scale(Kind::Gyro)),
            set,
        }
    }

    /// -2 to 2 counts (multiplier of Numerical Recipes).
    fn flicker(&mut self) -> i16 {
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.random >> 16) as i16 % 3
    }

    fn counts(&mut self, axis: &Axis, vector_b: &Vector3<f32>) -> i16 {
        ComplexField::round(axis.axis_b.dot(vector_b) / axis.scale) as i16 + self.flicker()
    }

    fn cycle(&mut self) -> (Sample, Increments) {
        let (acc, mag, gyro) = (self.set.acc, self.set.mag, self.set.gyro);
        let place_b = self.set.place_b;
        let (mut force_b, mut field_b) = (Vector3::zeros(), Vector3::zeros());
        let (mut rate_b, mut before_b) = (Vector3::zeros(), Vector3::zeros());
        for fast in 0..FAST {
            before_b = rate_b;
            match self.moves {
                // A step of the motion is 20 ms; taken for 10, it tumbles twice as fast.
                Moves::Tumbles => rate_b = motion(self.fast, &mut self.q_nb).rate_b * 2.0,
                Moves::Rests => {}
                Moves::Spins => {
                    let spun_s = self.fast.saturating_sub(SETTLING * FAST) as f32 * (FAST_US as f32 * 1e-6);
                    rate_b.x = (SPIN_UP * spun_s).min(SPIN);
                    self.q_nb *= UnitQuaternion::from_scaled_axis(rate_b * (FAST_US as f32 * 1e-6));
                    self.q_nb.renormalize();
                }
            }
            force_b = self.q_nb.inverse_transform_vector(&super::counted::FORCE_N);
            field_b = self.q_nb.inverse_transform_vector(&super::counted::FIELD_N_UT);
            self.fast += 1;
            let counts = gyro.map(|axis| self.counts(&axis, &rate_b));
            let at_us = FAST_US * self.fast as u64;
            self.integrator.add(Fast { at_us, counts });
            if READ_AT.contains(&fast) {
                let acc_p =
                    core::array::from_fn(|plate| core::array::from_fn(|k| self.counts(&acc[3 * plate + k], &force_b)));
                self.integrator.force(at_us + 7_000, acc_p);
            }
        }
        let start_us = FAST_US * self.fast as u64;
        let acceleration_b = (rate_b - before_b) / (FAST_US as f32 * 1e-6);
        let at_place =
            |place_b: Vector3<f32>| force_b + acceleration_b.cross(&place_b) + rate_b.cross(&rate_b.cross(&place_b));
        let acc_p = core::array::from_fn(|plate| {
            let at_place = at_place(place_b[plate]);
            core::array::from_fn(|k| self.counts(&acc[3 * plate + k], &at_place))
        });
        let mag_p = core::array::from_fn(|plate| core::array::from_fn(|k| self.counts(&mag[3 * plate + k], &field_b)));
        let reading = Reading {
            errors: Errors(0),
            acc_p,
            mag_p,
            gyro: gyro.map(|axis| self.counts(&axis, &rate_b)),
            gyro_temperature: [0; 4],
            temperature: [400; 4],
            lift_off: self.moves == Moves::Spins && self.fast > SETTLING * FAST,
            ..Reading::unread((self.fast / FAST) as u16)
        };
        let sample = Sample {
            reading,
            start_us,
            slots_us: core::array::from_fn(|slot| 250 * slot as u32),
        };
        (sample, self.integrator.take())
    }
}

/// Counts every cycle of all motions.
#[inline(never)]
pub fn count() {
    for (n, moves) in [Moves::Tumbles, Moves::Rests, Moves::Spins].into_iter().enumerate() {
        of(moves, &CYCLES[n * PARTS * CYCLES_COUNTED..][..PARTS * CYCLES_COUNTED]);
    }
}

#[inline(never)]
fn of(moves: Moves, costs: &[AtomicU32]) {
    let mut unit = Unit::new(moves);
    let mut temperatures = Temperatures::default();
    let mut monitor = Monitor::new(&unit.set);
    let mut estimator = Estimator::of(&Settings::NOMINAL);
    for cycle in 0..SETTLING + CYCLES_COUNTED {
        let (sample, increments) = unit.cycle();
        let (measured, calibration) = ticks(|| {
            temperatures.note(&sample.reading);
            unit.set.apply(&sample.reading, &temperatures)
        });
        let (_, faults) = ticks(|| monitor.step(&unit.set, &sample.reading, &measured, 0.2));
        let readings = increments.forces;
        let ((), forces) = ticks(|| {
            readings
                .iter()
                .for_each(|force| estimator.take_force(sample.reading.counter, force))
        });
        let (_, whole) = ticks(|| estimator.step(&sample, &increments));
        let Some(counted) = cycle.checked_sub(SETTLING) else {
            continue;
        };
        for (part, ticks) in [calibration, faults, forces, whole].into_iter().enumerate() {
            costs[part * CYCLES_COUNTED + counted].store(ticks, Ordering::Relaxed);
        }
    }
}
