//! The last five seconds of a disagreement: its mean over one second and over five, and its spread.
//!
//! In: one disagreement a cycle in standard deviations of its noise. Out: sums over the last [`SHORT`] and [`LONG`]
//! cycles, scaled to a standard deviation of one, and the sum of squares. Kept as integers of 1/64, so that running sums
//! are exact for ever, and clipped at 127, so that one wild sample does not fill the window alone.

use nalgebra::ComplexField;

/// Cycles: those within one second of the first faulty one at 5 Hz, itself included.
pub(super) const SHORT: usize = 6;
/// Cycles: those within five seconds.
pub(super) const LONG: usize = 26;

const PER_SIGMA: f32 = 64.0;
const MOST_SIGMAS: f32 = 127.0;

/// A window over the newest disagreements.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trace {
    ring: [i16; LONG],
    next: u8,
    held: u8,
    sum: i32,
    squares: i32,
}

impl Trace {
    pub(super) const EMPTY: Trace = Trace {
        ring: [0; LONG],
        next: 0,
        held: 0,
        sum: 0,
        squares: 0,
    };

    /// Takes one; what is not a number is as wild as can be.
    pub(super) fn push(&mut self, sigmas: f32) {
        let sigmas = if sigmas.is_nan() { MOST_SIGMAS } else { sigmas };
        let new = (sigmas.clamp(-MOST_SIGMAS, MOST_SIGMAS) * PER_SIGMA) as i16;
        let old = core::mem::replace(&mut self.ring[usize::from(self.next)], new);
        self.sum += i32::from(new) - i32::from(old);
        self.squares += i32::from(new) * i32::from(new) - i32::from(old) * i32::from(old);
        self.next = (self.next + 1) % LONG as u8;
        self.held = (self.held + 1).min(LONG as u8);
    }

    /// Whether it holds [`LONG`] cycles.
    pub(super) fn full(&self) -> bool {
        usize::from(self.held) == LONG
    }

    /// Sum over the last [`SHORT`] in its standard deviations; 0 before there are as many.
    pub(super) fn short(&self) -> f32 {
        if usize::from(self.held) < SHORT {
            return 0.0;
        }
        let newest = (1..=SHORT).map(|back| self.ring[(usize::from(self.next) + LONG - back) % LONG]);
        let sum: i32 = newest.map(i32::from).sum();
        sum as f32 / (PER_SIGMA * ComplexField::sqrt(SHORT as f32))
    }

    /// Sum over all in its standard deviations; 0 before there are [`SHORT`].
    pub(super) fn long(&self) -> f32 {
        if usize::from(self.held) < SHORT {
            return 0.0;
        }
        self.sum as f32 / (PER_SIGMA * ComplexField::sqrt(f32::from(self.held)))
    }

    /// Sum of squares; of [`LONG`] healthy ones 26 on average.
    pub(super) fn squares(&self) -> f32 {
        self.squares as f32 / (PER_SIGMA * PER_SIGMA)
    }

    /// Variance about the mean, of a full window.
    pub(super) fn variance(&self) -> f32 {
        let mean = self.long() / ComplexField::sqrt(LONG as f32);
        self.squares() / LONG as f32 - mean * mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sixty-fourth each is rounded towards zero.
    const ROUNDING: f32 = 26.0 / 64.0;

    #[test]
    fn sums_are_those_of_the_newest_and_never_drift() {
        let mut trace = Trace::EMPTY;
        for cycle in 0..1_000_000_u32 {
            trace.push((cycle.wrapping_mul(2_654_435_761) % 1000) as f32 - 500.0);
        }
        for _ in 0..LONG {
            trace.push(0.5);
        }
        assert_eq!(
            (trace.short(), trace.long()),
            (0.5 * 6.0_f32.sqrt(), 0.5 * 26.0_f32.sqrt())
        );
        assert_eq!((trace.squares(), trace.variance().abs() < 1e-5), (0.25 * 26.0, true));
    }

    #[test]
    fn it_says_nothing_before_a_second_and_grows_to_five() {
        let mut trace = Trace::EMPTY;
        for cycle in 1..=LONG {
            trace.push(1.0);
            let expected = if cycle < SHORT { 0.0 } else { (cycle as f32).sqrt() };
            assert!((trace.long() - expected).abs() < ROUNDING, "{cycle}");
            assert_eq!(trace.full(), cycle == LONG);
        }
    }

    #[test]
    fn wild_values_and_those_that_are_no_numbers_are_clipped() {
        let mut trace = Trace::EMPTY;
        for wild in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30]
            .into_iter()
            .cycle()
            .take(100)
        {
            trace.push(wild);
        }
        assert!(trace.squares() > 0.9 * 26.0 * 127.0 * 127.0 && trace.long().is_finite());
    }
}
