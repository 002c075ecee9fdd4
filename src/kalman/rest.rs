//! The gyros' bias as rest shows it, and whether it is rest.
//!
//! In: a window in which little moved, and what the gyros read beyond the bias believed. Out: three scalars of the bias; after a
//! contradiction the bias forgotten, or not.
//!
//! A slow turn at a steady rate looks like rest to the gyros. Once the bias is known, such a window is refused by the gate, and
//! one of two is true: the bias is another, or the unit turns. Force and field tell. What stands in n turns in b with a
//! unit that turns, by `v x a` after the small angle `a`, and stays in b when the bias is another. So with `a` the rate beyond the
//! bias since the contradiction began, times the time since, and `v` the directions of force and field,
//!
//! ```text
//! turned = sum (v_now - v_then) . (v_then x a) / sum |v_then x a|^2        1: the unit turns; 0: the bias is another
//! ```
//!
//! is asked once the turn would be [`TELLS`] and [`Params::recovery_s`] have passed; below a half the bias is forgotten. Neither
//! force nor field shows a turn about itself: where there is only one of them, or both lie along the axis, the bias is forgotten
//! after [`Params::coast_s`], as nothing contradicts the gyros.
//!
//! [`Params::recovery_s`]: super::Params::recovery_s
//! [`Params::coast_s`]: super::Params::coast_s

use nalgebra::Vector3;

use super::{
    Filter, Quantity,
    compare::compare,
    innovation::{Noise, Scalar},
    square,
    state::Row,
};

/// \[rad\] a turn that force or field shows: five times what 0.05 m/s2 of an accelerometer's mean or 0.2 uT of the field move them.
const TELLS: f32 = 0.035;

/// Rest that contradicts the bias.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contradicted {
    /// \[s\] since the window in which it began.
    lasted_s: f32,
    /// Where force and field lay in b then.
    seen_b: [Vector3<f32>; 2],
}

impl Filter {
    /// At rest the gyros measure their own bias and the Earth's rate.
    pub(super) fn compare_rest(&mut self, bias_b: &Vector3<f32>) {
        if let Some(contradicted) = &self.contradicted {
            let angle_b = (bias_b - self.bias_b) * contradicted.lasted_s;
            let now_b = self.seen_b();
            let (mut turned, mut would) = (0.0, 0.0);
            for (then_b, now_b) in contradicted.seen_b.iter().zip(now_b) {
                let by_turn_b = then_b.cross(&angle_b);
                turned += (now_b - then_b).dot(&by_turn_b);
                would += by_turn_b.norm_squared();
            }
            let lasted_s = contradicted.lasted_s;
            let tells = lasted_s >= self.params.recovery_s && would >= square(TELLS);
            if tells || lasted_s >= self.params.coast_s {
                self.contradicted = None;
                if !(tells && turned > 0.5 * would) {
                    self.covariance.forget_bias(self.params.bias_sd);
                }
            }
        }
        let noise = Noise::white(square(self.params.rest.bias_sd) + self.measured.means.rate_variance);
        // One turn contradicts all three axes, though it be small about some: they are taken together or not at all.
        let known = self.covariance.bias();
        let gate = square(self.params.gate);
        let off_b = bias_b - self.bias_b;
        self.correction.usable = (0..3).all(|k| square(off_b[k]) <= gate * (known[(k, k)] + noise.alone));
        let mut accepted = true;
        for axis in 0..3 {
            let scalar = Scalar {
                quantity: Quantity::Bias,
                predicted: self.bias_b[axis],
                measured: bias_b[axis],
                row: Row::Driver(axis),
                noise,
            };
            let start = self.covariance.of_driver(axis);
            accepted &= compare(&mut self.pending, &mut self.correction, &scalar, &start);
        }
        self.correction.usable = true;
        let duration_s = self.measured.means.duration_s;
        self.contradicted = match self.contradicted {
            _ if accepted => None,
            Some(Contradicted { lasted_s, seen_b }) => Some(Contradicted {
                lasted_s: lasted_s + duration_s,
                seen_b,
            }),
            None => Some(Contradicted {
                lasted_s: duration_s,
                seen_b: self.seen_b(),
            }),
        };
    }

    /// Directions of the window's force and field in b, zero for a field that was not sampled.
    fn seen_b(&self) -> [Vector3<f32>; 2] {
        let acc_n = self.measured.means.acc_n;
        let mag_n = self.measured.field.map_or_else(Vector3::zeros, |field| field.mag_n);
        [acc_n, mag_n].map(|vector_n| {
            let vector_b = self.q_nb.inverse_transform_vector(&vector_n);
            vector_b.try_normalize(f32::MIN_POSITIVE).unwrap_or_default()
        })
    }
}

#[cfg(test)]
mod tests;
