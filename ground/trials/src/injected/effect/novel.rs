//! What no library of sensor effects describes.

use nalgebra::{UnitQuaternion, Vector3};

use super::{
    ACCELEROMETER, GYRO, GYRO_AND_MAGNETOMETER, Injection, MAGNETOMETER, each, everything, one, random, shaped,
};
use crate::{
    draw::Draw,
    injected::{
        recording::Kind::{Accelerometer, Gyro, Magnetometer},
        scene::Scene,
        series,
    },
};

const fn novel(injection: Injection) -> Injection {
    Injection {
        in_library: false,
        ..injection
    }
}

/// All of this file.
pub const ALL: &[Injection] = &[
    novel(shaped("cross-talk", GYRO_AND_MAGNETOMETER, cross_talk)),
    novel(shaped("slow-tone", ACCELEROMETER, slow_tone)),
    novel(random("noise-bursts", GYRO, noise_bursts)),
    novel(shaped("sticking-mount", GYRO_AND_MAGNETOMETER, sticking_mount)),
    novel(shaped("supply-ramp", MAGNETOMETER, supply_ramp)),
    novel(shaped("sun-heating", ACCELEROMETER, sun_heating)),
];

/// The gyro's wire runs beside the magnetometer's bridge: its root leaks.
fn cross_talk(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, own) = (one(scene, Magnetometer, draw), draw.below(3));
    let rates = series::mean(&scene.sensors[one(scene, Gyro, draw)].values, 3);
    let leak = strength * 0.5 * draw.vector();
    each(scene, &[sensor], |row, field| {
        field + leak * rates[row][own].abs().sqrt()
    })
}

/// A slow oscillation of an accelerometer's electronics, whose frequency wanders.
fn slow_tone(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, swing, rate) = (
        one(scene, Accelerometer, draw),
        strength * 0.03 * draw.vector(),
        draw.log_uniform(0.15, 0.8),
    );
    let times_s = scene.times_s.clone();
    each(scene, &[sensor], |row, force| {
        let t = times_s[row];
        force + swing * (rate * t + 0.3 * (0.11 * t).sin()).sin()
    })
}

/// Noise that comes and goes: a burst of some seconds in every ten.
fn noise_bursts(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, often) = (one(scene, Gyro, draw), (10.0 / scene.step_s) as usize);
    let (mut from, mut long) = (0.0, 0.0);
    let noise: Vec<Vector3<f64>> = (0..scene.times_s.len())
        .map(|row| {
            if row % often == 0 {
                long = draw.uniform(0.1, 0.3) * often as f64;
                from = row as f64 + draw.uniform(0.0, 0.7) * often as f64;
            }
            match (from..from + long).contains(&(row as f64)) {
                true => strength * 0.01 * draw.vector(),
                false => Vector3::zeros(),
            }
        })
        .collect();
    each(scene, &[sensor], |row, rate| rate + noise[row])
}

/// The unit slips in its mount and back, some seconds later each time: the record does not.
fn sticking_mount(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let slip = UnitQuaternion::from_scaled_axis(strength * 0.01 * draw.direction());
    let (mut share, mut to, mut next) = (0.0, 0.0, 0.0);
    for (row, pose) in scene.record.iter_mut().enumerate() {
        if row as f64 >= next {
            to = 1.0 - to;
            next += draw.uniform(4.0, 12.0) / scene.step_s;
        }
        // Followed with a second's lag, so that the record stays smooth.
        share += (to - share) * scene.step_s;
        pose.q_nb = pose.q_nb.map(|q_nb| q_nb * slip.powf(share));
    }
    everything(scene)
}

/// The battery sinks: every magnetometer reads less, ever faster.
fn supply_ramp(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let all = scene.of(Magnetometer);
    let knee = draw.uniform(0.4, 0.8) * scene.times_s.len() as f64;
    each(scene, &all, |row, field| {
        field * (1.0 - strength * 0.01 * (row as f64 / knee).powi(4).min(4.0))
    })
}

/// One accelerometer is warmed by light from one side: its error follows where that side looked within some ten seconds.
fn sun_heating(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, swing) = (one(scene, Accelerometer, draw), strength * 0.03 * draw.vector());
    let (face_b, sun_n) = (draw.direction(), draw.direction());
    let light = scene
        .followed()
        .into_iter()
        .map(|(q_nb, _)| Vector3::x() * (q_nb * face_b).dot(&sun_n).max(0.0));
    let warmth = series::lagged(&light.collect::<Vec<_>>(), 10.0 / scene.step_s);
    each(scene, &[sensor], |row, force| force + swing * warmth[row].x)
}
