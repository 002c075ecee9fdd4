//! The unit as its designers believe it to be: unit.toml of a trial.
//!
//! In: sampling instants. Out: text after the case format. Axes, scales, ranges and bandwidths are the reference
//! design's; sigmas are those the plant draws its parts with, and those the trial draws calibration errors with.

use std::fmt::Write;

use nalgebra::Vector3;
use packets::channel::{CHANNELS, Channel, Quantity};
use twin::geometry;

use crate::flight::{CYCLE_S, Instants};

/// What is known about one kind of channel.
pub struct Kind {
    /// Its name in unit.toml.
    pub sensor: &'static str,
    /// White noise of a sample.
    pub noise: f64,
    /// How well the calibration knows bias, scale and axis (rad).
    pub bias: f64,
    /// Scale.
    pub scale: f64,
    /// Axis.
    pub axis_rad: f64,
    range: [f64; 2],
    bits: u32,
    bandwidth_hz: Option<f64>,
    /// \[s\] how well a sampling instant is known: the part converts by its own clock, so a reading's age is spread evenly over a
    /// period. Zero for thermometers, whose part the twin knows.
    pub instant_sigma_s: f64,
}

/// Facts about a kind of channel.
pub fn kind(quantity: Quantity) -> Kind {
    let kind = |sensor, [noise, bias, scale, axis_rad]: [f64; 4], range, bits, bandwidth_hz| Kind {
        sensor,
        noise,
        bias,
        scale,
        axis_rad,
        range,
        bits,
        bandwidth_hz,
        instant_sigma_s: match sensor {
            "accelerometer" => 1.0 / 50.0 / 12f64.sqrt(),
            "magnetometer" => 1.0 / 75.0 / 12f64.sqrt(),
            "gyro" => 1.0 / 256.0 / 12f64.sqrt(),
            _ => 0.0,
        },
    };
    match quantity {
        Quantity::SpecificForce => kind(
            "accelerometer",
            [0.045, 0.02, 0.001, 0.002],
            [-60.2, 60.2],
            12,
            Some(25.0),
        ),
        Quantity::Field => kind("magnetometer", [0.2, 0.1, 0.003, 0.003], [-188.0, 188.0], 12, None),
        Quantity::Rate => kind("gyro", [0.00344, 0.0015, 0.001, 0.002], [-5.585, 5.585], 14, Some(12.7)),
        Quantity::GyroTemperature => kind("thermometer", [0.12, 0.06, 0.001, 0.0], [-90.0, 100.0], 12, None),
        Quantity::Temperature => kind("thermometer", [0.05, 0.03, 0.0005, 0.0], [-55.0, 125.0], 12, None),
    }
}

/// Sensitive axis in b; `None` for a thermometer.
pub fn axis_b(channel: Channel) -> Option<Vector3<f64>> {
    match channel.quantity {
        Quantity::SpecificForce | Quantity::Field => {
            let axis = "xyz".find(channel.name.chars().last()?)?;
            Some(geometry::dcm_bp(channel.plate).column(axis).into_owned())
        }
        Quantity::Rate => Some(geometry::gyro_axis_b(channel.plate)),
        Quantity::GyroTemperature | Quantity::Temperature => None,
    }
}

/// The file, with sigmas of noise and of calibration declared so many times what they are.
pub fn toml(instants: &Instants, [noise, calibration]: [f64; 2]) -> String {
    let mut text = format!("name = \"e-MEMS on the host board\"\ncycle_s = {CYCLE_S}\n");
    // Writing to a string cannot fail.
    let mut put = |arguments: std::fmt::Arguments<'_>| {
        let _ = text.write_fmt(arguments);
    };
    for (channel, slot_s) in CHANNELS.into_iter().zip(instants.slots_s) {
        let facts = kind(channel.quantity);
        let (lsb, zero) = channel.quantity.scale();
        put(format_args!(
            "\n[[channel]]\nname = \"{}\"\nsensor = \"{}\"\ngroup = \"plate {}\"\nlsb = {lsb}\nbias = {:.1}\n",
            channel.name,
            facts.sensor,
            channel.plate + 1,
            0.0 - zero
        ));
        if let Some(axis) = axis_b(channel) {
            put(format_args!("axis_b = [{:.9}, {:.9}, {:.9}]\n", axis.x, axis.y, axis.z));
        }
        put(format_args!(
            "noise_sigma = {}\nbias_sigma = {}\nscale_sigma = {}\naxis_sigma_rad = {}\n",
            noise * facts.noise,
            calibration * facts.bias,
            calibration * facts.scale,
            calibration * facts.axis_rad
        ));
        let [least, most] = facts.range;
        put(format_args!(
            "range = [{least}, {most}]\nbits = {}\nslot_s = {slot_s:.6}\n",
            facts.bits
        ));
        if facts.instant_sigma_s > 0.0 {
            put(format_args!("instant_sigma_s = {:.6}\n", facts.instant_sigma_s));
        }
        if let Some(bandwidth_hz) = facts.bandwidth_hz {
            put(format_args!("bandwidth_hz = {bandwidth_hz}\n"));
        }
        if channel.quantity == Quantity::SpecificForce {
            let place = geometry::accelerometer_place_b(channel.plate);
            put(format_args!(
                "lever_m = [{:.9}, {:.9}, {:.9}]\n",
                place.x, place.y, place.z
            ));
        }
    }
    text
}
