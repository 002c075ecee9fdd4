//! What the unit knows of itself after a reset: what it was doing, how often it started, when it was last alive.
//!
//! In and out: small contents of the retained memory ([`crate::retained`], which checks them), little endian.
//!
//! | content | bytes |
//! |---|---|
//! | [`Resume`] | 0 mode (1 WAIT, 2 FLIGHT), 1 flags (1 recording, 2 derived frames, 4 the log was not heard yet), 2-3 counter of the next packet, 4-5 dips of the supply since power-on |
//! | [`Starts`] | 0-1 since power-on, 2-3 without health between them |
//! | [`Pulse`] | 0-7 last alive, 8-15 watchdog last fed \[us since the unit's clock started\] |
//!
//! Refuses a mode or a flag that does not exist: what a checksum lets through is still looked at.

use crate::{
    board::{ResetCause, Retained},
    crash::CrashRecord,
    kalman::Outage,
    mode::{Mode, State},
    retained::{PULSE, Region, STARTS, STATE},
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
    /// Dips of the supply since power-on.
    pub dips: u16,
}

impl Resume {
    /// Keeps it.
    pub fn keep(&self, memory: &impl Retained) {
        let mode = match self.mode {
            Mode::Wait => 1,
            Mode::Flight => 2,
        };
        let flag = |bit: u8, set: bool| if set { bit } else { 0 };
        let flags = flag(RECORDING, self.recording) | flag(DERIVED, self.derived) | flag(AWAITS_LOG, self.awaits_log);
        let ([a, b], [c, d]) = (self.next_counter.to_le_bytes(), self.dips.to_le_bytes());
        STATE.keep(memory, &[mode, flags, a, b, c, d]);
    }

    /// What was kept.
    pub fn recall(memory: &impl Retained) -> Option<Self> {
        let [mode, flags, a, b, c, d] = recall(STATE, memory)?;
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
            next_counter: u16::from_le_bytes([a, b]),
            dips: u16::from_le_bytes([c, d]),
        })
    }

    /// The state after a start: what a reset struck goes on; after power-on, when nothing was kept, the log is waited for.
    pub fn state(kept: Option<Resume>) -> State {
        let mut state = State::default();
        if let Some(kept) = kept {
            state.mode = kept.mode;
            state.recording = kept.recording;
            state.derived = kept.derived;
        }
        state.awaits_log = kept.is_none_or(|kept| kept.awaits_log);
        state
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

/// Starts that ended within a minute each; the next one is in safe mode.
const FAILED_STARTS: u16 = 3;

impl Starts {
    /// Whether this start reads, sends and records only: whatever ended the ones before is left out, if it was the estimation
    /// or a command.
    pub fn ask_for_safe_mode(&self) -> bool {
        self.without_health > FAILED_STARTS
    }

    /// One more start; keeps and returns it. The first thing a unit does: whatever it does next may end in a reset.
    pub fn count(memory: &impl Retained) -> Self {
        let before = Starts::recall(memory).unwrap_or_default();
        let starts = Starts {
            since_power_on: before.since_power_on.saturating_add(1),
            without_health: before.without_health.saturating_add(1),
        };
        starts.keep(memory);
        starts
    }

    /// Keeps it.
    pub fn keep(&self, memory: &impl Retained) {
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
    /// \[us\] the latest fast sample of the gyros, since that run's clock started.
    pub at_us: u64,
    /// \[us\] the latest feeding of the watchdog.
    pub fed_us: u64,
}

impl Pulse {
    /// Keeps it.
    pub fn keep(&self, memory: &impl Retained) {
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

/// \[us\] from a reset to the start of the unit's clock, as the image on the emulated board shows it.
const START_US: u64 = 510;
/// \[us\] between two pulses, at most half of which passed on average before a reset struck.
const PULSE_US: u64 = 10_000;
/// \[us\] from the last feeding of the watchdog to its reset if the LSI runs at 32 kHz.
const WATCHDOG_US: u64 = 1_000_000;
/// \[s\] how far that may be off: 0.68 to 1.88 s (17 to 47 kHz, STM32F407 data sheet), all equally likely, about 1 s.
const WATCHDOG_SD_S: f32 = 0.45;
/// A cut of the supply that is over in 50 ms to 2 s, all equally likely: longer ones nobody knows of, there is no clock in them.
pub const POWER_CUT: Outage = Outage {
    lasted_s: 1.0,
    sd_s: 0.6,
    ended_us: 0,
};

/// What a reset missed since `kept_us` of the run before. A pin that is held low is not known of: it counts as if it were not.
pub fn outage(kept_us: u64, reset: ResetCause, pulse: Pulse, crash: Option<&CrashRecord>) -> Outage {
    let alive_us = pulse.at_us.max(kept_us);
    let next_us = alive_us.saturating_add(PULSE_US);
    let half_a_pulse = (alive_us.saturating_add(PULSE_US / 2), PULSE_US as f32 * 0.5e-6);
    let (struck_us, sd_s) = match reset {
        ResetCause::Watchdog => {
            let bites_us = pulse.fed_us.saturating_add(WATCHDOG_US);
            // One part waits for ever and the others go on until it bites; or nobody goes on.
            if bites_us > next_us {
                (bites_us, WATCHDOG_SD_S)
            } else {
                half_a_pulse
            }
        }
        ResetCause::Software => match crash {
            Some(crash) if (alive_us..next_us.saturating_add(WATCHDOG_US)).contains(&crash.uptime_us) => {
                (crash.uptime_us, 0.001)
            }
            _ => half_a_pulse,
        },
        ResetCause::Pin => half_a_pulse,
        // The memory outlasted a dip of the supply.
        ResetCause::PowerOn => (
            alive_us.saturating_add((POWER_CUT.lasted_s * 1e6) as u64),
            POWER_CUT.sd_s,
        ),
    };
    Outage {
        lasted_s: struck_us.saturating_sub(kept_us).saturating_add(START_US) as f32 * 1e-6,
        sd_s,
        ended_us: 0,
    }
}

fn recall<const N: usize>(region: Region, memory: &impl Retained) -> Option<[u8; N]> {
    let mut bytes = [0; N];
    (region.recall(memory, &mut bytes)?.len() == N).then_some(bytes)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use core::cell::RefCell;
    use std::{vec, vec::Vec};

    use super::*;
    use crate::retained::RETAINED_BYTES;

    struct Memory(RefCell<Vec<u8>>);

    impl Retained for Memory {
        fn read(&self, at: usize, bytes: &mut [u8]) {
            bytes.copy_from_slice(&self.0.borrow()[at..at + bytes.len()]);
        }

        fn write(&self, at: usize, bytes: &[u8]) {
            self.0.borrow_mut()[at..at + bytes.len()].copy_from_slice(bytes);
        }
    }

    #[test]
    fn what_the_unit_was_doing_is_kept_and_starts_are_counted() {
        let memory = Memory(RefCell::new(vec![0; RETAINED_BYTES]));
        assert_eq!(Resume::recall(&memory), None);
        let in_flight = Resume {
            mode: Mode::Flight,
            recording: true,
            derived: true,
            awaits_log: false,
            next_counter: 0x1234,
            dips: 0x0506,
        };
        let awaiting = Resume {
            awaits_log: true,
            ..Resume::default()
        };
        for resume in [in_flight, awaiting] {
            resume.keep(&memory);
            assert_eq!(Resume::recall(&memory), Some(resume));
        }
        let pulse = Pulse {
            at_us: 0x0102_0304_0506_0708,
            fed_us: 9,
        };
        pulse.keep(&memory);
        for number in 1..4 {
            let starts = Starts::count(&memory);
            assert_eq!((starts.since_power_on, starts.without_health), (number, number));
        }
        assert_eq!(Pulse::recall(&memory), Some(pulse));
        let healthy = Starts {
            without_health: 0,
            ..Starts::recall(&memory).expect("kept")
        };
        healthy.keep(&memory);
        assert_eq!(Starts::count(&memory).without_health, 1);
        assert_eq!(Starts::count(&memory).since_power_on, 5);
    }

    #[test]
    fn a_reset_goes_on_and_power_on_waits_for_the_log() {
        for n in 0..16_u8 {
            let [flight, recording, derived, awaits_log] = [1, 2, 4, 8].map(|bit| n & bit != 0);
            let mode = if flight { Mode::Flight } else { Mode::Wait };
            let kept = Resume {
                mode,
                recording,
                derived,
                awaits_log,
                ..Resume::default()
            };
            let state = Resume::state(Some(kept));
            assert_eq!((state.mode, state.recording), (mode, recording), "{kept:?}");
            assert_eq!((state.derived, state.awaits_log), (derived, awaits_log), "{kept:?}");
        }
        let mut after_power_on = Resume::state(None);
        assert!(after_power_on.awaits_log);
        after_power_on.awaits_log = false;
        assert_eq!(after_power_on, State::default());
    }

    #[test]
    fn an_outage_is_as_long_as_the_reset_allows() {
        let pulse = |at_us, fed_us| Pulse { at_us, fed_us };
        let missed = |reset, pulse: Pulse, crash| {
            let Outage { lasted_s, sd_s, .. } = outage(5_000_000, reset, pulse, crash);
            ((lasted_s * 1e3).round_ties_even(), sd_s)
        };
        assert_eq!(
            missed(ResetCause::Pin, pulse(5_070_000, 5_000_000), None),
            (76.0, 0.005)
        );
        // Everybody hung at 5.07 s, 0.1 s after the last feeding; one part hung and the pulse went on.
        assert_eq!(
            missed(ResetCause::Watchdog, pulse(5_070_000, 4_970_000), None),
            (971.0, 0.45)
        );
        assert_eq!(
            missed(ResetCause::Watchdog, pulse(5_070_000, 4_071_000), None),
            (76.0, 0.005)
        );
        let crash = CrashRecord::new(crate::crash::CrashCause::Panic, 1, 0, 0, 5_072_000, "");
        assert_eq!(
            missed(ResetCause::Software, pulse(5_070_000, 5_000_000), Some(&crash)),
            (73.0, 0.001)
        );
        let old = CrashRecord::new(crate::crash::CrashCause::Panic, 1, 0, 0, 72_000, "");
        assert_eq!(
            missed(ResetCause::Software, pulse(5_070_000, 5_000_000), Some(&old)),
            (76.0, 0.005)
        );
        // Pulses of no use: the reset was not before what was kept.
        assert_eq!(missed(ResetCause::Pin, pulse(0, 0), None), (6.0, 0.005));
    }

    #[test]
    fn a_mode_a_flag_or_a_length_that_does_not_exist_is_refused_whatever_its_checksum() {
        let memory = Memory(RefCell::new(vec![0; RETAINED_BYTES]));
        for content in [
            &[3, 0, 0, 0, 0, 0][..],
            &[1, 8, 0, 0, 0, 0],
            &[1, 0, 0, 0, 0],
            &[1, 0, 0, 0, 0, 0, 0],
        ] {
            STATE.keep(&memory, content);
            assert_eq!(Resume::recall(&memory), None, "{content:?}");
        }
    }
}
