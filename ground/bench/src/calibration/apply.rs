//! `ground calibration apply`: a set into the unit, over its umbilical, as a file or compiled in.
//!
//! The set is made into what the unit carries and checked as the unit checks it, whatever is then done with it.

use std::{fmt::Write, path::PathBuf, time::Duration};

use emems::{
    calibration::{ENCODED_BYTES, Ranges},
    unit::Settings,
};
use serialport::{DataBits, FlowControl, Parity, StopBits};

use crate::{
    calibrate::{CalibrateError, read_set},
    set::{image, send},
};

/// The umbilical's rate.
const BAUD: u32 = 115_200;

/// Puts a calibration set into the unit
///
/// Over the umbilical the unit must be in WAIT; it checks the whole set and keeps the one it had if anything is wrong,
/// and what it then uses is read back and compared. It lasts until the unit's next start. The set is for the unit's
/// nominal ranges: 6 g, 1.3 gauss, 320 deg/s.
#[derive(Clone, Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("where").required(true).multiple(true).args(["port", "out", "rust"]))]
pub struct Arguments {
    /// Calibration set
    set: PathBuf,
    /// Serial port of the umbilical (/dev/ttyUSB0, COM3): load it and read it back
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// Write the bytes the unit carries
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write them as a constant to be compiled in
    #[arg(long, value_name = "FILE")]
    rust: Option<PathBuf>,
}

pub fn apply(arguments: &Arguments) -> Result<(), CalibrateError> {
    let set = read_set(&arguments.set)?;
    let image = image::image(&set, Ranges::of(&Settings::NOMINAL));
    let image = image.map_err(|error| CalibrateError::of(&arguments.set)(error.to_string()))?;
    let bytes = image.set.encode();
    let what = format!(
        "set {} of unit {} ({}), {} channels, CRC-32 {:08X}",
        set.number,
        set.serial,
        set.unit,
        set.channels.len(),
        checksum(&bytes)
    );
    println!("{what}");
    if !image.nominal.is_empty() {
        println!("nominal: {}", image.nominal.join(" "));
    }
    let files = [
        (&arguments.out, bytes.to_vec()),
        (&arguments.rust, constant(&what, &bytes).into_bytes()),
    ];
    for (path, content) in files {
        let Some(path) = path else { continue };
        let fail = CalibrateError::of(path);
        std::fs::write(path, content).map_err(|error| fail(format!("cannot be written: {error}")))?;
        println!("{}", path.display());
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
        println!("{said}; read back, the same");
    }
    Ok(())
}

/// The CRC-32 a set ends with.
fn checksum(bytes: &[u8; ENCODED_BYTES]) -> u32 {
    bytes.last_chunk().map_or(0, |crc| u32::from_le_bytes(*crc))
}

fn constant(what: &str, bytes: &[u8; ENCODED_BYTES]) -> String {
    let mut text = format!("/// Calibration: {what}.\npub const CALIBRATION: [u8; {ENCODED_BYTES}] = [\n");
    // Writing to a string cannot fail.
    for line in bytes.chunks(16) {
        let cells: Vec<String> = line.iter().map(|byte| format!("0x{byte:02X},")).collect();
        let _ = writeln!(text, "    {}", cells.join(" "));
    }
    text + "];\n"
}
