//! How a flight's readings scatter by frequency.
//!
//! In: packets by number. Out: power spectral densities [unit^2/Hz] of gyros, and of accelerometers and magnetometers by axis, the mean
//! over the plates. Welch's estimate ([`crate::spectrum`]) of each block of [`BLOCK`] packets that follow each other, and the mean of the blocks;
//! a shorter flight has that of its longest stretch. A channel that was not read throughout a block has no part in it.

use crate::spectrum::welch;
use emems::sample::Reading;
use packets::channel::{self, CHANNEL_COUNT, CHANNELS, Quantity};

/// Packets of a block: fourteen minutes at 5 Hz.
const BLOCK: usize = 4096;

type Row = [Option<i16>; CHANNEL_COUNT];

/// A flight's spectra as it goes on.
#[derive(Clone, Debug, Default)]
pub struct Spectra {
    last: Option<u64>,
    block: Vec<Row>,
    longest: Vec<Row>,
    sums: Vec<Sum>,
    blocks: usize,
}

/// Densities of a channel over blocks.
#[derive(Clone, Debug, Default)]
struct Sum {
    density: Vec<f64>,
    blocks: u32,
}

/// A line of a spectrum: its name, and `(f [cycles a packet], density [unit^2 packets])`.
pub type Line = (String, Vec<(f64, f64)>);

impl Spectra {
    /// Takes a packet.
    pub fn packet(&mut self, number: u64, reading: &Reading) {
        if self.last.replace(number).is_some_and(|last| last + 1 != number) {
            self.cut();
        }
        self.block.push(channel::counts(reading));
        if self.block.len() == BLOCK {
            let block = std::mem::take(&mut self.block);
            self.add(&block);
            self.blocks += 1;
        }
    }

    fn cut(&mut self) {
        let block = std::mem::take(&mut self.block);
        if self.blocks == 0 && block.len() > self.longest.len() {
            self.longest = block;
        }
    }

    fn add(&mut self, block: &[Row]) {
        self.sums.resize(CHANNEL_COUNT, Sum::default());
        for (index, (sum, channel)) in self.sums.iter_mut().zip(CHANNELS).enumerate() {
            let values: Option<Vec<f64>> = block.iter().map(|row| Some(channel.quantity.si(row[index]?))).collect();
            let density = values.map(|values| welch(&values, 1.0)).unwrap_or_default();
            if density.is_empty() {
                continue;
            }
            sum.density.resize(density.len(), 0.0);
            sum.density
                .iter_mut()
                .zip(&density)
                .for_each(|(sum, (_, power))| *sum += power);
            sum.blocks += 1;
        }
    }

    /// Lines of a quantity: one a gyro, one an axis of the others.
    pub fn lines(&self, quantity: Quantity) -> Vec<Line> {
        let mut whole = self.clone();
        whole.cut();
        if whole.blocks == 0 {
            let longest = std::mem::take(&mut whole.longest);
            whole.add(&longest);
        }
        let mut lines: Vec<(String, Vec<&Sum>)> = Vec::new();
        for (channel, sum) in CHANNELS.iter().zip(&whole.sums) {
            if channel.quantity != quantity || sum.blocks == 0 {
                continue;
            }
            let name = match quantity {
                Quantity::Rate => channel.name,
                // "a1x": the axis is last.
                _ => channel.name.get(channel.name.len() - 1..).unwrap_or(channel.name),
            };
            match lines.iter_mut().find(|(known, _)| known == name) {
                Some((_, sums)) => sums.push(sum),
                None => lines.push((name.to_string(), vec![sum])),
            }
        }
        lines.into_iter().map(|(name, sums)| (name, mean(&sums))).collect()
    }
}

fn mean(sums: &[&Sum]) -> Vec<(f64, f64)> {
    let bins = sums.iter().map(|sum| sum.density.len()).min().unwrap_or(0);
    // Welch leaves the zeroth of `bins + 1` out, which span half a cycle a packet.
    let frequency = |bin: usize| 0.5 * (bin + 1) as f64 / (bins + 1) as f64;
    let power = |bin: usize| {
        sums.iter()
            .map(|sum| sum.density[bin] / f64::from(sum.blocks))
            .sum::<f64>()
    };
    (0..bins)
        .map(|bin| (frequency(bin), power(bin) / sums.len() as f64))
        .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use emems::sample::{Errors, NOT_READ};

    use super::*;

    /// Gyro 2 swings at an eighth of a cycle a packet.
    fn swinging(number: u64, gap: bool) -> Reading {
        let swing = (400.0 * (TAU * 0.125 * number as f64).sin()) as i16;
        Reading {
            errors: Errors(0),
            gyro: [if gap { NOT_READ } else { 3 }, swing, 0, 0],
            ..Reading::unread(0)
        }
    }

    #[test]
    fn a_swing_stands_at_its_frequency_and_silence_has_no_line() {
        for count in [300_u64, 9000] {
            let mut spectra = Spectra::default();
            (0..count).for_each(|number| spectra.packet(number, &swinging(number, number == 100 || number == 5000)));
            let lines = spectra.lines(Quantity::Rate);
            let names: Vec<&str> = lines.iter().map(|(name, _)| name.as_str()).collect();
            assert_eq!(names, ["g2", "g3", "g4"], "{count}");
            let (_, density) = &lines[0];
            let highest = density
                .iter()
                .max_by(|one, other| one.1.total_cmp(&other.1))
                .expect("a line");
            let bin = density[1].0 - density[0].0;
            assert!((highest.0 - 0.125).abs() <= bin, "{count}: {highest:?}");
            // The power of a sine of 400 counts, half its amplitude squared.
            let amplitude = Quantity::Rate.si(400);
            let power: f64 = density.iter().map(|(_, density)| density * bin).sum();
            assert!(
                (power / (0.5 * amplitude * amplitude) - 1.0).abs() < 0.05,
                "{count}: {power}"
            );
        }
    }

    #[test]
    fn a_missed_packet_ends_a_stretch() {
        let mut spectra = Spectra::default();
        (0..40)
            .chain(50..90)
            .for_each(|number| spectra.packet(number, &swinging(number, false)));
        assert!(spectra.lines(Quantity::Rate).is_empty(), "both stretches are too short");
    }
}
