//! What the codes say without any model: samples sent twice, bits that are lost or stuck, channels that stand still.
//!
//! In: a log and its unit. Out: [`Finding`]s, each an effect of the library with its channels. Nothing is predicted for these, so
//! they hold whatever the motion was.
//!
//! - **Samples sent twice.** The three axes of a part repeat their codes together by chance rarely, and as often as those of
//!   the other parts of its kind do. More repeats than Poisson's law allows at the largest rate among the others
//!   ([`RARE`]) are old samples; and so are more than its axes would make each by itself ([`crate::input::repeats`]), which
//!   holds where all parts of a kind send some.
//!   Few of them are seen where the others of the kind changed ([`moved`]). A gyro that is the only one of its plate is held against its own scatter ([`alone`]).
//! - **Lost bits.** All codes of a channel lie a multiple of `n` apart. By chance all differences of `k` codes are even with
//!   probability `2^(1 - k)`.
//! - **A stuck bit** ([`bits`]). One bit is the same in all codes, however often those above it change.
//! - **Stuck.** From some instant on all codes are one, where the described noise would change them, and where it changes those of
//!   the other channels of its kind.

mod alone;
mod bits;
mod moved;

use nalgebra::Vector3;
use statrs::{
    distribution::{DiscreteCDF, Poisson},
    function::erf::erf,
};
use twin::predict::{Channel, Kind, UnitDescription};

use crate::{
    input::{
        log::{Log, Series},
        repeats,
    },
    parity::lost::Loss,
    thresholds::RARE,
};

/// Samples from which codes say anything: that so many are all even is chance once in 2^63.
const LEAST: usize = 64;

/// Axes of a part that are taken together: one repeats too often by chance.
const AXES: usize = 3;

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
    /// Where channels look, of those that look elsewhere than described.
    pub looks: Vec<Look>,
    /// Packets that nobody counted.
    pub losses: Vec<Loss>,
}

/// Where a channel looks.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Which.
    pub channel: usize,
    /// Along what.
    pub axis_b: Vector3<f64>,
    /// \[m\] from where.
    pub lever_m: Vector3<f64>,
}

/// Looks at all channels.
pub fn look(log: &Log, unit: &UnitDescription) -> Vec<Finding> {
    look_along(log, log, unit)
}

/// The same of some rows of a log; old samples are counted in the whole of it, for nothing is fitted to them.
pub fn look_along(log: &Log, whole: &Log, unit: &UnitDescription) -> Vec<Finding> {
    let steps = lost_bits(log, unit);
    let mut others = of_parts(unit, &steps);
    others.extend(bits::stuck(log, unit, &steps));
    others.extend(stuck(log, unit));
    // A part of which one axis stands repeats as often as the other two do.
    let stands = stuck(whole, unit);
    let is_spoilt = |channel: usize| {
        let is_other = |own: &Finding| own.channels.contains(&channel);
        steps[channel].is_some() || others.iter().chain(&stands).any(is_other)
    };
    let mut found = stale(whole, unit, &is_spoilt);
    found.extend(alone::stale(whole, unit, &is_spoilt));
    for own in moved::stale(whole, unit, &is_spoilt) {
        if found.iter().all(|known| known.channels != own.channels) {
            found.push(own);
        }
    }
    found.extend(others);
    found
}

fn code(channel: &Channel, value: f64) -> i64 {
    (value / channel.lsb).round() as i64
}

/// Whether a channel rounds to codes.
pub fn sends_codes(channel: &Channel) -> bool {
    channel.bits.is_some() && channel.lsb > 0.0
}

/// Rows whose values are those of the row before in all of these channels.
pub(super) fn repeated(log: &Log, channels: &[usize]) -> Vec<u32> {
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

fn stale(log: &Log, unit: &UnitDescription, is_spoilt: &dyn Fn(usize) -> bool) -> Vec<Finding> {
    let mut found = Vec::new();
    for kind in [Kind::Accelerometer, Kind::Magnetometer, Kind::Gyro] {
        let parts: Vec<Vec<usize>> = parts(unit, kind)
            .into_iter()
            // Coarse codes repeat by themselves.
            .filter(|part| part.len() >= AXES && part.iter().all(|channel| !is_spoilt(*channel)))
            .collect();
        let counts: Vec<(usize, f64)> = (parts.iter())
            .map(|part| (log.channels[part[0]].rows.len(), repeated(log, part).len() as f64))
            .collect();
        for (at, part) in parts.iter().enumerate() {
            let (samples, count) = counts[at];
            let others = counts.iter().enumerate().filter(|(other, _)| *other != at);
            let rates = others.map(|(_, (samples, count))| (count + 1.0) / (*samples).max(1) as f64);
            let Some(rate) = rates.max_by(f64::total_cmp).filter(|_| samples >= LEAST) else {
                continue;
            };
            let tail = Poisson::new(rate * samples as f64).map_or(1.0, |law| law.sf((count as u64).saturating_sub(1)));
            if count >= 1.0 && tail < RARE / parts.len() as f64 {
                found.push(old_samples(part.clone(), count, rate * samples as f64));
            }
        }
    }
    let kinds = [Kind::Accelerometer, Kind::Magnetometer, Kind::Gyro];
    for own in repeats::by_axes(log, unit, &kinds) {
        let is_coded = |channel: &usize| sends_codes(&unit.channels[*channel]) && !is_spoilt(*channel);
        let is_known = found.iter().any(|known| known.channels == own.channels);
        if !is_known && own.channels.iter().all(is_coded) {
            found.push(old_samples(own.channels, own.count, own.chance));
        }
    }
    found
}

/// So many samples of a part that it sent twice, where chance makes so many.
fn old_samples(channels: Vec<usize>, count: f64, chance: f64) -> Finding {
    Finding {
        effect: "stale-sample",
        channels,
        what: format!("{count} samples in which all axes repeat the one before; by chance {chance:.0}"),
        step: None,
        looks: Vec::new(),
        losses: Vec::new(),
    }
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
                looks: Vec::new(),
                losses: Vec::new(),
            }),
        }
    }
    found
}

/// Samples at the end that are all one.
pub(super) fn alike_at_end(series: &Series) -> usize {
    let Some(end) = series.values.last() else { return 0 };
    series.values.iter().rev().take_while(|value| *value == end).count()
}

/// Probability that noise leaves a code as it is: of a normal law at most what lies within half a code of its middle.
fn left_by_noise(channel: &Channel) -> f64 {
    erf(0.5 * channel.lsb / (2f64.sqrt() * channel.noise_sigma))
}

/// Share of the samples from a row on that repeat the one before.
fn repeated_since(series: &Series, row: u32) -> f64 {
    let since = &series.values[series.rows.partition_point(|own| *own < row)..];
    let same = since.windows(2).filter(|pair| pair[0] == pair[1]).count();
    same as f64 / since.len().saturating_sub(1).max(1) as f64
}

/// Stuck channels. A unit that is quieter than described stands still in all channels of a kind, and is not stuck.
fn stuck(log: &Log, unit: &UnitDescription) -> Vec<Finding> {
    let since = |index: usize, channel: &Channel, series: &Series| {
        let alike = alike_at_end(series);
        let from = series.rows.len() - alike;
        if !sends_codes(channel) || alike < LEAST {
            return None;
        }
        let others = unit.channels.iter().zip(&log.channels).enumerate();
        let others = others.filter(|(other, (own, _))| *other != index && own.sensor == channel.sensor);
        let quiet = others.map(|(_, (_, own))| repeated_since(own, series.rows[from]));
        let chance = quiet.fold(left_by_noise(channel), f64::max).powf(alike as f64);
        (chance * (unit.channels.len() as f64) < RARE).then_some(from)
    };
    let channels = unit.channels.iter().zip(&log.channels).enumerate();
    let stuck = channels.filter_map(|(index, (channel, series))| Some((index, since(index, channel, series)?)));
    stuck
        .map(|(index, from)| Finding {
            effect: "stuck-channel",
            channels: vec![index],
            what: match from {
                0 => "one code throughout".to_owned(),
                _ => {
                    let row = log.channels[index].rows[from];
                    format!("one code from {:.1} s on", log.start_s[row as usize])
                }
            },
            step: None,
            looks: Vec::new(),
            losses: Vec::new(),
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
    use crate::parity::taken_out::taken_out;
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
    fn samples_that_all_parts_of_a_kind_send_twice_are_found_at_each() {
        let is_old = |part: usize, row: usize| (row + 5 * part) % 20 == 7;
        let twice = found(|index, row, value, before| if is_old(index / 3, row) { before } else { value });
        let every: Vec<_> = (0..4)
            .map(|part| ("stale-sample", (3 * part..3 * part + 3).collect()))
            .collect();
        assert_eq!(told(&twice), every);
    }

    #[test]
    fn a_part_of_which_one_axis_stands_sends_nothing_twice() {
        let stands = found(|index, _, value, _| if index == 5 { 1.3 } else { value });
        assert_eq!(told(&stands), [("stuck-channel", vec![5])]);
    }

    #[test]
    fn rows_that_all_parts_repeat_are_of_no_part() {
        assert_eq!(
            found(|_, row, value, before| if row % 20 == 7 { before } else { value }),
            []
        );
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
    fn a_channel_that_stands_from_an_instant_on_is_left_out_from_there() {
        let stands = |index: usize, row: usize, value: f64, before: f64| {
            let is_since = |from: usize| row > from;
            match index {
                5 if is_since(400) => before,
                // Shorter than chance excludes.
                7 if is_since(599 - LEAST / 2) => before,
                _ => value,
            }
        };
        let (mut log, mut unit) = logged(stands);
        let found = look(&log, &unit);
        assert_eq!(told(&found), [("stuck-channel", vec![5])]);
        assert_eq!(found[0].what, "one code from 80.0 s on");
        taken_out(&mut log, &mut unit, &found);
        assert_eq!([log.channels[5].rows.len(), log.channels[7].rows.len()], [400, 600]);
    }

    #[test]
    fn a_unit_that_is_quieter_than_described_is_not_stuck_where_it_rests() {
        let rests = |_: usize, row: usize, value: f64, before: f64| if row > 400 { before } else { value };
        assert_eq!(found(rests), []);
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
