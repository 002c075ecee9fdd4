//! Where a log was made, as far as the log and its reference tell.
//!
//! In: a log, the unit, and a reference on about the log's clock. Out: which way the reference's attitudes are to be read
//! ([`settled`]), gravity and field by the log's own sensors at them, and the environment of the case. The attitude is body to
//! navigation if specific force, turned by it, stands still in navigation; navigation's axes are those in which it points up and
//! the field north.
//!
//! Refused: forces and fields that are not of their unit, with the one they look like ([`check_units`]); attitudes at which
//! nothing points up; a gravity that no place on Earth has.

use gap::input::log::Log;
use nalgebra::{UnitQuaternion, Vector3};
use twin::{
    environment::Environment,
    predict::{Kind, UnitDescription},
};

use super::{
    clock,
    made::{MadeError, NewCaseArguments},
    reference::{Axes, Told},
};

/// [m/s2] what a place on Earth has, and the accelerometers may be off by.
const GRAVITY: std::ops::Range<f64> = 9.5..10.1;

/// Median of the norms of one kind's vectors, by plate or whole.
fn norm_of(log: &Log, unit: &UnitDescription, kind: Kind) -> Option<f64> {
    let mut norms: Vec<f64> = vectors(log, unit, kind)
        .into_iter()
        .map(|(_, vector)| vector.norm())
        .collect();
    norms.sort_by(f64::total_cmp);
    norms.get(norms.len() / 2).copied()
}

/// Vectors in b of one kind, row by row, by least squares.
fn vectors(log: &Log, unit: &UnitDescription, kind: Kind) -> Vec<(f64, Vector3<f64>)> {
    let mut only = unit.clone();
    for channel in &mut only.channels {
        // The least squares are those of the gyros.
        channel.sensor = if channel.sensor == kind {
            Kind::Gyro
        } else {
            Kind::Thermometer
        };
    }
    clock::rates(log, &only)
}

/// Physical values must be of their unit.
///
/// # Errors
/// When they are not.
pub fn check_units(log: &Log, unit: &UnitDescription, name: &str) -> Result<(), MadeError> {
    let guess = |value: f64, units: &[(&str, std::ops::Range<f64>)]| {
        units
            .iter()
            .find(|(_, range)| range.contains(&value))
            .map(|(unit, _)| (*unit).to_owned())
    };
    let wrong = |what: &str, value: f64, unit: &str, meant: Option<String>| {
        let meant = meant.map_or(String::new(), |meant| {
            format!("; it looks like {meant}: multiply the columns")
        });
        Err(MadeError::Wrong(format!(
            "{name}: {what} are {value:.3} {unit} on the median{meant}"
        )))
    };
    if let Some(force) = norm_of(log, unit, Kind::Accelerometer).filter(|force| !(5.0..20.0).contains(force)) {
        return wrong(
            "specific forces",
            force,
            "m/s2",
            guess(force, &[("g", 0.8..1.2), ("milli-g", 800.0..1200.0)]),
        );
    }
    if let Some(field) = norm_of(log, unit, Kind::Magnetometer).filter(|field| !(10.0..120.0).contains(field)) {
        return wrong(
            "fields",
            field,
            "uT",
            guess(
                field,
                &[
                    ("gauss", 0.15..0.8),
                    ("milligauss", 150.0..800.0),
                    ("nanotesla", 15_000.0..80_000.0),
                ],
            ),
        );
    }
    Ok(())
}

/// What the log says of the place.
pub struct Place {
    /// [m/s2]
    pub gravity: f64,
    /// \[uT\]
    pub field_n_ut: Vector3<f64>,
    /// \[uT\] of that mean.
    pub field_sigma_ut: f64,
}

/// Which way the reference is to be read, and the place by it.
///
/// # Errors
/// When nothing points up.
pub fn settled(
    told: &Told,
    log: &Log,
    unit: &UnitDescription,
    offset_s: f64,
    rates: &[(f64, Vector3<f64>)],
) -> Result<(Axes, bool, Place), MadeError> {
    let forces = vectors(log, unit, Kind::Accelerometer);
    let fields = vectors(log, unit, Kind::Magnetometer);
    let attitude = |t_s: f64| -> Option<UnitQuaternion<f64>> {
        let at = told.rows.partition_point(|row| row.t_s < t_s + offset_s);
        Some(told.rows.get(at)?.q)
    };
    let mean_n = |vectors: &[(f64, Vector3<f64>)], axes: Axes, is_inverse: bool| {
        let turned = vectors
            .iter()
            .filter_map(|(t_s, vector)| Some(Told::turned(attitude(*t_s)?, axes, is_inverse) * vector));
        let all: Vec<Vector3<f64>> = turned.collect();
        let mean = all.iter().sum::<Vector3<f64>>() / all.len().max(1) as f64;
        let spread = all.iter().map(|one| (one - mean).norm_squared()).sum::<f64>() / all.len().max(1) as f64;
        (mean, spread.sqrt())
    };
    // Which way it turns does not hang on the axes: the mean force is longest, and straight up, where it is read rightly.
    let rated = [false, true].map(|is_inverse| (mean_n(&forces, Axes::Ned, is_inverse).1, is_inverse));
    let is_inverse = if rated[1].0 < 0.7 * rated[0].0 && !rates.is_empty() {
        rated[1].1
    } else {
        rated[0].1
    };
    let found = Axes::ALL.into_iter().find(|axes| {
        let (force_n, _) = mean_n(&forces, *axes, is_inverse);
        // The mean force points up, which is -z in north, east, down.
        -force_n.z > 0.9 * force_n.norm()
    });
    let Some(mut axes) = found else {
        return Err(MadeError::Wrong(
            "the reference's attitudes do not turn the accelerometers' mean upright in any convention known (north-east-down, \
             east-north-up, north-west-up): are log and reference of one unit, mounted alike?"
                .into(),
        ));
    };
    let (force_n, _) = mean_n(&forces, axes, is_inverse);
    let (mut field_n_ut, mut field_sigma_ut) = mean_n(&fields, axes, is_inverse);
    // Of the two that count upwards, the one whose field points north: the other has it east.
    if axes == Axes::Enu && field_n_ut.x < field_n_ut.y.abs() {
        let (other, sigma) = mean_n(&fields, Axes::Nwu, is_inverse);
        if other.x > other.y.abs() {
            (axes, field_n_ut, field_sigma_ut) = (Axes::Nwu, other, sigma);
        }
    }
    Ok((
        axes,
        is_inverse,
        Place {
            gravity: force_n.norm(),
            field_n_ut,
            field_sigma_ut: (field_sigma_ut / (fields.len().max(1) as f64).sqrt()).max(0.1),
        },
    ))
}

/// The place as given, else as the log tells.
///
/// # Errors
/// When there is no such place.
pub fn environment(
    arguments: &NewCaseArguments,
    place: &Place,
    said: &mut Vec<String>,
) -> Result<Environment, MadeError> {
    let gravity = match arguments.gravity_m_s2 {
        Some(gravity) => gravity,
        None => {
            said.push(format!(
                "place      gravity {:.4} m/s2 by the accelerometers; give --gravity-m-s2 where it is known",
                place.gravity
            ));
            place.gravity
        }
    };
    if !GRAVITY.contains(&gravity) {
        return Err(MadeError::Wrong(format!(
            "gravity is {gravity:.3} m/s2, which no place on Earth has; give --gravity-m-s2, and look at the accelerometers' scale"
        )));
    }
    let field_n_ut = match arguments.field_n_ut.as_deref() {
        Some([n, e, d]) => Vector3::new(*n, *e, *d),
        _ => {
            let field = place.field_n_ut;
            said.push(format!(
                "           field {:.2}, {:.2}, {:.2} uT north, east, down by the magnetometers; give --field-n-ut where it is known",
                field.x, field.y, field.z
            ));
            field
        }
    };
    if arguments.latitude_deg.is_none() {
        said.push(
            "           latitude taken for 0: the Earth's rate is a fiftieth of a gyro's noise; give --latitude-deg"
                .to_owned(),
        );
    }
    Ok(Environment {
        gravity,
        latitude: arguments.latitude_deg.unwrap_or(0.0).to_radians(),
        field_n_ut,
        temperature_c: 25.0,
    })
}
