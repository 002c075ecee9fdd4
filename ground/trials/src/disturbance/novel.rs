//! Disturbances that no library of sensor effects describes: the right verdict on them is "none of these".

use std::sync::Arc;

use packets::channel::Quantity::{Field, Rate, SpecificForce};
use twin::part::signal::Noise;

use super::{ALL_PLATES, Disturbance, channels, graded, random};
use crate::{
    draw::Draw,
    scene::{Scene, changed},
};

/// All of them.
pub const ALL: &[Disturbance] = &[
    graded("cross-talk", cross_talk),
    graded("slow-tone", slow_tone),
    random("noise-bursts", noise_bursts),
    graded("sticking-mount", sticking_mount),
    graded("supply-ramp", supply_ramp),
    graded("sun-heating", sun_heating),
];

/// The gyro's wire runs beside the magnetometer's bridge.
fn cross_talk(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plate = draw.below(4);
    let (rate, leak) = (scene.views.rate[plate].clone(), strength * 0.4 * draw.vector());
    scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |t, field| {
        field + leak * (rate(t).abs().sqrt())
    });
    channels(Field, &[plate])
}

/// A slow oscillation of one accelerometer's electronics.
fn slow_tone(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plate = draw.below(4);
    let (swing, rate) = (strength * 0.03 * draw.vector(), draw.log_uniform(0.08, 0.4));
    scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| {
        force + swing * (rate * t + 0.3 * (0.11 * t).sin()).sin()
    });
    channels(SpecificForce, &[plate])
}

/// Noise that comes and goes, seconds at a time.
fn noise_bursts(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let noise = Noise::new(draw.uniform(0.0, 1e15) as u64);
    for plate in ALL_PLATES {
        let (on, white) = (noise.stream(0), noise.stream(1 + plate as u64));
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            let bursting = on.uniform((t.max(0.0) / 4.0) as u64) < 0.15;
            rate + if bursting {
                strength * 0.02 * white.normal((t * 400.0).round().max(0.0) as u64)
            } else {
                0.0
            }
        });
    }
    channels(Rate, &ALL_PLATES)
}

/// The unit slips in its mount and back, at random, by the same angle: what is recorded did not slip.
fn sticking_mount(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let noise = Noise::new(draw.uniform(0.0, 1e15) as u64);
    let slip = nalgebra::UnitQuaternion::from_scaled_axis(strength * 0.01 * draw.direction());
    let slipped = move |t: f64| noise.uniform((t.max(0.0) / 9.0) as u64) < 0.4;
    let record = scene.record.clone();
    scene.record = Arc::new(move |t| {
        let (q_nb, place_n) = record(t);
        // Eased in and out over a second, so that the record stays smooth.
        let within = (t / 9.0).fract() * 9.0;
        let (before, now) = (slipped(t - 9.0), slipped(t));
        let share = match (before, now) {
            (false, false) => 0.0,
            (true, true) => 1.0,
            (false, true) => ease(within),
            (true, false) => 1.0 - ease(within),
        };
        (q_nb * slip.powf(share), place_n)
    });
    super::moving()
}

fn ease(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
}

/// The battery sinks: every magnetometer reads less, ever faster.
fn supply_ramp(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let knee_s = draw.uniform(150.0, 400.0);
    for view in &mut scene.views.field_p_ut {
        *view = changed(view, move |t, field| {
            field * (1.0 - strength * 0.01 * (t / knee_s).powi(4).min(4.0))
        });
    }
    channels(Field, &ALL_PLATES)
}

/// One accelerometer is warmed by light from one side: its error follows where that side looks, slowly.
fn sun_heating(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plate = draw.below(4);
    let (motion, swing) = (scene.motion.clone(), strength * 0.03 * draw.vector());
    let (face_b, sun_n) = (draw.direction(), draw.direction());
    scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| {
        // The mean of a minute of light, in twelve looks.
        let light = |back: u32| {
            (twin::motion::Motion::at(&*motion, t - 5.0 * f64::from(back))
                .attitude
                .q_nb
                * face_b)
                .dot(&sun_n)
                .max(0.0)
        };
        let warmth: f64 = (0..12).map(light).sum::<f64>() / 12.0;
        force + swing * warmth
    });
    channels(SpecificForce, &[plate])
}
