//! What the pages of fault detection say, in f64: whole histories instead of rings and running sums, a matrix inverted instead of
//! steps saved.

extern crate std;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::vec::Vec;

use super::super::Verdict;

pub(crate) type V = Vector3<f64>;

pub(crate) fn of(x: f32) -> f64 {
    f64::from(x)
}

/// Weighted least squares; `None` where the axes do not span space.
pub(crate) fn solve(axes_b: &[V], values: &[f64], variances: &[f64], wanted: u16) -> Option<(V, Matrix3<f64>)> {
    let (mut information, mut weighted) = (Matrix3::zeros(), V::zeros());
    for k in (0..axes_b.len()).filter(|k| wanted >> k & 1 == 1) {
        information += axes_b[k] * axes_b[k].transpose() / variances[k];
        weighted += axes_b[k] * (values[k] / variances[k]);
    }
    let least = information.symmetric_eigenvalues().min();
    let covariance = (least > 1e-6 * information.trace()).then(|| information.try_inverse())??;
    Some((covariance * weighted, covariance))
}

/// What an axis should measure, and the variance of that.
pub(crate) fn along(solution: &(V, Matrix3<f64>), axis_b: &V) -> (f64, f64) {
    (axis_b.dot(&solution.0), axis_b.dot(&(solution.1 * axis_b)))
}

/// Values since the last restart, to a 64th, at most 127.
#[derive(Clone, Default)]
pub(crate) struct History(pub(crate) Vec<f64>);

impl History {
    pub(crate) fn push(&mut self, value: f64) {
        self.0.push(((value * 64.0).round() / 64.0).clamp(-127.0, 127.0));
    }

    fn last(&self, cycles: usize) -> &[f64] {
        &self.0[self.0.len().saturating_sub(cycles)..]
    }

    fn sum(&self, cycles: usize) -> f64 {
        self.last(cycles).iter().sum()
    }

    fn squares(&self) -> f64 {
        self.last(26).iter().map(|value| value * value).sum()
    }

    pub(crate) fn full(&self) -> bool {
        self.0.len() >= 26
    }
}

/// Means over one and five seconds in standard deviations, and the sum of squares.
pub(crate) type Limits = [f64; 3];
const SOUND: Limits = [3.0, 3.0, 52.0];
const QUIET: f64 = 0.5625;

/// One axis.
#[derive(Clone)]
pub(crate) struct Watched {
    pub(crate) history: History,
    pub(crate) noise: f64,
    relative: f64,
    pub(crate) offset: f64,
    pub(crate) offset_variance: f64,
    allowed: f64,
    pub(crate) strikes: u32,
    sound_for: u32,
    relapses: u32,
    pub(crate) verdict: Verdict,
    /// Whether it learned was a matter of rounding.
    pub(crate) open: bool,
}

impl Watched {
    pub(crate) fn new(noise: f64, allowed: f64, counted_in: f64) -> Self {
        Watched {
            history: History::default(),
            noise,
            relative: counted_in / noise,
            offset: 0.0,
            offset_variance: allowed,
            allowed,
            strikes: 0,
            sound_for: 0,
            relapses: 0,
            verdict: Verdict::Sound,
            open: false,
        }
    }

    pub(crate) fn excluded(&self) -> bool {
        self.verdict != Verdict::Sound
    }

    fn unnamed(&self) -> bool {
        [Verdict::Disagreeing, Verdict::Biased, Verdict::Noisy].contains(&self.verdict)
    }

    pub(crate) fn note(&mut self, disagreement: f64, share: f64, systematic: f64) {
        let sigmas = disagreement / (self.noise * share).sqrt();
        let most = 4.5 * (1.0 + self.relative * systematic).sqrt();
        // What is wild without anything systematic is clipped with it.
        let clipped = if sigmas.abs() > 4.5 {
            sigmas.clamp(-most, most)
        } else {
            sigmas
        };
        self.history.push(clipped);
    }

    /// The largest figure in parts of its limit, squared.
    pub(crate) fn over(&self, [short, long, squares]: Limits, systematic: &History) -> f64 {
        let history = &self.history;
        let of_squares = history.squares() / (squares + 4.5 * 4.5 * self.relative * systematic.squares());
        if history.0.len() < 6 {
            return of_squares;
        }
        let mean = |cycles: usize, limit: f64, seen: usize| {
            let variance = cycles as f64 + self.relative * systematic.sum(seen).powi(2);
            history.sum(seen).powi(2) / (limit * limit * variance)
        };
        of_squares
            .max(mean(6, short, 6))
            .max(mean(history.0.len().min(26), long, 26))
    }

    fn crept(&self) -> f64 {
        (self.offset / 6.0).powi(2) / self.allowed
    }

    fn loudness(&self, over: f64) -> f64 {
        if self.strikes >= 3 {
            return (f64::from(self.strikes) / 3.0 + over.sqrt()).powi(2);
        }
        self.crept().max(over)
    }

    pub(crate) fn alarm(&self, limits: Limits, systematic: &History) -> f64 {
        self.loudness(self.over(limits, systematic))
    }

    pub(crate) fn learn(&mut self, disagreement: f64, variance: f64, limits: Limits, systematic: &History) -> f64 {
        let over = self.over(limits, systematic);
        let near = self.crept().max(over);
        // Within what single precision and steps of a 64th leave open.
        self.open |= self.history.full() && (near / QUIET - 1.0).abs() < 2e-3;
        if near <= QUIET || !self.history.full() {
            let gain = self.offset_variance / variance;
            self.offset += gain * disagreement;
            let learnt = (1.0 - gain) * self.offset_variance + self.noise / 1e6;
            self.offset_variance = learnt.min(self.allowed);
        }
        self.loudness(over)
    }

    pub(crate) fn strike(&mut self, gated: bool) {
        self.strikes = if gated { self.strikes + 1 } else { 0 };
    }

    pub(crate) fn restart(&mut self) {
        self.history = History::default();
        (self.sound_for, self.strikes) = (0, 0);
    }

    pub(crate) fn exclude(&mut self, verdict: Verdict) {
        if !self.excluded() {
            self.relapses = (self.relapses + 1).min(6);
            if self.offset.abs() >= 6.0 * self.allowed.sqrt() {
                self.offset = 0.0;
            }
        }
        self.verdict = verdict;
        self.restart();
    }

    pub(crate) fn reconsider(&mut self, systematic: &History) {
        let agrees = self.over(SOUND, systematic) < 1.0;
        self.sound_for = if agrees { self.sound_for + 1 } else { 0 };
        if self.sound_for >= 26 << (self.relapses - 1) {
            (self.verdict, self.strikes) = (Verdict::Sound, 0);
        } else if self.history.full() && self.unnamed() && !agrees {
            let mean = self.history.sum(26) / 26.0;
            let variance = self.history.squares() / 26.0 - mean * mean;
            let expected = 1.0 + self.relative * systematic.squares() / 26.0;
            self.verdict = if variance > 4.0 * expected {
                Verdict::Noisy
            } else {
                Verdict::Biased
            };
        }
    }
}

/// What a cycle gave.
#[derive(Clone, Copy)]
pub(crate) struct Given<const N: usize> {
    pub(crate) values: [f64; N],
    pub(crate) present: u16,
    pub(crate) frozen: u16,
    pub(crate) dt_s: Option<f64>,
    pub(crate) later: bool,
}

fn is_in(set: u16, k: usize) -> bool {
    set >> k & 1 == 1
}

/// How sure a calibration is: bias, scale, direction; and \[s\] the sampling instants.
#[derive(Clone, Copy)]
pub(crate) struct Sure {
    pub(crate) bias: f64,
    pub(crate) scale: f64,
    pub(crate) direction: f64,
    pub(crate) timing_s: f64,
}

impl Sure {
    /// Relative, squared.
    fn relative(&self) -> f64 {
        self.scale.powi(2) + self.direction.powi(2)
    }
}

/// A mean of the vector since the beginning, of at most 1000 cycles.
#[derive(Clone, Default)]
struct Usual {
    mean: Option<V>,
    cycles: f64,
}

impl Usual {
    fn take(&mut self, vector: V) {
        self.cycles = (self.cycles + 1.0).min(1000.0);
        let mean = self.mean.get_or_insert(vector);
        *mean += (vector - *mean) / self.cycles;
    }

    fn off(&self, vector: V) -> f64 {
        self.mean.map_or(0.0, |mean| (vector - mean).norm_squared())
    }
}

/// Four sensors of three axes.
pub(crate) struct TriadsModel {
    axes_b: [V; 12],
    sure: Sure,
    pub(crate) watches: [Watched; 12],
    of_all: History,
    least: f64,
    likeness: [[f64; 4]; 12],
    usual: Usual,
    last: Option<V>,
    seen: [(f64, f64); 12],
    pub(crate) solution: Option<(V, Matrix3<f64>)>,
    pub(crate) used: u16,
    late: Option<(u16, f64)>,
    pub(crate) undecided: bool,
    /// Which axis went, or whether one has redundancy, was a matter of rounding.
    pub(crate) tied: bool,
    /// How often a whole sensor was excluded, a fault had a double, and was given another name.
    pub(crate) events: [u32; 3],
}

const OF_TRIADS: Limits = [5.6, 5.1, 90.0];

impl TriadsModel {
    pub(crate) fn new(axes_b: [V; 12], noise: [f64; 12], sure: Sure) -> Self {
        let least = noise.iter().fold(f64::MAX, |least, noise| least.min(*noise)).powi(2);
        TriadsModel {
            axes_b,
            sure,
            watches: noise.map(|noise| Watched::new(noise * noise, sure.bias * sure.bias, least)),
            of_all: History::default(),
            least,
            likeness: [[0.0; 4]; 12],
            usual: Usual::default(),
            last: None,
            seen: [(0.0, 0.0); 12],
            solution: None,
            used: 0,
            late: None,
            undecided: false,
            tied: false,
            events: [0; 3],
        }
    }

    fn excluded(&self) -> u16 {
        (0..12)
            .filter(|k| self.watches[*k].excluded())
            .fold(0, |all, k| all | 1 << k)
    }

    fn values(&self) -> [f64; 12] {
        self.seen.map(|seen| seen.0)
    }

    fn variances(&self) -> [f64; 12] {
        self.seen.map(|seen| seen.1)
    }

    pub(crate) fn step(&mut self, given: &Given<12>, rate: f64, by_place: f64) {
        let mut doubled = false;
        if let Some((present, systematic)) = self.late.take() {
            self.undecided = false;
            self.watch(present, systematic);
            doubled = self.undecided;
        }
        for k in (0..12).filter(|k| is_in(given.frozen, *k)) {
            self.watches[k].exclude(Verdict::Frozen);
        }
        let candidates = given.present & !self.excluded();
        for k in 0..12 {
            let watch = &self.watches[k];
            self.seen[k] = (given.values[k] - watch.offset, watch.noise + watch.offset_variance);
        }
        let rough = self.rough(candidates);
        let changed = match (self.last, given.dt_s) {
            (Some(last), Some(dt_s)) => (rough - last).norm_squared() / dt_s.powi(2),
            _ => 0.0,
        };
        let motion = changed.max(rate.powi(2) * rough.norm_squared());
        let systematic =
            self.sure.relative() * self.usual.off(rough) + self.sure.timing_s.powi(2) * motion + by_place.powi(2);
        self.seen.iter_mut().for_each(|seen| seen.1 += systematic);
        let decided = self.agree(candidates);
        self.undecided = !decided || doubled;
        let Some((vector, _)) = self.solution else {
            self.last = None;
            return;
        };
        if decided {
            if given.later {
                self.late = Some((given.present, systematic));
            } else {
                self.watch(given.present, systematic);
            }
            self.usual.take(vector);
            self.last = Some(vector);
        }
    }

    /// The complete plate nearest to the last vector, or all that there is.
    fn rough(&self, candidates: u16) -> V {
        let plates = (0..4).filter(|plate| candidates >> (3 * plate) & 7 == 7);
        let of_plate = |plate: usize| {
            (0..3).fold(V::zeros(), |sum, axis| {
                sum + self.axes_b[3 * plate + axis] * self.seen[3 * plate + axis].0
            })
        };
        let nearest = self.last.and_then(|last| {
            let off = |vector: &V| (vector - last).norm();
            plates.map(of_plate).min_by(|a, b| off(a).total_cmp(&off(b)))
        });
        let all = || solve(&self.axes_b, &self.values(), &self.variances(), candidates);
        nearest.or_else(|| Some(all()?.0)).unwrap_or_default()
    }

    /// The used axis furthest beyond the gate goes, and again.
    fn agree(&mut self, candidates: u16) -> bool {
        self.used = candidates;
        loop {
            self.solution = solve(&self.axes_b, &self.values(), &self.variances(), self.used);
            let Some(solution) = &self.solution else { return true };
            let free = |k: usize| 1.0 - along(solution, &self.axes_b[k]).1 / self.seen[k].1;
            self.tied |= (0..12).any(|k| is_in(self.used, k) && (free(k) / 0.05 - 1.0).abs() < 0.01);
            let sigmas = |k: &usize| {
                let (expected, explained) = along(solution, &self.axes_b[*k]);
                let (value, variance) = self.seen[*k];
                let free = variance - explained;
                if free > 0.05 * variance {
                    (value - expected).abs() / free.sqrt()
                } else {
                    0.0
                }
            };
            let worst = (0..12)
                .filter(|k| is_in(self.used, *k))
                .max_by(|a, b| sigmas(a).total_cmp(&sigmas(b)));
            let Some(worst) = worst.filter(|k| sigmas(k) > 6.0) else {
                return true;
            };
            // With one dimension of parity left all are off alike, and rounding decides.
            let alike = (0..12)
                .filter(|k| is_in(self.used, *k) && sigmas(k) > 0.999 * sigmas(&worst))
                .count();
            self.tied |= alike > 1;
            let fewer = self.used & !(1 << worst);
            if solve(&self.axes_b, &self.values(), &self.variances(), fewer).is_none() {
                return false;
            }
            self.used = fewer;
        }
    }

    /// Disagreement of an axis with the vector of all others, and its variance in those of the axis.
    fn disagreement(&self, k: usize) -> Option<(f64, f64)> {
        let (value, variance) = self.seen[k];
        let (expected, explained) = along(self.solution.as_ref()?, &self.axes_b[k]);
        if !is_in(self.used, k) {
            return Some((value - expected, 1.0 + explained / variance));
        }
        if variance - explained <= 0.05 * variance {
            return None;
        }
        let (others, covariance) = solve(&self.axes_b, &self.values(), &self.variances(), self.used & !(1 << k))?;
        let (expected, explained) = along(&(others, covariance), &self.axes_b[k]);
        Some((value - expected, 1.0 + explained / variance))
    }

    fn watch(&mut self, present: u16, systematic: f64) {
        let offsets = self
            .watches
            .iter()
            .fold(0.0, |most: f64, watch| most.max(watch.offset_variance));
        let counted = (systematic + offsets) / self.least;
        self.of_all.push(counted.sqrt());
        let (mut alarms, mut doubted) = ([0.0; 12], 0);
        for (k, alarm) in alarms.iter_mut().enumerate() {
            let disagreement = self.disagreement(k).filter(|_| is_in(present, k));
            let watch = &mut self.watches[k];
            match disagreement {
                Some((by, share)) => watch.note(by, share, counted),
                None => watch.history.push(0.0),
            }
            if watch.excluded() {
                doubted |= 1 << k;
                if disagreement.is_some() {
                    watch.reconsider(&self.of_all);
                }
            } else if let (Some((by, share)), true) = (disagreement, is_in(self.used, k)) {
                watch.strike(false);
                *alarm = watch.learn(by, share * self.seen[k].1, OF_TRIADS, &self.of_all);
            } else {
                if disagreement.is_some() {
                    watch.strike(true);
                }
                *alarm = watch.alarm(OF_TRIADS, &self.of_all);
            }
        }
        if doubted != 0 {
            let doubted = present & self.excluded();
            for k in (0..12).filter(|k| is_in(doubted, *k)) {
                self.resemble(k);
            }
        }
        if alarms.iter().any(|alarm| *alarm >= 1.0) {
            self.judge(&alarms);
        }
    }

    fn judge(&mut self, alarms: &[f64; 12]) {
        let worst = (0..12).fold(0, |worst, k| if alarms[k] > alarms[worst] { k } else { worst });
        if self.has_double(worst) {
            self.events[1] += 1;
            self.undecided = true;
            return;
        }
        let plate = worst / 3 * 3..worst / 3 * 3 + 3;
        let others = plate.clone().filter(|k| *k != worst);
        let all =
            others.clone().any(|k| alarms[k] >= 1.0 || self.watches[k].excluded()) || self.watches[worst].excluded();
        self.events[0] += u32::from(all);
        for k in plate.filter(|k| *k == worst || all) {
            if !self.watches[k].excluded() {
                self.watches[k].exclude(Verdict::Disagreeing);
                self.likeness[k] = [0.0; 4];
            }
        }
        self.watches
            .iter_mut()
            .filter(|watch| !watch.excluded())
            .for_each(Watched::restart);
        self.of_all = History::default();
    }

    /// The cosine between what two faults leave in parity space.
    fn has_double(&self, k: usize) -> bool {
        let Some((_, covariance)) = self.solution else {
            return false;
        };
        let shared = |i: usize, j: usize| {
            let own = if i == j { self.seen[i].1 } else { 0.0 };
            own - self.axes_b[i].dot(&(covariance * self.axes_b[j]))
        };
        (0..12)
            .filter(|j| *j != k && is_in(self.used, *j) && is_in(self.used, k))
            .any(|j| shared(j, k).powi(2) > 0.81 * shared(j, j) * shared(k, k))
    }

    fn resemble(&mut self, k: usize) {
        let Some(solution) = self.solution else { return };
        let expected = |k: usize| along(&solution, &self.axes_b[k]).0;
        let (next, after) = (k / 3 * 3 + (k + 1) % 3, k / 3 * 3 + (k + 2) % 3);
        let measured = self.seen[k].0 + self.watches[k].offset;
        let others = [expected(k), -expected(k), expected(next), expected(after)];
        for (kept, other) in self.likeness[k].iter_mut().zip(others) {
            let off = (measured - other).powi(2) / self.seen[k].1;
            *kept = if *kept == 0.0 { off } else { *kept + (off - *kept) / 8.0 };
        }
        let [itself, reversed, next, after] = self.likeness[k].map(f64::sqrt);
        let watch = &mut self.watches[k];
        if watch.unnamed() && watch.history.full() && itself > 6.0 {
            if reversed < 3.0 {
                watch.verdict = Verdict::Reversed;
                self.events[2] += 1;
            } else if next < 3.0 || after < 3.0 {
                watch.verdict = Verdict::Exchanged;
                self.events[2] += 1;
            }
        }
    }
}

/// Four gyros.
pub(crate) struct GyrosModel {
    axes_b: [V; 4],
    pub(crate) across: [f64; 4],
    sure: Sure,
    pub(crate) parity: Watched,
    pub(crate) watches: [Watched; 4],
    of_parity: History,
    of_gyros: [History; 4],
    course: Option<V>,
    usual: Usual,
    quiet_for: u32,
    doubted_for: u32,
    last_sigmas: f64,
    pub(crate) leaping: Option<usize>,
    pub(crate) suspect: bool,
}

const OF_GYROS: Limits = [5.2, 4.8, 90.0];

impl GyrosModel {
    pub(crate) fn new(axes_b: [V; 4], noise: [f64; 4], sure: Sure) -> Self {
        // The one direction of four in which no rate shows.
        let information = axes_b
            .iter()
            .fold(Matrix3::zeros(), |sum, axis_b| sum + axis_b * axis_b.transpose());
        let inverse = information.try_inverse().unwrap_or_default();
        let projected = |row: usize, column: usize| {
            f64::from(u8::from(row == column)) - axes_b[row].dot(&(inverse * axes_b[column]))
        };
        let across = core::array::from_fn(|k| projected(0, k) / projected(0, 0).sqrt());
        let allowed = sure.bias.powi(2);
        let of_parity = (0..4).map(|k: usize| (across[k] * noise[k]).powi(2)).sum();
        GyrosModel {
            axes_b,
            across,
            sure,
            parity: Watched::new(of_parity, allowed, of_parity),
            watches: noise.map(|noise| Watched::new(noise * noise, allowed, noise * noise)),
            of_parity: History::default(),
            of_gyros: Default::default(),
            course: None,
            usual: Usual::default(),
            quiet_for: 0,
            doubted_for: 0,
            last_sigmas: 0.0,
            leaping: None,
            suspect: false,
        }
    }

    pub(crate) fn is_doubted(&mut self) -> bool {
        self.doubted_for = self.doubted_for.saturating_sub(1);
        self.doubted_for > 0 || self.suspect
    }

    fn excluded(&self) -> u16 {
        (0..4)
            .filter(|k| self.watches[*k].excluded())
            .fold(0, |all, k| all | 1 << k)
    }

    /// The rate and its covariance, and which gyros it is of.
    pub(crate) fn step(&mut self, given: &Given<4>) -> (Option<(V, Matrix3<f64>)>, u16) {
        for k in (0..4).filter(|k| is_in(given.frozen, *k)) {
            self.blame(k, Verdict::Frozen);
        }
        let candidates = given.present & !self.excluded();
        let systematic = self.systematic(given, candidates);
        let variances = core::array::from_fn(|k: usize| self.watches[k].noise + systematic);
        let mut used = candidates;
        let mut solution = solve(&self.axes_b, &given.values, &variances, candidates);
        if candidates == 15 {
            (solution, used) = self.check(given, &variances, systematic);
        } else {
            self.suspect = false;
        }
        match &solution {
            Some(found) => {
                let watched = given.present & self.excluded();
                for k in (0..4).filter(|k| is_in(watched, *k)) {
                    let (expected, variance) = along(found, &self.axes_b[k]);
                    let share = 1.0 + variance / variances[k];
                    let watch = &mut self.watches[k];
                    let counted = (systematic + watch.offset_variance / share) / watch.noise;
                    self.of_gyros[k].push(counted.sqrt());
                    watch.note(given.values[k] - watch.offset - expected, share, counted);
                    watch.reconsider(&self.of_gyros[k]);
                }
                self.course = Some(found.0);
                self.usual.take(found.0);
            }
            None => self.course = None,
        }
        (solution, used)
    }

    fn rate_of(&self, values: &[f64; 4], wanted: u16) -> Option<V> {
        Some(solve(&self.axes_b, values, &[1.0; 4], wanted)?.0)
    }

    fn systematic(&self, given: &Given<4>, candidates: u16) -> f64 {
        let rough = self.rate_of(&given.values, candidates).unwrap_or_default();
        let acceleration = match (self.course, given.dt_s) {
            (Some(course), Some(dt_s)) => {
                let without = |k: usize| self.rate_of(&given.values, candidates & !(1 << k)).unwrap_or_default();
                let turns = self.leaping.map_or(rough, without);
                (turns - course).norm_squared() / dt_s.powi(2)
            }
            _ => 0.0,
        };
        self.sure.relative() * self.usual.off(rough) + self.sure.timing_s.powi(2) * acceleration
    }

    fn check(&mut self, given: &Given<4>, variances: &[f64; 4], systematic: f64) -> (Option<(V, Matrix3<f64>)>, u16) {
        let parity = (0..4).map(|k| self.across[k] * given.values[k]).sum::<f64>() - self.parity.offset;
        let noise = self.parity.noise;
        let variance = noise + systematic + self.parity.offset_variance;
        if let Some(leapt) = self.leap(given, variances, parity.abs() / noise.sqrt()) {
            self.watches[leapt].strike(true);
            if self.watches[leapt].alarm(OF_GYROS, &self.of_gyros[leapt]) >= 1.0 {
                self.blame(leapt, Verdict::Disagreeing);
            }
            let left = 15 & !(1 << leapt);
            return (solve(&self.axes_b, &given.values, variances, left), left);
        }
        if self.leaping.is_none() {
            self.watches.iter_mut().for_each(|watch| watch.strike(false));
        }
        let counted = (systematic + self.parity.offset_variance) / noise;
        self.of_parity.push(counted.sqrt());
        self.parity.note(parity, 1.0, counted);
        let alarm = self.parity.learn(parity, variance, OF_GYROS, &self.of_parity);
        self.quiet_for = if alarm < QUIET { self.quiet_for + 1 } else { 0 };
        if alarm > QUIET {
            self.doubted_for = 52;
        }
        self.suspect = alarm > 1.0 || (self.suspect && self.quiet_for < 52);
        let solution = solve(&self.axes_b, &given.values, variances, 15);
        let wider = if self.suspect {
            1.0 + parity.powi(2) / variance
        } else {
            1.0
        };
        (solution.map(|(rate, covariance)| (rate, covariance * wider)), 15)
    }

    fn leap(&mut self, given: &Given<4>, variances: &[f64; 4], sigmas: f64) -> Option<usize> {
        let before = core::mem::replace(&mut self.last_sigmas, sigmas);
        if sigmas < 8.0 {
            self.leaping = None;
            return None;
        }
        // Not one that has grown.
        if before > 4.0 && self.leaping.is_none() {
            return None;
        }
        let course = self.course?;
        let change =
            |k: usize| Some((solve(&self.axes_b, &given.values, variances, 15 & !(1 << k))?.0 - course).norm());
        let mut changes: Vec<(f64, usize)> = (0..4).filter_map(|k| Some((change(k)?, k))).collect();
        changes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let alone = (changes[1].0 > 3.0 * changes[0].0).then_some(changes[0].1);
        let leapt = alone.filter(|k| self.leaping.is_none_or(|before| before == *k));
        self.leaping = self.leaping.or(leapt);
        leapt
    }

    pub(crate) fn blame(&mut self, k: usize, verdict: Verdict) {
        self.watches[k].exclude(verdict);
        self.of_gyros[k] = History::default();
        self.watches[k].offset = self.parity.offset / self.across[k];
        self.watches[k].offset_variance = self.parity.offset_variance / self.across[k].powi(2);
        if verdict == Verdict::Frozen {
            for watch in self.watches.iter_mut().filter(|watch| watch.unnamed()) {
                watch.verdict = Verdict::Sound;
                watch.restart();
            }
        }
        self.leaping = None;
        self.parity.restart();
        self.of_parity = History::default();
        self.suspect = false;
    }
}

/// Directions of the start carried along by each of four rates.
#[derive(Default)]
pub(crate) struct VectorRateModel {
    start: [Option<(V, f64)>; 2],
    turned: [UnitQuaternion<f64>; 4],
    rates: Vec<[V; 4]>,
    elapsed_s: f64,
}

impl VectorRateModel {
    fn begin(&mut self, directions: [Option<(V, f64)>; 2]) {
        (self.start, self.turned, self.elapsed_s) = (directions, Default::default(), 0.0);
    }

    pub(crate) fn pause(&mut self) {
        self.rates.clear();
    }

    pub(crate) fn step(
        &mut self,
        (noise, bias): (f64, f64),
        rates: Option<[V; 4]>,
        dt_s: Option<f64>,
        directions: [Option<(V, f64)>; 2],
    ) -> Option<usize> {
        let (Some(now), Some(dt_s), false) = (rates, dt_s, self.rates.is_empty()) else {
            self.rates = rates.into_iter().collect();
            self.begin(directions);
            return None;
        };
        self.rates.push(now);
        let of_last: Vec<[V; 4]> = self.rates.iter().rev().take(3).copied().collect();
        self.elapsed_s += dt_s;
        for k in 0..4 {
            let mean = match of_last[..] {
                // Adams and Moulton, third order.
                [now, before, earlier] => (now[k] * 5.0 + before[k] * 8.0 - earlier[k]) / 12.0,
                _ => (of_last[0][k] + of_last[1][k]) / 2.0,
            };
            self.turned[k] *= UnitQuaternion::from_scaled_axis(mean * dt_s);
        }
        let mut costs: Vec<(f64, usize)> = (0..4)
            .map(|k| {
                let of_one = self.start.iter().zip(directions).map(|(start, now)| {
                    let (Some((start, before)), Some((now, after))) = (start, now) else {
                        return 0.0;
                    };
                    let variance =
                        before + after + (bias * self.elapsed_s).powi(2) + 2.7 * noise.powi(2) * dt_s * self.elapsed_s;
                    (now - self.turned[k].inverse() * start).norm_squared() / (2.0 * variance)
                });
                (of_one.sum(), k)
            })
            .collect();
        costs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let is_one = costs[0].0 < 12.0 && costs[1].0 > costs[0].0 + 8.0;
        let guilty = (self.elapsed_s >= 2.0 && is_one).then_some(costs[0].1);
        if self.elapsed_s >= 10.0 || guilty.is_some() {
            self.begin(directions);
        }
        guilty
    }
}
