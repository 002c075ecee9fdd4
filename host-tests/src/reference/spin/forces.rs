//! What the accelerometers say of the rate, in f64: equations free of the force, by the null space of the axes.

use emems::calibration::Set;
use nalgebra::{DMatrix, DVector, SVector, Vector3};

use super::{ACROSS, ACROSS_UP, GATE, LEVER, N, SPIN, SPIN_UP, Spin, axis_b, square};

impl Spin {
    /// Residuals and rows of the equations of force, white with variance one, and the force.
    fn equations(
        &self,
        set: &Set,
        along: &[Option<f64>; 12],
        more: f64,
    ) -> (Vec<(f64, SVector<f64, N>)>, Vector3<f64>) {
        let rate_b = self.rate_b();
        let x = Vector3::x();
        let turned = |axis: &Vector3<f64>| axis.cross(&x);
        let dot_b = x * self.spin_up + self.turning_b(self.across_up) + turned(&rate_b) * self.spin;
        let [y_b, z_b] = self.across_b();
        let largest = along
            .iter()
            .flatten()
            .fold(0.0_f64, |largest, along| largest.max(along.abs()));
        let [of_acc, ..] = set.uncertainty;
        let used: Vec<usize> = (0..12).filter(|k| along[*k].is_some()).collect();
        let mut axes = DMatrix::<f64>::zeros(used.len(), 3);
        let mut residuals = DVector::<f64>::zeros(used.len());
        let mut rows = DMatrix::<f64>::zeros(used.len(), N);
        for (row, k) in used.iter().enumerate() {
            let axis = &set.acc[*k];
            let along = along[*k].unwrap_or_default();
            let n_b = axis_b(axis);
            let variance = square(axis.noise.into())
                + square(0.02)
                + square(f64::from(of_acc.scale) * along)
                + square(f64::from(of_acc.direction) * largest)
                + more;
            let by_sd = 1.0 / variance.sqrt();
            let place_b: Vector3<f64> = set.place_b[k / 3].cast();
            let far_b = place_b * (1.0 + self.lever);
            // Derivative of `w' x r + w x (w x r)`, where an axis across the spin turns with b.
            let by_rate = |axis: &Vector3<f64>, dot: &Vector3<f64>| {
                dot.cross(&far_b) + axis.cross(&rate_b.cross(&far_b)) + rate_b.cross(&axis.cross(&far_b))
            };
            let felt = |place_b: &Vector3<f64>| dot_b.cross(place_b) + rate_b.cross(&rate_b.cross(place_b));
            let seen = [
                (SPIN, by_rate(&x, &turned(&rate_b))),
                (SPIN_UP, x.cross(&far_b)),
                (ACROSS, by_rate(&y_b, &(turned(&y_b) * self.spin))),
                (ACROSS + 1, by_rate(&z_b, &(turned(&z_b) * self.spin))),
                (ACROSS_UP, y_b.cross(&far_b)),
                (ACROSS_UP + 1, z_b.cross(&far_b)),
                (LEVER, felt(&place_b)),
            ];
            for (state, seen_b) in seen {
                rows[(row, state)] = n_b.dot(&seen_b) * by_sd;
            }
            residuals[row] = (along - n_b.dot(&felt(&far_b))) * by_sd;
            axes.row_mut(row).copy_from(&(n_b.transpose() * by_sd));
        }
        let inverse = (axes.transpose() * &axes).try_inverse().expect("axes span space");
        let force = &inverse * axes.transpose() * &residuals;
        let beside = DMatrix::identity(used.len(), used.len()) - &axes * &inverse * axes.transpose();
        let eigen = beside.symmetric_eigen();
        let free = (0..used.len()).filter(|k| eigen.eigenvalues[*k] > 0.5);
        let equation = |k: usize| {
            let by = eigen.eigenvectors.column(k);
            let row = rows.tr_mul(&by);
            (
                by.dot(&residuals),
                SVector::<f64, N>::from_iterator(row.iter().copied()),
            )
        };
        (free.map(equation).collect(), Vector3::new(force[0], force[1], force[2]))
    }

    pub(super) fn take_force(&mut self, set: &Set, acc_p: &[[i16; 3]; 4]) {
        let counts = acc_p.as_flattened();
        let codes = emems::sensor::lis331hh::CODES;
        let along = std::array::from_fn(|k| {
            let within = counts[k] > *codes.start() && counts[k] < *codes.end();
            within.then(|| f64::from(set.acc[k].value(counts[k], 0.0)))
        });
        let mut more = square(4.0 * 0.006 * self.spin * self.spin_up * 0.045);
        let (_, force_b) = self.equations(set, &along, more);
        if let Some((before_us, before_b)) = self.force.replace((self.at_us, force_b)) {
            let change_b = force_b - before_b;
            let dt_s = (self.at_us - before_us) as f64 * 1e-6;
            let bend_b = change_b - self.changed_b.replace(change_b).unwrap_or(change_b);
            self.shaken += (bend_b.norm_squared() / 18.0 - self.shaken) / 2.0;
            more += square(0.006 * change_b.norm() / dt_s) + 0.55 * self.shaken;
        }
        let (equations, _) = self.equations(set, &along, more);
        let scale = self.usual.max(1.0);
        let off = |of: &Self| {
            let each = equations.iter().map(|(residual, h)| {
                let (of_state, left) = of.look(h, *residual);
                left * left / (of_state + scale)
            });
            each.sum::<f64>() / equations.len() as f64
        };
        let mean = off(self);
        let surprising = if self.seen { f64::MAX } else { 4.0 };
        self.usual += (scale * mean.min(4.0) - self.usual) / 20.0;
        if mean > surprising && self.surprised_s <= 0.0 {
            self.surprised_s = 0.6;
            self.p[(SPIN_UP, SPIN_UP)] += 360.0;
            self.p[(SPIN, SPIN)] += 1.44;
            if off(self) > surprising {
                for axis in 0..2 {
                    self.p[(ACROSS_UP + axis, ACROSS_UP + axis)] += 1.0;
                    self.p[(ACROSS + axis, ACROSS + axis)] += 0.0025;
                }
            }
        }
        let scale = scale * off(self).max(1.0);
        for (residual, h) in &equations {
            self.update(h, *residual, scale, GATE);
        }
    }
}
