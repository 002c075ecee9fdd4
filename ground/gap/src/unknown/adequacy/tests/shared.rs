//! What is open of each channel, and found along one line in several.

use super::{super::calibrations::Shared, *};

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
    let instant = |view: &View| Open::new("instant".into(), 1.0, view.axis_b, [Vector3::zeros(); 2]);
    views.iter_mut().for_each(|view| view.open = vec![instant(view)]);
    let of_three = off(&views, &joint, [2.2; CHANNELS]);
    views.iter_mut().for_each(|view| view.part = 0);
    let of_one = off(&views, &joint, [2.2; CHANNELS]);
    assert!(of_three.p < 0.04 && of_one.p > 0.1, "{of_three:?} {of_one:?}");
}

#[test]
fn zeros_along_one_vector_are_seen_where_no_two_are_alike() {
    const SENSORS: usize = 12;
    let (mut views, joint) = scene_of(SENSORS);
    // Of each two sensors along an axis one looks along it and one against it.
    for (channel, view) in views.iter_mut().enumerate().filter(|(channel, _)| channel % 2 == 1) {
        view.axis_b = -view.axis_b;
        let bias = Open::new("bias".into(), 1.0, view.axis_b, [Vector3::zeros(); 2]);
        view.open = vec![bias];
        assert_eq!(view.axis_b, -Vector3::ith(channel % 3, 1.0));
    }
    let judged = |off: &dyn Fn(&View) -> f64| {
        let mut residuals = noise_of(SENSORS, 7);
        for ((residual, columns), view) in residuals.iter_mut().zip(joint.columns()).zip(&views) {
            *residual += columns.nuisance.column(0) * off(view);
        }
        judge(&views, &joint, &joint.fit(&residuals), &[], None)
    };
    let magnet_b = Vector3::new(2.5, -2.0, 1.5);
    let magnet = judged(&|view| view.axis_b.dot(&magnet_b));
    let first = &magnet.aspects[0].what;
    assert!(
        magnet.p < 0.02 && first.contains("zeros along one vector"),
        "{magnet:?}"
    );
    let each = judged(&|view| view.axis_b.abs().dot(&magnet_b) * 0.5);
    assert!(
        !each.aspects.iter().any(|aspect| aspect.what.contains("one vector")),
        "{each:?}"
    );
}

#[test]
fn a_turn_of_several_axes_is_seen_whole() {
    const SIGMA_RAD: f64 = 2e-3;
    let (mut views, joint) = scene_of(6);
    let axes = [
        [0.8, 0.6, 0.0],
        [0.0, 0.6, 0.8],
        [-0.6, 0.0, 0.8],
        [1.0, 0.0, 0.0],
        [0.0, 0.8, -0.6],
        [0.0, 0.0, 1.0],
    ];
    let across = |axis_b: Vector3<f64>| {
        let first = axis_b.cross(&Vector3::new(0.36, 0.48, 0.8)).normalize();
        [first, axis_b.cross(&first)]
    };
    for (view, axis_b) in views.iter_mut().zip(axes.map(Vector3::from)) {
        view.group = 0;
        let open = |name: &str| Open::new(name.into(), SIGMA_RAD, axis_b, across(axis_b));
        view.open = vec![open("scale"), open("axis_1"), open("axis_2")];
    }
    let turn_b = Vector3::new(5e-6, -3e-6, 8e-6);
    let mut fitted = joint.fit(&noise_of(6, 1));
    for (found, axis_b) in fitted.nuisance.iter_mut().zip(axes.map(Vector3::from)) {
        let moved = nalgebra::Rotation3::new(turn_b) * axis_b - axis_b;
        let [first, second] = across(axis_b).map(|across| across.dot(&moved) / SIGMA_RAD);
        *found = DVector::from_vec(vec![0.0, first, second]);
    }
    let energy: f64 = fitted.nuisance.iter().map(DVector::norm_squared).sum();
    let turned = |own: &Shared| own.what.starts_with("what is mounted with g0, turned");
    let shared = Shared::all(&views, 2);
    let own = shared.iter().find(|own| turned(own)).map(|own| own.sum(&fitted));
    // The ridge closes a thousandth.
    assert!(
        own.is_some_and(|own| (own / energy - 1.0).abs() < 3e-3),
        "{own:?} {energy}"
    );
}
