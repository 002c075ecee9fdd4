//! A reference that is not exact: what of its record is used, and how far that is off, sample by sample.
//!
//! In: the motion that a truth instrument recorded, and two twins along it, of which one sees an octave more of it. Out: the
//! motion as it is used, and for each channel and row the standard deviation that the instrument puts into the prediction.
//!
//! An optical system resolves microns and microradians, which its rate, differentiated once or twice, turns into more than the
//! unit's own noise. A hand or a table moves below the corners of [`twin::motion::Recorded::used`], so what the octave above them holds is error. It changes within
//! a second by ten times, with the markers that are seen, so it is taken over [`ALIKE_S`] to either side, at the pace of the record
//! and not of the log, which may have one row in that time. How much there is below, the log tells ([`super::level`]): at most
//! [`BELOW`] times as much for rates, no more than as much for specific forces.

use std::sync::Arc;

use twin::predict::{Accuracy, Kind, Twin};

use crate::input::{level::levels, windows::Fit};

/// Most of the error below a corner over that in the octave above it, of rates. On BROAD's recordings 03 and 32, gyros calibrated
/// on the spot, it is 1.3 to 1.7, for small errors and large ones, and 0.6 to 0.9 for specific forces.
const BELOW: f64 = 1.6;

/// \[s\] to either side over which an error is as large.
const ALIKE_S: f64 = 0.15;

/// \[s\] at most from one instant to the next at which the octave is looked at: a dozen in twice [`ALIKE_S`]. Its mean square needs
/// no more, for what is not followed between them has the same variance at them.
pub const SPREAD_S: f64 = 0.025;

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
    records: Vec<Arc<[f64]>>,
    /// \[s\] between its samples.
    step_s: f64,
}

impl Reference {
    /// \[s\] between the samples of its record; 0 without one.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Of a case without a record, or with an exact one.
    pub fn stated(accuracy: Accuracy) -> Self {
        Self {
            accuracy,
            ..Self::default()
        }
    }

    /// Of two twins, along the record as it is [used](twin::motion::Recorded::used) and along what is [finer](twin::motion::Recorded::finer): `close` at even instants that are as close as
    /// the record's, `spread` all along the log, whose rows are those of `twin`.
    pub fn seen(accuracy: Accuracy, twin: &Twin, fit: &Fit, spread: [&Twin; 2], close: [&Twin; 2]) -> Self {
        let channels = &twin.unit().channels;
        let above = |channel: usize| -> Vec<f64> {
            let octave = octave(channel, spread);
            let local = Local::of(spread[0].starts_s(), &octave);
            twin.starts_s().iter().map(|row_s| local.rms(*row_s)).collect()
        };
        let mut fast: Vec<Vec<f64>> = (0..channels.len()).map(above).collect();
        for (kind, most) in [
            (Kind::Gyro, BELOW),
            (Kind::Accelerometer, 1.0),
            (Kind::Magnetometer, 1.0),
        ] {
            let levels = levels(twin, fit, kind, &|channel, row| fast[channel][row], most);
            for (channel, level) in levels {
                fast[channel].iter_mut().for_each(|sigma| *sigma *= level);
            }
        }
        let starts_s = close[0].starts_s();
        let record = |channel: usize| -> Arc<[f64]> {
            let octave = octave(channel, close);
            let local = Local::of(starts_s, &octave);
            let even = octave.iter().zip(starts_s);
            even.map(|(value, start_s)| value / local.rms(*start_s).max(f64::MIN_POSITIVE))
                .collect()
        };
        Self {
            accuracy,
            fast,
            records: (0..channels.len()).map(record).collect(),
            step_s: starts_s.get(1).map_or(1.0, |second| second - starts_s[0]),
        }
    }

    /// [s^2] standard deviation of its response to motion: what the second derivative of a channel's reading may add to it.
    pub fn response_sigma(&self, channel: usize) -> Option<f64> {
        self.records.get(channel).map(|_| RESPONSE_S2)
    }

    /// A record of such errors in a channel, an octave too fast and of unit variance, and the seconds between its samples; none
    /// of an exact reference.
    pub fn record(&self, channel: usize) -> Option<(Arc<[f64]>, f64)> {
        let record = self.records.get(channel)?;
        (!record.is_empty()).then(|| (Arc::clone(record), self.step_s))
    }

    /// [physical unit] standard deviation that it puts into the prediction of a channel at a row, of errors that do not stay
    /// alike.
    pub fn fast_sigma(&self, channel: usize, row: usize) -> f64 {
        self.fast.get(channel).map_or(0.0, |rows| rows[row])
    }
}

/// What the finer record adds to the readings of a channel.
fn octave(channel: usize, [used, finer]: [&Twin; 2]) -> Vec<f64> {
    let (used, finer) = (used.channel(channel, &[]), finer.channel(channel, &[]));
    finer
        .iter()
        .zip(used.iter())
        .map(|(finer, used)| finer - used)
        .collect()
}

/// A series whose mean square is asked for over [`ALIKE_S`] to either side of an instant, of what is finite there.
struct Local<'a> {
    t_s: &'a [f64],
    /// Energy and number of the samples before each.
    before: Vec<(f64, usize)>,
}

impl<'a> Local<'a> {
    fn of(t_s: &'a [f64], values: &[f64]) -> Self {
        let mut before = vec![(0.0, 0)];
        for value in values {
            let (energy, count) = before[before.len() - 1];
            before.push(if value.is_finite() {
                (energy + value * value, count + 1)
            } else {
                (energy, count)
            });
        }
        Self { t_s, before }
    }

    /// Root mean square; at an instant beyond the series as at its nearest end.
    fn rms(&self, now_s: f64) -> f64 {
        let ends = self.t_s.first().zip(self.t_s.last());
        let now_s = ends.map_or(now_s, |(first, last)| now_s.clamp(*first, *last));
        let [from, to] = [
            self.t_s.partition_point(|t_s| *t_s < now_s - ALIKE_S),
            self.t_s.partition_point(|t_s| *t_s <= now_s + ALIKE_S),
        ];
        let (energy, count) = (
            self.before[to].0 - self.before[from].0,
            self.before[to].1 - self.before[from].1,
        );
        (energy.max(0.0) / count.max(1) as f64).sqrt()
    }
}
