//! Least squares with covariance, by singular values.
//!
//! In: a design matrix (a row an observation, a column a parameter) and the observations, all equally good. Out: the
//! parameters, their covariance `s2 (J'J)^-1` and the residual scatter `s` per degree of freedom, or the directions of
//! parameter space that the observations leave open. Columns are scaled to unit length first, so that what is open is
//! decided without regard to units.
//!
//! Refused: fewer observations than parameters, and designs whose smallest singular value is below [`OPEN`] of the
//! largest. Source: C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems" (1974), chapters 12 and 25.

use nalgebra::{DMatrix, DVector};

/// Ratio of singular values (of unit columns) below which a direction counts as open: an excitation this weak would
/// have to be known to a part in a million to be of use.
pub const OPEN: f64 = 1e-6;

/// A solution.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The parameters.
    pub parameters: DVector<f64>,
    /// Their covariance, from the residuals' scatter; zero where nothing is left over to judge it by.
    pub covariance: DMatrix<f64>,
    /// Observed minus predicted.
    pub residuals: DVector<f64>,
    /// Root mean square residual per degree of freedom.
    pub scatter: f64,
    /// Observations less parameters.
    pub freedom: usize,
}

/// What the observations cannot tell.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{} of the parameters' directions are not excited", .directions.len())]
pub struct Open {
    /// Unit directions in parameter space, largest component positive.
    pub directions: Vec<DVector<f64>>,
}

/// Solves `design * parameters = observed`.
///
/// # Errors
/// When directions stay open.
pub fn solve(design: &DMatrix<f64>, observed: &DVector<f64>) -> Result<Solution, Open> {
    let information = Information::of(design)?;
    let parameters = &information.inverse * (design.transpose() * observed);
    // One step of refinement takes out what squaring the condition number has put in.
    let parameters = &parameters + &information.inverse * (design.transpose() * (observed - design * &parameters));
    let residuals = observed - design * &parameters;
    let freedom = design.nrows().saturating_sub(design.ncols());
    let scatter = if freedom == 0 {
        0.0
    } else {
        (residuals.norm_squared() / freedom as f64).sqrt()
    };
    Ok(Solution {
        covariance: information.inverse * (scatter * scatter),
        parameters,
        residuals,
        scatter,
        freedom,
    })
}

/// What a design says about its parameters, before anything is observed.
#[derive(Clone, Debug, PartialEq)]
pub struct Information {
    /// `(J'J)^-1`: the parameters' covariance for observations of unit variance.
    pub inverse: DMatrix<f64>,
    /// Largest over smallest singular value, of unit columns.
    pub condition: f64,
}

impl Information {
    /// Of a design matrix.
    ///
    /// # Errors
    /// When directions stay open.
    pub fn of(design: &DMatrix<f64>) -> Result<Self, Open> {
        let count = design.ncols();
        let lengths: Vec<f64> = design.column_iter().map(|column| column.norm()).collect();
        let unit = |k: usize| lengths.get(k).copied().filter(|&length| length > 0.0).unwrap_or(1.0);
        let scaled = DMatrix::from_fn(design.nrows().max(count), count, |row, column| {
            design.get((row, column)).map_or(0.0, |value| value / unit(column))
        });
        let svd = scaled.svd(false, true);
        let Some(v_t) = svd.v_t else {
            return Err(Open { directions: Vec::new() });
        };
        let largest = svd.singular_values.max();
        let least = svd.singular_values.min();
        let floor = OPEN * largest;
        let open = svd
            .singular_values
            .iter()
            .enumerate()
            .filter(|&(_, &s)| s.is_nan() || s <= floor);
        let directions: Vec<_> = open
            .map(|(k, _)| {
                let direction = v_t.row(k).transpose();
                let lead = direction
                    .iter()
                    .fold(0.0_f64, |lead, &c| if c.abs() > lead.abs() { c } else { lead });
                direction * lead.signum()
            })
            .collect();
        if !directions.is_empty() || count == 0 {
            return Err(Open { directions });
        }
        let mut inverse = DMatrix::zeros(count, count);
        for (k, &s) in svd.singular_values.iter().enumerate() {
            let row = v_t.row(k);
            inverse += row.transpose() * row / (s * s);
        }
        for row in 0..count {
            for column in 0..count {
                inverse[(row, column)] /= unit(row) * unit(column);
            }
        }
        Ok(Information {
            inverse,
            condition: largest / least,
        })
    }
}

/// Half-width of the two-sided 95 % interval in sigmas, for a sigma estimated with `freedom` degrees of freedom:
/// Student's t after M. Abramowitz, I. A. Stegun (1964), 26.7.5 (to 3e-3 from six degrees on; their tables below).
pub fn student_95(freedom: usize) -> f64 {
    const Z: f64 = 1.959_963_985;
    const FEW: [f64; 6] = [f64::INFINITY, 12.706, 4.303, 3.182, 2.776, 2.571];
    if let Some(&few) = FEW.get(freedom) {
        return few;
    }
    let (n, z2) = (freedom as f64, Z * Z);
    Z * (1.0
        + (z2 + 1.0) / (4.0 * n)
        + (5.0 * z2 * z2 + 16.0 * z2 + 3.0) / (96.0 * n * n)
        + (3.0 * z2.powi(3) + 19.0 * z2 * z2 + 17.0 * z2 - 15.0) / (384.0 * n.powi(3)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a well-conditioned 3-parameter solution in f64.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn a_line_through_four_points_has_the_textbook_covariance() {
        // y = 1 + 2 x + (1, -1, -1, 1)/10 at x = 0..3: residuals orthogonal to the line, s2 = 0.04 / 2.
        let design = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 1.0, 3.0]);
        let observed = DVector::from_row_slice(&[1.1, 2.9, 4.9, 7.1]);
        let solution = solve(&design, &observed).expect("line");
        assert!((solution.parameters[0] - 1.0).abs() < ROUNDING && (solution.parameters[1] - 2.0).abs() < ROUNDING);
        assert!((solution.scatter - 0.02_f64.sqrt()).abs() < ROUNDING);
        let expected = DMatrix::from_row_slice(2, 2, &[0.7, -0.3, -0.3, 0.2]) * 0.02;
        assert!((solution.covariance - expected).norm() < ROUNDING);
    }

    #[test]
    fn what_is_not_excited_is_named_whatever_its_unit() {
        let design = DMatrix::from_row_slice(4, 3, &[1e6, 1.0, 0.0, 2e6, 1.0, 0.0, 3e6, 1.0, 0.0, 4e6, 1.0, 0.0]);
        let open = solve(&design, &DVector::zeros(4)).expect_err("third column is zero");
        assert_eq!(open.directions.len(), 1);
        assert!((open.directions[0][2] - 1.0).abs() < ROUNDING);
        let few = solve(&DMatrix::identity(2, 3), &DVector::zeros(2)).expect_err("two rows, three parameters");
        assert_eq!(few.directions.len(), 1);
    }

    #[test]
    fn student_is_that_of_the_tables() {
        for (freedom, table) in [
            (1, 12.706),
            (4, 2.776),
            (5, 2.571),
            (10, 2.228),
            (30, 2.042),
            (1000, 1.962),
        ] {
            assert!(
                (student_95(freedom) - table).abs() < 3e-3,
                "{freedom}: {}",
                student_95(freedom)
            );
        }
    }
}
