//! What of the gyros' noise lasts in the attitude, in f64: the densities on either side of the spin, and the whole congruence.

use emems::calibration::Set;
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector3};

use super::{ACROSS, N, Spin, square};

/// Densities on either side of the spin.
pub(super) struct Lasting {
    corner: f64,
    turned: f64,
    passed: [[[f64; 2]; 2]; 2],
    density: [f64; 2],
    heard: f64,
    pub(super) told: f64,
    pub(super) told_s: f64,
}

impl Lasting {
    /// Nothing was heard.
    pub(super) const NONE: Self = Lasting {
        corner: 8.0,
        turned: 0.0,
        passed: [[[0.0; 2]; 2]; 2],
        density: [1.0; 2],
        heard: 1.0,
        told: 0.0,
        told_s: 0.0,
    };

    pub(super) fn hear(&mut self, off: f64, spin: f64, phase: f64, lasts_s: f64) {
        self.turned += self.corner * lasts_s;
        let width = self.corner * lasts_s / 6.0;
        self.heard = (self.heard + width).min(1.5);
        let mut squares = [0.0; 2];
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            let (sin, cos) = (phase + sign * self.turned).sin_cos();
            for (part, turned) in [cos, sin].into_iter().enumerate() {
                let [first, second] = [0, 1].map(|pole| self.passed[side][pole][part]);
                let first = first + off * width.sqrt() * turned - width * first;
                let second = second + width * (first - second);
                self.passed[side][0][part] = first;
                self.passed[side][1][part] = second;
                squares[side] += 4.0 * second * second;
            }
        }
        let (above, below) = if spin > 0.0 { (0, 1) } else { (1, 0) };
        if spin.abs() < (1.0 + 7.3 / 6.0) * self.corner {
            squares[below] = squares[above];
            self.passed[below] = self.passed[above];
        }
        for (density, square) in self.density.iter_mut().zip(squares) {
            *density += width / self.heard * (square - *density);
        }
    }
}

/// The gyro that sees least of the spin.
pub(super) fn least_along(set: &Set) -> usize {
    let along = |k: &usize| set.gyro[*k].axis_b.x.abs();
    (0..4).min_by(|a, b| along(a).total_cmp(&along(b))).unwrap_or_default()
}

impl Spin {
    pub(super) fn give_back(&mut self, set: &Set) {
        let told = std::mem::take(&mut self.lasting.told);
        let lasted_s = std::mem::take(&mut self.lasting.told_s);
        if told == 0.0 || lasted_s == 0.0 {
            return;
        }
        let density = lasted_s / told;
        self.lasting.corner = (0.2 / density.sqrt()).sqrt();
        let part = (2.0 * (self.lasting.density[0] * self.lasting.density[1]).sqrt()).min(1.0);
        let sampled = 0.5 * square(set.gyro[least_along(set)].noise.into());
        let lasts = (part * self.rough).max(sampled);
        if lasts >= self.rough {
            return;
        }
        let nose_n = self.nose_n();
        let field_n: Vector3<f64> = self.start.surroundings.field_n_ut.cast().normalize();
        let across = 1.0 - square(nose_n.dot(&field_n));
        let back = (1.0 - lasts / self.rough) * density * lasted_s * across;
        let of_rate: Matrix2<f64> = self.p.fixed_view::<2, 2>(ACROSS, ACROSS).into_owned();
        let both = self.p.fixed_view::<3, 2>(0, ACROSS).into_owned();
        let by_rate = both * of_rate.try_inverse().expect("rates are not known for sure");
        let given = self.p.fixed_view::<3, 3>(0, 0) - by_rate * both.transpose();
        // The whole congruence.
        let seen_n = given.try_inverse().expect("attitude is not known for sure") * field_n;
        let variance = 1.0 / field_n.dot(&seen_n);
        let given_back = back.min(variance - back / (self.lasting.corner * lasted_s));
        if given_back <= 0.0 {
            return;
        }
        let less = field_n * seen_n.transpose() * (variance * (1.0 - (1.0 - given_back / variance).sqrt()));
        let mut s = SMatrix::<f64, N, N>::identity();
        s.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() - less));
        s.fixed_view_mut::<3, 2>(0, ACROSS).copy_from(&(less * by_rate));
        self.p = s * self.p * s.transpose();
    }
}
