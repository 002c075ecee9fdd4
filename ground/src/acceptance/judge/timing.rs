//! Packets as they arrive, and what the unit says of its buses.

use emems::{
    health::Health,
    sample::{NO_SLOT, SENSORS},
};
use packets::stream::sequence::{Sequence, Step};

use super::Finding;
use crate::acceptance::{
    evidence::{Evidence, Packet, Stage, spread},
    limits,
    status::Status,
};

/// Packets that were sent without a pause: from the first pose to the last turn. What comes later answers words, or is read back.
pub fn sent(evidence: &Evidence) -> Vec<&Packet> {
    let (Some(first), Some(last)) = (evidence.stretches.first(), evidence.stretches.last()) else {
        return Vec::new();
    };
    let within = first.from_s..=last.to_s;
    evidence
        .packets
        .iter()
        .filter(|packet| within.contains(&packet.at_s))
        .collect()
}

/// Arrival of each packet off the straight line through all \[s\], and the period \[s\]; by its number from the first.
pub fn arrivals(evidence: &Evidence) -> Option<(f64, Vec<(f64, f64)>)> {
    let mut sequence = Sequence::default();
    let numbered = |packet: &&Packet| (sequence.number(packet.reading.counter).0 as f64, packet.at_s);
    let points: Vec<(f64, f64)> = sent(evidence).iter().map(numbered).collect();
    let (n, _) = spread(&points.iter().map(|point| point.0).collect::<Vec<_>>())?;
    let (t, _) = spread(&points.iter().map(|point| point.1).collect::<Vec<_>>())?;
    let (mut over, mut under) = (0.0, 0.0);
    for (number, at_s) in &points {
        over += (number - n) * (at_s - t);
        under += (number - n).powi(2);
    }
    let period_s = over / under;
    let off = points
        .iter()
        .map(|(number, at_s)| (*number, at_s - t - period_s * (number - n)));
    (under > 0.0).then(|| (period_s, off.collect()))
}

fn finding(part: &str, what: &'static str, measured: String, limit: String, good: bool, check: &str) -> Finding {
    Finding {
        part: part.into(),
        what,
        measured,
        limit,
        good,
        check: check.into(),
    }
}

/// Period, jitter, missing packets, damage on the line.
pub fn packets(evidence: &Evidence) -> Vec<Finding> {
    let Some((period_s, off)) = arrivals(evidence) else {
        return Vec::new();
    };
    let ppm = 1e6 * (period_s / limits::PERIOD_S - 1.0);
    let most = off.iter().map(|(_, off_s)| off_s.abs()).fold(0.0, f64::max);
    let mut sequence = Sequence::default();
    let steps = sent(evidence)
        .into_iter()
        .map(|packet| sequence.number(packet.reading.counter).1);
    let missed: u64 = steps
        .map(|step| match step {
            Step::Missed(count) => u64::from(count),
            Step::Jumped => 1,
            _ => 0,
        })
        .sum();
    let noise = Status::all(evidence).last().and_then(|status| status.noise);
    vec![
        finding(
            "packets",
            "period as received",
            format!("{:.4} ms ({ppm:+.0} ppm)", 1e3 * period_s),
            format!("200 ms within {} ppm", limits::PERIOD_PPM),
            ppm.abs() <= limits::PERIOD_PPM,
            "the crystal: value and load capacitors; this computer's clock",
        ),
        finding(
            "packets",
            "jitter as received",
            format!("{:.1} ms at most", 1e3 * most),
            format!("{:.0} ms", 1e3 * limits::JITTER_S),
            most <= limits::JITTER_S,
            "the adapter's latency timer and this computer's load; then the unit's clock",
        ),
        finding(
            "packets",
            "missing",
            format!("{missed} of {}", off.len()),
            "0".into(),
            missed == 0,
            "the umbilical's cable and ground, the level shifter, this computer's load",
        ),
        finding(
            "umbilical",
            "damaged, unit to ground",
            format!("{} places", evidence.unread),
            "0".into(),
            evidence.unread == 0,
            "TX wire (PB10), ground, level shifter, baud rate",
        ),
        finding(
            "umbilical",
            "damaged, ground to unit",
            noise.map_or("not said".into(), |bytes| format!("{bytes} bytes")),
            "0".into(),
            noise == Some(0),
            "RX wire (PB11), ground, level shifter, baud rate",
        ),
    ]
}

/// \[us\] one accelerometer takes in a cycle: the median over all cycles of the mean over plates; `None` without derived frames.
pub fn read_us(evidence: &Evidence) -> Option<f64> {
    let mut taken: Vec<f64> = (evidence.frames.iter())
        .filter(|frame| frame.stage != Stage::SelfTest)
        .filter_map(|frame| {
            let slots = &frame.derived.slots_us;
            // The first four slots are accelerometers, the fifth begins when the fourth is read.
            let (first, last) = (slots[0], slots[4]);
            (first != NO_SLOT && last != NO_SLOT).then(|| (f64::from(last) - f64::from(first)) / 4.0)
        })
        .collect();
    taken.sort_by(f64::total_cmp);
    taken.get(taken.len() / 2).copied()
}

/// Errors of the buses, counted over the whole test but the self-test, and how long a read takes.
pub fn bus(evidence: &Evidence) -> Vec<Finding> {
    let mut found = Vec::new();
    // A sensor under test is not read, and is configured again afterwards.
    let is_awake = |stage: Stage| !matches!(stage, Stage::SelfTest | Stage::Talk);
    let counted: Vec<&Packet> = evidence
        .packets
        .iter()
        .filter(|packet| is_awake(packet.stage))
        .collect();
    let errors: Vec<(usize, usize)> = (0..SENSORS.len())
        .map(|slot| {
            (
                slot,
                counted
                    .iter()
                    .filter(|packet| packet.reading.errors.contains(slot))
                    .count(),
            )
        })
        .filter(|(_, count)| *count > 0)
        .collect();
    let names: Vec<String> = errors
        .iter()
        .map(|(slot, count)| format!("{} {count}", SENSORS[*slot]))
        .collect();
    found.push(finding(
        "buses",
        "readings that failed",
        if names.is_empty() { "0".into() } else { names.join(", ") },
        "0".into(),
        names.is_empty(),
        "of one sensor: its solder and supply; of one plate: its cable and channel; of all: pull-ups, the multiplexer",
    ));
    let healths = || evidence.frames.iter().filter(|frame| is_awake(frame.stage));
    let count = |bit: Health| healths().filter(|frame| frame.derived.health.contains(bit)).count();
    let counts = [
        (
            "times the sensor bus was freed",
            Health::BUS_RECOVERED,
            "a part or a cable that holds SDA or SCL low; pull-ups (PB6, PB7)",
        ),
        (
            "cycles cut off by the deadline",
            Health::DEADLINE,
            "a part that stretches the clock, or several that do not answer",
        ),
        (
            "parts that lost their settings",
            Health::RECONFIGURED,
            "a part that browns out: its supply, its decoupling capacitor",
        ),
        (
            "cycles with an alarm of a gyro",
            Health::GYRO_ALARM,
            "5 V of the gyros; SPI frames (SCK edges, length of the wires)",
        ),
        (
            "magnetometer overflows",
            Health::MAGNETOMETER_OVERFLOW,
            "a magnet or a current near the plates",
        ),
    ];
    let is_there = healths().next().is_some();
    for (what, bit, check) in counts {
        let measured = if is_there {
            count(bit).to_string()
        } else {
            "no derived frames".into()
        };
        found.push(finding(
            "buses",
            what,
            measured,
            "0".into(),
            is_there && count(bit) == 0,
            check,
        ));
    }
    let limit_us = limits::READ_US * limits::READ_FACTOR;
    if let Some(taken_us) = read_us(evidence) {
        found.push(finding(
            "sensor bus",
            "time of a read",
            format!("{taken_us:.0} us"),
            format!("{limit_us:.0} us"),
            taken_us <= limit_us,
            "a slow bus: pull-ups of SCL and SDA too weak (4.7 kohm to 3.3 V at PB6 and PB7) or cables too long; a part that stretches the clock",
        ));
    }
    found
}
