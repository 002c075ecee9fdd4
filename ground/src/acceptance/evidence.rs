//! What was heard in an acceptance test: packets, derived frames and the unit's lines, each with its time and what was going on.
//!
//! Nothing is judged here. Times are those of the line, in seconds.

use std::collections::VecDeque;

use emems::{derived::Derived, sample::Reading};
use nalgebra::Vector3;
use packets::channel::{ACC_LSB, CHANNEL_COUNT, CHANNELS, Quantity, counts};
use twin::geometry::dcm_bp;

/// What was going on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Questions and answers.
    Talk,
    /// The sensors test themselves.
    SelfTest,
    /// At rest, level.
    Rest,
    /// In or on the way to a pose.
    Pose(usize),
    /// A turn.
    Turn(usize),
    /// The recorder writes; then it is read.
    Memory,
}

/// A packet.
#[derive(Clone, Debug)]
pub struct Packet {
    /// \[s\] when its last byte was there.
    pub at_s: f64,
    /// Meanwhile.
    pub stage: Stage,
    /// What it says.
    pub reading: Reading,
}

/// A derived frame.
#[derive(Clone, Debug)]
pub struct Frame {
    /// \[s\] when its last byte was there.
    pub at_s: f64,
    /// Meanwhile.
    pub stage: Stage,
    /// What it says.
    pub derived: Box<Derived>,
}

/// A line of the unit.
#[derive(Clone, Debug)]
pub struct Said {
    /// \[s\] when.
    pub at_s: f64,
    /// Meanwhile.
    pub stage: Stage,
    /// Without its `>`.
    pub text: String,
}

/// A stretch at rest, or of a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Of what.
    pub stage: Stage,
    /// \[s\] its first packet.
    pub from_s: f64,
    /// \[s\] its last.
    pub to_s: f64,
}

/// All of it.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Packets of the umbilical, those of a dump apart.
    pub packets: Vec<Packet>,
    /// Derived frames.
    pub frames: Vec<Frame>,
    /// The unit's lines.
    pub said: Vec<Said>,
    /// Damaged places in the stream, outside of a dump.
    pub unread: usize,
    /// Packets read back from the recorder.
    pub dumped: Vec<Reading>,
    /// What is to be judged.
    pub stretches: Vec<Stretch>,
    /// What was asked for and not seen, in words.
    pub missing: Vec<String>,
    /// Whether the lift-off line was seen when it was asserted; `None` where it was not asserted.
    pub lift_off_seen: Option<bool>,
}

impl Evidence {
    /// Packets of a stretch.
    pub fn within(&self, stretch: &Stretch) -> impl Iterator<Item = &Packet> {
        let Stretch { from_s, to_s, .. } = *stretch;
        self.packets
            .iter()
            .filter(move |packet| (from_s..=to_s).contains(&packet.at_s))
    }

    /// The first stretch of a stage.
    pub fn stretch(&self, stage: Stage) -> Option<&Stretch> {
        self.stretches.iter().find(|stretch| stretch.stage == stage)
    }

    /// \[counts\] of a channel in a stretch, where it was read.
    pub fn counts(&self, stretch: &Stretch, channel: usize) -> Vec<f64> {
        let values = self.within(stretch).map(|packet| counts(&packet.reading)[channel]);
        values.flatten().map(f64::from).collect()
    }
}

/// Place of a channel in [`CHANNELS`], by what it measures, its plate and its axis.
pub fn channel(quantity: Quantity, plate: usize, axis: usize) -> usize {
    let mut of_kind = (0..CHANNEL_COUNT).filter(|k| CHANNELS[*k].quantity == quantity && CHANNELS[*k].plate == plate);
    of_kind.nth(axis).unwrap_or_default()
}

/// Mean and standard deviation; `None` of fewer than two.
pub fn spread(values: &[f64]) -> Option<(f64, f64)> {
    if values.len() < 2 {
        return None;
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    Some((mean, variance.sqrt()))
}

/// [m/s2] specific force in b that each plate's accelerometer gives of a reading, where it was read.
pub fn forces_b(reading: &Reading) -> Vec<Vector3<f64>> {
    let all = counts(reading);
    let force = |plate: usize| {
        let axis = |axis: usize| all[channel(Quantity::SpecificForce, plate, axis)].map(f64::from);
        Some(dcm_bp(plate) * Vector3::new(axis(0)?, axis(1)?, axis(2)?) * ACC_LSB)
    };
    (0..4).filter_map(force).collect()
}

/// Packets without a motion that make a stretch at rest: four seconds, in which a hand that holds still is seen to shake.
pub const STILL_PACKETS: usize = 20;

/// \[sigma of the data sheet's noise\] range of [`STILL_PACKETS`] values at rest. Of normal noise it is below 6 in 999 of 1000
/// (Tippett's distribution of the range), and the median channel of a unit with one bad part is no bad one.
const STILL_SIGMAS: f64 = 8.0;

/// \[counts\] noise of a gyro and of an accelerometer axis (see [`super::limits`]).
const NOISE_COUNTS: [f64; 2] = [
    super::limits::GYRO_NOISE / packets::channel::GYRO_LSB,
    super::limits::ACC_NOISE / ACC_LSB,
];

/// Whether the newest packets are of a unit at rest: the median gyro and the median axis of the accelerometers hardly move.
pub fn is_still(newest: &VecDeque<Reading>) -> bool {
    let kinds = [Quantity::Rate, Quantity::SpecificForce].into_iter().zip(NOISE_COUNTS);
    newest.len() >= STILL_PACKETS
        && kinds.into_iter().all(|(quantity, noise)| {
            let of_kind = (0..CHANNEL_COUNT).filter(|k| CHANNELS[*k].quantity == quantity);
            let range = |k: usize| {
                let values = newest.iter().filter_map(|reading| counts(reading)[k]);
                let (least, most) = values.fold((i16::MAX, i16::MIN), |(low, high), v| (low.min(v), high.max(v)));
                (least <= most).then(|| f64::from(most) - f64::from(least))
            };
            let mut ranges: Vec<f64> = of_kind.filter_map(range).collect();
            ranges.sort_by(f64::total_cmp);
            ranges
                .get(ranges.len() / 2)
                .is_none_or(|median| *median <= STILL_SIGMAS * noise)
        })
}
