//! The attitude on the way through a step, from what is known at its ends.
//!
//! An error of the gyros acts in the axes that the unit has at that instant. In a fifth of a second of fast turning they
//! move by a right angle, and if the turn's own axis moves too, an error taken off the increment as a whole is taken off
//! in a wrong direction: a hand's 390 deg/s with a known bias of 0.3 deg/s, at 5 Hz, ends 1.5 instead of 1.2 deg off. So
//! it is taken off by the mean attitude of the step, the bias Jacobian of a preintegrated rotation (C. Forster,
//! L. Carlone, F. Dellaert, D. Scaramuzza, "On-manifold preintegration for real-time visual-inertial odometry", IEEE
//! Trans. Robotics 33(1), 2017).
//!
//! In: the attitude at the beginning, the rotation vector, the gyros' rates at both ends. Out: the attitude at the end
//! and the mean matrix by Simpson's rule. Halfway the rotation is that of the cubic with these rates at its ends,
//! `phi/2 + T (rate_0 - phi'_1)/8`, where `phi' = rate + phi x rate/2 + phi x (phi x rate)/12` (J. E. Bortz, "A new
//! mathematical formulation for strapdown inertial navigation", IEEE Trans. AES 7(1), 1971).

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::square;
use crate::attitude::{dcm_nb, from_rotation_vector};

/// \[rad\] up to this turn both ends tell enough: the third order that they miss is below a thousandth.
const SHORT: f32 = 0.1;

/// Attitude at the end of a step, and the mean of `dcm_nb` over it. `rates_b` [rad/s] at its beginning and its end,
/// where both are known.
pub(super) fn through(
    q_nb: &UnitQuaternion<f32>,
    angle_b: &Vector3<f32>,
    rates_b: Option<[Vector3<f32>; 2]>,
    covered_s: f32,
) -> (UnitQuaternion<f32>, Matrix3<f32>) {
    let ended_nb = q_nb * from_rotation_vector(*angle_b);
    let ends = dcm_nb(q_nb) + dcm_nb(&ended_nb);
    if angle_b.norm_squared() < square(SHORT) {
        return (ended_nb, ends * 0.5);
    }
    let bent_b = rates_b.map_or(Vector3::zeros(), |[began_b, ended_b]| {
        let swept_b = angle_b.cross(&ended_b);
        let grows_b = ended_b + swept_b / 2.0 + angle_b.cross(&swept_b) / 12.0;
        (began_b - grows_b) * (covered_s / 8.0)
    });
    let middle_nb = q_nb * from_rotation_vector(angle_b * 0.5 + bent_b);
    (ended_nb, (ends + dcm_nb(&middle_nb) * 4.0) / 6.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::ComplexField;

    use super::*;

    /// \[s\] as long as the unit's cycle.
    const STEP_S: f32 = 0.2;

    /// [rad/s] 6 rad/s about an axis that swings by half a radian at 1 Hz, as a hand turns a box.
    fn rate_b(t_s: f32) -> Vector3<f32> {
        let (sin, cos) = ComplexField::sin_cos(core::f32::consts::TAU * t_s);
        Vector3::new(3.0 * sin, 6.0, 3.0 * cos)
    }

    /// Attitude and mean matrix over a step from `from_s`, integrated finely.
    fn finely(from_s: f32) -> (UnitQuaternion<f32>, Matrix3<f32>) {
        const PARTS: usize = 400;
        let dt_s = STEP_S / PARTS as f32;
        let (mut q, mut sum) = (UnitQuaternion::identity(), Matrix3::zeros());
        for part in 0..PARTS {
            let turn = from_rotation_vector(rate_b(from_s + (part as f32 + 0.5) * dt_s) * dt_s);
            sum += (dcm_nb(&q) + dcm_nb(&(q * turn))) * 0.5;
            q *= turn;
        }
        (q, sum / PARTS as f32)
    }

    fn worst(known: bool) -> f32 {
        (0..10).fold(0.0, |worst: f32, step| {
            let from_s = step as f32 * 0.1;
            let (q, mean) = finely(from_s);
            let rates_b = known.then(|| [rate_b(from_s), rate_b(from_s + STEP_S)]);
            let (ended, found) = through(&UnitQuaternion::identity(), &q.scaled_axis(), rates_b, STEP_S);
            assert!(ended.angle_to(&q) < 1e-3);
            worst.max((found - mean).norm())
        })
    }

    #[test]
    fn the_mean_of_a_bending_turn_is_found_with_the_rates_and_missed_without() {
        assert!(worst(true) < 0.01, "{}", worst(true));
        assert!(worst(false) > 5.0 * worst(true), "{}", worst(false));
    }

    /// The cubic that has the turn and both its rates at the ends, in f64: its rotation halfway by Hermite's formula.
    #[test]
    fn halfway_the_turn_is_that_of_the_cubic() {
        let mut draws = crate::draws::Draws::of(1);
        for _ in 0..50 {
            let q = draws.attitude();
            let (angle_b, rates_b) = (
                draws.vector(1.5) + Vector3::new(0.2, 0.0, 0.0),
                [draws.vector(6.0), draws.vector(6.0)],
            );
            let (ended, found) = through(&q, &angle_b, Some(rates_b), STEP_S);
            let phi = angle_b.cast::<f64>();
            let [began, ends] = rates_b.map(|rate_b| rate_b.cast::<f64>());
            // Bortz: how the rotation vector grows at the rate of the end.
            let grows = ends + phi.cross(&ends) * 0.5 + phi.cross(&phi.cross(&ends)) / 12.0;
            let half = phi * 0.5 + (began - grows) * (f64::from(STEP_S) / 8.0);
            let at = |turn: Vector3<f64>| {
                (q.cast::<f64>() * UnitQuaternion::from_scaled_axis(turn))
                    .to_rotation_matrix()
                    .into_inner()
            };
            let expected = (at(Vector3::zeros()) + at(half) * 4.0 + at(phi)) / 6.0;
            assert!((found.cast::<f64>() - expected).norm() < 1e-5);
            assert!((dcm_nb(&ended).cast::<f64>() - at(phi)).norm() < 1e-5);
        }
    }

    #[test]
    fn a_short_turn_has_the_mean_of_its_ends() {
        let angle_b = Vector3::new(0.0, 0.0, 0.09);
        let (_, mean) = through(&UnitQuaternion::identity(), &angle_b, None, STEP_S);
        let (_, longer) = through(&UnitQuaternion::identity(), &(angle_b * 1.2), None, STEP_S);
        // (1 + cos(0.09))/2 and sin(0.108)/0.108 on the diagonal.
        assert!((mean[(0, 0)] - 0.997_976).abs() < 1e-5);
        assert!((longer[(0, 0)] - 0.998_06).abs() < 1e-5);
    }
}
