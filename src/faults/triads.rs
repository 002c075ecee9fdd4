//! Four sensors of three axes: detection and isolation among their twelve axes.
//!
//! In, each cycle: what the axes measured, which of them may be used, and by how much plates may differ for reasons of time
//! and place. Out: the vector, and what is held of each axis.
//!
//! With twelve axes and three unknowns there are nine dimensions of parity. The disagreement of axis `k` with the vector of
//! all others is the likelihood-ratio statistic of a fault of that axis alone (J. Potter and M. Suman, "Thresholdless
//! redundancy management with arrays of skewed instruments", AGARDograph 224, 1977; W. Baarda's data snooping). A fault of
//! one axis shows in the others at a third at most, for `h_j . h_k / 3` is the correlation of two axes, so the largest is the
//! faulty one; where two hypotheses are told apart by less than [`ALIKE`], it is said not to be isolable. Axes are excluded
//! one a cycle, and the windows begin anew with the new company. When a second axis of a sensor goes, its third goes too.

use nalgebra::{ComplexField, Vector3};

use super::{
    Cycle,
    consensus::{Disagreement, agreed},
    health::Verdict,
    trace::{Limits, Systematic, larger},
    watch::{QUIET, Watch},
};
use crate::{
    calibration::{Axis, Uncertainty},
    geometry::{PLATES, TRIAD_AXES},
    redundancy::{Known, Seen, Solution, solve_seen},
    root::root,
};

/// Means over one and five seconds, for less than one false alarm of 24 axes in ten hours of simulated rest. Sum of squares:
/// chi-square of 26 degrees of freedom, 1e-8.
const LIMITS: Limits = Limits {
    short: 5.6,
    long: 5.1,
    squares: 90.0,
};
/// Faults whose traces in parity space have this cosine at least cannot be told apart.
const ALIKE: f32 = 0.9;
/// Cycles after which what another axis resembles is forgotten.
const LIKENESS_CYCLES: f32 = 8.0;
/// An axis resembles another quantity if it differs from it by less than this many standard deviations.
const RESEMBLES: f32 = 3.0;
/// ... and from what it should measure by more than this many.
const DIFFERS: f32 = 6.0;

/// Why sensors of one kind differ whatever the vector is.
pub(super) struct Apart {
    /// [rad/s] rate within the uncertainty of the sampling instants.
    pub(super) rate: f32,
    /// [unit] standard deviation of what differs from place to place.
    pub(super) by_place: f32,
}

/// Twelve axes under watch.
#[derive(Clone, Debug)]
pub(super) struct Triads {
    axes_b: [Vector3<f32>; TRIAD_AXES],
    uncertainty: Uncertainty,
    /// \[s\] by how much the sensors' sampling instants are unsure.
    timing_s: f32,
    watches: [Watch; TRIAD_AXES],
    /// What is systematic of all of them, counted in the noise of the least noisy.
    of_all: Systematic,
    /// [1/unit2] one over the variance of that.
    per_noise: f32,
    /// \[1\] that variance in the noise of the noisiest.
    least_relative: f32,
    /// Squared differences from what it should be, its negative, the next and the one after next axis of its sensor.
    likeness: [[f32; 4]; TRIAD_AXES],
    /// The vector the offsets were learned at.
    usual_b: Option<Vector3<f32>>,
    last_b: Option<Vector3<f32>>,
    cycles: f32,
    /// What the axes measured in the latest cycle, and how far that was from its vector.
    seen: [Seen; TRIAD_AXES],
    /// The vector of the latest cycle.
    pub(super) solution: Solution,
    /// Axes present and what was systematic in that cycle, if it is still to be watched.
    late: Option<(u16, f32)>,
    /// It is not decidable which axis is at fault.
    pub(super) undecided: bool,
}

impl Triads {
    pub(super) fn new(axes: &[Axis; TRIAD_AXES], uncertainty: Uncertainty, timing_s: f32) -> Self {
        let least = axes.iter().fold(f32::MAX, |least, axis| least.min(axis.noise));
        let most = axes.iter().fold(0.0_f32, |most, axis| most.max(axis.noise));
        let (noise, allowed) = (least * least, uncertainty.bias * uncertainty.bias);
        Triads {
            axes_b: core::array::from_fn(|k| axes[k].axis_b),
            uncertainty,
            timing_s,
            watches: axes.map(|axis| Watch::new(axis.noise * axis.noise, allowed, noise)),
            of_all: Systematic::NONE,
            per_noise: 1.0 / noise,
            least_relative: noise / (most * most),
            likeness: [[0.0; 4]; TRIAD_AXES],
            usual_b: None,
            last_b: None,
            cycles: 0.0,
            seen: [Seen::default(); TRIAD_AXES],
            solution: Solution::NOTHING,
            late: None,
            undecided: false,
        }
    }

    /// Axes that are not believed.
    pub(super) fn excluded(&self) -> u16 {
        let (mut bit, mut excluded) = (1, 0);
        for watch in &self.watches {
            if watch.excluded() {
                excluded |= bit;
            }
            bit <<= 1;
        }
        excluded
    }

    /// What is held of axis `k`.
    pub(super) fn verdict(&self, k: usize) -> Verdict {
        self.watches[k].verdict
    }

    /// Takes a cycle.
    pub(super) fn step(&mut self, cycle: &Cycle<TRIAD_AXES>, apart: &Apart) {
        let doubled = self.catch_up();
        if cycle.frozen != 0 {
            for k in (0..TRIAD_AXES).filter(|k| cycle.frozen.wrapping_shr(*k as u32) & 1 == 1) {
                self.watches[k].exclude(Verdict::Frozen);
            }
        }
        let candidates = cycle.present & !self.excluded();
        for k in 0..TRIAD_AXES {
            let (seen, watch) = (&mut self.seen[k], &self.watches[k]);
            seen.value = cycle.values[k] - watch.offset;
            seen.variance = watch.noise + watch.offset_variance;
        }
        let systematic = self.systematic(cycle.dt_s, apart, &self.seen, candidates);
        for seen in &mut self.seen {
            seen.variance += systematic;
        }
        let decided = agreed(&self.axes_b, &mut self.seen, candidates, &mut self.solution);
        self.undecided = !decided || doubled;
        if self.solution.known != Known::All {
            self.last_b = None;
        } else if decided {
            if cycle.watched_later {
                self.late = Some((cycle.present, systematic));
            } else {
                self.watch(cycle.present, systematic);
            }
            self.remember();
        }
    }

    /// Watches the cycle before, if that was put off: nothing has asked since. Whether it was not isolable then.
    fn catch_up(&mut self) -> bool {
        let Some((present, systematic)) = self.late.take() else {
            return false;
        };
        self.undecided = false;
        self.watch(present, systematic);
        self.undecided
    }

    /// \[unit2\] what does not average out: scale and direction as far as the vector is not where the offsets were learned,
    /// motion within the uncertainty of the sampling instants, and what differs by place.
    fn systematic(&self, dt_s: Option<f32>, apart: &Apart, seen: &[Seen; TRIAD_AXES], candidates: u16) -> f32 {
        let rough_b = self.rough(seen, candidates);
        let Uncertainty { scale, direction, .. } = self.uncertainty;
        let relative = scale * scale + direction * direction;
        let from_usual = self.usual_b.map_or(0.0, |usual_b| (rough_b - usual_b).norm_squared());
        let turned = apart.rate * apart.rate * rough_b.norm_squared();
        let changed = match (self.last_b, dt_s) {
            (Some(last_b), Some(dt_s)) => (rough_b - last_b).norm_squared() / (dt_s * dt_s),
            _ => 0.0,
        };
        let timing = self.timing_s * self.timing_s * larger(turned, changed);
        relative * from_usual + timing + apart.by_place * apart.by_place
    }

    /// A vector good enough to say how uncertain it is: that of the complete plate nearest to the last one, as wild values
    /// are not; before there is a last one, or without a complete plate, that of all.
    fn rough(&self, seen: &[Seen; TRIAD_AXES], candidates: u16) -> Vector3<f32> {
        let (mut nearest, mut least) = (None, f32::INFINITY);
        if let Some(last_b) = self.last_b {
            let mut left = candidates;
            for plate in 0..PLATES {
                if left & 0b111 == 0b111 {
                    // Near enough to rotations, whatever the calibration.
                    let along = |axis: usize| self.axes_b[3 * plate + axis] * seen[3 * plate + axis].value;
                    let vector_b = along(0) + along(1) + along(2);
                    let off = (vector_b - last_b).norm_squared();
                    if off < least {
                        (nearest, least) = (Some(vector_b), off);
                    }
                }
                left >>= 3;
            }
        }
        nearest.unwrap_or_else(|| {
            let mut of_all = Solution::NOTHING;
            solve_seen(&self.axes_b, seen, candidates, &mut of_all);
            of_all.vector_b
        })
    }

    /// Notes what each axis disagrees by; judges if one that is believed raises an alarm.
    #[inline(never)]
    fn watch(&mut self, present: u16, systematic: f32) {
        let offsets = self.watches.iter().map(|watch| watch.offset_variance);
        let counted = (systematic + offsets.fold(0.0, larger)) * self.per_noise;
        let cursor = self.of_all.push(root(counted));
        let added = self.of_all.added();
        let bounds = self.of_all.bounds(LIMITS, &added, QUIET, self.least_relative);
        let (mut alarms, mut loudest, mut doubted) = ([0.0; TRIAD_AXES], 0.0, false);
        let (mut read, mut used) = (present, self.solution.used);
        for (k, alarm) in (0..TRIAD_AXES).zip(&mut alarms) {
            let (watch, seen) = (&mut self.watches[k], &self.seen[k]);
            let disagreement = if read & 1 == 1 {
                Disagreement::of(seen, used & 1 == 1)
            } else {
                None
            };
            match disagreement {
                // The parts of the disagreement's variance are in the same proportion as the axis's own.
                Some(Disagreement { by, share }) => watch.note(cursor, by, share, counted),
                None => watch.miss(cursor),
            }
            match disagreement {
                _ if watch.excluded() => {
                    doubted = true;
                    if disagreement.is_some() {
                        watch.reconsider(&added);
                    }
                }
                Some(Disagreement { by, share }) if used & 1 == 1 => {
                    watch.strike(false);
                    let variance = share * seen.variance;
                    if watch.learn_quietly(by, variance, &bounds).is_none() {
                        *alarm = watch.learn(by, variance, LIMITS, &added);
                        loudest = larger(*alarm, loudest);
                    }
                }
                gated => {
                    if gated.is_some() {
                        watch.strike(true);
                    }
                    *alarm = watch.alarm(LIMITS, &added);
                    loudest = larger(*alarm, loudest);
                }
            }
            (read, used) = (read >> 1, used >> 1);
        }
        if !doubted && loudest < 1.0 {
            return;
        }
        if doubted {
            let doubted = present & self.excluded();
            for k in (0..TRIAD_AXES).filter(|k| doubted.wrapping_shr(*k as u32) & 1 == 1) {
                self.resemble(k);
            }
        }
        if loudest >= 1.0 {
            self.judge(&alarms);
        }
    }

    /// Excludes the axis with the loudest alarm.
    fn judge(&mut self, alarms: &[f32; TRIAD_AXES]) {
        let worst = (0..TRIAD_AXES).fold(0, |worst, k| if alarms[k] > alarms[worst] { k } else { worst });
        if self.has_double(worst) {
            self.undecided = true;
            return;
        }
        let sensor = (0..TRIAD_AXES).filter(|k| k / 3 == worst / 3);
        let all = sensor
            .clone()
            .any(|k| k != worst && alarms[k] >= 1.0 || self.watches[k].excluded());
        for k in sensor.filter(|k| *k == worst || all) {
            if !self.watches[k].excluded() {
                self.watches[k].exclude(Verdict::Disagreeing);
                self.likeness[k] = [0.0; 4];
            }
        }
        for watch in self.watches.iter_mut().filter(|watch| !watch.excluded()) {
            watch.restart();
        }
        self.of_all.restart();
    }

    /// Whether a fault of another used axis would look the same as one of `k`.
    fn has_double(&self, k: usize) -> bool {
        let solution = &self.solution;
        let moved_b = solution.covariance_b * self.axes_b[k];
        let free = |j: usize| self.seen[j].variance - solution.along(&self.axes_b[j]).1;
        (0..TRIAD_AXES)
            .filter(|j| *j != k && solution.used >> j & solution.used >> k & 1 == 1)
            .any(|j| {
                let shared = self.axes_b[j].dot(&moved_b);
                shared * shared > ALIKE * ALIKE * free(j) * free(k)
            })
    }

    /// Compares an excluded axis with its negative and with its sensor's other axes.
    fn resemble(&mut self, k: usize) {
        let expected = |k: usize| self.solution.along(&self.axes_b[k]).0;
        let plate = k / 3 * 3;
        let on_plate = |steps: usize| plate.wrapping_add(k.wrapping_add(steps) % 3);
        let (next, after) = (on_plate(1), on_plate(2));
        let seen = &self.seen[k];
        let measured = seen.value + self.watches[k].offset;
        for (kept, other) in
            self.likeness[k]
                .iter_mut()
                .zip([expected(k), -expected(k), expected(next), expected(after)])
        {
            let off = (measured - other) * (measured - other) / seen.variance;
            *kept = if *kept == 0.0 {
                off
            } else {
                *kept + (off - *kept) / LIKENESS_CYCLES
            };
        }
        let [itself, reversed, next, after] = self.likeness[k].map(ComplexField::sqrt);
        let watch = &mut self.watches[k];
        if watch.verdict.is_unnamed() && watch.seen_long() && itself > DIFFERS {
            if reversed < RESEMBLES {
                watch.verdict = Verdict::Reversed;
            } else if next.min(after) < RESEMBLES {
                watch.verdict = Verdict::Exchanged;
            }
        }
    }

    fn remember(&mut self) {
        let vector_b = self.solution.vector_b;
        self.cycles = (self.cycles + 1.0).min(super::watch::MEMORY);
        let usual_b = self.usual_b.get_or_insert(vector_b);
        *usual_b += (vector_b - *usual_b) / self.cycles;
        self.last_b = Some(vector_b);
    }
}

#[cfg(test)]
mod tests;
