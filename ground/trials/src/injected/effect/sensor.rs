//! What is wrong with gyros and accelerometers: laws on what they wrote.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::{ACCELEROMETER, GYRO, GYRO_AND_ACCELEROMETER, Injection, each, names, one, shaped, warm};
use crate::{
    draw::Draw,
    injected::{
        recording::Kind::{Accelerometer, Gyro},
        scene::Scene,
        series,
    },
};

/// [rad/s] of one degree a second.
const DEG: f64 = std::f64::consts::PI / 180.0;

/// [m/s2] of one milli-g.
const MG: f64 = 9.806_65e-3;

/// All of this file.
pub const ALL: &[Injection] = &[
    shaped("gyro-bias", GYRO, gyro_bias),
    shaped("gyro-scale", GYRO, gyro_scale),
    shaped("gyro-misalignment", GYRO, gyro_misalignment),
    shaped("gyro-nonlinearity", GYRO, gyro_nonlinearity),
    shaped("gyro-saturation", GYRO, gyro_saturation),
    shaped("gyro-g-sensitivity", GYRO_AND_ACCELEROMETER, g_sensitivity),
    shaped("gyro-lag", GYRO, gyro_lag),
    shaped("gyro-latency", GYRO, gyro_latency),
    shaped("gyro-bias-walk", GYRO, bias_walk),
    warm("gyro-bias-temperature", GYRO, gyro_bias_temperature),
    shaped("gyro-warm-up", GYRO, warm_up),
    shaped("accel-bias", ACCELEROMETER, accel_bias),
    shaped("accel-scale", ACCELEROMETER, accel_scale),
    shaped("accel-misalignment", ACCELEROMETER, accel_misalignment),
    shaped("accel-nonlinearity", ACCELEROMETER, accel_nonlinearity),
    shaped("accel-latency", ACCELEROMETER, accel_latency),
    warm("accel-bias-temperature", ACCELEROMETER, accel_bias_temperature),
    shaped("lever-arm", GYRO_AND_ACCELEROMETER, lever_arm),
];

fn bias(scene: &mut Scene, sensor: usize, b: Vector3<f64>) -> Vec<String> {
    scene.sizes_of("b", sensor, &b);
    each(scene, &[sensor], |_, value| value + b)
}

fn gyro_bias(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Gyro, draw);
    bias(scene, sensor, strength * 0.3 * DEG * draw.vector())
}

fn accel_bias(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Accelerometer, draw);
    bias(scene, sensor, strength * 10.0 * MG * draw.vector())
}

/// A scale multiplies what was felt: what was written less the zero.
fn scale(scene: &mut Scene, sensor: usize, s: Vector3<f64>) -> Vec<String> {
    scene.sizes_of("s", sensor, &s);
    let zero = scene.sensors[sensor].bias;
    each(scene, &[sensor], |_, value| value + s.component_mul(&(value - zero)))
}

fn gyro_scale(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Gyro, draw);
    scale(scene, sensor, strength * 0.005 * draw.vector())
}

fn accel_scale(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Accelerometer, draw);
    scale(scene, sensor, strength * 0.008 * draw.vector())
}

/// Axes that are askew one by one.
fn skew(draw: &mut Draw, size: f64) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| if row == column { 0.0 } else { size * draw.normal() })
}

fn gyro_misalignment(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Gyro, draw);
    let (askew, zero) = (skew(draw, 0.008 * strength), scene.sensors[sensor].bias);
    each(scene, &[sensor], |_, value| value + askew * (value - zero))
}

fn accel_misalignment(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Accelerometer, draw);
    let (askew, zero) = (skew(draw, 0.008 * strength), scene.sensors[sensor].bias);
    each(scene, &[sensor], |_, value| value + askew * (value - zero))
}

/// A spring that stiffens: a cube, with a little of the fifth power; one part in a hundred at 5 rad/s.
fn gyro_nonlinearity(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Gyro, draw);
    let (a, zero) = (
        strength * draw.sign() * draw.uniform(0.005, 0.015),
        scene.sensors[sensor].bias,
    );
    each(scene, &[sensor], |_, value| {
        value + (value - zero).map(|rate| a * rate * (rate / 5.0).powi(2) * (1.0 - 0.02 * (rate / 5.0).powi(2)))
    })
}

fn accel_nonlinearity(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Accelerometer, draw);
    let a = strength * 6e-4 * draw.vector();
    scene.sizes_of("a", sensor, &a);
    each(scene, &[sensor], |_, value| {
        value + a.component_mul(&value.component_mul(&value))
    })
}

/// An amplifier that reaches its rail: a two-hundredth of the samples at the typical size, on each axis at its own rate.
fn gyro_saturation(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Gyro, draw);
    let share = (0.005 * strength).min(0.3);
    let most = [0, 1, 2].map(|own| {
        let mut sizes: Vec<f64> = scene.sensors[sensor]
            .values
            .iter()
            .map(|value| value[own].abs())
            .collect();
        sizes.sort_by(f64::total_cmp);
        sizes[((1.0 - share) * (sizes.len() - 1) as f64) as usize]
    });
    let own = draw.below(3);
    let all = draw.chance(0.5);
    let most: Vector3<f64> = Vector3::from_fn(|axis, _| if all || axis == own { most[axis] } else { f64::INFINITY });
    let touched = each(scene, &[sensor], |_, value| {
        value.zip_map(&most, |value: f64, most: f64| value.clamp(-most, most))
    });
    if all {
        touched
    } else {
        vec![scene.sensors[sensor].names[own].clone()]
    }
}

fn g_sensitivity(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Gyro, draw);
    let k = Matrix3::from_fn(|_, _| strength * 0.05 * DEG / 9.8 * draw.normal());
    // What the accelerometer felt, its white noise averaged out.
    let force = series::mean(&scene.sensors[one(scene, Accelerometer, draw)].values, 3);
    each(scene, &[sensor], |row, value| value + k * force[row])
}

fn gyro_lag(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Gyro, draw);
    let tau_s = strength * draw.uniform(0.5, 1.5) * 0.01;
    scene.size("tau", tau_s);
    let lagging = series::lagged(&scene.sensors[sensor].values, tau_s / scene.step_s);
    each(scene, &[sensor], |row, _| lagging[row])
}

/// All sensors of these kinds late by one time.
pub(super) fn late(scene: &mut Scene, draw: &mut Draw, strength: f64, sensors: &[usize]) -> Vec<String> {
    let delay_s = strength * draw.uniform(0.5, 1.5) * 0.005;
    scene.size("tau", delay_s);
    let rows = delay_s / scene.step_s;
    for &at in sensors {
        scene.sensors[at].values = series::late(&scene.sensors[at].values, |_| rows);
    }
    names(scene, sensors)
}

fn gyro_latency(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let all = scene.of(Gyro);
    late(scene, draw, strength, &all)
}

fn accel_latency(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let all = scene.of(Accelerometer);
    late(scene, draw, strength, &all)
}

/// A random walk of each axis.
fn bias_walk(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Gyro, draw);
    let size = strength * 0.01 * DEG * scene.step_s.sqrt();
    let mut zero = Vector3::zeros();
    let walk: Vec<Vector3<f64>> = (0..scene.times_s.len())
        .map(|_| {
            zero += size * draw.vector();
            zero
        })
        .collect();
    each(scene, &[sensor], |row, value| value + walk[row])
}

/// A zero that goes with the temperature, by a coefficient that bends.
pub(super) fn drifting(scene: &mut Scene, draw: &mut Draw, sensor: usize, k: Vector3<f64>) -> Vec<String> {
    scene.sizes_of("k", sensor, &k);
    let bend = draw.uniform(-0.015, 0.015);
    let warmth: Vec<f64> = scene.temperature_c.iter().flatten().map(|own| own - 25.0).collect();
    each(scene, &[sensor], |row, value| {
        let warmth = warmth.get(row).copied().unwrap_or(0.0);
        value + k * (warmth * (1.0 + bend * warmth))
    })
}

fn gyro_bias_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Gyro, draw);
    let k = strength * 0.01 * DEG * draw.vector();
    drifting(scene, draw, sensor, k)
}

fn accel_bias_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Accelerometer, draw);
    let k = strength * 0.4 * MG * draw.vector();
    drifting(scene, draw, sensor, k)
}

fn warm_up(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Gyro, draw);
    let (a, tau) = (
        strength * 0.2 * DEG * draw.vector(),
        draw.uniform(0.15, 0.5) * scene.times_s.len() as f64,
    );
    scene.sizes_of("A", sensor, &a);
    each(scene, &[sensor], |row, value| value + a * (-(row as f64) / tau).exp())
}

/// The accelerometer sits elsewhere: what it would feel more there, from the rates that the gyro wrote.
fn lever_arm(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<String> {
    let sensor = one(scene, Accelerometer, draw);
    let offset_b = strength * 0.01 * draw.direction();
    for (name, value) in ["dx", "dy", "dz"].into_iter().zip(offset_b.iter()) {
        scene.size(name, *value);
    }
    let gyro = &scene.sensors[one(scene, Gyro, draw)];
    let rates: Vec<Vector3<f64>> = gyro.values.iter().map(|value| value - gyro.bias).collect();
    // The gyro is behind the accelerometer by the difference of their slots; over ten milliseconds its noise is averaged.
    let early = (scene.sensors[sensor].slot_s - gyro.slot_s) / scene.step_s;
    let rates = series::mean(&series::late(&rates, |_| -early), 3);
    let turning: Vec<Vector3<f64>> = series::slope(&rates, 3)
        .iter()
        .map(|slope| slope / scene.step_s)
        .collect();
    each(scene, &[sensor], |row, value| {
        // w' x r + w x (w x r), the second as (w w' - w'w) r.
        let rate = rates[row];
        let spin = rate * rate.dot(&offset_b) - offset_b * rate.norm_squared();
        value + turning[row].cross(&offset_b) + spin
    })
}

/// A turn by a small angle about a drawn axis.
pub(super) fn turn(draw: &mut Draw, angle: f64) -> Rotation3<f64> {
    Rotation3::new(angle * draw.direction())
}
