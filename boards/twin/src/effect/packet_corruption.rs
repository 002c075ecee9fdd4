//! Corruption: a damaged packet passes for a whole one, and a value is anything.

use super::spread::{Beneath, View, mixture, unusual_part};
use super::{Effect, Nature, Page, Symbol, Texture};
use crate::channel::Kind;
use crate::part::signal::Noise;

/// `packet-corruption`.
pub struct PacketCorruption;

const PAGE: Page = Page {
    name: "packet-corruption",
    physics: "Bytes of a packet are damaged and nobody notices: now and then a value is anything within the range, near or far.",
    equation: "y uniform over the range with probability p",
    source: "A line without a check sum",
    excited_by: "any",
    siblings: &["bit-fault", "shock"],
    confirm_by: "Check sums; the outliers are in one channel at a time.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer, Kind::Thermometer],
    parameters: &[Symbol::positive("p", "1", 0.01)],
    texture: Texture::Shapeless,
    ..Page::SMOOTH
};

/// Part of the range beyond which damage often goes: 256 codes of 4096.
const FAR: f64 = 1.0 / 16.0;
/// How often at least, of the damage that is seen above the noise. A flipped bit goes least far: on a part of 12 bits three of nine
/// bits that are seen go beyond [`FAR`], on the gyro, whose range has 8738 codes, two of eight. Another hexadecimal digit goes there
/// more than half of the time, any value at all seven times of eight.
const LEAST_FAR: f64 = 0.25;
/// \[nats\] one damaged log in a thousand is refused.
const REFUSED: f64 = 6.9;

/// Whether samples off their prediction lie too near to it for damage, which knows nothing of it. By Chernoff's bound of the
/// binomial law: `ln P(far <= k of n) <= -n KL(k/n, LEAST_FAR)`.
fn is_too_near(hits: f64, far: f64) -> bool {
    let part = far / hits;
    // Of no hits the part is no number, and nothing is refused.
    part < LEAST_FAR && {
        let of = |own: f64, least: f64| if own > 0.0 { own * (own / least).ln() } else { 0.0 };
        hits * (of(part, LEAST_FAR) + of(1.0 - part, 1.0 - LEAST_FAR)) > REFUSED
    }
}

impl Effect for PacketCorruption {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        let _ = variant;
        let p = theta[0].clamp(0.0, 0.999);
        let (mixed, odds) = (mixture(p), p.ln() - (-p).ln_1p());
        let (mut likelihood, mut usual, mut hits, mut far) = (0.0, 0.0, 0.0, 0.0);
        for view in views {
            let (span, law) = (view.span(), view.normal_law(view.channel.sigma()));
            let anything = (view.resolution() / span).ln();
            for (_, residual) in view.residuals() {
                let whole = law(residual);
                (likelihood, usual) = (likelihood + mixed(whole, anything), usual + whole);
                if odds + anything > whole {
                    (hits, far) = (hits + 1.0, far + f64::from(residual.abs() > FAR * span));
                }
            }
        }
        match is_too_near(hits, far) {
            true => usual,
            false => likelihood,
        }
    }

    fn beneath(&self, theta: &[f64], _variant: f64, views: &[View]) -> Vec<Vec<Beneath>> {
        let p = theta[0].clamp(0.0, 0.999);
        let of = |view: &View| {
            let (sigma, anything) = (view.channel.sigma(), (view.resolution() / view.span()).ln());
            view.each_worth(|_, residual| 1.0 - unusual_part(p, view.normal(residual, sigma), anything))
        };
        views.iter().map(of).collect()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let _ = variant;
        let corrupted = |(number, view): (usize, &View)| {
            let (which, what) = (noise.stream(2 * number as u64), noise.stream(2 * number as u64 + 1));
            let [low, _] = view.limits();
            let sample = |(k, measured): (usize, &f64)| match which.uniform(k as u64) < theta[0] {
                true => low + view.span() * what.uniform(k as u64),
                false => *measured,
            };
            view.measured.iter().enumerate().map(sample).collect()
        };
        views.iter().enumerate().map(corrupted).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damage_goes_far_and_what_stays_near_is_none() {
        // All of 24 near: 24 ln(4/3) = 6.904.
        assert!(is_too_near(24.0, 0.0) && !is_too_near(23.0, 0.0));
        assert!(!is_too_near(0.0, 0.0) && !is_too_near(1000.0, 250.0) && !is_too_near(1000.0, 900.0));
        assert!(is_too_near(1000.0, 150.0));
    }
}
