//! The 16-bit packet counter to a number that never wraps, and the packets missed in between.
//!
//! In: counters in the order received. Out: packet numbers, whose product with the cycle is time, and what the step
//! from the packet before was. The first packet keeps its counter as its number, so time is counter times cycle.
//!
//! The counter wraps every 65,536 packets (3.64 h at 5 Hz), so a step is only known modulo that. Steps of up to
//! [`LONGEST_GAP`] are taken as missed packets; any other step is a jump (the unit was powered anew, or two streams
//! were joined), after which numbers go on by one, since nobody knows how long it took.

/// \[s\] nominal read cycle, one packet each.
pub const CYCLE_S: f64 = 0.2;

/// Missed packets that are still believed: one hour at 5 Hz.
pub const LONGEST_GAP: u16 = 18_000;

/// How a packet follows the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// There is none before it.
    First,
    /// The next one.
    Next,
    /// So many between them are missing.
    Missed(u16),
    /// It has the same counter.
    Repeated,
    /// Its counter tells nothing about how much later it is.
    Jumped,
}

/// Numbers packets.
#[derive(Debug, Default)]
pub struct Sequence {
    last: Option<(u16, u64)>,
}

impl Sequence {
    /// Number of the packet with this counter, and its step from the one before.
    pub fn number(&mut self, counter: u16) -> (u64, Step) {
        let (number, step) = match self.last {
            None => (u64::from(counter), Step::First),
            Some((last, number)) => match counter.wrapping_sub(last) {
                0 => (number, Step::Repeated),
                1 => (number + 1, Step::Next),
                ahead if ahead - 1 <= LONGEST_GAP => (number + u64::from(ahead), Step::Missed(ahead - 1)),
                _ => (number + 1, Step::Jumped),
            },
        };
        self.last = Some((counter, number));
        (number, step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(counters: &[u16], expected: &[(u64, Step)]) {
        let mut sequence = Sequence::default();
        let numbers: Vec<_> = counters.iter().map(|counter| sequence.number(*counter)).collect();
        assert_eq!(numbers, expected);
    }

    #[test]
    fn the_first_packet_keeps_its_counter() {
        check(&[7, 8], &[(7, Step::First), (8, Step::Next)]);
    }

    #[test]
    fn a_gap_is_missed_packets_also_over_the_wrap() {
        check(
            &[0xFFFE, 0xFFFF, 0, 3],
            &[
                (65_534, Step::First),
                (65_535, Step::Next),
                (65_536, Step::Next),
                (65_539, Step::Missed(2)),
            ],
        );
    }

    #[test]
    fn a_day_is_numbered_without_a_break() {
        const DAY_AT_5_HZ: u64 = 432_000;
        let mut sequence = Sequence::default();
        for number in 0..DAY_AT_5_HZ {
            assert_eq!(sequence.number(number as u16).0, number);
        }
    }

    #[test]
    fn a_repeated_counter_is_the_same_packet() {
        check(&[5, 5, 6], &[(5, Step::First), (5, Step::Repeated), (6, Step::Next)]);
    }

    #[test]
    fn a_counter_that_goes_back_is_a_jump_not_three_hours() {
        check(
            &[1000, 0, 1],
            &[(1000, Step::First), (1001, Step::Jumped), (1002, Step::Next)],
        );
    }

    #[test]
    fn an_hour_is_the_longest_gap_believed() {
        check(&[0, 18_001], &[(0, Step::First), (18_001, Step::Missed(18_000))]);
        check(&[0, 18_002], &[(0, Step::First), (1, Step::Jumped)]);
    }
}
