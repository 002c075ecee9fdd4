//! A dry-tuned gyro's rotor: decay time constant, tuning speed, figure of merit.
//!
//! In: peaks of the free pick-off oscillation; periods of that oscillation at several spin speeds. Out: time constant
//! \[s\], tuning speed \[Hz\], figure of merit.
//!
//! ```text
//! A(t) = A_0 exp(-t / tau)                          tau = (t2 - t1) / ln(A1 / A2) for two peaks
//! 1 / T = |N - N_0| / F_m                           F_m = T1 T2 (dN1 - dN2) / (T2 - T1) for two speeds, N_0 known
//! ```
//!
//! The paper prints the reciprocal of the first (its eq. 4) and, in its eq. 6, a factor `1 / 2 pi` that is right only
//! for speeds in rad/s; here speeds are in revolutions a second, periods in seconds. More than two peaks or speeds are
//! fitted by least squares. Refuses peaks that do not decay, and speeds that leave the tuning speed undetermined.

/// Why the rotor's figures cannot be had.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RotorError {
    /// Not enough measurements.
    #[error("{given} measurements; {needed} are needed")]
    TooFew {
        /// How many there are.
        given: usize,
        /// How many it takes.
        needed: usize,
    },
    /// Amplitudes and periods are positive numbers.
    #[error("measurement {0} (counted from 1) is not a positive number")]
    NotPositive(usize),
    /// The peaks do not get smaller.
    #[error("the peaks do not decay: the loop was closed, or the motor still drove the oscillation")]
    NoDecay,
    /// All at one speed or symmetric about the tuning speed.
    #[error("the speeds do not determine the tuning speed: take periods at different distances from it")]
    Undetermined,
}

/// Decay time constant \[s\] from peaks `(time [s], amplitude)` of one sign.
pub fn decay_time(peaks: &[(f64, f64)]) -> Result<f64, RotorError> {
    if peaks.len() < 2 {
        return Err(RotorError::TooFew {
            given: peaks.len(),
            needed: 2,
        });
    }
    if let Some(bad) = peaks
        .iter()
        .position(|(t, a)| !(t.is_finite() && a.is_finite() && *a > 0.0))
    {
        return Err(RotorError::NotPositive(bad + 1));
    }
    let logs: Vec<(f64, f64)> = peaks.iter().map(|(t, a)| (*t, a.ln())).collect();
    let (slope, _, _) = line(&logs).ok_or(RotorError::NoDecay)?;
    if slope < 0.0 {
        Ok(-1.0 / slope)
    } else {
        Err(RotorError::NoDecay)
    }
}

/// What periods at several speeds say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuning {
    /// Tuning speed \[Hz\].
    pub speed_hz: f64,
    /// Figure of merit.
    pub merit: f64,
    /// Root mean square of what the line leaves, in oscillation frequency \[Hz\].
    pub residual_hz: f64,
}

/// Tuning speed and figure of merit from `(spin speed [Hz], oscillation period [s])`, at least three.
///
/// Which speeds lie below the tuning speed is not asked: every division is tried and the straightest line taken.
pub fn tuning(speeds: &[(f64, f64)]) -> Result<Tuning, RotorError> {
    if speeds.len() < 3 {
        return Err(RotorError::TooFew {
            given: speeds.len(),
            needed: 3,
        });
    }
    if let Some(bad) = speeds
        .iter()
        .position(|(n, t)| !(*n > 0.0 && *t > 0.0 && n.is_finite() && t.is_finite()))
    {
        return Err(RotorError::NotPositive(bad + 1));
    }
    let mut sorted = speeds.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let divisions = (0..=sorted.len()).filter_map(|below| {
        let signed: Vec<(f64, f64)> = sorted
            .iter()
            .enumerate()
            .map(|(k, (speed, period))| (*speed, if k < below { -1.0 / period } else { 1.0 / period }))
            .collect();
        let (slope, at_zero, residual_hz) = line(&signed)?;
        let found = Tuning {
            speed_hz: -at_zero / slope,
            merit: 1.0 / slope,
            residual_hz,
        };
        let split = sorted.partition_point(|(speed, _)| *speed < found.speed_hz);
        (slope > 0.0 && split == below).then_some(found)
    });
    divisions
        .min_by(|a, b| a.residual_hz.total_cmp(&b.residual_hz))
        .ok_or(RotorError::Undetermined)
}

/// Figure of merit from two periods \[s\] at known distances \[Hz\] from the tuning speed.
pub fn merit(period1_s: f64, detuning1_hz: f64, period2_s: f64, detuning2_hz: f64) -> Result<f64, RotorError> {
    let merit = period1_s * period2_s * (detuning1_hz - detuning2_hz) / (period2_s - period1_s);
    if merit.is_finite() {
        Ok(merit)
    } else {
        Err(RotorError::Undetermined)
    }
}

/// Slope, value at zero and root mean square residual of the straight line through points.
fn line(points: &[(f64, f64)]) -> Option<(f64, f64, f64)> {
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |sum, point| {
        (sum.0 + point.0 / count, sum.1 + point.1 / count)
    });
    let (xx, xy) = points.iter().fold((0.0, 0.0), |sum, point| {
        (sum.0 + (point.0 - x).powi(2), sum.1 + (point.0 - x) * (point.1 - y))
    });
    let slope = xy / xx;
    let left: f64 = points
        .iter()
        .map(|point| (point.1 - y - slope * (point.0 - x)).powi(2))
        .sum();
    slope.is_finite().then(|| (slope, y - slope * x, (left / count).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    // A = 1e-5, An = Bn = 1e-7, Cn = 1.5e-7, C = 1.4e-5 kg m2, 200 Hz: (C + An)/(An + Bn - Cn) = 282. Periods by the
    // eigenvalues of eqs. 1 and 2 with the minus sign that makes it a gyroscope.
    const PERIODS_S: [f64; 2] = [282.699_695_75, 141.697_963_91];
    /// The figure of merit holds at the tuning speed; one hertz from it the period is off by 0.7 %.
    const NEAR_TUNING: f64 = 0.01;

    #[test]
    fn two_peaks_give_the_decay_time_and_not_its_reciprocal() {
        let tau = decay_time(&[(10.0, 1.0), (35.0, 0.6)]).expect("decay");
        assert!((tau - 48.940379724).abs() < 1e-9, "{tau}");
    }

    #[test]
    fn two_speeds_give_the_figure_of_merit_without_two_pi() {
        let merit = merit(PERIODS_S[0], 1.0, PERIODS_S[1], 2.0).expect("merit");
        assert!((merit - 284.0956).abs() < 1e-3, "{merit}");
        assert!((merit / 282.0 - 1.0).abs() < NEAR_TUNING);
    }

    #[test]
    fn speeds_on_both_sides_give_the_tuning_speed_without_being_told_which_is_which() {
        let speeds = [198.0, 199.0, 201.5, 203.0].map(|n: f64| (n, 282.0 / (n - 200.2).abs()));
        let found = tuning(&speeds).expect("tuning");
        assert!(
            (found.speed_hz - 200.2).abs() < 1e-6 && (found.merit - 282.0).abs() < 1e-6,
            "{found:?}"
        );
    }

    #[test]
    fn what_does_not_decay_or_determine_is_refused() {
        assert_eq!(decay_time(&[(0.0, 1.0), (1.0, 1.1)]), Err(RotorError::NoDecay));
        assert_eq!(decay_time(&[(0.0, 1.0), (1.0, -0.5)]), Err(RotorError::NotPositive(2)));
        assert_eq!(tuning(&[(200.0, 5.0); 3]), Err(RotorError::Undetermined));
        assert_eq!(merit(5.0, 1.0, 5.0, 2.0), Err(RotorError::Undetermined));
    }
}
