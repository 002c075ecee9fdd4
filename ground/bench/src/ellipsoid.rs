//! Calibration without controlled inputs (MV SEC): a triad turned every way in a field of known strength.
//!
//! In: points `v` \[counts\] of an accelerometer at rest or a magnetometer, and the field's strength `R` [m/s2, uT]. Out:
//! `v = T B + v0` with `|B| = R`: offset `v0` \[counts\] and lower triangular `T` [counts per unit], whose first row ties x
//! to the sensor's own x axis, with covariance. Nine parameters; how the sensor sits in the body is not among them.
//!
//! Start: the algebraic ellipsoid `[x2 y2 z2 2xy 2xz 2yz 2x 2y 2z] s = 1` of centred and scaled data, then
//! `T = chol((M / k)^-1) / R`. Uncentred, or left at that, noise biases it. Then Gauss-Newton on the minimum-variance
//! estimator, Eqs 4.45 to 4.47 of Marinho (2017), with Eq 4.48 as `1 - h/R`, `h = |T^-1 (v - v0)|`: every residual is
//! weighted by the variance its direction has, and freed of the half `sigma2/R` by which noise lengthens a vector. After
//! J. C. Loetters et al., Sensors and Actuators A 68 (1998) and C. C. Foster, G. H. Elkaim, JGCD 31(1) (2008).
//!
//! The printed Eq 4.44 names the last two angles the other way round than public code after the same source does:
//! [`Convention`]. Refused: fewer than ten points, points that are no ellipsoid, and points that leave it open.
//!
//! ```
//! use bench::ellipsoid::Ellipsoid;
//! use nalgebra::Vector3;
//!
//! // A magnetometer of 10 counts a uT, turned every way in a field of 23 uT, with an offset of (5, 0, -7) counts.
//! let points: Vec<Vector3<f64>> = (0..100)
//!     .map(|k| {
//!         let (z, way) = (1.0 - f64::from(k) / 49.5, 2.4 * f64::from(k));
//!         let across = (1.0 - z * z).max(0.0).sqrt();
//!         230.0 * Vector3::new(across * way.cos(), across * way.sin(), z) + Vector3::new(5.0, 0.0, -7.0)
//!     })
//!     .collect();
//! let found = Ellipsoid::fit(&points, 23.0).unwrap();
//! assert!((found.offset - Vector3::new(5.0, 0.0, -7.0)).amax() < 1e-6);
//! assert!((found.shape[(0, 0)] - 10.0).abs() < 1e-6);
//! ```

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, Vector3};

use crate::least_squares::{self, Information};

/// Most Gauss-Newton steps; five are usual.
const STEPS: usize = 50;

/// A step below this share of the parameters ends the iteration.
const CONVERGED: f64 = 1e-12;

/// How the last row of `T` is written in angles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Convention {
    /// `c (sin phi cos lambda, sin lambda, cos phi cos lambda)`: Eq 4.44 of Marinho (2017), and so Table 6.1.
    #[default]
    Thesis,
    /// `c (sin lambda, sin phi cos lambda, cos phi cos lambda)`: public magnetometer code.
    Standard,
}

/// A calibrated triad.
#[derive(Clone, Debug, PartialEq)]
pub struct Ellipsoid {
    /// `T` [counts per unit], lower triangular.
    pub shape: Matrix3<f64>,
    /// `v0` \[counts\].
    pub offset: Vector3<f64>,
    /// Covariance of T11 T21 T22 T31 T32 T33 and the offset.
    pub covariance: SMatrix<f64, 9, 9>,
    /// `1 - h/R` of every point.
    pub residuals: Vec<f64>,
    /// Noise of one output \[counts\], from the residuals.
    pub scatter: f64,
    /// Points less nine.
    pub freedom: usize,
    /// Largest over smallest singular value of the last step.
    pub condition: f64,
}

/// Scales, misalignments and offsets as Table 6.1 lists them: a, b, c, x0, y0, z0, rho, phi, lambda.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nine {
    /// Values; scales in counts per unit, angles in rad.
    pub values: [f64; 9],
    /// Their sigmas.
    pub sigmas: [f64; 9],
}

/// Why points give no calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EllipsoidError {
    /// Too few points.
    #[error("nine parameters need at least ten points, and these are {0}")]
    Few(usize),
    /// No ellipsoid.
    #[error("the points lie on no ellipsoid: turn the triad through all directions, and leave out disturbed points")]
    Shapeless,
    /// Not enough directions.
    #[error("the points do not determine the ellipsoid: turn the triad through directions they leave out")]
    Open,
    /// No convergence.
    #[error("the fit does not settle: the points scatter too much for an ellipsoid")]
    Unsettled,
}

impl Ellipsoid {
    /// Fits `v = T B + v0`, `|B| = strength`.
    ///
    /// # Errors
    /// When the points do not determine it.
    pub fn fit(points: &[Vector3<f64>], strength: f64) -> Result<Self, EllipsoidError> {
        if points.len() < 10 {
            return Err(EllipsoidError::Few(points.len()));
        }
        let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let size = (points.iter().map(|v| (v - centre).norm_squared()).sum::<f64>() / points.len() as f64).sqrt();
        if !(size > 0.0 && strength > 0.0) {
            return Err(EllipsoidError::Shapeless);
        }
        // From here on in units of the cloud's size about its centre, and of the field.
        let points: Vec<_> = points.iter().map(|v| (v - centre) / size).collect();
        let (mut shape, mut offset) = algebraic(&points)?;
        let mut variance = 0.0;
        for _ in 0..STEPS {
            let step = step(&points, &shape, &offset, variance).ok_or(EllipsoidError::Open)?;
            shape += triangle(&step.parameters);
            offset += step.parameters.fixed_rows::<3>(6);
            if !(shape.norm().is_finite() && shape.diagonal().iter().all(|side| *side > 0.0)) {
                return Err(EllipsoidError::Unsettled);
            }
            let settled = step.parameters.norm() < CONVERGED && (step.scatter.powi(2) - variance).abs() < CONVERGED;
            variance = step.scatter.powi(2);
            if settled {
                return Ok(finish(&points, shape, offset, &step, centre, size, strength));
            }
        }
        Err(EllipsoidError::Unsettled)
    }

    /// The field [unit] for some counts.
    pub fn field(&self, counts: &Vector3<f64>) -> Vector3<f64> {
        // T has a positive diagonal, so it has an inverse.
        self.shape
            .solve_lower_triangular(&(counts - self.offset))
            .unwrap_or_default()
    }

    /// As Table 6.1 lists it, with sigmas propagated through the derivatives.
    pub fn nine(&self, convention: Convention) -> Nine {
        let values = angles(&self.shape, &self.offset, convention);
        let mut gradient = SMatrix::<f64, 9, 9>::zeros();
        for k in 0..9 {
            let mut nudge = DVector::zeros(9);
            // Angles are smooth in T: a millionth of its size loses neither digits nor curvature.
            nudge[k] = 1e-6 * self.shape.norm();
            let at = |sign: f64| {
                let moved = &nudge * sign;
                angles(
                    &(self.shape + triangle(&moved)),
                    &(self.offset + moved.fixed_rows::<3>(6)),
                    convention,
                )
            };
            let (up, down) = (at(1.0), at(-1.0));
            for row in 0..9 {
                gradient[(row, k)] = (up[row] - down[row]) / (2.0 * nudge[k]);
            }
        }
        let covariance = gradient * self.covariance * gradient.transpose();
        Nine {
            values,
            sigmas: std::array::from_fn(|k| covariance[(k, k)].max(0.0).sqrt()),
        }
    }
}

/// `T` from the nine of Table 6.1 (angles in rad): a, b, c, .., rho, phi, lambda.
pub fn shape(nine: &[f64; 9], convention: Convention) -> Matrix3<f64> {
    let [a, b, c, _, _, _, rho, phi, lambda] = *nine;
    let (x, y) = match convention {
        Convention::Thesis => (phi.sin() * lambda.cos(), lambda.sin()),
        Convention::Standard => (lambda.sin(), phi.sin() * lambda.cos()),
    };
    let third = [c * x, c * y, c * phi.cos() * lambda.cos()];
    Matrix3::new(
        a,
        0.0,
        0.0,
        b * rho.sin(),
        b * rho.cos(),
        0.0,
        third[0],
        third[1],
        third[2],
    )
}

fn angles(t: &Matrix3<f64>, offset: &Vector3<f64>, convention: Convention) -> [f64; 9] {
    let (x, y, z) = (t[(2, 0)], t[(2, 1)], t[(2, 2)]);
    let (phi, lambda) = match convention {
        Convention::Thesis => (x.atan2(z), y.atan2(x.hypot(z))),
        Convention::Standard => (y.atan2(z), x.atan2(y.hypot(z))),
    };
    let b = t[(1, 0)].hypot(t[(1, 1)]);
    let c = t.row(2).norm();
    [
        t[(0, 0)],
        b,
        c,
        offset.x,
        offset.y,
        offset.z,
        t[(1, 0)].atan2(t[(1, 1)]),
        phi,
        lambda,
    ]
}

fn triangle(six: &DVector<f64>) -> Matrix3<f64> {
    Matrix3::new(six[0], 0.0, 0.0, six[1], six[2], 0.0, six[3], six[4], six[5])
}

/// The algebraic ellipsoid, for a field of one.
fn algebraic(points: &[Vector3<f64>]) -> Result<(Matrix3<f64>, Vector3<f64>), EllipsoidError> {
    let design = DMatrix::from_fn(points.len(), 9, |row, k| {
        let v = &points[row];
        [
            v.x * v.x,
            v.y * v.y,
            v.z * v.z,
            2.0 * v.x * v.y,
            2.0 * v.x * v.z,
            2.0 * v.y * v.z,
            2.0 * v.x,
            2.0 * v.y,
            2.0 * v.z,
        ][k]
    });
    let s =
        least_squares::solve(&design, &DVector::from_element(points.len(), 1.0)).map_err(|_| EllipsoidError::Open)?;
    let s = s.parameters;
    let m = Matrix3::new(s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]);
    let offset = -(m.try_inverse().ok_or(EllipsoidError::Shapeless)? * Vector3::new(s[6], s[7], s[8]));
    let k = 1.0 + offset.dot(&(m * offset));
    let inverse = (m / k).try_inverse().ok_or(EllipsoidError::Shapeless)?;
    let shape = ((inverse + inverse.transpose()) / 2.0)
        .cholesky()
        .ok_or(EllipsoidError::Shapeless)?
        .l();
    Ok((shape, offset))
}

/// One Gauss-Newton step; `variance` is that of one output, in the units of the points.
fn step(
    points: &[Vector3<f64>],
    shape: &Matrix3<f64>,
    offset: &Vector3<f64>,
    variance: f64,
) -> Option<least_squares::Solution> {
    let mut design = DMatrix::zeros(points.len(), 9);
    let mut observed = DVector::zeros(points.len());
    let inverse = shape.try_inverse()?;
    let spread = inverse * inverse.transpose();
    for (row, v) in points.iter().enumerate() {
        let field = inverse * (v - offset);
        let h = field.norm();
        // h changes by -w.(dT field + dv0); w is also its gradient in v, so |w| sigma is its noise. Taken where the
        // point belongs, on the ellipsoid: with its own length in it, a point's noise would weight itself.
        let way = field / h;
        let w = inverse.transpose() * way;
        let lengthened = variance * (spread.trace() - way.dot(&(spread * way))) / (2.0 * h);
        let noise = w.norm();
        let gradient = nine_partials(&w, &way);
        for (k, value) in gradient.iter().enumerate() {
            design[(row, k)] = value / noise;
        }
        observed[row] = (h - lengthened - 1.0) / noise;
    }
    least_squares::solve(&design, &observed).ok()
}

/// What `w . (dT way + dv0)` takes of each element of `dT`, by rows of its lower triangle, and of `dv0`.
fn nine_partials(w: &Vector3<f64>, way: &Vector3<f64>) -> [f64; 9] {
    [
        w.x * way.x,
        w.y * way.x,
        w.y * way.y,
        w.z * way.x,
        w.z * way.y,
        w.z * way.z,
        w.x,
        w.y,
        w.z,
    ]
}

fn finish(
    points: &[Vector3<f64>],
    shape: Matrix3<f64>,
    offset: Vector3<f64>,
    step: &least_squares::Solution,
    centre: Vector3<f64>,
    size: f64,
    strength: f64,
) -> Ellipsoid {
    let units = DVector::from_fn(9, |k, _| if k < 6 { size / strength } else { size });
    let residual = |v: &Vector3<f64>| 1.0 - shape.solve_lower_triangular(&(v - offset)).unwrap_or_default().norm();
    let correlation =
        SMatrix::<f64, 9, 9>::from_fn(|row, column| step.covariance[(row, column)] * units[row] * units[column]);
    Ellipsoid {
        shape: shape * (size / strength),
        offset: offset * size + centre,
        residuals: points.iter().map(residual).collect(),
        covariance: correlation,
        scatter: step.scatter * size,
        freedom: step.freedom,
        condition: condition(points, &shape, &offset),
    }
}

fn condition(points: &[Vector3<f64>], shape: &Matrix3<f64>, offset: &Vector3<f64>) -> f64 {
    let row = |v: &Vector3<f64>| {
        let u = shape
            .solve_lower_triangular(&(v - offset))
            .unwrap_or_default()
            .normalize();
        nine_partials(&u, &u)
    };
    let rows: Vec<[f64; 9]> = points.iter().map(row).collect();
    Information::of(&DMatrix::from_fn(rows.len(), 9, |r, k| rows[r][k])).map_or(f64::INFINITY, |known| known.condition)
}

#[cfg(test)]
mod tests;
