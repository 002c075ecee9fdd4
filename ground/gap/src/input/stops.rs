//! Gyros that stop before the end of their range, by the rows of a log alone.
//!
//! In: a log of physical units before it is thinned, and its unit. Out: [`Stop`], the reading at which a gyro stands again and again and beyond
//! which it has none. [`beneath`] takes these samples out of the log, as those at the end of the range are: they say no more than "beyond".
//!
//! The largest readings of a gyro come seldomer than those a little smaller. Of the [`INSIDE`] readings that follow the largest a part `p` is the same
//! as the next; so `n` readings of the largest value have the probability `p^(n-1)` by chance, for each of the two sides of each gyro. Rows in which no
//! other gyro moved are the logger's, which wrote them twice, and count once.
//!
//! Says nothing of gyros that send codes (the search has their limits), of a limit that bends, or of readings that a calibration has mixed.

use twin::predict::{Kind, UnitDescription};

use crate::{input::log::Log, thresholds::RARE};

/// Readings inside the largest that say how often two are the same: each further one at the stop is then worth 5.5 nats at most.
const INSIDE: usize = 256;

/// A side on which a gyro stops.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// Its channel.
    pub channel: usize,
    /// [rad/s] the reading there.
    pub at: f64,
    /// \[nats\] against chance.
    pub nats: f64,
}

/// Where gyros stop.
pub fn stops(log: &Log, unit: &UnitDescription) -> Vec<Stop> {
    let is_gyro = |channel: &usize| unit.channels[*channel].sensor == Kind::Gyro;
    let gyros: Vec<usize> = (0..unit.channels.len()).filter(is_gyro).collect();
    let is_new = moved(log, &gyros);
    let sides = (2 * gyros.len()) as f64;
    let of_side = |(channel, sign): (usize, f64)| {
        let series = &log.channels[channel];
        let rows = series.rows.iter().zip(&series.values);
        let new = rows.filter(|(row, _)| is_new[**row as usize]);
        let mut outwards: Vec<f64> = new.map(|(_, value)| sign * value).collect();
        outwards.sort_by(|one, other| other.total_cmp(one));
        let largest = *outwards.first()?;
        let many = outwards.iter().take_while(|value| **value == largest).count();
        let inside = outwards.get(many..many + INSIDE)?;
        let same = inside.windows(2).filter(|pair| pair[0] == pair[1]).count();
        let chance = (same + 1) as f64 / INSIDE as f64;
        let nats = -(many as f64 - 1.0) * chance.ln() - sides.ln();
        (nats > -RARE.ln()).then_some(Stop {
            channel,
            at: sign * largest,
            nats,
        })
    };
    let without_codes = gyros.iter().filter(|channel| unit.channels[**channel].bits.is_none());
    let both = without_codes.flat_map(|channel| [(*channel, 1.0), (*channel, -1.0)]);
    both.filter_map(of_side).collect()
}

/// Per row, whether any of these channels has another value than before.
fn moved(log: &Log, channels: &[usize]) -> Vec<bool> {
    let mut has_moved = vec![false; log.start_s.len()];
    for channel in channels {
        let series = &log.channels[*channel];
        let mut before = None;
        for (row, value) in series.rows.iter().zip(&series.values) {
            has_moved[*row as usize] |= before != Some(*value);
            before = Some(*value);
        }
    }
    has_moved
}

/// The log without the samples at stops, which are counted as clipped.
pub fn beneath(log: &mut Log, stops: &[Stop]) {
    for stop in stops {
        let series = &mut log.channels[stop.channel];
        let before = series.values.len();
        let samples = series.rows.iter().zip(&series.values);
        let inside = samples.filter(|(_, value)| **value != stop.at);
        (series.rows, series.values) = inside.map(|(row, value)| (*row, *value)).unzip();
        log.masked[stop.channel].clipped += before - series.values.len();
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    const SAMPLES: usize = 12_000;

    /// Three gyros that are turned to and fro by hand, in steps of `lsb`, the first no faster than `most` [rad/s]. The logger writes one of the samples
    /// 40 times.
    fn turned(lsb: f64, most: f64, hangs_at: Option<usize>) -> (Log, UnitDescription) {
        let mut text = "name = \"x\"\ncycle_s = 0.004\n".to_owned();
        for name in ["gx", "gy", "gz"] {
            text += &format!(
                "[[channel]]\nname = \"{name}\"\nsensor = \"gyro\"\ngroup = \"unit\"\naxis_b = [1.0, 0.0, 0.0]\nlsb = 1.0\n\
                 noise_sigma = 0.002\n"
            );
        }
        let unit = UnitDescription::read(&text, "unit.toml").expect("a unit");
        let mut log = Log::empty(3);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        for sample in 0..SAMPLES {
            let t_s = sample as f64 * 0.004;
            let values = [0.0, 1.0, 2.0].map(|phase: f64| {
                let noise: f64 = StandardNormal.sample(&mut random);
                let rate = 2.0 * (3.1 * t_s + phase).sin() + (7.3 * t_s + 2.0 * phase).sin() + 0.002 * noise;
                (rate / lsb).round() * lsb
            });
            let copies = if hangs_at == Some(sample) { 40 } else { 1 };
            for _ in 0..copies {
                let row = log.start_s.len();
                log.start_s.push(row as f64 * 0.004);
                for (channel, value) in values.iter().enumerate() {
                    let value = if channel == 0 { value.clamp(-most, most) } else { *value };
                    log.channels[channel].rows.push(row as u32);
                    log.channels[channel].values.push(value);
                }
            }
        }
        (log, unit)
    }

    fn found(lsb: f64, most: f64, hangs_at: Option<usize>) -> Vec<(usize, f64)> {
        let (log, unit) = turned(lsb, most, hangs_at);
        stops(&log, &unit).iter().map(|stop| (stop.channel, stop.at)).collect()
    }

    #[test]
    fn a_gyro_that_stops_is_told_on_both_sides_and_its_samples_are_left_out() {
        for lsb in [1e-6, 1e-3] {
            assert_eq!(found(lsb, 2.9, None), [(0, 2.9), (0, -2.9)], "{lsb}");
        }
        let (mut log, unit) = turned(1e-6, 2.9, None);
        let at_stops = log.channels[0].values.iter().filter(|value| value.abs() == 2.9).count();
        let stops = stops(&log, &unit);
        beneath(&mut log, &stops);
        assert!(at_stops > 10);
        assert_eq!(log.masked[0].clipped, at_stops);
        assert_eq!(log.channels[0].rows.len(), SAMPLES - at_stops);
        assert_eq!(log.channels[1].rows.len(), SAMPLES);
    }

    /// Coarse steps come again at the top by themselves; and a logger that hangs writes the largest reading as well as another.
    #[test]
    fn coarse_steps_and_a_logger_that_hangs_are_no_stop() {
        for lsb in [1e-6, 1e-3, 0.01, 0.1] {
            assert_eq!(found(lsb, 9.0, None), [], "{lsb}");
        }
        let (log, _) = turned(1e-6, 9.0, None);
        let of_largest = nalgebra::DVector::from_column_slice(&log.channels[0].values).argmax().0;
        assert_eq!(found(1e-6, 9.0, Some(of_largest)), []);
    }
}
