//! What is wrong with accelerometers.

use nalgebra::{Matrix3, Vector3};
use packets::channel::Quantity::SpecificForce;
use twin::geometry;

use super::{ALL_PLATES, Disturbance, channels, graded, gross, plates, warm};
use crate::{
    draw::Draw,
    scene::{Scene, changed, rubbed, shifted, slow},
};

/// [m/s2] of one milli-g.
const MG: f64 = 9.80665e-3;

/// All of this file.
pub const ALL: &[Disturbance] = &[
    graded("accel-bias", bias),
    warm("accel-bias-temperature", bias_temperature),
    graded("accel-scale", scale),
    warm("accel-scale-temperature", scale_temperature),
    graded("accel-misalignment", misalignment),
    graded("accel-nonlinearity", nonlinearity),
    graded("accel-hysteresis", hysteresis),
    graded("accel-vibration-rectification", vibration_rectification),
    graded("lever-arm", lever_arm),
    graded("accel-latency", latency),
    gross("accel-high-pass", high_pass),
    gross("accel-range", range),
];

fn bias(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let b = strength * 10.0 * MG * draw.vector();
        scene.sizes_of("b", SpecificForce, plate, b.as_slice());
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |_, force| force + b);
    }
    channels(SpecificForce, &plates)
}

fn bias_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let (k, bend) = (strength * 0.4 * MG * draw.vector(), draw.uniform(-0.015, 0.015));
        scene.sizes_of("k", SpecificForce, plate, k.as_slice());
        let source = scene.source.clone();
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| {
            let warmth = source.at(t).temperature_c - 25.0;
            force + k * warmth * (1.0 + bend * warmth)
        });
    }
    channels(SpecificForce, &plates)
}

fn scale(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let s = strength * 0.008 * draw.vector();
        scene.sizes_of("s", SpecificForce, plate, s.as_slice());
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |_, force| {
            force + s.component_mul(&force)
        });
    }
    channels(SpecificForce, &plates)
}

fn scale_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let (k, bend) = (strength * 2e-4 * draw.vector(), draw.uniform(-0.015, 0.015));
        scene.sizes_of("k", SpecificForce, plate, k.as_slice());
        let source = scene.source.clone();
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| {
            let warmth = source.at(t).temperature_c - 25.0;
            force + k.component_mul(&force) * (warmth * (1.0 + bend * warmth))
        });
    }
    channels(SpecificForce, &plates)
}

/// Three axes that are not square to each other.
fn misalignment(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let skew: Matrix3<f64> = Matrix3::from_fn(|row, column| {
            if row == column {
                0.0
            } else {
                strength * 0.008 * draw.normal()
            }
        });
        scene.magnitude.get_or_insert(skew.norm());
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |_, force| force + skew * force);
    }
    channels(SpecificForce, &plates)
}

/// Second order, each axis its own.
fn nonlinearity(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let a = strength * 6e-4 * draw.vector();
        scene.sizes_of("a", SpecificForce, plate, a.as_slice());
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |_, force| {
            force + a.component_mul(&force.component_mul(&force))
        });
    }
    channels(SpecificForce, &plates)
}

/// The proof mass rubs: after a turning back the reading stays behind on the other side, in full once some m/s2 are gone.
fn hysteresis(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let (plates, way) = (plates(draw), draw.log_uniform(0.3, 3.0));
    for &plate in &plates {
        let behind = strength * 5.0 * MG * draw.vector().abs();
        scene.magnitude.get_or_insert(behind.norm());
        let lean = rubbed(&scene.views.force_p[plate], way, scene.duration_s + 2.0);
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| {
            force - behind.component_mul(&lean(t))
        });
    }
    channels(SpecificForce, &plates)
}

/// What turns the unit shakes it, too fast to be recorded, by an amplitude that grows with the rate; of that a spring that is
/// stiffer one way makes an offset, 2 mg at 1 rad/s. Where stops are near it falls short of the square.
fn vibration_rectification(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let (k, source) = (strength * 2.0 * MG * draw.vector(), scene.source.clone());
        scene.magnitude.get_or_insert(k.norm());
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| {
            let shaking = source.at(t).rate_b.norm_squared();
            force + k * (shaking / (1.0 + 0.005 * shaking))
        });
    }
    channels(SpecificForce, &plates)
}

/// The unit turns about another point than its drawing says: all plates are off by one vector.
fn lever_arm(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let offset_b = strength * 0.01 * draw.direction();
    for (name, value) in ["dx", "dy", "dz"].into_iter().zip(offset_b.iter()) {
        scene.size(name, *value);
    }
    for plate in ALL_PLATES {
        let (source, dcm_pb) = (scene.source.clone(), geometry::dcm_bp(plate).transpose());
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| {
            let truth = source.at(t);
            let tangential = truth.rate_dot_b.cross(&offset_b);
            force + dcm_pb * (tangential + truth.rate_b.cross(&truth.rate_b.cross(&offset_b)))
        });
    }
    channels(SpecificForce, &ALL_PLATES)
}

fn latency(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let delay_s = strength * draw.uniform(0.5, 1.5) * 0.01;
    scene.size("tau", delay_s);
    for view in &mut scene.views.force_p {
        *view = shifted(view, move |t| t - delay_s);
    }
    channels(SpecificForce, &ALL_PLATES)
}

fn high_pass(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let (plates, tau_s) = (plates(draw), draw.log_uniform(0.5, 3.0));
    for &plate in &plates {
        let slow = slow(&scene.views.force_p[plate], tau_s, scene.duration_s + 2.0);
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| force - slow(t));
    }
    channels(SpecificForce, &plates)
}

/// A full scale other than the register map says: codes worth twice or four times as much.
fn range(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    let factor = if draw.chance(0.5) { 0.5 } else { 0.25 };
    for &plate in &plates {
        scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |_, force: Vector3<f64>| {
            force * factor
        });
    }
    channels(SpecificForce, &plates)
}
