//! What is wrong with gyros.

use std::sync::Arc;

use packets::channel::Quantity::Rate;
use twin::{geometry, part::signal::Noise, plant::Views};

use super::{ALL_PLATES, Disturbance, channels, graded, gross, plates, warm};
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
    warm("gyro-temperature-hysteresis", temperature_hysteresis),
    graded("gyro-warm-up", warm_up),
    graded("gyro-scale", scale),
    warm("gyro-scale-temperature", scale_temperature),
    graded("gyro-nonlinearity", nonlinearity),
    graded("gyro-misalignment", misalignment),
    graded("gyro-g-sensitivity", g_sensitivity),
    graded("gyro-g2", g2),
    graded("gyro-supply", supply),
    graded("gyro-lag", lag),
    graded("gyro-latency", latency),
    graded("gyro-bias-walk", bias_walk),
    gross("gyro-saturation", saturation),
    gross("earth-rate", earth_rate),
];

fn bias(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let b = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.3 * DEG;
        scene.sizes_of("b", Rate, plate, &[b]);
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |_, rate| rate + b);
    }
    channels(Rate, &plates)
}

/// The coefficient bends by a percent or two a degree, as real ones do.
fn bias_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let k = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.01 * DEG;
        scene.sizes_of("k", Rate, plate, &[k]);
        let bend = draw.uniform(-0.015, 0.015);
        let source = scene.source.clone();
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            let warmth = source.at(t).temperature_c - 25.0;
            rate + k * warmth * (1.0 + bend * warmth)
        });
    }
    channels(Rate, &plates)
}

/// The die follows its case by some seconds: what the thermometer lets its electronics take out is not what it does.
fn temperature_hysteresis(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let (plates, tau_s) = (plates(draw), draw.log_uniform(3.0, 12.0));
    for &plate in &plates {
        // [rad/s/degC], so that a ramp of 1 degC/s shifts by 0.1 deg/s once the die follows.
        let k = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.1 * DEG / tau_s;
        scene.sizes_of("k", Rate, plate, &[k * tau_s]);
        let told = scene.views.gyro_temperature_c[plate].clone();
        let die = lagged(&told, tau_s);
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| rate + k * (told(t) - die(t)));
    }
    channels(Rate, &plates)
}

fn warm_up(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let (plates, tau_s) = (plates(draw), draw.log_uniform(30.0, 150.0));
    for &plate in &plates {
        let a = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.2 * DEG;
        scene.sizes_of("A", Rate, plate, &[a]);
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
        scene.sizes_of("s", Rate, plate, &[s]);
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |_, rate| rate * (1.0 + s));
    }
    channels(Rate, &plates)
}

fn scale_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let k = strength * draw.sign() * draw.uniform(0.5, 1.5) * 2e-4;
        scene.sizes_of("k", Rate, plate, &[k]);
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
        scene.magnitude.get_or_insert(a);
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
        scene.magnitude.get_or_insert(turn.angle());
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
        scene.magnitude.get_or_insert(k.norm());
        let source = scene.source.clone();
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            rate + k.dot(&source.at(t).force_b)
        });
    }
    channels(Rate, &plates)
}

/// The square of the force where the gyro is, felt a little more along one axis. The trials' motions do not bring it out:
/// only those by hand leave one g, by a tenth, and there five typical sizes in all gyros reach a ratio of 4.
fn g2(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let k = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.02 * DEG / (9.8 * 9.8);
        scene.magnitude.get_or_insert(k);
        let (soft_p, force_p) = (draw.direction(), Views::of(&scene.source).force_p[plate].clone());
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            let force = force_p(t);
            rate + k * (force.norm_squared() + 0.05 * soft_p.dot(&force).powi(2))
        });
    }
    channels(Rate, &plates)
}

/// ADIS16265 datasheet: 0.5 deg/s per volt; parts differ, their supply is one. It sags as a battery empties, or when a load
/// is switched on: at once by its inner resistance, and a little more as its electrodes follow.
fn supply(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let is_load = draw.chance(0.5);
    let (onset_s, tau_s, slow) = (
        scene.pace() * draw.uniform(60.0, 240.0),
        scene.pace() * draw.uniform(5.0, 30.0),
        draw.uniform(0.05, 0.2),
    );
    let whole_s = scene.duration_s;
    let sag_v = move |t: f64| match is_load {
        true if t < onset_s => 0.0,
        true => 0.25 * (1.0 - slow * (-(t - onset_s) / tau_s).exp()),
        false => 0.25 * t / whole_s * (1.0 + slow * (t / whole_s - 1.0)),
    };
    for plate in ALL_PLATES {
        let k = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.5 * DEG;
        scene.magnitude.get_or_insert(k);
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| rate - k * sag_v(t));
    }
    channels(Rate, &ALL_PLATES)
}

fn lag(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let (plates, tau_s) = (plates(draw), strength * draw.uniform(0.5, 1.5) * 0.02);
    scene.size("tau", tau_s);
    for &plate in &plates {
        scene.views.rate[plate] = lagged(&scene.views.rate[plate], tau_s);
    }
    channels(Rate, &plates)
}

fn latency(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let delay_s = strength * draw.uniform(0.5, 1.5) * 0.01;
    scene.size("tau", delay_s);
    for view in &mut scene.views.rate {
        *view = shifted(view, move |t| t - delay_s);
    }
    channels(Rate, &ALL_PLATES)
}

/// Steps of a second, joined by lines.
fn bias_walk(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let steps = (scene.duration_s as usize + 1).max(1200);
    let plates = plates(draw);
    scene.magnitude.get_or_insert(strength * 0.01 * DEG);
    for &plate in &plates {
        let noise = Noise::new(draw.uniform(0.0, 1e15) as u64);
        let mut walk = vec![0.0];
        for step in 0..steps {
            let last = walk.last().copied().unwrap_or(0.0);
            walk.push(last + strength * 0.01 * DEG * noise.normal(step as u64));
        }
        let walk = Arc::new(walk);
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            let at = t.clamp(0.0, steps as f64 - 1.0);
            let (whole, part) = (at.floor() as usize, at.fract());
            rate + walk[whole] * (1.0 - part) + walk[whole + 1] * part
        });
    }
    channels(Rate, &plates)
}

fn saturation(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    let most = draw.uniform(0.6, 1.0);
    // A register clips at once, an amplifier bends before: a parabola from most - bend to most + bend.
    let bend = most * draw.uniform(0.0, 0.15);
    scene.magnitude.get_or_insert(most);
    for &plate in &plates {
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |_, rate| {
            let within = rate.abs() - (most - bend);
            let short = match within {
                _ if within <= 0.0 => 0.0,
                _ if within < 2.0 * bend => within * within / (4.0 * bend),
                _ => within - bend,
            };
            rate.signum() * (rate.abs() - short)
        });
    }
    channels(Rate, &plates)
}

/// The gyros tell the rate against the room. A fiftieth of their noise in a sample: in ten minutes nobody sees it.
fn earth_rate(scene: &mut Scene, _draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let earth_n = scene.site.earth_rate_n();
    for plate in ALL_PLATES {
        let (axis_b, motion) = (geometry::gyro_axis_b(plate), scene.motion.clone());
        scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
            rate - axis_b.dot(&(motion.at(t).attitude.q_nb.inverse() * earth_n))
        });
    }
    channels(Rate, &ALL_PLATES)
}
