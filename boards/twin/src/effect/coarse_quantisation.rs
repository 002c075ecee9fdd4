//! Coarse quantisation: low bits are missing, rounded or cut off, because a mode has fewer of them or a shift went wrong.

use super::spread::{Beneath, IMPOSSIBLE, View};
use super::{Effect, Nature, Page};
use crate::channel::Kind;
use crate::part::signal::Noise;

/// `coarse-quantisation`.
pub struct CoarseQuantisation;

const PAGE: Page = Page {
    name: "coarse-quantisation",
    physics: "The low bits of the channel are missing: a low-power mode, or a shift too many.",
    equation: "y = round(x/q) q or floor(x/q) q, q = 2, 4, 8 or 16 counts",
    source: "LIS331HH data sheet: low-power modes; HMC5883L: 12 bits",
    excited_by: "rest",
    siblings: &["accel-hysteresis", "bit-fault"],
    confirm_by: "A histogram of the codes: only every second, fourth, eighth is there.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer, Kind::Thermometer],
    ..Page::SMOOTH
};

/// [physical unit] of one step.
fn step(view: &View, variant: f64) -> f64 {
    view.channel.lsb * variant.abs().exp2()
}

/// Steps that are whole, rounded or cut off.
fn whole(steps: f64, variant: f64) -> f64 {
    if variant > 0.0 { steps.round() } else { steps.floor() }
}

/// [physical unit] least that a value may have been above its prediction, of a sample with this residual: rounded, it was
/// within half a step; cut off, within the step above.
fn lowest(view: &View, variant: f64, residual: f64) -> f64 {
    let half = if variant > 0.0 { 0.5 } else { 0.0 };
    residual - half * step(view, variant)
}

/// Least worth of a sample that is somewhere in a wide step.
const LEAST_WORTH: f64 = 1e-3;

/// Where a normal variable with mean zero, known to lie within `low` to `high`, pins its mean, and by how many samples' worth:
/// a Newton step of its likelihood. With `m`, `v` the mean and variance of what lies there, `m / I` and `I = 1 - v / sigma^2`
/// (Johnson and Kotz, truncated normal law).
fn pinned(low: f64, high: f64, sigma: f64) -> [f64; 2] {
    let [a, b] = [low, high].map(|end| end / sigma);
    let density = |z: f64| (-0.5 * z * z).exp() / core::f64::consts::TAU.sqrt();
    // Both tails from the side where they are small.
    let tail = |z: f64| 0.5 * libm::erfc(z * core::f64::consts::FRAC_1_SQRT_2);
    let mass = if a > 0.0 {
        tail(a) - tail(b)
    } else {
        tail(-b) - tail(-a)
    };
    if mass < 1e-12 {
        // So far out it is at the nearer end.
        return [if low > 0.0 { low } else { high }, 1.0];
    }
    let mean = (density(a) - density(b)) / mass;
    let worth = (mean * mean - (a * density(a) - b * density(b)) / mass).clamp(LEAST_WORTH, 1.0);
    [sigma * mean / worth, worth]
}

impl Effect for CoarseQuantisation {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        let _ = theta;
        let of = |view: &View| -> f64 {
            let q = step(view, variant);
            let sample = |(k, residual): (usize, f64)| {
                let code = view.measured[k] / q;
                if view.channel.bits.is_none() || (code - code.round()).abs() > 0.25 * view.channel.lsb / q {
                    return view.explained(IMPOSSIBLE, residual);
                }
                let low = lowest(view, variant, residual);
                view.explained(view.within(low, low + q), residual)
            };
            view.residuals().map(sample).sum()
        };
        views.iter().map(of).sum()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let _ = (theta, noise);
        let coarse = |view: &View| {
            let (q, measured) = (step(view, variant), view.measured.iter());
            measured.map(|measured| whole(measured / q, variant) * q).collect()
        };
        views.iter().map(coarse).collect()
    }

    fn beneath(&self, _theta: &[f64], variant: f64, views: &[View]) -> Vec<Vec<Beneath>> {
        let of = |view: &View| {
            let pairs = view.as_logged().into_iter().zip(view.predicted);
            let steps = pairs.map(|(logged, predicted)| {
                let low = lowest(view, variant, logged.value - predicted);
                let [away, worth] = pinned(low, low + step(view, variant), view.channel.noise_sigma);
                Beneath {
                    value: predicted + away,
                    worth,
                }
            });
            steps.collect()
        };
        views.iter().map(of).collect()
    }

    fn expected(&self, variant: f64, view: &View) -> Vec<f64> {
        let steps = variant.abs().exp2();
        view.mean_of_codes(|code| whole(code / steps, variant) * steps)
    }

    /// Cut off, a value is rounded that is half a step lower.
    fn shifted(&self, variant: f64) -> Option<f64> {
        Some(-variant)
    }

    fn told(&self, variant: f64) -> Option<String> {
        let how = if variant > 0.0 { "rounded" } else { "cut off" };
        Some(format!("steps of {} counts, {how}", variant.abs().exp2()))
    }

    /// Bits that are missing; negative where they are cut off instead of rounded.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        (1..=4).flat_map(|bits| [f64::from(bits), -f64::from(bits)]).collect()
    }
}
