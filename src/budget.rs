//! How long a sensor may take within a cycle.
//!
//! Each read has [`READ_LIMIT_US`] (thesis, App. B.3: 16 ms). Sixteen of those are 256 ms, more than a cycle has, and
//! the thesis' unit then never closes a packet again. So every sensor that still waits for its turn keeps a reserve, and
//! the packet closes at the deadline whatever happened.

/// \[us\] the longest a read may take.
pub const READ_LIMIT_US: u64 = 16_000;

/// \[us\] the longest a sensor that failed may take until it answers again.
pub const PROBE_LIMIT_US: u64 = 2_000;

/// \[us\] the longest freeing the bus takes after a sensor that used all its time.
const RECOVERY_US: u64 = 1_000;

/// \[us\] kept for each waiting sensor in a long cycle: half for its read, which takes 0.3 ms, half for freeing the bus.
const RESERVE_US: u64 = 2 * RECOVERY_US;

/// The times of one cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Budget {
    /// \[us\] after its start the packet closes at the latest: 190 ms of 200.
    pub deadline_us: u64,
    /// \[us\] after its start the packet is sent if every sensor has had its turn by then: 10 ms of 200. Without it the
    /// packets of a cycle with a silent sensor, which is shorter, would come early.
    pub close_us: u64,
}

impl Budget {
    /// The budget of cycles that start every `period_us`.
    pub fn of_period(period_us: u64) -> Self {
        Budget {
            deadline_us: period_us / 20 * 19,
            close_us: period_us / 20,
        }
    }

    /// \[us\] the next sensor may take, `elapsed_us` into the cycle, while `waiting` more come after it. Zero when its
    /// time is up.
    pub fn limit_us(&self, elapsed_us: u64, waiting: u64, failed: bool) -> u64 {
        // In a short cycle the reserves must leave something to whoever is first.
        let reserve_us = RESERVE_US.min(self.deadline_us / 30);
        let taken_us = elapsed_us.saturating_add(waiting.saturating_mul(reserve_us));
        let left_us = self.deadline_us.saturating_sub(taken_us);
        let own_us = left_us.saturating_sub(RECOVERY_US).max(left_us.min(reserve_us / 2));
        own_us.min(if failed { PROBE_LIMIT_US } else { READ_LIMIT_US })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::SENSOR_COUNT;

    /// What a sensor that answers takes.
    const READ_US: u64 = 300;

    /// The end of a cycle in which the sensors of `silent` take all they may, and how many others had too little time.
    fn cycle(period_us: u64, silent: u16, failed: bool) -> (u64, usize) {
        let budget = Budget::of_period(period_us);
        let (mut elapsed_us, mut starved) = (0, 0);
        for slot in 0..SENSOR_COUNT {
            let is_silent = silent >> slot & 1 == 1;
            let limit_us = budget.limit_us(elapsed_us, (SENSOR_COUNT - 1 - slot) as u64, is_silent && failed);
            starved += usize::from(!is_silent && limit_us < READ_US);
            elapsed_us += if is_silent { limit_us + RECOVERY_US } else { READ_US };
        }
        (elapsed_us, starved)
    }

    #[test]
    fn whatever_sensors_are_silent_the_others_have_time_and_the_packet_closes() {
        for silent in 0..=u16::MAX {
            for failed in [false, true] {
                let (end_us, starved) = cycle(200_000, silent, failed);
                assert!(end_us <= 190_000 && starved == 0, "{silent:016b}: {end_us} {starved}");
            }
        }
    }

    #[test]
    fn a_few_silent_sensors_have_the_full_sixteen_milliseconds() {
        assert_eq!(
            cycle(200_000, 0b1111, false).0,
            4 * (READ_LIMIT_US + RECOVERY_US) + 12 * READ_US
        );
        assert_eq!(Budget::of_period(200_000).limit_us(0, 15, true), PROBE_LIMIT_US);
    }

    #[test]
    fn a_twenty_millisecond_cycle_closes_with_one_sensor_silent() {
        let (end_us, starved) = cycle(20_000, 1, false);
        assert!(end_us <= 19_000 && starved == 0, "{end_us} {starved}");
    }
}
