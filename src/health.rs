//! The health word: bits 0 to 15 are the packet's error identifier, those above what it has no room for.

/// Health of the unit in one cycle, one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Health(pub u32);

impl Health {
    /// The sensor bus was recovered.
    pub const BUS_RECOVERED: Health = Health(1 << 16);
    /// The deadline closed the cycle before every sensor had its turn.
    pub const DEADLINE: Health = Health(1 << 17);
    /// Packets are being recorded.
    pub const RECORDING: Health = Health(1 << 18);
    /// The recorder refused the last packet.
    pub const RECORDER_REFUSED: Health = Health(1 << 19);
    /// A magnetometer axis overflowed.
    pub const MAGNETOMETER_OVERFLOW: Health = Health(1 << 20);
    /// A gyro reported an alarm.
    pub const GYRO_ALARM: Health = Health(1 << 21);
    /// A gyro stands at the end of its range.
    pub const GYRO_SATURATED: Health = Health(1 << 22);
    /// A sensor had lost its configuration and got it back.
    pub const RECONFIGURED: Health = Health(1 << 23);
    /// The crystal did not start: the unit's time is off by up to 8 %.
    pub const INTERNAL_OSCILLATOR: Health = Health(1 << 24);
    /// Safe mode: nothing is estimated.
    pub const SAFE_MODE: Health = Health(1 << 25);

    /// With these bits set too. Bits 0 to 15 are the packet's error identifier.
    pub fn with(self, more: Health) -> Health {
        Health(self.0 | more.0)
    }

    /// With these bits set too if `condition`.
    pub fn with_if(self, more: Health, condition: bool) -> Health {
        if condition { self.with(more) } else { self }
    }

    /// Whether all these bits are set.
    pub fn contains(self, other: Health) -> bool {
        self.0 & other.0 == other.0
    }
}
