//! Debouncing of the lift-off and micro-g lines.
//!
//! In: a line's level, polled every [`POLL_US`]. Out: its debounced level: asserted while at least three of the newest
//! five polls are. A glitch shorter than 60 ms never passes, a real edge passes within 100 ms (fault U11).

/// \[us\] between polls.
pub const POLL_US: u64 = 20_000;

const NEWEST: u8 = 0b1_1111;
const ENOUGH: u32 = 3;

/// The newest polls of a line.
#[derive(Clone, Copy, Debug, Default)]
pub struct Debounce {
    polls: u8,
}

impl Debounce {
    /// Takes a poll, gives the debounced level.
    pub fn poll(&mut self, asserted: bool) -> bool {
        self.polls = (self.polls << 1 | u8::from(asserted)) & NEWEST;
        self.polls.count_ones() >= ENOUGH
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn levels<const N: usize>(polls: [u8; N]) -> [u8; N] {
        let mut line = Debounce::default();
        polls.map(|poll| line.poll(poll == 1).into())
    }

    #[test]
    fn a_glitch_of_two_polls_never_passes() {
        assert_eq!(levels([0, 1, 1, 0, 0, 0, 1, 1, 0]), [0; 9]);
    }

    #[test]
    fn a_bouncing_edge_passes_once() {
        assert_eq!(levels([0, 1, 0, 1, 1, 1, 1, 0, 0, 1]), [0, 0, 0, 0, 1, 1, 1, 1, 1, 1]);
        assert_eq!(levels([1, 1, 1, 1, 0, 0, 0, 0]), [0, 0, 1, 1, 1, 1, 0, 0]);
    }
}
