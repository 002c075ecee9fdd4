//! What is wrong with the reference: the truth instrument's record, the environment as stated, a plate's place or plug.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use packets::channel::Quantity::{Field, Rate, SpecificForce};
use twin::{geometry, plant::Views};

use super::{ALL_PLATES, Disturbance, channels, graded, gross, moving, plate};
use crate::{
    draw::Draw,
    scene::{Scene, changed, shifted},
};

/// All of this file.
pub const ALL: &[Disturbance] = &[
    graded("plate-rotation", plate_rotation),
    graded("plate-flexing", plate_flexing),
    gross("plate-swap", plate_swap),
    graded("gravity-value", gravity_value),
    graded("table-tilt", table_tilt),
    graded("mounting", mounting),
    graded("reference-lag", reference_lag),
    graded("reference-rate-scale", reference_rate_scale),
    graded("field-model", field_model),
    graded("latency", latency),
    graded("read-skew", read_skew),
    graded("clock-rate", clock_rate),
    gross("reference-sign", reference_sign),
];

/// A plate screwed on askew turns its three sensors together.
fn plate_rotation(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plate = plate(draw);
    let turn_b = nalgebra::Rotation3::new(strength * 0.01 * draw.direction());
    scene.magnitude.get_or_insert(0.01 * strength);
    let dcm_bp = geometry::dcm_bp(plate);
    let turn_p = dcm_bp.transpose() * turn_b.matrix() * dcm_bp;
    scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |_, force| turn_p * force);
    scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |_, field| turn_p * field);
    let (axis_b, source) = (geometry::gyro_axis_b(plate), scene.source.clone());
    // Turning the plate by R turns what it measures by R' in b.
    let change_b = turn_b.inverse() * axis_b - axis_b;
    scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
        rate + change_b.dot(&source.at(t).rate_b)
    });
    sensors(&[plate])
}

/// A plate on stand-offs yields to what presses on its face, and a tenth as much to what pulls along it, and turns its
/// sensors by that: by its weight, for in all motions here the pull of a turn is a fiftieth of that.
fn plate_flexing(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let plate = plate(draw);
    let hinge = draw.uniform(0.0, std::f64::consts::TAU);
    // [rad s2/m] 0.17 deg at one g.
    let yielding = strength * draw.uniform(0.5, 1.5) * 0.003 / 9.8;
    scene.magnitude.get_or_insert(yielding);
    let along_p = 0.1 * draw.direction();
    let load_p = Views::of(&scene.source).force_p[plate].clone();
    let turn_p = move |t: f64| {
        let load = load_p(t).dot(&(Vector3::z() + along_p));
        nalgebra::Rotation3::new(yielding * load * Vector3::new(hinge.cos(), hinge.sin(), 0.0))
    };
    let turned = turn_p.clone();
    scene.views.force_p[plate] = changed(&scene.views.force_p[plate], move |t, force| turned(t).inverse() * force);
    let turned = turn_p.clone();
    scene.views.field_p_ut[plate] = changed(&scene.views.field_p_ut[plate], move |t, field| {
        turned(t).inverse() * field
    });
    let (dcm_bp, axis_b, source) = (
        geometry::dcm_bp(plate),
        geometry::gyro_axis_b(plate),
        scene.source.clone(),
    );
    scene.views.rate[plate] = changed(&scene.views.rate[plate], move |t, rate| {
        let axis_p = dcm_bp.transpose() * axis_b;
        rate + (dcm_bp * (turn_p(t) * axis_p - axis_p)).dot(&source.at(t).rate_b)
    });
    sensors(&[plate])
}

/// Two plates' connectors are exchanged: all that is on one is read for the other.
fn plate_swap(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let one = plate(draw);
    let other = (one + 1 + draw.below(3)) % 4;
    scene.views.force_p.swap(one, other);
    scene.views.field_p_ut.swap(one, other);
    scene.views.rate.swap(one, other);
    scene.views.temperature_c.swap(one, other);
    scene.views.gyro_temperature_c.swap(one, other);
    sensors(&[one, other])
}

/// What moves with these plates.
fn sensors(plates: &[usize]) -> Vec<usize> {
    [SpecificForce, Field, Rate]
        .into_iter()
        .flat_map(|quantity| channels(quantity, plates))
        .collect()
}

fn gravity_value(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let more = strength * draw.sign() * 0.02;
    scene.claimed.gravity += more;
    // What is claimed is too much by this: the truth is less.
    scene.size("dg", -more);
    channels(SpecificForce, &ALL_PLATES)
}

/// The table stands askew: everything the record says is turned by a rotation fixed in n about a level axis.
fn table_tilt(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let way = draw.uniform(0.0, std::f64::consts::TAU);
    scene.magnitude.get_or_insert(0.005 * strength);
    let tilt = UnitQuaternion::from_scaled_axis(strength * 0.005 * Vector3::new(way.cos(), way.sin(), 0.0));
    let record = scene.record.clone();
    scene.record = Arc::new(move |t| {
        let (q_nb, place_n) = record(t);
        (tilt * q_nb, tilt * place_n)
    });
    moving()
}

/// The unit sits askew on what is measured: the record is turned by a rotation fixed in b.
fn mounting(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let askew = UnitQuaternion::from_scaled_axis(strength * 0.01 * draw.direction());
    scene.magnitude.get_or_insert(0.01 * strength);
    let record = scene.record.clone();
    scene.record = Arc::new(move |t| {
        let (q_nb, place_n) = record(t);
        (q_nb * askew, place_n)
    });
    moving()
}

/// The record is late.
fn reference_lag(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let delay_s = strength * draw.uniform(0.5, 1.5) * 0.01;
    scene.size("tau", delay_s);
    let record = scene.record.clone();
    scene.record = Arc::new(move |t| record(t - delay_s));
    moving()
}

/// The table turns about the vertical by more or less than its encoder says: rates are off by a factor, and so is the angle
/// that has been gone.
fn reference_rate_scale(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let gear = strength * draw.sign() * draw.uniform(0.5, 1.5) * 0.005;
    // What was told is too much by this: the truth is less.
    scene.size("s", -gear);
    let (record, motion) = (scene.record.clone(), scene.motion.clone());
    scene.record = Arc::new(move |t| {
        let (q_nb, place_n) = record(t);
        let more = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), gear * motion.heading_rad(t));
        (more * q_nb, place_n)
    });
    moving()
}

fn field_model(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let more_n = strength * 0.4 * draw.vector();
    scene.claimed.field_n_ut += more_n;
    for (name, value) in ["dn", "de", "dd"].into_iter().zip(more_n.iter()) {
        scene.size(name, -value);
    }
    channels(Field, &ALL_PLATES)
}

/// Everything the unit says is late, with a little jitter.
fn latency(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let delay_s = strength * draw.uniform(0.5, 1.5) * 0.01;
    scene.size("tau", delay_s);
    every_view_at(scene, move |t| t - delay_s);
    moving()
}

/// Sensors are read one after the other, later than the description says, each by the same step more.
fn read_skew(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let step_s = strength * draw.uniform(0.5, 1.5) * 0.002;
    scene.size("delta", step_s);
    for plate in ALL_PLATES {
        let late = |slot: usize| move |t: f64| t + step_s * slot as f64;
        scene.views.force_p[plate] = shifted(&scene.views.force_p[plate], late(plate));
        scene.views.field_p_ut[plate] = shifted(&scene.views.field_p_ut[plate], late(4 + plate));
        scene.views.rate[plate] = shifted(&scene.views.rate[plate], late(8 + plate));
    }
    moving()
}

fn clock_rate(scene: &mut Scene, draw: &mut Draw, strength: f64) -> Vec<usize> {
    let rate = 1.0 + strength * draw.sign() * draw.uniform(0.5, 1.5) * 1e-4;
    scene.size("e", rate - 1.0);
    every_view_at(scene, move |t| t * rate);
    moving()
}

/// The record turns one way about one axis where the unit turned the other.
fn reference_sign(scene: &mut Scene, draw: &mut Draw, _strength: f64) -> Vec<usize> {
    let axis = draw.below(3);
    let record = scene.record.clone();
    scene.record = Arc::new(move |t| {
        let (q_nb, place_n) = record(t);
        let mut vector = q_nb.into_inner();
        // The sign of one angle of a turn vector.
        vector.coords[axis] = -vector.coords[axis];
        (UnitQuaternion::from_quaternion(vector), place_n)
    });
    moving()
}

fn every_view_at(scene: &mut Scene, time: impl Fn(f64) -> f64 + Copy + Send + Sync + 'static) {
    for plate in ALL_PLATES {
        scene.views.force_p[plate] = shifted(&scene.views.force_p[plate], time);
        scene.views.field_p_ut[plate] = shifted(&scene.views.field_p_ut[plate], time);
        scene.views.rate[plate] = shifted(&scene.views.rate[plate], time);
    }
}
