//! The errors of a reference from sample to sample, drawn anew.
//!
//! In: of a channel, a record of such errors, an octave too fast and of unit variance. Out: an error at any sample, likewise of
//! unit variance. The record is played slower: at half speed it is the octave below, which is most of what is left in the
//! reference; at a quarter the next, with half the variance, and so on ([`OCTAVES`]). It keeps the tails that markers lost and
//! found again give, and played from the same place in every channel what channels have in common. Where it starts is drawn.

use std::sync::Arc;

use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Octaves below the record's own.
const OCTAVES: i32 = 6;

/// What a channel needs for it.
#[derive(Clone, Debug)]
pub struct Instrument {
    /// The channel's own noise over all that it scatters, at each sample.
    pub own: Vec<f64>,
    /// The record.
    pub record: Arc<[f64]>,
    /// Place of each sample in the record, were it played as fast as it is.
    pub places: Vec<f64>,
}

/// Where in the record each octave starts, as a part of its length, and its size with its sign.
#[derive(Clone, Debug)]
pub struct Played {
    octaves: Vec<(f64, f64)>,
    /// Standard deviation of them all.
    sigma: f64,
}

impl Played {
    /// Draws.
    pub fn draw(random: &mut Xoshiro256PlusPlus) -> Self {
        let mut between = |low: f64, high: f64| Uniform::new(low, high).map_or(low, |law| law.sample(&mut *random));
        let variance = |octave: i32| 0.5f64.powi(octave);
        let octaves = (1..=OCTAVES).map(|octave| {
            let (start, sign) = (between(0.0, 1.0), between(-1.0, 1.0).signum());
            (start, sign * variance(octave).sqrt())
        });
        Self {
            octaves: octaves.collect(),
            sigma: (1..=OCTAVES).map(variance).sum::<f64>().sqrt(),
        }
    }
}

impl Instrument {
    /// What a sample is off, in standard deviations of it, given its sensor's own.
    pub fn err(&self, sample: usize, own: f64, played: &Played) -> f64 {
        let part = self.own[sample];
        part * own + (1.0 - part * part).max(0.0).sqrt() * self.error(sample, played)
    }

    /// One standard deviation of error of the reference, more or less, at a sample.
    fn error(&self, sample: usize, played: &Played) -> f64 {
        let length = self.record.len() as f64;
        let (mut sum, mut place) = (0.0, self.places[sample]);
        for (start, size) in &played.octaves {
            place *= 0.5;
            let at = wrapped(start * length + place, length);
            let below = (at as usize).min(self.record.len() - 1);
            let above = if below + 1 < self.record.len() { below + 1 } else { 0 };
            let beyond = at - below as f64;
            sum += size * (self.record[below] * (1.0 - beyond) + self.record[above] * beyond);
        }
        sum / played.sigma
    }
}

/// A place in a record that begins anew where it ends. Most are within it or one length beyond it, and a remainder takes long.
fn wrapped(place: f64, length: f64) -> f64 {
    let near = if place < length { place } else { place - length };
    if (0.0..length).contains(&near) {
        near
    } else {
        near.rem_euclid(length)
    }
}

#[cfg(test)]
mod tests {
    use rand_xoshiro::rand_core::SeedableRng;

    use super::*;

    #[test]
    fn it_is_of_unit_variance_and_an_octave_slower_than_the_record() {
        let record: Arc<[f64]> = (0..4000).map(|k| 2f64.sqrt() * (f64::from(k) * 1.3).sin()).collect();
        let instrument = Instrument {
            own: vec![0.0; 4000],
            record: Arc::clone(&record),
            places: (0..4000).map(f64::from).collect(),
        };
        let played = Played::draw(&mut Xoshiro256PlusPlus::seed_from_u64(3));
        let errors: Vec<f64> = (0..4000).map(|sample| instrument.error(sample, &played)).collect();
        let mean_of = |of: &dyn Fn(usize) -> f64| (0..3999).map(of).sum::<f64>() / 3999.0;
        let energy = mean_of(&|k| errors[k] * errors[k]);
        // Between samples of a wave of 1.3 rad a step a straight line loses a fifth of its energy.
        assert!((0.7..1.1).contains(&energy), "{energy}");
        let alike = |values: &[f64]| mean_of(&|k| values[k] * values[k + 1]) / mean_of(&|k| values[k] * values[k]);
        assert!(
            alike(&record) < 0.3 && alike(&errors) > 0.6,
            "{} {}",
            alike(&record),
            alike(&errors)
        );
    }
}
