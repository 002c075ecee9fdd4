//! The sensor bus as the controller finds it: its two wires, the switch, and what holds SDA.
//!
//! Bytes of I2C transfers in, acknowledges and bytes out. A controller asks [`super::Plant::sda_held`] before it
//! sends a START, for with SDA low it cannot; if it goes on regardless it is not acknowledged and reads zeros.

use crate::part::{Nanos, tca9548a::Tca9548a};

/// Clock pulses after which a part that was cut off in mid-byte lets go of SDA (UM10204, section 3.1.16).
const PULSES_TO_FREE: u8 = 9;

/// Who holds SDA low.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hold {
    Nobody,
    /// A part, for this many more clock pulses.
    Part(u8),
    /// A fault of the wire.
    Stuck,
}

/// The sensor bus.
pub struct SensorBus {
    pub(super) switch: Tca9548a,
    hold: Hold,
    silenced: bool,
    stop_misplaced: bool,
    /// STARTs on a held bus (by a part, for good), calls of a multiplexer that is gone, and STARTs that a controller could not
    /// send.
    pub(super) struck: [u64; 4],
}

impl SensorBus {
    pub(super) fn new(switch: Tca9548a) -> Self {
        SensorBus {
            switch,
            hold: Hold::Nobody,
            silenced: false,
            stop_misplaced: false,
            struck: [0; 4],
        }
    }

    /// START (or repeated START) and an address; `read` is the direction bit. Returns whether anyone acknowledges.
    pub fn start(&mut self, address: u8, read: bool, now: Nanos) -> bool {
        self.struck[2] += u64::from(self.silenced);
        !self.is_in_the_way() && self.switch.start(address, read, now)
    }

    /// A byte from the controller; returns whether anyone acknowledges.
    pub fn write(&mut self, byte: u8, now: Nanos) -> bool {
        !self.is_held() && self.switch.write(byte, now)
    }

    /// A byte for the controller; 0xFF if nobody sends.
    pub fn read(&mut self, now: Nanos) -> u8 {
        if self.is_held() { 0x00 } else { self.switch.read(now) }
    }

    /// STOP.
    pub fn stop(&mut self, now: Nanos) {
        self.switch.stop(now);
    }

    /// Power returns, to the parts as to the switch.
    pub(super) fn power_on(&mut self, now: Nanos) {
        self.switch.power_on(now);
    }

    /// The switch's reset line is pulled: no channel is selected.
    pub fn reset_pin(&mut self) {
        self.switch.reset();
    }

    /// Whether SDA is low with nobody sending.
    pub(super) fn is_held(&self) -> bool {
        self.hold != Hold::Nobody
    }

    /// As [`SensorBus::is_held`], asked by a controller that is about to send a START.
    pub(super) fn is_in_the_way(&mut self) -> bool {
        match self.hold {
            Hold::Nobody => {}
            Hold::Part(_) => self.struck[0] += 1,
            Hold::Stuck => self.struck[1] += 1,
        }
        self.is_held()
    }

    /// The controller sends no START from here on.
    pub(super) fn misplace_stop(&mut self) {
        self.stop_misplaced = true;
    }

    /// Whether the controller cannot send the START that it is about to.
    pub(super) fn start_is_refused(&mut self) -> bool {
        self.struck[3] += u64::from(self.stop_misplaced);
        self.stop_misplaced
    }

    /// The controller is reset.
    pub(super) fn controller_reset(&mut self) {
        self.stop_misplaced = false;
    }

    /// The multiplexer is gone, or back.
    pub(super) fn silence(&mut self, silent: bool) {
        self.silenced = silent;
        self.switch.silence(silent);
    }

    /// One pulse on SCL outside a transfer.
    pub(super) fn clock_pulse(&mut self) {
        if let Hold::Part(pulses) = self.hold {
            self.struck[0] += 1;
            self.hold = if pulses > 1 {
                Hold::Part(pulses - 1)
            } else {
                Hold::Nobody
            };
        }
    }

    /// A part was cut off in mid-byte and holds SDA for so many clock pulses.
    pub(super) fn hold_sda(&mut self, pulses: u8) {
        if self.hold == Hold::Nobody && pulses > 0 {
            self.hold = Hold::Part(pulses.min(PULSES_TO_FREE));
        }
    }

    /// The wire is stuck, or no longer.
    pub(super) fn stick(&mut self, stuck: bool) {
        self.hold = if stuck { Hold::Stuck } else { Hold::Nobody };
    }
}
