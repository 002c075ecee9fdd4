//! The log of a case: the unit's own packets, or a table of physical values, to rows and channels.

use std::path::Path;

use packets::{
    channel::{self, CHANNELS, Quantity},
    stream::{
        Bytes5To8, Decoder, Item,
        sequence::{Sequence, Step},
    },
};

use super::{CaseError, Kind, plausible, read_bytes};
use crate::input::log::{Column, Log};

/// Reads a log.
///
/// # Errors
/// When the file cannot be read or does not fit the unit's channels.
pub fn read_measured(file: &Path, kind: Kind, columns: &[Column], cycle_s: Option<f64>) -> Result<Log, CaseError> {
    let bytes = read_bytes(file)?;
    match (kind, cycle_s) {
        (Kind::Packets, Some(cycle_s)) => from_packets(file, &bytes, columns, cycle_s),
        (Kind::Packets, None) => Err(CaseError::key(
            file,
            "cycle_s",
            "is absent from the unit; packets are numbered, not timed",
        )),
        (Kind::Csv | Kind::Table, cycle_s) => {
            from_csv(file, &bytes, columns, cycle_s.filter(|_| kind == Kind::Csv), kind)
        }
    }
}

fn from_packets(file: &Path, bytes: &[u8], columns: &[Column], cycle_s: f64) -> Result<Log, CaseError> {
    let places = columns
        .iter()
        .map(|column| {
            let found = CHANNELS.iter().position(|channel| channel.name == column.name);
            found.ok_or_else(|| CaseError::key(file, &column.name, "is a channel of the unit that packets do not have"))
        })
        .collect::<Result<Vec<usize>, CaseError>>()?;
    let mut log = Log::empty(columns.len());
    let mut decoder = Decoder::new(Bytes5To8::Errors);
    let mut items = decoder.push(bytes);
    items.extend(decoder.finish().map(Item::Reject));
    let mut sequence = Sequence::default();
    for item in &items {
        let reading = match item {
            Item::Packet { reading, .. } => reading,
            Item::Reject(_) => {
                log.stream.rejected += 1;
                continue;
            }
            Item::Derived { .. } | Item::Line { .. } => continue,
        };
        let (number, step) = sequence.number(reading.counter);
        match step {
            Step::Missed(missed) => log.stream.lost += u64::from(missed),
            Step::Jumped => log.stream.jumps += 1,
            Step::Repeated => {
                log.stream.repeated += 1;
                continue;
            }
            Step::First | Step::Next => {}
        }
        log.begin_row(number as f64 * cycle_s);
        let counts = channel::counts(reading);
        for (index, (column, place)) in columns.iter().zip(&places).enumerate() {
            let value = counts.get(*place).copied().flatten();
            let value = value.filter(|counts| Some(*counts) != column.overflow_counts);
            let value = value.filter(|counts| !is_before_conversion(number, *place, *counts));
            log.put(index, column, value.map(|counts| f64::from(counts) * column.lsb));
        }
    }
    if log.start_s.is_empty() {
        return Err(CaseError::key(file, "packets", "holds no intact packet"));
    }
    Ok(log)
}

/// Whether a thermometer has not converted yet: the temperature register of the TMP102 reads zero from power-on until its
/// first conversion is complete (SBOS397, "temperature register"), and the first packet may come before that.
fn is_before_conversion(number: u64, place: usize, counts: i16) -> bool {
    number == 0 && counts == 0 && CHANNELS[place].quantity == Quantity::Temperature
}

fn from_csv(file: &Path, bytes: &[u8], columns: &[Column], cycle_s: Option<f64>, kind: Kind) -> Result<Log, CaseError> {
    let mut reader = csv::Reader::from_reader(bytes);
    let malformed = |error: csv::Error| CaseError::key(file, "rows", error.to_string());
    let header = reader.headers().map_err(malformed)?.clone();
    if header.get(0) != Some("t_s") {
        return Err(CaseError::key(file, "header", "must begin with t_s"));
    }
    let place_of = |name: &str| header.iter().position(|cell| cell == name);
    let places = columns
        .iter()
        .map(|column| {
            place_of(&column.name)
                .ok_or_else(|| CaseError::key(file, &column.name, "is a channel of the unit without a column"))
        })
        .collect::<Result<Vec<usize>, CaseError>>()?;
    if let Some(stranger) = header
        .iter()
        .skip(1)
        .find(|name| columns.iter().all(|column| column.name != **name))
    {
        return Err(CaseError::key(file, stranger, "is a column the unit does not describe"));
    }
    let mut times_s = Vec::new();
    let mut rows: Vec<Vec<Option<f64>>> = Vec::new();
    let mut record = csv::StringRecord::new();
    let mut last_s = f64::NEG_INFINITY;
    while reader.read_record(&mut record).map_err(malformed)? {
        let line = || format!("line {}", record.position().map_or(0, csv::Position::line));
        let number = |place: usize| -> Result<Option<f64>, CaseError> {
            let cell = record.get(place).unwrap_or_default().trim();
            if cell.is_empty() {
                return Ok(None);
            }
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
            let name = header.get(place).unwrap_or_default();
            value
                .map(Some)
                .ok_or_else(|| CaseError::key(file, line(), format!("{name} is {cell:?}, not a finite number")))
        };
        let start_s = number(0)?.ok_or_else(|| CaseError::key(file, line(), "t_s is empty"))?;
        if start_s <= last_s {
            return Err(CaseError::key(
                file,
                line(),
                format!("t_s {start_s} does not come after {last_s}"),
            ));
        }
        last_s = start_s;
        times_s.push(start_s);
        rows.push(places.iter().map(|place| number(*place)).collect::<Result<_, _>>()?);
    }
    if times_s.is_empty() {
        return Err(CaseError::key(file, "rows", "has none"));
    }
    let of = |channel: usize| rows.iter().filter_map(|row| row[channel]).collect();
    let values: Vec<Vec<f64>> = (0..columns.len()).map(of).collect();
    // The rows of a table are commands, apart and few; what contradicts them is found with them.
    if kind == Kind::Csv
        && let Some((what, why)) = plausible::doubt(columns, &times_s, &values, cycle_s)
    {
        return Err(CaseError::key(file, what, why));
    }
    let zeros = plausible::zeros(columns, &values);
    let mut log = Log::empty(columns.len());
    for (start_s, row) in times_s.into_iter().zip(rows) {
        log.begin_row(start_s);
        for (index, (column, value)) in columns.iter().zip(row).enumerate() {
            log.put(index, column, value.map(|value| value + zeros[index]));
        }
    }
    Ok(log)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_before_the_first_conversion_is_no_temperature() {
        let place = |name: &str| CHANNELS.iter().position(|channel| channel.name == name).expect(name);
        assert!(is_before_conversion(0, place("t3"), 0));
        assert!(!is_before_conversion(0, place("t3"), 1) && !is_before_conversion(1, place("t3"), 0));
        assert!(!is_before_conversion(0, place("tg3"), 0) && !is_before_conversion(0, place("a1x"), 0));
    }
}
