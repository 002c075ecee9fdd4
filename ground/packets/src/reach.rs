//! How often each sensor stood at the end of its range, or gave a code that it cannot give.
//!
//! In: readings. Out: a [`Tally`], packets by sensor, for summaries and pages. A value at the end of a range says only that it
//! was that much or more; a code that the part cannot give says nothing at all.

use emems::sample::{NOT_READ, Reading, SENSOR_COUNT};

use crate::channel::{self, CHANNELS, Reach, sensor_name};

/// Packets by sensor, in reading order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// At the end of its range, on any axis.
    pub end: [u64; SENSOR_COUNT],
    /// With a code that the part cannot give.
    pub impossible: [u64; SENSOR_COUNT],
}

/// Sensors of a reading whose values have this reach, one bit each.
pub fn sensors(reading: &Reading, reach: Reach) -> u16 {
    let values = CHANNELS.iter().zip(channel::counts(reading));
    values
        .filter(|(channel, value)| value.is_some_and(|counts| channel.quantity.reach(counts) == reach))
        .fold(0, |bits, (channel, _)| bits | 1 << channel.slot())
}

/// A reading without the codes that no part can give.
pub fn without_impossible(mut reading: Reading) -> Reading {
    let values = (reading.acc_p.as_flattened_mut().iter_mut())
        .chain(reading.mag_p.as_flattened_mut())
        .chain(&mut reading.gyro)
        .chain(&mut reading.gyro_temperature)
        .chain(&mut reading.temperature);
    for (channel, value) in CHANNELS.iter().zip(values) {
        if *value != NOT_READ && channel.quantity.reach(*value) == Reach::Impossible {
            *value = NOT_READ;
        }
    }
    reading
}

impl Tally {
    /// Counts a packet.
    pub fn add(&mut self, reading: &Reading) {
        for (counts, reach) in [(&mut self.end, Reach::End), (&mut self.impossible, Reach::Impossible)] {
            let bits = sensors(reading, reach);
            for (slot, count) in counts.iter_mut().enumerate() {
                *count += u64::from(bits >> slot & 1);
            }
        }
    }

    /// What to print: a name and its value; nothing where nothing was counted.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        [
            ("packets at the end of range", &self.end),
            ("packets with impossible codes", &self.impossible),
        ]
        .into_iter()
        .filter_map(|(name, counts)| Some((name, by_sensor(counts)?)))
        .collect()
    }
}

/// `accelerometer 1: 12, gyro 3: 4`; `None` without any.
pub fn by_sensor(counts: &[u64; SENSOR_COUNT]) -> Option<String> {
    let words: Vec<String> = (counts.iter().enumerate())
        .filter(|(_, count)| **count > 0)
        .map(|(slot, count)| format!("{}: {count}", sensor_name(slot)))
        .collect();
    (!words.is_empty()).then(|| words.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipped_and_impossible_values_are_counted_by_sensor_and_the_impossible_ones_taken_out() {
        let mut reading = Reading::unread(1);
        reading.acc_p[1] = [12, 2047, 2047];
        reading.gyro[2] = -4368;
        reading.acc_p[3] = [0x7FFF, 3, 4];
        let mut tally = Tally::default();
        tally.add(&reading);
        tally.add(&Reading::unread(2));
        assert_eq!(
            tally.rows(),
            [
                (
                    "packets at the end of range",
                    "accelerometer 2: 1, gyro 3: 1".to_string()
                ),
                ("packets with impossible codes", "accelerometer 4: 1".to_string()),
            ]
        );
        let sound = without_impossible(reading);
        assert_eq!((sound.acc_p[3], sound.acc_p[1]), ([NOT_READ, 3, 4], [12, 2047, 2047]));
        assert_eq!(Tally::default().rows(), []);
    }
}
