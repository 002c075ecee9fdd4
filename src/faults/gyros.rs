//! Four gyros: detection by their one parity, and who it was.
//!
//! In, each cycle: what the gyros measured, and what the vectors say of which is at fault ([`vector_rate`]). Out: the rate,
//! and what is held of each gyro.
//!
//! Four axes and three unknowns leave one dimension of parity, `p = n . y` with `n` the unit vector across the columns of
//! the axes (`n_i` is the signed volume of the other three; nominally `(1, 1, 1, sqrt 0.9) / sqrt 3.9`). It says that a gyro
//! is off by `p / n_i`, not which `i`. That is said by
//!
//! - the gyro itself, if it was not read, saturated or frozen;
//! - the rate before: when the parity leaps, the rate without the faulty gyro goes on as it was and the three others leap;
//! - the vectors: acceleration and field turned by the rate without each gyro in turn ([`vector_rate`]).
//!
//! Until one of them does, all four are used with the covariance widened, and the gyros are said not to be isolable. With a
//! gyro out the other three are not checked; the excluded one is, and comes back.
//!
//! [`vector_rate`]: super::vector_rate

use nalgebra::{ComplexField, Matrix3, SMatrix, Vector3, Vector4};

use super::{
    Cycle,
    health::Verdict,
    trace::{Limits, Systematic},
    watch::{QUIET, Watch},
};
use crate::{
    calibration::{Axis, Uncertainty},
    geometry::PLATES,
    redundancy::{Known, Solution, matrix, solve},
    root::{reciprocal_root, root},
};

/// Means over one and five seconds: 2e-7 and 3e-6 a test. Lower than for single axes, as there is one test, not 24, and as a
/// gyro's fault shows by half in the parity.
const LIMITS: Limits = Limits {
    short: 5.2,
    long: 4.8,
    squares: 90.0,
};
/// Standard deviations of a leap of the parity in one cycle.
const LEAP: f32 = 8.0;
/// A gyro has leapt if without it the rate changed so many times less than without any other.
const FAR: f32 = 3.0;
const ALL: u16 = 0b1111;
/// Quiet cycles after which a suspicion is dropped.
const QUIET_CYCLES: u8 = 52;

/// Four gyros under watch.
#[derive(Clone, Debug)]
pub(super) struct Gyros {
    axes_b: [Vector3<f32>; PLATES],
    /// Unit vector of the parity.
    across: [f32; PLATES],
    /// Least squares by all four, and its covariance for a variance of one.
    rate_from_all: SMatrix<f32, 3, PLATES>,
    of_one: Matrix3<f32>,
    /// All four have the same noise, so that these are the weighted ones too.
    alike: bool,
    /// By how much a parity of one moves the rate when each gyro is left out.
    without: [Vector3<f32>; PLATES],
    uncertainty: Uncertainty,
    /// \[s\] by how much the sampling instants are unsure.
    timing_s: f32,
    parity: Watch,
    watches: [Watch; PLATES],
    /// What is systematic of the parity, and of each gyro.
    of_parity: Systematic,
    of_gyros: [Systematic; PLATES],
    /// [rad/s] rate of the cycle before.
    course_b: Option<Vector3<f32>>,
    usual_b: Option<Vector3<f32>>,
    cycles: f32,
    quiet_for: u8,
    /// Cycles for which the parity is still doubted.
    doubted_for: u8,
    /// Parity of the cycle before, in standard deviations of the noise.
    last_sigmas: f32,
    leaping: Option<usize>,
    /// The parity is off and it is not known by whom.
    pub(super) suspect: bool,
}

impl Gyros {
    pub(super) fn new(axes: &[Axis; PLATES], uncertainty: Uncertainty, timing_s: f32) -> Self {
        let allowed = uncertainty.bias * uncertainty.bias;
        let axes_b = core::array::from_fn(|k| axes[k].axis_b);
        let across = across(&axes_b);
        let noise: [f32; PLATES] = core::array::from_fn(|k| axes[k].noise * axes[k].noise);
        // No set is accepted whose gyros do not span space, any three of them.
        let (rate_from_all, of_one) = matrix(&axes_b, ALL).unwrap_or_default();
        let parity_noise = (0..PLATES).map(|k| across[k] * across[k] * noise[k]).sum();
        Gyros {
            axes_b,
            across,
            rate_from_all,
            of_one,
            alike: noise.iter().all(|other| *other == noise[0]),
            without: core::array::from_fn(|k| {
                let (without, _) = matrix(&axes_b, ALL & !(1 << k)).unwrap_or_default();
                without * Vector4::from(across)
            }),
            uncertainty,
            timing_s,
            parity: Watch::new(parity_noise, allowed, parity_noise),
            watches: noise.map(|noise| Watch::new(noise, allowed, noise)),
            of_parity: Systematic::NONE,
            of_gyros: [Systematic::NONE; PLATES],
            course_b: None,
            usual_b: None,
            cycles: 0.0,
            quiet_for: 0,
            doubted_for: 0,
            last_sigmas: 0.0,
            leaping: None,
            suspect: false,
        }
    }

    /// Whether the parity is on its way to an alarm, or was not long ago; to be asked once a cycle.
    pub(super) fn is_doubted(&mut self) -> bool {
        self.doubted_for = self.doubted_for.saturating_sub(1);
        self.doubted_for > 0 || self.suspect
    }

    /// Gyros that are not believed.
    pub(super) fn excluded(&self) -> u16 {
        let each = self.watches.iter().enumerate();
        each.fold(0, |axes, (k, watch)| axes | u16::from(watch.excluded()) << k)
    }

    /// What is held of a gyro.
    pub(super) fn verdict(&self, plate: usize) -> Verdict {
        self.watches[plate].verdict
    }

    /// Takes a cycle.
    pub(super) fn step(&mut self, cycle: &Cycle<PLATES>) -> Solution {
        if cycle.frozen != 0 {
            for k in (0..PLATES).filter(|k| cycle.frozen >> k & 1 == 1) {
                self.blame(k, Verdict::Frozen);
            }
        }
        let candidates = cycle.present & !self.excluded();
        let systematic = self.systematic(cycle, candidates);
        let variances = core::array::from_fn(|k| self.watches[k].noise + systematic);
        let finite = cycle.values.iter().all(|value| value.abs() <= f32::MAX);
        let mut solution = if candidates == ALL && self.alike && finite {
            Solution {
                vector_b: self.rate_from_all * Vector4::from(*cycle.values),
                covariance_b: self.of_one * variances[0],
                known: Known::All,
                used: ALL,
            }
        } else {
            solve(&self.axes_b, cycle.values, &variances, candidates)
        };
        if candidates == ALL {
            self.check(cycle, &variances, systematic, &mut solution);
        } else {
            self.suspect = false;
        }
        if solution.known == Known::All {
            self.reconsider(cycle, &variances, systematic, &solution);
            self.remember(&solution);
        } else {
            self.course_b = None;
        }
        solution
    }

    /// [rad2/s2] what does not average out: scale and direction away from where the parity was learned, and angular
    /// acceleration within the uncertainty of the sampling instants.
    fn systematic(&self, cycle: &Cycle<PLATES>, candidates: u16) -> f32 {
        let rough_b = if candidates == ALL {
            self.rate_from_all * Vector4::from(*cycle.values)
        } else {
            solve(&self.axes_b, cycle.values, &[1.0; PLATES], candidates).vector_b
        };
        let Uncertainty { scale, direction, .. } = self.uncertainty;
        let from_usual = self.usual_b.map_or(0.0, |usual_b| (rough_b - usual_b).norm_squared());
        let acceleration = match (self.course_b, cycle.dt_s) {
            (Some(course_b), Some(dt_s)) => {
                // While one gyro leaps the others say how the unit turns.
                let change = match self.leaping {
                    Some(leaping) => {
                        solve(
                            &self.axes_b,
                            cycle.values,
                            &[1.0; PLATES],
                            candidates & !1_u16.wrapping_shl(leaping as u32),
                        )
                        .vector_b
                    }
                    None => rough_b,
                } - course_b;
                change.norm_squared() / (dt_s * dt_s)
            }
            _ => 0.0,
        };
        (scale * scale + direction * direction) * from_usual + self.timing_s * self.timing_s * acceleration
    }

    /// The parity of all four; the solution becomes that of those left.
    fn check(&mut self, cycle: &Cycle<PLATES>, variances: &[f32; PLATES], systematic: f32, solution: &mut Solution) {
        let parity = self.parity_of(cycle.values);
        let noise = self.parity.noise;
        let variance = noise + systematic + self.parity.offset_variance;
        if let Some(leapt) = self.leap(cycle, variances, parity * reciprocal_root(noise)) {
            self.watches[leapt].strike(true);
            if self.watches[leapt].alarm(LIMITS, &self.of_gyros[leapt].added()) >= 1.0 {
                self.blame(leapt, Verdict::Disagreeing);
            }
            *solution = solve(&self.axes_b, cycle.values, variances, ALL & !(1 << leapt));
            return;
        }
        if self.leaping.is_none() {
            self.watches.iter_mut().for_each(|watch| watch.strike(false));
        }
        let counted = (systematic + self.parity.offset_variance) / noise;
        let cursor = self.of_parity.push(root(counted));
        self.parity.note(cursor, parity, 1.0, counted);
        let alarm = self.parity.learn(parity, variance, LIMITS, &self.of_parity.added());
        self.quiet_for = if alarm < QUIET {
            self.quiet_for.saturating_add(1)
        } else {
            0
        };
        if alarm > QUIET {
            self.doubted_for = QUIET_CYCLES;
        }
        self.suspect = alarm > 1.0 || (self.suspect && self.quiet_for < QUIET_CYCLES);
        if self.suspect {
            solution.covariance_b *= 1.0 + parity * parity / variance;
        }
    }

    /// The gyro that has leapt in this cycle or goes on leaping, if the parity is `sigmas` and it is one only.
    fn leap(&mut self, cycle: &Cycle<PLATES>, variances: &[f32; PLATES], sigmas: f32) -> Option<usize> {
        let before = core::mem::replace(&mut self.last_sigmas, sigmas.abs());
        if sigmas.abs() < LEAP {
            self.leaping = None;
            return None;
        }
        if before > LEAP / 2.0 && self.leaping.is_none() {
            return None;
        }
        let leapt = self
            .alone(cycle, variances)
            .filter(|k| self.leaping.is_none_or(|before| before == *k));
        self.leaping = self.leaping.or(leapt);
        leapt
    }

    /// The one gyro without which the rate changed far less than without any other, if there is one.
    fn alone(&self, cycle: &Cycle<PLATES>, variances: &[f32; PLATES]) -> Option<usize> {
        let course_b = self.course_b?;
        let changes: [f32; PLATES] = core::array::from_fn(|k| {
            let without = solve(&self.axes_b, cycle.values, variances, ALL & !(1 << k));
            (without.vector_b - course_b).norm()
        });
        let least = (0..PLATES).fold(0, |least, k| if changes[k] < changes[least] { k } else { least });
        let clear = |k: usize| k == least || changes[k] > FAR * changes[least];
        (0..PLATES).all(clear).then_some(least)
    }

    /// Excludes a gyro. One that is frozen explains what others were accused of on the parity's word.
    pub(super) fn blame(&mut self, plate: usize, verdict: Verdict) {
        // What it disagreed by before is what the parity has learned, over its part in the parity.
        let part = self.across[plate];
        let watch = &mut self.watches[plate];
        watch.exclude(verdict);
        self.of_gyros[plate].restart();
        watch.offset = self.parity.offset / part;
        watch.offset_variance = self.parity.offset_variance / (part * part);
        if verdict == Verdict::Frozen {
            for watch in self.watches.iter_mut().filter(|watch| watch.verdict.is_unnamed()) {
                watch.verdict = Verdict::Sound;
                watch.restart();
            }
        }
        self.leaping = None;
        self.parity.restart();
        self.of_parity.restart();
        self.suspect = false;
    }

    /// Watches the excluded gyro, if it is the only one that is missing.
    fn reconsider(&mut self, cycle: &Cycle<PLATES>, variances: &[f32; PLATES], systematic: f32, solution: &Solution) {
        let watched = cycle.present & self.excluded();
        if watched == 0 {
            return;
        }
        for k in (0..PLATES).filter(|k| watched >> k & 1 == 1) {
            let (expected, variance) = solution.along(&self.axes_b[k]);
            let share = (variances[k] + variance) / variances[k];
            let watch = &mut self.watches[k];
            let disagreement = cycle.values[k] - watch.offset - expected;
            let counted = (systematic + watch.offset_variance / share) / watch.noise;
            let cursor = self.of_gyros[k].push(root(counted));
            watch.note(cursor, disagreement, share, counted);
            watch.reconsider(&self.of_gyros[k].added());
        }
    }

    fn remember(&mut self, solution: &Solution) {
        let rate_b = solution.vector_b;
        self.course_b = Some(rate_b);
        self.cycles = (self.cycles + 1.0).min(super::watch::MEMORY);
        let usual_b = self.usual_b.get_or_insert(rate_b);
        *usual_b += (rate_b - *usual_b) / self.cycles;
    }

    /// The rate without each gyro in turn; `None` unless all four are used. What four gyros measure is what their rate
    /// explains and the parity, so without one of them the rate is off from that of all by the parity alone. Its learned
    /// offset is taken out, which gives each of these the same bias.
    pub(super) fn without_each(&self, values: &[f32; PLATES], used: u16) -> Option<[Vector3<f32>; PLATES]> {
        if used != ALL {
            return None;
        }
        let rate_b = self.rate_from_all * Vector4::from(*values);
        let parity = self.parity_of(values);
        Some(self.without.map(|moved_b| rate_b + moved_b * parity))
    }

    /// Parity beyond its learned offset.
    fn parity_of(&self, values: &[f32; PLATES]) -> f32 {
        let parts = self.across.iter().zip(values);
        parts.fold(0.0, |sum, (across, value)| sum + across * value) - self.parity.offset
    }
}

/// Unit vector of the parity: across the three columns of the axes.
fn across(axes_b: &[Vector3<f32>; PLATES]) -> [f32; PLATES] {
    let [a, b, c, d] = axes_b;
    let volume = |x: &Vector3<f32>, y: &Vector3<f32>, z: &Vector3<f32>| x.dot(&y.cross(z));
    let across = [volume(b, c, d), -volume(a, c, d), volume(a, b, d), -volume(a, b, c)];
    let length = ComplexField::sqrt(across.iter().map(|part| part * part).sum::<f32>());
    across.map(|part| part / length)
}

#[cfg(test)]
mod tests;
