//! Records as a table, in counts or nominal SI: its columns, a record's values, and both as CSV.
//!
//! In: a key and its entry. Out: names, values, and lines without their ends. Columns: the key (`epoch`, `boot`, `seq`),
//! `t_s` within the boot, the mode, health, the packet's counter, errors, lift-off and micro-g, its thirty-six channels,
//! when each of the sixteen sensors was sampled after `t_s` \[us\], and the estimator's state: attitude, gyro bias [rad/s],
//! deviations of attitude \[rad\] and bias [rad/s], sensors not used. What was not measured is an empty cell.

use std::fmt;

use emems::{
    flight_log::record::{Entry, Key},
    packet,
    sample::{NO_SLOT, Reading, SENSOR_COUNT},
};
use packets::channel::{self, CHANNELS};

/// One cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A number that is whole.
    Whole(u64),
    /// Bits, and how many hexadecimal digits show them all.
    Bits(u32, usize),
    /// Counts of a sensor.
    Counts(i16),
    /// A number that is not whole, and the decimals that lose nothing of it.
    Fixed(f64, usize),
    /// A number of the estimator's.
    Real(f32),
    /// A word.
    Word(&'static str),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Whole(value) => value.fmt(f),
            Value::Bits(bits, digits) => write!(f, "{bits:0digits$X}"),
            Value::Counts(counts) => counts.fmt(f),
            Value::Fixed(value, decimals) => write!(f, "{value:.decimals$}"),
            Value::Real(value) => write!(f, "{value:e}"),
            Value::Word(word) => f.write_str(word),
        }
    }
}

/// What a column holds, whatever its record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// [`Value::Whole`], [`Value::Bits`] or [`Value::Counts`].
    Integer,
    /// [`Value::Fixed`] or [`Value::Real`].
    Number,
    /// [`Value::Word`].
    Word,
}

/// Names of the estimator's columns that are numbers; one of bits follows.
const ESTIMATE: [&str; 13] = [
    "q0",
    "q1",
    "q2",
    "q3",
    "bias_x",
    "bias_y",
    "bias_z",
    "sigma_x",
    "sigma_y",
    "sigma_z",
    "sigma_bias_x",
    "sigma_bias_y",
    "sigma_bias_z",
];

/// Every column, in order.
pub fn columns(si: bool) -> Vec<(String, Kind)> {
    let integers = |names: &[&str]| {
        names
            .iter()
            .map(|name| (name.to_string(), Kind::Integer))
            .collect::<Vec<_>>()
    };
    let of_channels = if si { Kind::Number } else { Kind::Integer };
    let mut columns = integers(&["epoch", "boot", "seq"]);
    columns.extend([("t_s".into(), Kind::Number), ("mode".into(), Kind::Word)]);
    columns.extend(integers(&["health", "counter", "errors", "lift_off", "micro_g"]));
    columns.extend(CHANNELS.iter().map(|channel| (channel.name.to_string(), of_channels)));
    columns.extend((0..SENSOR_COUNT).map(|slot| (format!("slot_{slot}_us"), Kind::Integer)));
    columns.extend(ESTIMATE.map(|name| (name.into(), Kind::Number)));
    columns.extend(integers(&["sensors"]));
    columns
}

/// A record's values, one a column.
pub fn values(key: Key, entry: &Entry, si: bool) -> Vec<Option<Value>> {
    // A record whose packet is none was not written by a unit; its row says so by its empty cells.
    let decoded = packet::decode(&entry.packet).ok();
    let reading = decoded.unwrap_or(Reading::unread(0));
    let mut values = vec![
        Some(Value::Whole(key.epoch.into())),
        Some(Value::Whole(key.boot.into())),
        Some(Value::Whole(key.seq.into())),
        Some(Value::Fixed(entry.start_us as f64 / 1e6, 6)),
        Some(Value::Word(if entry.flight { "FLIGHT" } else { "WAIT" })),
        Some(Value::Bits(entry.health.0, 8)),
        decoded.map(|reading| Value::Whole(reading.counter.into())),
        Some(Value::Bits(reading.errors.0.into(), 4)),
        Some(Value::Whole(reading.lift_off.into())),
        Some(Value::Whole(reading.micro_g.into())),
    ];
    values.extend(CHANNELS.iter().zip(channel::counts(&reading)).map(|(channel, counts)| {
        let quantity = channel.quantity;
        counts.map(|counts| {
            if si {
                Value::Fixed(quantity.si(counts), quantity.decimals())
            } else {
                Value::Counts(counts)
            }
        })
    }));
    let slot = |slot_us: u32| (slot_us != NO_SLOT).then_some(Value::Whole(slot_us.into()));
    values.extend(entry.slots_us.map(slot));
    match &entry.estimate {
        Some(estimate) => {
            let numbers = estimate.q_nb.iter().chain(&estimate.bias_b).chain(&estimate.sigma);
            values.extend(numbers.map(|value| Some(Value::Real(*value))));
            values.push(Some(Value::Bits(estimate.sensors.0, 8)));
        }
        None => values.extend([None; ESTIMATE.len() + 1]),
    }
    values
}

/// The header of the CSV.
pub fn header() -> String {
    let names: Vec<String> = columns(true).into_iter().map(|(name, _)| name).collect();
    names.join(",")
}

/// A record's row of the CSV.
pub fn row(key: Key, entry: &Entry, si: bool) -> String {
    let cell = |value: Option<Value>| value.map_or(String::new(), |value| value.to_string());
    let cells: Vec<String> = values(key, entry, si).into_iter().map(cell).collect();
    cells.join(",")
}

#[cfg(test)]
mod tests {
    use emems::{faults::SensorHealth, flight_log::record::Estimate, health::Health};

    use super::*;

    fn entry() -> Entry {
        let mut reading = Reading::unread(7);
        reading.acc_p[0] = [-315, 0, 1];
        let mut slots_us = [NO_SLOT; SENSOR_COUNT];
        slots_us[0] = 240;
        Entry {
            start_us: 1_400_003,
            packet: packet::encode(&reading),
            slots_us,
            flight: true,
            health: Health(0x4FFFF),
            estimate: None,
        }
    }

    #[test]
    fn a_row_has_a_cell_for_every_name() {
        let key = Key {
            epoch: 1,
            boot: 2,
            seq: 3,
        };
        let with_estimate = Entry {
            estimate: Some(Estimate {
                q_nb: [1.0, 0.0, 0.0, 0.0],
                bias_b: [0.25; 3],
                sigma: [0.5; 6],
                sensors: SensorHealth(1),
            }),
            ..entry()
        };
        for entry in [entry(), with_estimate] {
            let cells = |line: &str| line.split(',').count();
            assert_eq!(cells(&row(key, &entry, true)), cells(&header()));
        }
        let counts = row(key, &entry(), false);
        assert!(
            counts.starts_with("1,2,3,1.400003,FLIGHT,0004FFFF,7,FFFF,0,0,-315,0,1,,"),
            "{counts}"
        );
        assert!(
            row(key, &entry(), true).contains(",-9.26728,0.00000,0.02942,,"),
            "{}",
            row(key, &entry(), true)
        );
    }
}
