//! What is wrong with magnetometers, or with the field where they are.

use nalgebra::{Matrix3, Vector3};

use super::{Injection, MAGNETOMETER, comes_and_goes, each, one, sensor, shaped, warm};
use crate::{
    draw::Draw,
    injected::{recording::Kind::Magnetometer, scene::Scene, series},
};

/// All of this file.
pub const ALL: &[Injection] = &[
    shaped("hard-iron", MAGNETOMETER, hard_iron),
    shaped("hard-iron", MAGNETOMETER, passing_iron),
    shaped("soft-iron", MAGNETOMETER, soft_iron),
    shaped("mag-latency", MAGNETOMETER, latency),
    shaped("eddy-current", MAGNETOMETER, eddy_current),
    shaped("mag-set-reset", MAGNETOMETER, set_reset),
    shaped("current-field", MAGNETOMETER, current_field),
    shaped("mag-cross-field", MAGNETOMETER, cross_field),
    shaped("field-gradient", MAGNETOMETER, field_gradient),
    warm("mag-offset-temperature", MAGNETOMETER, offset_temperature),
];

fn hard_iron(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, iron_b) = (one(scene, Magnetometer, draw), strength * 1.5 * draw.direction());
    each(scene, &[sensor], |_, field| field + iron_b)
}

/// A magnet that is brought and taken away.
fn passing_iron(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, iron_b) = (one(scene, Magnetometer, draw), strength * 1.5 * draw.direction());
    let is_here = comes_and_goes(scene, draw);
    each(
        scene,
        &[sensor],
        |row, field| if is_here(row) { field + iron_b } else { field },
    )
}

fn soft_iron(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Magnetometer, draw);
    let half: Matrix3<f64> = Matrix3::from_fn(|_, _| strength * 0.01 * draw.normal());
    let soft = half + half.transpose();
    each(scene, &[sensor], |_, field| field + soft * field)
}

fn latency(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let all = scene.of(Magnetometer);
    sensor::late(scene, draw, strength, &all)
}

/// Currents in a conducting case follow its field by a lag.
fn eddy_current(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, tau_s) = (
        one(scene, Magnetometer, draw),
        strength * draw.uniform(0.5, 1.5) * 0.006,
    );
    scene.size("tau", tau_s);
    let lagging = series::lagged(&scene.sensors[sensor].values, tau_s / scene.step_s);
    each(scene, &[sensor], |row, _| lagging[row])
}

/// Permed at an instant: zero and gain jump.
fn set_reset(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Magnetometer, draw);
    let onset = draw.uniform(0.25, 0.6) * scene.times_s.len() as f64;
    let (gain, offset) = (strength * draw.sign() * 0.02, strength * 0.5 * draw.vector());
    each(scene, &[sensor], |row, field| match (row as f64) < onset {
        true => field,
        false => field * (1.0 + gain) + offset,
    })
}

/// A load that switches on and off.
fn current_field(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, wire_b) = (one(scene, Magnetometer, draw), strength * 0.8 * draw.vector());
    let period = draw.uniform(0.12, 0.25) * scene.times_s.len() as f64;
    let (share, from) = (draw.uniform(0.3, 0.6), draw.uniform(0.0, 1.0));
    each(scene, &[sensor], |row, field| {
        match (row as f64 / period + from).fract() < share {
            true => field + wire_b,
            false => field,
        }
    })
}

/// An AMR bridge's answer to the field across it, with a little of the next order.
fn cross_field(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, k) = (
        one(scene, Magnetometer, draw),
        strength * 3e-4 * draw.uniform(0.6, 1.4) * draw.sign(),
    );
    each(scene, &[sensor], |_, field| {
        let across = Vector3::new(field.x * field.y, field.y * field.z, field.z * field.x);
        field + k * across + 0.1 * k * k * across.component_mul(&field)
    })
}

/// Iron in the room: the field differs with the place.
fn field_gradient(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Magnetometer, draw);
    // Free of sources and curl: symmetric and without trace [uT/m].
    let half: Matrix3<f64> = Matrix3::from_fn(|_, _| strength * 2.0 * draw.normal());
    let whole = half + half.transpose();
    let gradient_n = whole - Matrix3::identity() * (whole.trace() / 3.0);
    // Where the magnetometer was when it measured, a slot before the row.
    let followed = scene.followed_by(sensor);
    let middle = followed.iter().map(|one| one.1).sum::<Vector3<f64>>() / followed.len() as f64;
    each(scene, &[sensor], |row, field| {
        let (q_nb, place_n) = followed[row];
        field + q_nb.inverse() * (gradient_n * (place_n - middle))
    })
}

fn offset_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Magnetometer, draw);
    let k = strength * 0.1 * draw.vector();
    sensor::drifting(scene, draw, sensor, k)
}
