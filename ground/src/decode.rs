//! `ground decode`: a stream that was kept, or the recorder's chip, as tables.
//!
//! In: a file of packets, however damaged, or a raw image of the NAND, gzip or not, or standard input. Out: CSV on standard
//! output, gaps and rejected bytes on standard error; or with `--out` a folder with everything. An image is told by its
//! first [`HEAD`] bytes, where superblock and log begin. The attitude of a page is estimated at the launch site that the flight log says.
//! Memory does not grow with a stream; an image is bounded by the largest chip.

pub(crate) mod cycle;
mod image;
mod input;

use std::{
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    time::Duration,
};

use attitude::told::{self, NothingTold};
use emems::{
    nand::PAGE_BYTES,
    site::{self, Site},
    unit::Settings,
};
use logs::{
    digest::{Digest, StreamEntry},
    folder::{self, Folder, FolderError},
    table,
};
use packets::{
    input::looks_like,
    stream::{Bytes5To8, sequence::CYCLE_S},
};
use recorder::log::{self, LogError};

use self::{
    cycle::{Contradicted, Cycle},
    input::Input,
};

/// \[bytes\] 62 blocks of an image, four of them the superblock's.
const HEAD: u64 = 1 << 20;

/// Decodes packets to CSV and lists gaps and bytes that are no packet
///
/// Reads 156-byte packets (and derived frames) from a file however cut, spliced or mixed with other text: every intact
/// one is decoded, the rest is reported by offset, length and reason on standard error. Values are SI with nominal scale
/// (m/s2, uT, rad/s, degC); a value that was not read is an empty cell, and so is one in SI that no part can give; time is
/// counter times cycle, which derived frames say themselves. A raw image of the
/// recorder's NAND (528 bytes a page) is recognised and gives its newest epoch's records; `recover` gives the others. The
/// attitude on the page is at the launch site that an image says, or else the --flight-log.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground decode umbilical.log > flight.csv\n  ground decode flight.txt.gz --out decoded\n  ground decode nand.bin --out decoded\n  ground decode flight.dump --out decoded --flight-log flight.dump"
)]
pub struct DecodeArguments {
    /// File of packets, gzip or not; - for standard input
    pub file: PathBuf,
    /// Values in counts instead of SI, with counter, error bits and flags
    #[arg(long, conflicts_with = "out")]
    pub counts: bool,
    /// Write a folder in DIR instead: counts.csv, si.csv, flight.mcap (Foxglove, PlotJuggler), log.txt, summary.txt, plots in
    /// index.html; of an image also records.parquet
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the summary as JSON
    #[arg(long, requires = "out")]
    pub json: bool,
    /// The unit's flight log, image or dump, which says at which launch site the page's attitude is; of an image it is its own [default: the
    /// site that is compiled in]
    #[arg(long, value_name = "FILE", requires = "out")]
    pub flight_log: Option<PathBuf>,
    /// Bytes 5 to 8 are a CRC-16 (streams after Table A.2), not the error identifier
    #[arg(long)]
    pub crc: bool,
    /// Time between two packets of a stream; derived frames and an image say it themselves [default: 200ms]
    #[arg(long, value_name = "TIME", value_parser = cycle)]
    pub cycle: Option<Duration>,
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
    /// The flight log cannot be used.
    #[error(transparent)]
    FlightLog(#[from] NothingTold),
    /// There is no packet in it.
    #[error("{path}: not one packet in it: {looks}")]
    NoPackets {
        /// Which file.
        path: PathBuf,
        /// What it looks like instead.
        looks: &'static str,
    },
    /// Its derived frames contradict the cycle.
    #[error("{path}: {source}")]
    Cycle {
        /// Which file.
        path: PathBuf,
        /// How.
        source: Contradicted,
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
/// When the file cannot be read, holds no packet, contradicts the cycle that was told, or is an image of a newer log; and when
/// the output cannot be written. What else is in the file is passed over, and said. Of a file that breaks off, what came
/// before is written first.
pub fn decode(arguments: &DecodeArguments) -> Result<(), DecodeError> {
    let mut input = Input::open(&arguments.file)?;
    // A stream that is still being sent is not kept waiting: its first bytes are text, those of an image are not.
    let mut head = input.first(PAGE_BYTES as u64)?;
    if !head.is_ascii() {
        head.extend(input.first(HEAD)?);
    }
    let looks = looks_like(&head);
    let no_packets = || DecodeError::NoPackets {
        path: arguments.file.clone(),
        looks,
    };
    let stdout = &mut BufWriter::new(io::stdout().lock());
    let stderr = &mut BufWriter::new(io::stderr().lock());
    if log::is_image(&head) {
        let log = image::log(input, head)?;
        if log.packets.is_empty() && log.headers.is_empty() && log.damage.newer.is_empty() {
            return Err(DecodeError::NoPackets {
                path: arguments.file.clone(),
                looks: "it is an image of a recorder in which nothing was recorded, or all was erased",
            });
        }
        return match &arguments.out {
            None => image::to_text(&log, arguments.counts, stdout, stderr),
            Some(parent) => image::to_folder(&log, &name(arguments), parent, arguments.json),
        };
    }
    let told = arguments.flight_log.as_deref().map(told::open).transpose()?;
    let site = told.as_ref().and_then(told::site);
    let any = match &arguments.out {
        None => to_text(arguments, input.after(head), stdout, stderr)?,
        Some(parent) => to_folder(arguments, site, input.after(head), parent)?,
    };
    if any { Ok(()) } else { Err(no_packets()) }
}

fn name(arguments: &DecodeArguments) -> String {
    let name = arguments
        .file
        .file_name()
        .map(|name| name.to_string_lossy().into_owned());
    name.filter(|name| name != "-").unwrap_or("stdin".into())
}

fn stem(name: &str) -> &str {
    name.split('.').next().filter(|stem| !stem.is_empty()).unwrap_or("log")
}

/// Where the unit was: as it was told, or else at the site that is compiled in.
fn place(told: Option<site::Told>) -> Site {
    let compiled_in = Settings::NOMINAL.site;
    told.map_or(compiled_in, |told| told.site(&compiled_in))
}

fn finish(
    mut folder: Folder,
    digest: Digest,
    told: Option<site::Told>,
    [stem, name]: [&str; 2],
    json: bool,
) -> Result<(), DecodeError> {
    let (rest, record) = digest.finish();
    folder.entries(&rest)?;
    let mut rows = record.summary.rows();
    rows.extend(told.map(|told| ("launch site", told.to_string())));
    let path = folder.finish(stem, &format!("decoded from {name}"), &rows, &record, None)?;
    let page = path.join("index.html");
    if json {
        let rows: serde_json::Map<_, _> = (rows.into_iter())
            .map(|(name, value)| (name.to_string(), value.into()))
            .collect();
        println!("{}", serde_json::json!({ "summary": rows, "page": page }));
    } else {
        print!("{}", folder::text_of(&rows));
        println!("{}", page.display());
    }
    Ok(())
}

/// Reads a stream to its end and gives its entries away with their cycle \[s\] once that is known; what came of it. A stream
/// that breaks off is an error for afterwards.
#[allow(clippy::type_complexity)] // A pair of what was found and what went wrong at last.
fn stream(
    arguments: &DecodeArguments,
    site: Option<site::Told>,
    input: Input,
    mut put: impl FnMut(f64, &[StreamEntry]) -> Result<(), DecodeError>,
) -> Result<(Cycle, Digest, Option<DecodeError>), DecodeError> {
    let told_s = arguments.cycle.map(|cycle| cycle.as_secs_f64());
    let mut digest = match arguments.out {
        Some(_) => Digest::new(bytes_5_to_8(arguments), told_s.unwrap_or(CYCLE_S), &place(site)),
        None => Digest::summing(bytes_5_to_8(arguments)),
    };
    let mut cycle = Cycle::new(told_s);
    let read = input.read(|piece| {
        let entries = cycle
            .take(digest.push(None, piece))
            .map_err(|source| DecodeError::Cycle {
                path: arguments.file.clone(),
                source,
            })?;
        if cycle.hopeless() {
            return Err(DecodeError::NoPackets {
                path: arguments.file.clone(),
                looks: "its bytes are no text of the unit",
            });
        }
        if entries.is_empty() {
            Ok(())
        } else {
            put(cycle.s(), &entries)
        }
    });
    let broken = match read {
        Err(error @ DecodeError::Read { .. }) if cycle.any() => Some(error),
        other => other.map(|()| None)?,
    };
    let rest = cycle.rest();
    if cycle.any() {
        put(cycle.s(), &rest)?;
    }
    Ok((cycle, digest, broken))
}

/// Rows and remarks; whether there was a packet.
fn to_text(
    arguments: &DecodeArguments,
    input: Input,
    rows: &mut dyn Write,
    remarks: &mut dyn Write,
) -> Result<bool, DecodeError> {
    let header = if arguments.counts {
        table::counts_header()
    } else {
        table::si_header()
    };
    let mut header = Some(header);
    let mut put = |cycle_s: f64, entries: &[StreamEntry]| -> Result<(), DecodeError> {
        if let Some(header) = header.take() {
            writeln!(rows, "{header}")?;
        }
        for entry in entries {
            if let StreamEntry::Packet { number, reading, .. } = entry {
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
    let (cycle, digest, broken) = stream(arguments, None, input, &mut put)?;
    if !cycle.any() {
        return Ok(false);
    }
    let (rest, record) = digest.finish();
    put(cycle.s(), &rest)?;
    rows.flush()?;
    write!(remarks, "{}", folder::text_of(&record.summary.rows()))?;
    remarks.flush()?;
    broken.map_or(Ok(true), Err)
}

/// A folder; none without a packet, and whether there was one.
fn to_folder(
    arguments: &DecodeArguments,
    site: Option<site::Told>,
    input: Input,
    parent: &Path,
) -> Result<bool, DecodeError> {
    let name = name(arguments);
    let mut made: Option<Folder> = None;
    let (_, digest, broken) = stream(arguments, site, input, |cycle_s, entries| {
        let folder = match &mut made {
            Some(folder) => folder,
            none => none.insert(Folder::create(parent, stem(&name), cycle_s)?),
        };
        Ok(folder.entries(entries)?)
    })?;
    let Some(folder) = made else { return Ok(false) };
    finish(folder, digest, site, [stem(&name), &name], arguments.json)?;
    broken.map_or(Ok(true), Err)
}

fn bytes_5_to_8(arguments: &DecodeArguments) -> Bytes5To8 {
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

    fn arguments(file: &Path) -> DecodeArguments {
        DecodeArguments {
            file: file.into(),
            counts: true,
            out: None,
            json: false,
            flight_log: None,
            crc: false,
            cycle: None,
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
        let any = to_text(&arguments(&file), input.after(head), &mut rows, &mut remarks).expect("decode");
        assert!(any);
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
    fn what_holds_no_packet_is_an_error_and_leaves_no_folder() {
        let place = tempfile::tempdir().expect("temporary folder");
        for (name, bytes, words) in [
            ("empty", b"".as_slice(), "it is empty"),
            ("page.html", b"<html>", "web page"),
            ("counts.csv", b"t_s,counter,a1x\n0,1,2\n", "a table"),
            ("noise", &[0x81, 0x40, 0x00, 0xFF], "no text"),
        ] {
            let file = place.path().join(name);
            std::fs::write(&file, bytes).expect("written");
            let out = place.path().join("out");
            let asked = DecodeArguments {
                counts: false,
                out: Some(out.clone()),
                ..arguments(&file)
            };
            for asked in [asked, arguments(&file)] {
                let error = decode(&asked).expect_err(name).to_string();
                assert!(error.contains(words), "{name}: {error}");
            }
            assert!(!out.exists(), "{name}");
        }
    }

    #[test]
    fn of_a_stream_that_breaks_off_what_came_is_written_before_the_error() {
        let place = tempfile::tempdir().expect("temporary folder");
        let file = place.path().join("cut.txt.gz");
        let mut packed = GzEncoder::new(Vec::new(), Compression::none());
        packed
            .write_all(&encode(&Reading::unread(2)).repeat(20))
            .expect("packed");
        let packed = packed.finish().expect("packed");
        std::fs::write(&file, &packed[..packed.len() - 300]).expect("written");
        let (mut rows, mut remarks) = (Vec::new(), Vec::new());
        let input = Input::open(&file).expect("open");
        let read = to_text(&arguments(&file), input, &mut rows, &mut remarks);
        assert!(matches!(read, Err(DecodeError::Read { .. })), "{read:?}");
        assert!(String::from_utf8_lossy(&rows).lines().count() > 10);
    }

    #[test]
    fn a_cycle_has_a_unit_and_a_least() {
        assert_eq!(cycle("100ms"), Ok(Duration::from_millis(100)));
        assert!(cycle("0s").is_err());
        assert!(cycle("fast").is_err());
    }
}
