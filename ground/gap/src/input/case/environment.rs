//! Where a case was, as far as the unit's sensors need to know.
//!
//! In: the case's `[environment]` and the unit. Out: an [`Environment`]. Refuses, naming the key: what a sensor needs and is not
//! given, and what is given in another unit.

use nalgebra::Vector3;
use twin::{
    environment::Environment,
    predict::{Kind, UnitDescription},
};

use super::{CaseError, Opened};

/// Of an opened case.
///
/// # Errors
/// When a sensor needs what is not given, or it is given in another unit.
pub fn environment(opened: &Opened, unit: &UnitDescription) -> Result<Environment, CaseError> {
    let given = &opened.text.environment;
    let needs = |kind: Kind| unit.channels.iter().any(|channel| channel.sensor == kind);
    let absent = |key: &str, sensors: &str| {
        CaseError::key(
            &opened.file,
            format!("environment.{key}"),
            format!("is absent; the unit's {sensors} need it"),
        )
    };
    let gravity = given.gravity_m_s2.or((!needs(Kind::Accelerometer)).then_some(0.0));
    let latitude_deg = given.latitude_deg.or((!needs(Kind::Gyro)).then_some(0.0));
    let field_n_ut = given.field_n_ut.or((!needs(Kind::Magnetometer)).then_some([0.0; 3]));
    let environment = Environment {
        gravity: gravity.ok_or_else(|| absent("gravity_m_s2", "accelerometers"))?,
        latitude: latitude_deg
            .ok_or_else(|| absent("latitude_deg", "gyros"))?
            .to_radians(),
        field_n_ut: Vector3::from(field_n_ut.ok_or_else(|| absent("field_n_ut", "magnetometers"))?),
        temperature_c: given.temperature_c.unwrap_or(25.0),
    };
    let checks = [
        (
            "gravity_m_s2",
            (0.0..100.0).contains(&environment.gravity),
            "must be in m/s2, 0 to 100",
        ),
        (
            "latitude_deg",
            environment.latitude.abs() <= std::f64::consts::FRAC_PI_2,
            "must be in degrees, -90 to 90",
        ),
        (
            "field_n_ut",
            environment.field_n_ut.norm() < 1000.0,
            "must be in microtesla, below 1000",
        ),
        (
            "temperature_c",
            (-100.0..200.0).contains(&environment.temperature_c),
            "must be in degrees Celsius, -100 to 200",
        ),
        (
            "field_sigma_ut",
            (0.0..1000.0).contains(&given.field_sigma_ut),
            "must be in microtesla, 0 or more",
        ),
    ];
    match checks.iter().find(|(_, holds, _)| !holds) {
        Some((key, _, problem)) => Err(CaseError::key(&opened.file, format!("environment.{key}"), *problem)),
        None => Ok(environment),
    }
}
