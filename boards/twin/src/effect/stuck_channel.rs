//! A stuck channel: from some instant on it says the same, whatever happens.

use super::spread::{Beneath, IMPOSSIBLE, View};
use super::{Effect, Nature, Page, onsets};
use crate::channel::Kind;
use crate::part::signal::Noise;

/// `stuck-channel`.
pub struct StuckChannel;

const PAGE: Page = Page {
    name: "stuck-channel",
    physics: "From some instant on the channel gives one value: a dead part, a broken wire, an overflow code.",
    equation: "y = c from t0 on",
    source: "Dead sensors; HMC5883L data sheet: -4096 for overflow",
    excited_by: "any",
    siblings: &["accel-high-pass", "stale-sample"],
    confirm_by: "The code does not change, not even by noise.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer, Kind::Thermometer],
    ..Page::SMOOTH
};

impl Effect for StuckChannel {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        let _ = theta;
        let of = |view: &View| -> f64 {
            let sigma = view.channel.sigma();
            let sample = |(k, residual): (usize, f64)| {
                let before = k
                    .checked_sub(1)
                    .filter(|&k| view.t_s[k] >= variant)
                    .map(|k| view.measured[k]);
                match before {
                    Some(before) if (view.measured[k] - before).abs() < 0.5 * view.resolution() => 0.0,
                    Some(before) if before.is_finite() => view.explained(IMPOSSIBLE, residual),
                    // The value it is stuck at may be any: no worse than one in a range of counts.
                    _ if view.t_s[k] >= variant => -(view.span() / view.resolution()).ln(),
                    _ => view.normal(residual, sigma),
                }
            };
            view.residuals().map(sample).sum()
        };
        views.iter().map(of).sum()
    }

    fn beneath(&self, _theta: &[f64], variant: f64, views: &[View]) -> Vec<Vec<Beneath>> {
        let of = |view: &View| view.each_worth(|k, _| f64::from(view.t_s[k] < variant));
        views.iter().map(of).collect()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let _ = theta;
        let stuck = |(number, view): (usize, &View)| {
            let [low, _] = view.limits();
            let resolution = view.resolution();
            // Which value it sticks at is anything.
            let value = low + view.span() * noise.uniform(number as u64);
            let value = (value / resolution).round() * resolution;
            let sample = |(measured, t_s): (&f64, &f64)| if *t_s < variant { *measured } else { value };
            view.measured.iter().zip(view.t_s).map(sample).collect()
        };
        views.iter().enumerate().map(stuck).collect()
    }

    fn expected(&self, variant: f64, view: &View) -> Vec<f64> {
        let mut logged = view.measured.iter().zip(view.t_s);
        let stuck = logged.rfind(|(value, t_s)| value.is_finite() && **t_s >= variant);
        let rows = view.predicted.iter().zip(view.t_s);
        rows.map(|(predicted, t_s)| match stuck {
            Some((value, _)) if *t_s >= variant => *value,
            _ => *predicted,
        })
        .collect()
    }

    /// The instant from which each of them gives one value to the end, the last of these.
    fn settled(&self, views: &[View]) -> Option<f64> {
        let of = |view: &View| {
            let logged = view
                .measured
                .iter()
                .zip(view.t_s)
                .filter(|(value, _)| value.is_finite());
            let logged: Vec<(&f64, &f64)> = logged.collect();
            let (end, _) = logged.last()?;
            let is_other = |(value, _): &(&f64, &f64)| (*value - *end).abs() > 0.5 * view.resolution();
            let changed = logged.iter().rposition(is_other).map_or(0, |at| at + 1);
            logged.get(changed).map(|(_, t_s)| **t_s)
        };
        views.iter().filter_map(of).reduce(f64::max)
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(format!("from {variant:.1} s on"))
    }

    /// Onsets \[s\]; the first is the start of the log.
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        starts_s.first().copied().into_iter().chain(onsets(starts_s)).collect()
    }
}
