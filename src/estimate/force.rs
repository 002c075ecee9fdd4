//! Specific force over a period: the mean of the packet's reading and of those before it, each turned to the packet's.
//!
//! In: the readings between two cycles, as they come or with the cycle; then the cycle's force as [`Sampled`] and how far b
//! turned. Out: the mean in the same place, and its variance. With `c` counts, `s_k` and `h_k` an axis' scale and direction,
//! `f` the force of the cycle before and `a` the rotation vector from that cycle to the reading,
//!
//! ```text
//! y_k = s_k (c_k' - c_k)        f' = f + P sum h_k y_k,  P = (sum h_k h_k^T)^-1        sum of exp(a x) f'
//! ```
//!
//! Bias, temperature and what the axes disagree on are in `f` already; for the difference the scale at the reference
//! temperature is enough. The rotations up to the readings are nominal; what the calibration says of the period's is spread
//! evenly over it when the cycle comes.
//!
//! **What the mean hides.** Vibration that is folded down to nothing that moves from packet to packet still moves from reading to
//! reading: what each is off the line through the two before it has a sixth of its square as a variance of a reading. The mean of `n`
//! readings has an `n`-th of it, and its [`Sampled::scatter`] says that nothing is at rest.
//!
//! Leaves out a reading of which a used axis was not read or stands at the end of its range, one whose axes do not agree on
//! a vector (parity: what is left of `y` has three degrees of freedom less than there are axes), and all of a period after
//! which other axes are used than before it. So a fault costs the mean, not the attitude. One whose axes do not agree still shows
//! how far the force scatters: parts that measure some milliseconds apart disagree where it moves fast.

use nalgebra::{Matrix3, Vector3};

use crate::{
    calibration::Set,
    geometry::TRIAD_AXES,
    increments::{Force, Forces},
    kalman::Sampled,
    redundancy::{Known, Solution, solve},
};

/// The readings of a period so far, and what they are compared with.
#[derive(Clone, Debug)]
pub(super) struct Averager {
    /// Axes used in the cycle before, bit `k` the `k`-th, and least squares over them: found anew only when they are others.
    used: u16,
    covariance_b: Option<Matrix3<f32>>,
    /// The cycle before: its reading, and the force that was found.
    acc_p: [[i16; 3]; 4],
    force_b: Vector3<f32>,
    /// Which packet the readings taken come before, and how many those are.
    counter: u16,
    taken: usize,
    /// Sum of those that were not left out, in b as it was at the cycle before, and how many.
    sum_b: Vector3<f32>,
    kept: f32,
    /// \[s\] sum of what the rotations up to them cover.
    covered_s: f32,
    /// The two forces before, the latest first, in the same b.
    before_b: [Option<Vector3<f32>>; 2],
    /// [m2/s4] sum of a sixth of the square by which each is off the line through the two before it, and how many.
    unforeseen: f32,
    lines: f32,
}

/// How far b turned in a period.
pub(super) struct Turn {
    /// \[rad\] over the increment, calibrated and without bias; a rotation vector in b.
    pub calibrated_b: Vector3<f32>,
    /// \[rad\] over the increment, as its readings have it.
    pub nominal_b: [f32; 3],
    /// \[rad\] from the end of the increment to the cycle's reading of force.
    pub since_b: Vector3<f32>,
    /// \[s\] of the increment.
    pub covered_s: f32,
}

/// \[counts\] beyond these an accelerometer's 12 bits end.
const RANGE: core::ops::Range<i16> = -2047..2047;

/// So many times its variance may be left over of a difference that a vector does not explain: nine degrees of freedom
/// leave six times as much once in fifty million readings.
const PARITY: f32 = 6.0;
/// [m/s2] an axis may be off by this: plates are apart, and a hand turns them by 10 rad/s2.
const APART: f32 = 0.3;
/// And by this part of the difference, for axes that a calibration does not know better.
const MISALIGNED: f32 = 0.05;

impl Averager {
    /// Before the first cycle.
    pub const EMPTY: Averager = Averager {
        used: 0,
        covariance_b: None,
        acc_p: Force::NONE.acc_p,
        force_b: Vector3::new(0.0, 0.0, 0.0),
        counter: 0,
        taken: 0,
        sum_b: Vector3::new(0.0, 0.0, 0.0),
        kept: 0.0,
        covered_s: 0.0,
        before_b: [None; 2],
        unforeseen: 0.0,
        lines: 0.0,
    };

    /// Takes the next reading before the packet with this counter. Those taken before another are of a cycle that was lost,
    /// and forgotten.
    pub fn take(&mut self, counter: u16, reading: &Force, set: &Set) {
        if self.counter != counter {
            self.forget();
            self.counter = counter;
        }
        self.taken = self.taken.saturating_add(1);
        if let Some((change_b, agrees)) = self.change(reading, set) {
            let nominal_b = Vector3::from(reading.angle_b);
            let covered_us = reading.covered_us.max(1) as f32;
            let angle_b = nominal_b + nominal_b * (reading.after_us as f32 / covered_us);
            let force_b = turned(self.force_b + change_b, &-angle_b);
            if let [Some(last_b), Some(last_but_one_b)] = self.before_b {
                self.unforeseen += off(&force_b, &line_b(&last_b, &last_but_one_b));
                self.lines += 1.0;
            }
            self.before_b = [Some(force_b), self.before_b[0]];
            if agrees {
                self.sum_b += force_b;
                self.kept += 1.0;
                self.covered_s += reading.covered_us as f32 * 1e-6;
            }
        }
    }

    /// [m/s2] what a reading's force is more than that of the cycle before, in b of the reading, and whether its axes agree on it.
    fn change(&self, reading: &Force, set: &Set) -> Option<(Vector3<f32>, bool)> {
        let covariance_b = self.covariance_b.as_ref()?;
        let (mut along_b, mut squares, mut white) = (Vector3::zeros(), 0.0, 0.0);
        let mut left = self.used;
        let counts = self.acc_p.as_flattened().iter().zip(reading.acc_p.as_flattened());
        for (axis, (before, now)) in set.acc.iter().zip(counts) {
            if left & 1 == 1 {
                if !RANGE.contains(now) {
                    return None;
                }
                let change = axis.scale * (i32::from(*now) - i32::from(*before)) as f32;
                along_b += axis.axis_b * change;
                squares += change * change;
                white += axis.noise * axis.noise;
            }
            left >>= 1;
        }
        let change_b = covariance_b * along_b;
        let over = squares - change_b.dot(&along_b);
        let axes = self.used.count_ones() as f32;
        // A difference has twice the variance of a reading.
        let each = 2.0 * PARITY * white + APART * APART * axes;
        let most = each * (axes - 3.0) / axes + MISALIGNED * MISALIGNED * squares;
        Some((change_b, over <= most))
    }

    /// Makes the force of a cycle, found with the axes `used`, the mean of itself and of the readings before it, with the variance
    /// that they show.
    pub fn average(&self, force: &mut Sampled, used: u16, turn: &Turn) {
        if self.used != used {
            return;
        }
        let turned_b = turn.calibrated_b + turn.since_b;
        let (mut unforeseen, mut lines) = (self.unforeseen, self.lines);
        if let [Some(last_b), Some(last_but_one_b)] = self.before_b {
            unforeseen += off(&force.value_b, &turned(line_b(&last_b, &last_but_one_b), &turned_b));
            lines += 1.0;
        }
        if lines > 0.0 {
            force.is_of_readings_with(unforeseen / (3.0 * lines));
        }
        if self.kept <= 0.0 {
            return;
        }
        // What the calibration adds to the nominal turn up to a reading, in the mean.
        let part = self.covered_s / (self.kept * turn.covered_s);
        let added_b = (turn.calibrated_b - Vector3::from(turn.nominal_b)) * part;
        let sum_b = self.sum_b + added_b.cross(&self.sum_b);
        let each = 1.0 / (self.kept + 1.0);
        force.value_b = (force.value_b + turned(sum_b, &turned_b)) * each;
        force.variance *= each;
    }

    /// Takes those readings before a packet that were not taken yet.
    pub fn complete(&mut self, counter: u16, forces: &Forces, set: &Set) {
        if self.counter != counter {
            self.forget();
        }
        for reading in forces.iter().skip(self.taken).filter(|reading| !reading.is_none()) {
            self.take(counter, reading, set);
        }
    }

    fn forget(&mut self) {
        (self.taken, self.kept, self.covered_s) = (0, 0.0, 0.0);
        self.sum_b = Vector3::zeros();
        self.before_b = [Some(self.force_b), None];
        (self.unforeseen, self.lines) = (0.0, 0.0);
    }

    /// The next period begins with a cycle's reading and its force.
    pub fn begin(&mut self, acc_p: &[[i16; 3]; 4], force: &Solution, set: &Set) {
        let used = if force.known == Known::All { force.used } else { 0 };
        if self.used != used {
            self.used = used;
            self.covariance_b = covariance(set, used);
        }
        self.acc_p = *acc_p;
        self.force_b = force.vector_b;
        self.forget();
    }
}

#[inline(never)]
fn covariance(set: &Set, used: u16) -> Option<Matrix3<f32>> {
    let axes_b = set.acc.map(|axis| axis.axis_b);
    let found = solve(&axes_b, &[0.0; TRIAD_AXES], &[1.0; TRIAD_AXES], used);
    (found.known == Known::All).then_some(found.covariance_b)
}

/// Where the line through two forces goes.
fn line_b(last_b: &Vector3<f32>, last_but_one_b: &Vector3<f32>) -> Vector3<f32> {
    last_b * 2.0 - last_but_one_b
}

/// By how much a force is off that line, as the square that has the variance of one of the three.
fn off(force_b: &Vector3<f32>, foreseen_b: &Vector3<f32>) -> f32 {
    (force_b - foreseen_b).norm_squared() / 6.0
}

/// Components of a vector that stands still, after b turned: `exp(-d x) v` by the Gibbs vector `tan(d/2)`, whose series to
/// third order is good to 0.006 for 1 rad.
fn turned(vector_b: Vector3<f32>, by_b: &Vector3<f32>) -> Vector3<f32> {
    let gibbs_b = by_b * (0.5 + by_b.norm_squared() * (1.0 / 24.0));
    let across_b = vector_b.cross(&gibbs_b);
    vector_b + (across_b + across_b.cross(&gibbs_b)) * (2.0 / (1.0 + gibbs_b.norm_squared()))
}

#[cfg(test)]
mod tests;
