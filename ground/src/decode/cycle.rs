//! The time between two packets of a stream: as its derived frames say it, as it was told, or nominal.
//!
//! In: [`StreamEntry`]s as they come. Out: the same entries, held back until the cycle is known: from the first two derived
//! frames near each other, or after [`PATIENCE`] packets without. Packets are numbered, not timed, so every time in the
//! tables hangs on it. Refused: frames that contradict what was told or what was settled on, since their times are the unit's.

use logs::digest::StreamEntry;
use packets::stream::sequence::CYCLE_S;

/// Packets without two derived frames after which none are waited for: at 50 Hz one packet in nine has one.
const PATIENCE: usize = 40;

/// Entries without a packet after which there is none to come: stretches of noise.
const HOPELESS: usize = 10_000;

/// Counters apart at most that two frames are compared over: farther apart, one may be from after a restart.
const COUNTERS_APART: u16 = 10;

/// Relative. The unit's clock is good to 100 ppm; a cycle told wrongly is another number.
const SAME: f64 = 0.01;

/// Frames that contradict the cycle.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the times would be by a cycle of {:.3} ms, but the derived frames say {:.3} ms: leave --cycle out, or say --cycle {:.0}us",
    1e3 * .used_s, 1e3 * .seen_s, 1e6 * .seen_s
)]
pub struct Contradicted {
    /// \[s\] told or settled on.
    pub used_s: f64,
    /// \[s\] by the frames.
    pub seen_s: f64,
}

/// Finds the cycle and holds entries back until it is known.
#[derive(Debug)]
pub struct Cycle {
    told_s: Option<f64>,
    settled_s: Option<f64>,
    held: Vec<StreamEntry>,
    packets: usize,
    /// Counter and start \[us\] of the last derived frame.
    frame: Option<(u16, u64)>,
    /// \[s\] a cycle that contradicts, seen once: one may be a restart's.
    doubt_s: Option<f64>,
}

impl Cycle {
    /// Of a stream whose cycle was told, or was not.
    pub fn new(told_s: Option<f64>) -> Self {
        Cycle {
            told_s,
            settled_s: None,
            held: Vec::new(),
            packets: 0,
            frame: None,
            doubt_s: None,
        }
    }

    /// \[s\] The cycle, as far as it is known.
    pub fn s(&self) -> f64 {
        self.settled_s.or(self.told_s).unwrap_or(CYCLE_S)
    }

    /// Whether there were packets.
    pub fn any(&self) -> bool {
        self.packets > 0
    }

    /// Whether so much came without a packet that there is none to come.
    pub fn hopeless(&self) -> bool {
        self.packets == 0 && self.held.len() > HOPELESS
    }

    /// Takes entries; those that may be written now.
    ///
    /// # Errors
    /// When derived frames contradict the cycle.
    pub fn take(&mut self, entries: Vec<StreamEntry>) -> Result<Vec<StreamEntry>, Contradicted> {
        for entry in &entries {
            match entry {
                StreamEntry::Packet { .. } => self.packets += 1,
                StreamEntry::Derived(derived) => self.frame(derived.counter, derived.start_us)?,
                StreamEntry::Line { .. } | StreamEntry::Reject(_) => {}
            }
        }
        self.held.extend(entries);
        if self.settled_s.is_none() && self.packets < PATIENCE {
            return Ok(Vec::new());
        }
        Ok(self.rest())
    }

    /// What is held still, at the end.
    pub fn rest(&mut self) -> Vec<StreamEntry> {
        if self.packets > 0 {
            self.settled_s.get_or_insert(self.told_s.unwrap_or(CYCLE_S));
        }
        std::mem::take(&mut self.held)
    }

    fn frame(&mut self, counter: u16, start_us: u64) -> Result<(), Contradicted> {
        let before = self.frame.replace((counter, start_us));
        let Some((last, last_us)) = before else { return Ok(()) };
        let apart = counter.wrapping_sub(last);
        if !(1..=COUNTERS_APART).contains(&apart) || start_us <= last_us {
            return Ok(());
        }
        let seen_s = (start_us - last_us) as f64 * 1e-6 / f64::from(apart);
        let same = |one: f64| (one / seen_s - 1.0).abs() < SAME;
        match self.settled_s.or(self.told_s) {
            Some(used_s) if !same(used_s) => {
                if self.doubt_s.replace(seen_s).is_some_and(same) {
                    return Err(Contradicted { used_s, seen_s });
                }
            }
            Some(used_s) => {
                self.doubt_s = None;
                self.settled_s = Some(used_s);
            }
            // To the microsecond: what is beyond is the jitter of one cycle.
            None => self.settled_s = Some((seen_s * 1e6).round() / 1e6),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use emems::{derived::Derived, sample::Reading};
    use packets::stream::sequence::Step;

    use super::*;

    fn packet(number: u64) -> StreamEntry {
        StreamEntry::Packet {
            number,
            step: Step::Next,
            offset: 0,
            reading: Reading::unread(number as u16),
        }
    }

    fn frame(counter: u16, start_us: u64) -> StreamEntry {
        StreamEntry::Derived(Box::new(Derived {
            counter,
            start_us,
            ..Derived::NONE
        }))
    }

    #[test]
    fn the_frames_say_the_cycle_and_nothing_is_written_before() {
        let mut cycle = Cycle::new(None);
        assert_eq!(cycle.take(vec![packet(1), frame(1, 1_000_000)]), Ok(vec![]));
        let out = cycle.take(vec![packet(2), frame(2, 1_020_001)]).expect("agreed");
        assert_eq!((out.len(), cycle.s()), (4, 0.020001));
    }

    #[test]
    fn what_was_told_wrongly_is_refused_before_a_row_is_written() {
        let mut cycle = Cycle::new(Some(0.02));
        let start = |k: u16| frame(k, 1_000_000 + 200_000 * u64::from(k));
        assert_eq!(cycle.take(vec![packet(1), start(1), packet(2), start(2)]), Ok(vec![]));
        let error = cycle.take(vec![packet(3), start(3)]).expect_err("told wrongly");
        assert!(
            error
                .to_string()
                .contains("20.000 ms, but the derived frames say 200.000 ms"),
            "{error}"
        );
    }

    #[test]
    fn without_frames_the_told_or_the_nominal_cycle_holds_after_a_while() {
        for (told, used) in [(None, 0.2), (Some(0.02), 0.02)] {
            let mut cycle = Cycle::new(told);
            let out: usize = (0..45).map(|k| cycle.take(vec![packet(k)]).expect("none").len()).sum();
            assert_eq!((out, cycle.s()), (45, used));
        }
    }

    #[test]
    fn a_restart_is_no_contradiction() {
        let mut cycle = Cycle::new(None);
        for entries in [
            [frame(1, 400_000), frame(2, 600_000)],
            [frame(3, 90_000_000), frame(4, 90_200_000)],
        ] {
            assert!(cycle.take(entries.to_vec()).is_ok());
        }
        assert_eq!(cycle.s(), 0.2);
    }
}
