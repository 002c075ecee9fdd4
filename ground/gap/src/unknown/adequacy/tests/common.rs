//! What some channels see together.

use super::{super::common::Common, *};

#[test]
fn a_supply_that_sags_is_found_by_the_factor_all_sensors_share() {
    let left = judged(|channel, residual| {
        let felt = scene().0[channel].felt.clone();
        (residual.iter_mut().enumerate())
            .for_each(|(row, value)| *value += 0.8 * (row as f64 / SAMPLES as f64 - 0.5) * felt[row]);
    });
    assert!(left.p < 0.01, "{left:?}");
    assert!(
        left.aspects.iter().any(|aspect| aspect.what.contains("common factor")),
        "{left:?}"
    );
}

#[test]
fn a_mount_that_slips_is_found_by_the_rotation_all_sensors_share() {
    let slips = |row: usize| if row * 7 / SAMPLES % 2 == 1 { 0.5 } else { 0.0 };
    let left = judged(|channel, residual| {
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
fn what_goes_along_one_axis_is_seen_sharper_than_along_any() {
    let slips = |row: usize| if row / 17 * 7 % 5 < 2 { 0.9 } else { 0.0 };
    let left = judged(|channel, residual| {
        let turned = &scene().0[channel].turned;
        (residual.iter_mut().enumerate()).for_each(|(row, value)| *value += slips(row) * turned[(row, 2)]);
    });
    let size = |what: &str| {
        let mut own = left.aspects.iter().filter(|aspect| aspect.what == what);
        own.next().map_or(0.0, |aspect| aspect.size)
    };
    let one = size("all sensors: a common rotation about one axis in stretches of 1/60");
    let any = size("all sensors: a common rotation in stretches of 1/60");
    assert!(one > 5.0 && one > any + 1.0, "{one} {any}");
}

#[test]
fn a_step_in_the_middle_of_a_stretch_is_as_large_as_at_its_edge() {
    let (views, joint) = scene();
    let common = Common::new(&views, 10, |view, _| view.axis_b, |_| true);
    let energy = |from: usize| {
        let pulse = |row: usize, _| f64::from(u8::from((from..from + SAMPLES / 10).contains(&row)));
        let residuals = vec![DVector::from_fn(SAMPLES, pulse); CHANNELS];
        let rest = joint.fit(&residuals);
        common.sum(&Fitted {
            rest: residuals,
            ..rest
        })
    };
    let (edge, middle) = (energy(SAMPLES / 10), energy(SAMPLES / 10 + SAMPLES / 20));
    assert!((middle / edge - 1.0).abs() < 0.01, "{middle} {edge}");
}

#[test]
fn blows_that_are_weak_in_each_sensor_are_seen_by_all_together() {
    const SENSORS: usize = 12;
    let (views, joint) = scene_of(SENSORS);
    let judged = |blow: f64| {
        let mut residuals = noise_of(SENSORS, 7);
        for residual in &mut residuals {
            (50..SAMPLES).step_by(100).for_each(|row| residual[row] += blow);
        }
        judge(&views, &joint, &joint.fit(&residuals), &[], None)
    };
    let (none, weak) = (judged(0.0), judged(2.0));
    assert!(none.p > 0.05, "{none:?}");
    assert!(
        weak.p < 0.02 && weak.aspects[0].what == "gyros: outliers along a common vector",
        "{weak:?}"
    );
}
