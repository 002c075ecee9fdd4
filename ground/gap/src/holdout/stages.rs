//! The held-out gap along the pipeline: raw channels, calibrated vectors, attitude.
//!
//! In: the held-out samples and finished predictions, as for the shrink. Out: [`Stage`]s, each with what the nominal twin
//! gets wrong, what recalibration and the effect leave of it, and the floor: what a perfect twin with its own noise would
//! get wrong, on the same motion with the same holes and the same estimation.
//!
//! What the effect adds is taken off the samples before they are estimated (`y - (after - before)`): that is the unit as
//! it would be without it, whatever the effect is. Vectors are compared with what the nominal twin says, attitudes with
//! the reference. Where the unit can correct the effect itself, the samples stay as they are and are estimated through the
//! corrected [`Response`]s: `corrected`, the figure its owner gets.
//!
//! Stages without enough channels, and tables, which have no attitude, are left out.

use nalgebra::{UnitQuaternion, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use twin::predict::Twin;

use super::judge::{BLOCK_S, Finished, RESAMPLES, SEED, central_95};
use crate::{
    holdout::attitude::{Estimation, Response, Track},
    input::hold::Held,
};

/// Rows that a stage must be there in to be judged.
const LEAST_ROWS: usize = 50;

/// Part of its floor by which a stage must stand above it to be worth a quotient.
const WORTH: f64 = 0.01;

/// One stage of the pipeline.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// Which.
    pub name: &'static str,
    /// Unit of what follows.
    pub unit: &'static str,
    /// Root mean square error of the nominal twin's view.
    pub before: f64,
    /// With the calibration refitted.
    pub recalibrated: f64,
    /// With the effect taken off, and recalibrated.
    pub after: f64,
    /// Through the corrected calibration set, where the unit can correct the effect.
    pub corrected: Option<f64>,
    /// What a perfect twin would leave.
    pub floor: f64,
    /// 100 (before - after) / (before - floor); `None` where there is nothing above the floor.
    pub percent: Option<f64>,
    /// Its 95 % interval.
    pub interval_percent: [f64; 2],
    /// Rows judged.
    pub rows: usize,
}

/// Which readings are estimated, in the order of a row's errors.
const BEFORE: usize = 0;
const RECALIBRATED: usize = 1;
const AFTER: usize = 2;
const FLOOR: usize = 3;

/// The first of [`ESTIMATED`] that is an attitude.
const FIRST_ATTITUDE: usize = 3;

/// Names and units of the estimated stages.
const ESTIMATED: [(&str, &str); 5] = [
    ("force", "m/s2"),
    ("rate", "rad/s"),
    ("field", "uT"),
    ("attitude by TRIAD", "deg"),
    ("attitude by the Kalman filter", "deg"),
];

impl Held {
    /// Judges the calibrated vectors and the attitude. `corrected` holds the responses of the channels with the effect in the
    /// calibration.
    pub fn stages(&self, twin: &Twin, finished: Finished, corrected: Option<&[Response]>) -> Vec<Stage> {
        let log_rows = twin.starts_s().len();
        let mut measured = vec![vec![f64::NAN; log_rows]; self.samples().len()];
        for (dense, series) in measured.iter_mut().zip(self.samples()) {
            for (row, value) in series.rows.iter().zip(&series.values) {
                dense[*row as usize] = *value;
            }
        }
        let rows: Vec<usize> = (0..log_rows)
            .filter(|row| measured.iter().any(|channel| channel[*row].is_finite()))
            .collect();
        let without = |model: &[Vec<f64>]| -> Vec<Vec<f64>> {
            let channels = measured.iter().zip(model).zip(finished.before);
            let cleaned = channels.map(|((measured, model), before)| {
                let samples = measured.iter().zip(model).zip(before);
                samples.map(|((y, model), before)| y - (model - before)).collect()
            });
            cleaned.collect()
        };
        let after = self.course(finished.said()).predicted();
        let nominal: Vec<Response> = twin.unit().channels.iter().map(Response::nominal).collect();
        let estimation = Estimation::new(twin, rows);
        let truth = estimation.track(finished.before, &nominal);
        let mut tracks: Vec<Track> = [
            measured.clone(),
            without(finished.recalibrated),
            without(&after),
            perfect(&measured, &finished, &|channel, row| finished.sigmas[channel][row]),
        ]
        .iter()
        .map(|readings| estimation.track(readings, &nominal))
        .collect();
        // Vectors are compared with what the reference says at that instant, and its errors are in the floor; a filter is not
        // fed with them.
        let steady = |channel: usize, _: usize| finished.steady[channel];
        let undisturbed = estimation.track(&perfect(&measured, &finished, &steady), &nominal);
        tracks.extend(corrected.map(|responses| estimation.track(&measured, responses)));
        let reference = estimation.reference();
        let starts_s: Vec<f64> = estimation.rows().iter().map(|row| twin.starts_s()[*row]).collect();
        let stage = |(at, (name, unit)): (usize, &(&'static str, &'static str))| {
            let of = |(number, track): (usize, &Track)| {
                let is_fed = number == FLOOR && at >= FIRST_ATTITUDE;
                errors(if is_fed { &undisturbed } else { track }, at, &truth, &reference)
            };
            let errors: Vec<Vec<Option<f64>>> = tracks.iter().enumerate().map(of).collect();
            judge(name, unit, &errors, &starts_s)
        };
        ESTIMATED.iter().enumerate().filter_map(stage).collect()
    }
}

/// What a perfect twin would have measured: its own predictions with noise of these sigmas, of a channel at a row, where samples
/// are.
fn perfect(measured: &[Vec<f64>], finished: &Finished, sigma: &dyn Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let mut noisy = |(channel, (measured, before)): (usize, (&Vec<f64>, &Vec<f64>))| -> Vec<f64> {
        let samples = measured.iter().zip(before).enumerate();
        samples
            .map(|(row, (measured, before))| {
                let noise: f64 = StandardNormal.sample(&mut random);
                // A hole stays one.
                if measured.is_finite() {
                    before + sigma(channel, row) * noise
                } else {
                    f64::NAN
                }
            })
            .collect()
    };
    measured
        .iter()
        .zip(finished.before)
        .enumerate()
        .map(&mut noisy)
        .collect()
}

/// Squared errors of one stage at every row.
fn errors(track: &Track, stage: usize, truth: &Track, reference: &[UnitQuaternion<f64>]) -> Vec<Option<f64>> {
    let angles = |found: &[Option<UnitQuaternion<f64>>]| -> Vec<Option<f64>> {
        let pairs = found.iter().zip(reference);
        pairs
            .map(|(found, truth)| Some(found.as_ref()?.angle_to(truth).to_degrees().powi(2)))
            .collect()
    };
    match stage {
        3 => angles(&track.triad),
        4 => angles(&track.filter),
        _ => {
            let pairs = track.vectors[stage].iter().zip(&truth.vectors[stage]);
            let apart = |(found, truth): (&Option<Vector3<f64>>, &Option<Vector3<f64>>)| {
                Some((found.as_ref()? - truth.as_ref()?).norm_squared())
            };
            pairs.map(apart).collect()
        }
    }
}

/// Sums over the rows that every variant has, and their bootstrap in blocks.
fn judge(name: &'static str, unit: &'static str, errors: &[Vec<Option<f64>>], starts_s: &[f64]) -> Option<Stage> {
    let first_s = *starts_s.first()?;
    let variants = errors.len();
    let mut blocks: Vec<(f64, Vec<f64>)> = Vec::new();
    let mut block_of = None;
    for (row, start_s) in starts_s.iter().enumerate() {
        let all: Option<Vec<f64>> = errors
            .iter()
            .map(|variant| variant[row].filter(|e| e.is_finite()))
            .collect();
        let Some(all) = all else { continue };
        let number = ((start_s - first_s) / BLOCK_S) as usize;
        if block_of != Some(number) {
            block_of = Some(number);
            blocks.push((0.0, vec![0.0; variants]));
        }
        if let Some((count, sums)) = blocks.last_mut() {
            *count += 1.0;
            sums.iter_mut().zip(&all).for_each(|(sum, error)| *sum += error);
        }
    }
    let total = added(blocks.iter(), variants);
    if (total.0 as usize) < LEAST_ROWS {
        return None;
    }
    let rms = |variant: usize| (total.1[variant] / total.0).sqrt();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let pick = rand_distr::Uniform::new(0, blocks.len()).ok()?;
    let resampled = (0..RESAMPLES).filter_map(|_| {
        let drawn: Vec<usize> = (0..blocks.len()).map(|_| pick.sample(&mut random)).collect();
        percent(&added(drawn.iter().map(|at| &blocks[*at]), variants))
    });
    let percents: Vec<f64> = resampled.collect();
    Some(Stage {
        name,
        unit,
        before: rms(BEFORE),
        recalibrated: rms(RECALIBRATED),
        after: rms(AFTER),
        corrected: (variants > FLOOR + 1).then(|| rms(FLOOR + 1)),
        floor: rms(FLOOR),
        percent: percent(&total),
        interval_percent: if percents.is_empty() {
            [0.0; 2]
        } else {
            central_95(percents)
        },
        rows: total.0 as usize,
    })
}

fn added<'a>(blocks: impl Iterator<Item = &'a (f64, Vec<f64>)>, variants: usize) -> (f64, Vec<f64>) {
    blocks.fold((0.0, vec![0.0; variants]), |(count, mut sums), block| {
        sums.iter_mut().zip(&block.1).for_each(|(sum, more)| *sum += more);
        (count + block.0, sums)
    })
}

fn percent((count, sums): &(f64, Vec<f64>)) -> Option<f64> {
    let rms = |variant: usize| (sums[variant] / count).sqrt();
    let above = rms(BEFORE) - rms(FLOOR);
    (above > WORTH * rms(FLOOR)).then(|| 100.0 * (rms(BEFORE) - rms(AFTER)) / above)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(values: [f64; 4]) -> Vec<Vec<Option<f64>>> {
        values.map(|value| vec![Some(value * value); 600]).into()
    }

    fn starts_s() -> Vec<f64> {
        (0..600).map(|row| f64::from(row) * 0.2).collect()
    }

    #[test]
    fn what_is_left_is_counted_from_the_floor() {
        let stage = judge("x", "deg", &rows([3.0, 2.5, 1.5, 1.0]), &starts_s()).expect("judged");
        assert!((stage.percent.expect("a gap") - 75.0).abs() < 1e-9);
        assert_eq!(
            (stage.before, stage.recalibrated, stage.after, stage.floor),
            (3.0, 2.5, 1.5, 1.0)
        );
        assert!((stage.interval_percent[0] - 75.0).abs() < 1e-9);
    }

    #[test]
    fn a_stage_at_its_floor_has_no_percentage() {
        let stage = judge("x", "deg", &rows([1.0, 1.0, 1.2, 1.0]), &starts_s()).expect("judged");
        assert_eq!(stage.percent, None);
    }

    #[test]
    fn rows_that_one_variant_lacks_are_left_out_of_all() {
        let mut errors = rows([3.0, 3.0, 3.0, 1.0]);
        errors[2][..590].fill(None);
        assert_eq!(judge("x", "deg", &errors, &starts_s()), None);
    }
}
