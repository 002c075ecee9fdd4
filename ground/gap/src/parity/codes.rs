//! What the codes say without any model: samples sent twice, bits that are lost, channels that stand still.
//!
//! In: a log and its unit. Out: [`Finding`]s, each an effect of the library with its channels. Nothing is predicted for these, so
//! they hold whatever the motion was.
//!
//! - **Samples sent twice.** The three axes of a part repeat their codes together by chance rarely, and as often as those of
//!   the other parts of its kind do. More repeats than Poisson's law allows at the largest rate among the others
//!   ([`REPEATS_CHANCE`]) are old samples.
//! - **Lost bits.** All codes of a channel lie a multiple of `n` apart. By chance all differences of `k` codes are even with
//!   probability `2^(1 - k)`.
//! - **Stuck.** All codes are one, where the described noise would change them.

use statrs::distribution::{DiscreteCDF, Poisson};
use twin::predict::{Channel, Kind, UnitDescription};

use crate::{
    input::log::{Log, Series},
    thresholds::REPEATS_CHANCE,
};

/// Samples from which codes say anything: that so many are all even is chance once in 2^63.
const LEAST: usize = 64;

/// Axes of a part that are taken together: one repeats too often by chance.
const AXES: usize = 3;

/// Noise over a code \[1\] from which a channel cannot stand still by chance: one code then holds at most 0.90 of the samples,
/// [`LEAST`] of them in a row with probability 0.002.
const RESTLESS: f64 = 0.3;

/// What was found in codes.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Name in the library.
    pub effect: &'static str,
    /// Where.
    pub channels: Vec<usize>,
    /// In words.
    pub what: String,
    /// \[counts\] step of the codes that are there, for lost bits.
    pub step: Option<i64>,
}

/// Looks at all channels.
pub fn look(log: &Log, unit: &UnitDescription) -> Vec<Finding> {
    let steps = lost_bits(log, unit);
    let mut found = stale(log, unit, &steps);
    found.extend(of_parts(unit, &steps));
    found.extend(stuck(log, unit));
    found
}

/// The log without what was found: old samples and stuck channels are left out, lost bits are rounding.
pub fn taken_out(log: &mut Log, unit: &mut UnitDescription, found: &[Finding]) {
    for finding in found {
        let repeats = repeats(log, &finding.channels);
        for channel in finding.channels.iter().copied() {
            let own = &mut unit.channels[channel];
            let series = &mut log.channels[channel];
            match (finding.effect, finding.step) {
                (_, Some(step)) => {
                    let coarse = step as f64 * own.lsb;
                    own.noise_sigma = own.noise_sigma.hypot(coarse / 12f64.sqrt());
                    // Cut off instead of rounded, they are off by half a step.
                    own.bias_sigma = own.bias_sigma.hypot(0.5 * coarse);
                }
                ("stale-sample", _) => *series = series.only(|row| repeats.binary_search(&(row as u32)).is_err()),
                _ => *series = Series::default(),
            }
        }
    }
}

fn code(channel: &Channel, value: f64) -> i64 {
    (value / channel.lsb).round() as i64
}

fn sends_codes(channel: &Channel) -> bool {
    channel.bits.is_some() && channel.lsb > 0.0
}

/// Rows whose values are those of the row before in all of these channels.
fn repeats(log: &Log, channels: &[usize]) -> Vec<u32> {
    let Some(first) = channels.first().map(|channel| &log.channels[*channel]) else {
        return Vec::new();
    };
    let same = |series: &Series, row: u32| {
        let at = series.rows.binary_search(&row).ok()?;
        let before = at.checked_sub(1)?;
        Some(series.rows[before] + 1 == row && series.values[before] == series.values[at])
    };
    let rows = first.rows.iter().copied();
    rows.filter(|row| {
        channels
            .iter()
            .all(|channel| same(&log.channels[*channel], *row) == Some(true))
    })
    .collect()
}

fn stale(log: &Log, unit: &UnitDescription, steps: &[Option<i64>]) -> Vec<Finding> {
    let mut found = Vec::new();
    for kind in [Kind::Accelerometer, Kind::Magnetometer, Kind::Gyro] {
        let parts: Vec<Vec<usize>> = parts(unit, kind)
            .into_iter()
            // Coarse codes repeat by themselves.
            .filter(|part| part.len() >= AXES && part.iter().all(|channel| steps[*channel].is_none()))
            .collect();
        let counts: Vec<(usize, f64)> = (parts.iter())
            .map(|part| (log.channels[part[0]].rows.len(), repeats(log, part).len() as f64))
            .collect();
        for (at, part) in parts.iter().enumerate() {
            let (samples, count) = counts[at];
            let others = counts.iter().enumerate().filter(|(other, _)| *other != at);
            let rates = others.map(|(_, (samples, count))| (count + 1.0) / (*samples).max(1) as f64);
            let Some(rate) = rates.max_by(f64::total_cmp).filter(|_| samples >= LEAST) else {
                continue;
            };
            let tail = Poisson::new(rate * samples as f64).map_or(1.0, |law| law.sf((count as u64).saturating_sub(1)));
            if count >= 1.0 && tail < REPEATS_CHANCE / parts.len() as f64 {
                found.push(Finding {
                    effect: "stale-sample",
                    channels: part.clone(),
                    what: format!(
                        "{count} samples in which all axes repeat the one before; by chance {:.0}",
                        rate * samples as f64
                    ),
                    step: None,
                });
            }
        }
    }
    found
}

/// Channels of a kind, a part each: those of one group.
fn parts(unit: &UnitDescription, kind: Kind) -> Vec<Vec<usize>> {
    let own = |group: &str| {
        let channels = unit.channels.iter().enumerate();
        let own =
            channels.filter(|(_, channel)| channel.sensor == kind && channel.group == group && sends_codes(channel));
        own.map(|(index, _)| index).collect()
    };
    unit.groups().into_iter().map(own).collect()
}

/// \[counts\] what all codes of each channel lie apart, where that is more than one.
fn lost_bits(log: &Log, unit: &UnitDescription) -> Vec<Option<i64>> {
    let of = |(channel, series): (&Channel, &Series)| {
        if !sends_codes(channel) || series.values.len() < LEAST {
            return None;
        }
        let first = code(channel, series.values[0]);
        let apart = series.values.iter().map(|value| (code(channel, *value) - first).abs());
        let step = apart.fold(0, greatest_common_factor);
        // Codes that hardly change may all be even by chance.
        let changes = series.values.windows(2).filter(|pair| pair[0] != pair[1]).count();
        (step > 1 && changes >= LEAST / 2).then_some(step)
    };
    unit.channels.iter().zip(&log.channels).map(of).collect()
}

/// Lost bits, a finding for each part and step.
fn of_parts(unit: &UnitDescription, steps: &[Option<i64>]) -> Vec<Finding> {
    let mut found: Vec<Finding> = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        let Some(step) = *step else { continue };
        let is_own = |finding: &&mut Finding| {
            let other = &unit.channels[finding.channels[0]];
            finding.step == Some(step)
                && (&other.group, other.sensor) == (&unit.channels[index].group, unit.channels[index].sensor)
        };
        match found.iter_mut().find(is_own) {
            Some(finding) => finding.channels.push(index),
            None => found.push(Finding {
                effect: "coarse-quantisation",
                channels: vec![index],
                what: format!("all codes are a multiple of {step} apart"),
                step: Some(step),
            }),
        }
    }
    found
}

fn stuck(log: &Log, unit: &UnitDescription) -> Vec<Finding> {
    let is_stuck = |(channel, series): (&Channel, &Series)| {
        let is_one = series.values.windows(2).all(|pair| pair[0] == pair[1]);
        sends_codes(channel) && series.values.len() >= LEAST && is_one && channel.noise_sigma > RESTLESS * channel.lsb
    };
    let channels = unit.channels.iter().zip(&log.channels).enumerate();
    let stuck = channels.filter(|(_, pair)| is_stuck(*pair));
    stuck
        .map(|(index, _)| Finding {
            effect: "stuck-channel",
            channels: vec![index],
            what: "one code throughout".to_owned(),
            step: None,
        })
        .collect()
}

fn greatest_common_factor(one: i64, other: i64) -> i64 {
    if other == 0 {
        one
    } else {
        greatest_common_factor(other, one % other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    /// Four plates with three accelerometers each, a noise of two codes, changed as told.
    fn logged(change: impl Fn(usize, usize, f64, f64) -> f64) -> (Log, UnitDescription) {
        let mut text = "name = \"x\"\ncycle_s = 0.2\n".to_owned();
        for index in 0..12 {
            text += &format!(
                "[[channel]]\nname = \"a{index}\"\nsensor = \"accelerometer\"\ngroup = \"plate {}\"\naxis_b = [1.0, 0.0, 0.0]\n\
                 lsb = 0.1\nnoise_sigma = 0.2\nbits = 12\n",
                index / 3 + 1
            );
        }
        let unit = UnitDescription::read(&text, "unit.toml").expect("a unit");
        let mut log = Log::empty(12);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut before = [0.0; 12];
        for row in 0..600 {
            log.start_s.push(0.2 * row as f64);
            for (index, before) in before.iter_mut().enumerate() {
                let noise: f64 = StandardNormal.sample(&mut random);
                let value = change(index, row, (2.0 * noise).round() * 0.1, *before);
                *before = value;
                log.channels[index].rows.push(row as u32);
                log.channels[index].values.push(value);
            }
        }
        (log, unit)
    }

    fn found(change: impl Fn(usize, usize, f64, f64) -> f64) -> Vec<Finding> {
        let (log, unit) = logged(change);
        look(&log, &unit)
    }

    fn told(found: &[Finding]) -> Vec<(&'static str, Vec<usize>)> {
        found
            .iter()
            .map(|finding| (finding.effect, finding.channels.clone()))
            .collect()
    }

    #[test]
    fn codes_of_a_healthy_unit_say_nothing() {
        assert_eq!(found(|_, _, value, _| value), []);
    }

    #[test]
    fn samples_that_a_part_sends_twice_are_found_at_that_part() {
        let twice = found(|index, row, value, before| if index / 3 == 2 && row % 20 == 7 { before } else { value });
        assert_eq!(told(&twice), [("stale-sample", vec![6, 7, 8])]);
    }

    #[test]
    fn lost_bits_and_a_channel_that_stands_are_found() {
        let coarse = found(|index, _, value, _| match index {
            3..=5 => (value / 0.4).floor() * 0.4,
            9 => 1.3,
            _ => value,
        });
        assert_eq!(
            told(&coarse),
            [("coarse-quantisation", vec![3, 4, 5]), ("stuck-channel", vec![9])]
        );
        assert_eq!(coarse[0].step, Some(4));
    }

    #[test]
    fn what_was_found_no_longer_speaks_in_the_fit() {
        let (mut log, mut unit) = logged(|index, row, value, before| match index {
            0..=2 if row % 20 == 7 => before,
            3 => (value / 0.4).floor() * 0.4,
            9 => 1.3,
            _ => value,
        });
        let found = look(&log, &unit);
        taken_out(&mut log, &mut unit, &found);
        let rows = |channel: usize| log.channels[channel].rows.len();
        // Thirty were sent twice; a few more repeat by chance.
        assert!((560..=570).contains(&rows(0)) && rows(0) == rows(1), "{}", rows(0));
        assert_eq!([rows(9), rows(11)], [0, 600]);
        // A step of 0.4 has the deviation 0.4 / sqrt(12) and cuts off half of it at most.
        let coarse = &unit.channels[3];
        assert!((coarse.noise_sigma - 0.2_f64.hypot(0.115_470)).abs() < 1e-6);
        assert!((coarse.bias_sigma - 0.2).abs() < 1e-9, "{}", coarse.bias_sigma);
        assert_eq!(unit.channels[11].noise_sigma, 0.2);
    }
}
