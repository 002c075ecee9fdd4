//! What another filter hands over is taken, and what it does not know stays.

use nalgebra::SMatrix;

use super::*;
use crate::{
    draws::Draws,
    kalman::state::{DRIVEN, STATES},
};

/// A filter in flight, in the middle of a window, with a correction pending and everything else in motion.
fn flying(draws: &mut Draws) -> Filter {
    let mut world = World::new(draws.attitude(), params());
    world.fly(3.0, draws.vector(0.5), |_, step| biased(step));
    world.fly(2.0 * STEP_S, draws.vector(0.5), nothing);
    let mut filter = world.filter;
    filter.silent_s = 0.3;
    filter.rejected_s = [2.0, 3.0];
    filter.rested = true;
    filter.velocity_n = Vector2::new(0.1, 0.2);
    filter
}

fn known(draws: &mut Draws, spin: f32) -> Known {
    let root = SMatrix::<f32, 6, 6>::from_fn(|_, _| draws.within(-0.01, 0.01));
    Known {
        q_nb: draws.attitude(),
        rate_b: draws.vector(1.0),
        bias_b: draws.vector(0.01),
        covariance: root * root.transpose() + SMatrix::from_diagonal_element(1e-5),
        sees_spin_b: draws.vector(0.01),
        sees_spin_variance: Vector3::new(0.5 * spin, spin, 2.0 * spin),
        iron_b: draws.vector(1.0),
        iron_covariance: Matrix3::new(0.2, 0.1, 0.0, 0.1, 0.3, 0.0, 0.0, 0.0, 0.4),
    }
}

#[test]
fn it_goes_on_from_what_is_known() {
    for seed in 0..20 {
        let mut draws = Draws::of(seed);
        let mut filter = flying(&mut draws);
        let mut before = filter.clone();
        before.settlements = before.settlements.wrapping_add(1);
        // Known better than the filter knows it in the first row, as well in the second, and worse in the third.
        let of_spin = |row: usize| DRIVEN + 3 + 3 * row;
        let p = before.covariance.matrix();
        let mut known = known(&mut draws, 1.0);
        for (row, part) in [0.5, 1.0, 2.0].into_iter().enumerate() {
            known.sees_spin_variance[row] = part * p[(of_spin(row), of_spin(row))];
        }
        filter.go_on(77_000_000, &known);
        let state = (
            filter.q_nb,
            filter.rate_b,
            filter.bias_b,
            filter.last_us,
            filter.aligned,
        );
        assert_eq!(state, (known.q_nb, known.rate_b, known.bias_b, Some(77_000_000), true));
        assert_eq!(
            (filter.velocity_n, filter.silent_s, filter.rejected_s),
            (Vector2::zeros(), 0.0, [0.0; 2])
        );
        assert!(!filter.rested && filter.gyro_b.is_none() && filter.going.is_none() && filter.contradicted.is_none());
        assert_eq!(filter.window.duration_s, 0.0);
        assert!((filter.iron.iron_b - known.iron_b).norm() < 1e-5);
        assert!((filter.iron.covariance - known.iron_covariance).norm() < 1e-5);
        assert!(filter.pending.is_done() && filter.settlements == before.settlements);
        // What is known better has its column's share in all others of the matrix, which is more than nothing.
        let of_itself = p[(of_spin(0), of_spin(0))];
        let share = |k: usize| p[(k, of_spin(0))] / of_itself;
        let change = known.sees_spin_b[0] - before.gyro_matrix[(0, 0)];
        let mut moved = 0.0_f32;
        for row in 0..3 {
            for column in 0..3 {
                let k = of_spin(row) + column;
                let by = filter.gyro_matrix[(row, column)] - before.gyro_matrix[(row, column)];
                assert!((by - share(k) * change).abs() < 1e-7, "{row} {column}: {by}");
                moved = moved.max(if k == of_spin(0) { 0.0 } else { by.abs() });
            }
        }
        assert!((filter.gyro_matrix[(0, 0)] - known.sees_spin_b[0]).abs() < 1e-7);
        assert!(moved > 0.0);
        let found = filter.covariance.matrix();
        // Attitude 0 to 2 and bias 5 to 7 are given; the velocity is bounded; the gyro matrix stands, but for what its first row's
        // first element, known better, takes off it.
        let given = |k: usize| match k {
            0..3 => Some(k),
            5..8 => Some(k - 2),
            _ => None,
        };
        for row in 0..STATES {
            for column in 0..STATES {
                let matrix = |k: usize| k >= DRIVEN + 3;
                let less = of_itself - known.sees_spin_variance[0];
                let expected = match (given(row), given(column)) {
                    (Some(row), Some(column)) => known.covariance[(row, column)],
                    (None, None) if matrix(row) && matrix(column) => {
                        p[(row, column)] - share(row) * share(column) * less
                    }
                    (None, None) if row == column => square(filter.params.velocity_sd),
                    _ => 0.0,
                };
                let off = (found[(row, column)] - expected).abs();
                let is_given = given(row).is_some() || given(column).is_some();
                let allowed = if is_given { 0.0 } else { 1e-6 * of_itself };
                assert!(off <= allowed, "{row} {column}: {off}");
            }
        }
    }
}

#[test]
fn what_is_no_number_begins_anew_and_forgetting_does_too() {
    let mut draws = Draws::of(1);
    let mut filter = flying(&mut draws);
    let mut wrong = known(&mut draws, 1.0);
    wrong.bias_b.y = f32::NAN;
    filter.go_on(1, &wrong);
    assert!(!filter.aligned && filter.bias_b == Vector3::zeros());
    let mut filter = flying(&mut draws);
    filter.forget();
    let fresh = Filter::new(params());
    assert_eq!((filter.aligned, filter.q_nb, filter.last_us), (false, fresh.q_nb, None));
    assert_eq!(filter.covariance, fresh.covariance);
}

/// A matrix drawn gyro by gyro has the covariance that the filter begins with; and with directions alone it has no trace.
#[test]
fn what_a_set_says_of_gyros_is_what_units_drawn_by_it_have() {
    const UNITS: u64 = 20_000;
    let axes_b = crate::geometry::gyro_axes_b();
    let axes_b: [Vector3<f32>; 4] = core::array::from_fn(|k| axes_b.row(k).transpose());
    let (least_squares, _) = crate::redundancy::matrix(&axes_b, 0b1111).expect("a tetrahedron");
    let mut draws = Draws::of(7);
    // Twelve uniform numbers between these have a variance of one.
    let mut normal = || (0..12).map(|_| draws.within(-0.5, 0.5)).sum::<f32>();
    for [scale, direction] in [[0.003, 0.01], [0.0, 0.01], [0.01, 0.01]] {
        let mut covariance = Covariance::new(&params());
        covariance.know_gyros(&least_squares, &axes_b, [scale, direction]);
        let said = covariance.matrix();
        let said = said.fixed_view::<9, 9>(DRIVEN + 3, DRIVEN + 3);
        let mut found = SMatrix::<f32, 9, 9>::zeros();
        for _ in 0..UNITS {
            let drawn = axes_b.iter().enumerate().map(|(k, axis_b)| {
                let off = Vector3::from_fn(|_, _| normal());
                let along = axis_b * axis_b.dot(&off);
                least_squares.column(k) * ((off - along) * direction + along * scale).transpose()
            });
            let matrix: Matrix3<f32> = drawn.sum();
            // Row by row, as the states are.
            let row_by_row = matrix.transpose();
            let elements = nalgebra::SVector::<f32, 9>::from_column_slice(row_by_row.as_slice());
            found += elements * elements.transpose() / UNITS as f32;
        }
        // Five deviations of a variance over so many: there are 45 of them, thrice.
        let largest = said.diagonal().max();
        let worst = (found - said).abs().max();
        assert!(
            worst < 5.0 * largest * (2.0 / UNITS as f32).sqrt(),
            "{scale}: {worst} of {largest}"
        );
        let trace = nalgebra::SVector::<f32, 9>::from_fn(|k, _| if k % 4 == 0 { 1.0 } else { 0.0 });
        let of_trace = trace.dot(&(said * trace));
        assert!((of_trace - 2.25 * scale * scale).abs() < 1e-3 * largest, "{of_trace}");
    }
}
