//! What of the gyros' noise lasts in the attitude.
//!
//! The filter takes what the gyros' residuals show for white. The attitude is the integral of the rate, and has of a noise in the
//! long run only what lies where the rate's own zero is: at the frequency of the spin, because the rate across it turns with b.
//! Vibration lies above it: of a large rocket's 0.75 deg/s at 50 Hz a twentieth lasts.
//!
//! In: residuals of one gyro over what was expected of them. Out: which part of their noise lasts, `c`, and what of the attitude's
//! covariance is to be given back.
//!
//! **Which part.** The residuals, turned by the angle spun and by `w t` beside it to either side, pass two low-passes. Their mean
//! square says the noise's density there, 1 where all is white. `w` is the filter's own corner: what follows a rate of
//! density `R` whose derivative walks by `q` has `H = (sqrt(2) w s + w^2) / (s^2 + sqrt(2) w s + w^2)`, `w = sqrt(q / sqrt(R))`,
//! and leaves `|1 - H|^2 = 1/2` of a noise there; nearer to the spin it has taken the noise for the rate. Between both sides the
//! logarithm of a density is taken for straight, so that `c = 2 sqrt(a b)`. Motion only adds to it; more than white is not said.
//!
//! **What is given back.** In a packet's time `T` the filter adds `R T` to the attitude's variance across the spin, where `c R T` is
//! right. The field sees two directions in every packet. What is left there is no noise of the gyros, but what is constant: the
//! field's error, iron. About the field, along `m`, nothing is seen, and `D = (1 - c) R T (1 - (x.m)^2)` is too much. Noise that does not
//! last still moves the attitude for a time of `1/w`, so that of the variance `v` about the field `D / (w T)` stays:
//! `d = min(D, v - D / (w T))`. With `v = 1 / (m' P^-1 m)` and `S = 1 - (1 - sqrt(1 - d/v)) v m m' P^-1`, `S P S' = P - d m m'`, a
//! covariance as long as `d < v`. `P` is here that of the attitude given the rate across: the rate's noise of this moment is all there,
//! and what the two have in common does not change.

use nalgebra::{ComplexField, Matrix3, Vector3};

use super::{
    Spin,
    covariance::{ACROSS, ATTITUDE},
    motion::ACROSS_WALK,
};
use crate::{
    attitude::{dcm_nb, sin_cos},
    calibration::Set,
};

/// Of the corner, the width of a low-pass: what lies at the spin itself, which the filter took for the rate, passes two of them
/// by a thousandth.
const WIDTH: f32 = 1.0 / 6.0;
/// Of the corner, how fast the spin must be for the side below it to be clear of what is constant in b. Beside `n` widths, two low-passes
/// leave of a constant as large as the noise a density of `8 / (width dt (1 + n^2)^2)`: with a corner of 8 rad/s and slices of 20 ms, a
/// tenth of white noise at 7.3.
const CLEAR: f32 = 1.0 + 7.3 * WIDTH;
/// Of how many times `1/width` a density is the mean: at a corner of 9 rad/s a second, as the noise itself.
const REMEMBERED: f32 = 1.5;
/// [rad/s] the corner before the gyros were heard: that of 1 deg/s.
const BEGINS_AT: f32 = 8.0;

/// What the residuals showed.
#[derive(Clone, Copy, Debug)]
pub struct Lasting {
    /// The gyro that is heard: the one that sees least of the spin.
    pub gyro: usize,
    /// [rad/s] the filter's corner, and \[rad\] how far it turned.
    corner: f32,
    turned: f32,
    /// Two low-passes of the residuals on either side, as complex numbers.
    passed: [[[f32; 2]; 2]; 2],
    /// \[1\] their densities, where 1 is white, and how much was heard of them.
    density: [f32; 2],
    heard: f32,
    /// [s2/rad2] what the gyros told of a component of the rate across since the latest packet, and \[s\] for how long.
    told: f32,
    told_s: f32,
    /// [rad2/s2] variance of a slice of the gyro that is heard by its samples' noise, which is white.
    pub sampled: f32,
}

impl Lasting {
    /// Nothing was heard, all lasts.
    pub fn new(set: &Set) -> Self {
        let (mut gyro, mut least) = (0, f32::MAX);
        for (k, axis) in set.gyro.iter().enumerate() {
            let along = axis.axis_b.x.abs();
            if along < least {
                (gyro, least) = (k, along);
            }
        }
        Lasting {
            gyro,
            corner: BEGINS_AT,
            turned: 0.0,
            passed: [[[0.0; 2]; 2]; 2],
            density: [1.0; 2],
            heard: 1.0,
            told: 0.0,
            told_s: 0.0,
            sampled: f32::MAX,
        }
    }

    /// A residual of the gyro that is heard, in standard deviations, from a slice at this angle spun.
    pub fn hear(&mut self, off: f32, spin: f32, phase: f32, lasts_s: f32) {
        self.turned += self.corner * lasts_s;
        if self.turned > core::f32::consts::TAU {
            self.turned -= core::f32::consts::TAU;
        }
        let width = WIDTH * self.corner * lasts_s;
        self.heard = (self.heard + width).min(REMEMBERED);
        let part = width / self.heard;
        // By its root, what stands in the low-passes is right for every width: that of white noise is 1/4.
        let off = off * ComplexField::sqrt(width);
        let mut squares = [0.0; 2];
        for ((square, passed), turned) in squares
            .iter_mut()
            .zip(&mut self.passed)
            .zip([self.turned, -self.turned])
        {
            let (sin, cos) = sin_cos(phase + turned);
            let [first, second] = passed;
            for ((first, second), off) in first.iter_mut().zip(second).zip([off * cos, off * sin]) {
                *first += off - width * *first;
                *second += width * (*first - *second);
                *square += 4.0 * *second * *second;
            }
        }
        let [above, below] = if spin > 0.0 { [0, 1] } else { [1, 0] };
        // What is constant in b, a bias or a false rate, is no noise; nor is what it would leave in the low-passes.
        if spin.abs() < CLEAR * self.corner {
            squares[below] = squares[above];
            self.passed[below] = self.passed[above];
        }
        for (density, square) in self.density.iter_mut().zip(squares) {
            *density += part * (square - *density);
        }
    }

    /// A gyro told of a component of the rate across with this weight.
    pub fn tell(&mut self, weight: f32) {
        self.told += weight;
    }

    /// A slice lasted so long.
    pub fn last(&mut self, lasts_s: f32) {
        self.told_s += lasts_s;
    }

    /// Which part of the noise lasts.
    fn part(&self) -> f32 {
        (2.0 * ComplexField::sqrt(self.density[0] * self.density[1])).min(1.0)
    }
}

impl Spin {
    /// After a packet: what of the gyros' noise was counted and does not last.
    #[inline(never)]
    pub(super) fn give_back(&mut self) {
        let lasting = &mut self.lasting;
        let told = core::mem::take(&mut lasting.told);
        let lasted_s = core::mem::take(&mut lasting.told_s);
        if !(told > 0.0 && lasted_s > 0.0) {
            return;
        }
        // Over the packet, each gyro's variance and weight in it.
        let density = lasted_s / told;
        lasting.corner = ComplexField::sqrt(ACROSS_WALK / ComplexField::sqrt(density));
        let lasts = (lasting.part() * self.rough).max(lasting.sampled);
        if lasts >= self.rough {
            return;
        }
        let nose_n = dcm_nb(&self.q_nb).column(0).into_owned();
        let along_n = self.surroundings.field_n_ut.normalize();
        let across = along_n.cross(&nose_n).norm_squared();
        let too_much = (1.0 - lasts / self.rough) * density * lasted_s * across;
        let slow = 1.0 / (lasting.corner * lasted_s);
        let of_rate = self.covariance.block::<2, 2>(ACROSS, ACROSS);
        let both = self.covariance.block::<3, 2>(ATTITUDE, ACROSS);
        let Some(inverse) = of_rate.try_inverse() else {
            return;
        };
        let by_rate = both * inverse;
        let given_rate = self.covariance.block::<3, 3>(ATTITUDE, ATTITUDE) - by_rate * both.transpose();
        if let Some(less) = less(&given_rate, &along_n, too_much, slow) {
            self.covariance.lessen_attitude(&less, &by_rate);
        }
    }
}

/// `1 - S` for a covariance of which so much is given back along a direction, but for `slow` of it. `None` where all of it stays.
fn less(of: &Matrix3<f32>, along_n: &Vector3<f32>, too_much: f32, slow: f32) -> Option<Matrix3<f32>> {
    let seen_n = of.try_inverse()? * along_n;
    let variance = 1.0 / along_n.dot(&seen_n);
    let given_back = (variance - slow * too_much).min(too_much);
    // Not greater, so that NaN is refused too.
    let leaves = given_back > 0.0 && given_back < variance;
    let part = 1.0 - ComplexField::sqrt(1.0 - given_back / variance);
    leaves.then(|| along_n * seen_n.transpose() * (part * variance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        calibration::Ranges,
        spin::covariance::{Covariance, STATES},
        unit::Settings,
    };
    use nalgebra::SMatrix;

    /// Uniform numbers of variance one.
    fn uniform(random: &mut u32) -> f32 {
        *random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((*random >> 8) as f32 / (1 << 24) as f32 - 0.5) * f32::sqrt(12.0)
    }

    /// Mean part over a minute of residuals at this spin.
    fn part(spin: f32, mut residual: impl FnMut(&mut u32) -> f32) -> f32 {
        let mut lasting = Lasting::new(&Set::nominal(Ranges::of(&Settings::NOMINAL)));
        let (mut random, mut sum) = (1, 0.0);
        for k in 0..3000 {
            let phase = (spin * 0.02 * k as f32) % core::f32::consts::TAU;
            lasting.hear(residual(&mut random), spin, phase, 0.02);
            sum += lasting.part();
        }
        sum / 3000.0
    }

    /// The residual's density at three turns a second beside that of the same power in white. Twice, as the filter is taken to leave
    /// half of what is there.
    #[test]
    fn white_noise_lasts_and_a_shaken_angle_does_not() {
        for spin in [18.85, -18.85] {
            let white = part(spin, uniform);
            assert!(white > 0.9, "{white}");
            // A bounded angle, differenced: 1 - cos(w dt) is 0.02 to 0.14 at the two sides.
            let mut before = 0.0;
            let shaken = part(spin, |random| {
                let angle = uniform(random) * f32::sqrt(0.5);
                angle - core::mem::replace(&mut before, angle)
            });
            assert!((0.05..0.2).contains(&shaken), "{shaken}");
        }
    }

    #[test]
    fn what_is_constant_in_b_is_no_noise_near_the_spin() {
        // The side below the spin is at a tenth of a turn a second.
        let constant = part(BEGINS_AT + 0.6, |_| 1.0);
        assert!(constant < 0.1, "{constant}");
    }

    /// Densities after a minute of a constant at this spin and a slice of nothing at another.
    fn of_constant(spin: f32, then: f32) -> [f32; 2] {
        let mut lasting = Lasting::new(&Set::nominal(Ranges::of(&Settings::NOMINAL)));
        for k in 0..3000 {
            let phase = (spin * 0.02 * k as f32) % core::f32::consts::TAU;
            lasting.hear(1.0, spin, phase, 0.02);
        }
        lasting.hear(0.0, then, 0.0, 0.02);
        lasting.density.map(|density| 2.0 * density)
    }

    #[test]
    fn what_is_constant_in_b_is_a_tenth_of_white_noise_where_the_side_below_is_heard() {
        let clear = BEGINS_AT * CLEAR + 0.01;
        let [_, below] = of_constant(clear, clear);
        assert!((0.07..0.12).contains(&below), "{below}");
    }

    #[test]
    fn a_side_that_is_heard_again_has_nothing_of_what_was_not_heard() {
        let [above, below] = of_constant(BEGINS_AT + 1.0, 2.0 * BEGINS_AT * CLEAR);
        assert!((above - below).abs() < 0.01, "{above} {below}");
    }

    /// What is given back is taken off along its direction, and nowhere else; of a variance that is as small as what noise moves for a
    /// time nothing is.
    #[test]
    fn what_is_given_back_is_taken_off_along_its_direction() {
        let root = Matrix3::new(0.5, -0.2, 0.1, 0.3, 0.8, -0.4, 0.1, 0.2, 0.6);
        let of = root * root.transpose();
        let along_n = Vector3::new(0.6, -0.3, 0.74).normalize();
        let variance = 1.0 / along_n.dot(&(of.try_inverse().expect("inverse") * along_n));
        let back = 0.3 * variance;
        let s = Matrix3::identity() - less(&of, &along_n, back, 0.5).expect("something");
        let left = s * of * s.transpose() - (of - along_n * along_n.transpose() * back);
        assert!(left.norm() < 1e-6, "{left}");
        assert_eq!(less(&of, &along_n, variance, 1.1), None);
    }

    /// What the attitude has in common with the rate is the same afterwards, and no variance is more.
    #[test]
    fn what_is_given_back_leaves_a_covariance() {
        let mut random = 7;
        let root = SMatrix::<f32, STATES, STATES>::from_fn(|_, _| uniform(&mut random));
        let mut covariance = Covariance::of(&[0.0; STATES]);
        let p = root * root.transpose();
        covariance.set(&p);
        let by_rate = covariance.block::<3, 2>(ATTITUDE, ACROSS)
            * covariance.block::<2, 2>(ACROSS, ACROSS).try_inverse().expect("inverse");
        let both = covariance.block::<3, 2>(ATTITUDE, ACROSS);
        let given = covariance.block::<3, 3>(ATTITUDE, ATTITUDE) - by_rate * both.transpose();
        for size in [0.01, 1.0, 100.0] {
            let mut covariance = covariance.clone();
            let less = Matrix3::identity() * size * given.try_inverse().expect("inverse");
            let less = less * (Matrix3::identity() + less).try_inverse().expect("inverse");
            covariance.lessen_attitude(&(less * 0.5), &by_rate);
            let moved = covariance.block::<3, 2>(ATTITUDE, ACROSS) - both;
            assert!(moved.norm() < 1e-3 * both.norm(), "{moved}");
            let after = covariance.block::<STATES, STATES>(0, 0).cast::<f64>();
            let after = (after + after.transpose()) * 0.5;
            assert!(after.symmetric_eigenvalues().min() > -1e-3, "{size}");
            let taken = covariance.block::<3, 3>(ATTITUDE, ATTITUDE) - covariance_of(&p);
            assert!(taken.symmetric_eigenvalues().max() < 1e-3, "{taken}");
        }
    }

    fn covariance_of(p: &SMatrix<f32, STATES, STATES>) -> Matrix3<f32> {
        p.fixed_view::<3, 3>(0, 0).into_owned()
    }
}
