//! Old samples of a sensor that has one axis, a gyro of a plate.
//!
//! In: a log and its unit. Out: a [`Finding`] for each channel that repeats oftener than its own scatter makes it.
//!
//! One axis repeats too often by chance to be held against others, which feel other motions. But whatever it measures, how often its codes change by
//! none, by one and by two is one law that falls smoothly: of a normal law `N0 = N1^(4/3) / N2^(1/3)`, `N1` and `N2` being the mean of both
//! signs, known to `N0 sqrt(16/(18 N1) + 1/(18 N2))`. An old sample adds to `N0` alone. What exceeds three of these deviations by
//! Chernoff's bound of Poisson's tail is no chance, and a repeat has to be likelier old than not, as in [`crate::input::repeats`].
//!
//! A code that is a stop, or the one at which a channel stands, repeats by itself: repeats of the commonest one are not counted.

use std::collections::BTreeMap;

use twin::predict::{Channel, Kind, UnitDescription};

use super::{AXES, Finding, code, old_samples, sends_codes};
use crate::{
    input::log::{Log, Series},
    thresholds::{RARE, SAID},
};

/// Changes of each size from which the law of codes is known: to a quarter.
const LEAST_CHANGES: f64 = 16.0;

/// Gyros that send samples twice; those in which something else is the matter say nothing of it.
pub fn stale(log: &Log, unit: &UnitDescription, is_spoilt: &dyn Fn(usize) -> bool) -> Vec<Finding> {
    let gyros: Vec<usize> = (0..unit.channels.len())
        .filter(|channel| unit.channels[*channel].sensor == Kind::Gyro)
        .collect();
    let of_group = |group: &str| gyros.iter().filter(|own| unit.channels[**own].group == group).count();
    let is_alone = |channel: &&usize| of_group(&unit.channels[**channel].group) < AXES;
    let least = (gyros.len().max(1) as f64 / RARE).ln();
    let alone = gyros.iter().filter(is_alone).filter(|channel| !is_spoilt(**channel));
    alone
        .filter_map(|channel| {
            let (count, chance) = repeats(&unit.channels[*channel], &log.channels[*channel], least)?;
            Some(old_samples(vec![*channel], count, chance))
        })
        .collect()
}

/// Samples that repeat the one before, and how many do by chance, if that is beyond it.
fn repeats(channel: &Channel, series: &Series, least_nats: f64) -> Option<(f64, f64)> {
    if !sends_codes(channel) {
        return None;
    }
    let mut changed = [0.0_f64; 3];
    let mut repeated: BTreeMap<i64, f64> = BTreeMap::new();
    for (rows, values) in series.rows.windows(2).zip(series.values.windows(2)) {
        if rows[0] + 1 != rows[1] {
            continue;
        }
        let [before, now] = [values[0], values[1]].map(|value| code(channel, value));
        match now.abs_diff(before) {
            0 => *repeated.entry(now).or_default() += 1.0,
            by @ 1..=2 => changed[by as usize] += 0.5,
            _ => {}
        }
    }
    let [_, one, two] = changed;
    if one.min(two) < LEAST_CHANGES {
        return None;
    }
    let commonest = repeated.values().copied().fold(0.0, f64::max);
    let count = repeated.values().sum::<f64>() - commonest;
    let chance = ((4.0 * one.ln() - two.ln()) / 3.0).exp();
    let expected = chance * (1.0 + 3.0 * (8.0 / (9.0 * one) + 1.0 / (18.0 * two)).sqrt());
    let is_likelier_old = count - expected >= SAID * count;
    let nats = count * (count / expected).ln() - count + expected;
    (is_likelier_old && nats > least_nats).then_some((count, chance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    /// What is said of 1500 samples with a noise of so many codes, of which a share is old, of a unit that swings by 200 codes in the second half
    /// and rests in the first.
    fn found(noise: f64, share: f64, highest: f64) -> Vec<Finding> {
        let text = "name = \"x\"\n[[channel]]\nname = \"w\"\nsensor = \"gyro\"\ngroup = \"plate 1\"\naxis_b = [1.0, 0.0, 0.0]\nlsb = 0.5\n\
                    noise_sigma = 1.0\nbits = 12\n";
        let unit = UnitDescription::read(text, "unit.toml").expect("a unit");
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut log = Log::empty(1);
        let mut before = 0.0;
        for row in 0..1500_u32 {
            let [scatter, chance]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
            let moved = if row < 750 {
                0.0
            } else {
                200.0 * (0.05 * f64::from(row)).sin()
            };
            let is_old = statrs::function::erf::erf(chance.abs() / 2f64.sqrt()) < share;
            before = if is_old {
                before
            } else {
                0.5 * (moved + noise * scatter).round().min(highest)
            };
            log.start_s.push(0.2 * f64::from(row));
            log.channels[0].rows.push(row);
            log.channels[0].values.push(before);
        }
        super::super::look(&log, &unit)
    }

    #[test]
    fn a_healthy_gyro_repeats_no_oftener_than_its_scatter_makes_it() {
        for noise in [0.1, 0.4, 0.7, 1.0, 2.0, 3.0, 8.0] {
            assert_eq!(found(noise, 0.0, f64::INFINITY), [], "{noise}");
        }
    }

    #[test]
    fn a_gyro_that_sends_samples_twice_is_found() {
        let found = found(3.0, 0.2, f64::INFINITY);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].effect, &found[0].channels), ("stale-sample", &vec![0]));
    }

    #[test]
    fn a_gyro_at_its_stop_sends_nothing_twice() {
        assert_eq!(found(3.0, 0.0, 50.0), []);
    }
}
