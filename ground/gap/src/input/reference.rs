//! A reference that is not exact: what of its record is used, and how far that is off, sample by sample.
//!
//! In: the motion that a truth instrument recorded, and two twins along it, of which one sees an octave more of it. Out: the
//! motion as it is used, and for each channel and row the standard deviation that the instrument puts into the prediction.
//!
//! An optical system resolves microns and microradians, which its rate, differentiated once or twice, turns into more than the
//! unit's own noise. A hand or a table moves below [`CORNERS_HZ`], so what the octave above them holds is error, and tells how
//! much there is below: [`BELOW`] times as much for rates, no more than as much for specific forces. It changes within a
//! second by ten times, with the markers that are seen, so it is taken over [`ALIKE_S`] to either side.

use std::rc::Rc;

use twin::{
    motion::Recorded,
    predict::{Accuracy, Kind, Twin},
};

/// \[Hz\] corners to which the record is smoothed, of attitude and position.
const CORNERS_HZ: [f64; 2] = [20.0, 10.0];

/// Error below a corner over that in the octave above it, of rates. On BROAD's recordings 03 and 32, gyros calibrated on the
/// spot, it is 1.3 to 1.7, for small errors and large ones, and 0.6 to 0.9 for specific forces.
const BELOW: f64 = 1.6;

/// \[s\] to either side over which an error is as large.
const ALIKE_S: f64 = 0.15;

/// [s^2] how its record answers to motion, as its second derivative: it is filtered, or what it sees bends against the unit,
/// like a low-pass of 50 Hz or less: `1/(2 pi 50 Hz)^2`. On BROAD's recording 03 it is 1.0e-5 for the first of three rates.
const RESPONSE_S2: f64 = 1.0e-5;

/// How well the reference knows.
#[derive(Clone, Debug, Default)]
pub struct Reference {
    /// As the case states it: errors that stay alike for seconds.
    pub accuracy: Accuracy,
    /// Standard deviations of the errors that do not, channel by channel at every row of the log, in physical units; none for a
    /// reference that is exact.
    fast: Vec<Vec<f64>>,
    /// What the octave above holds, channel by channel, of unit variance everywhere.
    records: Vec<Rc<[f64]>>,
    /// \[s\] between its samples.
    step_s: f64,
}

impl Reference {
    /// Of a case without a record, or with an exact one.
    pub fn stated(accuracy: Accuracy) -> Self {
        Self {
            accuracy,
            ..Self::default()
        }
    }

    /// Of the twin along the record as it is [`used`] and the one along what is [`finer`]; `dense` are the same two at even
    /// instants that are as close as the record's.
    pub fn seen(accuracy: Accuracy, [used, finer]: [&Twin; 2], dense: [&Twin; 2]) -> Self {
        let channels = 0..used.unit().channels.len();
        let below = |channel: usize| match used.unit().channels[channel].sensor {
            Kind::Gyro => BELOW,
            _ => 1.0,
        };
        let fast = |channel: usize| -> Vec<f64> {
            let octave = local_rms(used.starts_s(), &octave(channel, used, finer));
            octave.into_iter().map(|rms| below(channel) * rms).collect()
        };
        let starts_s = dense[0].starts_s();
        let record = |channel: usize| -> Rc<[f64]> {
            let octave = octave(channel, dense[0], dense[1]);
            let around = local_rms(starts_s, &octave);
            let even = octave.iter().zip(around);
            even.map(|(value, around)| value / around.max(f64::MIN_POSITIVE))
                .collect()
        };
        Self {
            accuracy,
            fast: channels.clone().map(fast).collect(),
            records: channels.map(record).collect(),
            step_s: starts_s.get(1).map_or(1.0, |second| second - starts_s[0]),
        }
    }

    /// [s^2] standard deviation of its response to motion: what the second derivative of a channel's reading may add to it.
    pub fn response_sigma(&self, channel: usize) -> Option<f64> {
        self.records.get(channel).map(|_| RESPONSE_S2)
    }

    /// A record of such errors in a channel, an octave too fast and of unit variance, and the seconds between its samples; none
    /// of an exact reference.
    pub fn record(&self, channel: usize) -> Option<(Rc<[f64]>, f64)> {
        let record = self.records.get(channel)?;
        (!record.is_empty()).then(|| (Rc::clone(record), self.step_s))
    }

    /// [physical unit] standard deviation that it puts into the prediction of a channel at a row, of errors that do not stay
    /// alike.
    pub fn fast_sigma(&self, channel: usize, row: usize) -> f64 {
        self.fast.get(channel).map_or(0.0, |rows| rows[row])
    }
}

/// What the finer record adds to the readings of a channel.
fn octave(channel: usize, used: &Twin, finer: &Twin) -> Vec<f64> {
    let (used, finer) = (used.channel(channel, &[]), finer.channel(channel, &[]));
    finer
        .iter()
        .zip(used.iter())
        .map(|(finer, used)| finer - used)
        .collect()
}

/// The record as it is used.
pub fn used(record: &Recorded) -> Recorded {
    record.smoothed(CORNERS_HZ[0], CORNERS_HZ[1])
}

/// The record with an octave more.
pub fn finer(record: &Recorded) -> Recorded {
    record.smoothed(2.0 * CORNERS_HZ[0], 2.0 * CORNERS_HZ[1])
}

/// Root mean square over [`ALIKE_S`] to either side of each instant, of what is finite there.
fn local_rms(t_s: &[f64], values: &[f64]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0usize)];
    for value in values {
        let (energy, count) = sums[sums.len() - 1];
        sums.push(if value.is_finite() {
            (energy + value * value, count + 1)
        } else {
            (energy, count)
        });
    }
    let (mut from, mut to) = (0, 0);
    let at = |now_s: &f64| {
        while t_s[from] < now_s - ALIKE_S {
            from += 1;
        }
        while to < t_s.len() && t_s[to] <= now_s + ALIKE_S {
            to += 1;
        }
        let (energy, count) = (sums[to].0 - sums[from].0, sums[to].1 - sums[from].1);
        (energy.max(0.0) / count.max(1) as f64).sqrt()
    };
    t_s.iter().map(at).collect()
}
