//! Records as CSV, in counts or nominal SI.
//!
//! In: a key and its entry. Out: header and rows. Columns: the key (`epoch`, `boot`, `seq`), `t_s` within the boot, the
//! mode, health (hexadecimal), the packet's counter, errors, lift-off and micro-g, its thirty-six channels, when each of
//! the sixteen sensors was sampled after `t_s` [us], and the estimator's state. What was not measured is an empty cell.

use std::fmt::Write;

use emems::{
    flight_log::record::{Entry, Key},
    packet,
    sample::{NO_SLOT, Reading, SENSOR_COUNT},
};
use packets::channel::{self, CHANNELS};

/// Names of the estimator's columns: attitude, gyro bias [rad/s], deviations of attitude [rad] and bias [rad/s],
/// sensors not used (hexadecimal).
const ESTIMATE: &str =
    "q0,q1,q2,q3,bias_x,bias_y,bias_z,sigma_x,sigma_y,sigma_z,sigma_bias_x,sigma_bias_y,sigma_bias_z,sensors";
/// Commas of as many empty cells.
const NO_ESTIMATE: &str = ",,,,,,,,,,,,,";

/// The header.
pub fn header() -> String {
    let mut header = String::from("epoch,boot,seq,t_s,mode,health,counter,errors,lift_off,micro_g");
    for channel in &CHANNELS {
        push(&mut header, format_args!(",{}", channel.name));
    }
    for slot in 0..SENSOR_COUNT {
        push(&mut header, format_args!(",slot_{slot}_us"));
    }
    header + "," + ESTIMATE
}

/// A record's row.
pub fn row(key: Key, entry: &Entry, si: bool) -> String {
    // A record whose packet is none was not written by a unit; its row says so by its empty cells.
    let decoded = packet::decode(&entry.packet).ok();
    let reading = decoded.unwrap_or(Reading::unread(0));
    let mut row = format!(
        "{},{},{},{:.6},{},{:08X},{},{:04X},{},{}",
        key.epoch,
        key.boot,
        key.seq,
        entry.start_us as f64 * 1e-6,
        if entry.flight { "FLIGHT" } else { "WAIT" },
        entry.health.0,
        decoded.map_or(String::new(), |reading| reading.counter.to_string()),
        reading.errors.0,
        u8::from(reading.lift_off),
        u8::from(reading.micro_g)
    );
    for (channel, value) in CHANNELS.iter().zip(channel::counts(&reading)) {
        row.push(',');
        match value {
            Some(value) if si => {
                let (value, decimals) = (channel.quantity.si(value), channel.quantity.decimals());
                push(&mut row, format_args!("{value:.decimals$}"));
            }
            Some(value) => push(&mut row, format_args!("{value}")),
            None => {}
        }
    }
    for slot_us in entry.slots_us {
        row.push(',');
        if slot_us != NO_SLOT {
            push(&mut row, format_args!("{slot_us}"));
        }
    }
    row.push(',');
    match &entry.estimate {
        Some(estimate) => {
            let values = estimate.q_nb.iter().chain(&estimate.bias_b).chain(&estimate.sigma);
            let values: Vec<String> = values.map(|value| format!("{value:e}")).collect();
            row += &values.join(",");
            push(&mut row, format_args!(",{:08X}", estimate.sensors.0));
        }
        None => row += NO_ESTIMATE,
    }
    row
}

/// Writing to a string does not fail.
fn push(row: &mut String, text: std::fmt::Arguments<'_>) {
    let _ = row.write_fmt(text);
}

#[cfg(test)]
mod tests {
    use emems::{derived::Health, faults::SensorHealth, flight_log::record::Estimate};

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
