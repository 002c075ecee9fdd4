//! Old samples of a part, by the others of its kind: they moved, and it repeated.
//!
//! In: a log and its unit. Out: a [`Finding`] for each part of three axes that repeats all of them where it should have read something else.
//!
//! Few old samples drown among those that repeat where a unit rests. So rows are asked in which it does not. The change of a row that another
//! part reads along its axes is a vector; along those of this part it comes to `p`, off by noise and by [`ELSEWHERE`] of itself:
//! `s^2 = 4 (NOISIER sigma)^2 + (ELSEWHERE p)^2`, for both differences have the noise of two samples. That all axes repeat is then no likelier than
//! `exp(-sum p^2/s^2 / 2)`, and of several other parts the one counts that makes it likeliest. Where the sum of these chances over all rows that moved
//! leaves Chernoff's bound of Poisson's tail below [`RARE`], the samples are old.
//!
//! One part that reads something of its own, a magnet or a reversed bit, makes no row move, for two others have to. A part that does not
//! change as the others say in most rows has another place or another field, and is not looked at.

use nalgebra::{Matrix3, Vector3};
use twin::predict::{Kind, UnitDescription};

use super::{AXES, Finding, parts};
use crate::{
    input::log::Log,
    thresholds::{RARE, SAID},
};

/// Part of a change that is another one elsewhere on the unit, and some 20 of a packet's 200 ms later. Assumed; a larger one asks for quicker turns.
const ELSEWHERE: f64 = 0.3;

/// Times the described noise that a healthy part may have, as the units that are dealt a little wrong have at most (ring R0m).
const NOISIER: f64 = 1.5;

/// Chance of a repeat below which a row moved: over the 3000 packets of ten minutes these add up to less than one.
const MOVED: f64 = 1e-4;

/// Other parts that must say so.
const WITNESSES: usize = 2;

/// Old samples at least: the others may have been wrong in one row.
const LEAST_OLD: f64 = 2.0;

/// Parts that repeat where they should have changed.
pub fn stale(log: &Log, unit: &UnitDescription, is_spoilt: &dyn Fn(usize) -> bool) -> Vec<Finding> {
    let of_kind = |kind: Kind| -> Vec<Part> {
        let all = parts(unit, kind).into_iter();
        all.filter(|own| !own.iter().any(|channel| is_spoilt(*channel)))
            .filter_map(|own| Part::of(log, unit, &own))
            .collect()
    };
    let kinds = [Kind::Accelerometer, Kind::Magnetometer].map(of_kind);
    let looked_at = kinds.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    let least = (looked_at / RARE).ln();
    let found = kinds.iter().flat_map(|kind| {
        let old = |part: &'_ Part| part.old(kind);
        kind.iter().filter_map(move |part| Some((old(part)?, part)))
    });
    found
        .filter(|((count, chance), _)| *count >= LEAST_OLD && count * (count / chance).ln() - count + chance > least)
        .map(|((count, _), part)| Finding {
            effect: "stale-sample",
            channels: part.channels.clone(),
            what: format!(
                "{count} samples in which all axes repeat the one before, where all others of the kind changed"
            ),
            step: None,
            looks: Vec::new(),
            losses: Vec::new(),
        })
        .collect()
}

/// Three axes.
struct Part {
    channels: Vec<usize>,
    axes: Matrix3<f64>,
    sigmas: Vector3<f64>,
    /// Row by row, what each axis changed by since the row before.
    changes: Vec<Option<Vector3<f64>>>,
    /// The same as a vector in b.
    changes_b: Vec<Option<Vector3<f64>>>,
}

impl Part {
    fn of(log: &Log, unit: &UnitDescription, channels: &[usize]) -> Option<Self> {
        let [x, y, z] = <[usize; AXES]>::try_from(channels).ok()?;
        let axis = |channel: usize| unit.channels[channel].axis_b.transpose();
        let axes = Matrix3::from_rows(&[axis(x), axis(y), axis(z)]);
        let inverse = axes.try_inverse()?;
        let changes = [x, y, z].map(|channel| {
            let mut changes = vec![None; log.start_s.len()];
            let series = &log.channels[channel];
            for (rows, values) in series.rows.windows(2).zip(series.values.windows(2)) {
                if rows[0] + 1 == rows[1] {
                    changes[rows[1] as usize] = Some(values[1] - values[0]);
                }
            }
            changes
        });
        let of_row = |row: usize| Some(Vector3::new(changes[0][row]?, changes[1][row]?, changes[2][row]?));
        let changes: Vec<Option<Vector3<f64>>> = (0..log.start_s.len()).map(of_row).collect();
        Some(Self {
            channels: channels.to_vec(),
            axes,
            sigmas: Vector3::new(x, y, z).map(|channel| unit.channels[channel].sigma()),
            changes_b: changes
                .iter()
                .map(|change| change.map(|change| inverse * change))
                .collect(),
            changes,
        })
    }

    /// Samples that are old, and how many chance makes; none of a part that does not change as the others of its kind do.
    fn old(&self, kind: &[Self]) -> Option<(f64, f64)> {
        let (mut moved, mut followed, mut count, mut chance) = (0.0, 0.0, 0.0, 0.0);
        let others: Vec<&Self> = kind.iter().filter(|other| other.channels != self.channels).collect();
        for (row, change) in self.changes.iter().enumerate() {
            let Some(change) = change else { continue };
            let told = others
                .iter()
                .filter_map(|other| Some(self.axes * other.changes_b[row]?));
            let told: Vec<(f64, f64)> = told.map(|told| self.off(change, &told)).collect();
            let least = told.iter().min_by(|one, other| one.0.total_cmp(&other.0));
            let Some((size, off)) = least.filter(|_| told.len() >= WITNESSES) else {
                continue;
            };
            let likely = (-0.5 * size).exp();
            if likely < MOVED {
                moved += 1.0;
                chance += likely;
                // Nearer to what is told than half the way to nothing.
                followed += f64::from(u8::from(*off < 0.25 * size));
                count += f64::from(u8::from(*change == Vector3::zeros()));
            }
        }
        (followed > SAID * moved).then_some((count, chance))
    }

    /// Of a change that another part tells, its size and how far this one is off it, as squares.
    fn off(&self, change: &Vector3<f64>, told: &Vector3<f64>) -> (f64, f64) {
        let weights = Vector3::from_fn(|axis, _| {
            let noise = 2.0 * NOISIER * self.sigmas[axis];
            1.0 / (noise * noise + (ELSEWHERE * told[axis]).powi(2))
        });
        let square = |of: Vector3<f64>| of.component_mul(&of).dot(&weights);
        (square(*told), square(change - told))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    /// What is said of four magnetometers with a noise of two codes in a unit that turns in the last of ten parts of the log, in rows in which
    /// a part sends the row before as told; `own` is what a part reads besides.
    fn found(is_old: impl Fn(usize, u32) -> bool, own: impl Fn(usize, u32) -> f64) -> Vec<Finding> {
        let (log, unit) = logged(is_old, own);
        stale(&log, &unit, &|_| false)
    }

    fn logged(is_old: impl Fn(usize, u32) -> bool, own: impl Fn(usize, u32) -> f64) -> (Log, UnitDescription) {
        let mut text = "name = \"x\"\ncycle_s = 0.2\n".to_owned();
        for index in 0..12 {
            let axis = ["[1.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]", "[0.0, 0.0, 1.0]"][index % 3];
            text += &format!(
                "[[channel]]\nname = \"m{index}\"\nsensor = \"magnetometer\"\ngroup = \"plate {}\"\naxis_b = {axis}\nlsb = 0.1\n\
                 noise_sigma = 0.2\nbits = 12\n",
                index / 3 + 1
            );
        }
        let unit = UnitDescription::read(&text, "unit.toml").expect("a unit");
        let mut log = Log::empty(12);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut before = [0.0; 12];
        for row in 0..1500_u32 {
            log.start_s.push(0.2 * f64::from(row));
            let turned = if row < 1350 { 0.0 } else { 0.7 * f64::from(row - 1350) };
            let field = [30.0 * turned.cos(), 30.0 * turned.sin(), 20.0 * (0.4 * turned).cos()];
            for (index, before) in before.iter_mut().enumerate() {
                let noise: f64 = StandardNormal.sample(&mut random);
                let value = field[index % 3] + own(index / 3, row) + 0.2 * noise;
                *before = if is_old(index / 3, row) {
                    *before
                } else {
                    (value / 0.1).round() * 0.1
                };
                log.channels[index].rows.push(row);
                log.channels[index].values.push(*before);
            }
        }
        (log, unit)
    }

    #[test]
    fn parts_that_move_or_rest_together_have_no_old_samples() {
        assert_eq!(found(|_, _| false, |_, _| 0.0), []);
        // Rows that were written twice, or that all parts sent twice, move nowhere.
        assert_eq!(found(|_, row| row % 20 == 7, |_, _| 0.0), []);
    }

    #[test]
    fn two_old_samples_in_a_turn_are_found_at_each_part() {
        let old = |part: usize, row: u32| row == 1400 + 7 * part as u32 || row == 1450 + 7 * part as u32;
        let (log, unit) = logged(old, |_, _| 0.0);
        let found = super::super::look(&log, &unit);
        let channels: Vec<&Vec<usize>> = found.iter().map(|own| &own.channels).collect();
        assert_eq!(
            channels,
            [&vec![0, 1, 2], &vec![3, 4, 5], &vec![6, 7, 8], &vec![9, 10, 11]]
        );
    }

    #[test]
    fn a_part_that_lies_still_where_others_feel_something_of_their_own_sends_nothing_twice() {
        // Three of four beside a current that changes; the fourth repeats where it rests.
        let current = |part: usize, row: u32| {
            if part > 0 && row < 1350 {
                20.0 * f64::from(row % 2)
            } else {
                0.0
            }
        };
        assert_eq!(found(|part, row| part == 0 && row < 1350 && row % 50 == 3, current), []);
    }
}
