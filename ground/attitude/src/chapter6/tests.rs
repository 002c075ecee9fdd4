use std::sync::LazyLock;

use packets::channel::{ACC_LSB, GYRO_LSB, MAG_LSB_UT};
use twin::{
    motion::{Motion, RotationTest},
    part::signal::{Noise, Specimen},
};

use super::*;

const SEED: u64 = 7;

/// The sets of LMS EC and of MV SEC.
static CALIBRATED: LazyLock<[Set; 2]> = LazyLock::new(|| {
    let lms_ec = std::thread::spawn(|| calibrated::lms_ec(SEED).expect("LMS EC"));
    let mv_sec = calibrated::mv_sec(SEED).expect("MV SEC");
    [lms_ec.join().expect("a set"), mv_sec]
});

/// Tests with their poses.
const TESTS: [(usize, &[Pose]); 2] = [(1, &TEST_1), (2, &TEST_2)];

/// [m/s2] accelerometer biases of the twin (0.02 on an axis, half of it in the mean) and 1.4 parts in 1000 of gravity.
const FORCE: f64 = 0.05;

#[test]
fn the_twin_stands_in_the_poses_of_the_thesis() {
    for (test, poses) in TESTS {
        let flown = Flown::of(test, SEED);
        let run = flown.by(mt());
        for pose in poses {
            let force_e = run.force_e(pose.after).expect("a rest");
            let off = (force_e - Vector3::from(pose.exact)).amax();
            assert!(off < FORCE, "test {test} {}: {force_e}", pose.name);
        }
    }
}

#[test]
fn by_mt_it_is_what_the_unit_sent_and_by_another_set_it_is_not() {
    let flown = Flown::of(1, SEED);
    assert!(flown.by(mt()).as_sent());
    let mut other = mt();
    other.gyro[0].bias_counts += 1.0;
    assert!(!flown.by(other).as_sent());
}

/// Length of the mean error about the three axes.
fn mean(errors: &flown::Errors) -> f64 {
    Vector3::from(errors.mean_sd().map(|(mean, _)| mean)).norm()
}

#[test]
fn a_calibrated_unit_errs_less_than_one_by_mt() {
    let [lms_ec, mv_sec] = *CALIBRATED;
    for (test, poses) in TESTS {
        let flown = Flown::of(test, SEED);
        let [mt, lms_ec, mv_sec] = [mt(), lms_ec, mv_sec].map(|set| {
            let run = flown.by(set);
            let [rate, triad, _] = run.errors().map(|errors| mean(&errors));
            (rate, triad, off(&run, poses).expect("every pose"))
        });
        // Half: what no calibration takes away is the noise of a test's means, 0.01 deg/s and 0.01 m/s2.
        assert!(lms_ec.0 < 0.5 * mt.0, "test {test}, rate: {lms_ec:?}, MT {mt:?}");
        assert!(lms_ec.2 < 0.5 * mt.2, "test {test}, force: {lms_ec:?}, MT {mt:?}");
        assert!(mv_sec.2 < 0.5 * mt.2, "test {test}, force: {mv_sec:?}, MT {mt:?}");
        assert!(mv_sec.1 < 0.5 * mt.1, "test {test}, TRIAD: {mv_sec:?}, MT {mt:?}");
    }
}

#[test]
fn no_test_is_flown_with_the_noise_its_parameters_were_fitted_to() {
    for test in [RotationTest::first(), RotationTest::second()] {
        assert!(test.duration_s().expect("an end") < calibrated::LATER_S);
    }
}

/// \[counts\] five sigmas of the least sure bias, a gyro's: 2.68 counts, 45 samples a run, 24 runs.
const BIAS_COUNTS: f64 = 0.41;

#[test]
fn both_methods_find_the_biases_the_parts_were_made_with() {
    let [lms_ec, mv_sec] = *CALIBRATED;
    let same = |name: &str, found: f32, made: f64| {
        let off = f64::from(found) - made;
        assert!(off.abs() < BIAS_COUNTS, "{name}: {found} counts, made with {made}");
    };
    // As `twin::plant` draws them: a stream a plate, the gyros' after the plates', in it a stream a part.
    let stream = |number: usize, part: u64| Noise::new(SEED).stream(number as u64).stream(part);
    for plate in 0..4 {
        let acc = Specimen::<3>::draw(stream(plate, 0), 0.0, 0.02 / ACC_LSB, 0).bias;
        let mag = Specimen::<3>::draw(stream(plate, 1), 0.0, 0.1 / MAG_LSB_UT, 0).bias;
        let gyro = Specimen::<1>::draw(stream(4 + plate, 0), 0.0, 0.0015 / GYRO_LSB, 0).bias;
        for axis in 0..3 {
            let k = 3 * plate + axis;
            same("acc, LMS EC", lms_ec.acc[k].bias_counts, acc[axis]);
            same("acc, MV SEC", mv_sec.acc[k].bias_counts, acc[axis]);
            same("mag, MV SEC", mv_sec.mag[k].bias_counts, mag[axis]);
        }
        same("gyro, LMS EC", lms_ec.gyro[plate].bias_counts, gyro.x);
    }
}

#[test]
fn what_is_printed_has_every_row() {
    let text = tables(SEED, &|| ()).expect("calibrated");
    for row in [
        "rate, thesis, LMS EC",
        "rate, twin, MT",
        "rate, twin, LMS EC",
        "gyros as by MT",
        "TRIAD, MV SEC",
        "filter, MV SEC",
        "Table 6.2",
        "Table 6.4",
        "rms off",
    ] {
        assert!(text.contains(row), "{row} in\n{text}");
    }
}
