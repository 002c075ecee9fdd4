//! What is wrong with the reference's record, or with what the case claims of the place.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::{ACCELEROMETER, GYRO, GYRO_AND_MAGNETOMETER, Injection, MAGNETOMETER, everything, names, sensor, shaped};
use crate::{
    draw::Draw,
    injected::{
        recording::{Kind, Pose},
        scene::Scene,
    },
};

/// All of this file.
pub const ALL: &[Injection] = &[
    shaped("reference-lag", ACCELEROMETER, lag),
    shaped("mounting", GYRO_AND_MAGNETOMETER, mounting),
    shaped("table-tilt", ACCELEROMETER, tilt),
    shaped("gravity-value", ACCELEROMETER, gravity_value),
    shaped("field-model", MAGNETOMETER, field_model),
    Injection {
        in_library: false,
        ..shaped("reference-smoothing", GYRO, smoothing)
    },
];

/// Turns what the record says of every row.
fn turned(scene: &mut Scene, turn: impl Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>) -> Vec<String> {
    for pose in &mut scene.record {
        pose.q_nb = pose.q_nb.map(&turn);
    }
    everything(scene)
}

/// The unit sits askew on what is measured.
fn mounting(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let askew = UnitQuaternion::from_rotation_matrix(&sensor::turn(draw, 0.01 * strength));
    turned(scene, |q_nb| q_nb * askew)
}

/// The reference's vertical is none.
fn tilt(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let way = draw.uniform(0.0, std::f64::consts::TAU);
    let tilt = UnitQuaternion::from_scaled_axis(0.005 * strength * Vector3::new(way.cos(), way.sin(), 0.0));
    for pose in &mut scene.record {
        pose.place_n = pose.place_n.map(|place_n| tilt * place_n);
    }
    turned(scene, |q_nb| tilt * q_nb)
}

/// The record is late.
fn lag(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let delay_s = strength * draw.uniform(0.5, 1.5) * 0.005;
    scene.size("tau", delay_s);
    let rows = delay_s / scene.step_s;
    let late = |row: usize| {
        let from = row as f64 - rows;
        let before = scene.record.get(usize::try_from(from.floor() as i64).ok()?)?;
        let after = scene.record.get(from.floor() as usize + 1)?;
        let part = from - from.floor();
        Some(Pose {
            q_nb: before.q_nb.zip(after.q_nb).map(|(one, other)| one.slerp(&other, part)),
            place_n: before
                .place_n
                .zip(after.place_n)
                .map(|(one, other)| one.lerp(&other, part)),
        })
    };
    let record: Vec<Pose> = (0..scene.record.len())
        .map(|row| late(row).unwrap_or_default())
        .collect();
    scene.record = record;
    everything(scene)
}

/// The record was smoothed both ways, as software for markers does: means under a bell, without delay.
fn smoothing(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let width = (strength * draw.uniform(0.8, 1.2) * 0.012 / scene.step_s).max(0.1);
    let far = (3.0 * width).ceil() as isize;
    let bell: Vec<f64> = (-far..=far)
        .map(|offset| (-0.5 * (offset as f64 / width).powi(2)).exp())
        .collect();
    let smooth = |row: usize| {
        let (mut turn, mut place) = (nalgebra::Vector4::zeros(), Vector3::zeros());
        let (mut turns, mut places) = (0.0, 0.0);
        let own = scene.record[row];
        let middle = own.q_nb?;
        for (offset, weight) in (-far..=far).zip(&bell) {
            let Some(pose) = usize::try_from(row as isize + offset)
                .ok()
                .and_then(|at| scene.record.get(at))
            else {
                continue;
            };
            if let Some(q_nb) = pose.q_nb {
                let near = q_nb.coords * middle.coords.dot(&q_nb.coords).signum();
                turn += near * *weight;
                turns += weight;
            }
            if let Some(place_n) = pose.place_n {
                place += place_n * *weight;
                places += weight;
            }
        }
        Some(Pose {
            q_nb: (turns > 0.0).then(|| UnitQuaternion::from_quaternion(Quaternion::from(turn))),
            place_n: own.place_n.filter(|_| places > 0.0).map(|_| place / places),
        })
    };
    let record: Vec<Pose> = (0..scene.record.len())
        .map(|row| smooth(row).unwrap_or(scene.record[row]))
        .collect();
    scene.record = record;
    everything(scene)
}

fn gravity_value(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let more = strength * draw.sign() * 0.02;
    scene.gravity += more;
    // What is claimed is too much by this: the truth is less.
    scene.size("dg", -more);
    names(scene, &scene.of(Kind::Accelerometer))
}

fn field_model(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let more_n = strength * 1.0 * draw.vector();
    scene.field_n_ut = scene.field_n_ut.map(|field_n| field_n + more_n);
    for (name, value) in ["dn", "de", "dd"].into_iter().zip(more_n.iter()) {
        scene.size(name, -value);
    }
    names(scene, &scene.of(Kind::Magnetometer))
}
