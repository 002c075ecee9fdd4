//! The last five seconds of a disagreement: its mean over one second and over five, and its spread.
//!
//! In, each cycle: a disagreement, and the standard deviation of what in it is systematic, both in standard deviations of
//! its noise. Out: how far the sums over the last [`SHORT`] and [`LONG`] cycles, and the sum of squares, are on the way to
//! their limits. Over `n` cycles noise of 1 adds to a variance of `n`; what is systematic may have the same sign all along and
//! adds to `(sum s)^2`. Kept as integers of 1/64, so that running sums are exact for ever, and clipped at 127, so that one
//! wild sample does not fill the window alone.

/// Cycles: those within one second of the first faulty one at 5 Hz, itself included.
pub(super) const SHORT: usize = 6;
/// Cycles: those within five seconds.
pub(super) const LONG: usize = 26;

const PER_SIGMA: f32 = 64.0;
const MOST_SIGMAS: f32 = 127.0;
/// Standard deviations at which a single value is to be clipped before it comes here: below the limits of the means.
pub(super) const WILD: f32 = 4.5;
/// Variances the systematic part may reach in the sum of squares: one value of it alone is no alarm.
const SYSTEMATIC_SQUARES: f32 = WILD * WILD;

/// One cycle in 1/64 of the noise.
#[derive(Clone, Copy, Debug)]
struct Cycle {
    disagreement: i16,
    systematic: i16,
}

const NOTHING: Cycle = Cycle {
    disagreement: 0,
    systematic: 0,
};

/// A window over the newest disagreements.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trace {
    ring: [Cycle; LONG],
    next: u8,
    held: u8,
    sum: i32,
    squares: i32,
    systematic: i32,
    systematic_squares: i32,
    /// Sums of disagreement and systematic part over the newest [`SHORT`].
    short: [i32; 2],
}

/// Limits of a window: means in standard deviations, and the sum of squares.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) short: f32,
    pub(super) long: f32,
    pub(super) squares: f32,
}

impl Trace {
    pub(super) const EMPTY: Trace = Trace {
        ring: [NOTHING; LONG],
        next: 0,
        held: 0,
        sum: 0,
        squares: 0,
        systematic: 0,
        systematic_squares: 0,
        short: [0; 2],
    };

    /// Takes a cycle; what is not a number is as wild as can be.
    pub(super) fn push(&mut self, disagreement: f32, systematic: f32) {
        let new = Cycle {
            disagreement: clipped(disagreement),
            systematic: clipped_above(systematic),
        };
        let next = usize::from(self.next);
        let left = if next < SHORT {
            next + (LONG - SHORT)
        } else {
            next - SHORT
        };
        // Both are within it.
        let left = self.ring.get(left).copied().unwrap_or(NOTHING);
        let old = self.ring.get_mut(next).map_or(NOTHING, |old| core::mem::replace(old, new));
        // The sums of 26 squares of 8128 stay within 32 bits; arithmetic that would check it is a tenth of the step.
        let moved = |sum: &mut i32, new: i32, old: i32| *sum = sum.wrapping_add(new).wrapping_sub(old);
        let square = |value: i16| i32::from(value).wrapping_mul(i32::from(value));
        moved(&mut self.short[0], new.disagreement.into(), left.disagreement.into());
        moved(&mut self.short[1], new.systematic.into(), left.systematic.into());
        moved(&mut self.sum, new.disagreement.into(), old.disagreement.into());
        moved(&mut self.squares, square(new.disagreement), square(old.disagreement));
        moved(&mut self.systematic, new.systematic.into(), old.systematic.into());
        moved(
            &mut self.systematic_squares,
            square(new.systematic),
            square(old.systematic),
        );
        self.next = if next < LONG - 1 { next as u8 + 1 } else { 0 };
        self.held = if self.held < LONG as u8 { self.held + 1 } else { self.held };
    }

    /// Whether it holds [`LONG`] cycles.
    pub(super) fn full(&self) -> bool {
        usize::from(self.held) == LONG
    }

    /// Square of the largest of its three figures, in parts of their limits: roots cost more than all the rest. The means
    /// count from [`SHORT`] cycles on.
    pub(super) fn over_squared(&self, limits: Limits) -> f32 {
        let allowed = limits.squares + SYSTEMATIC_SQUARES * squared_sigmas(self.systematic_squares);
        let spread = squared_sigmas(self.squares) / allowed;
        if usize::from(self.held) < SHORT {
            return spread;
        }
        let [short, systematic] = self.short;
        let short = mean_squared(short, systematic, SHORT as f32) / (limits.short * limits.short);
        let long = mean_squared(self.sum, self.systematic, f32::from(self.held)) / (limits.long * limits.long);
        larger(spread, larger(short, long))
    }

    /// Variance of a full window about its mean, and the variance that is expected.
    pub(super) fn variance(&self) -> (f32, f32) {
        let mean = self.sum as f32 / (PER_SIGMA * LONG as f32);
        let expected = 1.0 + squared_sigmas(self.systematic_squares) / LONG as f32;
        (squared_sigmas(self.squares) / LONG as f32 - mean * mean, expected)
    }
}

/// The larger of two numbers; the second if either is none. `f32::max` is a call on the target.
pub(super) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

fn clipped(sigmas: f32) -> i16 {
    if sigmas < 0.0 {
        -clipped_above(-sigmas)
    } else {
        clipped_above(sigmas)
    }
}

/// Of a number that is not below zero, or none.
fn clipped_above(sigmas: f32) -> i16 {
    // To the nearest; a comparison with NaN is false.
    if sigmas < MOST_SIGMAS {
        (sigmas * PER_SIGMA + 0.5) as i32 as i16
    } else {
        (MOST_SIGMAS * PER_SIGMA) as i16
    }
}

fn squared_sigmas(squares: i32) -> f32 {
    squares as f32 / (PER_SIGMA * PER_SIGMA)
}

/// Square of a sum in its standard deviations.
fn mean_squared(sum: i32, systematic: i32, cycles: f32) -> f32 {
    let (sum, systematic) = (sum as f32, systematic as f32);
    sum * sum / (PER_SIGMA * PER_SIGMA * cycles + systematic * systematic)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Limits = Limits {
        short: 1.0,
        long: 1.0,
        squares: 1e9,
    };

    fn over(trace: &Trace, limits: Limits) -> f32 {
        trace.over_squared(limits).sqrt()
    }

    fn filled(with: impl Iterator<Item = (f32, f32)>) -> Trace {
        let mut trace = Trace::EMPTY;
        with.for_each(|(disagreement, systematic)| trace.push(disagreement, systematic));
        trace
    }

    #[test]
    fn sums_are_those_of_the_newest_and_never_drift() {
        let wild = (0..1_000_000_u32).map(|n| ((n.wrapping_mul(2_654_435_761) % 1000) as f32 - 500.0, 3.0));
        let trace = filled(wild.chain(core::iter::repeat_n((0.5, 0.0), LONG)));
        assert!((over(&trace, ONE) - 0.5 * 26.0_f32.sqrt()).abs() < 1e-6);
        assert!((over(&trace, Limits { long: 1e9, ..ONE }) - 0.5 * 6.0_f32.sqrt()).abs() < 1e-6);
        assert_eq!(
            trace.over_squared(Limits {
                short: 1e9,
                long: 1e9,
                squares: 6.5
            }),
            1.0
        );
        assert!(trace.variance().0.abs() < 1e-5);
    }

    #[test]
    fn means_count_from_a_second_on_and_grow_to_five() {
        for cycles in 1..=LONG {
            let over = over(&filled(core::iter::repeat_n((1.0, 0.0), cycles)), ONE);
            let expected = if cycles < SHORT { 0.0 } else { (cycles as f32).sqrt() };
            // The sum of squares adds the root of 26 over its limit.
            assert!((over - expected).abs() < 2e-4, "{cycles}: {over}");
        }
    }

    #[test]
    fn what_is_systematic_does_not_average_out_and_leaves_with_its_cycles() {
        let steady = filled(core::iter::repeat_n((2.0, 2.0), LONG));
        // 52 against sqrt(26 + 52^2).
        assert!((over(&steady, ONE) - 0.995).abs() < 1e-3, "{}", over(&steady, ONE));
        let gone = filled(core::iter::repeat_n((2.0, 2.0), LONG).chain(core::iter::repeat_n((0.0, 0.0), LONG)));
        assert_eq!(gone.over_squared(ONE), 0.0);
    }

    #[test]
    fn wild_values_and_those_that_are_no_numbers_are_clipped() {
        let wild = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30];
        let trace = filled(wild.into_iter().cycle().take(100).map(|sigmas| (sigmas, 0.0)));
        assert!(trace.over_squared(ONE).is_finite() && trace.variance().0 > 100.0);
    }
}
