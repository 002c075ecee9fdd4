//! What to fly, as asked for on the command line.
//!
//! In: the words after `ground fly`. Out: duration and faults of a run. Refuses what would silently do something else:
//! no time at all, a fault after the end, a sensor that does not exist.

use std::{path::PathBuf, time::Duration};

use emems::sample::SENSOR_COUNT;
use logs::table::SLOT_NAMES;
use trials::strike::Wish;
use twin::{
    part::Nanos,
    run::{Fault, Scheduled},
};

use crate::{case::instrument::Instrument, site};

/// How long a flight beside a console lasts at most: longer than anybody sits there, and within the unit's clock.
pub const UNTIL_TOLD: Duration = Duration::from_secs(100 * 365 * 86_400);

/// How long a motion without an end is flown.
const ENDLESS_S: f64 = 60.0;

/// Flies the unit: its release image on the emulated board, or with --host the same code on this computer
///
/// Sensors, buses and lines are modelled at register level; what they measure comes from a motion or a recording. The
/// telemetry is decoded as it comes and everything kept in a new folder: packets.txt, counts.csv, si.csv, flight.mcap, log.txt,
/// umbilical.txt, summary.txt, and plots of every sensor in index.html. The folder is a gap case too, for `ground gap`:
/// motion.csv is the motion as a reference instrument saw it, unit.toml the unit as described, case.toml the windows. The
/// same arguments give the same packets. Ctrl-C ends the flight; what was flown is kept.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  ground fly                                       a sounding rocket, from the pad to re-entry
  ground fly --motion still --duration 10min --derived
  ground fly --recording 07_fast_rotation.csv.gz   what a real unit felt
  ground fly --motion-file turns.csv --latitude-deg -2.37 --field-n-ut 24.2,-9.2,-4.1
  ground fly --motion tumble --silent a2@10s..20s --silent g4@15s
  ground fly --motion tumble --duration 3min --with gyro-scale=0.01@g2 --with vibration@20s..80s
  ground fly --motion rotation-1 --unit flights/tumble-1/corrected/unit.toml
  ground fly --console                             and talk to it; type G_HE")]
pub struct FlyArguments {
    /// Motion to fly; `ground sources` lists them [default: rocket]
    #[arg(long, value_name = "NAME", group = "source")]
    pub motion: Option<String>,
    /// Recording of a real unit to fly: CSV (.gz) with t_s, gyr_x..z, acc_x..z, mag_x..z
    #[arg(long, value_name = "FILE", group = "source")]
    pub recording: Option<PathBuf>,
    /// Recorded motion to fly: CSV (.gz) with t_s, qw, qx, qy, qz and perhaps px_m..pz_m
    #[arg(long, value_name = "FILE", group = "source")]
    pub motion_file: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)] // clap would take the text for the command's.
    pub units: logs::units::Units,
    /// Virtual time to fly, such as 90s, 10min, 24h [default: as long as the motion lasts, or 60s; with --console until told]
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub duration: Option<Duration>,
    /// Which specimen of the unit: biases and noise of its parts
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Run the unit's code on this computer instead of its image on the emulated board
    #[arg(long)]
    pub host: bool,
    /// Fly this image: the ELF file that cargo build --release leaves [default: the one in this program, else the sources']
    #[arg(long, value_name = "FILE", conflicts_with = "host")]
    pub image: Option<PathBuf>,
    /// Compare with this folder, the same flight on the host, and take its place where all packets are the same
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["host", "console"])]
    pub in_place_of: Option<PathBuf>,
    /// Where the flight's folder goes; an existing one is never overwritten
    #[arg(long, value_name = "DIR", default_value = "flights")]
    pub out: PathBuf,
    /// Fly no faster than real time
    #[arg(long)]
    pub real_time: bool,
    /// Sit at the umbilical of the flying unit, in real time
    #[arg(long)]
    pub console: bool,
    /// Ask the unit for derived frames: slot times, cycle time, gyro increments
    #[arg(long)]
    pub derived: bool,
    /// Silence a sensor (a1..a4, m1..m4, g1..g4, t1..t4) from a time on, or for a while: a2@10s, g1@10s..20s
    #[arg(long, value_name = "SENSOR@TIME", value_parser = silence)]
    pub silent: Vec<Silence>,
    /// Disturb the unit: NAME=SIZE@SENSOR@FROM..TO, all but the name if wanted, such as hard-iron, gyro-scale=0.01@g2, accel-bias=3x@a1,
    /// vibration@20s..80s; `ground effects` lists them. What was done is written to answer.toml
    #[arg(long, value_name = "EFFECT")]
    pub with: Vec<Wish>,
    /// Fly the unit that this description says, with the effects it is known to have (a unit.toml)
    #[arg(long, value_name = "FILE")]
    pub unit: Option<PathBuf>,
    /// What records the motion in motion.csv
    #[arg(long, value_enum, default_value_t)]
    pub reference: Instrument,
    /// Which flight of this specimen: another one has other noise
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub flight: u32,
    /// Say nothing but where the page is
    #[arg(long)]
    pub quiet: bool,
    /// Print the summary and where the page is as JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    #[allow(missing_docs)] // clap would take the text for the command's.
    pub site: site::SiteArguments,
}

/// A sensor that does not answer for a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Silence {
    /// Reading-order slot of the sensor.
    pub slot: usize,
    /// From when.
    pub from: Duration,
    /// Until when; `None` for good.
    pub to: Option<Duration>,
}

/// Why a plan is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// A fault after the end.
    #[error("--silent {sensor}@{at:?} is after the end of the flight at {end:?}; fly longer with --duration")]
    AfterTheEnd {
        /// Short name of the sensor.
        sensor: &'static str,
        /// When it would strike.
        at: Duration,
        /// When the flight ends.
        end: Duration,
    },
    /// There is no first flight.
    #[error("--in-place-of {0}: there is no such folder")]
    NoFirst(String),
    /// The time asked for does not fit the unit's clock of 2^64 ns.
    #[error("{0:?} is longer than the 584 years that can be flown")]
    TooLong(Duration),
}

/// How long to fly a source that lasts so long.
pub fn duration_of(asked: Option<Duration>, source_s: Option<f64>) -> Duration {
    let own = || Duration::try_from_secs_f64(source_s.unwrap_or(ENDLESS_S)).unwrap_or(Duration::MAX);
    asked.unwrap_or_else(own)
}

/// \[ns\] on the clock of a run.
///
/// # Errors
/// When it does not fit.
pub fn nanos(time: Duration) -> Result<Nanos, PlanError> {
    time.as_nanos().try_into().map_err(|_| PlanError::TooLong(time))
}

/// The faults of a flight that ends at `end`.
///
/// # Errors
/// When one would strike after the end.
pub fn faults(silences: &[Silence], end: Duration) -> Result<Vec<Scheduled>, PlanError> {
    let mut faults = Vec::new();
    for Silence { slot, from, to } in silences {
        let times = [(Some(*from), Fault::Silent(*slot)), (*to, Fault::Restored(*slot))];
        for (at, fault) in times {
            let Some(at) = at else { continue };
            if at >= end {
                let sensor = SLOT_NAMES.get(*slot).copied().unwrap_or_default();
                return Err(PlanError::AfterTheEnd { sensor, at, end });
            }
            faults.push(Scheduled { at: nanos(at)?, fault });
        }
    }
    faults.sort_by_key(|scheduled| scheduled.at);
    Ok(faults)
}

fn duration(text: &str) -> Result<Duration, String> {
    match time(text)? {
        Duration::ZERO => Err("there is nothing to fly in no time".into()),
        duration => Ok(duration),
    }
}

fn silence(text: &str) -> Result<Silence, String> {
    let form = || format!("write it like {}@10s or {}@10s..20s", SLOT_NAMES[1], SLOT_NAMES[8]);
    let (name, times) = text.split_once('@').ok_or_else(form)?;
    let slot = (0..SENSOR_COUNT).find(|slot| SLOT_NAMES.get(*slot) == Some(&name));
    let slot = slot.ok_or_else(|| format!("no sensor is called {name}: there are {}", SLOT_NAMES.join(" ")))?;
    let (from, to) = match times.split_once("..") {
        Some((from, to)) => (time(from)?, Some(time(to)?)),
        None => (time(times)?, None),
    };
    if to.is_some_and(|to| to <= from) {
        return Err(format!("{name} would answer again before it falls silent"));
    }
    Ok(Silence { slot, from, to })
}

fn time(text: &str) -> Result<Duration, String> {
    humantime::parse_duration(text).map_err(|error| format!("{error}; write it like 90s, 10min or 24h"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEN: Duration = Duration::from_secs(10);
    const TWENTY: Duration = Duration::from_secs(20);

    #[test]
    fn a_silence_is_a_sensor_and_a_time_or_two() {
        let (slot, from) = (1, TEN);
        assert_eq!(silence("a2@10s"), Ok(Silence { slot, from, to: None }));
        let to = Some(TWENTY);
        assert_eq!(silence("t4@10s..20s"), Ok(Silence { slot: 15, from, to }));
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_the_way_out() {
        let check = |text, words: &str| {
            let refusal = silence(text).expect_err(text);
            assert!(refusal.contains(words), "{refusal}");
        };
        check("a5@1s", "there are a1 a2");
        check("a1", "write it like a2@10s");
        check("a1@soon", "write it like 90s");
        check("a1@9s..2s", "before it falls silent");
        assert!(duration("0s").is_err());
    }

    #[test]
    fn faults_strike_in_order_and_within_the_flight() {
        let silences = [
            Silence {
                slot: 8,
                from: TWENTY,
                to: None,
            },
            Silence {
                slot: 1,
                from: TEN,
                to: Some(Duration::from_secs(30)),
            },
        ];
        let struck = faults(&silences, Duration::from_secs(40)).expect("faults");
        let struck: Vec<_> = struck.iter().map(|scheduled| (scheduled.at, scheduled.fault)).collect();
        assert_eq!(
            struck,
            [
                (10_000_000_000, Fault::Silent(1)),
                (20_000_000_000, Fault::Silent(8)),
                (30_000_000_000, Fault::Restored(1)),
            ]
        );
        let late = faults(&silences, TWENTY).expect_err("after the end");
        assert_eq!(
            late.to_string(),
            "--silent g1@20s is after the end of the flight at 20s; fly longer with --duration"
        );
    }

    #[test]
    fn a_flight_lasts_as_long_as_asked_or_as_its_source() {
        assert_eq!(duration_of(Some(TEN), Some(7.0)), TEN);
        assert_eq!(duration_of(None, Some(7.0)), Duration::from_secs(7));
        assert_eq!(duration_of(None, None), Duration::from_secs(60));
    }
}
