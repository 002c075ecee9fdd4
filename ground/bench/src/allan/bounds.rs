//! Confidence bounds of a deviation.
//!
//! In: the power law, how the estimator differences and averages, its windows. Out: equivalent degrees of freedom, and
//! bounds from the chi-squared distribution.
//!
//! An estimate is the mean of `M` squares `z_k^2` of a stationary Gaussian `z` with autocorrelation `rho`, so that
//!
//! ```text
//! edf = M^2 / sum_{|k| < M} (M - |k|) rho_k^2
//! ```
//!
//! `rho` follows from the generalised autocovariance of the angle under each power law (Greenhall and Riley,
//! "Uncertainty of stability variances based on finite differences", PTTI 2003, eqs. 7 to 13). Where their tables
//! interpolate, the sum itself is taken here, over at most some thousand lags: long windows advance by a fraction of
//! the averaging time instead of single samples, and lags beyond [`FARTHEST`] averaging times carry nothing.
//!
//! Refuses power laws under which the variance does not converge (none).

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{deviation::Deviation, noise::PowerLaw};

/// Steps an averaging time is divided into: the sum over lags is then within 0.1 % of the one over all lags.
const STEPS: f64 = 64.0;
/// Correlations farther than this many averaging times are below 1e-4 of the power under every law.
const FARTHEST: f64 = 16.0;
/// From this averaging factor on, second differences of the autocovariance are taken as derivatives: the difference
/// would lose more to rounding than the derivative to curvature.
const SMOOTH: f64 = 1000.0;

/// Low and high bound of a deviation `value` with `edf` degrees of freedom; `confidence` lies between 0 and 1.
pub fn bounds(value: f64, edf: f64, confidence: f64) -> Option<(f64, f64)> {
    if !(edf.is_finite() && edf > 0.0 && confidence > 0.0 && confidence < 1.0) {
        return None;
    }
    let tail = 0.5 * (1.0 - confidence);
    let chi = ChiSquared::new(edf).ok()?;
    Some((
        value * (edf / chi.inverse_cdf(1.0 - tail)).sqrt(),
        value * (edf / chi.inverse_cdf(tail)).sqrt(),
    ))
}

/// Equivalent degrees of freedom of an estimate from `windows` windows at averaging factor `m`.
pub fn edf(law: PowerLaw, deviation: Deviation, m: usize, windows: usize) -> Option<f64> {
    let order = if deviation == Deviation::Hdev { 3 } else { 2 };
    if windows == 0 || law.alpha() + 2 * order <= 1 {
        return None;
    }
    let (windows, m) = (windows as f64, m as f64);
    let stride = if deviation == Deviation::Adev { 1.0 } else { m };
    let modified = matches!(deviation, Deviation::Mdev | Deviation::Tdev);
    if law == PowerLaw::WhiteAngle && !modified {
        return Some(white_angle(order, stride, windows));
    }
    // Few long windows overlap so much that they must be followed in finer steps than many short ones.
    let steps = stride.min(STEPS.max(STEPS * stride / windows));
    let windows = windows * steps / stride;
    let filter = if modified {
        1.0
    } else if steps < stride {
        steps
    } else {
        m
    };
    let power = correlation(0.0, if modified { 1.0 } else { m }, law, order);
    let last = windows.min(FARTHEST * steps).ceil() as usize;
    let sum: f64 = (0..last)
        .map(|k| {
            let r = correlation(k as f64 / steps, filter, law, order) / power;
            let both = if k == 0 { 1.0 } else { 2.0 };
            both * (windows - k as f64).max(0.0) * r * r
        })
        .sum();
    Some((windows * windows / sum).max(1.0))
}

/// White angle: differences are correlated only where they share samples, at whole multiples of the averaging time.
fn white_angle(order: i32, stride: f64, windows: f64) -> f64 {
    let rho: &[f64] = if order == 2 {
        &[-4.0 / 6.0, 1.0 / 6.0]
    } else {
        &[-15.0 / 20.0, 6.0 / 20.0, -1.0 / 20.0]
    };
    let lags = (1..).map(|j| f64::from(j) * stride);
    let sum: f64 = rho
        .iter()
        .zip(lags)
        .map(|(rho, lag)| 2.0 * (windows - lag).max(0.0) * rho * rho)
        .sum();
    (windows * windows / (windows + sum)).max(1.0)
}

/// Autocovariance of the differences of order `order` of the angle's averages at lag `t` averaging times, times a
/// constant.
fn correlation(t: f64, filter: f64, law: PowerLaw, order: i32) -> f64 {
    let weights: &[f64] = if order == 2 {
        &[6.0, -4.0, 1.0]
    } else {
        &[20.0, -15.0, 6.0, -1.0]
    };
    let averaged = |t: f64| averaged(t.abs(), filter, law.alpha());
    let sides = (1..)
        .map(f64::from)
        .zip(&weights[1..])
        .map(|(j, weight)| weight * (averaged(t - j) + averaged(t + j)));
    weights[0] * averaged(t) + sides.sum::<f64>()
}

/// Second difference over `1 / filter` of the autocovariance: the angle's averages are differences of its integral.
fn averaged(t: f64, filter: f64, alpha: i32) -> f64 {
    if filter < SMOOTH || t == 0.0 {
        let step = 1.0 / filter;
        let second = 2.0 * autocovariance(t, alpha) - autocovariance(t - step, alpha) - autocovariance(t + step, alpha);
        return second * filter * filter;
    }
    let log = t.ln();
    match alpha {
        1 => -(2.0 * log + 3.0),
        0 => -6.0 * t,
        -1 => t * t * (12.0 * log + 7.0),
        -2 => 20.0 * t.powi(3),
        -3 => -t.powi(4) * (30.0 * log + 11.0),
        _ => -42.0 * t.powi(5),
    }
}

/// Generalised autocovariance of the integral of the angle.
fn autocovariance(t: f64, alpha: i32) -> f64 {
    let t = t.abs();
    if t == 0.0 {
        return 0.0;
    }
    match alpha {
        2 => -t,
        1 => t * t * t.ln(),
        0 => t.powi(3),
        -1 => -t.powi(4) * t.ln(),
        -2 => -t.powi(5),
        -3 => t.powi(6) * t.ln(),
        _ => t.powi(7),
    }
}

#[cfg(test)]
#[path = "bounds/tests.rs"]
mod tests;
