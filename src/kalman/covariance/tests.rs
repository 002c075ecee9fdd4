//! What is done to the covariance outside a window, block by block against the whole matrix.

use super::*;
use crate::draws::{Draws, near};

type Matrix = SMatrix<f64, STATES, STATES>;

/// Symmetric, every element another.
fn drawn(seed: u64) -> Covariance {
    let mut draws = Draws::of(seed);
    let mut p = Covariance::new(&Params::ROOM);
    for row in 0..DRIVEN {
        p.across[row] = core::array::from_fn(|_| draws.within(-1.0, 1.0));
        p.driven[row] = core::array::from_fn(|_| draws.within(-1.0, 1.0));
        p.driven[row][row] = draws.within(2.0, 3.0);
    }
    for row in 0..DRIVERS {
        p.drivers[row] = core::array::from_fn(|_| draws.within(-1.0, 1.0));
        p.drivers[row][row] = draws.within(2.0, 3.0);
    }
    mirror(&mut p.driven);
    mirror(&mut p.drivers);
    p
}

fn whole(p: &Covariance) -> Matrix {
    p.matrix().cast()
}

/// A state known with this variance and independent of the rest.
fn forget(p: &mut Matrix, state: usize, variance: f64) {
    p.row_mut(state).fill(0.0);
    p.column_mut(state).fill(0.0);
    p[(state, state)] = variance;
}

fn is(found: &Covariance, expected: &Matrix, what: &str) {
    for (found, expected) in found.matrix().iter().zip(expected.iter()) {
        assert!(near(*found, *expected, 1e-5, 1e-6), "{what}: {found} {expected}");
    }
}

#[test]
fn it_begins_with_what_the_parameters_say() {
    let params = Params::ROOM;
    let sds = |k: usize| match k {
        0..3 => core::f32::consts::PI,
        3..5 => params.velocity_sd,
        5..8 => params.bias_sd,
        _ => params.gyro_matrix_sd,
    };
    let p = whole(&Covariance::new(&params));
    for (k, variance) in p.diagonal().iter().enumerate() {
        let sd = f64::from(sds(k));
        assert!((variance / (sd * sd) - 1.0).abs() < 1e-6, "{k}");
    }
    assert_eq!(p, Matrix::from_diagonal(&p.diagonal()));
}

#[test]
fn what_is_known_afresh_is_independent_of_the_rest() {
    let mut draws = Draws::of(1);
    for seed in 0..20 {
        let before = drawn(seed);
        let sd = draws.within(0.5, 3.0);
        let variance = f64::from(sd * sd);
        let forgotten = |states: core::ops::Range<usize>| {
            let mut expected = whole(&before);
            states.for_each(|state| forget(&mut expected, state, variance));
            expected
        };
        let mut p = before.clone();
        p.forget_velocity(sd);
        is(&p, &forgotten(3..5), "velocity");
        let mut p = before.clone();
        p.forget_bias(sd);
        is(&p, &forgotten(5..8), "bias");
        let mut p = before.clone();
        p.forget_attitude();
        let mut expected = whole(&before);
        (0..3).for_each(|state| forget(&mut expected, state, core::f64::consts::PI.powi(2)));
        is(&p, &expected, "attitude");
        let sds: [f32; 3] = core::array::from_fn(|_| draws.within(0.5, 3.0));
        let mut p = before.clone();
        p.know_bias(&sds);
        let mut expected = whole(&before);
        (0..3).for_each(|k| forget(&mut expected, 5 + k, f64::from(sds[k]).powi(2)));
        is(&p, &expected, "each bias");
        // Attitude and bias together.
        let both = SMatrix::<f32, 6, 6>::from_fn(|row, column| (row * 6 + column) as f32 + (column * 6 + row) as f32);
        let mut p = before.clone();
        p.set_bias(&both);
        let mut expected = whole(&before);
        (5..8).for_each(|state| forget(&mut expected, state, 0.0));
        for row in 0..3 {
            for column in 0..3 {
                expected[(row, 5 + column)] = both[(row, 3 + column)].into();
                expected[(5 + column, row)] = both[(row, 3 + column)].into();
                expected[(5 + row, 5 + column)] = both[(3 + row, 3 + column)].into();
            }
        }
        is(&p, &expected, "bias with attitude");
    }
}

/// Bias and gyro matrix walk, each its own way, and nothing else.
#[test]
fn walks_are_added_to_their_own_variances() {
    let before = drawn(1);
    let mut p = before.clone();
    p.drift(&[0.25, 0.5]);
    let mut expected = whole(&before);
    for k in 0..DRIVERS {
        expected[(DRIVEN + k, DRIVEN + k)] += if k < 3 { 0.25 } else { 0.5 };
    }
    is(&p, &expected, "walks");
}

/// After silence no state is known worse than at the start, and one that would be is independent of the rest.
#[test]
fn age_ends_where_it_began() {
    let params = Params {
        bias_sd: 1.6,
        gyro_matrix_sd: 1.6,
        velocity_sd: 1.6,
        ..Params::ROOM
    };
    let start = whole(&Covariance::new(&params));
    let mut capped = 0;
    for seed in 0..50 {
        let before = drawn(seed);
        let walks = [0.05, 0.1];
        let mut p = before.clone();
        p.age(&params, &walks);
        let mut expected = whole(&before);
        for k in 0..DRIVERS {
            expected[(DRIVEN + k, DRIVEN + k)] += f64::from(walks[usize::from(k >= 3)]);
        }
        for state in 0..STATES {
            if expected[(state, state)] >= start[(state, state)] {
                capped += 1;
                forget(&mut expected, state, start[(state, state)]);
            }
        }
        is(&p, &expected, "aged");
    }
    assert!(capped > 100 && capped < 800, "{capped}");
}

/// What a reset keeps: the velocity is not known, the attitude is known worse, and the rest stands.
#[test]
fn after_a_reset_the_velocity_is_forgotten_and_the_attitude_grows() {
    let before = drawn(3);
    let mut p = before.clone();
    // Only what is right of the diagonals was kept.
    for row in 0..DRIVEN {
        p.driven[row][..row].fill(9.0);
    }
    for row in 0..DRIVERS {
        p.drivers[row][..row].fill(9.0);
    }
    p.go_on(0.5, 0.125);
    let mut expected = whole(&before);
    for state in 0..3 {
        expected[(state, state)] += 0.125;
    }
    (3..5).for_each(|state| forget(&mut expected, state, 0.25));
    is(&p, &expected, "gone on");
}

#[test]
fn the_worst_is_the_largest_of_three() {
    let mut p = drawn(1);
    for variances in [
        [1.0, 2.0, 3.0],
        [3.0, 1.0, 2.0],
        [2.0, 3.0, 1.0],
        [3.0, 2.0, 1.0],
        [1.0, 3.0, 2.0],
        [2.0, 1.0, 3.0],
    ] {
        (0..3).for_each(|k| p.driven[k][k] = variances[k]);
        assert_eq!(p.worst(), 3.0, "{variances:?}");
    }
}

/// Each variance by itself: below its floor it is raised, above and at zero it stays, below zero it is said to be unsound.
#[test]
fn floors_hold_for_each_state() {
    for state in 0..STATES {
        let floor = FLOORS[match state {
            0..3 => 0,
            3..5 => 1,
            5..8 => 2,
            _ => 3,
        }];
        let kept = |variance: f32| {
            let mut p = drawn(1);
            match state.checked_sub(DRIVEN) {
                None => p.driven[state][state] = variance,
                Some(k) => p.drivers[k][k] = variance,
            }
            let sound = p.keep_bounds();
            (p.matrix()[(state, state)], sound)
        };
        assert_eq!(kept(0.5 * floor), (floor, true), "{state}");
        assert_eq!(kept(1.5 * floor), (1.5 * floor, true), "{state}");
        assert_eq!(kept(0.0), (0.0, true), "{state}");
        assert_eq!(kept(-1e-3), (floor, false), "{state}");
    }
    assert!(drawn(1).keep_bounds());
}

#[test]
fn a_number_that_is_none_is_seen_in_each_block() {
    assert!(drawn(1).is_finite());
    for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for block in 0..3 {
            let mut p = drawn(1);
            match block {
                0 => p.driven[1][2] = wrong,
                1 => p.across[4][7] = wrong,
                _ => p.drivers[11][3] = wrong,
            }
            assert!(!p.is_finite(), "{block} {wrong}");
        }
    }
}
