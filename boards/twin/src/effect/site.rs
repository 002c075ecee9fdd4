//! Where an effect acts when it acts on one channel, and what the description tells about the neighbours.

use std::collections::BTreeSet;

use nalgebra::Vector3;

use crate::channel::{Channel, Kind, UnitDescription};
use crate::environment::Environment;

/// A channel among the others, at a place on Earth, in a log.
#[derive(Clone, Copy)]
pub struct Site<'a> {
    /// The unit.
    pub unit: &'a UnitDescription,
    /// Index of the channel.
    pub index: usize,
    /// The channel.
    pub channel: &'a Channel,
    /// Where the unit is.
    pub environment: &'a Environment,
    /// \[s\] first and last cycle of the log.
    pub log_s: (f64, f64),
}

impl Site<'_> {
    /// The channels of the same kind in the same group, in the order of the file: x, y, z of one chip.
    pub fn triad(&self) -> Vec<usize> {
        self.of_group(&self.channel.group, self.channel.sensor)
    }

    /// The channels of this kind in this group, in the order of the file.
    pub fn of_group(&self, group: &str, sensor: Kind) -> Vec<usize> {
        let channels = self.unit.channels.iter().enumerate();
        let wanted = channels.filter(|(_, channel)| channel.group == group && channel.sensor == sensor);
        wanted.map(|(index, _)| index).collect()
    }

    /// An axis of the plate in b, `which` of 1, 2, 3: that of its accelerometer's or else its magnetometer's channel.
    pub fn plate_axis_b(&self, which: f64) -> Option<Vector3<f64>> {
        let place = (which as usize).checked_sub(1)?;
        let vectors = [Kind::Accelerometer, Kind::Magnetometer];
        let triads = vectors
            .into_iter()
            .map(|sensor| self.of_group(&self.channel.group, sensor));
        let index = triads.filter_map(|triad| triad.get(place).copied()).next()?;
        Some(self.unit.channels[index].axis_b)
    }

    /// Place of the channel's sensor in the reading order: how many sensors are read before it. The slots tell that, but not of
    /// parts that convert by clocks of their own, whose slots are as old as their readings: of these the order of the file does.
    pub fn read_position(&self) -> usize {
        let channels = &self.unit.channels;
        if channels.iter().any(|channel| channel.instant_sigma_s.is_some()) {
            let chip = |channel: &Channel| (channel.group.clone(), channel.sensor);
            let before: BTreeSet<_> = channels.iter().take(self.index).map(chip).collect();
            return before.len() - usize::from(before.contains(&chip(self.channel)));
        }
        let before = channels.iter().map(|channel| channel.slot_s);
        let mut before: Vec<f64> = before.filter(|slot_s| *slot_s < self.channel.slot_s).collect();
        before.sort_by(f64::total_cmp);
        before.dedup();
        before.len()
    }
}
