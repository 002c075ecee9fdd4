//! The last five seconds of a disagreement: its mean over one second and over five, and its spread.
//!
//! In, each cycle: a disagreement, and the standard deviation of what in it is systematic, both in standard deviations of
//! noise. Out: how far the sums over the last [`SHORT`] and [`LONG`] cycles, and the sum of squares, are on the way to
//! their limits. Over `n` cycles noise of 1 adds to a variance of `n`; what is systematic may have the same sign all along and
//! adds to `(sum s)^2`. Kept as integers of 1/64, so that running sums are exact for ever, and clipped at 127, so that one
//! wild sample does not fill the window alone.
//!
//! What is systematic is the same for all sensors of a kind, so it is kept once for all their axes ([`Systematic`]), and
//! every axis keeps its disagreements in the same [`Cursor`]s.

use crate::root::root;

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

/// Where the cycle stands in a window: the newest place, which held the oldest, and that of the one [`SHORT`] before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cursor {
    newest: usize,
    left: usize,
}

/// A window over the newest values, in 1/64, with its sums.
#[derive(Clone, Copy, Debug)]
struct Window {
    ring: [i16; LONG],
    short: i32,
    sum: i32,
    squares: i32,
}

impl Window {
    const EMPTY: Window = Window {
        ring: [0; LONG],
        short: 0,
        sum: 0,
        squares: 0,
    };

    fn push(&mut self, cursor: Cursor, value: i16) {
        // Both are within it.
        let left = self.ring.get(cursor.left).copied().unwrap_or_default();
        let Some(newest) = self.ring.get_mut(cursor.newest) else {
            return;
        };
        let (new, left, old) = (i32::from(value), i32::from(left), i32::from(*newest));
        *newest = value;
        // The sums of 26 squares of 8128 stay within 32 bits; arithmetic that would check it is a tenth of the step.
        self.short = self.short.wrapping_add(new).wrapping_sub(left);
        self.sum = self.sum.wrapping_add(new).wrapping_sub(old);
        let squares = self.squares.wrapping_add(new.wrapping_mul(new));
        self.squares = squares.wrapping_sub(old.wrapping_mul(old));
    }
}

/// What is systematic of each of the newest cycles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Systematic {
    window: Window,
    next: u8,
}

/// What it adds to the variances of the three figures, in noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Added {
    short: f32,
    long: f32,
    squares: f32,
}

impl Systematic {
    pub(super) const NONE: Systematic = Systematic {
        window: Window::EMPTY,
        next: 0,
    };

    /// Takes a cycle; where that stands.
    pub(super) fn push(&mut self, sigmas: f32) -> Cursor {
        let newest = usize::from(self.next);
        let left = if newest < SHORT {
            newest + (LONG - SHORT)
        } else {
            newest - SHORT
        };
        self.next = if newest < LONG - 1 { newest as u8 + 1 } else { 0 };
        let cursor = Cursor { newest, left };
        self.window.push(cursor, clipped(sigmas));
        cursor
    }

    pub(super) fn added(&self) -> Added {
        let squared = |sum: i32| (sum as f32) * (sum as f32);
        Added {
            short: squared(self.window.short),
            long: squared(self.window.sum),
            squares: squared_sigmas(self.window.squares),
        }
    }

    /// What the sums of a full window are below whose figures are all below `part` of their limits, squared, if at least
    /// `relative` of the variance of what is systematic is in it: the roots that no axis then has to be asked for.
    pub(super) fn bounds(&self, limits: Limits, added: &Added, part: f32, relative: f32) -> Bounds {
        let mean = |limit: f32, cycles: usize, added: f32| {
            let variance = PER_SIGMA * PER_SIGMA * cycles as f32 + relative * added;
            // A root is within a millionth, and the sums are integers.
            (limit * root(part * variance)) as i32
        };
        Bounds {
            short: mean(limits.short, SHORT, added.short),
            long: mean(limits.long, LONG, added.long),
            squares: (PER_SIGMA * PER_SIGMA * part * limits.squares) as i32,
        }
    }

    /// Begins anew.
    pub(super) fn restart(&mut self) {
        self.window = Window::EMPTY;
    }
}

/// What sums of a window may reach.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    short: i32,
    long: i32,
    squares: i32,
}

/// A window over the newest disagreements of an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trace {
    window: Window,
    held: u8,
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
        window: Window::EMPTY,
        held: 0,
    };

    /// Takes a cycle; what is not a number is as wild as can be.
    pub(super) fn push(&mut self, cursor: Cursor, disagreement: f32) {
        self.window.push(cursor, clipped(disagreement));
        self.held = if self.held < LONG as u8 {
            self.held + 1
        } else {
            self.held
        };
    }

    /// Whether it holds [`LONG`] cycles.
    pub(super) fn full(&self) -> bool {
        usize::from(self.held) == LONG
    }

    /// Whether it is full and surely below `bounds`.
    pub(super) fn is_within(&self, bounds: &Bounds) -> bool {
        // Above the lower bound and below the upper one, in one comparison.
        let within = |sum: i32, most: i32| (sum.wrapping_add(most) as u32) < (most as u32).wrapping_mul(2);
        let window = &self.window;
        self.full()
            && within(window.short, bounds.short)
            && within(window.sum, bounds.long)
            && window.squares < bounds.squares
    }

    /// Square of the largest of its three figures, in parts of their limits: roots cost more than all the rest. What is
    /// systematic has `relative` of its variance in the noise of this axis. The means count from [`SHORT`] cycles on.
    pub(super) fn over_squared(&self, limits: Limits, added: &Added, relative: f32) -> f32 {
        let allowed = limits.squares + SYSTEMATIC_SQUARES * relative * added.squares;
        let spread = squared_sigmas(self.window.squares) / allowed;
        if usize::from(self.held) < SHORT {
            return spread;
        }
        let mean_squared = |sum: i32, cycles: f32, added: f32, limit: f32| {
            let sum = sum as f32;
            sum * sum / ((limit * limit) * (PER_SIGMA * PER_SIGMA * cycles + relative * added))
        };
        let short = mean_squared(self.window.short, SHORT as f32, added.short, limits.short);
        let long = mean_squared(self.window.sum, f32::from(self.held), added.long, limits.long);
        larger(spread, larger(short, long))
    }

    /// Variance of a full window about its mean, and the variance that is expected.
    pub(super) fn variance(&self, added: &Added, relative: f32) -> (f32, f32) {
        let mean = self.window.sum as f32 / (PER_SIGMA * LONG as f32);
        let expected = 1.0 + relative * added.squares / LONG as f32;
        (
            squared_sigmas(self.window.squares) / LONG as f32 - mean * mean,
            expected,
        )
    }
}

/// The larger of two numbers; the second if either is NaN. `f32::max` is a call on the target.
pub(super) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

fn clipped(sigmas: f32) -> i16 {
    const MOST: i16 = (MOST_SIGMAS * PER_SIGMA) as i16;
    // To the nearest: the cast takes off what is behind the point. A comparison with NaN is false.
    if sigmas < 0.0 {
        return if sigmas > -MOST_SIGMAS {
            (sigmas * PER_SIGMA - 0.5) as i32 as i16
        } else {
            -MOST
        };
    }
    if sigmas < MOST_SIGMAS {
        (sigmas * PER_SIGMA + 0.5) as i32 as i16
    } else {
        MOST
    }
}

fn squared_sigmas(squares: i32) -> f32 {
    squares as f32 * (1.0 / (PER_SIGMA * PER_SIGMA))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Limits = Limits {
        short: 1.0,
        long: 1.0,
        squares: 1e9,
    };

    /// A disagreement and what is systematic of it.
    struct Both(Trace, Systematic);

    impl Both {
        fn over_squared(&self, limits: Limits) -> f32 {
            self.0.over_squared(limits, &self.1.added(), 1.0)
        }

        fn variance(&self) -> (f32, f32) {
            self.0.variance(&self.1.added(), 1.0)
        }
    }

    fn over(both: &Both, limits: Limits) -> f32 {
        both.over_squared(limits).sqrt()
    }

    fn filled(with: impl Iterator<Item = (f32, f32)>) -> Both {
        let (mut trace, mut of_all) = (Trace::EMPTY, Systematic::NONE);
        with.for_each(|(disagreement, systematic)| trace.push(of_all.push(systematic), disagreement));
        Both(trace, of_all)
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
    fn what_is_within_the_bounds_is_below_the_limits_and_little_else_is_not() {
        const LIMITS: Limits = Limits {
            short: 5.0,
            long: 4.0,
            squares: 90.0,
        };
        let mut surely = 0;
        for n in 0..2_000_u32 {
            let random = |k: u32| (n.wrapping_mul(2_654_435_761).wrapping_add(k * 40_503) % 997) as f32 / 997.0;
            let size = 3.0 * random(1);
            let both = filled((0..LONG as u32).map(|k| (size * random(k) - 0.2, 0.3 * random(n))));
            let added = both.1.added();
            let within = both.0.is_within(&both.1.bounds(LIMITS, &added, 0.5, 1.0));
            let over = both.over_squared(LIMITS);
            assert!(!within || over < 0.5, "{n}: {over}");
            // Without what is systematic in the squares, which are few.
            assert!(within || over > 0.3, "{n}: {over}");
            surely += u32::from(within);
        }
        assert!(surely > 200 && surely < 1_800, "{surely}");
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
