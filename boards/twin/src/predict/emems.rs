//! The e-MEMS unit as a description: what a `unit.toml` of a unit with nominal parts says.
//!
//! Geometry as the plant has it; noise and biases as the plant draws them; sixteen reads 7.425 ms apart (thesis 002:
//! 118.8 ms a cycle), or at any other slots.

use core::f64::consts::PI;

use emems::{
    sample::{Kind as Part, SENSORS},
    sensor::{
        adis16265::{self, Range, SampleRate},
        hmc5883l::{self, GAUSS_UT, Gain},
        lis331hh::{self, CODES, FullScale, STANDARD_GRAVITY_F64},
        tmp102,
    },
};
use nalgebra::Vector3;

use crate::channel::{Channel, Kind, UnitDescription};
use crate::geometry;

/// \[s\] between two reads: 118.8 ms over sixteen.
const READ_S: f64 = 7.425e-3;
/// [m/s2] of one count of the LIS331HH at 6 g.
const DIGIT: f64 = FullScale::G6.mg_per_count() as f64 * 1e-3 * STANDARD_GRAVITY_F64;
/// \[s\] a cycle.
const CYCLE_S: f64 = 0.2;

/// Nominal unit, each sensor read at its slot \[s\] after the start of the cycle, in reading order.
pub fn emems(slot_s: impl Fn(usize) -> f64) -> UnitDescription {
    let mut channels: Vec<Channel> = Vec::new();
    for (slot, sensor) in SENSORS.into_iter().enumerate() {
        let slot_s = slot_s(slot);
        let dcm_bp = geometry::dcm_bp(sensor.plate);
        let number = sensor.plate + 1;
        let blank = Channel {
            name: String::new(),
            group: format!("plate {number}"),
            slot_s,
            ..thermometer()
        };
        let axes = || ["x", "y", "z"].into_iter().enumerate();
        match sensor.kind {
            Part::Accelerometer => channels.extend(axes().map(|(axis, letter)| Channel {
                name: format!("a{number}{letter}"),
                axis_b: dcm_bp.column(axis).into_owned(),
                lever_m: geometry::accelerometer_place_b(sensor.plate),
                ..accelerometer(&blank)
            })),
            Part::Magnetometer => channels.extend(axes().map(|(axis, letter)| Channel {
                name: format!("m{number}{letter}"),
                axis_b: dcm_bp.column(axis).into_owned(),
                ..magnetometer(&blank)
            })),
            Part::Gyro => channels.push(Channel {
                name: format!("g{number}"),
                axis_b: geometry::gyro_axis_b(sensor.plate),
                ..gyro(&blank)
            }),
            Part::Thermometer => channels.push(Channel {
                name: format!("t{number}"),
                ..blank
            }),
        }
    }
    // The gyros' own thermometers are read with them; packets have them after the gyros.
    let gyros: Vec<Channel> = channels
        .iter()
        .filter(|channel| channel.sensor == Kind::Gyro)
        .cloned()
        .collect();
    let first = channels
        .iter()
        .position(|channel| channel.sensor == Kind::Thermometer)
        .unwrap_or(channels.len());
    let inside = gyros.into_iter().map(|gyro| Channel {
        name: format!("t{}", gyro.name),
        group: gyro.group,
        slot_s: gyro.slot_s,
        lsb: adis16265::CELSIUS_PER_COUNT_F64,
        bias: -f64::from(adis16265::ZERO_C),
        noise_sigma: 0.12,
        bias_sigma: 0.06,
        scale_sigma: 1e-3,
        range: [-90.0, 100.0],
        ..thermometer()
    });
    channels.splice(first..first, inside);
    UnitDescription {
        name: "e-MEMS".to_owned(),
        cycle_s: Some(CYCLE_S),
        channels,
        effects: Vec::new(),
    }
}

/// \[s\] between conversions of a part by its own clock, as the unit configures it. A reading is half of it old on the average.
pub fn conversion_s(kind: Kind) -> f64 {
    match kind {
        Kind::Accelerometer => 1.0 / f64::from(lis331hh::Rate::Hz50.hz()),
        Kind::Magnetometer => 1.0 / f64::from(hmc5883l::Rate::Hz75.hz()),
        Kind::Gyro => 1.0 / f64::from(SampleRate::Hz256.hz()),
        Kind::Thermometer => 1.0 / f64::from(tmp102::Rate::Hz8.hz()),
    }
}

/// The slots of the thesis' read cycle.
pub fn thesis_slot_s(slot: usize) -> f64 {
    slot as f64 * READ_S
}

fn thermometer() -> Channel {
    Channel {
        name: String::new(),
        sensor: Kind::Thermometer,
        group: String::new(),
        axis_b: Vector3::zeros(),
        lsb: tmp102::CELSIUS_PER_COUNT.into(),
        bias: 0.0,
        noise_sigma: 0.05,
        drift_sigma: 0.0,
        bias_sigma: 0.03,
        scale_sigma: 5e-4,
        axis_sigma_rad: 0.0,
        range: [-55.0, 125.0],
        bits: Some(12),
        bandwidth_hz: None,
        slot_s: 0.0,
        instant_sigma_s: None,
        lever_m: Vector3::zeros(),
    }
}

fn accelerometer(blank: &Channel) -> Channel {
    Channel {
        sensor: Kind::Accelerometer,
        lsb: DIGIT,
        noise_sigma: 0.045,
        drift_sigma: 2e-4,
        bias_sigma: 0.02,
        scale_sigma: 1e-3,
        axis_sigma_rad: 2e-3,
        // The data sheet says 6 g; the code goes a little further.
        range: [f64::from(*CODES.start()) * DIGIT, f64::from(*CODES.end()) * DIGIT],
        bandwidth_hz: Some(25.0),
        ..blank.clone()
    }
}

fn magnetometer(blank: &Channel) -> Channel {
    Channel {
        sensor: Kind::Magnetometer,
        lsb: f64::from(GAUSS_UT) / f64::from(Gain::PerGauss1090.counts_per_gauss()),
        noise_sigma: 0.2,
        drift_sigma: 5e-4,
        bias_sigma: 0.1,
        scale_sigma: 3e-3,
        axis_sigma_rad: 3e-3,
        range: [-130.0, 130.0],
        ..blank.clone()
    }
}

fn gyro(blank: &Channel) -> Channel {
    Channel {
        sensor: Kind::Gyro,
        lsb: Range::DegPerS320.deg_s_per_count_f64() * PI / 180.0,
        noise_sigma: 0.00344,
        drift_sigma: 1.5e-5,
        bias_sigma: 1.5e-3,
        scale_sigma: 1e-3,
        axis_sigma_rad: 2e-3,
        range: [-320.0 * PI / 180.0, 320.0 * PI / 180.0],
        bits: Some(14),
        bandwidth_hz: Some(12.7),
        ..blank.clone()
    }
}
