//! A table of counts, as `ground decode --counts` writes it, as readings.
//!
//! In: CSV with the columns `counter` and the 36 channels by name (`a1x` .. `t4`); `errors` in hexadecimal, `lift_off` and
//! `micro_g` where they are there. Out: readings in the order of the rows; an empty cell was not read. Refuses files
//! without those columns, tables in SI (with `t_s`, without `counter`) and cells that are no whole number, with line and column.

use std::io::BufRead;

use emems::sample::{Errors, NOT_READ, Reading};
use logs::recording::RecordingError;
use packets::channel::CHANNELS;

/// Whether a header is that of such a table.
pub fn is_one(header: &str) -> bool {
    let mut names = header.trim_end().split(',').map(str::trim);
    names.any(|name| name == CHANNELS[0].name)
}

/// Reads the rows; `file` is what errors call them.
pub fn parse(file: &str, lines: impl BufRead) -> Result<Vec<Reading>, RecordingError> {
    let io = |error| RecordingError::Io {
        file: file.to_string(),
        error,
    };
    let mut lines = lines.lines();
    let header = lines.next().transpose().map_err(io)?.unwrap_or_default();
    let names: Vec<&str> = header.trim_end().split(',').map(str::trim).collect();
    let place = |column: &'static str| names.iter().position(|name| *name == column);
    if place("counter").is_none() && place("t_s").is_some() {
        return Err(RecordingError::Converted { file: file.to_string() });
    }
    let needed = |column: &'static str| {
        place(column).ok_or_else(|| RecordingError::Column {
            file: file.to_string(),
            column,
            found: names.join(", "),
        })
    };
    let counter = needed("counter")?;
    let channels: Vec<(&'static str, usize)> = CHANNELS
        .iter()
        .map(|channel| Ok((channel.name, needed(channel.name)?)))
        .collect::<Result<_, RecordingError>>()?;
    let mut readings = Vec::new();
    for (index, line) in lines.enumerate() {
        let line = line.map_err(io)?;
        if line.trim().is_empty() {
            continue;
        }
        let cells: Vec<&str> = line.trim_end().split(',').map(str::trim).collect();
        let cell = |at: usize| cells.get(at).copied().unwrap_or_default();
        let number = |at: usize, column: &'static str, radix: u32| {
            let text = cell(at);
            let refused = || RecordingError::Cell {
                file: file.to_string(),
                line: index + 2,
                column,
                cell: text.to_string(),
            };
            if text.is_empty() {
                return Ok(None);
            }
            i32::from_str_radix(text, radix).map(Some).map_err(|_| refused())
        };
        let mut reading = Reading::unread(number(counter, "counter", 10)?.unwrap_or_default() as u16);
        reading.errors = Errors(match place("errors") {
            Some(at) => number(at, "errors", 16)?.unwrap_or_default() as u16,
            None => 0,
        });
        let flag = |column| place(column).is_some_and(|at| cell(at) == "1");
        (reading.lift_off, reading.micro_g) = (flag("lift_off"), flag("micro_g"));
        let mut counts = Vec::with_capacity(CHANNELS.len());
        for (column, at) in &channels {
            counts.push(number(*at, column, 10)?.map_or(NOT_READ, |counts| counts as i16));
        }
        fill(&mut reading, &counts);
        readings.push(reading);
    }
    Ok(readings)
}

/// Counts in the order of [`CHANNELS`], which is the packet's.
fn fill(reading: &mut Reading, counts: &[i16]) {
    let places = reading
        .acc_p
        .as_flattened_mut()
        .iter_mut()
        .chain(reading.mag_p.as_flattened_mut())
        .chain(&mut reading.gyro)
        .chain(&mut reading.gyro_temperature)
        .chain(&mut reading.temperature);
    for (place, counts) in places.zip(counts) {
        *place = *counts;
    }
}

#[cfg(test)]
mod tests {
    use packets::channel;

    use super::*;

    fn table(row: &str) -> String {
        let names: Vec<&str> = CHANNELS.iter().map(|channel| channel.name).collect();
        format!("t_s,counter,errors,lift_off,micro_g,{}\n{row}\n", names.join(","))
    }

    #[test]
    fn every_channel_comes_back_under_its_own_name() {
        let row = format!(
            "0.4,2,00F0,1,0,{}",
            (1..=36).map(|n| n.to_string()).collect::<Vec<_>>().join(",")
        );
        let read = parse("log.csv", table(&row).as_bytes()).expect("readings");
        let expected: Vec<Option<i16>> = (1..=36).map(Some).collect();
        assert_eq!(channel::counts(&read[0]).to_vec(), expected);
        assert_eq!((read[0].counter, read[0].errors), (2, Errors(0xF0)));
        assert_eq!((read[0].lift_off, read[0].micro_g), (true, false));
    }

    #[test]
    fn empty_cells_were_not_read_and_rubbish_is_named() {
        let row = |cell: &str| format!("0.4,2,0000,0,0,{cell}{}", ",5".repeat(35));
        let read = parse("log.csv", table(&row("")).as_bytes()).expect("readings");
        assert_eq!((read[0].acc_p[0][0], read[0].acc_p[0][1]), (NOT_READ, 5));
        let error = parse("log.csv", table(&row("x")).as_bytes()).expect_err("no number");
        assert!(error.to_string().contains("line 2, column \"a1x\""), "{error}");
        let error = parse("log.csv", "t_s,a1x\n".as_bytes()).expect_err("no counter");
        assert!(error.to_string().contains("counter"), "{error}");
        let converted = table("0").replace(",counter,errors,lift_off,micro_g", "");
        let error = parse("si.csv", converted.as_bytes()).expect_err("in SI");
        assert!(error.to_string().contains("packets.txt or counts.csv"), "{error}");
        assert!(is_one("t_s,counter,a1x") && !is_one("t_s,gyr_x"));
    }
}
