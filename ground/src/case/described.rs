//! What a log is, and the unit that sent it as its owners describe it.
//!
//! In: the bytes of a log, and what the command line names of the unit. Out: packets or CSV, and the description, each channel read
//! when the log says: by the mean slots of its derived frames, else by the design, half a conversion of its part before. With a
//! calibration set, its parameters, and the sigmas of its covariance.

use std::fs;

use bench::set::{Set, unit::refine};
use gap::input::{case::Kind as LogKind, log::Column};
use packets::stream::{Bytes5To8, Decoder, Item};
use twin::predict::{Channel, Kind, UnitDescription, conversion_s, emems};

use super::made::{MadeError, NewCaseArguments};

/// Packets or CSV; the mean slots \[s\] of a log with derived frames.
///
/// # Errors
/// When it is neither.
pub fn format_of(bytes: &[u8], name: &str) -> Result<(LogKind, Option<Vec<f64>>), MadeError> {
    let mut decoder = Decoder::new(Bytes5To8::Errors);
    let items = decoder.push(bytes);
    let packets = items.iter().filter(|item| matches!(item, Item::Packet { .. })).count();
    if packets > 0 {
        let mut sums: Option<(Vec<f64>, f64)> = None;
        for item in &items {
            if let Item::Derived { derived, .. } = item {
                let (slots, count) = sums.get_or_insert_with(|| (vec![0.0; derived.slots_us.len()], 0.0));
                slots
                    .iter_mut()
                    .zip(derived.slots_us.iter())
                    .for_each(|(sum, slot_us)| *sum += 1e-6 * f64::from(*slot_us));
                *count += 1.0;
            }
        }
        let slots = sums.map(|(slots, count)| slots.into_iter().map(|sum| sum / count).collect());
        return Ok((LogKind::Packets, slots));
    }
    let header = bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
    match header.starts_with(b"t_s,") {
        true => Ok((LogKind::Csv, None)),
        false => Err(MadeError::Wrong(format!(
            "{name}: holds no packet, and is no CSV whose header begins with t_s; give what the console kept, or a CSV in SI"
        ))),
    }
}

/// The unit, its channels read when the log says.
///
/// # Errors
/// When a file of it cannot be used.
pub fn unit(
    arguments: &NewCaseArguments,
    kind: LogKind,
    slots: Option<&Vec<f64>>,
    said: &mut Vec<String>,
) -> Result<UnitDescription, MadeError> {
    let mut unit = match &arguments.unit {
        Some(path) => UnitDescription::open(path)?,
        // The read cycle of sixteen sensors lasts 4.2 ms.
        None => emems(|slot| {
            slots
                .and_then(|slots| slots.get(slot).copied())
                .unwrap_or(slot as f64 * 0.28e-3)
        }),
    };
    if arguments.unit.is_none() {
        for channel in &mut unit.channels {
            let period_s = conversion_s(channel.sensor);
            channel.slot_s -= 0.5 * period_s;
            if channel.sensor != Kind::Thermometer {
                channel.instant_sigma_s = Some(period_s / 12f64.sqrt());
            }
        }
        let source = if slots.is_some() {
            "derived frames"
        } else {
            "the design"
        };
        said.push(format!(
            "unit       the design; slots by {source}, less half a conversion"
        ));
    } else {
        said.push("unit       as given".to_owned());
    }
    if let Some(path) = &arguments.set {
        let file = path.display().to_string();
        let wrong = |why| MadeError::Set {
            file: file.clone(),
            why,
        };
        let text = fs::read_to_string(path).map_err(|source| MadeError::File {
            path: path.clone(),
            source,
        })?;
        let set = Set::parse(&text).map_err(wrong)?;
        let refined = refine(&unit.text(), &set, None).map_err(wrong)?;
        unit = UnitDescription::read(&refined, &file)?;
        said.push(format!(
            "           {} channels and their sigmas by the covariance of {file}",
            set.channels.len()
        ));
    } else {
        said.push(
            "           no --set: sigmas are the design's; a set's covariance says what the calibration knew"
                .to_owned(),
        );
    }
    if kind == LogKind::Csv {
        // Physical values: nothing is counted.
        for channel in &mut unit.channels {
            (channel.lsb, channel.bits) = (1.0, None);
            if channel.name.starts_with("tg") {
                channel.bias = 0.0;
            }
        }
    }
    Ok(unit)
}

/// What the log's reader must know of the channels.
pub fn columns(unit: &UnitDescription) -> Vec<Column> {
    let column = |channel: &Channel| Column {
        name: channel.name.clone(),
        lsb: channel.lsb,
        sensor: channel.sensor,
        bias: channel.bias,
        range: channel.range,
        code_range: None,
        overflow_counts: None,
    };
    unit.channels.iter().map(column).collect()
}
