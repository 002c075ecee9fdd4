extern crate std;

use proptest::prelude::*;

use super::*;
use crate::{
    calibration::Axis,
    increments::{Force, GyroCycle, SLICES, Slice, forces::READINGS},
    sample::{NO_SLOT, NOT_READ, Reading, SENSOR_COUNT},
};

/// \[us\] from cycle to cycle.
const PERIOD_US: u64 = 200_000;

/// Level and at rest in the laboratory, facing magnetic north: counts of the nominal unit, which flicker by one as what
/// repeats itself is held to be frozen.
fn resting(counter: u16) -> (Sample, Increments) {
    let (force_b, field_b) = (Vector3::new(0.0, 0.0, -9.7864), Vector3::new(18.35, 0.0, -14.2));
    let set = Set::nominal(Ranges::of(&Settings::NOMINAL));
    let counts =
        |axis: &Axis, vector_b: &Vector3<f32>| ComplexField::round(axis.axis_b.dot(vector_b) / axis.scale) as i16;
    let triads = |axes: &[Axis; 12], vector_b: &Vector3<f32>| -> [[i16; 3]; 4] {
        let flicker = |k: usize| (usize::from(counter) * (k + 1)) as i16 % 3 - 1;
        core::array::from_fn(|plate| {
            core::array::from_fn(|k| counts(&axes[3 * plate + k], vector_b) + flicker(3 * plate + k))
        })
    };
    let start_us = PERIOD_US * (u64::from(counter) + 1);
    let sample = Sample {
        reading: Reading {
            errors: crate::sample::Errors(0),
            acc_p: triads(&set.acc, &force_b),
            mag_p: triads(&set.mag, &field_b),
            gyro: core::array::from_fn(|k| (usize::from(counter) * (k + 2)) as i16 % 3 - 1),
            gyro_temperature: [0; 4],
            temperature: [400; 4],
            ..Reading::unread(counter)
        },
        start_us,
        slots_us: core::array::from_fn(|slot| 250 * slot as u32),
    };
    let still = GyroCycle {
        integral_counts_s: 0.0,
        least: 0,
        most: 0,
        count: 20,
    };
    let increments = Increments {
        angle_b: [0.0; 3],
        covered_us: PERIOD_US as u32,
        end_us: start_us - 2_500,
        gyro: [still; 4],
        forces: [Force::NONE; READINGS],
        slices: [Slice::NONE; SLICES],
    };
    (sample, increments)
}

/// \[rad\] a magnetometer's count and a half of 0.09 uT on each of twelve axes, of 18 uT.
const FLICKER: f32 = 0.01;

/// \[rad\] heading of a magnetic compass needle east of north, from an estimate level to half a degree.
fn heading(q: [f32; 4]) -> f32 {
    2.0 * nalgebra::RealField::atan2(q[3], q[0])
}

#[test]
fn at_rest_triad_has_the_attitude_at_once_and_the_filter_after_its_first_window() {
    let mut estimator = Estimator::of(&Settings::NOMINAL);
    let declination = Site::LABORATORY.declination_deg.to_radians();
    for counter in 0..10 {
        let (sample, increments) = resting(counter);
        let estimate = estimator.step(&sample, &increments);
        // A count and a half of either sensor on each axis.
        assert!((heading(estimate.triad_nb.expect("two vectors")) - declination).abs() < FLICKER);
        assert_eq!(estimate.q_nb.is_some(), counter >= 4, "{counter}");
        assert_eq!(estimate.sensors, SensorHealth(0));
        if let Some(q_nb) = estimate.q_nb {
            assert!((heading(q_nb) - declination).abs() < FLICKER);
        }
    }
}

#[test]
fn a_plate_that_was_not_read_is_in_the_health_and_has_no_part_in_the_slot_times() {
    let estimator = Estimator::of(&Settings::NOMINAL);
    let (mut sample, increments) = resting(0);
    sample.reading.acc_p[0] = [NOT_READ; 3];
    sample.slots_us[0] = NO_SLOT;
    let estimate = estimator.clone().step(&sample, &increments);
    assert_eq!(estimate.sensors, SensorHealth(0b111));
    let measured = estimator.set.apply(&sample.reading, &estimator.temperatures);
    let force_b = estimator
        .monitor
        .clone()
        .step(&estimator.set, &sample.reading, &measured, 0.2)
        .force_b;
    let sampled = estimator
        .sampled(&sample, Kind::Accelerometer, &force_b)
        .expect("three plates");
    // Slots 1, 2 and 3 at 250, 500 and 750 us.
    assert_eq!(sampled.at_us, sample.start_us + 500);
    // 0.045 m/s2 of one axis over the root of three plates.
    assert!((ComplexField::sqrt(sampled.variance) - 0.045 / 1.732).abs() < 1e-4);
}

#[test]
fn in_free_fall_triad_has_no_vertical() {
    let mut estimator = Estimator::of(&Settings::NOMINAL);
    let (mut sample, increments) = resting(0);
    sample.reading.acc_p = [[0; 3]; 4];
    assert_eq!(estimator.step(&sample, &increments).triad_nb, None);
}

/// Roll and pitch may be off by this of what readings in between say where those are not to count \[rad\].
const NOT_COUNTED: f32 = 1e-6;

#[test]
fn readings_between_cycles_count_unless_the_gyros_have_a_gap_or_stand_at_their_end() {
    let set = Set::nominal(Ranges::of(&Settings::NOMINAL));
    let pushed_b = Vector3::new(1.5, 0.0, -9.7864);
    let pushed = |axis: &Axis| ComplexField::round(axis.axis_b.dot(&pushed_b) / axis.scale) as i16;
    let reading = Force {
        acc_p: core::array::from_fn(|plate| core::array::from_fn(|k| pushed(&set.acc[3 * plate + k]))),
        covered_us: 60_000,
        ..Force::NONE
    };
    let tilt = |spoil: &dyn Fn(&mut Increments), readings: [Force; READINGS]| {
        let mut estimator = Estimator::of(&Settings::NOMINAL);
        let cycles = (0..60).map(|counter| {
            let (sample, mut increments) = resting(counter);
            increments.forces = readings;
            spoil(&mut increments);
            estimator.step(&sample, &increments).q_nb
        });
        let [w, x, y, z] = cycles.last().flatten().expect("an attitude");
        2.0 * (w * y - z * x)
    };
    let gap = |increments: &mut Increments| increments.covered_us = 150_000;
    let at_end = |increments: &mut Increments| increments.gyro.iter_mut().for_each(|gyro| gyro.most = 4368);
    let whole = |_: &mut Increments| {};
    let differs = |spoil: &dyn Fn(&mut Increments)| {
        (tilt(spoil, [reading; READINGS]) - tilt(spoil, [Force::NONE; READINGS])).abs()
    };
    assert!(differs(&whole) > 0.03, "{}", differs(&whole));
    assert!(differs(&gap) < NOT_COUNTED, "{}", differs(&gap));
    assert!(differs(&at_end) < NOT_COUNTED, "{}", differs(&at_end));
}

fn is_finite(estimate: &Estimate) -> bool {
    let vectors = [
        estimate.force_b,
        estimate.field_b_ut,
        estimate.rate_b,
        estimate.bias_b,
        estimate.bias_sd,
    ];
    let attitudes = [estimate.triad_nb.unwrap_or_default(), estimate.q_nb.unwrap_or_default()];
    let mut all = vectors
        .as_flattened()
        .iter()
        .chain(attitudes.as_flattened())
        .chain(&estimate.covariance_n);
    all.all(|number| number.is_finite())
}

prop_compose! {
    fn hostile()(
        acc_p: [[i16; 3]; 4], mag_p: [[i16; 3]; 4], gyro: [i16; 4], gyro_temperature: [i16; 4], temperature: [i16; 4],
        lift_off: bool, start_us: u64, slots_us: [u32; SENSOR_COUNT], angles: [u32; 3], integrals: [u32; 4],
        ends: [(i16, i16, u8); 4], covered_us: u32, end_us: u64, sane: bool, counter in 10..40_u16,
        between: [([[i16; 3]; 4], [u32; 3], u32, u32); READINGS], sliced: [(u32, u16, [i16; 4]); SLICES],
    ) -> (Sample, Increments) {
        let (resting, still) = resting(counter);
        let reading = Reading { acc_p, mag_p, gyro, gyro_temperature, temperature, lift_off, ..resting.reading };
        let gyro = core::array::from_fn(|k| GyroCycle {
            integral_counts_s: f32::from_bits(integrals[k]), least: ends[k].0, most: ends[k].1, count: ends[k].2,
        });
        let forces = between.map(|(acc_p, angles, covered_us, after_us)| Force {
            acc_p, angle_b: angles.map(f32::from_bits), covered_us, after_us,
        });
        let slices = sliced.map(|(before_us, lasts_us, quarters)| Slice { before_us, lasts_us, quarters });
        let increments = Increments { angle_b: angles.map(f32::from_bits), covered_us, end_us, gyro, forces, slices };
        // Half of them with sound times, so that they get as far as the filter.
        match sane {
            true => (Sample { reading, ..resting }, Increments { gyro, forces, slices, ..still }),
            false => (Sample { reading, start_us, slots_us }, increments),
        }
    }
}

proptest! {
    #[test]
    fn whatever_comes_in_the_estimate_stays_finite(cycles in proptest::collection::vec(hostile(), 1..20)) {
        let mut estimator = Estimator::of(&Settings::NOMINAL);
        for counter in 0..6 {
            let (sample, increments) = resting(counter);
            estimator.step(&sample, &increments);
        }
        for (sample, increments) in cycles {
            let estimate = estimator.step(&sample, &increments);
            prop_assert!(is_finite(&estimate), "{:?}", estimate);
        }
    }
}

/// Flips a bit of a number.
fn flip(number: &mut f32, bit: u32) {
    *number = f32::from_bits(number.to_bits() ^ 1 << bit);
}

/// U9: any bit of what is estimated, or of what the estimation goes by, has flipped between two steps. The next one goes on from the copy
/// as if nothing had been; left alone, some would have turned the attitude by degrees. That it is found is the board's part.
#[test]
fn after_a_flipped_bit_of_the_filter_the_attitude_goes_on_from_its_copy() {
    let step = |estimator: &mut Estimator, counter: u16| {
        let (sample, increments) = resting(counter);
        let q_nb = estimator.step(&sample, &increments).q_nb.expect("an attitude");
        attitude::from_parts(q_nb).expect("a quaternion")
    };
    let degrees = |one: UnitQuaternion<f32>, other: UnitQuaternion<f32>| one.angle_to(&other).to_degrees();
    let settings = Settings::NOMINAL;
    let mut sound = Estimator::of(&settings);
    for counter in 0..6 {
        let (sample, increments) = resting(counter);
        sound.step(&sample, &increments);
    }
    (6..53).for_each(|counter| {
        step(&mut sound, counter);
    });
    let (mut kept, set) = ([0; KEPT_BYTES], sound.set);
    assert!(sound.keep(&mut kept));
    type Strike = dyn Fn(&mut Estimator, u32);
    let places: [&Strike; 12] = [
        &|estimator, bit| {
            let mut parts = *estimator.filter.q_nb.quaternion();
            flip(&mut parts.coords[bit as usize % 4], bit);
            estimator.filter.q_nb = UnitQuaternion::new_unchecked(parts);
        },
        &|estimator, bit| flip(&mut estimator.filter.bias_b.z, bit),
        &|estimator, bit| flip(&mut estimator.filter.gyro_matrix.m12, bit),
        &|estimator, bit| flip(&mut estimator.filter.velocity_n.x, bit),
        &|estimator, bit| flip(&mut estimator.filter.reference.dip, bit),
        &|estimator, bit| flip(&mut estimator.filter.reference.declination, bit),
        &|estimator, bit| flip(&mut estimator.filter.iron.iron_b.y, bit),
        &|estimator, bit| flip(&mut estimator.filter.params.gravity, bit),
        &|estimator, bit| flip(&mut estimator.filter.params.window_s, bit),
        &|estimator, bit| flip(&mut estimator.covariance_n[3], bit),
        &|estimator, bit| estimator.last_us = estimator.last_us.map(|last_us| last_us ^ 1 << bit),
        &|estimator, bit| flip(&mut estimator.white[1], bit),
    ];
    let mut worst_unnoticed_deg = 0.0_f32;
    for (place, strike) in places.iter().enumerate() {
        for bit in 0..32 {
            let mut struck = sound.clone();
            strike(&mut struck, bit);
            let mut unnoticed = struck.clone();
            struck.restore(&set, &settings.site, Some(&kept));
            let mut undisturbed = sound.clone();
            for counter in 53..60 {
                let expected = step(&mut undisturbed, counter);
                let off_deg = degrees(step(&mut struck, counter), expected);
                assert!(off_deg < 0.05, "place {place}, bit {bit}: {off_deg} deg");
                let (sample, increments) = resting(counter);
                let q_nb = unnoticed.step(&sample, &increments).q_nb.and_then(attitude::from_parts);
                worst_unnoticed_deg = worst_unnoticed_deg.max(q_nb.map_or(0.0, |q_nb| degrees(q_nb, expected)));
            }
        }
    }
    assert!(
        worst_unnoticed_deg > 5.0,
        "no flip did any harm: {worst_unnoticed_deg} deg"
    );
    // With nothing to go on from the attitude is found afresh, which takes a window.
    sound.restore(&set, &settings.site, None);
    assert!(!sound.filter.aligned);
}

/// U9: a bit of either copy of the calibration set.
#[test]
fn a_flipped_bit_of_the_calibration_is_put_right_by_the_copy_whose_checksum_fits() {
    let set = Set::nominal(Ranges::of(&Settings::NOMINAL));
    let mut estimator = Estimator::new(set, &Settings::NOMINAL.site);
    let sum = set.checksum();
    let flipped = |axis: usize, bit: u32| {
        let mut flipped = set;
        let scale = &mut flipped.acc[axis % 12].scale;
        flip(scale, bit % 32);
        flipped
    };
    for bit in 0..64 {
        let mut copy = set;
        assert!(!estimator.mend_set(&mut copy, sum));
        if bit < 32 {
            copy = flipped(bit as usize, bit);
        } else {
            estimator.set = flipped(bit as usize, bit);
        }
        assert!(estimator.mend_set(&mut copy, sum), "{bit}");
        assert!(estimator.set == set && copy == set, "{bit}");
    }
}
