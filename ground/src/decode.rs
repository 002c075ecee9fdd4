//! `ground decode`: a stream that was kept, or the recorder's chip, as tables.
//!
//! In: a file of packets, however damaged, or a raw image of the NAND, gzip or not, or standard input. Out: CSV on standard
//! output, gaps and rejected bytes on standard error; or with `--out` a folder with everything. An image is told by its
//! first [`HEAD`] bytes, where superblock and log begin. Memory does not grow with a stream; an image is bounded by the
//! largest chip.

mod image;
mod input;

use std::{
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    time::Duration,
};

use emems::nand::PAGE_BYTES;
use packets::stream::Bytes5To8;
use recorder::log::{self, LogError};

use self::input::Input;
use crate::{
    digest::{Digest, Entry},
    folder::{self, Folder, FolderError},
    table,
};

/// [bytes] 62 blocks of an image, four of them the superblock's.
const HEAD: u64 = 1 << 20;

/// Decodes packets to CSV and lists gaps and bytes that are no packet
///
/// Reads 156-byte packets (and derived frames) from a file however cut, spliced or mixed with other text: every intact
/// one is decoded, the rest is reported by offset, length and reason on standard error. Values are SI with nominal scale
/// (m/s2, uT, rad/s, degC); a value that was not read is an empty cell; time is counter times cycle. A raw image of the
/// recorder's NAND (528 bytes a page) is recognised and gives its newest epoch's records; `recover` gives the others.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground decode umbilical.log > flight.csv\n  ground decode flight.txt.gz --out decoded\n  ground decode nand.bin --out decoded"
)]
pub struct Arguments {
    /// File of packets, gzip if it ends in .gz; - for standard input
    pub file: PathBuf,
    /// Values in counts instead of SI, with counter, error bits and flags
    #[arg(long, conflicts_with = "out")]
    pub counts: bool,
    /// Write a folder in DIR instead: counts.csv, si.csv, log.txt, summary.txt, plots in index.html; of an image also
    /// records.parquet
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Bytes 5 to 8 are a CRC-16 (streams after Table A.2), not the error identifier
    #[arg(long)]
    pub crc: bool,
    /// Time between two packets of a stream; an image says it itself
    #[arg(long, value_name = "TIME", default_value = "200ms", value_parser = cycle)]
    pub cycle: Duration,
}

/// Why a file could not be decoded.
#[derive(Debug, thiserror::Error)]
pub enum DecodeError {
    /// It cannot be read.
    #[error("{path} cannot be read at byte {offset}: {source}")]
    Read {
        /// Which file.
        path: PathBuf,
        /// How far it was read, after unpacking.
        offset: u64,
        /// Why.
        source: io::Error,
    },
    /// It is an image, but not of a log that this program reads.
    #[error("{path}: {source}")]
    Image {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: LogError,
    },
    /// Standard output or error cannot be written.
    #[error("the output cannot be written: {0}")]
    Output(#[from] io::Error),
    /// The folder cannot be written.
    #[error(transparent)]
    Folder(#[from] FolderError),
}

/// Runs `ground decode`.
///
/// # Errors
/// When the file cannot be read or the output not written, or it is an image of a newer log; never because of what else is
/// in the file.
pub fn decode(arguments: &Arguments) -> Result<(), DecodeError> {
    let mut input = Input::open(&arguments.file)?;
    // A stream that is still being sent is not kept waiting: its first bytes are text, those of an image are not.
    let mut head = input.first(PAGE_BYTES as u64)?;
    if !head.is_ascii() {
        head.extend(input.first(HEAD)?);
    }
    let stdout = &mut BufWriter::new(io::stdout().lock());
    let stderr = &mut BufWriter::new(io::stderr().lock());
    let cycle_s = arguments.cycle.as_secs_f64();
    match (log::is_image(&head), &arguments.out) {
        (true, None) => image::to_text(&image::log(input, head)?, arguments.counts, stdout, stderr),
        (true, Some(parent)) => image::to_folder(&image::log(input, head)?, &name(arguments), parent),
        (false, None) => to_text(arguments, cycle_s, input.after(head), stdout, stderr),
        (false, Some(parent)) => to_folder(arguments, cycle_s, input.after(head), parent),
    }
}

fn name(arguments: &Arguments) -> String {
    let name = arguments
        .file
        .file_name()
        .map(|name| name.to_string_lossy().into_owned());
    name.filter(|name| name != "-").unwrap_or("stdin".into())
}

fn stem(name: &str) -> &str {
    name.split('.').next().filter(|stem| !stem.is_empty()).unwrap_or("log")
}

fn finish(mut folder: Folder, digest: Digest, stem: &str, name: &str) -> Result<(), DecodeError> {
    let (rest, summary, envelope) = digest.finish();
    folder.entries(&rest)?;
    let rows = summary.rows();
    let path = folder.finish(stem, &format!("decoded from {name}"), &rows, &summary, &envelope)?;
    print!("{}", folder::text_of(&rows));
    println!("{}", path.join("index.html").display());
    Ok(())
}

fn to_text(
    arguments: &Arguments,
    cycle_s: f64,
    input: Input,
    rows: &mut dyn Write,
    remarks: &mut dyn Write,
) -> Result<(), DecodeError> {
    let header = if arguments.counts {
        table::counts_header()
    } else {
        table::si_header()
    };
    writeln!(rows, "{header}")?;
    let mut digest = Digest::new(bytes_5_to_8(arguments));
    let mut put = |entries: &[Entry]| -> io::Result<()> {
        for entry in entries {
            if let Entry::Packet { number, reading, .. } = entry {
                let t_s = *number as f64 * cycle_s;
                let row = if arguments.counts {
                    table::counts_row(t_s, reading)
                } else {
                    table::si_row(t_s, reading)
                };
                writeln!(rows, "{row}")?;
            }
            if let Some(remark) = folder::remark(entry, cycle_s) {
                writeln!(remarks, "{remark}")?;
            }
        }
        Ok(())
    };
    input.read(|piece| Ok(put(&digest.push(None, piece))?))?;
    let (rest, summary, _) = digest.finish();
    put(&rest)?;
    rows.flush()?;
    write!(remarks, "{}", folder::text_of(&summary.rows()))?;
    Ok(remarks.flush()?)
}

fn to_folder(arguments: &Arguments, cycle_s: f64, input: Input, parent: &Path) -> Result<(), DecodeError> {
    let name = name(arguments);
    let mut folder = Folder::create(parent, stem(&name), cycle_s)?;
    let mut digest = Digest::new(bytes_5_to_8(arguments));
    input.read(|piece| Ok(folder.entries(&digest.push(None, piece))?))?;
    finish(folder, digest, stem(&name), &name)
}

fn bytes_5_to_8(arguments: &Arguments) -> Bytes5To8 {
    if arguments.crc {
        Bytes5To8::Crc
    } else {
        Bytes5To8::Errors
    }
}

fn cycle(text: &str) -> Result<Duration, String> {
    match humantime::parse_duration(text) {
        Ok(cycle) if cycle >= Duration::from_millis(1) => Ok(cycle),
        Ok(_) => Err("at least 1ms".into()),
        Err(error) => Err(format!("{error}; write it like 200ms")),
    }
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use emems::{packet::encode, sample::Reading};
    use flate2::{Compression, write::GzEncoder};

    use super::*;

    fn arguments(file: &Path) -> Arguments {
        Arguments {
            file: file.into(),
            counts: true,
            out: None,
            crc: false,
            cycle: Duration::from_millis(200),
        }
    }

    #[test]
    fn a_packed_stream_becomes_rows_and_remarks() {
        let place = tempfile::tempdir().expect("temporary folder");
        let file = place.path().join("log.txt.gz");
        let mut packed = GzEncoder::new(File::create(&file).expect("file"), Compression::fast());
        for bytes in [
            b"ok\n".as_slice(),
            &encode(&Reading::unread(2)),
            &encode(&Reading::unread(4)),
        ] {
            packed.write_all(bytes).expect("write");
        }
        packed.finish().expect("finish");
        let (mut rows, mut remarks) = (Vec::new(), Vec::new());
        let mut input = Input::open(&file).expect("open");
        let head = input.first(7).expect("a beginning");
        to_text(&arguments(&file), 0.2, input.after(head), &mut rows, &mut remarks).expect("decode");
        let rows = String::from_utf8(rows).expect("text");
        let times: Vec<_> = rows
            .lines()
            .map(|row| row.split(',').take(3).collect::<Vec<_>>().join(","))
            .collect();
        assert_eq!(times, ["t_s,counter,errors", "0.400,2,FFFF", "0.800,4,FFFF"]);
        let remarks = String::from_utf8(remarks).expect("text");
        assert!(
            remarks.starts_with(
                "offset 0, 3 bytes: not part of a frame\noffset 159, packet 4, 0.800 s: 1 packet missed before it\npackets "
            ),
            "{remarks}"
        );
    }

    #[test]
    fn a_cycle_has_a_unit_and_a_least() {
        assert_eq!(cycle("100ms"), Ok(Duration::from_millis(100)));
        assert!(cycle("0s").is_err());
        assert!(cycle("fast").is_err());
    }
}
