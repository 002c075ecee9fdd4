//! Whether a parameter set can be used, and if not, why.
//!
//! In: a [`Set`]. Out: nothing, or the [`Refusal`]. The limits are wide: they are there for corrupt, mistaken and
//! exchanged sets, not for poor ones. Condition numbers are in the Frobenius norm, `|A| |A^-1|`, 3 for a rotation; above
//! [`MOST_CONDITION`] noise is a thousand times larger in the vector than in the axes.

use core::fmt;

use nalgebra::{ComplexField, Matrix3, Vector3};

use super::{Axis, Channel, Set};
use crate::{
    geometry::{PLATES, gyro_axis_b, triad_axes_b},
    sample::{Kind, Sensor},
};

/// A sensor (or three gyros) above this spans no space.
const MOST_CONDITION: f32 = 1e3;
/// cos 10 deg. The thesis' worst axis is 1.3 deg off; exchanged, swapped and reversed axes are 53 deg off at least.
const LEAST_COSINE: f32 = 0.984_8;
/// A scale outside half to twice the datasheet's is in another unit or of another range.
const SCALES: core::ops::RangeInclusive<f32> = 0.5..=2.0;
/// \[counts\] half the codes of a 12-bit part: what is left is no range.
const MOST_BIAS_COUNTS: f32 = 1024.0;
/// \[counts\] noise beyond this is not that of a working part.
const MOST_NOISE_COUNTS: f32 = 200.0;
/// \[degC\] what the parts survive.
const TEMPERATURES: core::ops::RangeInclusive<f32> = -60.0..=130.0;
/// \[m\] a place farther from the centre than this is not on the unit.
const MOST_PLACE: f32 = 0.5;
/// How far from 1 the length of an axis may be.
const UNIT_LENGTH: f32 = 1e-3;

/// Why a parameter set is not used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// The bytes are not as many as a set has.
    Length(usize),
    /// They do not begin as a set does.
    NotASet,
    /// A version this unit does not know.
    Version(u16),
    /// The checksum does not fit.
    Checksum {
        /// Written.
        written: u32,
        /// Of the bytes as they are.
        computed: u32,
    },
    /// A code for a method or a range that does not exist, at this byte.
    Code(usize),
    /// It belongs to other sensor ranges than the unit's.
    OtherRanges,
    /// It belongs to another unit.
    OtherUnit {
        /// Serial number in the set.
        found: u32,
        /// Serial number of this unit.
        expected: u32,
    },
    /// A number that is not finite, of an axis or (`None`) of the set.
    NotFinite(Option<Channel>),
    /// The temperatures are not in order or beyond what the parts survive.
    Temperatures,
    /// A negative or absurd uncertainty, or a place not on the unit.
    Uncertainty,
    /// A sense axis whose length is not 1.
    NotUnit(Channel),
    /// The axes of a sensor, or three gyros, do not span space: with its condition number.
    IllConditioned(Sensor, f32),
    /// A sense axis more than 10 deg from where it is built in: exchanged plates or axes, or a sign.
    Direction(Channel),
    /// A scale less than half or more than twice the datasheet's, somewhere in the range of temperatures.
    Scale(Channel),
    /// A bias that leaves no range, somewhere in the range of temperatures.
    Bias(Channel),
    /// Noise that is zero, negative or absurd.
    Noise(Channel),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Length(found) => write!(f, "{found} bytes where a set has {}", super::ENCODED_BYTES),
            Refusal::NotASet => write!(f, "not a calibration set"),
            Refusal::Version(found) => write!(f, "set of version {found}: update the unit"),
            Refusal::Checksum { written, computed } => {
                write!(f, "checksum {written:08X} written, {computed:08X} found: send it again")
            }
            Refusal::Code(at) => write!(f, "unknown code at byte {at}"),
            Refusal::OtherRanges => write!(f, "made at other sensor ranges: calibrate at the unit's"),
            Refusal::OtherUnit { found, expected } => write!(f, "of unit {found}, this is unit {expected}"),
            Refusal::NotFinite(Some(channel)) => write!(f, "{channel}: not a number"),
            Refusal::NotFinite(None) => write!(f, "not a number"),
            Refusal::Temperatures => write!(f, "temperatures out of order or range"),
            Refusal::Uncertainty => write!(f, "uncertainty or place out of range"),
            Refusal::NotUnit(channel) => write!(f, "{channel}: axis is not of length 1"),
            Refusal::IllConditioned(sensor, condition) => {
                // As a whole number: formatting f32 costs the image kilobytes.
                write!(
                    f,
                    "{sensor}: condition {}, its axes do not span space",
                    *condition as u32
                )
            }
            Refusal::Direction(channel) => write!(f, "{channel}: over 10 deg from nominal: exchanged or reversed?"),
            Refusal::Scale(channel) => write!(f, "{channel}: scale not within half to twice nominal"),
            Refusal::Bias(channel) => write!(f, "{channel}: bias leaves no range"),
            Refusal::Noise(channel) => write!(f, "{channel}: noise not above 0 or absurd"),
        }
    }
}

impl core::error::Error for Refusal {}

pub(super) fn check(set: &Set) -> Result<(), Refusal> {
    numbers(set)?;
    conditions(set)?;
    let triads_b = triad_axes_b();
    for (channel, axis) in set.channels() {
        let n = usize::from(channel.0);
        let nominal_b = match channel.kind() {
            Kind::Gyro => gyro_axis_b(channel.plate()),
            _ => triads_b[n % triads_b.len()],
        };
        one(set, channel, axis, &nominal_b)?;
    }
    Ok(())
}

/// Everything but the axes, and that the axes are numbers.
fn numbers(set: &Set) -> Result<(), Refusal> {
    let spreads = set.uncertainty.iter().flat_map(|u| [u.bias, u.scale, u.direction]);
    let places = set.place_b.iter().flat_map(|place| [place.x, place.y, place.z]);
    let temperatures = [set.lowest_c, set.reference_c, set.highest_c];
    let mut own = spreads
        .clone()
        .chain(places.clone())
        .chain(temperatures)
        .chain([set.place_sigma]);
    if !own.all(|number| number.is_finite()) {
        return Err(Refusal::NotFinite(None));
    }
    if let Some((channel, _)) = set
        .channels()
        .find(|(_, axis)| !axis.numbers().iter().all(|n| n.is_finite()))
    {
        return Err(Refusal::NotFinite(Some(channel)));
    }
    let in_order = set.lowest_c < set.highest_c && (set.lowest_c..=set.highest_c).contains(&set.reference_c);
    if !in_order || !TEMPERATURES.contains(&set.lowest_c) || !TEMPERATURES.contains(&set.highest_c) {
        return Err(Refusal::Temperatures);
    }
    let placed = places.into_iter().all(|component| component.abs() < MOST_PLACE);
    if !placed || set.place_sigma < 0.0 || spreads.into_iter().any(|sigma| sigma < 0.0) {
        return Err(Refusal::Uncertainty);
    }
    Ok(())
}

/// Each sensor of three axes, and every three of the four gyros.
fn conditions(set: &Set) -> Result<(), Refusal> {
    for (kind, axes) in [(Kind::Accelerometer, &set.acc), (Kind::Magnetometer, &set.mag)] {
        for (plate, [x, y, z]) in axes.as_chunks::<3>().0.iter().enumerate() {
            spans(Sensor { kind, plate }, [x, y, z])?;
        }
    }
    for plate in 0..PLATES {
        let others = [1, 2, 3].map(|step: usize| &set.gyro[plate.wrapping_add(step) % PLATES]);
        spans(
            Sensor {
                kind: Kind::Gyro,
                plate: plate.wrapping_add(1) % PLATES,
            },
            others,
        )?;
    }
    Ok(())
}

fn spans(sensor: Sensor, axes: [&Axis; 3]) -> Result<(), Refusal> {
    let rows = Matrix3::from_rows(&axes.map(|axis| axis.axis_b.transpose()));
    let condition = rows.try_inverse().map_or(f32::INFINITY, |inverse| {
        ComplexField::sqrt(rows.norm_squared() * inverse.norm_squared())
    });
    if condition <= MOST_CONDITION {
        Ok(())
    } else {
        Err(Refusal::IllConditioned(sensor, condition))
    }
}

fn one(set: &Set, channel: Channel, axis: &Axis, nominal_b: &Vector3<f32>) -> Result<(), Refusal> {
    if (axis.axis_b.norm_squared() - 1.0).abs() > 2.0 * UNIT_LENGTH {
        return Err(Refusal::NotUnit(channel));
    }
    if axis.axis_b.dot(nominal_b) < LEAST_COSINE {
        return Err(Refusal::Direction(channel));
    }
    let nominal_scale = set.ranges.nominal_scale(channel.kind());
    for at_c in [set.lowest_c, set.reference_c, set.highest_c] {
        let above_c = at_c - set.reference_c;
        if !SCALES.contains(&(axis.scale_at(above_c) / nominal_scale)) {
            return Err(Refusal::Scale(channel));
        }
        if axis.bias_counts_at(above_c).abs() > MOST_BIAS_COUNTS {
            return Err(Refusal::Bias(channel));
        }
    }
    if !(axis.noise > 0.0 && axis.noise / axis.scale <= MOST_NOISE_COUNTS) {
        return Err(Refusal::Noise(channel));
    }
    Ok(())
}
