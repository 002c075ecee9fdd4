//! A raw log: every sample of some channels, in counts.
//!
//! In: a stream of the unit's packets, however damaged, or a table with a column a channel. Out: one row of samples a
//! cycle, `NaN` where a value was not read, stood at the end of its part's range, or a packet is missing. Packets are told from
//! tables by their first frame. Refused: channels the log does not have, and logs without a sample.

use std::path::Path;

use packets::{
    channel::{self, CHANNELS, Reach},
    stream::{Bytes5To8, Decoder, Item},
};

use crate::table::{self, Table, TableError};

/// Most packets that may be missing between two before the gap counts as the counter's restart: an hour.
const LONGEST_GAP: u16 = 18_000;

/// Reads the samples of `channels` and the bytes they came from.
///
/// # Errors
/// When the file cannot be read, or does not have them.
pub fn samples(file: &Path, channels: &[String]) -> Result<(Vec<Vec<f64>>, Vec<u8>), TableError> {
    let bytes = table::bytes(file)?;
    let samples = if is_packets(&bytes) {
        packets(file, &bytes, channels)?
    } else {
        cells(file, &bytes, channels)?
    };
    if samples.is_empty() {
        return Err(error(file, "", "holds no sample".into()));
    }
    Ok((samples, bytes))
}

/// Whether bytes hold an intact packet near their start.
fn is_packets(bytes: &[u8]) -> bool {
    const START: usize = 64 * 1024;
    let mut decoder = Decoder::new(Bytes5To8::Errors);
    let items = decoder.push(bytes.get(..START).unwrap_or(bytes));
    items.iter().any(|item| matches!(item, Item::Packet { .. }))
}

fn packets(file: &Path, bytes: &[u8], channels: &[String]) -> Result<Vec<Vec<f64>>, TableError> {
    let place = |name: &String| {
        let found = CHANNELS.iter().position(|channel| channel.name == name);
        found.ok_or_else(|| error(file, name, "is no channel of a packet".into()))
    };
    let places: Vec<usize> = channels.iter().map(place).collect::<Result<_, _>>()?;
    let mut decoder = Decoder::new(Bytes5To8::Errors);
    let mut samples: Vec<Vec<f64>> = Vec::new();
    let mut last: Option<u16> = None;
    for item in decoder.push(bytes) {
        let Item::Packet { reading, .. } = item else { continue };
        let missing = last.map_or(0, |last| reading.counter.wrapping_sub(last).wrapping_sub(1));
        if missing <= LONGEST_GAP {
            samples.extend((0..missing).map(|_| vec![f64::NAN; places.len()]));
        }
        last = Some(reading.counter);
        let counts = channel::counts(&reading);
        samples.push(places.iter().map(|&place| whole(place, counts[place])).collect());
    }
    Ok(samples)
}

/// Counts that are a measurement: not those at the end of a part's range, which say only that it was more.
fn whole(place: usize, counts: Option<i16>) -> f64 {
    let measured = counts.filter(|counts| CHANNELS[place].quantity.reach(*counts) == Reach::Within);
    measured.map_or(f64::NAN, f64::from)
}

fn cells(file: &Path, bytes: &[u8], channels: &[String]) -> Result<Vec<Vec<f64>>, TableError> {
    let table = Table::parse(file, bytes)?;
    let place = |name: &String| {
        let why = || format!("is not in the file, which has {}", table.columns.join(", "));
        table.column(name).ok_or_else(|| error(file, name, why()))
    };
    let places: Vec<usize> = channels.iter().map(place).collect::<Result<_, _>>()?;
    let row = |row| {
        places
            .iter()
            .map(|&place| Ok(table.number(row, place)?.unwrap_or(f64::NAN)))
            .collect()
    };
    table.rows.iter().map(row).collect()
}

fn error(file: &Path, column: &str, why: String) -> TableError {
    TableError {
        file: file.into(),
        line: 0,
        column: column.into(),
        why,
    }
}

#[cfg(test)]
mod tests {
    use emems::{packet::encode, sample::Reading};

    use super::*;

    fn write(bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let place = tempfile::tempdir().expect("temporary folder");
        let file = place.path().join("log");
        std::fs::write(&file, bytes).expect("write");
        (place, file)
    }

    #[test]
    fn a_missing_packet_is_a_row_without_samples() {
        let mut bytes = b"G_ST\r\n".to_vec();
        for counter in [7, 9] {
            let mut reading = Reading::unread(counter);
            reading.gyro[1] = 100 + counter as i16;
            bytes.extend(encode(&reading));
        }
        let (_place, file) = write(&bytes);
        let (samples, _) = samples(&file, &["g2".into(), "g1".into()]).expect("packets");
        assert_eq!(samples.len(), 3);
        assert_eq!((samples[0][0], samples[2][0]), (107.0, 109.0));
        assert!(samples[1][0].is_nan() && samples[0][1].is_nan());
    }

    #[test]
    fn a_table_is_a_log_too_and_missing_columns_are_named() {
        let (_place, file) = write(b"t_s;g1\n0,0;5\n0,2;\n");
        let (found, _) = samples(&file, &["g1".into()]).expect("table");
        assert!(found[0][0] == 5.0 && found[1][0].is_nan());
        let error = samples(&file, &["g2".into()]).expect_err("no g2").to_string();
        assert!(
            error.ends_with("column g2: is not in the file, which has t_s, g1"),
            "{error}"
        );
        let (_place, empty) = write(b"g1\n");
        assert!(samples(&empty, &["g1".into()]).is_err());
    }
}
