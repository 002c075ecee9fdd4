//! What the unit knows of itself after a reset: what it was doing, how often it started, when it was last alive.
//!
//! In and out: small contents of the retained memory ([`crate::retained`], which checks them), little endian.
//!
//! | content | bytes |
//! |---|---|
//! | [`Resume`] | 0 mode (1 WAIT, 2 FLIGHT), 1 flags (1 recording, 2 derived frames, 4 the log was not heard yet), 2-3 counter of the next packet |
//! | [`Starts`] | 0-1 since power-on, 2-3 without health between them |
//! | [`Pulse`] | 0-7 last alive, 8-15 watchdog last fed \[us since the unit's clock started\] |
//!
//! Refuses a mode or a flag that does not exist: what a checksum lets through is still looked at.

use crate::{
    board::Retained,
    mode::Mode,
    retained::{PULSE, Place, STARTS, STATE},
};

const RECORDING: u8 = 1 << 0;
const DERIVED: u8 = 1 << 1;
const AWAITS_LOG: u8 = 1 << 2;

/// What the unit was doing when a reset struck.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Resume {
    /// Mode to return to.
    pub mode: Mode,
    /// Whether packets were being recorded.
    pub recording: bool,
    /// Whether derived frames were on.
    pub derived: bool,
    /// The mode is that of a unit just switched on: the log, which may know better, has not been heard yet.
    pub awaits_log: bool,
    /// Counter of the next packet.
    pub next_counter: u16,
}

impl Resume {
    /// Keeps it.
    pub fn keep(&self, memory: &mut impl Retained) {
        let mode = match self.mode {
            Mode::Wait => 1,
            Mode::Flight => 2,
        };
        let flag = |bit: u8, set: bool| if set { bit } else { 0 };
        let flags = flag(RECORDING, self.recording) | flag(DERIVED, self.derived) | flag(AWAITS_LOG, self.awaits_log);
        let [low, high] = self.next_counter.to_le_bytes();
        STATE.keep(memory, &[mode, flags, low, high]);
    }

    /// What was kept.
    pub fn recall(memory: &impl Retained) -> Option<Self> {
        let [mode, flags, low, high] = recall(STATE, memory)?;
        if flags & !(RECORDING | DERIVED | AWAITS_LOG) != 0 {
            return None;
        }
        Some(Resume {
            mode: match mode {
                1 => Mode::Wait,
                2 => Mode::Flight,
                _ => return None,
            },
            recording: flags & RECORDING != 0,
            derived: flags & DERIVED != 0,
            awaits_log: flags & AWAITS_LOG != 0,
            next_counter: u16::from_le_bytes([low, high]),
        })
    }
}

/// How often the unit started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Starts {
    /// Since power-on, this one among them.
    pub since_power_on: u16,
    /// Since the unit was last healthy for a minute, this one among them. Whoever watches the health sets it to zero.
    pub without_health: u16,
}

impl Starts {
    /// One more start; keeps and returns it. The first thing a unit does: whatever it does next may end in a reset.
    pub fn count(memory: &mut impl Retained) -> Self {
        let before = Starts::recall(memory).unwrap_or_default();
        let starts = Starts {
            since_power_on: before.since_power_on.saturating_add(1),
            without_health: before.without_health.saturating_add(1),
        };
        starts.keep(memory);
        starts
    }

    /// Keeps it.
    pub fn keep(&self, memory: &mut impl Retained) {
        let [a, b] = self.since_power_on.to_le_bytes();
        let [c, d] = self.without_health.to_le_bytes();
        STARTS.keep(memory, &[a, b, c, d]);
    }

    /// What was kept.
    pub fn recall(memory: &impl Retained) -> Option<Self> {
        let [a, b, c, d] = recall(STARTS, memory)?;
        Some(Starts {
            since_power_on: u16::from_le_bytes([a, b]),
            without_health: u16::from_le_bytes([c, d]),
        })
    }
}

/// When the unit was last alive: a reset struck after it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pulse {
    /// [us] the latest fast sample of the gyros, since that run's clock started.
    pub at_us: u64,
    /// [us] the latest feeding of the watchdog.
    pub fed_us: u64,
}

impl Pulse {
    /// Keeps it.
    pub fn keep(&self, memory: &mut impl Retained) {
        let mut bytes = [0; 16];
        bytes[..8].copy_from_slice(&self.at_us.to_le_bytes());
        bytes[8..].copy_from_slice(&self.fed_us.to_le_bytes());
        PULSE.keep(memory, &bytes);
    }

    /// What was kept.
    pub fn recall(memory: &impl Retained) -> Option<Self> {
        let bytes: [u8; 16] = recall(PULSE, memory)?;
        let (at, fed) = bytes.split_first_chunk()?;
        Some(Pulse {
            at_us: u64::from_le_bytes(*at),
            fed_us: u64::from_le_bytes(*fed.first_chunk()?),
        })
    }
}

fn recall<const N: usize>(place: Place, memory: &impl Retained) -> Option<[u8; N]> {
    let mut bytes = [0; N];
    (place.recall(memory, &mut bytes)?.len() == N).then_some(bytes)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::{vec, vec::Vec};

    use super::*;
    use crate::retained::RETAINED_BYTES;

    struct Memory(Vec<u8>);

    impl Retained for Memory {
        fn read(&self, at: usize, bytes: &mut [u8]) {
            bytes.copy_from_slice(&self.0[at..at + bytes.len()]);
        }

        fn write(&mut self, at: usize, bytes: &[u8]) {
            self.0[at..at + bytes.len()].copy_from_slice(bytes);
        }
    }

    #[test]
    fn what_the_unit_was_doing_is_kept_and_starts_are_counted() {
        let mut memory = Memory(vec![0; RETAINED_BYTES]);
        assert_eq!(Resume::recall(&memory), None);
        let in_flight = Resume {
            mode: Mode::Flight,
            recording: true,
            derived: true,
            awaits_log: false,
            next_counter: 0x1234,
        };
        let awaiting = Resume {
            awaits_log: true,
            ..Resume::default()
        };
        for resume in [in_flight, awaiting] {
            resume.keep(&mut memory);
            assert_eq!(Resume::recall(&memory), Some(resume));
        }
        let pulse = Pulse {
            at_us: 0x0102_0304_0506_0708,
            fed_us: 9,
        };
        pulse.keep(&mut memory);
        for number in 1..4 {
            let starts = Starts::count(&mut memory);
            assert_eq!((starts.since_power_on, starts.without_health), (number, number));
        }
        assert_eq!(Pulse::recall(&memory), Some(pulse));
        let healthy = Starts {
            without_health: 0,
            ..Starts::recall(&memory).expect("kept")
        };
        healthy.keep(&mut memory);
        assert_eq!(Starts::count(&mut memory).without_health, 1);
        assert_eq!(Starts::count(&mut memory).since_power_on, 5);
    }

    #[test]
    fn a_mode_a_flag_or_a_length_that_does_not_exist_is_refused_whatever_its_checksum() {
        let mut memory = Memory(vec![0; RETAINED_BYTES]);
        for content in [&[3, 0, 0, 0][..], &[1, 8, 0, 0], &[1, 0, 0], &[1, 0, 0, 0, 0]] {
            STATE.keep(&mut memory, content);
            assert_eq!(Resume::recall(&memory), None, "{content:?}");
        }
    }
}
