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
    /// How far each axis is from what the vector expects of it, and the variance of what is expected.
    pub(super) off: [(f32, f32); 12],
    /// The used axis that disagrees most, if any beyond the gate.
    worst: Option<usize>,
    /// Whether it was decidable who agrees.
    pub(super) decided: bool,
}

/// Values along axes.
pub(super) struct Values<'a> {
    pub(super) values: &'a [f32; 12],
    pub(super) variances: &'a [f32; 12],
}

/// What disagrees with the others and by how much: against the vector of all but itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disagreement {
    /// [unit] measured less expected.
    pub(super) by: f32,
    /// [1] its variance, in those of the axis.
    pub(super) share: f32,
}

impl Disagreement {
    /// Of an axis with `variance` that is `off` by so much from what a vector expects of it with some variance; `None` if
    /// nothing else says anything about it. A used value pulls the vector its own way: the residual `r` of one with
    /// leverage `l` is a disagreement of `r / (1 - l)` with the vector without it, of variance `v / (1 - l)`.
    pub(super) fn of((residual, explained): (f32, f32), variance: f32, used: bool) -> Option<Self> {
        let leverage = explained / variance;
        if !used {
            return Some(Disagreement {
                by: residual,
                share: 1.0 + leverage,
            });
        }
        let free = 1.0 - leverage;
        (free > UNCHECKED).then(|| Disagreement {
            by: residual / free,
            share: 1.0 / free,
        })
    }
}

impl Agreement {
    /// Of nothing yet.
    pub(super) const NOTHING: Agreement = Agreement {
        solution: Solution::NOTHING,
        off: [(0.0, 0.0); 12],
        worst: None,
        decided: true,
    };

    /// Takes a solution, and holds every axis against it. With the leverage `l` a residual `r` is a disagreement of
    /// `r / sqrt(v (1 - l))` standard deviations; looked at squared first, as the root is seldom needed.
    fn take(&mut self, solution: Solution, axes_b: &[Vector3<f32>; 12], values: &Values) {
        self.solution = solution;
        let mut worst = (GATE, None);
        let axes = axes_b.iter().zip(values.values).zip(values.variances);
        for (k, (((axis_b, value), variance), off)) in axes.zip(&mut self.off).enumerate() {
            let (expected, explained) = self.solution.along(axis_b);
            let (residual, free) = (value - expected, variance - explained);
            *off = (residual, explained);
            // Seldom true, so asked first.
            if residual * residual > GATE * GATE * free
                && free > UNCHECKED * variance
                && self.solution.used >> k & 1 == 1
            {
                let sigmas = residual.abs() * reciprocal_root(free);
                if sigmas > worst.0 {
                    worst = (sigmas, Some(k));
                }
            }
        }
        self.worst = worst.1;
    }
}

impl Values<'_> {
    /// The vector of those of `candidates` that agree.
    pub(super) fn agree(&self, axes_b: &[Vector3<f32>; 12], candidates: u16, found: &mut Agreement) {
        let solved = |wanted| solve(axes_b, self.values, self.variances, wanted);
        found.take(solved(candidates), axes_b, self);
        if found.solution.known != Known::All {
            return;
        }
        while let Some(worst) = found.worst {
            let fewer = solved(found.solution.used & !(1 << worst));
            if fewer.known != Known::All {
                found.decided = false;
                break;
            }
            found.take(fewer, axes_b, self);
        }
    }
}
