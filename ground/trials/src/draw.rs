//! Chance with a seed: every number of a trial comes from here, in the order it is asked for.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use packets::channel::Quantity;
use twin::part::signal::Noise;

/// A stream of draws.
#[derive(Clone, Debug)]
pub struct Draw {
    noise: Noise,
    drawn: u64,
    asked: Option<Asked>,
}

/// The sensors that are to be struck, where nothing is to be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asked {
    /// Of this plate.
    pub plate: usize,
    /// Of this kind; `None` for whatever the disturbance strikes.
    pub quantity: Option<Quantity>,
}

impl Draw {
    /// The same stream, but this is struck.
    pub fn asking(self, asked: Option<Asked>) -> Self {
        Draw { asked, ..self }
    }

    /// What is to be struck; drawn where it is none.
    pub fn asked(&self) -> Option<Asked> {
        self.asked
    }

    /// The stream of a seed. Seeds are spread first (the finaliser of SplitMix64; Steele, Lea and Flood 2014), for what is
    /// drawn by neighbouring seeds would be the same numbers in another order.
    pub fn new(seed: u64) -> Self {
        let mixed = (seed ^ (seed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        Draw {
            noise: Noise::new(mixed ^ (mixed >> 31)),
            drawn: 0,
            asked: None,
        }
    }

    /// An independent stream.
    pub fn stream(&self, index: u64) -> Draw {
        Draw {
            noise: self.noise.stream(index),
            drawn: 0,
            asked: self.asked,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_seeds_share_no_numbers() {
        let drawn = |seed: u64| -> Vec<u64> {
            let mut draw = Draw::new(seed);
            (0..64).map(|_| draw.uniform(0.0, 1.0).to_bits()).collect()
        };
        let one = drawn(32);
        assert!(
            [33, 34, 40]
                .iter()
                .all(|seed| drawn(*seed).iter().all(|number| !one.contains(number)))
        );
    }
}
