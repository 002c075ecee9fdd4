//! Residuals with and without something in them.

mod clock;
mod common;
mod recurrence;
mod scatter;
mod shared;

use rand_distr::{Distribution, StandardNormal, Uniform};

use super::{view::LEVELLED, *};
use crate::null::joint::Columns;
use nalgebra::{DMatrix, Vector3};

const SAMPLES: usize = 600;
const CHANNELS: usize = 3;

/// Three gyros, each with an open bias of five sigma of noise.
fn scene() -> (Vec<View>, Joint) {
    scene_of(CHANNELS)
}

/// So many, along x, y, z and again.
fn scene_of(channels: usize) -> (Vec<View>, Joint) {
    let phase: Vec<f64> = (0..SAMPLES).map(|row| row as f64 / SAMPLES as f64).collect();
    let view = |channel: usize| View {
        name: format!("g{channel}"),
        kind: 1,
        part: channel,
        group: channel,
        axis_b: Vector3::ith(channel % 3, 1.0),
        phase: phase.clone(),
        motion: DMatrix::from_fn(SAMPLES, 2, |row, column| {
            (row as f64 * 0.01 * (column + 1) as f64).sin()
        }),
        turned: DMatrix::from_fn(SAMPLES, 3, |row, axis| {
            let felt_b = Vector3::new(1.0, (row as f64 * 0.03).sin(), (row as f64 * 0.02).cos());
            felt_b.cross(&Vector3::ith(channel % 3, 1.0))[axis]
        }),
        felt: DVector::from_fn(SAMPLES, |row, _| (row as f64 * 0.07 + channel as f64).sin()),
        predicted: DVector::from_fn(SAMPLES, |row, _| 40.0 * (row as f64 * 0.5 + channel as f64).sin()),
        open: vec![Open::new(
            "bias".into(),
            1.0,
            Vector3::ith(channel % 3, 1.0),
            [Vector3::zeros(); 2],
        )],
        codes: None,
        clock: None,
        instrument: None,
        is_limited: false,
        levels: vec![(0..SAMPLES).map(|row| (row * row / 7 % LEVELS) as u8).collect(); LEVELLED.len()],
    };
    let columns = Columns {
        nuisance: DMatrix::from_element(SAMPLES, 1, 5.0).into(),
        effects: DMatrix::zeros(SAMPLES, 0),
    };
    (
        (0..channels).map(view).collect(),
        Joint::new(vec![columns; channels], &[]),
    )
}

fn noise(seed: u64) -> Vec<DVector<f64>> {
    noise_of(CHANNELS, seed)
}

fn noise_of(channels: usize, seed: u64) -> Vec<DVector<f64>> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut channel = || DVector::from_fn(SAMPLES, |_, _| StandardNormal.sample(&mut random));
    (0..channels).map(|_| channel()).collect()
}

fn judged(change: impl Fn(usize, &mut DVector<f64>)) -> Leftover {
    let (views, joint) = scene();
    let mut residuals = noise(7);
    residuals
        .iter_mut()
        .enumerate()
        .for_each(|(channel, residual)| change(channel, residual));
    judge(&views, &joint, &joint.fit(&residuals), &[], None)
}

/// The channel that stands out most.
fn first_channel(left: &Leftover) -> Option<usize> {
    left.aspects.iter().find_map(|aspect| match aspect.channels[..] {
        [channel] => Some(channel),
        _ => None,
    })
}

#[test]
fn noise_alone_is_enough() {
    let left = judged(|_, _| {});
    assert!(left.p > 0.05, "{left:?}");
    assert!(left.unknown(0.05) < 0.06);
}

#[test]
fn a_slow_wave_in_one_channel_is_found_there() {
    let left = judged(|channel, residual| {
        if channel == 1 {
            residual
                .iter_mut()
                .enumerate()
                .for_each(|(row, value)| *value += 0.7 * (row as f64 * 0.05).sin());
        }
    });
    assert!(left.p < 0.01, "{left:?}");
    assert_eq!(first_channel(&left), Some(1));
    assert!(left.unknown(0.05) > 0.9);
}

#[test]
fn what_hides_in_the_calibration_is_found_by_its_size() {
    let left = judged(|channel, residual| {
        if channel == 2 {
            residual.add_scalar_mut(5.0 * 8.0);
        }
    });
    assert!(left.p < 0.01, "{left:?}");
    assert!(left.aspects[0].what.contains("calibration"), "{:?}", left.aspects);
}

#[test]
fn what_an_effect_on_the_scatter_explains_no_longer_counts() {
    let louder = |residuals: &mut [DVector<f64>]| residuals[0] *= 2.0;
    let (views, joint) = scene();
    let mut residuals = noise(7);
    louder(&mut residuals);
    let fitted = joint.fit(&residuals);
    assert!(judge(&views, &joint, &fitted, &[], None).p < 0.01);
    let explained = judge(
        &views,
        &joint,
        &fitted,
        &[],
        Some(Disturb {
            channels: &[0],
            of: &|residuals, _| louder(residuals),
        }),
    );
    assert!(explained.p > 0.05, "{explained:?}");
}

#[test]
fn a_channel_that_scatters_as_explained_is_looked_at_for_everything_else() {
    let louder = |residuals: &mut [DVector<f64>]| residuals[0] *= 2.0;
    let (views, joint) = scene();
    let mut residuals = noise(7);
    louder(&mut residuals);
    (residuals[0].iter_mut().enumerate()).for_each(|(row, value)| *value += (row as f64 * 0.05).sin());
    let left = judge(
        &views,
        &joint,
        &joint.fit(&residuals),
        &[],
        Some(Disturb {
            channels: &[0],
            of: &|residuals, _| louder(residuals),
        }),
    );
    assert!(left.p < 0.01, "{left:?}");
    assert_eq!(first_channel(&left), Some(0));
}

#[test]
fn noise_that_comes_and_goes_is_told_from_louder_noise() {
    let scaled = |factor: fn(usize) -> f64| {
        judged(|_, residual| {
            residual
                .iter_mut()
                .enumerate()
                .for_each(|(row, value)| *value *= factor(row));
        })
    };
    let names = |left: &Leftover| -> Vec<String> { left.aspects.iter().map(|aspect| aspect.what.clone()).collect() };
    let comes = |left: &Leftover| names(left).iter().any(|what| what.contains("comes and goes"));
    // The same energy, in one seventh of the time or always.
    let bursts = scaled(|row| if row / 20 % 7 == 3 { 2.5 } else { 1.0 });
    assert!(comes(&bursts), "{:?}", names(&bursts));
    let louder = scaled(|_| 1.32);
    assert!(louder.p < 0.01 && !comes(&louder), "{:?}", names(&louder));
}

#[test]
fn what_is_small_in_each_of_many_channels_shows_in_all_together() {
    let left = judged(|_, residual| {
        residual
            .iter_mut()
            .enumerate()
            .for_each(|(row, value)| *value += 0.22 * (row as f64 * 0.05).sin());
    });
    let size = |what: &str| {
        let own = left.aspects.iter().find(|aspect| aspect.what.starts_with(what));
        own.map_or(0.0, |aspect| aspect.size)
    };
    let each = (0..CHANNELS).map(|channel| size(&format!("g{channel}: a shape in time")));
    let together = size("gyros together: a shape in time");
    assert!(
        together > 3.0 && each.fold(0.0, f64::max) < together,
        "{:?}",
        left.aspects
    );
}

/// What a law `|rate|` leaves of another one, its root, and what it leaves of itself.
#[test]
fn another_law_than_the_named_one_shows_in_how_its_strength_changes() {
    let (views, joint) = scene();
    let rate = |row: usize| (row as f64 * 0.03).sin().abs();
    let suspect = Suspect {
        name: "current-field".into(),
        entries: (0..CHANNELS)
            .map(|channel| (channel, DVector::from_fn(SAMPLES, |row, _| rate(row) - 0.637)))
            .collect(),
    };
    let of = |law: &dyn Fn(usize) -> f64| {
        let mut residuals = noise(7);
        for residual in &mut residuals {
            (residual.iter_mut().enumerate()).for_each(|(row, value)| *value += 3.0 * law(row));
        }
        let fitted = joint.fit(&residuals);
        judge(&views, &joint, &fitted, std::slice::from_ref(&suspect), None)
    };
    // The best fit of the named law to its own root, taken off.
    let other = of(&|row| rate(row).sqrt() - 0.763 - 0.9 * (rate(row) - 0.637));
    let strength = other.aspects.iter().find(|aspect| aspect.what.contains("strength"));
    assert!(
        strength.is_some_and(|strength| strength.size > 4.0),
        "{:?}",
        other.aspects
    );
    let own = of(&|_| 0.0);
    assert!(own.p > 0.05, "{own:?}");
}

#[test]
fn a_strength_that_is_fitted_in_each_channel_is_no_leftover() {
    let (views, _) = scene();
    // How much each channel knows of its own strength is another.
    let law = |channel: usize, row: usize| (channel + 1) as f64 * (row as f64 * 0.03).sin();
    let columns = |channel: usize| Columns {
        nuisance: DMatrix::from_element(SAMPLES, 1, 5.0).into(),
        effects: DMatrix::from_fn(
            SAMPLES,
            CHANNELS,
            |row, own| if own == channel { law(channel, row) } else { 0.0 },
        ),
    };
    let joint = Joint::new((0..CHANNELS).map(columns).collect(), &[100.0; CHANNELS]);
    let strengths = [200.0, -150.0, 30.0];
    let mut residuals = noise(7);
    for (channel, (residual, strength)) in residuals.iter_mut().zip(strengths).enumerate() {
        (residual.iter_mut().enumerate()).for_each(|(row, value)| *value += strength * law(channel, row));
    }
    let entry = |(channel, strength): (usize, f64)| {
        (
            channel,
            DVector::from_fn(SAMPLES, |row, _| strength * law(channel, row)),
        )
    };
    let suspect = Suspect {
        name: "gyro-scale".into(),
        entries: strengths.into_iter().enumerate().map(entry).collect(),
    };
    let mut fitted = joint.fit(&residuals);
    // What rounding leaves of numbers that large, and simulated logs have otherwise.
    (fitted.rest[0].iter_mut().enumerate()).for_each(|(row, value)| *value += 1e-6 * law(0, row));
    let left = judge(&views, &joint, &fitted, &[suspect], None);
    assert!(left.p > 0.05, "{left:?}");
}

/// Three laws, each in a third of the log, large beside their priors: what these take off is no other law's.
#[test]
fn what_a_prior_takes_off_a_large_effect_is_no_leftover() {
    const PRIOR: f64 = 0.5;
    const STRENGTH: f64 = 12.0;
    let (views, _) = scene();
    let law = |channel: usize, row: usize| match row * CHANNELS / SAMPLES == channel {
        true => (channel + 1) as f64 * (row as f64 * 0.2).sin(),
        false => 0.0,
    };
    let columns = |channel: usize| Columns {
        nuisance: DMatrix::from_element(SAMPLES, 1, 5.0).into(),
        effects: DMatrix::from_fn(
            SAMPLES,
            CHANNELS,
            |row, own| if own == channel { law(channel, row) } else { 0.0 },
        ),
    };
    let joint = Joint::new((0..CHANNELS).map(columns).collect(), &[PRIOR; CHANNELS]);
    let mut residuals = noise(7);
    for (channel, residual) in residuals.iter_mut().enumerate() {
        (residual.iter_mut().enumerate()).for_each(|(row, value)| *value += STRENGTH * law(channel, row));
    }
    let entry = |channel: usize| {
        (
            channel,
            DVector::from_fn(SAMPLES, |row, _| STRENGTH * law(channel, row)),
        )
    };
    let suspect = Suspect {
        name: "gyro-scale".into(),
        entries: (0..CHANNELS).map(entry).collect(),
    };
    let left = judge(&views, &joint, &joint.fit(&residuals), &[suspect], None);
    assert!(left.p > 0.05, "{left:?}");
}

#[test]
fn a_wrong_law_is_found_by_the_steps_between_levels() {
    let left = judged(|channel, residual| {
        if channel == 0 {
            let levels = scene().0[0].levels[0].clone();
            let of_level = |row: usize| 0.3 * (f64::from(levels[row]) - 3.5) / 2.3;
            residual
                .iter_mut()
                .enumerate()
                .for_each(|(row, value)| *value += of_level(row));
        }
    });
    assert!(left.p < 0.01, "{left:?}");
    assert!(left.aspects[0].what.contains("steps with"), "{:?}", left.aspects);
}
