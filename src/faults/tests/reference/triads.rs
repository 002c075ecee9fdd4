//! Four sensors of three axes.

use nalgebra::Matrix3;

use super::{
    super::super::Verdict,
    Given, Sure, Usual, V, along, is_in, solve,
    watched::{History, Limits, Watched},
};

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
