//! Who is far off in this one cycle: the gate before the vector.
//!
//! In: values along axes with their variances. Out: the axes that agree within [`GATE`] standard deviations, and whether
//! that was decidable. As long as all agree nothing else is done.
//!
//! If some do not, the axis that disagrees most is left out, and again, while there is redundancy. Of one wild sensor, or two
//! on different plates, the wild axes disagree most at every step, as each shows in the others at a third at most.

use nalgebra::{ComplexField, Vector3};

use crate::redundancy::{Known, Solution, solve};

/// Standard deviations. Beyond it a value is not used; it changes the vector by at most a quarter of that unnoticed.
pub(super) const GATE: f32 = 6.0;
/// An axis that explains itself to more than this part has no redundancy left.
const UNCHECKED: f32 = 0.05;

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

    /// In standard deviations, if it is beyond the gate. Looked at squared first: the root is seldom needed.
    fn beyond_gate(&self) -> Option<f32> {
        if self.by * self.by <= GATE * GATE * self.variance {
            return None;
        }
        Some(self.by.abs() / ComplexField::sqrt(self.variance)).filter(|sigmas| *sigmas > GATE)
    }
}

impl Values<'_> {
    pub(super) fn solve(&self, wanted: u16) -> Solution {
        solve(self.axes_b, self.values, self.variances, wanted)
    }

    pub(super) fn disagreement(&self, k: usize, solution: &Solution) -> Option<Disagreement> {
        let used = solution.used >> k & 1 == 1;
        Disagreement::of(self.values[k], self.variances[k], solution.along(&self.axes_b[k]), used)
    }

    /// The used axis that disagrees most, if any beyond the gate.
    fn worst(&self, solution: &Solution) -> Option<usize> {
        let mut worst = (GATE, None);
        for k in (0..12).filter(|k| solution.used >> k & 1 == 1) {
            let beyond = self
                .disagreement(k, solution)
                .and_then(|disagreement| disagreement.beyond_gate());
            if let Some(sigmas) = beyond.filter(|sigmas| *sigmas > worst.0) {
                worst = (sigmas, Some(k));
            }
        }
        worst.1
    }

    /// The vector of those of `candidates` that agree, and whether it was decidable which do.
    pub(super) fn agreed(&self, candidates: u16) -> (Solution, bool) {
        let all = self.solve(candidates);
        if all.known != Known::All || self.worst(&all).is_none() {
            return (all, true);
        }
        self.one_by_one(all, candidates.count_ones())
    }

    fn one_by_one(&self, mut solution: Solution, most: u32) -> (Solution, bool) {
        for _ in 0..most {
            let Some(worst) = self.worst(&solution) else { break };
            let fewer = self.solve(solution.used & !(1 << worst));
            if fewer.known != Known::All {
                return (solution, false);
            }
            solution = fewer;
        }
        (solution, true)
    }
}
