//! Chance with a seed: every number of a trial comes from here, in the order it is asked for.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use twin::part::signal::Noise;

/// A stream of draws.
#[derive(Clone, Debug)]
pub struct Draw {
    noise: Noise,
    drawn: u64,
}

impl Draw {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Draw {
            noise: Noise::new(seed),
            drawn: 0,
        }
    }

    /// An independent stream.
    pub fn stream(&self, index: u64) -> Draw {
        Draw {
            noise: self.noise.stream(index),
            drawn: 0,
        }
    }

    fn next(&mut self) -> u64 {
        self.drawn += 1;
        self.drawn
    }

    /// Uniform from `least` to `most`.
    pub fn uniform(&mut self, least: f64, most: f64) -> f64 {
        let index = self.next();
        least + (most - least) * self.noise.uniform(index)
    }

    /// Uniform in the logarithm, from `least` to `most`, both above zero.
    pub fn log_uniform(&mut self, least: f64, most: f64) -> f64 {
        self.uniform(least.ln(), most.ln()).exp()
    }

    /// Zero mean, unit variance, normal.
    pub fn normal(&mut self) -> f64 {
        let index = self.next();
        self.noise.normal(index)
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.uniform(0.0, 1.0) < probability
    }

    /// Below `count`, which is above zero.
    pub fn below(&mut self, count: usize) -> usize {
        (self.uniform(0.0, count as f64) as usize).min(count.saturating_sub(1))
    }

    /// Plus or minus one.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// Three independent normals.
    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    /// A direction, uniform on the sphere.
    pub fn direction(&mut self) -> Vector3<f64> {
        let (height, turn) = (self.uniform(-1.0, 1.0), self.uniform(0.0, TAU));
        let radius = (1.0 - height * height).max(0.0).sqrt();
        Vector3::new(radius * turn.cos(), radius * turn.sin(), height)
    }
}
