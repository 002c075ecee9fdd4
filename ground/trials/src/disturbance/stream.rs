//! What is wrong with samples rather than with physics: noise, timing from sample to sample, codes and packets.

use emems::sample::{NOT_READ, Reading};
use nalgebra::Vector3;
use packets::channel::{
    CHANNELS,
    Quantity::{Field, Rate, SpecificForce},
};
use twin::part::signal::Noise;

use super::{ALL_PLATES, Disturbance, channels, graded, gross, moving, plates, random};
use crate::{
    draw::Draw,
    scene::{Scene, changed, shifted},
};

/// All of this file.
pub const ALL: &[Disturbance] = &[
    random("noise-level", noise_level),
    graded("vibration", vibration),
    graded("shock", shock),
    random("sampling-jitter", sampling_jitter),
    graded("stale-sample", stale_sample),
    gross("packet-loss", packet_loss),
    gross("coarse-quantisation", coarse_quantisation),
    gross("bit-fault", bit_fault),
    gross("stuck-channel", stuck_channel),
    gross("packet-corruption", packet_corruption),
];

/// A white sequence that is a function of time: one value an instant.
fn white(seed: f64) -> impl Fn(f64, u64) -> f64 + Copy + Send + Sync {
    let noise = Noise::new(seed as u64);
    move |t_s, stream| noise.stream(stream).normal((t_s * 1e9).round().max(0.0) as u64)
}

fn noise_level(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    let white = white(draw.uniform(0.0, 1e15));
    let quantity = if draw.chance(0.5) { Field } else { SpecificForce };
    let quantity = draw.asked().and_then(|asked| asked.quantity).unwrap_or(quantity);
    scene
        .magnitude
        .get_or_insert(strength * if quantity == Field { 0.2 } else { 0.12 });
    for &plate in &plates {
        let noise = move |t: f64| Vector3::from_fn(|axis, _| white(t, (8 * plate + axis) as u64));
        match quantity {
            Field => {
                scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |t, field| {
                    field + strength * 0.2 * noise(t)
                })
            }
            // The part's low-pass takes most of what is added before it; nodes stand every 5 ms.
            _ => {
                scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| {
                    force + strength * 0.12 * noise(t)
                })
            }
        }
    }
    channels(quantity, &plates)
}

/// A motor's line, seen by every accelerometer and, a little, by every gyro.
fn vibration(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let (rate, direction_b) = (draw.uniform(2.0 * 3.1, 9.0 * 3.1), draw.direction());
    scene.magnitude.get_or_insert(0.12 * strength);
    for plate in ALL_PLATES {
        let swing_p =
            strength * 0.12 * draw.uniform(0.7, 1.3) * (twin::geometry::dcm_bp(plate).transpose() * direction_b);
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| {
            force + swing_p * (rate * t).sin()
        });
    }
    channels(SpecificForce, &ALL_PLATES)
}

/// Taps: short decaying strokes on the whole unit, some a minute.
fn shock(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    scene.magnitude.get_or_insert(20.0 * strength);
    let taps: Vec<(f64, Vector3<f64>)> = (0..(0.1 * scene.duration_s).ceil() as u32)
        .map(|k| {
            (
                10.0 * f64::from(k) + draw.uniform(0.0, 10.0),
                strength * draw.uniform(2.0, 20.0) * draw.direction(),
            )
        })
        .collect();
    for plate in ALL_PLATES {
        let (taps, dcm_pb) = (taps.clone(), twin::geometry::dcm_bp(plate).transpose());
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| {
            let stroke = |(at, stroke): &(f64, Vector3<f64>)| {
                let since = t - at;
                if (0.0..0.5).contains(&since) {
                    stroke * (-since / 0.06).exp() * (60.0 * since).cos()
                } else {
                    Vector3::zeros()
                }
            };
            force + dcm_pb * taps.iter().map(stroke).sum::<Vector3<f64>>()
        });
    }
    channels(SpecificForce, &ALL_PLATES)
}

/// The instant of each packet is off by a draw of its own; a packet's fast samples share it.
fn sampling_jitter(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let white = white(draw.uniform(0.0, 1e15));
    scene.magnitude.get_or_insert(0.003 * strength);
    let when = move |t: f64| t + strength * 0.003 * white((t / 0.2).floor() * 0.2, 0);
    for plate in ALL_PLATES {
        scene.views.force_p[plate] = shifted(&scene.views.force_p[plate], when);
        scene.views.field_p_ut[plate] = shifted(&scene.views.field_p_ut[plate], when);
        scene.views.rate[plate] = shifted(&scene.views.rate[plate], when);
    }
    moving()
}

/// The triad or value of a channel.
fn codes(reading: &mut Reading, index: usize) -> Option<&mut i16> {
    let channel = CHANNELS.get(index)?;
    let (plate, axis) = (channel.plate, index % 3);
    match channel.quantity {
        SpecificForce => reading.acc_p.get_mut(plate)?.get_mut(axis),
        Field => reading.mag_p.get_mut(plate)?.get_mut(axis),
        Rate => reading.gyro.get_mut(plate),
        _ => None,
    }
}

/// Sensors of one plate: all channels of each freeze together.
fn some_sensors(draw: &mut Draw) -> Vec<Vec<usize>> {
    let plates = plates(draw);
    let quantity = [SpecificForce, Field, Rate][draw.below(3)];
    let quantity = draw.asked().and_then(|asked| asked.quantity).unwrap_or(quantity);
    plates.into_iter().map(|plate| channels(quantity, &[plate])).collect()
}

/// A read that ran out of time leaves the value of the cycle before.
fn stale_sample(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let (sensors, noise) = (some_sensors(draw), Noise::new(draw.uniform(0.0, 1e15) as u64));
    let share = (0.02 * strength).min(0.5);
    scene.magnitude.get_or_insert(share);
    let touched = sensors.concat();
    scene.transit.push(Box::new(move |readings| {
        for at in 1..readings.len() {
            let before = readings[at - 1];
            for (sensor, channels) in sensors.iter().enumerate() {
                if noise.stream(sensor as u64).uniform(at as u64) < share {
                    for &index in channels {
                        let mut before = before;
                        if let (Some(now), Some(old)) = (codes(&mut readings[at], index), codes(&mut before, index)) {
                            *now = *old;
                        }
                    }
                }
            }
        }
    }));
    touched
}

/// Packets that are lost and not counted: what comes after is early.
fn packet_loss(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let lost: Vec<u16> = (0..1 + draw.below(3))
        .map(|_| (scene.pace() * draw.uniform(200.0, 2400.0)) as u16)
        .collect();
    scene.transit.push(Box::new(move |readings| {
        readings.retain(|reading| !lost.contains(&reading.counter));
        let first = readings.first().map_or(0, |reading| reading.counter);
        for (reading, counter) in readings.iter_mut().zip(first..) {
            reading.counter = counter;
        }
    }));
    moving()
}

fn each(scene: &mut Scene, touched: &[usize], change: impl Fn(usize, usize, i16) -> i16 + Send + Sync + 'static) {
    let touched = touched.to_vec();
    scene.transit.push(Box::new(move |readings| {
        for (at, reading) in readings.iter_mut().enumerate() {
            for &index in &touched {
                if let Some(code) = codes(reading, index).filter(|code| **code != NOT_READ) {
                    *code = change(at, index, *code);
                }
            }
        }
    }));
}

fn coarse_quantisation(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let touched = some_sensors(draw).concat();
    let step = [4, 8, 16][draw.below(3)];
    each(scene, &touched, move |_, _, code| code.div_euclid(step) * step);
    touched
}

/// One bit that is always set.
fn bit_fault(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let sensor = some_sensors(draw).swap_remove(0);
    let channel = sensor[draw.below(sensor.len())];
    let bit = 1 << (3 + draw.below(4));
    each(scene, &[channel], move |_, _, code| code | bit);
    vec![channel]
}

fn stuck_channel(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let sensor = some_sensors(draw).swap_remove(0);
    let channel = sensor[draw.below(sensor.len())];
    let (onset, value) = (
        (scene.pace() * draw.uniform(100.0, 600.0)) as usize,
        (draw.normal() * 30.0) as i16,
    );
    each(
        scene,
        &[channel],
        move |at, _, code| if at < onset { code } else { value },
    );
    vec![channel]
}

/// Digits that were garbled on the way and passed for good.
fn packet_corruption(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let (noise, share) = (
        Noise::new(draw.uniform(0.0, 1e15) as u64),
        draw.log_uniform(0.001, 0.01),
    );
    each(scene, &moving(), move |at, index, code| {
        let channel = noise.stream(index as u64);
        if channel.uniform(at as u64) < share {
            code ^ (1 << (channel.word(at as u64) % 12))
        } else {
            code
        }
    });
    moving()
}
