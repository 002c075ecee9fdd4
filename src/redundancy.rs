//! Many axes, one vector: weighted least squares over whatever axes are left.
//!
//! In: sense axes in b, what each measured along itself, the variance of each, and which are to be used. Out: the vector in
//! b, its covariance, and what of it is known. With `H` the axes as rows and `W` the inverse variances,
//!
//! ```text
//! P = (H^T W H)^-1        x = P H^T W y        (C. F. Gauss; P is the covariance of x)
//! ```
//!
//! The thesis asks for a stored matrix for each set of failed sensors (future work, item 3). The sum of at most twelve
//! 3 x 3 terms and one 3 x 3 inverse serve every set, and weights with it: with all twelve axes alike this is the mean of
//! the four plates, with a plate gone the mean of three, with one axis gone `(I + s s^T / 3) S^T / 4`.
//!
//! What is left may not span space (two gyros of four). Then the eigenvectors of `H^T W H` say what is known: with rank 2
//! the adjugate is `l1 l2 u u^T` with `u` the direction nothing is known along, with rank 1 the matrix itself is
//! `l h h^T`. The vector returned then has no component along what is unknown, and its covariance none either.
//!
//! Refuses values and variances that are not finite, and variances that are not positive: such an axis is not used.

mod gaps;

use nalgebra::{Matrix3, SMatrix, Vector3};

pub use gaps::Known;

/// Most axes of one vector.
const AXES: usize = 16;

/// What an axis measured.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// [unit] along itself.
    pub value: f32,
    /// \[unit2\] variance of that.
    pub variance: f32,
    /// How far it is from what a vector expects of it, and the variance of what is expected, for who holds it against one.
    pub off: (f32, f32),
}

/// A vector out of redundant axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// [unit of the values] the vector, in b.
    pub vector_b: Vector3<f32>,
    /// [unit squared] its covariance, in b.
    pub covariance_b: Matrix3<f32>,
    /// What of it is known.
    pub known: Known,
    /// Axes used, bit `k` the `k`-th.
    pub used: u16,
}

impl Solution {
    /// Of no axes at all.
    pub const NOTHING: Solution = Solution {
        vector_b: Vector3::new(0.0, 0.0, 0.0),
        covariance_b: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        known: Known::Nothing,
        used: 0,
    };

    /// What an axis should have measured, and the variance of that.
    pub fn along(&self, axis_b: &Vector3<f32>) -> (f32, f32) {
        let [x, y, z] = [axis_b.x, axis_b.y, axis_b.z];
        let p = &self.covariance_b;
        let variance =
            x * (x * p.m11 + 2.0 * (y * p.m12 + z * p.m13)) + y * (y * p.m22 + 2.0 * z * p.m23) + z * z * p.m33;
        (axis_b.dot(&self.vector_b), variance)
    }
}

/// The vector behind `values`, one along each of `axes_b` with the variance beside it; axes whose bit in `wanted` is
/// clear are left out, as are those beyond the shortest of the three.
pub fn solve(axes_b: &[Vector3<f32>], values: &[f32], variances: &[f32], wanted: u16) -> Solution {
    let mut seen = [Seen::default(); AXES];
    for (seen, (value, variance)) in seen.iter_mut().zip(values.iter().zip(variances)) {
        (seen.value, seen.variance) = (*value, *variance);
    }
    let axes = values.len().min(variances.len()).min(AXES);
    let mut solution = Solution::NOTHING;
    solve_seen(axes_b, &seen[..axes], wanted, &mut solution);
    solution
}

/// [`solve`] for axes whose values and variances lie together, in the solution's place.
pub fn solve_seen(axes_b: &[Vector3<f32>], seen: &[Seen], wanted: u16, solution: &mut Solution) {
    // Written out: a symmetric matrix has six elements, and this sum is most of what a cycle costs.
    let [mut xx, mut xy, mut xz, mut yy, mut yz, mut zz] = [0.0; 6];
    let mut weighted = Vector3::zeros();
    // The bit of the axis; none beyond the sixteenth.
    let (mut bit, mut used) = (1, 0);
    for k in 0..axes_b.len().min(seen.len()) {
        let (axis_b, Seen { value, variance, .. }) = (&axes_b[k], seen[k]);
        let (axis, weight) = (bit, 1.0 / variance);
        bit <<= 1;
        // Comparisons with NaN are false.
        // Above zero and below infinity in one comparison.
        let weighs = weight.to_bits().wrapping_sub(1) < f32::MAX.to_bits();
        if !(wanted & axis != 0 && value.abs() <= f32::MAX && weighs) {
            continue;
        }
        used |= axis;
        let row = axis_b * weight;
        xx += row.x * axis_b.x;
        xy += row.x * axis_b.y;
        xz += row.x * axis_b.z;
        yy += row.y * axis_b.y;
        yz += row.y * axis_b.z;
        zz += row.z * axis_b.z;
        weighted += row * value;
    }
    let (covariance_b, known) = gaps::invert(&Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
    solution.vector_b = covariance_b * weighted;
    solution.covariance_b = covariance_b;
    solution.known = known;
    solution.used = used;
}

/// Rate by least squares from values about those of four axes that are wanted, all weighing the same: `rate = matrix
/// values`. With the covariance for values of a variance of one; `None` where they do not span space.
pub fn matrix(axes_b: &[Vector3<f32>; 4], wanted: u16) -> Option<(SMatrix<f32, 3, 4>, Matrix3<f32>)> {
    let Solution {
        covariance_b, known, ..
    } = solve(axes_b, &[0.0; 4], &[1.0; 4], wanted);
    let mut left = wanted;
    let columns = axes_b.map(|axis_b| {
        let is_wanted = left & 1 == 1;
        left >>= 1;
        if is_wanted {
            covariance_b * axis_b
        } else {
            Vector3::zeros()
        }
    });
    (known == Known::All).then(|| (SMatrix::from_columns(&columns), covariance_b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{gyro_axes_b, triad_axes_b};

    /// f32 rounding of sums of twelve products of numbers up to ten.
    const ROUNDING: f32 = 1e-5;
    const FORCE_B: Vector3<f32> = Vector3::new(-3.4, 1.6, -9.1);
    const ALL: u16 = 0xFFF;
    /// Of the 4096 sets of twelve axes, how many span space.
    const SPANNING: usize = 3977;

    fn measured<const N: usize>(axes_b: &[Vector3<f32>; N], vector_b: Vector3<f32>) -> [f32; N] {
        axes_b.map(|axis_b| axis_b.dot(&vector_b))
    }

    fn gyro_axes() -> [Vector3<f32>; 4] {
        core::array::from_fn(|plate| gyro_axes_b().row(plate).transpose())
    }

    #[test]
    fn twelve_axes_are_the_mean_of_four_plates_and_half_as_noisy() {
        let axes_b = triad_axes_b();
        let found = solve(&axes_b, &measured(&axes_b, FORCE_B), &[0.04; 12], ALL);
        assert!((found.vector_b - FORCE_B).norm() < ROUNDING);
        assert!((found.covariance_b - Matrix3::identity() * 0.01).norm() < 1e-7);
        assert_eq!((found.known, found.used), (Known::All, ALL));
    }

    #[test]
    fn any_one_axis_gone_is_the_closed_form_of_the_errata() {
        let axes_b = triad_axes_b();
        for gone in 0..12 {
            // An impulse on each other axis in turn shows that column of (I + s s^T / 3) S^T / 4.
            for k in (0..12).filter(|k| *k != gone) {
                let mut values = [0.0; 12];
                values[k] = 1.0;
                let found = solve(&axes_b, &values, &[1.0; 12], ALL & !(1 << gone)).vector_b;
                let expected = (axes_b[k] + axes_b[gone] * axes_b[gone].dot(&axes_b[k]) / 3.0) / 4.0;
                assert!((found - expected).norm() < ROUNDING, "{gone} {k}");
            }
        }
    }

    #[test]
    fn every_set_that_spans_space_gives_the_vector_and_every_other_says_so() {
        let axes_b = triad_axes_b();
        let values = measured(&axes_b, FORCE_B);
        let mut spanning = 0;
        for wanted in 0..1 << 12 {
            let found = solve(&axes_b, &values, &[1.0; 12], wanted);
            if found.known == Known::All {
                spanning += 1;
                let sigma = found.covariance_b.trace();
                assert!(
                    (found.vector_b - FORCE_B).norm() < ROUNDING * (1.0 + sigma),
                    "{wanted:03X}"
                );
            }
            if let Known::Across(unknown_b) = found.known {
                let seen = |k: &usize| wanted >> k & 1 == 1 && axes_b[*k].dot(&unknown_b).abs() > ROUNDING;
                assert_eq!((0..12).find(seen), None, "{wanted:03X}");
            }
            assert!(found.vector_b.iter().all(|component| component.is_finite()));
        }
        // Counted in exact arithmetic: the rank of each set of columns of M1 to M4.
        assert_eq!(spanning, SPANNING);
    }

    #[test]
    fn three_of_four_gyros_give_the_rate_and_the_errata_s_matrices() {
        let axes_b = gyro_axes();
        // Errata of section 3.4, gyro 4 gone: row of x_b (z_e) in columns g1 to g3.
        let row = [-0.702_728_4, 0.351_364_2, 0.351_364_2];
        for (k, expected) in row.into_iter().enumerate() {
            let mut values = [0.0; 4];
            values[k] = 1.0;
            let found = solve(&axes_b, &values, &[1.0; 4], 0b0111);
            assert!((found.vector_b.x - expected).abs() < ROUNDING);
            assert!((found.vector_b.z + 1.054_092_6).abs() < ROUNDING);
        }
    }

    #[test]
    fn two_gyros_know_all_but_the_direction_across_both() {
        let axes_b = gyro_axes();
        let rate_b = Vector3::new(0.3, -0.2, 1.0);
        for wanted in [0b0011_u16, 0b0101, 0b1001, 0b0110, 0b1010, 0b1100] {
            let found = solve(&axes_b, &measured(&axes_b, rate_b), &[0.25; 4], wanted);
            let Known::Across(unknown_b) = found.known else {
                panic!("{wanted:04b}: {:?}", found.known)
            };
            let (a, b) = (wanted.trailing_zeros() as usize, 15 - wanted.leading_zeros() as usize);
            assert!(unknown_b.cross(&axes_b[a].cross(&axes_b[b]).normalize()).norm() < ROUNDING);
            let expected = rate_b - unknown_b * unknown_b.dot(&rate_b);
            assert!((found.vector_b - expected).norm() < ROUNDING, "{wanted:04b}");
            assert!((found.covariance_b * unknown_b).norm() < ROUNDING);
        }
    }

    #[test]
    fn one_gyro_knows_its_own_direction_and_none_knows_nothing() {
        let axes_b = gyro_axes();
        let values = measured(&axes_b, Vector3::new(0.3, -0.2, 1.0));
        let found = solve(&axes_b, &values, &[0.25; 4], 0b0010);
        let Known::Along(known_b) = found.known else {
            panic!("{:?}", found.known)
        };
        assert!(known_b.cross(&axes_b[1]).norm() < ROUNDING);
        assert!((found.vector_b - axes_b[1] * values[1]).norm() < ROUNDING);
        assert!((found.along(&axes_b[1]).1 - 0.25).abs() < ROUNDING);
        assert_eq!(solve(&axes_b, &values, &[0.25; 4], 0), Solution::NOTHING);
    }

    #[test]
    fn what_is_not_a_number_is_not_used() {
        let axes_b = triad_axes_b();
        let mut values = measured(&axes_b, FORCE_B);
        let mut variances = [1.0; 12];
        values[0] = f32::NAN;
        values[5] = f32::INFINITY;
        variances[7] = 0.0;
        variances[9] = -1.0;
        variances[10] = f32::NAN;
        let found = solve(&axes_b, &values, &variances, ALL);
        assert_eq!(found.used, ALL & !(1 | 1 << 5 | 1 << 7 | 1 << 9 | 1 << 10));
        assert!((found.vector_b - FORCE_B).norm() < ROUNDING);
    }

    #[test]
    fn a_noisy_axis_counts_by_its_variance() {
        let axes_b = triad_axes_b();
        let mut values = measured(&axes_b, FORCE_B);
        let mut variances = [0.01; 12];
        values[3] += 3.0;
        let believed = solve(&axes_b, &values, &variances, ALL).vector_b - FORCE_B;
        variances[3] = 100.0;
        let doubted = solve(&axes_b, &values, &variances, ALL).vector_b - FORCE_B;
        assert!(
            (believed.norm() - 0.75).abs() < ROUNDING && doubted.norm() < 2e-4,
            "{believed} {doubted}"
        );
    }
}
