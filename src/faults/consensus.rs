//! Who is far off in this one cycle: the gate before the vector.
//!
//! In: values along axes with their variances. Out: the axes that agree within [`GATE`] standard deviations, and whether
//! that was decidable. As long as all agree nothing else is done.
//!
//! If some do not, the axis that disagrees most is left out, and again, while there is redundancy. Of one wild sensor, or two
//! on different plates, the wild axes disagree most at every step, as each shows in the others at a third at most.

use nalgebra::Vector3;

use super::root::reciprocal_root;
use crate::redundancy::{Known, Solution, solve};

/// Standard deviations. Beyond it a value is not used; it changes the vector by at most a quarter of that unnoticed.
pub(super) const GATE: f32 = 6.0;
/// An axis that explains itself to more than this part has no redundancy left.
const UNCHECKED: f32 = 0.05;

/// A vector out of those that agree.
pub(super) struct Agreement {
    pub(super) solution: Solution,
    /// What it expects of each axis, and the variance of that.
    pub(super) expected: [(f32, f32); 12],
    /// Whether it was decidable who agrees.
    pub(super) decided: bool,
}

/// Values along axes.
pub(super) struct Values<'a> {
    pub(super) axes_b: &'a [Vector3<f32>; 12],
    pub(super) values: &'a [f32; 12],
    pub(super) variances: &'a [f32; 12],
}

/// What disagrees with the others and by how much: against the vector of all but itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disagreement {
    /// [unit] measured less expected.
    pub(super) by: f32,
    /// [unit2] its variance.
    pub(super) variance: f32,
}

impl Disagreement {
    /// Of `value` with `variance` along an axis of which `solution` expects `expected`; `None` if nothing else says
    /// anything about it. A used value pulls the vector its own way: the residual `r` of one with leverage `l` is a
    /// disagreement of `r / (1 - l)` with the vector without it, of variance `v / (1 - l)`.
    pub(super) fn of(value: f32, variance: f32, expected: (f32, f32), used: bool) -> Option<Self> {
        let residual = value - expected.0;
        if !used {
            return Some(Disagreement {
                by: residual,
                variance: variance + expected.1,
            });
        }
        let free = 1.0 - expected.1 / variance;
        (free > UNCHECKED).then(|| Disagreement {
            by: residual / free,
            variance: variance / free,
        })
    }
}

impl Values<'_> {
    fn solve(&self, wanted: u16) -> Agreement {
        let solution = solve(self.axes_b, self.values, self.variances, wanted);
        let expected = self.axes_b.map(|axis_b| solution.along(&axis_b));
        Agreement {
            solution,
            expected,
            decided: true,
        }
    }

    pub(super) fn disagreement(&self, k: usize, found: &Agreement) -> Option<Disagreement> {
        let used = found.solution.used >> k & 1 == 1;
        Disagreement::of(self.values[k], self.variances[k], found.expected[k], used)
    }

    /// The used axis that disagrees most, if any beyond the gate. With the leverage `l` a residual `r` is a disagreement of
    /// `r / sqrt(v (1 - l))` standard deviations; looked at squared first, as the root is seldom needed.
    fn worst(&self, found: &Agreement) -> Option<usize> {
        let mut worst = (GATE, None);
        for k in (0..12).filter(|k| found.solution.used >> k & 1 == 1) {
            let (expected, explained) = found.expected[k];
            let (residual, free) = (self.values[k] - expected, self.variances[k] - explained);
            if residual * residual > GATE * GATE * free && free > UNCHECKED * self.variances[k] {
                let sigmas = residual.abs() * reciprocal_root(free);
                if sigmas > worst.0 {
                    worst = (sigmas, Some(k));
                }
            }
        }
        worst.1
    }

    /// The vector of those of `candidates` that agree.
    pub(super) fn agreed(&self, candidates: u16) -> Agreement {
        let mut found = self.solve(candidates);
        if found.solution.known != Known::All {
            return found;
        }
        for _ in 0..candidates.count_ones() {
            let Some(worst) = self.worst(&found) else { break };
            let fewer = self.solve(found.solution.used & !(1 << worst));
            if fewer.solution.known != Known::All {
                found.decided = false;
                break;
            }
            found = fewer;
        }
        found
    }
}
