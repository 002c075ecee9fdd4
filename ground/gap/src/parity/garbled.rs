//! Samples that were garbled on their way: far from what all others of their packet say, by one reversed bit.
//!
//! In: a log and its unit, what codes say taken out. Out: a [`Finding`], and which samples are [`spoilt`]. It comes before any motion, for
//! one such sample bends a motion by more than any effect does.
//!
//! In each packet the `n` samples `y` of a kind, over their noise, are fitted by a vector and its derivative, `A x`, and a sample stands as far
//! off as its residual in units of its own standard deviation, `w = (R y)_i / sqrt(R_ii)` with `R = I - A A^+` (Baarda 1968, data
//! snooping). The farthest is left out and the rest fitted again, while one is beyond [`OFF`]. Calibration and quick motions
//! leave something too, so `w` counts from its median over the log and in the robust deviation about it, if that is more than one.
//!
//! Far samples alone are no damage: a blow makes them. What a reversed bit makes is a power of two in codes. Of samples
//! that are off by any size, however large, one in [`ODDS`] comes as near to one as noise lets it; more than chance allows
//! ([`RARE`]) are damage. That chance is of samples that have nothing to do with each other. What lasts is no damage of packets, and passes
//! slowly through powers of two: a part whose counts mean half as much, in a boost. So a sample has no say when the same part is far off in the packet
//! before or after it too. Four gyros have one parity, which does not tell whose it is: there it is the one that leaves its own neighbours by as much. They
//! have no say in whether there is damage.

use nalgebra::{DMatrix, DVector, RowDVector};
use statrs::distribution::{Binomial, DiscreteCDF};
use twin::predict::{Channel, Kind, UnitDescription};

use crate::{
    input::log::Log,
    parity::codes::{Finding, sends_codes},
    thresholds::RARE,
};

/// Standard deviations from which a sample is left out: noise has one in 1e15, and what is nearer bends no motion by more than noise.
const OFF: f64 = 8.0;

/// Standard deviations within which noise leaves a size.
const NEAR: f64 = 3.0;

/// One in so many sizes is [`NEAR`] a power of two by chance, of those beyond `2 ODDS NEAR`: from there on powers are as far apart as that.
const ODDS: f64 = 8.0;

/// Of a vector.
const UNKNOWNS: usize = 3;

/// A normal law's standard deviation over the median of what it is off by.
const ROBUST: f64 = 1.482_602;

/// A sample that is off.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Off {
    channel: usize,
    row: u32,
    /// \[counts\] by how much.
    counts: f64,
    /// \[counts\] its standard deviation.
    sigma: f64,
}

impl Off {
    fn is_far(&self) -> bool {
        self.counts.abs() > 2.0 * ODDS * NEAR * self.sigma
    }

    fn is_reversed_bit(&self) -> bool {
        let nearest = self.counts.abs().log2().round().exp2();
        (self.counts.abs() - nearest).abs() < NEAR * self.sigma
    }
}

/// Whether samples are garbled, and in which channels.
pub fn look(log: &Log, unit: &UnitDescription) -> Option<Finding> {
    let kinds = [Kind::Accelerometer, Kind::Magnetometer];
    let far: Vec<Off> = (kinds.iter().flat_map(|kind| off(log, unit, *kind)))
        .filter(Off::is_far)
        .collect();
    let far = alone(unit, far);
    let reversed: Vec<&Off> = far.iter().filter(|own| own.is_reversed_bit()).collect();
    let before = (reversed.len() as u64).checked_sub(1)?;
    let chance = Binomial::new(ODDS.recip(), far.len() as u64).map_or(1.0, |law| law.sf(before));
    if chance >= RARE {
        return None;
    }
    let mut channels: Vec<usize> = reversed.iter().map(|own| own.channel).collect();
    channels.sort_unstable();
    channels.dedup();
    Some(Finding {
        effect: "packet-corruption",
        channels,
        what: format!(
            "{} samples are far off the others of their packet, {} of them by one reversed bit; by chance {:.0}",
            far.len(),
            reversed.len(),
            far.len() as f64 / ODDS
        ),
        step: None,
        looks: Vec::new(),
        losses: Vec::new(),
    })
}

/// Those beside which, in the packets before and after, no sample of the same part is far off.
fn alone(unit: &UnitDescription, far: Vec<Off>) -> Vec<Off> {
    let part = |own: &Off| (&unit.channels[own.channel].group, unit.channels[own.channel].sensor);
    let lasts = |own: &&Off| {
        let is_beside = |other: &Off| own.row.abs_diff(other.row) == 1 && part(other) == part(own);
        far.iter().any(is_beside)
    };
    far.iter().filter(|own| !lasts(own)).copied().collect()
}

/// Channel and row of samples that are off.
pub fn spoilt(log: &Log, unit: &UnitDescription) -> Vec<(usize, u32)> {
    let kinds = [Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer];
    let all = kinds.iter().flat_map(|kind| off(log, unit, *kind));
    all.map(|own| (own.channel, own.row)).collect()
}

/// What a packet's samples of a kind leave of their fit.
struct Packet {
    row: u32,
    /// Channels, and their samples over noise.
    samples: Vec<(usize, f64)>,
}

/// Samples of a kind that are off.
fn off(log: &Log, unit: &UnitDescription, kind: Kind) -> Vec<Off> {
    let is_own = |index: &usize| unit.channels[*index].sensor == kind && sends_codes(&unit.channels[*index]);
    let channels: Vec<usize> = (0..unit.channels.len()).filter(is_own).collect();
    // A vector fits so many whatever they are.
    if channels.len() <= UNKNOWNS {
        return Vec::new();
    }
    let mut packets: Vec<Packet> = (0..log.start_s.len())
        .map(|row| Packet {
            row: row as u32,
            samples: Vec::new(),
        })
        .collect();
    for channel in &channels {
        let (own, series) = (&unit.channels[*channel], &log.channels[*channel]);
        for (row, value) in series.rows.iter().zip(&series.values) {
            let over_noise = (value - own.bias) / own.sigma();
            packets[*row as usize].samples.push((*channel, over_noise));
        }
    }
    // A packet that lost a sample tells less of the others.
    packets.retain(|packet| packet.samples.len() == channels.len());
    let usual = Usual::of(unit, &channels, &packets);
    packets
        .iter()
        .flat_map(|packet| of_packet(log, unit, packet, &usual))
        .collect()
}

/// What `w` of each channel is as a rule: its median, and the deviation about it.
struct Usual(Vec<(usize, f64, f64)>);

impl Usual {
    fn of(unit: &UnitDescription, channels: &[usize], packets: &[Packet]) -> Self {
        let whole = Fit::of(unit, channels);
        let all: Vec<Vec<f64>> = packets.iter().map(|packet| whole.off(&packet.samples)).collect();
        let of = |(at, channel): (usize, &usize)| {
            let own: Vec<f64> = all.iter().map(|own| own[at]).collect();
            let middle = median(own.clone());
            let about = median(own.iter().map(|w| (w - middle).abs()).collect());
            (*channel, middle, (ROBUST * about).max(1.0))
        };
        Self(channels.iter().enumerate().map(of).collect())
    }

    fn of_channel(&self, channel: usize) -> (f64, f64) {
        let own = self.0.iter().find(|(own, ..)| *own == channel);
        own.map_or((0.0, 1.0), |(_, middle, about)| (*middle, *about))
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The fit of a vector and, where there are channels enough, its derivative.
struct Fit {
    slopes: DMatrix<f64>,
    inverse: DMatrix<f64>,
    /// `R`.
    left: DMatrix<f64>,
}

impl Fit {
    fn of(unit: &UnitDescription, channels: &[usize]) -> Self {
        let own: Vec<&Channel> = channels.iter().map(|channel| &unit.channels[*channel]).collect();
        let middle_s = own.iter().map(|channel| channel.slot_s).sum::<f64>() / own.len().max(1) as f64;
        let unknowns = if own.len() > 2 * UNKNOWNS {
            2 * UNKNOWNS
        } else {
            UNKNOWNS
        };
        let slopes = DMatrix::from_fn(own.len(), unknowns, |row, unknown| {
            let channel = own[row];
            let after_s = channel.slot_s - channel.tau_s() - middle_s;
            let size = if unknown < UNKNOWNS { 1.0 } else { after_s };
            size * channel.axis_b[unknown % UNKNOWNS] / channel.sigma()
        });
        // Slots that are all alike tell no derivative.
        let inverse = slopes
            .clone()
            .pseudo_inverse(1e-9)
            .unwrap_or_else(|_| DMatrix::zeros(unknowns, own.len()));
        let left = DMatrix::identity(own.len(), own.len()) - &slopes * &inverse;
        Self { slopes, inverse, left }
    }

    /// `w` of each sample.
    fn off(&self, samples: &[(usize, f64)]) -> Vec<f64> {
        let left = &self.left * values(samples);
        let own = left.iter().enumerate();
        own.map(|(at, left)| left / self.left[(at, at)].max(1e-6).sqrt())
            .collect()
    }
}

fn values(samples: &[(usize, f64)]) -> DVector<f64> {
    DVector::from_iterator(samples.len(), samples.iter().map(|(_, value)| *value))
}

/// Those of a packet.
fn of_packet(log: &Log, unit: &UnitDescription, packet: &Packet, usual: &Usual) -> Vec<Off> {
    let mut kept = packet.samples.clone();
    let mut out: Vec<(usize, f64)> = Vec::new();
    let farthest = |samples: &[(usize, f64)]| {
        let channels: Vec<usize> = samples.iter().map(|(channel, _)| *channel).collect();
        let off = Fit::of(unit, &channels).off(samples);
        let far = |(at, w): (usize, &f64)| {
            let (middle, about) = usual.of_channel(samples[at].0);
            (at, ((w - middle) / about).abs())
        };
        off.iter()
            .enumerate()
            .map(far)
            .max_by(|one, other| one.1.total_cmp(&other.1))
    };
    // A motion has three unknowns; of the rest no more than half can be off and still be told from it.
    while kept.len() > UNKNOWNS + out.len()
        && let Some((at, _)) = farthest(&kept).filter(|(_, off)| *off > OFF)
    {
        let at = match kept.len() > 4 {
            true => at,
            false => lonely(log, unit, packet.row, &kept),
        };
        out.push(kept.remove(at));
    }
    let channels: Vec<usize> = kept.iter().map(|(channel, _)| *channel).collect();
    let fit = Fit::of(unit, &channels);
    let found = &fit.inverse * values(&kept);
    let off = |(channel, value): (usize, f64)| {
        let own = &unit.channels[channel];
        let with = Fit::of(unit, &[&channels[..], &[channel]].concat());
        let slopes: RowDVector<f64> = with.slopes.row(channels.len()).columns(0, found.len()).into_owned();
        let open = (&slopes * &fit.inverse).norm_squared();
        let (_, about) = usual.of_channel(channel);
        let counts = own.sigma() / own.lsb;
        Off {
            channel,
            row: packet.row,
            counts: counts * (value - (slopes * &found)[0]),
            sigma: counts * about * (1.0 + open).sqrt(),
        }
    };
    out.into_iter().map(off).collect()
}

/// Of samples of which one must be off and the fit does not say which: the one that is farthest from the middle of its own neighbours.
fn lonely(log: &Log, unit: &UnitDescription, row: u32, samples: &[(usize, f64)]) -> usize {
    let jump = |(channel, value): &(usize, f64)| {
        let (own, series) = (&unit.channels[*channel], &log.channels[*channel]);
        let at = series.rows.partition_point(|own| *own < row);
        let beside = [at.checked_sub(1), Some(at + 1)];
        let values: Vec<f64> = (beside.iter().flatten())
            .filter_map(|at| Some((series.values.get(*at)? - own.bias) / own.sigma()))
            .collect();
        let middle = values.iter().sum::<f64>() / values.len().max(1) as f64;
        (value - middle).abs()
    };
    let jumps = samples.iter().map(jump).enumerate();
    jumps
        .max_by(|one, other| one.1.total_cmp(&other.1))
        .map_or(0, |(at, _)| at)
}
