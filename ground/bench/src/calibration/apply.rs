//! `ground calibration apply`: a set into the unit, over its umbilical, or as the file that is compiled in.
//!
//! The set is made into what the unit carries and checked as the unit checks it, whatever is then done with it.

use std::{path::PathBuf, time::Duration};

use emems::{
    calibration::{ENCODED_BYTES, Ranges},
    unit::Settings,
};
use serialport::{DataBits, FlowControl, Parity, StopBits};

use crate::{
    calibrate::{CalibrateError, read_set},
    report::Report,
    set::{Set, image, send},
};

/// The umbilical's rate.
const BAUD: u32 = 115_200;

/// Puts a calibration set into the unit
///
/// Over the umbilical the unit must be in WAIT; it checks the whole set and keeps the one it had if anything is wrong,
/// and what it then uses is read back and compared. It lasts until the unit's next start. To start with it, build the unit with
/// EMEMS_CALIBRATION naming the file that --image wrote. The set is for the unit's nominal ranges: 6 g, 1.3 gauss, 320 deg/s.
#[derive(Clone, Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("where").required(true).multiple(true).args(["port", "out"]))]
pub struct ApplyArguments {
    /// Calibration set
    set: PathBuf,
    /// Serial port of the umbilical (/dev/ttyUSB0, COM3): load it and read it back
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// Write the bytes the unit carries, to be compiled in, to this file
    #[arg(long = "image", alias = "out", id = "out", value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a page to this file
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Print the report as JSON
    #[arg(long)]
    pub json: bool,
}

pub fn apply(arguments: &ApplyArguments) -> Result<(), CalibrateError> {
    let set = read_set(&arguments.set)?;
    let image = image::image(&set, Ranges::of(&Settings::NOMINAL));
    let image = image.map_err(|error| CalibrateError::of(&arguments.set)(error.to_string()))?;
    let bytes = image.set.encode();
    let mut report = describe(&set, &image.nominal, checksum(&bytes));
    if let Some(path) = &arguments.out {
        let fail = CalibrateError::of(path);
        packets::output::replace_with(path, bytes).map_err(|error| fail(format!("cannot be written: {error}")))?;
        report.remarks.push(format!("its bytes are in {}", path.display()));
        report.next.push(format!(
            "to start with it: EMEMS_CALIBRATION={} cargo run --release, by its whole path",
            path.display()
        ));
    }
    if let Some(port) = &arguments.port {
        let fail = CalibrateError::of(port.as_ref());
        let opened = serialport::new(port, BAUD)
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .timeout(Duration::from_millis(200))
            .open();
        let mut line = opened.map_err(|error| fail(format!("cannot be opened: {error}")))?;
        let said = send::send(&mut line, &bytes).map_err(|error| fail(error.to_string()))?;
        report.remarks.push(format!("{said}; read back, the same"));
        report
            .next
            .push("it lasts until the unit's next start; to start with it, compile it in (--out)".into());
    }
    report
        .finish(
            arguments.page.as_deref(),
            &arguments.set.display().to_string(),
            arguments.json,
        )
        .map_err(CalibrateError::of(&arguments.set))
}

fn describe(set: &Set, nominal: &[String], crc: u32) -> Report {
    let mut report = Report {
        title: format!("Set {} of unit {} ({})", set.number, set.serial, set.unit),
        columns: ["channel", "part", "method", "counts per unit", "bias", "degC"]
            .map(String::from)
            .to_vec(),
        ..Report::default()
    };
    for entry in &set.channels {
        report.rows.push(vec![
            entry.name.clone(),
            entry.part.clone(),
            entry.method.clone(),
            format!("{:.6}", entry.sensitivity().norm()),
            entry
                .bias_counts
                .first()
                .map_or_else(String::new, |bias| format!("{bias:.4}")),
            entry
                .valid_c
                .map_or_else(|| "not measured".into(), |[low, high]| format!("{low:.1} to {high:.1}")),
        ]);
    }
    report.remarks.push(format!("the unit would take it; CRC-32 {crc:08X}"));
    if !nominal.is_empty() {
        report
            .remarks
            .push(format!("not calibrated, so nominal: {}", nominal.join(" ")));
    }
    if set.serial == 0 {
        report
            .remarks
            .push("it names no unit: any unit without a serial number takes it".into());
    }
    report
}

/// The CRC-32 a set ends with.
fn checksum(bytes: &[u8; ENCODED_BYTES]) -> u32 {
    bytes.last_chunk().map_or(0, |crc| u32::from_le_bytes(*crc))
}
