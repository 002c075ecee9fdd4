//! `ground recover`: a raw image or a dump, as tables, with all that is missing.
//!
//! In: the file. Out: CSV on standard output or in a file, or Parquet in a file; boots, gaps, damage and what is kept for the next start on
//! standard error.
//! Refuses a file larger than a chip and a newer format; otherwise whatever is readable is recovered.

use std::{
    io::{self, BufWriter, Read, Write},
    path::{Path, PathBuf},
};

use emems::{
    board::ResetCause,
    crash::CrashCause,
    flight_log::record::Start,
    mode::{Cause, Change},
    rail::Rail,
    site,
};
use packets::{
    input, output,
    stream::{Bytes5To8, Decoder, Item},
};

use crate::{
    log::{self, LIMIT, Log, LogError},
    parquet, table,
};

/// Gaps that are listed one by one.
const GAPS_LISTED: usize = 100;

/// Recovers records from a raw NAND image or a dump of the recorder
///
/// Reads every page (528 bytes each) of an image, or every frame of what `ground dump` or an umbilical's recording kept,
/// corrects what can be corrected, and writes a row for each record. Boots, changes of mode, gaps, damage, and the launch rail and site
/// that the chip keeps for the next start, go to standard error.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground recover nand.bin > flight.csv\n  ground recover flight.dump --counts --all-epochs --table all.csv\n  ground recover nand.bin --table flight.parquet"
)]
pub struct RecoverArguments {
    /// Raw image of the chip or a dump, gzip or not
    pub file: PathBuf,
    /// Values in counts instead of SI
    #[arg(long)]
    pub counts: bool,
    /// Records of older epochs too: erased by command, but not overwritten yet
    #[arg(long)]
    pub all_epochs: bool,
    /// Write the table to FILE instead of standard output; Parquet if it ends in .parquet
    #[arg(long, alias = "out", value_name = "FILE")]
    pub table: Option<PathBuf>,
    /// Print boots, changes of mode, gaps, damage, and the launch rail and site kept on standard output as JSON instead; needs --table
    #[arg(long, requires = "table")]
    pub json: bool,
}

/// Why nothing was recovered.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    /// The file cannot be read.
    #[error("{path}: {source}", path = path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file is no log.
    #[error("{path}: {source}", path = path.display())]
    Log {
        /// Which.
        path: PathBuf,
        /// Why.
        source: LogError,
    },
    /// There is no record in it.
    #[error("{path}: not one record in it: {why}", path = path.display())]
    Nothing {
        /// Which.
        path: PathBuf,
        /// What it looks like instead.
        why: &'static str,
    },
    /// The output cannot be written.
    #[error("the output cannot be written: {0}")]
    Output(#[from] io::Error),
}

/// Runs `ground recover`.
///
/// # Errors
/// When the file cannot be read or is no log, or the output cannot be written.
pub fn run(arguments: &RecoverArguments) -> Result<(), RecoverError> {
    let path = &arguments.file;
    let content = content(path)?;
    let log = log::read(&content).map_err(|source| RecoverError::Log {
        path: path.clone(),
        source,
    })?;
    if log.packets.is_empty() && log.headers.is_empty() && log.damage.newer.is_empty() {
        return Err(RecoverError::Nothing {
            path: path.clone(),
            why: nothing(&content),
        });
    }
    match &arguments.table {
        Some(out) if out.extension().is_some_and(|extension| extension == "parquet") => {
            let records = || log.packets_of(arguments.all_epochs);
            output::replace(out, |file| parquet::write(file, records(), !arguments.counts))?;
        }
        Some(out) => output::replace(out, |file| write_rows(&log, arguments, file))?,
        None => write_rows(&log, arguments, &mut BufWriter::new(io::stdout().lock()))?,
    }
    if arguments.json {
        // Through a writer, so that a closed pipe is an error and no panic.
        writeln!(io::stdout().lock(), "{}", json(&log, arguments.all_epochs))?;
    } else {
        write_remarks(&log, arguments.all_epochs, &mut BufWriter::new(io::stderr().lock()))?;
    }
    Ok(())
}

/// What [`write_remarks`] says, for programs. Nothing is cut short.
fn json(log: &Log, all_epochs: bool) -> serde_json::Value {
    let written = log.packets_of(all_epochs).count();
    let boots = log.headers.iter().map(|(key, header)| {
        serde_json::json!({
            "epoch": key.epoch,
            "boot": key.boot,
            "unit": header.unit.as_str(),
            "firmware": header.firmware.as_str(),
            "calibration": header.calibration.as_str(),
            "period_us": header.period_us,
            "opened_us": header.opened_us,
            "started": header.start.as_ref().map(started),
        })
    });
    let changes = log.changes.iter().map(|(key, change)| {
        serde_json::json!({
            "epoch": key.epoch,
            "boot": key.boot,
            "at_us": change.at_us,
            "mode": change.mode.name(),
            "by": change.cause.name(),
            "rail": rail(change).map(|rail| rail.to_string()),
            "site": site(change).map(|site| site.to_string()),
        })
    });
    let gaps = log.gaps().into_iter().map(|gap| {
        let first = gap.first;
        serde_json::json!({
            "epoch": first.epoch, "boot": first.boot, "first": first.seq, "last": gap.last, "after_us": gap.after_us,
        })
    });
    let twice = log
        .damage
        .conflicts
        .iter()
        .map(|key| serde_json::json!([key.epoch, key.boot, key.seq]));
    let damage = &log.damage;
    serde_json::json!({
        "records": written,
        "left_out": log.packets.len() - written,
        "boots": boots.collect::<Vec<_>>(),
        "changes": changes.collect::<Vec<_>>(),
        "kept": log.superblock.json(),
        "gaps": gaps.collect::<Vec<_>>(),
        "damage": {
            "pages_used": damage.used,
            "bits_corrected": damage.corrected,
            "halves_lost": damage.lost,
            "pages_astray": damage.astray,
            "twice_with_other_content": twice.collect::<Vec<_>>(),
            "newer_formats": damage.newer.iter().map(ToString::to_string).collect::<Vec<_>>(),
        },
    })
}

/// The file, unless it is too large to be a log; nothing of such a file is read.
fn content(path: &Path) -> Result<Vec<u8>, RecoverError> {
    let fail = |source| RecoverError::Read {
        path: path.to_owned(),
        source,
    };
    let too_large = |length| RecoverError::Log {
        path: path.to_owned(),
        source: LogError::TooLarge(length),
    };
    let length = std::fs::metadata(path).map_err(fail)?.len();
    if length > LIMIT {
        return Err(too_large(length));
    }
    let mut content = Vec::new();
    let read = input::open(path).and_then(|bytes| bytes.take(LIMIT + 1).read_to_end(&mut content));
    read.map_err(fail)?;
    match content.len() as u64 {
        length if length > LIMIT => Err(too_large(length)),
        _ => Ok(content),
    }
}

/// Why there is no record in a file, as far as its bytes tell.
fn nothing(content: &[u8]) -> &'static str {
    let mut decoder = Decoder::new(Bytes5To8::Errors);
    let head = content.get(..input::HEAD_BYTES).unwrap_or(content);
    let items = decoder.push(head);
    if items.iter().any(|item| matches!(item, Item::Packet { .. })) {
        "it holds packets as the unit sends them; `ground decode` reads those"
    } else if log::is_image(content) {
        "it is an image of a recorder in which nothing was recorded, or all was erased"
    } else {
        input::looks_like(head)
    }
}

fn write_rows(log: &Log, arguments: &RecoverArguments, rows: &mut dyn Write) -> io::Result<()> {
    writeln!(rows, "{}", table::header())?;
    for (key, entry) in log.packets_of(arguments.all_epochs) {
        writeln!(rows, "{}", table::row(*key, entry, !arguments.counts))?;
    }
    rows.flush()
}

/// Boots, changes, gaps, damage, and what the next start begins with, a line each.
///
/// # Errors
/// When they cannot be written.
pub fn write_remarks(log: &Log, all_epochs: bool, remarks: &mut dyn Write) -> io::Result<()> {
    for (key, header) in &log.headers {
        writeln!(
            remarks,
            "epoch {} boot {}: unit {}, firmware {}, calibration {}, a packet every {} ms, opened at {:.3} s",
            key.epoch,
            key.boot,
            or_none(&header.unit),
            or_none(&header.firmware),
            or_none(&header.calibration),
            f64::from(header.period_us) * 1e-3,
            header.opened_us as f64 * 1e-6
        )?;
        if let Some(start) = &header.start {
            writeln!(remarks, "  {}", started(start))?;
        }
    }
    for (key, change) in &log.changes {
        writeln!(
            remarks,
            "epoch {} boot {}: mode {} at {:.3} s by {}{}",
            key.epoch,
            key.boot,
            change.mode.name(),
            change.at_us as f64 * 1e-6,
            change.cause.name(),
            rail(change).map_or(String::new(), |rail| format!(": {rail}"))
                + &site(change).map_or(String::new(), |site| format!(": {site}"))
        )?;
    }
    let gaps = log.gaps();
    for gap in gaps.iter().take(GAPS_LISTED) {
        let key = gap.first;
        let after = gap
            .after_us
            .map_or(String::new(), |us| format!(", after {:.3} s", us as f64 * 1e-6));
        writeln!(
            remarks,
            "epoch {} boot {}: records {} to {} are missing{after}",
            key.epoch, key.boot, key.seq, gap.last
        )?;
    }
    if gaps.len() > GAPS_LISTED {
        writeln!(remarks, "and {} more gaps", gaps.len() - GAPS_LISTED)?;
    }
    for key in log.damage.conflicts.iter().take(GAPS_LISTED) {
        writeln!(
            remarks,
            "epoch {} boot {} record {} stands there twice with different content; the first is used",
            key.epoch, key.boot, key.seq
        )?;
    }
    for version in &log.damage.newer {
        writeln!(
            remarks,
            "records of newer format {version} were left out: update this program"
        )?;
    }
    let written = log.packets_of(all_epochs).count();
    let older = log.packets.len() - written;
    let damage = &log.damage;
    writeln!(remarks, "records    {written}, {older} of older epochs left out")?;
    writeln!(remarks, "gaps       {}", gaps.len())?;
    writeln!(
        remarks,
        "medium     {} pages used, {} bits corrected, {} halves lost, {} pages astray",
        damage.used, damage.corrected, damage.lost, damage.astray
    )?;
    for line in log.superblock.lines() {
        writeln!(remarks, "{line}")?;
    }
    remarks.flush()
}

/// The rail that the attitude took.
fn rail(change: &Change) -> Option<Rail> {
    match change.cause {
        Cause::RailTaken(rail) => Some(rail),
        _ => None,
    }
}

/// The site with which the estimation began afresh.
fn site(change: &Change) -> Option<site::Told> {
    match change.cause {
        Cause::SiteTaken(site) => Some(site),
        _ => None,
    }
}

/// How a unit started, in words.
fn started(start: &Start) -> String {
    let reset = match start.reset {
        ResetCause::PowerOn => "power-on",
        ResetCause::Watchdog => "the watchdog",
        ResetCause::Software => "the firmware",
        ResetCause::Pin => "the reset pin",
    };
    let crash = start.crash.as_ref().map_or(String::new(), |crash| {
        let at = match crash.cause {
            CrashCause::Panic => format!("panic at line {} of ..{}", crash.at, crash.place),
            CrashCause::HardFault => format!(
                "hard fault at {:08X}, lr {:08X}, CFSR {:08X}",
                crash.at, crash.lr, crash.cfsr
            ),
            CrashCause::UnhandledException => format!("exception {} without a handler", crash.at as i32),
            CrashCause::StackOverflow => format!("stack overflow, its pointer at {:08X}", crash.at),
        };
        format!("; crash before it: {at}, after {:.3} s", crash.uptime_us as f64 * 1e-6)
    });
    format!("started by {reset}, start {} since power-on{crash}", start.starts)
}

fn or_none(name: &str) -> &str {
    if name.is_empty() { "none" } else { name }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    #[test]
    fn what_a_unit_says_of_its_start_and_its_modes_is_told() {
        use emems::{
            crash::CrashRecord,
            flight_log::record::{BootHeader, Key},
            mode::{Cause, Change, Mode},
        };
        let mut log = Log::default();
        let start = Start {
            reset: ResetCause::Software,
            starts: 3,
            crash: Some(CrashRecord::new(
                CrashCause::Panic,
                123,
                0,
                0,
                90_500_000,
                "unit/acquire.rs",
            )),
        };
        let header = BootHeader {
            start: Some(start),
            ..BootHeader::default()
        };
        log.headers.insert(Key::default(), header);
        let change = Change {
            at_us: 2_000_000,
            mode: Mode::Flight,
            recording: true,
            cause: Cause::LiftOff,
        };
        let taken = Change {
            at_us: 1_500_000,
            mode: Mode::Wait,
            recording: false,
            cause: Cause::RailTaken(Rail::of_bytes([0x1B, 0x58, 0x21, 0x34, 0x05, 0x03])),
        };
        log.changes.insert(
            Key {
                seq: 1,
                ..Key::default()
            },
            change,
        );
        log.changes.insert(
            Key {
                seq: 2,
                ..Key::default()
            },
            taken,
        );
        let bytes = [0x26, 0x34, 0xFF, 0x18, 0xF7, 0xDD, 0xFC, 0x84, 2, 0x0A, 0x40, 15, 0];
        log.changes.insert(
            Key {
                seq: 3,
                ..Key::default()
            },
            Change {
                cause: Cause::SiteTaken(site::Told::of_bytes(bytes)),
                ..taken
            },
        );
        let mut remarks = Vec::new();
        write_remarks(&log, false, &mut remarks).expect("written");
        let remarks = String::from_utf8(remarks).expect("text");
        let started = "started by the firmware, start 3 since power-on; crash before it: panic at line 123 of ..unit/acquire.rs, \
                       after 90.500 s";
        assert!(remarks.contains(started), "{remarks}");
        assert!(remarks.contains("mode FLIGHT at 2.000 s by lift-off"), "{remarks}");
        let json = json(&log, false);
        assert_eq!(json["boots"][0]["started"], started);
        assert_eq!(json["changes"][0]["mode"], "FLIGHT");
        let said = "azimuth 70.00 elevation 85.00 sigma 0.5 0.3 deg";
        let text = format!("mode WAIT at 1.500 s by the launch rail taken: {said}");
        assert!(remarks.contains(&text), "{remarks}");
        assert_eq!(json["changes"][1]["rail"], said);
        assert!(json["changes"][0]["rail"].is_null() && json["changes"][1]["site"].is_null());
        let said = "gravity 9.780 m/s2 latitude -2.32 declination -20.83 dip -8.92 sd 0.2 deg field 26.24 iron 0.15 uT per g 0.00 deg/s";
        let text = format!("mode WAIT at 1.500 s by the launch site taken: {said}");
        assert!(remarks.contains(&text), "{remarks}");
        assert_eq!(json["changes"][2]["site"], said);
        assert_eq!(
            (&json["changes"][0]["at_us"], &json["records"]),
            (&2_000_000.into(), &0.into())
        );
    }

    #[test]
    fn a_file_larger_than_a_chip_is_refused_unread() {
        let place = tempfile::tempdir().expect("temporary folder");
        let path = place.path().join("claims.bin");
        // Ten gigabytes that take no room.
        std::fs::File::create(&path)
            .and_then(|file| file.set_len(10 << 30))
            .expect("sparse file");
        let error = content(&path).expect_err("too large");
        assert!(
            error.to_string().contains("10737418240 bytes are more than any chip"),
            "{error}"
        );
    }

    #[test]
    fn what_is_no_log_is_an_error_and_the_file_that_was_there_stays() {
        let place = tempfile::tempdir().expect("temporary folder");
        let out = place.path().join("have.csv");
        std::fs::write(&out, "have").expect("written");
        let recover = |name: &str, bytes: &[u8]| {
            let file = place.path().join(name);
            std::fs::write(&file, bytes).expect("written");
            let arguments = RecoverArguments {
                file,
                counts: true,
                all_epochs: false,
                table: Some(out.clone()),
                json: false,
            };
            run(&arguments).expect_err(name).to_string()
        };
        assert!(recover("empty", b"").contains("it is empty"));
        assert!(recover("page.html", b"<!doctype html>").contains("web page"));
        let packet = emems::packet::encode(&emems::sample::Reading::unread(1));
        assert!(recover("packets.txt", &packet).contains("ground decode"));
        assert!(recover("cut.gz", b"\x1f\x8b\x08\x00").contains("cut.gz: "));
        assert_eq!(std::fs::read(&out).expect("there"), b"have");
    }

    #[test]
    fn a_chip_full_of_random_bytes_is_read_in_bounded_time() {
        let begun = Instant::now();
        let mut state = 1_u64;
        let image: Vec<u8> = (0..4096 * 32 * 528 / 8)
            .flat_map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (state ^ state >> 29).to_le_bytes()
            })
            .collect();
        let log = log::read(&image).expect("read");
        assert!(log.packets.is_empty());
        assert!(
            begun.elapsed().as_secs() < 60,
            "ten seconds alone, and a margin for company"
        );
    }

    #[test]
    fn what_is_missing_is_said() {
        let (mut rows, mut remarks) = (Vec::new(), Vec::new());
        let arguments = RecoverArguments {
            file: "none".into(),
            counts: true,
            all_epochs: false,
            table: None,
            json: false,
        };
        write_rows(&Log::default(), &arguments, &mut rows).expect("written");
        write_remarks(&Log::default(), false, &mut remarks).expect("written");
        let remarks = String::from_utf8(remarks).expect("text");
        assert!(
            remarks.contains("records    0, 0 of older epochs left out"),
            "{remarks}"
        );
        assert_eq!(String::from_utf8(rows).expect("text").lines().count(), 1);
    }
}
