//! Random walk of the zero, stronger than described.
//!
//! The residual is projected on the walk's own first terms, `sin(x_k t/T)` with x_k = (k - 1/2) pi, in which a walk of s per
//! sqrt(s) has the variance `(s T/x_k)^2 n/T` beside the white sigma^2 (Karhunen and Loeve); higher terms are white.

use core::f64::consts::PI;

use super::spread::View;
use super::{Effect, Likelihood, Nature, Page, Symbol, Texture};
use crate::channel::Kind;
use crate::part::signal::Noise;

/// Terms looked at.
const TERMS: usize = 48;

/// `x_k` of term k.
fn place(term: usize) -> f64 {
    (term as f64 - 0.5) * PI
}

/// Of the residual along sin(x t/T) of unit norm.
fn coefficient(view: &View, x: f64) -> f64 {
    let count = view.measured.len() as f64;
    let sum: f64 = view
        .residuals()
        .map(|(k, residual)| residual * (x * (k as f64 + 0.5) / count).sin())
        .sum();
    sum * (2.0 / count).sqrt()
}

/// `gyro-bias-walk`.
pub struct BiasWalk;

const PAGE: Page = Page {
    name: "gyro-bias-walk",
    physics: "The gyro's zero wanders more than described: flicker and random walk.",
    equation: "sigma^2 + (s T/x_k)^2 n/T in term k",
    source: "ADIS16265 data sheet: in-run stability 0.007 deg/s",
    excited_by: "a long time at rest",
    siblings: &["gyro-bias-temperature", "gyro-warm-up", "gyro-bias", "gyro-supply"],
    confirm_by: "An hour at rest at constant temperature; Allan deviation.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::positive("s", "rad/s/sqrt(s)", 1e-4)],
    texture: Texture::Walk,
    ..Page::SMOOTH
};

impl Effect for BiasWalk {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        self.likelihood(variant, views)(theta)
    }

    fn likelihood<'a>(&'a self, _variant: f64, views: &'a [View<'a>]) -> Likelihood<'a> {
        let energies = |view: &View| (1..=TERMS).map(|term| coefficient(view, place(term)).powi(2)).collect();
        let known: Vec<(f64, Vec<f64>)> = views.iter().map(|view| (view.nominal(), energies(view))).collect();
        Box::new(move |theta| {
            let of = |(view, (nominal, energies)): (&View, &(f64, Vec<f64>))| -> f64 {
                let (count, span_s) = (
                    view.t_s.len() as f64,
                    view.t_s.last().unwrap_or(&0.0) - view.t_s.first().unwrap_or(&0.0),
                );
                let white = view.channel.sigma().powi(2);
                let change = |(term, energy): (usize, &f64)| {
                    let x = place(term);
                    let variance =
                        |walk: f64| white + (walk * span_s / x).powi(2) * count / span_s.max(f64::MIN_POSITIVE);
                    let (with, without) = (variance(theta[0].hypot(view.channel.drift_sigma)), white);
                    0.5 * ((without / with).ln() + energy / without - energy / with)
                };
                nominal + (1..=TERMS).zip(energies).map(change).sum::<f64>()
            };
            views.iter().zip(&known).map(of).sum()
        })
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let _ = variant;
        let walked = |(number, view): (usize, &View)| {
            let (stream, mut walk, mut before_s) = (noise.stream(number as u64), 0.0, None);
            let step = |(k, (measured, t_s)): (usize, (&f64, &f64))| {
                let dt_s: f64 = t_s - before_s.replace(*t_s).unwrap_or(*t_s);
                walk += theta[0] * dt_s.max(0.0).sqrt() * stream.normal(k as u64);
                measured + walk
            };
            view.measured.iter().zip(view.t_s).enumerate().map(step).collect()
        };
        views.iter().enumerate().map(walked).collect()
    }
}
