//! What acceleration does to a dry-tuned gyro's drift: the multi-position test.
//!
//! In: [`Position`]s and the output of one channel (x) in each. Out: [`Sensitivity`]: scale factor, misalignments, and
//! constant, mass unbalance and g-squared drifts, with 95 % intervals.
//!
//! ```text
//! K V = W_x + K_y W_y + K_s W_s + D_f + D_x a_x + D_y a_y + D_s a_s
//!       + D_xx a_x^2 + D_yy a_y^2 + D_ss a_s^2 + D_xy a_x a_y + D_xs a_x a_s + D_ys a_y a_s
//! ```
//!
//! (Eq. 7 of the dry-tuned gyro paper; `a` is gravity in g.) Of its thirteen coefficients a test at rest determines
//! twelve: `a_x^2 + a_y^2 + a_s^2 = 1`, so that `D_f : D_xx : D_yy : D_ss = 1 : -1 : -1 : -1` can be added without a
//! trace. The paper drops `D_yy`; what is determined then is `D_f + D_yy`, `D_xx - D_yy` and `D_ss - D_yy`, and so they are
//! called here. The noise is in the output, so the output is what is fitted, and divided by the scale factor after.
//!
//! Refuses position sets that leave more than that undetermined, and names the combinations they leave.

use nalgebra::{DMatrix, DVector, SVD};

use super::positions::Position;
use crate::least_squares::student_95;

/// The determined coefficients, in the order of the results.
pub const NAMES: [&str; 12] = [
    "1/K", "Ky", "Ks", "Df+Dyy", "Dx", "Dy", "Ds", "Dxx-Dyy", "Dss-Dyy", "Dxy", "Dxs", "Dys",
];

/// The thirteen coefficients of the full model.
const FULL: [&str; 13] = [
    "1/K", "Ky", "Ks", "Df", "Dx", "Dy", "Ds", "Dxx", "Dyy", "Dss", "Dxy", "Dxs", "Dys",
];

/// Singular values below this share of the largest, with columns of equal length, are not determined: position angles
/// are good to 1e-4.
const UNDETERMINED: f64 = 1e-4;

/// A coefficient with the half-width of its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficient {
    /// Value; drifts in deg/h per power of g, `1/K` in output per deg/h, misalignments in rad.
    pub value: f64,
    /// Half-width of the interval.
    pub half_width: f64,
}

/// What the test found.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivity {
    /// In the order of [`NAMES`].
    pub coefficients: [Coefficient; 12],
    /// What the model leaves of each output, in deg/h.
    pub residuals: Vec<f64>,
    /// Ratio of the largest to the smallest singular value, columns of equal length.
    pub condition: f64,
}

/// Why a test does not determine the coefficients.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SensitivityError {
    /// Not enough positions.
    #[error("{0} positions; twelve coefficients need at least 13, and 24 to find a wrong one")]
    TooFew(usize),
    /// The positions leave combinations free.
    #[error("the positions do not determine {}: add positions that excite them", .0.join("; nor "))]
    Undetermined(Vec<String>),
    /// The output does not follow the Earth's rate.
    #[error(
        "the scale factor is within its own uncertainty of zero: wrong channel, or the Earth's rate is hidden by noise"
    )]
    NoScale,
}

/// Fits the model to `(position, output)`.
pub fn sensitivity(test: &[(Position, f64)]) -> Result<Sensitivity, SensitivityError> {
    if test.len() < 13 {
        return Err(SensitivityError::TooFew(test.len()));
    }
    let positions: Vec<Position> = test.iter().map(|(position, _)| *position).collect();
    let design = columns(&positions, &determined);
    let (scaled, lengths) = equal_lengths(&design);
    let svd = SVD::new(scaled, true, true);
    let (most, least) = (svd.singular_values.max(), svd.singular_values.min());
    if least < UNDETERMINED * most {
        return Err(SensitivityError::Undetermined(undetermined(&design, &NAMES)));
    }
    let outputs = DVector::from_iterator(test.len(), test.iter().map(|(_, output)| *output));
    let Ok(inverse) = svd.pseudo_inverse(0.0) else {
        return Err(SensitivityError::NoScale);
    };
    let inverse = DMatrix::from_fn(12, test.len(), |i, j| inverse[(i, j)] / lengths[i]);
    let fitted = &inverse * &outputs;
    let left = &outputs - &design * &fitted;
    let freedom = test.len() - 12;
    let variance = left.norm_squared() / freedom as f64;
    let covariance = &inverse * inverse.transpose() * variance;
    let t = student_95(freedom);
    let per_rate = fitted[0];
    let seen = per_rate.abs() > t * covariance[(0, 0)].sqrt();
    if !seen {
        return Err(SensitivityError::NoScale);
    }
    let coefficients = std::array::from_fn(|j| {
        if j == 0 {
            return Coefficient {
                value: per_rate,
                half_width: t * covariance[(0, 0)].sqrt(),
            };
        }
        // A ratio of two estimates, to first order.
        let value = fitted[j] / per_rate;
        let spread = covariance[(j, j)] - 2.0 * value * covariance[(j, 0)] + value * value * covariance[(0, 0)];
        Coefficient {
            value,
            half_width: t * spread.max(0.0).sqrt() / per_rate.abs(),
        }
    });
    Ok(Sensitivity {
        coefficients,
        residuals: left.iter().map(|left| left / per_rate).collect(),
        condition: most / least,
    })
}

/// The combinations of the full model's thirteen coefficients that positions do not determine, largest parts first.
pub fn unidentifiable(positions: &[Position]) -> Vec<String> {
    undetermined(&columns(positions, &full), &FULL)
}

fn determined(position: &Position) -> Vec<f64> {
    let ([x, y, s], [wx, wy, ws]) = (position.gravity, position.rate);
    vec![wx, wy, ws, 1.0, x, y, s, x * x, s * s, x * y, x * s, y * s]
}

fn full(position: &Position) -> Vec<f64> {
    let ([x, y, s], [wx, wy, ws]) = (position.gravity, position.rate);
    vec![wx, wy, ws, 1.0, x, y, s, x * x, y * y, s * s, x * y, x * s, y * s]
}

fn columns(positions: &[Position], row: &dyn Fn(&Position) -> Vec<f64>) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = positions.iter().map(row).collect();
    DMatrix::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |i, j| rows[i][j])
}

/// Columns of length one and their lengths; a column of rounding only stays as small as it is.
fn equal_lengths(design: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    const ROUNDING: f64 = 1e-9;
    let longest = design.column_iter().map(|column| column.norm()).fold(0.0, f64::max);
    let length = |norm: f64| {
        if norm > ROUNDING * longest {
            norm
        } else {
            longest.max(f64::MIN_POSITIVE)
        }
    };
    let lengths: Vec<f64> = design.column_iter().map(|column| length(column.norm())).collect();
    (
        DMatrix::from_fn(design.nrows(), design.ncols(), |i, j| design[(i, j)] / lengths[j]),
        lengths,
    )
}

fn undetermined(design: &DMatrix<f64>, names: &[&str]) -> Vec<String> {
    /// Parts of a combination below this share of its largest are rounding.
    const PART: f64 = 1e-3;
    let (scaled, lengths) = equal_lengths(design);
    let eigen = (scaled.transpose() * &scaled).symmetric_eigen();
    let most = eigen.eigenvalues.max();
    let free = (0..names.len()).filter(|&j| eigen.eigenvalues[j] < UNDETERMINED * UNDETERMINED * most);
    free.map(|j| {
        let parts: Vec<f64> = (0..names.len())
            .map(|i| eigen.eigenvectors[(i, j)] / lengths[i])
            .collect();
        let largest = parts
            .iter()
            .copied()
            .max_by(|a, b| a.abs().total_cmp(&b.abs()))
            .unwrap_or(1.0);
        let named = parts
            .iter()
            .zip(names)
            .filter(|(part, _)| part.abs() > PART * largest.abs());
        named
            .map(|(part, name)| format!("{:+.2} {name}", part / largest))
            .collect::<Vec<_>>()
            .join(" ")
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::{super::positions::twenty_four, *};

    const LATITUDE_DEG: f64 = -23.211132298;
    /// 0.05 V per deg/h; misalignments of some mrad; drifts of some deg/h as of a tactical dry-tuned gyro.
    const TRUTH: [f64; 12] = [0.05, 2e-3, -3e-3, 4.0, 6.0, -5.0, 1.5, 0.2, -0.1, 0.05, 0.3, -0.15];

    fn test(positions: &[(f64, f64)], sigma: f64, seed: u64) -> Vec<(Position, f64)> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let positions = positions
            .iter()
            .map(|(inner, middle)| Position::on_table(*inner, *middle, LATITUDE_DEG));
        positions
            .map(|position| {
                let row = determined(&position);
                let drift: f64 = row[1..].iter().zip(&TRUTH[1..]).map(|(a, b)| a * b).sum();
                let noise: f64 = StandardNormal.sample(&mut random);
                (position, TRUTH[0] * (row[0] + drift + sigma * noise))
            })
            .collect()
    }

    #[test]
    fn twenty_four_positions_return_the_twelve_coefficients() {
        let found = sensitivity(&test(&twenty_four(LATITUDE_DEG), 0.0, 0)).expect("determined");
        for ((coefficient, truth), name) in found.coefficients.iter().zip(TRUTH).zip(NAMES) {
            assert!(
                (coefficient.value - truth).abs() < 1e-10,
                "{name}: {coefficient:?}, not {truth}"
            );
        }
        assert!(found.condition < 10.0, "{}", found.condition);
    }

    #[test]
    fn the_one_direction_no_test_at_rest_determines_is_named() {
        let positions: Vec<Position> = twenty_four(LATITUDE_DEG)
            .iter()
            .map(|(inner, middle)| Position::on_table(*inner, *middle, LATITUDE_DEG))
            .collect();
        assert_eq!(unidentifiable(&positions).len(), 1);
        let named = &unidentifiable(&positions)[0];
        let signs: Vec<bool> = ["Df", "Dxx", "Dyy", "Dss"]
            .iter()
            .map(|name| named.contains(&format!("+1.00 {name}")))
            .collect();
        assert!(
            signs == [true, false, false, false] || signs == [false, true, true, true],
            "{named}"
        );
        assert_eq!(named.split_whitespace().count(), 8, "{named}");
    }

    #[test]
    fn right_angles_alone_leave_the_product_of_the_sensitive_axes_free() {
        let mut positions = twenty_four(LATITUDE_DEG);
        positions.iter_mut().skip(16).for_each(|(inner, _)| *inner -= 45.0);
        let error = sensitivity(&test(&positions, 0.0, 0)).expect_err("not excited");
        let SensitivityError::Undetermined(free) = error else {
            panic!("{error}")
        };
        assert_eq!(free, ["+1.00 Dxy"]);
    }

    #[test]
    fn intervals_hold_the_truth_in_93_to_97_of_100_tests() {
        let positions = twenty_four(LATITUDE_DEG);
        let mut held = [0_u32; 12];
        for seed in 0..1_000 {
            let found = sensitivity(&test(&positions, 0.05, seed)).expect("determined");
            for (j, coefficient) in found.coefficients.iter().enumerate() {
                held[j] += u32::from((coefficient.value - TRUTH[j]).abs() <= coefficient.half_width);
            }
        }
        println!("held {held:?} of 1000");
        assert!(held.iter().all(|held| (930..=970).contains(held)), "{held:?}");
    }

    #[test]
    fn a_dead_channel_and_twelve_positions_are_refused() {
        let mut dead = test(&twenty_four(LATITUDE_DEG), 0.0, 0);
        dead.iter_mut().for_each(|(_, output)| *output = 0.0);
        assert_eq!(sensitivity(&dead), Err(SensitivityError::NoScale));
        assert_eq!(sensitivity(&dead[..12]), Err(SensitivityError::TooFew(12)));
    }
}
