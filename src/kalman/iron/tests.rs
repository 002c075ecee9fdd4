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
        let (parted, _) = eliminated(&[window.clone()], 1.0);
        // Moved by what no iron explains: the smaller of what none and the best one leave.
        let noise = f64::from(params.iron_noise_ut).powi(2);
        let unknown = nalgebra::Matrix3::identity() / f64::from(params.iron_change_sd_ut).powi(2);
        let (_, seen) = eliminated(&[window.clone()], 1.0);
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
