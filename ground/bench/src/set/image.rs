//! The calibration set as the unit carries it: 28 axes in single precision.
//!
//! In: a [`Set`], the unit's sensor ranges. Out: an [`emems::calibration::Set`] that the unit itself accepts, to be sent,
//! stored or compiled in, and the names of the axes nobody calibrated, which keep their nominal parameters.
//!
//! The set says `counts = (1 + c1 t + ..) S . x + b0 + b1 t + b2 t^2` with `t` above each channel's own reference, the unit
//! `x = scale (1 + k dT) (counts - bias(dT))` with `dT` above one reference, the middle of the temperatures all channels
//! hold at. The bias is moved there exactly. `k` is the chord of `1 / |S|` over these temperatures; where the curve leaves
//! it by more than [`MOST_BEND`] the set is refused.
//!
//! Noise is the nominal unit's: the scatter of rows that are means of many samples is no noise of one. An ellipsoid sees
//! no rotation of its triad, so the uncertainty of its directions is never below nominal, nor is that of a kind of which
//! some axes are nominal.
//!
//! Refused: channels the unit does not have, a bias beyond the square of temperature, temperatures without a common
//! range, two methods for one kind, and whatever the unit refuses ([`emems::calibration::Refusal`]).

use emems::{
    calibration::{self as unit, Axis, CHANNELS, Channel, Method, Ranges, Uncertainty},
    sample::Kind,
};
use nalgebra::Vector3;

use super::{Entry, Set};

/// Relative. A tenth of what separates the nominal scales from the thesis' calibrated ones (1 to 4 %, Eq 4.40).
pub const MOST_BEND: f64 = 1e-3;

/// A unit's set and what of it is nominal.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The set.
    pub set: unit::Set,
    /// Names of the channels with nominal parameters.
    pub nominal: Vec<String>,
}

/// Why a set does not fit the unit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// A channel the unit does not have.
    #[error("the unit has no channel {0}: its are a1x to a4z, m1x to m4z, g1 to g4")]
    Unknown(String),
    /// A channel that is another sensor's.
    #[error("channel {0} is no {1}")]
    OtherSensor(String, String),
    /// A polynomial of a degree the unit has not.
    #[error("channel {0}: its bias has degree {1}, the unit's 2: calibrate with --bias-order 2")]
    Degree(String, usize),
    /// A scale that is no straight line over temperature.
    #[error(
        "channel {channel}: its scale leaves a straight line by {percent:.2} % between {low:.0} and {high:.0} degC: calibrate over less"
    )]
    Bend {
        /// The channel.
        channel: String,
        /// Largest relative deviation \[%\].
        percent: f64,
        /// From \[degC\].
        low: f64,
        /// To \[degC\].
        high: f64,
    },
    /// No temperature all channels hold at.
    #[error("no temperature is within the range of every channel; {0} holds from {1:.1} to {2:.1} degC")]
    Temperatures(String, f64, f64),
    /// Two methods for one kind of sensor.
    #[error("channel {0} comes from another method than the other channels of its kind: the unit keeps one a kind")]
    Methods(String),
    /// The unit would refuse it.
    #[error("the unit refuses it: {0}")]
    Refused(unit::Refusal),
}

/// The unit's name of an axis: `a1x` to `a4z`, `m1x` to `m4z`, `g1` to `g4`.
pub fn name(channel: Channel) -> String {
    let plate = channel.plate() + 1;
    let axis = ["x", "y", "z"][usize::from(channel.0) % 3];
    match channel.kind() {
        Kind::Accelerometer => format!("a{plate}{axis}"),
        Kind::Magnetometer => format!("m{plate}{axis}"),
        Kind::Gyro | Kind::Thermometer => format!("g{plate}"),
    }
}

/// As the unit carries it; its serial number and the set's own come from the set.
///
/// # Errors
/// When the set does not fit the unit, or the unit would refuse it.
pub fn image(set: &Set, ranges: Ranges) -> Result<Image, ImageError> {
    let mut image = unit::Set::nominal(ranges);
    image.identity.unit = set.serial;
    image.identity.set = set.number;
    let channels: Vec<Channel> = (0..CHANNELS as u8).map(Channel).collect();
    if let Some(entry) = set
        .channels
        .iter()
        .find(|e| !channels.iter().any(|c| name(*c) == e.name))
    {
        return Err(ImageError::Unknown(entry.name.clone()));
    }
    let (low_c, high_c) = common_range(set)?;
    if low_c > f64::NEG_INFINITY {
        (image.lowest_c, image.highest_c) = (low_c as f32, high_c as f32);
        image.reference_c = ((low_c + high_c) / 2.0) as f32;
    }
    let at_c = f64::from(image.reference_c);
    let mut nominal = Vec::new();
    for (kind, sensor) in [
        (Kind::Accelerometer, "accelerometer"),
        (Kind::Magnetometer, "magnetometer"),
        (Kind::Gyro, "gyro"),
    ] {
        let mut calibrated = Vec::new();
        let own = channels.iter().filter(|channel| channel.kind() == kind);
        for (k, channel) in own.enumerate() {
            let name = name(*channel);
            let Some(entry) = set.channels.iter().find(|entry| entry.name == name) else {
                nominal.push(name);
                continue;
            };
            if entry.sensor != sensor {
                return Err(ImageError::OtherSensor(name, sensor.into()));
            }
            let slot = axis_mut(&mut image, kind, k);
            *slot = axis(entry, at_c, slot.noise)?;
            calibrated.push(entry);
        }
        let Some(first) = calibrated.first() else { continue };
        if let Some(other) = calibrated.iter().find(|entry| entry.method != first.method) {
            return Err(ImageError::Methods(other.name.clone()));
        }
        let whole = calibrated.len() == image.axes(kind).len();
        let n = kind as usize;
        image.identity.methods[n] = if first.method == "ellipsoid" {
            Method::MvSec
        } else {
            Method::LmsEc
        };
        image.uncertainty[n] = uncertainty(&calibrated, whole, image.uncertainty[n]);
    }
    image.check().map_err(ImageError::Refused)?;
    Ok(Image { set: image, nominal })
}

fn axis_mut(set: &mut unit::Set, kind: Kind, k: usize) -> &mut Axis {
    match kind {
        Kind::Accelerometer => &mut set.acc[k],
        Kind::Magnetometer => &mut set.mag[k],
        Kind::Gyro | Kind::Thermometer => &mut set.gyro[k],
    }
}

/// Temperatures every channel holds at; infinite where nobody measured any.
fn common_range(set: &Set) -> Result<(f64, f64), ImageError> {
    let mut common = (f64::NEG_INFINITY, f64::INFINITY);
    for entry in &set.channels {
        let Some([low, high]) = entry.valid_c else { continue };
        common = (common.0.max(low), common.1.min(high));
        if common.0 >= common.1 {
            return Err(ImageError::Temperatures(entry.name.clone(), low, high));
        }
    }
    Ok(common)
}

/// One axis about another reference temperature.
fn axis(entry: &Entry, at_c: f64, noise: f32) -> Result<Axis, ImageError> {
    let bias = &entry.bias_counts;
    if bias.iter().skip(3).any(|c| *c != 0.0) {
        return Err(ImageError::Degree(entry.name.clone(), bias.len() - 1));
    }
    // Taylor: b(t0 + dT) with t0 the new reference above the old.
    let t0 = entry.reference_c.map_or(0.0, |reference_c| at_c - reference_c);
    let [b0, b1, b2] = std::array::from_fn(|k| bias.get(k).copied().unwrap_or(0.0));
    let growth = |t: f64| 1.0 + t * entry.scale_per_k.iter().rev().fold(0.0, |sum, c| sum * t + c);
    // Value of a count, relative to that at the new reference.
    let worth = |above: f64| growth(t0) / growth(t0 + above);
    let mut scale_per_c = 0.0;
    if let Some([low, high]) = entry.valid_c {
        scale_per_c = (worth(high - at_c) - worth(low - at_c)) / (high - low);
        let bend = |step: u32| {
            let above = low + (high - low) * f64::from(step) / 16.0 - at_c;
            (worth(above) - 1.0 - scale_per_c * above).abs()
        };
        let most = (0..=16).map(bend).fold(0.0, f64::max);
        // Not the contrary comparison: a scale that vanishes in between gives no number.
        let straight = most <= MOST_BEND;
        if !straight {
            return Err(ImageError::Bend {
                channel: entry.name.clone(),
                percent: 100.0 * most,
                low,
                high,
            });
        }
    }
    let sensitivity_b: Vector3<f64> = entry.sensitivity() * growth(t0);
    let mut axis = Axis::from_sensitivity(
        sensitivity_b.map(|c| c as f32),
        (b0 + t0 * (b1 + t0 * b2)) as f32,
        noise,
    );
    axis.bias_per_c = (b1 + 2.0 * t0 * b2) as f32;
    axis.bias_per_c2 = b2 as f32;
    axis.scale_per_c = scale_per_c as f32;
    Ok(axis)
}

/// Root mean square of the channels' own, over their own scales.
fn uncertainty(entries: &[&Entry], whole: bool, nominal: Uncertainty) -> Uncertainty {
    let mean = |of: &dyn Fn(&Entry) -> f64| {
        let sum: f64 = entries
            .iter()
            .map(|entry| of(entry) / entry.sensitivity().norm_squared())
            .sum();
        (sum / entries.len() as f64).max(0.0).sqrt() as f32
    };
    let along = |entry: &Entry| {
        let axis_b = entry.sensitivity().normalize();
        axis_b.dot(&(entry.covariance().fixed_view::<3, 3>(0, 0) * axis_b))
    };
    let across = |entry: &Entry| (entry.covariance().fixed_view::<3, 3>(0, 0).trace() - along(entry)).max(0.0) / 2.0;
    let found = Uncertainty {
        bias: mean(&|entry| entry.covariance()[(3, 3)]),
        scale: mean(&along),
        direction: mean(&across),
    };
    let seen = whole && entries.iter().all(|entry| entry.method != "ellipsoid");
    let direction = if seen {
        found.direction
    } else {
        found.direction.max(nominal.direction)
    };
    if whole {
        return Uncertainty { direction, ..found };
    }
    Uncertainty {
        bias: found.bias.max(nominal.bias),
        scale: found.scale.max(nominal.scale),
        direction,
    }
}

#[cfg(test)]
mod tests;
