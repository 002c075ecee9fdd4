//! The unit as its designers believe it to be: `unit.toml`, channel by channel.
//!
//! In: the text of a `unit.toml` (format: the gap case). Out: [`UnitDescription`]. A channel's measured value is
//! `axis_b . truth + bias + noise`, rounded to `lsb` and clipped to `range`. An `[[effect]]` names an entry of the effect
//! library that the unit is known to have, with its parameters: so a twin that was taught an effect is again a `unit.toml`.
//!
//! Refuses, naming file and key: what is no TOML, a missing or unknown key, a value of the wrong type, an axis that is no
//! direction, a sigma or step that is negative or not finite, a range that is empty, a name used twice.

#[cfg(test)]
mod tests;

use std::{io, path::Path};

use nalgebra::{Unit, Vector3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::keys::meant;

/// What a channel measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Specific force [m/s2].
    Accelerometer,
    /// Inertial rate [rad/s].
    Gyro,
    /// Magnetic field \[uT\].
    Magnetometer,
    /// Temperature \[degC\].
    Thermometer,
}

impl Kind {
    /// As people write several of them.
    pub const fn plural(self) -> &'static str {
        match self {
            Self::Accelerometer => "accelerometers",
            Self::Gyro => "gyros",
            Self::Magnetometer => "magnetometers",
            Self::Thermometer => "thermometers",
        }
    }

    /// The physical unit of its readings.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Accelerometer => "m/s2",
            Self::Gyro => "rad/s",
            Self::Magnetometer => "uT",
            Self::Thermometer => "degC",
        }
    }
}

/// One logged channel.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Unique.
    pub name: String,
    /// What it measures.
    pub sensor: Kind,
    /// What shares a board, a chip or a bus.
    pub group: String,
    /// Sensitive axis in b, a direction; zero for thermometers.
    #[serde(default)]
    pub axis_b: Vector3<f64>,
    /// [physical unit per count]
    pub lsb: f64,
    /// [physical unit]
    #[serde(default)]
    pub bias: f64,
    /// [physical unit] white, per logged sample.
    pub noise_sigma: f64,
    /// [physical unit/sqrt(s)] random walk of the bias.
    #[serde(default)]
    pub drift_sigma: f64,
    /// [physical unit] how well the calibration knew the bias.
    #[serde(default)]
    pub bias_sigma: f64,
    /// \[1\] how well it knew the scale.
    #[serde(default)]
    pub scale_sigma: f64,
    /// \[rad\] how well it knew the axis, about each of the two directions across it.
    #[serde(default)]
    pub axis_sigma_rad: f64,
    /// [physical unit] beyond it the channel clips.
    #[serde(default = "unbounded")]
    pub range: [f64; 2],
    /// Width of the two's complement count; `None` for no rounding.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bits: Option<u32>,
    /// \[Hz\] corner of the sensor's first-order low-pass; `None` for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bandwidth_hz: Option<f64>,
    /// \[s\] sampling instant after the start of the cycle.
    #[serde(default)]
    pub slot_s: f64,
    /// \[s\] how well that instant is known; `None` for as well as the part's data sheet lets anyone know it. A part that
    /// converts by its own clock gives a reading of unknown age, and the ages of two clocks drift.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instant_sigma_s: Option<f64>,
    /// \[m\] place in b from the centre of rotation; accelerometers only.
    #[serde(default)]
    pub lever_m: Vector3<f64>,
}

fn unbounded() -> [f64; 2] {
    [f64::MIN, f64::MAX]
}

impl Channel {
    /// \[s\] time constant of its low-pass; 0 for none.
    pub fn tau_s(&self) -> f64 {
        self.bandwidth_hz
            .map_or(0.0, |corner_hz| 1.0 / (core::f64::consts::TAU * corner_hz))
    }

    /// [physical unit] standard deviation of a logged sample: white noise and the rounding of the count, q^2/12.
    pub fn sigma(&self) -> f64 {
        let rounding = if self.bits.is_some() {
            self.lsb.powi(2) / 12.0
        } else {
            0.0
        };
        (self.noise_sigma.powi(2) + rounding).sqrt()
    }

    /// Two directions across the axis, orthogonal to it and to each other. The first is as level as can be, so that
    /// neighbouring channels get neighbouring directions.
    pub fn across(&self) -> [Vector3<f64>; 2] {
        let level = if self.axis_b.z.abs() < 0.9 {
            Vector3::z()
        } else {
            Vector3::x()
        };
        let first = self.axis_b.cross(&level).normalize();
        [first, self.axis_b.cross(&first)]
    }

    /// The code \[counts\] the channel logs for a physical value; the value itself where it does not round.
    pub fn logged(&self, value: f64) -> f64 {
        let clipped = value.clamp(self.range[0], self.range[1]);
        match self.bits {
            Some(_) => (clipped / self.lsb).round() * self.lsb,
            None => clipped,
        }
    }
}

/// An effect of the library that the unit is known to have.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct KnownEffect {
    /// Name in the library.
    pub effect: String,
    /// Where: `all`, `common`, a group or a channel.
    pub locality: String,
    /// The value on the effect's grid, for effects that have one.
    #[serde(default)]
    pub variant: f64,
    /// Its parameters, in the order of the library.
    pub theta: Vec<f64>,
}

/// The nominal unit.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct UnitDescription {
    /// Its name.
    pub name: String,
    /// \[s\] one packet each cycle; `None` for a log without packets.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cycle_s: Option<f64>,
    /// Channels, in the order of the file.
    #[serde(rename = "channel")]
    pub channels: Vec<Channel>,
    /// Effects it is known to have.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<KnownEffect>,
}

/// A `unit.toml` that cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum UnitError {
    /// The operating system refuses it.
    #[error("{file}: cannot be read ({reason}); check its path and permissions")]
    Unreadable {
        /// The file.
        file: String,
        /// As the system puts it.
        reason: String,
    },
    /// Not what the format has.
    #[error("{file}: {reason}")]
    Format {
        /// The file.
        file: String,
        /// Line, column and key, as the parser tells them.
        reason: String,
    },
    /// A value that cannot be.
    #[error("{file}: channel {channel}: {key} {complaint}")]
    Value {
        /// The file.
        file: String,
        /// Name of the channel.
        channel: String,
        /// The key.
        key: &'static str,
        /// What is wrong with its value, and what it must be.
        complaint: &'static str,
    },
    /// Nothing to predict.
    #[error("{file}: has no [[channel]]; describe at least one")]
    NoChannel {
        /// The file.
        file: String,
    },
}

/// \[bytes\] largest file that is read: 40 channels are 10 kB. A device such as `/dev/zero` has no end.
const LARGEST: u64 = 16 << 20;

/// How far from one the length of an axis may be: three decimals.
const AXIS_ROUNDING: f64 = 2e-3;

impl UnitDescription {
    /// \[m\] place of a channel's sensor in b: that of the accelerometer in its group, for only these are described, or its own where there is none.
    pub fn place_b(&self, channel: &Channel) -> Vector3<f64> {
        let is_beside = |other: &&Channel| other.group == channel.group && other.sensor == Kind::Accelerometer;
        self.channels.iter().find(is_beside).unwrap_or(channel).lever_m
    }

    /// Reads a file.
    pub fn open(path: &Path) -> Result<Self, UnitError> {
        let file = path.display().to_string();
        let text = packed::read(path, LARGEST).and_then(|bytes| String::from_utf8(bytes).map_err(io::Error::other));
        match text {
            Ok(text) => Self::read(&text, &file),
            Err(error) => Err(UnitError::Unreadable {
                file,
                reason: error.to_string(),
            }),
        }
    }

    /// Reads the text of a file of that name.
    pub fn read(text: &str, file: &str) -> Result<Self, UnitError> {
        let mut unit: UnitDescription = toml::from_str(text).map_err(|error| UnitError::Format {
            file: file.to_owned(),
            reason: meant(error.to_string().trim_end()),
        })?;
        if unit.channels.is_empty() {
            return Err(UnitError::NoChannel { file: file.to_owned() });
        }
        if unit
            .cycle_s
            .is_some_and(|cycle_s| !(cycle_s > 0.0 && cycle_s.is_finite()))
        {
            return Err(UnitError::Format {
                file: file.to_owned(),
                reason: "cycle_s must be above zero".to_owned(),
            });
        }
        for i in 0..unit.channels.len() {
            let repeated = unit.channels[..i]
                .iter()
                .any(|before| before.name == unit.channels[i].name);
            let fault = match repeated {
                true => Some(("name", "is used twice; give every channel its own")),
                false => fault_of(&unit.channels[i]),
            };
            if let Some((key, complaint)) = fault {
                return Err(UnitError::Value {
                    file: file.to_owned(),
                    channel: unit.channels[i].name.clone(),
                    key,
                    complaint,
                });
            }
            if unit.channels[i].sensor != Kind::Thermometer {
                // Nine printed decimals leave the axis a billionth short.
                unit.channels[i].axis_b = Unit::new_normalize(unit.channels[i].axis_b).into_inner();
            }
        }
        Ok(unit)
    }

    /// The text of its `unit.toml`.
    pub fn text(&self) -> String {
        // Strings, numbers and tables only: there is nothing in it that TOML cannot write.
        toml::to_string(self).unwrap_or_default()
    }

    /// Index of the channel of that name.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|channel| channel.name == name)
    }

    /// The groups, in the order in which the file first names them.
    pub fn groups(&self) -> Vec<&str> {
        let mut groups: Vec<&str> = Vec::new();
        for channel in &self.channels {
            if !groups.contains(&channel.group.as_str()) {
                groups.push(&channel.group);
            }
        }
        groups
    }
}

/// The key that cannot be, and why.
fn fault_of(channel: &Channel) -> Option<(&'static str, &'static str)> {
    const SPREAD: &str = "must be finite and not below zero";
    let spread = [
        ("noise_sigma", channel.noise_sigma),
        ("drift_sigma", channel.drift_sigma),
        ("bias_sigma", channel.bias_sigma),
        ("scale_sigma", channel.scale_sigma),
        ("axis_sigma_rad", channel.axis_sigma_rad),
        ("instant_sigma_s", channel.instant_sigma_s.unwrap_or(0.0)),
    ];
    if let Some((key, _)) = spread
        .into_iter()
        .find(|(_, sigma)| !(*sigma >= 0.0 && sigma.is_finite()))
    {
        return Some((key, SPREAD));
    }
    let is_direction = (channel.axis_b.norm() - 1.0).abs() < AXIS_ROUNDING;
    let corner_hz = channel.bandwidth_hz.unwrap_or(1.0);
    [
        (
            channel.noise_sigma > 0.0 || channel.bits.is_some(),
            "noise_sigma",
            "must be above zero where nothing is rounded",
        ),
        (
            channel.sensor == Kind::Thermometer || is_direction,
            "axis_b",
            "must have length one",
        ),
        (
            channel.lsb > 0.0 && channel.lsb.is_finite(),
            "lsb",
            "must be finite and above zero",
        ),
        (channel.bias.is_finite(), "bias", "must be finite"),
        (channel.range[0] < channel.range[1], "range", "must be [least, most]"),
        (
            channel.bits.is_none_or(|bits| (1..=64).contains(&bits)),
            "bits",
            "must be 1 to 64",
        ),
        (
            corner_hz > 0.0 && corner_hz.is_finite(),
            "bandwidth_hz",
            "must be finite and above zero; omit it for none",
        ),
        (channel.slot_s.is_finite(), "slot_s", "must be finite"),
        (
            channel.lever_m.iter().all(|metres| metres.is_finite()),
            "lever_m",
            "must be finite",
        ),
    ]
    .into_iter()
    .find_map(|(holds, key, complaint)| (!holds).then_some((key, complaint)))
}
