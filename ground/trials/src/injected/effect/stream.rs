//! What is wrong with samples rather than with physics: noise, blows, timing from row to row, values that repeat.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{ACCELEROMETER, GYRO, Injection, each, everything, one, random, sensor, shaped};
use crate::{
    draw::Draw,
    injected::{
        recording::Kind::{Accelerometer, Gyro, Magnetometer},
        scene::Scene,
        series,
    },
};

/// All of this file.
pub const ALL: &[Injection] = &[
    random("noise-level", GYRO, noise_level),
    random("vibration", ACCELEROMETER, vibration),
    random("shock", ACCELEROMETER, shock),
    random("sampling-jitter", GYRO, sampling_jitter),
    random("stale-sample", GYRO, stale_sample),
    random("coarse-quantisation", GYRO, coarse_quantisation),
    shaped("latency", ACCELEROMETER, latency),
    shaped("clock-rate", ACCELEROMETER, clock_rate),
];

/// A sensor of any kind, and what is fine in it: a twentieth of a degree a second, 50 mm/s2, 0.5 uT.
fn any(scene: &Scene, draw: &mut Draw) -> (usize, f64) {
    let at = draw.below(scene.sensors.len());
    let fine = match scene.sensors[at].kind {
        Gyro => 2e-3,
        Accelerometer => 0.05,
        Magnetometer => 0.5,
    };
    (at, fine)
}

fn noise_level(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, fine) = any(scene, draw);
    let noise: Vec<Vector3<f64>> = (0..scene.times_s.len())
        .map(|_| strength * fine * draw.vector())
        .collect();
    each(scene, &[sensor], |row, value| value + noise[row])
}

/// A motor's line whose speed wanders, on the accelerometer and a little on the gyro, on all the time.
fn vibration(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let nyquist_hz = 0.5 / scene.step_s;
    let (hz, along_b) = (draw.uniform(0.25, 0.85) * nyquist_hz, draw.direction());
    let mut phase = 0.0;
    let phases: Vec<f64> = (0..scene.times_s.len())
        .map(|_| {
            phase += TAU * hz * scene.step_s + 0.02 * draw.normal();
            phase
        })
        .collect();
    let (force, rate) = (scene.of(Accelerometer), scene.of(Gyro));
    let turn_b = 0.01 * strength * draw.direction();
    let mut touched = each(scene, &force, |row, value| {
        value + strength * 0.3 * along_b * phases[row].sin()
    });
    touched.extend(each(scene, &rate, |row, value| value + turn_b * phases[row].cos()));
    touched
}

/// Taps: strokes that ring out in some hundredths of a second, one every five to ten.
fn shock(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let force = scene.of(Accelerometer);
    let mut strokes = vec![Vector3::zeros(); scene.times_s.len()];
    let (mut at_s, ring_hz) = (scene.times_s[0] + draw.uniform(1.0, 8.0), draw.uniform(15.0, 45.0));
    while at_s < scene.times_s[scene.times_s.len() - 1] {
        let stroke = strength * draw.uniform(1.0, 6.0) * draw.direction();
        for (row, t_s) in scene.times_s.iter().enumerate() {
            let since = t_s - at_s;
            if (0.0..0.3).contains(&since) {
                strokes[row] += stroke * (-since / 0.03).exp() * (TAU * ring_hz * since).cos();
            }
        }
        at_s += draw.uniform(5.0, 10.0);
    }
    each(scene, &force, |row, value| value + strokes[row])
}

/// The instant of each row is off by a draw of its own, for all sensors alike.
fn sampling_jitter(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let size = strength * 5e-4 / scene.step_s;
    let off: Vec<f64> = (0..scene.times_s.len()).map(|_| size * draw.normal()).collect();
    for sensor in &mut scene.sensors {
        sensor.values = series::late(&sensor.values, |row| off[row]);
    }
    everything(scene)
}

/// A read that came too late leaves the values of the row before.
fn stale_sample(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    // A magnetometer's rows repeat anyway.
    let kind = match draw.chance(0.5) && !scene.of(Accelerometer).is_empty() {
        true => Accelerometer,
        false => Gyro,
    };
    let sensor = one(scene, kind, draw);
    let share = (0.02 * strength).min(0.5);
    let mut before = scene.sensors[sensor].values[0];
    let kept: Vec<Vector3<f64>> = (scene.sensors[sensor].values.iter())
        .map(|value| {
            if !draw.chance(share) {
                before = *value;
            }
            before
        })
        .collect();
    each(scene, &[sensor], |row, _| kept[row])
}

fn coarse_quantisation(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let (sensor, fine) = any(scene, draw);
    // Steps of a power of two are what a register loses.
    let step = fine * 4.0 * 2f64.powf((strength.log2()).round());
    each(scene, &[sensor], |_, value| {
        value.map(|value| (value / step).floor() * step)
    })
}

/// Everything the unit says is late.
fn latency(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let all: Vec<usize> = (0..scene.sensors.len()).collect();
    sensor::late(scene, draw, strength, &all)
}

/// The unit's clock runs at another rate than the reference's, from the first row on.
fn clock_rate(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let rate = strength * draw.sign() * draw.uniform(0.5, 1.5) * 5e-5;
    scene.size("e", rate);
    for sensor in &mut scene.sensors {
        sensor.values = series::late(&sensor.values, |row| -rate * row as f64);
    }
    everything(scene)
}
