//! What a gyro's noise is made of, each with its slope in the Allan plot.
//!
//! In: averaging time, lag. Out: the Allan variance and the generalised autocovariance of the angle of each [`Term`] with
//! a squared coefficient of one. (IEEE Std 952-1997, annex C; table 7.7 of the tetrahedron thesis for the slopes.)
//!
//! ```text
//! term                coefficient          Allan variance at tau                     slope of the deviation
//! quantisation        Q   angle            3 Q^2 / tau^2                             -1
//! angle random walk   N   angle / sqrt s   N^2 / tau                                 -1/2
//! bias instability    B   rate             (2 ln 2 / pi) B^2                          0
//! rate random walk    K   rate / sqrt s    K^2 tau / 3                               +1/2
//! ramp                R   rate / s         R^2 tau^2 / 2                             +1
//! Markov              s   rate             2 s^2 (T/tau) (1 - T/(2 tau) (3 - 4 e^(-tau/T) + e^(-2 tau/T)))
//! sinusoid            A   rate             A^2 (sin^2(pi f tau) / (pi f tau))^2
//! ```

use std::f64::consts::{LN_2, PI};

/// A source of noise or drift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Term {
    /// White noise in angle.
    Quantisation,
    /// White noise in rate.
    AngleWalk,
    /// Flicker noise in rate.
    BiasInstability,
    /// Random walk in rate.
    RateWalk,
    /// Rate that grows with time.
    Ramp,
    /// Exponentially correlated rate; its coefficient is the standard deviation.
    Markov {
        /// Correlation time \[s\].
        time_s: f64,
    },
    /// Periodic rate; its coefficient is the amplitude.
    Sinusoid {
        /// Frequency \[Hz\].
        frequency_hz: f64,
    },
}

impl Term {
    /// The five whose shape is known beforehand.
    pub const POWER_LAWS: [Self; 5] = [
        Self::Quantisation,
        Self::AngleWalk,
        Self::BiasInstability,
        Self::RateWalk,
        Self::Ramp,
    ];

    /// Its name in IEEE 952, with the symbol of its coefficient.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Quantisation => "quantisation Q",
            Self::AngleWalk => "angle random walk N",
            Self::BiasInstability => "bias instability B",
            Self::RateWalk => "rate random walk K",
            Self::Ramp => "rate ramp R",
            Self::Markov { .. } => "Markov noise",
            Self::Sinusoid { .. } => "sinusoid",
        }
    }

    /// Power of time in its coefficient's unit: the coefficient is a rate times seconds to this power.
    pub const fn power_of_time(self) -> f64 {
        match self {
            Self::Quantisation => 1.0,
            Self::AngleWalk => 0.5,
            Self::BiasInstability | Self::Markov { .. } | Self::Sinusoid { .. } => 0.0,
            Self::RateWalk => -0.5,
            Self::Ramp => -1.0,
        }
    }

    /// Allan variance at `tau_s`.
    pub fn variance(self, tau_s: f64) -> f64 {
        match self {
            Self::Quantisation => 3.0 / (tau_s * tau_s),
            Self::AngleWalk => 1.0 / tau_s,
            Self::BiasInstability => 2.0 * LN_2 / PI,
            Self::RateWalk => tau_s / 3.0,
            Self::Ramp => 0.5 * tau_s * tau_s,
            Self::Markov { time_s } => markov(tau_s / time_s),
            Self::Sinusoid { frequency_hz } => {
                let phase = PI * frequency_hz * tau_s;
                (phase.sin().powi(2) / phase).powi(2)
            }
        }
    }

    /// Whether it is the same in every record, so that it adds to a variance but does not make it uncertain by itself.
    pub const fn is_deterministic(self) -> bool {
        matches!(self, Self::Ramp | Self::Sinusoid { .. })
    }

    /// Generalised autocovariance of the angle at a lag; quantisation has only its spike at zero lag and the ramp none,
    /// which the covariance of variances adds by itself.
    pub fn autocovariance(self, lag_s: f64) -> f64 {
        let t = lag_s.abs();
        match self {
            Self::Quantisation | Self::Ramp => 0.0,
            Self::AngleWalk => -0.5 * t,
            Self::BiasInstability if t > 0.0 => t * t * t.ln() / (2.0 * PI),
            Self::BiasInstability => 0.0,
            Self::RateWalk => t.powi(3) / 12.0,
            Self::Markov { time_s } => -time_s * time_s * (t / time_s + (-t / time_s).exp_m1()),
            Self::Sinusoid { frequency_hz } => {
                let omega = 2.0 * PI * frequency_hz;
                0.5 * (omega * t).cos() / (omega * omega)
            }
        }
    }
}

/// Allan variance of unit Markov noise at `u` correlation times.
fn markov(u: f64) -> f64 {
    if u < 1e-3 {
        // The closed form cancels to third order.
        return 2.0 * u / 3.0;
    }
    2.0 / u * (1.0 - (3.0 - 4.0 * (-u).exp() + (-2.0 * u).exp()) / (2.0 * u))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of second differences of the autocovariance.
    const RELATIVE: f64 = 1e-6;

    #[test]
    fn variance_and_autocovariance_of_each_term_belong_together() {
        let random = [
            Term::AngleWalk,
            Term::BiasInstability,
            Term::RateWalk,
            Term::Markov { time_s: 3.0 },
            Term::Sinusoid { frequency_hz: 0.13 },
        ];
        for term in random {
            for tau in [0.5, 2.0, 16.0] {
                let s = |lag: f64| term.autocovariance(lag);
                let power = 6.0 * s(0.0) - 8.0 * s(tau) + 2.0 * s(2.0 * tau);
                let variance = power / (2.0 * tau * tau);
                assert!(
                    (variance / term.variance(tau) - 1.0).abs() < RELATIVE,
                    "{term:?} at {tau}"
                );
            }
        }
    }

    #[test]
    fn slopes_are_those_of_table_7_7() {
        for (term, slope) in Term::POWER_LAWS.into_iter().zip([-1.0, -0.5, 0.0, 0.5, 1.0]) {
            let found = 0.5 * (term.variance(20.0) / term.variance(10.0)).log2();
            assert!((found - slope).abs() < 1e-12, "{term:?}: {found}");
        }
    }

    #[test]
    fn markov_noise_is_rate_walk_when_short_and_angle_walk_when_long() {
        let markov = Term::Markov { time_s: 10.0 };
        let walk = |tau: f64| 2.0 / 10.0 * tau / 3.0;
        assert!((markov.variance(0.02) / walk(0.02) - 1.0).abs() < 2e-3);
        assert!((markov.variance(1e5) / (2.0 * 10.0 / 1e5) - 1.0).abs() < 2e-3);
    }
}
