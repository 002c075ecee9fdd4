//! Four gyros.

extern crate std;

use nalgebra::Matrix3;
use std::vec::Vec;

use super::{
    super::super::Verdict,
    Given, Sure, Usual, V, along, is_in, solve,
    watched::{History, Limits, QUIET, Watched},
};

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
