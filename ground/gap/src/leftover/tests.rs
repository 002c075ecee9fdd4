//! Residuals with and without something in them.

use super::*;
use crate::joint::Columns;

const SAMPLES: usize = 600;
const CHANNELS: usize = 3;

/// Three gyros, each with an open bias of five sigma of noise.
fn scene() -> (Vec<View>, Joint) {
    let phase: Vec<f64> = (0..SAMPLES).map(|row| row as f64 / SAMPLES as f64).collect();
    let view = |channel: usize| View {
        name: format!("g{channel}"),
        kind: 1,
        axis_b: Vector3::ith(channel, 1.0),
        phase: phase.clone(),
        motion: DMatrix::from_fn(SAMPLES, 2, |row, column| {
            (row as f64 * 0.01 * (column + 1) as f64).sin()
        }),
        turned: DMatrix::from_fn(SAMPLES, 3, |row, axis| {
            let felt_b = Vector3::new(1.0, (row as f64 * 0.03).sin(), (row as f64 * 0.02).cos());
            felt_b.cross(&Vector3::ith(channel, 1.0))[axis]
        }),
        levels: vec![(0..SAMPLES).map(|row| (row % LEVELS) as u8).collect(); LEVELLED.len()],
    };
    let columns = Columns {
        nuisance: DMatrix::from_element(SAMPLES, 1, 5.0),
        effects: DMatrix::zeros(SAMPLES, 0),
    };
    (
        (0..CHANNELS).map(view).collect(),
        Joint::new(vec![columns; CHANNELS], &[]),
    )
}

fn noise(seed: u64) -> Vec<DVector<f64>> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut channel = || DVector::from_fn(SAMPLES, |_, _| StandardNormal.sample(&mut random));
    (0..CHANNELS).map(|_| channel()).collect()
}

fn judged(explained: &[usize], change: impl Fn(usize, &mut DVector<f64>)) -> Leftover {
    let (views, joint) = scene();
    let mut residuals = noise(7);
    residuals
        .iter_mut()
        .enumerate()
        .for_each(|(channel, residual)| change(channel, residual));
    judge(&views, &joint, &joint.fit(&residuals), explained)
}

#[test]
fn noise_alone_is_enough() {
    let left = judged(&[], |_, _| {});
    assert!(left.p > 0.05, "{left:?}");
    assert!(left.unknown(0.05) < 0.06);
}

#[test]
fn a_slow_wave_in_one_channel_is_found_there() {
    let left = judged(&[], |channel, residual| {
        if channel == 1 {
            residual
                .iter_mut()
                .enumerate()
                .for_each(|(row, value)| *value += 0.7 * (row as f64 * 0.05).sin());
        }
    });
    assert!(left.p < 0.01, "{left:?}");
    assert_eq!(left.aspects[0].channel, Some(1));
    assert!(left.unknown(0.05) > 0.9);
}

#[test]
fn what_hides_in_the_calibration_is_found_by_its_size() {
    let left = judged(&[], |channel, residual| {
        if channel == 2 {
            residual.add_scalar_mut(5.0 * 8.0);
        }
    });
    assert!(left.p < 0.01, "{left:?}");
    assert!(left.aspects[0].what.contains("calibration"), "{:?}", left.aspects);
}

#[test]
fn what_another_effect_explains_no_longer_counts() {
    let louder = |channel: usize, residual: &mut DVector<f64>| {
        if channel == 0 {
            *residual *= 2.0;
        }
    };
    assert!(judged(&[], louder).p < 0.01);
    assert!(judged(&[0], louder).p > 0.05);
}

#[test]
fn a_mount_that_slips_is_found_by_the_rotation_all_sensors_share() {
    let slips = |row: usize| if row * 7 / SAMPLES % 2 == 1 { 0.5 } else { 0.0 };
    let left = judged(&[], |channel, residual| {
        let turned = scene().0[channel].turned.clone();
        let about_z = |row: usize| slips(row) * turned[(row, 2)];
        residual
            .iter_mut()
            .enumerate()
            .for_each(|(row, value)| *value += about_z(row));
    });
    assert!(left.p < 0.01, "{left:?}");
    assert!(
        left.aspects
            .iter()
            .any(|aspect| aspect.what.contains("common rotation"))
    );
}

#[test]
fn a_wrong_law_is_found_by_the_steps_between_levels() {
    let left = judged(&[], |channel, residual| {
        if channel == 0 {
            let of_level = |row: usize| 0.3 * ((row % LEVELS) as f64 - 3.5) / 2.3;
            residual
                .iter_mut()
                .enumerate()
                .for_each(|(row, value)| *value += of_level(row));
        }
    });
    assert!(left.p < 0.01, "{left:?}");
    assert!(left.aspects[0].what.contains("steps with"), "{:?}", left.aspects);
}
