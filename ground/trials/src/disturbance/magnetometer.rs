//! What is wrong with magnetometers, or with the field where they are.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};
use packets::channel::Quantity::Field;
use twin::geometry;

use super::{ALL_PLATES, Disturbance, channels, graded, gross, plate, plates, warm};
use crate::{
    draw::Draw,
    scene::{Scene, changed, lagged, shifted},
};

/// All of this file.
pub const ALL: &[Disturbance] = &[
    graded("hard-iron", hard_iron),
    graded("soft-iron", soft_iron),
    warm("mag-scale-temperature", scale_temperature),
    warm("mag-offset-temperature", offset_temperature),
    graded("mag-cross-field", cross_field),
    graded("mag-set-reset", set_reset),
    graded("current-field", current_field),
    graded("eddy-current", eddy_current),
    graded("mains-alias", mains_alias),
    graded("mag-latency", latency),
    graded("field-gradient", field_gradient),
    gross("mag-axis-order", axis_order),
];

/// A magnet in the unit: one field in b, and a dipole's difference from plate to plate.
fn hard_iron(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let common_b = strength * 0.6 * draw.vector();
    scene.magnitude.get_or_insert(common_b.norm());
    for plate in ALL_PLATES {
        let own_b = common_b + strength * 0.15 * draw.vector();
        let own_p = geometry::dcm_bp(plate).transpose() * own_b;
        scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |_, field| field + own_p);
    }
    channels(Field, &ALL_PLATES)
}

/// Iron in the unit: symmetric, the same in b for all plates.
fn soft_iron(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let half = Matrix3::from_fn(|_, _| strength * 0.01 * draw.normal());
    let soft_b: Matrix3<f64> = half + half.transpose();
    scene.magnitude.get_or_insert(soft_b.norm());
    for plate in ALL_PLATES {
        let dcm_bp = geometry::dcm_bp(plate);
        let soft_p = dcm_bp.transpose() * soft_b * dcm_bp;
        scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |_, field| field + soft_p * field);
    }
    channels(Field, &ALL_PLATES)
}

/// HMC5883L datasheet: -0.3 %/degC uncompensated; parts differ by a fifth.
fn scale_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let (k, bend) = (-0.003 * strength * draw.uniform(0.8, 1.2), draw.uniform(-0.01, 0.01));
        scene.sizes_of("k", Field, plate, &[k; 3]);
        let source = scene.source.clone();
        scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |t, field| {
            let warmth = source.at(t).temperature_c - 25.0;
            field * (1.0 + k * warmth * (1.0 + bend * warmth))
        });
    }
    channels(Field, &plates)
}

fn offset_temperature(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let (k, bend) = (strength * 0.05 * draw.vector(), draw.uniform(-0.015, 0.015));
        scene.sizes_of("k", Field, plate, k.as_slice());
        let source = scene.source.clone();
        scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |t, field| {
            let warmth = source.at(t).temperature_c - 25.0;
            field + k * (warmth * (1.0 + bend * warmth))
        });
    }
    channels(Field, &plates)
}

/// An AMR bridge's answer to the field across it, m (1 - c/H0 ...) to first order: k m_i (m_j + m_k).
fn cross_field(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        let k = strength * 6e-4 * draw.uniform(0.6, 1.4) * draw.sign();
        scene.magnitude.get_or_insert(k);
        scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |_, field| {
            field + k * Vector3::new(field.x * field.y, field.y * field.z, field.z * field.x)
        });
    }
    channels(Field, &plates)
}

/// Permed at an instant: offset and gain jump.
fn set_reset(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plate = plate(draw);
    let onset_s = scene.pace() * draw.uniform(60.0, 200.0);
    let (gain, offset) = (strength * draw.sign() * 0.02, strength * 0.5 * draw.vector());
    scene.magnitude.get_or_insert(offset.norm());
    scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |t, field| {
        if t < onset_s {
            field
        } else {
            field * (1.0 + gain) + offset
        }
    });
    channels(Field, &[plate])
}

/// A load that switches: its wire's field, on and off in both windows.
fn current_field(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let (period_s, share) = (draw.uniform(25.0, 60.0), draw.uniform(0.3, 0.6));
    for plate in ALL_PLATES {
        let field_p = strength * 0.5 * draw.vector();
        scene.magnitude.get_or_insert(field_p.norm());
        scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |t, field| {
            if (t / period_s).fract() < share {
                field + field_p
            } else {
                field
            }
        });
    }
    channels(Field, &ALL_PLATES)
}

/// Currents in a conducting case: inside it the field follows that of the case's frame with a lag.
fn eddy_current(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let tau_s = strength * draw.uniform(0.5, 1.5) * 0.006;
    scene.size("tau", tau_s);
    for view in &mut scene.views.field_p_ut {
        *view = lagged(view, tau_s);
    }
    channels(Field, &ALL_PLATES)
}

/// A cable in the room: 60 Hz and a little of its third harmonic, which fold to nothing but what the oscillators of supply
/// and unit are off by. The supply is one with an oscillator of its own, an inverter; a grid wanders by 10 mHz in minutes.
fn mains_alias(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let hz = 60.0 * (1.0 + 3e-5 * draw.normal()) + 0.01 * draw.normal();
    let [in_phase_n, behind_n] = [0.5, 0.1].map(|size_ut| strength * size_ut * draw.vector());
    scene.magnitude.get_or_insert(in_phase_n.norm());
    let third = draw.uniform(0.0, 0.1);
    for plate in ALL_PLATES {
        let (dcm_pb, motion) = (geometry::dcm_bp(plate).transpose(), scene.motion.clone());
        // Copper on the board takes some of it away.
        let let_in = draw.uniform(0.85, 1.0);
        scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |t, field| {
            let phase = TAU * hz * t;
            let alternating_n = in_phase_n * (phase.sin() + third * (3.0 * phase).sin()) + behind_n * phase.cos();
            field + let_in * (dcm_pb * (motion.at(t).attitude.q_nb.inverse() * alternating_n))
        });
    }
    channels(Field, &ALL_PLATES)
}

fn latency(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let delay_s = strength * draw.uniform(0.5, 1.5) * 0.01;
    scene.size("tau", delay_s);
    for view in &mut scene.views.field_p_ut {
        *view = shifted(view, move |t| t - delay_s);
    }
    channels(Field, &ALL_PLATES)
}

/// Iron in the room: a field that varies over the unit, fixed to the room.
fn field_gradient(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    // Free of sources and curl: symmetric and without trace [uT/m].
    let half = Matrix3::from_fn(|_, _| strength * 4.0 * draw.normal());
    let gradient_n = half + half.transpose();
    let gradient_n: Matrix3<f64> = gradient_n - Matrix3::identity() * (gradient_n.trace() / 3.0);
    scene.magnitude.get_or_insert(gradient_n.norm());
    for plate in ALL_PLATES {
        let (dcm_bp, place_b) = (geometry::dcm_bp(plate), geometry::accelerometer_place_b(plate));
        let motion = scene.motion.clone();
        scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |t, field| {
            let q_nb = motion.at(t).attitude.q_nb;
            let place_n = motion.position_n(t) + q_nb * place_b;
            field + dcm_bp.transpose() * (q_nb.inverse() * (gradient_n * place_n))
        });
    }
    channels(Field, &ALL_PLATES)
}

/// Registers are in the order X, Z, Y: read as X, Y, Z.
fn axis_order(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let plates = plates(draw);
    for &plate in &plates {
        scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], |_, field| {
            Vector3::new(field.x, field.z, field.y)
        });
    }
    channels(Field, &plates)
}
