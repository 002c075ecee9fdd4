//! Iron as least squares over the samples has it, in f64.

extern crate std;

use nalgebra::{SMatrix, SVector};
use std::vec::Vec;

use super::*;
use crate::draws::{Draws, near};

type Sample = (Vector3<f32>, Matrix3<f32>);

/// A window of a unit that turns by up to `apart` \[rad\] in a field of its own, with `iron_b`, and with `moving` \[uT\] of a field
/// that does not stand still.
fn window(draws: &mut Draws, apart: f32, iron_b: &Vector3<f32>, moving: f32) -> Vec<Sample> {
    let field_n = Vector3::new(20.0, 0.0, 35.0) + draws.vector(1.0);
    let start = draws.attitude();
    let sample = |draws: &mut Draws| {
        let turned = start * crate::attitude::from_rotation_vector(draws.vector(apart));
        let dcm = turned.to_rotation_matrix().into_inner();
        (dcm.transpose() * (field_n + draws.vector(moving)) + iron_b, dcm)
    };
    (0..10).map(|_| sample(draws)).collect()
}

fn sums(window: &[Sample]) -> FieldSums {
    let mut sums = FieldSums::NONE;
    window.iter().for_each(|(mag_b, dcm)| sums.take(mag_b, dcm, 0.0));
    sums
}

/// Information about the iron and its weighted estimate by these windows, each with its own field: the field is eliminated by least
/// squares over field and iron together.
fn eliminated(windows: &[Vec<Sample>], weight: f64) -> (nalgebra::Matrix3<f64>, nalgebra::Vector3<f64>) {
    let (mut information, mut weighted) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
    for window in windows {
        // m_n = F + R iron, so R m_b = F + R iron.
        let (mut normal, mut right) = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
        for (mag_b, dcm) in window {
            let dcm = dcm.cast::<f64>();
            let design = SMatrix::<f64, 3, 6>::from_fn(|row, column| match column.checked_sub(3) {
                None => f64::from(u8::from(column == row)),
                Some(column) => dcm[(row, column)],
            });
            normal += design.transpose() * design;
            right += design.transpose() * (dcm * mag_b.cast::<f64>());
        }
        let block = |row: usize, column: usize| normal.fixed_view::<3, 3>(row, column).into_owned();
        let field = block(0, 0).try_inverse().expect("samples");
        let across = block(3, 0);
        let left = block(3, 3) - across * field * across.transpose();
        let right = right.fixed_rows::<3>(3) - across * field * right.fixed_rows::<3>(0);
        // A window is one measurement, however many samples it has.
        let per = weight / window.len() as f64;
        information += left * per;
        weighted += right * per;
    }
    (information, weighted)
}

/// Of a field that stands still: each window counts by the noise alone.
#[test]
fn iron_is_that_of_least_squares() {
    let params = Params::ROOM;
    for seed in 0..30 {
        let mut draws = Draws::of(seed);
        let iron_b = draws.vector(1.0);
        let mut found = HardIron::none(&params);
        let windows: Vec<_> = (0..6).map(|_| window(&mut draws, 0.5, &iron_b, 0.0)).collect();
        for window in &windows {
            assert!(!found.learn(&params, 1.0, &sums(window)), "{seed}");
        }
        let (mut information, weighted) = eliminated(&windows, 1.0 / f64::from(params.iron_noise_ut).powi(2));
        information += nalgebra::Matrix3::identity() / f64::from(params.iron_sd_ut).powi(2);
        let covariance = information.try_inverse().expect("definite");
        assert!(
            (found.covariance.cast::<f64>() - covariance).norm() < 0.02 * covariance.norm(),
            "{seed}"
        );
        assert!(
            (found.iron_b.cast::<f64>() - covariance * weighted).norm() < 0.05,
            "{seed}"
        );
        // What is not known of it moves the mean field of a window by T P T'.
        let sums = sums(&windows[0]);
        let turned = windows[0]
            .iter()
            .fold(nalgebra::Matrix3::zeros(), |sum, (_, dcm)| sum + dcm.cast::<f64>());
        let turned = turned / windows[0].len() as f64;
        let variance = (turned * found.covariance.cast::<f64>() * turned.transpose()).trace() / 3.0;
        assert!(near(found.variance(&sums), variance, 1e-4, 0.0), "{seed}");
        // A unit without iron to be learnt learns none; nor does one sample tell any.
        let none = Params {
            iron_sd_ut: 0.0,
            ..params
        };
        let mut other = HardIron::none(&none);
        assert!(!other.learn(&none, 1.0, &sums) && other == HardIron::none(&none));
        let one = self::sums(&windows[0][..1]);
        let before = found;
        assert!(!found.learn(&params, 1.0, &one) && found == before);
        let two = self::sums(&windows[0][..2]);
        assert!(!found.learn(&params, 1.0, &two) && found != before);
    }
}

/// Numbers that were kept make the same iron.
#[test]
fn what_is_kept_of_it_makes_it_again() {
    let mut draws = Draws::of(1);
    let mut found = HardIron::none(&Params::ROOM);
    found.learn(
        &Params::ROOM,
        1.0,
        &sums(&window(&mut draws, 0.5, &Vector3::new(1.0, 2.0, -1.0), 0.0)),
    );
    let mut numbers = Vec::new();
    found.each(&mut |number| numbers.push(*number));
    assert_eq!(numbers.len(), 12);
    let mut again = HardIron::none(&Params::ROOM);
    let mut next = numbers.into_iter();
    again.each(&mut |number| *number = next.next().expect("as many"));
    again.go_on();
    assert_eq!((again.iron_b, again.covariance), (found.iron_b, found.covariance));
}

/// A magnet that is stuck to the unit is another iron, found from the windows since, however well the one before is known.
#[test]
fn another_iron_takes_the_place_of_one_that_no_longer_explains_the_field() {
    let params = Params::ROOM;
    for seed in 0..20 {
        let mut draws = Draws::of(seed);
        let mut found = HardIron::none(&params);
        let before_b = draws.vector(1.0);
        for _ in 0..10 {
            let window = window(&mut draws, 0.6, &before_b, 0.1);
            assert!(!found.learn(&params, 1.0, &sums(&window)), "{seed}");
        }
        let magnet_b = before_b + draws.vector(5.0) + Vector3::new(0.0, 30.0, 0.0);
        let mut since = Vec::new();
        let changed = (0..12).find(|_| {
            let window = window(&mut draws, 0.6, &magnet_b, 0.1);
            since.push(window.clone());
            found.learn(&params, 1.0, &sums(&window))
        });
        assert!(changed.is_some_and(|after| after < 8), "{seed}: {changed:?}");
        assert!(
            (found.iron_b - magnet_b).norm() < 5.0,
            "{seed}: {} {magnet_b}",
            found.iron_b
        );
    }
}

/// The latest windows stand together as long as one iron explains them; another one takes the place of the present one if it leaves
/// the field much quieter. With the least squares over both windows in f64.
#[test]
fn the_latest_windows_are_those_that_one_iron_explains() {
    let params = Params::ROOM;
    let of = |x: f32| f64::from(x);
    let noise = of(params.iron_noise_ut).powi(2);
    let (mut afresh, mut changed, mut went_on) = (0, 0, 0);
    for seed in 0..300 {
        let mut draws = Draws::of(seed);
        let mut found = HardIron::none(&params);
        let (first_b, moved) = (draws.vector(1.0), draws.one_of([1.0, 4.0, 7.0, 30.0]));
        let second_b = first_b + draws.vector(moved);
        // Turned about one axis only in half of the runs: then what is not known of the iron matters.
        let apart = draws.one_of([0.1, 0.6]);
        let moving = draws.one_of([0.0, 3.0, 5.0]);
        // And a first window that says little of any iron.
        let first_apart = draws.one_of([0.02, apart]);
        let windows = [
            window(&mut draws, first_apart, &first_b, 0.0),
            window(&mut draws, apart, &second_b, moving),
        ];
        found.learn(&params, 1.0, &sums(&windows[0]));
        let before = found;
        let is_other = found.learn(&params, 1.0, &sums(&windows[1]));
        // Four seconds are looked at: of the window before three quarters count.
        let kept = 1.0 - 1.0 / of(params.iron_change_s);
        let weights = [kept, 1.0];
        let each: Vec<_> = windows
            .iter()
            .map(|window| eliminated(core::slice::from_ref(window), 1.0))
            .collect();
        let parted = each[0].0 * weights[0] + each[1].0;
        let seen = each[0].1 * weights[0] + each[1].1;
        let information = parted / noise + nalgebra::Matrix3::identity() / of(params.iron_change_sd_ut).powi(2);
        let covariance = information.try_inverse().expect("definite");
        let latest_b = covariance * (seen / noise);
        let left = |iron_b: &nalgebra::Vector3<f64>| {
            let of_window = |window: &Vec<Sample>| {
                let in_n = |(mag_b, dcm): &Sample| dcm.cast::<f64>() * (mag_b.cast::<f64>() - iron_b);
                let count = window.len() as f64;
                let mean = window
                    .iter()
                    .map(in_n)
                    .fold(nalgebra::Vector3::zeros(), |sum, m| sum + m)
                    / count;
                window
                    .iter()
                    .map(|sample| (in_n(sample) - mean).norm_squared())
                    .sum::<f64>()
                    / count
            };
            (of_window(&windows[0]) * weights[0] + of_window(&windows[1])) / (weights[0] + weights[1])
        };
        let (best, present) = (left(&latest_b), left(&before.iron_b.cast()));
        if (best / (4.0 * noise) - 1.0).abs() < 0.02 || (present / (noise + 2.0 * best) - 1.0).abs() < 0.02 {
            continue;
        }
        let explained = best <= 4.0 * noise;
        let expected = explained && present > noise + 2.0 * best;
        assert_eq!(is_other, expected, "{seed}: {best} {present}");
        let windows = if explained { 1.0 + kept } else { 1.0 };
        assert!((of(found.recent.windows) - windows).abs() < 1e-6, "{seed}: {best}");
        if is_other {
            changed += 1;
            let off = (found.covariance.cast::<f64>() - covariance).norm() / covariance.norm();
            assert!(off < 0.02, "{seed}: {off}");
        } else if explained {
            went_on += 1;
        } else {
            afresh += 1;
        }
    }
    assert!(
        changed > 20 && went_on > 20 && afresh > 10,
        "{changed} {went_on} {afresh}"
    );
}

/// What goes on moving is the world's and tells little: by how much the windows weigh.
#[test]
fn a_field_that_moves_tells_less() {
    let params = Params::ROOM;
    let mut draws = Draws::of(3);
    for moving in [0.0, 1.0, 2.0] {
        let mut found = HardIron::none(&params);
        let window = window(&mut draws, 0.4, &Vector3::zeros(), moving);
        let sums = sums(&window);
        found.learn(&params, 1.0, &sums);
        let (parted, seen) = eliminated(core::slice::from_ref(&window), 1.0);
        // Moved by what no iron explains: the smaller of what none and the best one leave.
        let noise = f64::from(params.iron_noise_ut).powi(2);
        let unknown = nalgebra::Matrix3::identity() / f64::from(params.iron_change_sd_ut).powi(2);
        let best = (parted / noise + unknown).try_inverse().expect("definite") * (seen / noise);
        let left = |iron_b: &nalgebra::Vector3<f64>| {
            let in_n = |(mag_b, dcm): &Sample| dcm.cast::<f64>() * (mag_b.cast::<f64>() - iron_b);
            let mean = window
                .iter()
                .map(in_n)
                .fold(nalgebra::Vector3::zeros(), |sum, m| sum + m)
                / window.len() as f64;
            window
                .iter()
                .map(|sample| (in_n(sample) - mean).norm_squared())
                .sum::<f64>()
                / window.len() as f64
        };
        let unrest = left(&best).min(left(&nalgebra::Vector3::zeros()));
        let weight = 1.0 / (noise + f64::from(params.iron_per_spread) * unrest);
        let information = parted * weight + nalgebra::Matrix3::identity() / f64::from(params.iron_sd_ut).powi(2);
        let covariance = information.try_inverse().expect("definite");
        let off = (found.covariance.cast::<f64>() - covariance).norm() / covariance.norm();
        assert!(off < 2e-3, "{moving}: {off}");
    }
}

#[test]
fn a_number_that_is_none_is_seen_in_each_part() {
    let fresh = HardIron::none(&Params::ROOM);
    assert!(fresh.is_finite());
    let spoil: [fn(&mut HardIron); 7] = [
        |iron| iron.covariance.m12 = f32::NAN,
        |iron| iron.information.m33 = f32::INFINITY,
        |iron| iron.recent.parted.m21 = f32::NAN,
        |iron| iron.iron_b.y = f32::NAN,
        |iron| iron.weighted.z = f32::NAN,
        |iron| iron.recent.seen.x = f32::NAN,
        |iron| iron.recent.squares = f32::NAN,
    ];
    for (k, spoil) in spoil.iter().enumerate() {
        let mut other = fresh;
        spoil(&mut other);
        assert!(!other.is_finite(), "{k}");
    }
}
