//! What is said of each axis, and the word the derived frame and the record have for it.
//!
//! | bit of the word | meaning when set |
//! |---|---|
//! | 0 to 11 | accelerometer axis `x, y, z` of plates 1 to 4 is not used |
//! | 12 to 23 | magnetometer axis, the same |
//! | 24 to 27 | gyro 1 to 4 |
//! | 28, 29, 30 | accelerometers, magnetometers, gyros disagree and it is not isolable which is at fault |
//! | 31 | calibration in doubt: temperature held or beyond what the set holds for |
//!
//! An axis is not used in a cycle in which it was not read, saturated or stood beyond the gate, and as long as it has
//! another [`Verdict`] than [`Verdict::Sound`].

use crate::{
    calibration::{CHANNELS, Channel, Channels},
    sample::Kind,
};

/// What is held of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Verdict {
    /// It agrees with the others.
    #[default]
    Sound,
    /// It does not, and has not been watched long enough to say how.
    Disagreeing,
    /// It is off by something constant or slow.
    Biased,
    /// It scatters more than its noise.
    Noisy,
    /// It measures the negative of what it should.
    Reversed,
    /// It measures what another axis of its sensor should.
    Exchanged,
    /// It repeats itself more often than noise would let it.
    Frozen,
}

impl Verdict {
    /// Whether how it is wrong may still be said.
    pub(super) fn is_unnamed(self) -> bool {
        matches!(self, Verdict::Disagreeing | Verdict::Biased | Verdict::Noisy)
    }
}

/// The health word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct SensorHealth(pub u32);

impl SensorHealth {
    /// Accelerometers disagree, not isolable.
    pub const ACCELEROMETERS: SensorHealth = SensorHealth(1 << CHANNELS);
    /// Magnetometers disagree, not isolable.
    pub const MAGNETOMETERS: SensorHealth = SensorHealth(1 << (CHANNELS + 1));
    /// Gyros disagree, not isolable.
    pub const GYROS: SensorHealth = SensorHealth(1 << (CHANNELS + 2));
    /// Calibration in doubt.
    pub const CALIBRATION: SensorHealth = SensorHealth(1 << (CHANNELS + 3));

    /// With these bits set too if `condition`.
    pub fn with_if(self, more: SensorHealth, condition: bool) -> Self {
        if condition { SensorHealth(self.0 | more.0) } else { self }
    }

    /// With these axes of a kind unused, bit `k` for its axis `k`.
    pub(super) fn unused(self, kind: Kind, axes: u16) -> Self {
        SensorHealth(self.0 | Channels::default().with(kind, axes).0)
    }

    /// Whether all these bits are set.
    pub fn contains(self, other: SensorHealth) -> bool {
        self.0 & other.0 == other.0
    }

    /// Axes that are not used.
    pub fn unused_channels(self) -> Channels {
        Channels(self.0 & Channels::ALL.0)
    }

    /// Whether an axis is used.
    pub fn uses(self, channel: Channel) -> bool {
        !self.unused_channels().contains(channel)
    }
}

#[cfg(test)]
mod tests;
