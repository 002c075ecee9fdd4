//! Which power law a record follows at one averaging time.
//!
//! In: the angle at that averaging time. Out: [`PowerLaw`], the exponent `alpha` of the rate's spectrum `f^alpha`. The
//! lag-1 autocorrelation `r1` of the angle, differenced until it is stationary, tells it: `alpha = -2 (rho + d) + 2`
//! with `rho = r1 / (1 + r1)` after `d` differences (Riley and Greenhall, "Power law noise identification using the
//! lag 1 autocorrelation", 2004). Fewer than [`LEAST_POINTS`] points say nothing: none.

/// Shortest angle that identifies a noise (Riley and Greenhall).
const LEAST_POINTS: usize = 30;

/// Exponent of the rate's power spectrum, named for the angle's noise as in the clock literature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PowerLaw {
    /// `f^2`: white noise in angle, for a gyro quantisation.
    WhiteAngle,
    /// `f^1`.
    FlickerAngle,
    /// `f^0`: angle random walk.
    WhiteRate,
    /// `f^-1`: bias instability.
    FlickerRate,
    /// `f^-2`: rate random walk.
    RateWalk,
    /// `f^-3`; only the Hadamard variance converges.
    FlickerWalk,
    /// `f^-4`; only the Hadamard variance converges.
    RateRun,
}

impl PowerLaw {
    const ALL: [Self; 7] = [
        Self::WhiteAngle,
        Self::FlickerAngle,
        Self::WhiteRate,
        Self::FlickerRate,
        Self::RateWalk,
        Self::FlickerWalk,
        Self::RateRun,
    ];

    /// The exponent.
    pub const fn alpha(self) -> i32 {
        2 - self as i32
    }

    /// What a gyro's data sheet calls it.
    pub const fn name(self) -> &'static str {
        [
            "quantisation",
            "flicker angle",
            "angle random walk",
            "bias instability",
            "rate random walk",
            "flicker walk",
            "rate run",
        ][self as usize]
    }

    /// The power law of `angle` at averaging factor `m`; `most_differences` is 2 for Allan's variances and 3 for
    /// Hadamard's.
    pub fn identify(angle: &[f64], m: usize, most_differences: usize) -> Option<Self> {
        let mut points: Vec<f64> = angle.iter().step_by(m.max(1)).copied().collect();
        if points.len() < LEAST_POINTS {
            return None;
        }
        remove_parabola(&mut points);
        for differences in 0..=most_differences {
            let r1 = lag1(&points)?;
            let rho = r1 / (1.0 + r1);
            if rho < 0.25 || differences == most_differences {
                let steps = (2.0 * rho).round() as i32 + 2 * differences as i32;
                let least = if most_differences > 2 { 6 } else { 4 };
                return Some(Self::ALL[steps.clamp(0, least) as usize]);
            }
            points = points.windows(2).map(|pair| pair[1] - pair[0]).collect();
        }
        None
    }
}

/// Takes out a constant rate and a ramp, which would pass for the slowest noise.
fn remove_parabola(points: &mut [f64]) {
    // Orthogonal over the grid: 1, u, u^2 - mean, with u from -1 to 1.
    let last = (points.len() - 1) as f64;
    let u = |k: usize| 2.0 * k as f64 / last - 1.0;
    let mean_u2 = (0..points.len()).map(|k| u(k) * u(k)).sum::<f64>() / points.len() as f64;
    let shapes: [&dyn Fn(usize) -> f64; 3] = [&|_| 1.0, &u, &|k| u(k) * u(k) - mean_u2];
    for shape in shapes {
        let (mut along, mut norm) = (0.0, 0.0);
        for (k, point) in points.iter().enumerate() {
            along += point * shape(k);
            norm += shape(k) * shape(k);
        }
        for (k, point) in points.iter_mut().enumerate() {
            *point -= along / norm * shape(k);
        }
    }
}

/// Lag-1 autocorrelation; none for points that do not vary.
fn lag1(points: &[f64]) -> Option<f64> {
    let mean = points.iter().sum::<f64>() / points.len() as f64;
    let power: f64 = points.iter().map(|value| (value - mean).powi(2)).sum();
    let lagged: f64 = points.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum();
    (power > 0.0).then(|| lagged / power)
}

#[cfg(test)]
mod tests {
    use super::{super::simulate::Noise, *};

    fn check(noise: &Noise, expected: PowerLaw) {
        let mut angle = vec![0.0];
        for (k, rate) in noise.rate(20_000, 1.0, 7).iter().enumerate() {
            angle.push(angle[k] + rate);
        }
        for m in [1, 8, 64] {
            assert_eq!(PowerLaw::identify(&angle, m, 2), Some(expected), "at factor {m}");
        }
    }

    #[test]
    fn each_noise_is_recognised_at_every_averaging_time() {
        check(
            &Noise {
                quantisation: 1.0,
                ..Noise::default()
            },
            PowerLaw::WhiteAngle,
        );
        check(
            &Noise {
                arw: 1.0,
                ..Noise::default()
            },
            PowerLaw::WhiteRate,
        );
        check(
            &Noise {
                bias_instability: 1.0,
                ..Noise::default()
            },
            PowerLaw::FlickerRate,
        );
        check(
            &Noise {
                rrw: 1.0,
                ..Noise::default()
            },
            PowerLaw::RateWalk,
        );
    }

    #[test]
    fn too_few_points_and_constant_ones_are_not_identified() {
        assert_eq!(PowerLaw::identify(&[1.0; 29], 1, 2), None);
        assert_eq!(PowerLaw::identify(&[1.0; 100], 1, 2), None);
    }
}
