//! What is wrong with gyros.

use std::sync::Arc;

use packets::channel::Quantity::Rate;
use twin::{geometry, part::signal::Noise};

use super::{Disturbance, channels, graded, gross, plates, warm};
use crate::{
    draw::Draw,
    scene::{Scene, changed, lagged, shifted},
};

/// [rad/s] of one degree a second.
const DEG: f64 = std::f64::consts::PI / 180.0;

/// All of this file.
pub const ALL: &[Disturbance] = &[
    graded("gyro-bias", bias),
    warm("gyro-bias-temperature", bias_temperature),
    graded("gyro-warm-up", warm_up),
    graded("gyro-scale", scale),
    warm("gyro-scale-temperature", scale_temperature),
    graded("gyro-nonlinearity", nonlinearity),
    graded("gyro-misalignment", misalignment),
    graded("gyro-g-sensitivity", g_sensitivity),
    graded("gyro-lag", lag),
    graded("gyro-latency", latency),
    graded("gyro-bias-walk", bias_walk),
    gross("gyro-saturation", saturation),
];

fn bias(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let b = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.3 * DEG;
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |_, rate| rate + b);
    }
    channels(Rate, &plates)
}

/// The coefficient bends by a percent or two a degree, as real ones do.
fn bias_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let k = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.01 * DEG;
        let bend = draw.uniform(-0.015, 0.015);
        let source = scene.source.clone();
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            let warmth = source.at(t).temperature_c - 25.0;
            rate + k * warmth * (1.0 + bend * warmth)
        });
    }
    channels(Rate, &plates)
}

fn warm_up(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let (plates, tau_s) = (plates(draw), draw.log_uniform(30.0, 150.0));
    for &plate in &plates {
        let a = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.2 * DEG;
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            rate + a * (-t.max(0.0) / tau_s).exp()
        });
    }
    channels(Rate, &plates)
}

fn scale(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let s = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.005;
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |_, rate| rate * (1.0 + s));
    }
    channels(Rate, &plates)
}

fn scale_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let k = strength * draw.sign() * draw.uniform(0.5, 1.5) * 2e-4;
        let bend = draw.uniform(-0.015, 0.015);
        let source = scene.source.clone();
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            let warmth = source.at(t).temperature_c - 25.0;
            rate * (1.0 + k * warmth * (1.0 + bend * warmth))
        });
    }
    channels(Rate, &plates)
}

/// A spring that stiffens: cubic, with a little of the fifth power.
fn nonlinearity(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let a = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.004;
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |_, rate| {
            rate + a * rate.powi(3) * (1.0 - 0.02 * rate * rate)
        });
    }
    channels(Rate, &plates)
}

fn misalignment(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let axis_b = geometry::gyro_axis_b(plate);
        // A turned axis, so its component along itself shrinks too.
        let turn = nalgebra::Rotation3::new(strength * draw.uniform(0.5, 1.5) * 0.01 * axis_b.cross(&draw.direction()));
        let (source, turned_b) = (scene.source.clone(), turn * axis_b);
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            rate + (turned_b - axis_b).dot(&source.at(t).rate_b)
        });
    }
    channels(Rate, &plates)
}

fn g_sensitivity(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let k = strength * 0.05 * DEG / 9.8 * draw.vector();
        let source = scene.source.clone();
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            rate + k.dot(&source.at(t).force_b)
        });
    }
    channels(Rate, &plates)
}

fn lag(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let (plates, tau_s) = (plates(draw), strength * draw.uniform(0.5, 1.5) * 0.02);
    for &plate in &plates {
        scene.views.rate[plate] = lagged(&scene.views.rate[plate], tau_s);
    }
    channels(Rate, &plates)
}

fn latency(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let delay_s = strength * draw.uniform(0.5, 1.5) * 0.01;
    for view in &mut scene.views.rate {
        *view = shifted(view, move |t| t - delay_s);
    }
    channels(Rate, &super::ALL_PLATES)
}

/// Steps of a second, joined by lines.
fn bias_walk(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    const STEPS: usize = 1200;
    let plates = plates(draw);
    for &plate in &plates {
        let noise = Noise::new(draw.uniform(0.0, 1e15) as u64);
        let mut walk = vec![0.0];
        for step in 0..STEPS {
            let last = walk.last().copied().unwrap_or(0.0);
            walk.push(last + strength * 0.01 * DEG * noise.normal(step as u64));
        }
        let walk = Arc::new(walk);
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            let at = t.clamp(0.0, STEPS as f64 - 1.0);
            let (whole, part) = (at.floor() as usize, at.fract());
            rate + walk[whole] * (1.0 - part) + walk[whole + 1] * part
        });
    }
    channels(Rate, &plates)
}

fn saturation(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    let most = draw.uniform(0.6, 1.0);
    for &plate in &plates {
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |_, rate| rate.clamp(-most, most));
    }
    channels(Rate, &plates)
}
