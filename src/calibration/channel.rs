//! The 28 axes of a unit by number: accelerometers, magnetometers, gyros, in reading order.

use core::fmt;

use crate::{
    geometry::{PLATES, TRIAD_AXES},
    sample::Kind,
};

/// How many axes measure: twelve of force, twelve of field, four of rate.
pub const CHANNELS: usize = 2 * TRIAD_AXES + PLATES;

/// An axis of a unit, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Channel(pub u8);

impl Channel {
    /// Axis `k` of a kind: 0 to 11 of force or field (three a plate), 0 to 3 of rate. Thermometers have none.
    pub fn of(kind: Kind, k: usize) -> Self {
        Channel(first(kind) + k as u8)
    }

    /// What it measures.
    pub fn kind(self) -> Kind {
        match usize::from(self.0) / TRIAD_AXES {
            0 => Kind::Accelerometer,
            1 => Kind::Magnetometer,
            _ => Kind::Gyro,
        }
    }

    /// Plate it is on, 0 to 3.
    pub fn plate(self) -> usize {
        let k = usize::from(self.0.wrapping_sub(first(self.kind())));
        if self.kind() == Kind::Gyro { k } else { k / 3 }
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plate = self.plate().wrapping_add(1);
        let axis = ["x", "y", "z"][usize::from(self.0) % 3];
        match self.kind() {
            Kind::Accelerometer => write!(f, "accelerometer {plate} {axis}"),
            Kind::Magnetometer => write!(f, "magnetometer {plate} {axis}"),
            _ => write!(f, "gyro {plate}"),
        }
    }
}

fn first(kind: Kind) -> u8 {
    match kind {
        Kind::Accelerometer => 0,
        Kind::Magnetometer => TRIAD_AXES as u8,
        Kind::Gyro | Kind::Thermometer => 2 * TRIAD_AXES as u8,
    }
}

/// A set of axes, bit `n` for [`Channel`] `n`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Channels(pub u32);

impl Channels {
    /// Every axis.
    pub const ALL: Channels = Channels((1 << CHANNELS) - 1);

    /// Adds an axis.
    pub fn insert(&mut self, channel: Channel) {
        self.0 |= 1 << channel.0;
    }

    /// Whether the axis is among them.
    pub fn contains(self, channel: Channel) -> bool {
        self.0 >> channel.0 & 1 == 1
    }

    /// Those of one kind, bit `k` for its axis `k`.
    pub fn of(self, kind: Kind) -> u16 {
        let axes = if kind == Kind::Gyro { PLATES } else { TRIAD_AXES };
        (self.0 >> first(kind)) as u16 & ((1 << axes) - 1)
    }

    /// With axes of one kind, bit `k` for its axis `k`.
    pub fn with(self, kind: Kind, axes: u16) -> Self {
        Channels(self.0 | u32::from(axes) << first(kind))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_numbered_as_they_are_read() {
        let named = |n, kind, plate| {
            assert_eq!((Channel(n).kind(), Channel(n).plate()), (kind, plate), "{}", Channel(n));
        };
        named(0, Kind::Accelerometer, 0);
        named(11, Kind::Accelerometer, 3);
        named(12, Kind::Magnetometer, 0);
        named(20, Kind::Magnetometer, 2);
        named(24, Kind::Gyro, 0);
        named(27, Kind::Gyro, 3);
        assert_eq!(Channel::of(Kind::Magnetometer, 8), Channel(20));
    }

    #[test]
    fn a_set_of_one_kind_comes_back() {
        let all = Channels::default()
            .with(Kind::Accelerometer, 0x801)
            .with(Kind::Gyro, 0b1010);
        assert_eq!(
            (
                all.of(Kind::Accelerometer),
                all.of(Kind::Magnetometer),
                all.of(Kind::Gyro)
            ),
            (0x801, 0, 0b1010)
        );
        assert!(all.contains(Channel(11)) && !all.contains(Channel(24)) && all.contains(Channel(25)));
    }
}
