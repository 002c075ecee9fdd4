//! The passage against `F P F' + Q` with dense matrices in f64.

use nalgebra::{SMatrix, SVector};

use super::{super::state::STATES, *};
use crate::{
    draws::{Draws, near},
    kalman::{Covariance, Sampled},
};

type Matrix = SMatrix<f64, STATES, STATES>;
type Column = SVector<f64, STATES>;

struct Drawn {
    params: Params,
    window: Window,
    means: Means,
    passage: Passage,
    covariance: Covariance,
}

/// A window of turns and forces, and a covariance with correlations of all states.
fn drawn(seed: u64) -> Drawn {
    let mut draws = Draws::of(seed);
    let params = Params {
        bias_walk: 0.3,
        gyro_matrix_walk: 0.2,
        ..Params::ROOM
    };
    let mut window = Window::EMPTY;
    for _ in 0..10 {
        let covered_s = draws.within(0.05, 0.15);
        let gyro_b = draws.vector(0.3);
        window.turn(
            &draws.dcm(),
            &gyro_b,
            covered_s,
            draws.within(0.0, 0.02),
            draws.within(0.0, 0.01),
        );
        let acc_n = Vector3::new(0.0, 0.0, -params.gravity) + draws.vector(0.5);
        let sampled = Sampled {
            value_b: acc_n,
            variance: 0.01,
            scatter: 0.0,
            at_us: 0,
        };
        window.take_acc(&acc_n, &sampled, params.gravity);
    }
    let mut means = window.means(&params, false);
    assert!(means.vertical);
    if seed.is_multiple_of(3) {
        (means.vertical, means.vertical_s) = (false, 0.0);
    }
    let mut passage = Passage::default();
    passage.become_of(&params, &window, &means);
    let mut covariance = Covariance::new(&params);
    // Two random scalars correlate everything.
    for _ in 0..6 {
        let column = State {
            driven: core::array::from_fn(|_| draws.within(-0.3, 0.3)),
            drivers: core::array::from_fn(|_| draws.within(-0.02, 0.02)),
        };
        let seen = super::super::joseph::Seen { column, variance: 2.0 };
        covariance.update(&seen, &super::super::joseph::Seen::NOTHING);
    }
    Drawn {
        params,
        window,
        means,
        passage,
        covariance,
    }
}

fn f_and_q(drawn: &Drawn) -> (Matrix, Matrix) {
    let Drawn {
        params, window, means, ..
    } = drawn;
    let of = |x: f32| f64::from(x);
    let tilt = of(params.gravity) * of(means.vertical_s);
    let (mut f, mut q) = (Matrix::identity(), Matrix::zeros());
    for k in 0..DRIVERS {
        let mean = |axis: usize| of(window.drive_integral[axis][k]) / of(window.duration_s);
        for axis in 0..3 {
            f[(axis, DRIVEN + k)] = of(window.drive[axis][k]);
        }
        // (a + B d) x (0, 0, -1), north and east.
        f[(3, DRIVEN + k)] = -tilt * mean(1);
        f[(4, DRIVEN + k)] = tilt * mean(0);
        let walk = if k < 3 {
            params.bias_walk
        } else {
            params.gyro_matrix_walk
        };
        q[(DRIVEN + k, DRIVEN + k)] = of(walk) * of(walk) * of(means.duration_s);
    }
    (f[(3, 1)], f[(4, 0)]) = (-tilt, tilt);
    let white = of(window.angle_variance);
    (0..3).for_each(|axis| q[(axis, axis)] = white);
    // A walk of this variance at its end, seen by its mean.
    for (velocity, axis, sign) in [(3, 1, -1.0), (4, 0, 1.0)] {
        q[(velocity, velocity)] = tilt * tilt * white / 3.0 + of(means.velocity_change_variance);
        q[(velocity, axis)] = sign * tilt * white / 2.0;
        q[(axis, velocity)] = q[(velocity, axis)];
    }
    (f, q)
}

fn state(column: &Column) -> State {
    State {
        driven: core::array::from_fn(|k| column[k] as f32),
        drivers: core::array::from_fn(|k| column[DRIVEN + k] as f32),
    }
}

fn is(found: &State, expected: &Column, what: &str) {
    let numbers = found.driven.iter().chain(&found.drivers);
    let scale = expected.amax();
    for (k, (found, expected)) in numbers.zip(expected.iter()).enumerate() {
        assert!(
            near(*found, *expected, 1e-4, 1e-5 * scale),
            "{what} {k}: {found} {expected}"
        );
    }
}

#[test]
fn what_a_scalar_sees_is_the_column_of_the_predicted_covariance() {
    for seed in 0..60 {
        let drawn = drawn(seed);
        let lost = !drawn.means.vertical;
        let (f, q) = f_and_q(&drawn);
        let p: Matrix = drawn.covariance.matrix().cast();
        let predicted = f * p * f.transpose() + q;
        let mut draws = Draws::of(seed);
        let mut rows = [Column::zeros(); DRIVERS + 3];
        for k in 0..DRIVERS {
            rows[k][DRIVEN + k] = 1.0;
        }
        (rows[DRIVERS][3], rows[DRIVERS + 1][4]) = (1.0, 1.0);
        for k in (0..3).chain(DRIVEN..STATES) {
            rows[DRIVERS + 2][k] = draws.within(-1.0, 1.0).into();
        }
        let of = state(&rows[DRIVERS + 2]);
        for (k, h) in rows.iter().enumerate() {
            let row = match k {
                DRIVERS => Row::Velocity(0),
                k if k == DRIVERS + 1 => Row::Velocity(1),
                k if k == DRIVERS + 2 => Row::Of(&of),
                k => Row::Driver(k),
            };
            let mut column = State::ZERO;
            drawn.passage.carry(&state(&(p * f.transpose() * h)), &row, &mut column);
            let mut expected = predicted * h;
            if lost {
                (expected[3], expected[4]) = (0.0, 0.0);
                if let Row::Velocity(_) = row {
                    continue;
                }
            }
            is(&column, &expected, "column");
        }
        let velocity = [3, 4].map(|k| state(&predicted.column(k).into()));
        let mut found = drawn.covariance.clone();
        found.predict(&drawn.passage, (!lost).then_some(&velocity));
        let mut expected = predicted;
        if lost {
            for k in 3..5 {
                expected.row_mut(k).fill(0.0);
                expected.column_mut(k).fill(0.0);
                expected[(k, k)] = f64::from(drawn.params.velocity_sd).powi(2);
            }
        }
        for (found, expected) in found.matrix().iter().zip(expected.iter()) {
            assert!(near(*found, *expected, 2e-4, 1e-5), "{seed}: {found} {expected}");
        }
    }
}

/// A mean over the window sees the attitude error at its start and the mean drive: at the end, what there is less what came later.
#[test]
fn a_mean_sees_the_attitude_in_the_middle() {
    for seed in 0..20 {
        let drawn = drawn(seed);
        let p: Matrix = drawn.covariance.matrix().cast();
        let Window {
            drive,
            drive_integral,
            duration_s,
            ..
        } = &drawn.window;
        let mean = |axis: usize, k: usize| f64::from(drive_integral[axis][k]) / f64::from(*duration_s);
        let mut seen = [State::ZERO; 3];
        drawn.covariance.means_seen(&drawn.passage, &mut seen);
        for (axis, seen) in seen.iter().enumerate() {
            let mut h = Column::zeros();
            h[axis] = 1.0;
            (0..DRIVERS).for_each(|k| h[DRIVEN + k] = mean(axis, k));
            is(seen, &(p * h), "mean");
        }
        let row_n = Draws::of(seed).vector(1.0);
        let mut expected = Column::zeros();
        for axis in 0..3 {
            expected[axis] = row_n[axis].into();
            for k in 0..DRIVERS {
                expected[DRIVEN + k] += f64::from(row_n[axis]) * (mean(axis, k) - f64::from(drive[axis][k]));
            }
        }
        is(&drawn.passage.mean_row(&row_n), &expected, "row");
    }
}
