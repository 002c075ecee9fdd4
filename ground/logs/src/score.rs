//! How far an attitude is from a reference: total, heading, inclination.
//!
//! With `e = q_est conj(q_ref)`, the error as a rotation in n: total `2 acos|w|`, heading `2 atan|z/w|`, inclination
//! `2 acos sqrt(w^2 + z^2)` (D. Laidig, M. Caruso, A. Cereatti, T. Seel, "BROAD", Data 6(7), 2021), all through arc
//! tangents, which keep small angles. Root mean squares in degrees.

use nalgebra::UnitQuaternion;

/// Root mean square errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rmse {
    /// \[deg\] of the whole error.
    pub total_deg: f64,
    /// \[deg\] of the turn about the vertical.
    pub heading_deg: f64,
    /// \[deg\] of the tilt.
    pub inclination_deg: f64,
}

/// Errors so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Score {
    squares: [f64; 3],
    count: f64,
}

/// \[rad\] total, heading and inclination of an error.
pub fn angles(estimate_nb: &UnitQuaternion<f64>, reference_nb: &UnitQuaternion<f64>) -> [f64; 3] {
    let e = estimate_nb * reference_nb.inverse();
    let tilt = e.i.hypot(e.j);
    [
        2.0 * e.imag().norm().atan2(e.w.abs()),
        2.0 * e.k.abs().atan2(e.w.abs()),
        2.0 * tilt.atan2(e.w.hypot(e.k)),
    ]
}

impl Score {
    /// Counts an error.
    pub fn add(&mut self, estimate_nb: &UnitQuaternion<f64>, reference_nb: &UnitQuaternion<f64>) {
        for (square, angle) in self.squares.iter_mut().zip(angles(estimate_nb, reference_nb)) {
            *square += angle * angle;
        }
        self.count += 1.0;
    }

    /// `None` if nothing was counted.
    pub fn rmse(&self) -> Option<Rmse> {
        let rms = |axis: usize| (self.squares[axis] / self.count).sqrt().to_degrees();
        (self.count > 0.0).then(|| Rmse {
            total_deg: rms(0),
            heading_deg: rms(1),
            inclination_deg: rms(2),
        })
    }
}

/// The mean of several.
pub fn mean(all: &[Rmse]) -> Rmse {
    let of = |part: fn(&Rmse) -> f64| all.iter().map(part).sum::<f64>() / all.len() as f64;
    Rmse {
        total_deg: of(|rmse| rmse.total_deg),
        heading_deg: of(|rmse| rmse.heading_deg),
        inclination_deg: of(|rmse| rmse.inclination_deg),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn a_turn_about_down_is_heading_and_a_tilt_is_inclination() {
        let reference = UnitQuaternion::from_euler_angles(0.3, -0.2, 2.0);
        let check = |axis: Vector3<f64>, expected: [f64; 3]| {
            let off = UnitQuaternion::from_scaled_axis(axis * 0.1) * reference;
            for (found, expected) in angles(&off, &reference).into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{found} is not {expected}");
            }
        };
        check(Vector3::z(), [0.1, 0.1, 0.0]);
        check(Vector3::x(), [0.1, 0.0, 0.1]);
    }

    #[test]
    fn nothing_counted_is_no_error_and_not_zero() {
        assert_eq!(Score::default().rmse(), None);
    }
}
