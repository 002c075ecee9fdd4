//! Samples that a part sent twice, by the rows of a log alone.
//!
//! In: a log of physical units before it is thinned, and its unit. Out: [`Repeats`], the parts whose axes repeat the row before together
//! oftener than they do by chance.
//!
//! A sample that is a few steps wide repeats by chance, on one axis in ten or fifty. All axes of a part do so with the product of these
//! parts, `chance = sum over stretches of n p_x p_y p_z`: stretch by stretch ([`STRETCH`]), for a part at rest repeats oftener. Axes that a
//! calibration has mixed repeat together, oftener than that product; but what repeats by chance is as often the sample before the last, and what
//! was sent twice is not; and steps of a few counts that axes make by chance return as often as no step does, where what was sent twice is followed
//! by steps of all sizes. Chance is the largest of the three. Rows in which
//! another part repeats too are the logger's, which wrote them twice, and are not looked at. Those in which every part does so say how often it
//! does: one part may have been changed since. With `c` repeats where `e` are expected chance has
//! `c ln(c/e) - c + e` nats against it (Chernoff's bound of Poisson's tail). Rests shorter than a stretch still bring more than is expected
//! (gyros of six healthy recordings repeat 0.7 to 1.2 times as often), so a repeat has to be likelier old than not too, `(c - e)/c`.
//! Whether the motion was followed does not matter, and of rows that were thinned it cannot be seen.
//!
//! Refuses nothing. Beside a reference these are not looked at: units that send codes (the search for effects on the scatter knows their steps; without
//! a reference [`crate::parity::codes`] asks of them), parts with fewer than
//! three axes, of which one repeats too often, and magnetometers, which are often read oftener than they measure.

use std::collections::HashMap;

use twin::predict::{Kind, UnitDescription};

use crate::{
    input::log::{Log, Series},
    thresholds::{RARE, SAID},
};

/// Axes of a part that are taken together.
const AXES: usize = 3;

/// Part of the largest reading within which two steps are one: f64 has 1e-16, a file nine digits.
const SAME_STEP: f64 = 1e-9;

/// Rows over which axes repeat alike: of 32 to 300 all say the same of six recordings.
const STRETCH: usize = 64;

/// A part that sends samples twice.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeats {
    /// Its channels.
    pub channels: Vec<usize>,
    /// Part of the samples that are old.
    pub share: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// \[nats\] against chance.
    pub nats: f64,
    /// Samples in which all axes repeat those of the row before.
    pub count: f64,
    /// How many do by chance.
    pub chance: f64,
}

/// Parts that repeat oftener than by chance; `None` of a unit that sends codes.
pub fn repeats(log: &Log, unit: &UnitDescription) -> Option<Vec<Repeats>> {
    if unit.channels.iter().any(|channel| channel.bits.is_some()) {
        return None;
    }
    Some(by_axes(log, unit, &[Kind::Accelerometer, Kind::Gyro]))
}

/// The same of the parts of some kinds, whether they send codes or not.
pub fn by_axes(log: &Log, unit: &UnitDescription, kinds: &[Kind]) -> Vec<Repeats> {
    let parts = parts(unit, kinds);
    let every = self::parts(unit, &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer]);
    let as_before = |back: usize| -> Vec<Vec<bool>> {
        let all = log.channels.iter();
        all.map(|series| repeated(series, log.start_s.len(), back)).collect()
    };
    let (repeated, as_last_but_one) = (as_before(1), as_before(2));
    let rows: Vec<usize> = (0..log.start_s.len()).collect();
    let all_of = |row: usize, channels: &[usize]| channels.iter().all(|channel| repeated[*channel][row]);
    let is_of_another = |row: usize, part: &[usize]| every.iter().any(|other| other != part && all_of(row, other));
    let whole = |row: usize| parts.len() > 1 && parts.iter().all(|part| all_of(row, part));
    let by_logger = rows.iter().filter(|row| whole(**row)).count() as f64;
    let of_part = |channels: &Vec<usize>| {
        let count = rows
            .iter()
            .filter(|row| all_of(**row, channels) && !is_of_another(**row, channels))
            .count() as f64;
        let by_chance = |rows: &[usize]| {
            let share = |channel: &usize| {
                let own = rows.iter().filter(|row| repeated[*channel][**row]).count();
                own as f64 / rows.len() as f64
            };
            rows.len() as f64 * channels.iter().map(share).product::<f64>()
        };
        let returns = |row: &&usize| {
            let is_as_before = channels.iter().all(|channel| as_last_but_one[*channel][**row]);
            is_as_before && !all_of(**row, channels) && !is_of_another(**row, channels)
        };
        let apart: f64 = rows.chunks(STRETCH).map(by_chance).sum();
        let chance = apart.max(rows.iter().filter(returns).count() as f64);
        let chance = match count > chance {
            true => chance.max(commonest_step(log, channels)),
            false => chance,
        };
        let expected = chance + by_logger + 1.0;
        let nats = if count - expected >= SAID * count {
            count * (count / expected).ln() - count + expected
        } else {
            0.0
        };
        let is_looked_at = |row: &&u32| !is_of_another(**row as usize, channels);
        let samples = log.channels[channels[0]]
            .rows
            .iter()
            .filter(is_looked_at)
            .count()
            .max(1) as f64;
        Repeats {
            channels: channels.clone(),
            share: (count - chance).max(0.0) / samples,
            sigma: count.sqrt() / samples,
            nats,
            count,
            chance,
        }
    };
    let least = (parts.len().max(1) as f64 / RARE).ln();
    let all = parts.iter().map(of_part);
    all.filter(|repeats| repeats.nats > least).collect()
}

/// Per row, whether a channel has a sample and it is that of so many rows before.
fn repeated(series: &Series, rows: usize, back: usize) -> Vec<bool> {
    let mut repeated = vec![false; rows];
    let spans = series.rows.windows(back + 1).zip(series.values.windows(back + 1));
    for (at, _) in spans.filter(|(rows, values)| rows[0] + back as u32 == rows[back] && values[0] == values[back]) {
        repeated[at[back] as usize] = true;
    }
    repeated
}

/// How often the step of all axes of a part that is commonest, of those that are one, is made from a row to the next.
fn commonest_step(log: &Log, channels: &[usize]) -> f64 {
    let mut steps: HashMap<Vec<i64>, usize> = HashMap::new();
    let axes: Vec<Vec<f64>> = channels.iter().map(|channel| along_rows(log, *channel)).collect();
    let largest = axes.iter().flatten().filter(|value| value.is_finite());
    let least = SAME_STEP * largest.fold(f64::MIN_POSITIVE, |most, value| f64::max(most, value.abs()));
    for row in 1..log.start_s.len() {
        let step = axes.iter().map(|axis| ((axis[row] - axis[row - 1]) / least).round());
        let step: Option<Vec<i64>> = step.map(|step| step.is_finite().then_some(step as i64)).collect();
        if let Some(step) = step.filter(|step| step.iter().any(|own| *own != 0)) {
            *steps.entry(step).or_default() += 1;
        }
    }
    steps.into_values().max().unwrap_or(0) as f64
}

/// A channel at every row of a log; NaN where it has no sample.
fn along_rows(log: &Log, channel: usize) -> Vec<f64> {
    let series = &log.channels[channel];
    let mut rows = vec![f64::NAN; log.start_s.len()];
    (series.rows.iter().zip(&series.values)).for_each(|(row, value)| rows[*row as usize] = *value);
    rows
}

/// Channels of each part of some kinds: those of one kind in one group.
fn parts(unit: &UnitDescription, kinds: &[Kind]) -> Vec<Vec<usize>> {
    let of = |kind: Kind| {
        unit.groups().into_iter().map(move |group| {
            let channels = unit.channels.iter().enumerate();
            let own = channels.filter(|(_, channel)| channel.sensor == kind && channel.group == group);
            own.map(|(index, _)| index).collect::<Vec<usize>>()
        })
    };
    (kinds.iter().copied())
        .flat_map(of)
        .filter(|part| part.len() >= AXES)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    const ROWS: u32 = 6000;

    /// An accelerometer, a gyro and a magnetometer, a noise of two steps, at rest in every second stretch; `is_old` says of part and row whether the row
    /// before is sent again, with some number between none and one.
    fn found(is_old: impl Fn(usize, u32, f64) -> bool) -> Vec<Repeats> {
        let (unit, log) = logged(is_old, 2.0, [0.0, 3.0]);
        repeats(&log, &unit).expect("no codes")
    }

    /// The same with a noise of so many steps, moving by so many steps in even and in odd stretches.
    fn logged(is_old: impl Fn(usize, u32, f64) -> bool, noisy: f64, moving: [f64; 2]) -> (UnitDescription, Log) {
        let mut text = "name = \"x\"\ncycle_s = 0.01\n".to_owned();
        let sensors = ["accelerometer", "gyro", "magnetometer"];
        for (index, sensor) in sensors.iter().flat_map(|one| [one; 3]).enumerate() {
            text += &format!(
                "[[channel]]\nname = \"c{index}\"\nsensor = \"{sensor}\"\ngroup = \"unit\"\naxis_b = [1.0, 0.0, 0.0]\nlsb = 1.0\n\
                 noise_sigma = 0.2\n"
            );
        }
        let unit = UnitDescription::read(&text, "unit.toml").expect("a unit");
        let mut log = Log::empty(9);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        let mut before = [0.0; 9];
        for row in 0..ROWS {
            log.start_s.push(0.01 * f64::from(row));
            let moved = moving[row as usize / 500 % 2];
            for part in 0..3 {
                let chance: f64 = StandardNormal.sample(&mut random);
                let old = row > 0 && is_old(part, row, statrs::function::erf::erf(chance.abs() / 2f64.sqrt()));
                for (index, before) in before.iter_mut().enumerate().skip(3 * part).take(3) {
                    let noise: f64 = StandardNormal.sample(&mut random);
                    let fresh =
                        0.1 * (noisy * noise + moved * (f64::from(row) * (0.11 + 0.02 * index as f64)).sin()).round();
                    *before = if old { *before } else { fresh };
                    log.channels[index].rows.push(row);
                    log.channels[index].values.push(*before);
                }
            }
        }
        (unit, log)
    }

    #[test]
    fn a_part_that_repeats_by_chance_says_nothing() {
        assert_eq!(found(|_, _, _| false), []);
    }

    #[test]
    fn a_part_that_sends_samples_twice_is_found_with_its_share() {
        let found = found(|part, _, chance| part == 1 && chance < 0.05);
        let [only] = found.as_slice() else {
            panic!("{found:?}");
        };
        assert_eq!(only.channels, [3, 4, 5]);
        assert!((only.share - 0.05).abs() < 3.0 * only.sigma, "{only:?}");
    }

    #[test]
    fn rows_that_the_logger_wrote_twice_are_of_no_part() {
        assert_eq!(found(|_, row, _| row % 20 == 0), []);
        // Nor are some of them, or all, in which another part was changed since.
        assert_eq!(found(|part, row, _| row % 20 == 0 && (part == 0 || row % 80 != 0)), []);
        assert_eq!(found(|part, row, _| row % 20 == 0 && part != 1), []);
    }

    /// The gyros' steps are no longer along their axes: all three repeat where one does.
    #[test]
    fn axes_that_a_calibration_has_mixed_repeat_together_by_chance() {
        let mixed = |is_old: &dyn Fn(usize, u32, f64) -> bool, noisy: f64, moving: [f64; 2]| {
            let (unit, mut log) = logged(is_old, noisy, moving);
            for row in 0..ROWS as usize {
                let [x, y, z] = [3, 4, 5].map(|channel| log.channels[channel].values[row]);
                for (channel, value) in [
                    (3, x + 0.11 * y - 0.07 * z),
                    (4, y + 0.05 * z - 0.11 * x),
                    (5, z + 0.07 * x),
                ] {
                    log.channels[channel].values[row] = value;
                }
            }
            repeats(&log, &unit).expect("no codes")
        };
        assert_eq!(mixed(&|_, _, _| false, 2.0, [0.0, 3.0]), []);
        // As quick as the noise is large: the sample before the last is seldom the same.
        assert_eq!(mixed(&|_, _, _| false, 0.5, [15.0; 2]), []);
        let found = mixed(&|part, _, chance| part == 1 && chance < 0.05, 2.0, [0.0, 3.0]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].share - 0.05).abs() < 3.0 * found[0].sigma, "{found:?}");
    }
}
