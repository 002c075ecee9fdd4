//! What is open of each channel, and found alike in all.

use super::*;

/// Judged with the only open column of each channel off by so many sigmas.
fn off(views: &[View], joint: &Joint, sigmas: [f64; CHANNELS]) -> Leftover {
    let mut residuals = noise(7);
    for ((residual, columns), sigmas) in residuals.iter_mut().zip(joint.columns()).zip(sigmas) {
        *residual += columns.nuisance.column(0) * sigmas;
    }
    judge(views, joint, &joint.fit(&residuals), &[], None)
}

#[test]
fn calibrations_that_are_off_alike_are_no_calibrations() {
    let (views, joint) = scene();
    let alike = off(&views, &joint, [2.5; CHANNELS]);
    assert!(alike.p < 0.02, "{alike:?}");
    assert!(
        alike.aspects[0].what.contains("bias of all alike"),
        "{:?}",
        alike.aspects
    );
    let each = off(&views, &joint, [2.0, -2.0, 0.5]);
    assert!(each.p > 0.05, "{each:?}");
}

#[test]
fn channels_of_one_part_have_one_instant_and_are_alike_by_chance() {
    let (mut views, joint) = scene();
    views.iter_mut().for_each(|view| view.open = vec!["instant".into()]);
    let of_three = off(&views, &joint, [2.2; CHANNELS]);
    views.iter_mut().for_each(|view| view.part = 0);
    let of_one = off(&views, &joint, [2.2; CHANNELS]);
    assert!(of_three.p < 0.04 && of_one.p > 0.1, "{of_three:?} {of_one:?}");
}
