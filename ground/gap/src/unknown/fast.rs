//! What a model leaves of one channel whatever its course: energy above the floor.
//!
//! In: the problem, the model and the floor of each sample. Out: for each channel the mean square above the floor, in squares of sigma,
//! with its standard deviation: of all frequencies together, or of the octaves that stand out of the floor, whichever is surer. Where the
//! reference errs more than the sensor scatters, in a colour that nobody knows, only all together are looked at. White, nearly Gaussian
//! energy is noise that is louder than described and no unknown effect; it is left out.
//!
//! What is fast moves no attitude by itself. It matters by what it adds to the gap of its sensor, which is one part: an axis of three that
//! scatters by a tenth more adds a thirtieth. What several of its axes have adds up ([`Bar`]).

use twin::predict::Channel;

use super::{
    alike,
    binned::Binned,
    octaves::{self, Excess},
    remainder::Setting,
};
use crate::{
    input::case::Bars,
    null::{misfit::correlation_time, model::Model, problem::Problem},
    thresholds::{MISFIT_CALM, NOISE_TAILS, REFERENCE_KNOWN},
};

/// What one channel holds above its floor.
#[derive(Clone, Copy, Debug)]
pub struct Fast {
    /// Which.
    pub channel: usize,
    /// Its samples.
    pub count: f64,
    /// [sigma^2] mean square above the floor, and the floor.
    pub excess: f64,
    /// [sigma^2] the floor.
    pub floor: f64,
    /// [sigma^2] standard deviation of the excess.
    pub error: f64,
    /// [sigma^2] what of the described variance is the reference's.
    pub reference: f64,
    /// ln of the odds of something against the floor alone (Schwarz 1978).
    pub log_bayes_factor: f64,
    /// [physical unit] root mean square of sigma.
    pub sigma: f64,
}

/// Of every channel that has samples: what it has beyond what the model says of its scatter and what its whole kind has ([`alike`]).
pub fn excesses(problem: &Problem, model: &Model, floor: &[Vec<f64>], setting: &Setting) -> Vec<Fast> {
    let of = |channel: usize, louder: f64| excess(problem, model, channel, &floor[channel], louder);
    let (channels, by_model) = (&problem.twin.unit().channels, setting.louder);
    let scatter = |channel: usize| {
        let fast = of(channel, by_model[channel])?;
        Some((1.0 + fast.excess / fast.floor).max(0.0).sqrt())
    };
    let of_kind = match setting.slow.attitude_sigma_rad > 0.0 {
        true => alike::louder(channels, scatter),
        false => vec![1.0; channels.len()],
    };
    let louder = by_model.iter().zip(of_kind).map(|(own, of_kind)| own * of_kind);
    louder
        .enumerate()
        .filter_map(|(channel, louder)| of(channel, louder))
        .collect()
}

/// Per channel, energy that no slow course can be: what is left within the stretches of [`Binned`], above the bar of the case for this channel and what the
/// reference may be off by, in squares of noise. None in channels whose scatter the model explains.
pub fn within_stretches(problem: &Problem, model: &Model, floor: &[Vec<f64>], setting: &Setting) -> Vec<f64> {
    let of_channel = |channel: usize| {
        let Some(fast) = excess(problem, model, channel, &floor[channel], setting.louder[channel])
            .filter(|_| !setting.scattered.contains(&channel))
        else {
            return 0.0;
        };
        let rest = problem.in_sigmas(channel, &model.fitted.rest[channel]) / setting.louder[channel];
        let binned = Binned::along(problem, channel, 1.0);
        let slow: f64 = binned.energy(rest.as_slice());
        let free = rest.len().saturating_sub(binned.bins.len()) as f64;
        (rest.norm_squared() - slow - free * (fast.floor + fast.bar(setting.bars))).max(0.0)
    };
    (0..problem.frames.len()).map(of_channel).collect()
}

impl Fast {
    /// [sigma^2] from which the excess matters to this channel: growth of its own gap, and what the reference may be off by.
    fn bar(&self, bars: &Bars) -> f64 {
        (self.floor.sqrt() + bars.gap_sigma).powi(2) - self.floor + REFERENCE_KNOWN * self.reference
    }
}

/// How much energy of a channel matters to its sensor.
pub struct Bar {
    /// [sigma^2] per channel, the sum over samples by which the gap of its sensor grows by the user's bar, less what the sensor's other axes
    /// are likelier to have above their floor than not.
    energy: Vec<f64>,
}

impl Bar {
    /// Of these channels, each of a sensor; of which something is there above the floor, `is_there` says.
    pub fn of(all: &[Fast], bars: &Bars, sensor: impl Fn(usize) -> usize, is_there: impl Fn(&Fast) -> bool) -> Self {
        let channels = all.iter().map(|fast| fast.channel + 1).max().unwrap_or(0);
        let of_channel = |channel: usize| {
            let own = || all.iter().filter(|fast| sensor(fast.channel) == sensor(channel));
            let sum = |of: &dyn Fn(&Fast) -> f64| own().map(|fast| fast.count * of(fast)).sum::<f64>();
            let samples = sum(&|_| 1.0);
            let floor = sum(&|fast| fast.floor) / samples.max(1.0);
            let others = own().filter(|fast| fast.channel != channel && is_there(fast));
            samples * ((floor.sqrt() + bars.gap_sigma).powi(2) - floor)
                - others.map(|fast| fast.count * fast.excess.max(0.0)).sum::<f64>()
        };
        Self {
            energy: (0..channels).map(of_channel).collect(),
        }
    }

    /// [sigma^2] mean square of a channel from which its excess matters: what others leave of the user's bar, and what the reference may be off by
    /// fast.
    pub fn over(&self, fast: &Fast) -> f64 {
        self.energy[fast.channel].max(0.0) / fast.count + REFERENCE_KNOWN * fast.reference
    }
}

/// The first channel of the sensor that a channel is of: those of its kind in its group are one part.
pub fn sensor(channels: &[Channel], channel: usize) -> usize {
    let own = &channels[channel];
    let is_of_it = |other: &Channel| other.sensor == own.sensor && other.group == own.group;
    channels.iter().position(is_of_it).unwrap_or(channel)
}

fn excess(problem: &Problem, model: &Model, channel: usize, floor: &[f64], louder: f64) -> Option<Fast> {
    let rows = &problem.frames[channel].series.rows;
    let rest = problem.in_sigmas(channel, &model.fitted.rest[channel]) / louder;
    let count = rest.len() as f64;
    let square = rest.norm_squared() / count;
    if rows.len() < 2 || !square.is_finite() || square <= 0.0 {
        return None;
    }
    let mean = |of: &dyn Fn(usize) -> f64| rows.iter().map(|row| of(*row as usize)).sum::<f64>() / count;
    let floor = mean(&|row| floor[row]);
    let squares = mean(&|row| problem.sigmas[channel][row].powi(2));
    let above = above(rest.as_slice(), floor, !problem.is_limited(channel));
    Some(Fast {
        channel,
        count,
        excess: above.energy / count,
        floor,
        error: above.error / count,
        reference: mean(&|row| problem.instrument.fast_sigma(channel, row).powi(2)) / squares,
        log_bayes_factor: above.log_bayes_factor,
        sigma: squares.sqrt(),
    })
}

/// What residuals in sigmas hold above a floor; octave by octave too where it `is_flat`.
fn above(rest: &[f64], floor: f64, is_flat: bool) -> Excess {
    let count = rest.len() as f64;
    let energy: f64 = rest.iter().map(|value| value * value).sum();
    let square = energy / count;
    let tails = rest.iter().map(|value| value.powi(4)).sum::<f64>() / count / (square * square) - 3.0;
    let alike = correlation_time(rest, energy);
    // Half as far below a Gaussian's is no sum of many small things: evenly spread values have -1.2, two values -2.
    let is_noise = tails > -0.5 * NOISE_TAILS && tails < NOISE_TAILS && alike < MISFIT_CALM;
    // Under nothing.
    let expected = floor * ((2.0 + NOISE_TAILS) / count).sqrt();
    let z = ((square - floor) / expected).max(0.0);
    let all = Excess {
        energy: energy - count * floor,
        // As it is.
        error: energy * ((2.0 + tails.max(0.0)) * alike / count).sqrt(),
        log_bayes_factor: if is_noise { 0.0 } else { 0.5 * (z * z - count.ln()) },
    };
    if is_noise || !is_flat {
        return all;
    }
    let by_octave = octaves::excess(rest, floor, NOISE_TAILS);
    if by_octave.log_bayes_factor < all.log_bayes_factor {
        all
    } else {
        by_octave
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    /// White noise of this sigma, and a sine of this amplitude.
    fn noise_and(sigma: f64, amplitude: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let noise = |random: &mut Xoshiro256PlusPlus| -> f64 { StandardNormal.sample(random) };
        (0..1500)
            .map(|k| sigma * noise(&mut random) + amplitude * (f64::from(k) * 0.1).sin())
            .collect()
    }

    #[test]
    fn a_tone_too_weak_for_the_whole_stands_out_of_its_octave_where_the_floor_is_flat() {
        let hummed = noise_and(1.0, 0.5);
        let (by_octave, whole) = (above(&hummed, 1.0, true), above(&hummed, 1.0, false));
        assert!(by_octave.log_bayes_factor > 10.0, "{by_octave:?}");
        assert!(whole.log_bayes_factor < 3.0, "{whole:?}");
    }

    #[test]
    fn noise_that_is_louder_than_described_is_nothing_unknown() {
        assert_eq!(above(&noise_and(1.5, 0.0), 1.0, true).log_bayes_factor, 0.0);
    }

    /// A channel of 300 samples of white noise with so much energy above its floor.
    fn held(channel: usize, excess: f64) -> Fast {
        Fast {
            channel,
            count: 300.0,
            excess,
            floor: 1.0,
            error: 0.1,
            reference: 0.0,
            log_bayes_factor: if excess > 0.0 { 20.0 } else { -2.0 },
            sigma: 1.0,
        }
    }

    /// Which of 28 channels have energy that matters, where these have some above their floor.
    fn mattering(excesses: &[f64]) -> Vec<usize> {
        let own = |channel: usize| held(channel, excesses.get(channel).copied().unwrap_or(0.0));
        let all: Vec<Fast> = (0..28).map(own).collect();
        let bars = Bars {
            attitude_deg: 0.5,
            gap_sigma: 0.05,
        };
        let bar = Bar::of(&all, &bars, |channel| channel / 3, |fast| fast.log_bayes_factor > 0.0);
        all.iter()
            .filter(|fast| fast.excess > bar.over(fast))
            .map(|fast| fast.channel)
            .collect()
    }

    /// The bar is (1.05^2 - 1) of the mean square of three axes: 0.3075 of one of them. The last of 28 is alone.
    #[test]
    fn energy_matters_by_what_it_adds_to_its_sensor_and_that_of_its_axes_adds_up() {
        assert!(mattering(&[0.30]).is_empty());
        assert_eq!(mattering(&[0.31]), vec![0]);
        assert_eq!(mattering(&[0.16, 0.16]), vec![0, 1]);
        assert!(mattering(&[0.16, 0.0, 0.0, 0.16]).is_empty());
        let mut last = [0.0; 28];
        last[27] = 0.11;
        assert_eq!(mattering(&last), vec![27]);
    }
}
