//! Who is far off in this one cycle: the gate before the vector.
//!
//! In: values along axes with their variances. Out: the axes that agree within [`GATE`] standard deviations, and whether
//! that was decidable. As long as all agree nothing else is done.
//!
//! If some do not: four complete plates each say the whole vector. The largest group of plates that agree with each other
//! fixes it, and every axis is held against that; so one whole plate, or two different ones, of wild values do no harm. Two
//! groups as large as each other are not decidable. Without a group, as when single axes of three plates are off, the axis
//! that disagrees most is left out, and again, while there is redundancy.

use nalgebra::{ComplexField, Vector3};

use crate::{
    geometry::PLATES,
    redundancy::{Known, Solution, solve},
};

/// Standard deviations. Beyond it a value is not used; it changes the vector by at most a quarter of that unnoticed.
pub(super) const GATE: f32 = 6.0;
/// Of the squared distance of two plates' vectors in variances of a component: chi-square of three degrees of freedom at
/// the gate's probability.
const PLATE_GATE: f32 = 42.0;
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

    /// In standard deviations.
    pub(super) fn sigmas(&self) -> f32 {
        self.by.abs() / ComplexField::sqrt(self.variance)
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
            let sigmas = self
                .disagreement(k, solution)
                .map_or(0.0, |disagreement| disagreement.sigmas());
            if sigmas > worst.0 {
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
        match self.plates(candidates) {
            Plates::Group(group) => self.one_by_one(self.near(&self.solve(group), candidates)),
            Plates::None => self.one_by_one(candidates),
            Plates::Divided => (all, false),
        }
    }

    /// Those of `candidates` within the gate of a vector they may have a part in.
    fn near(&self, solution: &Solution, candidates: u16) -> u16 {
        let is_near = |k: &usize| {
            let (expected, variance) = solution.along(&self.axes_b[*k]);
            let off = self.values[*k] - expected;
            candidates >> k & 1 == 1 && off * off < GATE * GATE * (self.variances[*k] + variance)
        };
        (0..12).filter(is_near).fold(0, |axes, k| axes | 1 << k)
    }

    fn one_by_one(&self, candidates: u16) -> (Solution, bool) {
        let mut solution = self.solve(candidates);
        for _ in 0..candidates.count_ones() {
            let Some(worst) = self.worst(&solution) else { break };
            let fewer = self.solve(solution.used & !(1 << worst));
            if fewer.known != Known::All {
                return (solution, false);
            }
            solution = fewer;
        }
        (solution, true)
    }

    /// Which complete plates agree with each other.
    fn plates(&self, candidates: u16) -> Plates {
        let whole: [Option<Solution>; PLATES] = core::array::from_fn(|plate| {
            let axes = 0b111 << (3 * plate);
            (candidates & axes == axes)
                .then(|| self.solve(axes))
                .filter(|alone| alone.known == Known::All)
        });
        let agree = |i: usize, j: usize| match (&whole[i], &whole[j]) {
            (Some(a), Some(b)) => {
                let variance = (a.covariance_b.trace() + b.covariance_b.trace()) / 3.0;
                (a.vector_b - b.vector_b).norm_squared() < PLATE_GATE * variance
            }
            _ => false,
        };
        let is_group = |group: u8| {
            let members = |plate: &usize| group >> plate & 1 == 1;
            (0..PLATES)
                .filter(members)
                .all(|i| (i + 1..PLATES).filter(members).all(|j| agree(i, j)))
        };
        for size in [4, 3, 2] {
            let mut groups = (0..16_u8).filter(|group| group.count_ones() == size && is_group(*group));
            match (groups.next(), groups.next()) {
                // All four agree, so it is single axes that do not: the gate of a plate is wider.
                (Some(0b1111), _) => return Plates::None,
                (Some(group), None) => {
                    let axes = (0..PLATES).filter(|plate| group >> plate & 1 == 1);
                    return Plates::Group(axes.fold(0, |all, plate| all | 0b111 << (3 * plate)));
                }
                (Some(first), Some(second)) if first & second == 0 => return Plates::Divided,
                (Some(_), Some(_)) => return Plates::None,
                _ => {}
            }
        }
        Plates::None
    }
}

/// How the plates stand to each other.
enum Plates {
    /// The axes of the largest group that agrees.
    Group(u16),
    /// No group tells who is wrong.
    None,
    /// Two groups against each other.
    Divided,
}
