//! Vibration: a line in the spectrum, from machinery or the supply, wherever sampling folds it to.
//!
//! What is left, in blocks, is transformed ([`super::line`]); what shakes one sensor shakes others at the same frequency. This is
//! unknown: the likelihood is averaged over all bins. A line stands above its neighbours, which what is slow has too.
//!
//! What shakes with a motor's wear, or is folded about by a slow log, is no line of a hundredth of a hertz. It is a sine all the
//! same, of any phase at any sample ([`WANDERS`]): most often near its largest, never beyond, which neither louder noise
//! nor blows are. It is on half of the time, more or less, and stands far above the noise.

use core::f64::consts::{PI, TAU};

use super::line::{BLOCKS, Block, first_bin, mean_of, spectra, summed};
use super::spread::{View, mixed};
use super::{Effect, Likelihood, Nature, Page, Symbol, Texture};
use crate::channel::Kind;
use crate::part::signal::Noise;

/// Steps a bin in which the frequency is sought: between two of them a line loses a hundredth of its power.
const FINE: usize = 8;

/// The variant of [`Vibration`] that is a sine whose frequency is any at any time.
pub const WANDERS: f64 = -1.0;

/// Sigmas that such a sine reaches at least, and what sizes are sought in multiples of.
const SMALLEST_SINE: f64 = 5.0;
const FAR: f64 = 10.0;

/// Part of the samples that must be this many sigma off: of a sine that is on for a quarter of the time. What is off for seconds is
/// no shaking.
const LONG: f64 = 0.15;
const OFF_SIGMAS: f64 = 3.0;

/// ln of the density at `z` sigma of a sine of amplitude `a` sigma and any phase, with noise: `1/(pi sqrt(a^2 - z^2))` rounded off
/// over a sigma at its ends, and by that a little too low everywhere.
fn of_any_phase(z: f64, a: f64) -> f64 {
    let z = z.abs();
    let inside = z.min(a);
    -PI.ln() - 0.5 * (a * a - inside * inside + 2.0 * a).ln() - 0.5 * (z - inside).powi(2)
}

/// \[s\] between samples.
fn step_s(view: &View) -> f64 {
    view.t_s.windows(2).map(|pair| pair[1] - pair[0]).next().unwrap_or(1.0)
}

/// `vibration`.
pub struct Vibration;

const PAGE: Page = Page {
    name: "vibration",
    physics: "Something vibrates or hums: a sine that the sampling may fold to any frequency below half its rate.",
    equation: "y + a sigma sin(2 pi f t + phase)",
    source: "Motors, reaction wheels, supplies; mg and mG",
    excited_by: "running machinery",
    siblings: &["noise-level", "mains-alias", "shock"],
    confirm_by: "Switch the machinery off; sample faster to see the true frequency.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer],
    parameters: &[Symbol::positive("a", "1", 1.0)],
    // In units of the sensor's noise, which an engine does not know.
    largest: 100.0,
    texture: Texture::Line,
    ..Page::SMOOTH
};

impl Effect for Vibration {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        self.likelihood(variant, views)(theta)
    }

    fn likelihood<'a>(&'a self, variant: f64, views: &'a [View<'a>]) -> Likelihood<'a> {
        if variant == WANDERS {
            return Box::new(|theta| views.iter().map(|view| wandering(theta[0], view)).sum());
        }
        // One line through all blocks of all of them, at this frequency or at any.
        let spectra = BLOCKS.map(|length| match variant > 0.0 {
            true => {
                let at = |view: &'a View<'a>| {
                    let cycles = variant * length as f64 * step_s(view);
                    let blocks = Block::all(view, length).into_iter();
                    blocks.map(move |block| {
                        let line = block.line(cycles);
                        (block, vec![line])
                    })
                };
                views.iter().flat_map(at).collect()
            }
            false => spectra(views, length),
        });
        let nominal: f64 = views.iter().map(View::nominal).sum();
        Box::new(move |theta| {
            let gain = |spectra: &Vec<_>| mean_of(&summed(spectra, |block, line| block.gain(theta[0], line)));
            nominal + mean_of(&spectra.each_ref().map(gain))
        })
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let humming = |(number, view): (usize, &View)| {
            let phase = TAU * noise.uniform(number as u64);
            let any_hz = 0.5 / step_s(view) * noise.stream(1).uniform(0);
            let frequency_hz = if variant > 0.0 { variant } else { any_hz };
            let amplitude = theta[0] * view.channel.sigma();
            let own = noise.stream(2 + number as u64);
            let at = |(k, t_s): (usize, &f64)| match variant == WANDERS {
                true => (TAU * own.uniform(2 * k as u64)).sin() * own.uniform(2 * k as u64 + 1).round(),
                false => (TAU * frequency_hz * t_s + phase).sin(),
            };
            let samples = view.measured.iter().zip(view.t_s.iter().enumerate().map(at));
            samples.map(|(measured, at)| measured + amplitude * at).collect()
        };
        views.iter().enumerate().map(humming).collect()
    }

    /// The frequency at which all of them have most.
    fn settled(&self, views: &[View]) -> Option<f64> {
        let length = BLOCKS[1];
        let blocks: Vec<Block> = views.iter().flat_map(|view| Block::all(view, length)).collect();
        let power = |cycles: &f64| -> f64 { blocks.iter().map(|block| block.power(*cycles)).sum() };
        let most = |all: &mut dyn Iterator<Item = f64>| {
            let powers = all.map(|cycles| (power(&cycles), cycles));
            powers
                .max_by(|one, other| one.0.total_cmp(&other.0))
                .map(|(_, cycles)| cycles)
        };
        let sums = summed(&spectra(views, length), |_, line| line);
        let bin = (0..sums.len()).max_by(|one, other| sums[*one].total_cmp(&sums[*other]))? + first_bin(length);
        let about = |step: usize| bin as f64 - 1.0 + step as f64 / FINE as f64;
        let cycles = most(&mut (0..=2 * FINE).map(about))?;
        Some(cycles / (length as f64 * step_s(views.first()?)))
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(match variant {
            WANDERS => "of a frequency that wanders".to_owned(),
            hz if hz > 0.0 => format!("at {hz:.3} Hz, as sampled"),
            _ => return None,
        })
    }

    /// Any frequency: the likelihood averages over them, unless the variant says which \[Hz\]. To inject, 0 is a drawn one.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        vec![0.0, WANDERS]
    }

    fn reach(&self, variant: f64) -> f64 {
        if variant == WANDERS { FAR } else { 1.0 }
    }
}

/// ln likelihood of a channel half of whose samples are off by a sine of amplitude `a` sigma and any phase.
fn wandering(a: f64, view: &View) -> f64 {
    if a < SMALLEST_SINE {
        return view.nominal();
    }
    let sigma = view.channel.sigma();
    let (off, all) = view.residuals().fold((0.0, 0.0), |(off, all), (_, residual)| {
        (
            off + f64::from(u8::from(residual.abs() > OFF_SIGMAS * sigma)),
            all + 1.0,
        )
    });
    if off < LONG * all {
        return view.nominal();
    }
    let sample = |(_, residual): (usize, f64)| {
        let shaken = of_any_phase(residual / sigma, a) + (view.resolution() / sigma).ln();
        mixed(0.5, view.normal(residual, sigma), shaken)
    };
    view.residuals().map(sample).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_density_of_a_sine_of_any_phase_is_one_and_rather_less() {
        for a in [5.0, 20.0, 60.0] {
            const STEP: f64 = 1e-3;
            let half = ((a + 8.0) / STEP) as usize;
            let whole: f64 = (0..half)
                .map(|k| 2.0 * STEP * of_any_phase(k as f64 * STEP, a).exp())
                .sum();
            assert!((0.85..1.0).contains(&whole), "{a}: {whole}");
        }
    }
}
