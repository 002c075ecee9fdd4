//! Who is far off in this one cycle: the gate before the vector.
//!
//! In: values along axes with their variances. Out: the axes that agree within [`GATE`] standard deviations, and whether
//! that was decidable. As long as all agree nothing else is done.
//!
//! If some do not, the axis that disagrees most is left out, and again, while there is redundancy. Of one wild sensor, or two
//! on different plates, the wild axes disagree most at every step, as each shows in the others at a third at most.

use nalgebra::Vector3;

use crate::redundancy::{Known, Seen, Solution, solve_seen};
use crate::root::reciprocal_root;

/// Standard deviations. Beyond it a value is not used; it changes the vector by at most a quarter of that unnoticed.
pub(super) const GATE: f32 = 6.0;
/// An axis that explains itself to more than this part has no redundancy left.
const UNCHECKED: f32 = 0.05;

/// What disagrees with the others and by how much: against the vector of all but itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disagreement {
    /// [unit] measured less expected.
    pub(super) by: f32,
    /// \[1\] its variance, in those of the axis.
    pub(super) share: f32,
}

impl Disagreement {
    /// Of an axis that was held against a vector; `None` if nothing else says anything about it. A used value pulls the
    /// vector its own way: the residual `r` of one with leverage `l` is a disagreement of `r / (1 - l)` with the vector
    /// without it, of variance `v / (1 - l)`.
    pub(super) fn of(seen: &Seen, used: bool) -> Option<Self> {
        let (residual, explained) = seen.off;
        let leverage = explained / seen.variance;
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

/// The vector of those of `candidates` that agree, in its place; every axis is held against it. Whether it was decidable
/// who agrees.
pub(super) fn agreed(
    axes_b: &[Vector3<f32>; 12],
    seen: &mut [Seen; 12],
    candidates: u16,
    solution: &mut Solution,
) -> bool {
    solve_seen(axes_b, seen, candidates, solution);
    let mut worst = held_against(solution, axes_b, seen);
    if solution.known != Known::All {
        return true;
    }
    while let Some(k) = worst {
        let mut fewer = Solution::NOTHING;
        solve_seen(axes_b, seen, solution.used & !(1 << k), &mut fewer);
        if fewer.known != Known::All {
            return false;
        }
        *solution = fewer;
        worst = held_against(solution, axes_b, seen);
    }
    true
}

/// Holds every axis against a vector. The used one that disagrees most, if any beyond the gate: with the leverage `l` a
/// residual `r` is a disagreement of `r / sqrt(v (1 - l))` standard deviations; looked at squared first, as the root is
/// seldom needed.
fn held_against(solution: &Solution, axes_b: &[Vector3<f32>; 12], seen: &mut [Seen; 12]) -> Option<usize> {
    let mut worst = (GATE, None);
    let mut used = solution.used;
    // By number: in an image that checks its sums, walking two arrays together costs as much as what is done there.
    for k in 0..axes_b.len() {
        let (axis_b, seen) = (&axes_b[k], &mut seen[k]);
        let (expected, explained) = solution.along(axis_b);
        let (residual, free) = (seen.value - expected, seen.variance - explained);
        seen.off = (residual, explained);
        // Seldom true, so asked first.
        if residual * residual > GATE * GATE * free && free > UNCHECKED * seen.variance && used & 1 == 1 {
            let sigmas = residual.abs() * reciprocal_root(free);
            if sigmas > worst.0 {
                worst = (sigmas, Some(k));
            }
        }
        used >>= 1;
    }
    worst.1
}

#[cfg(test)]
mod tests;
