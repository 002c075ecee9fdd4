//! A run of the image on the stand, watched by a [`Bench`].
//!
//! In: image, plant, faults, how long. Out: both lines' bytes and the log to the bench as they come, and a [`Report`].
//!
//! The emulated core runs on a thread of its own, as rigless has it, and the bench on the caller's. The two meet every
//! [`STEP`] of virtual time: that is often enough to watch, and seldom enough that meeting costs nothing. The bench is
//! then asked for the commands of each millisecond of the step to come, so a command is on the line at its own
//! millisecond, and every byte it hears carries its own instant. Refuses an image without the named statics.

mod pilot;

use std::{
    collections::BTreeSet,
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread,
};

use defmt_decoder::Table;
use emems::board::ResetCause;
use rigless::{
    device,
    emulator::{self, Finished, Start},
    session::Session,
    time::VirtualNanos,
};
use twin::{
    fault::Struck,
    part::Nanos,
    plant::Plant,
    run::{Bench, Scheduled},
};

pub use self::pilot::STEP;
use self::pilot::{Heard, Pilot, Said, meeting_after};
use crate::{
    chips::SharedPlant,
    covers::Covers,
    image::{Image, ImageError},
    rtt,
    stand::Stand,
};

const MILLISECOND: Nanos = 1_000_000;

/// How a run differs from the plain one.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Which defects of the emulator are covered.
    pub covers: Covers,
    /// How many in a million of the bytes towards the unit arrive with a framing error.
    pub framing_errors_per_million: u32,
    /// The board lacks its 8 MHz crystal.
    pub no_crystal: bool,
    /// Statics of the firmware, by symbol and size in bytes, read when the run ends.
    pub statics: Vec<(String, usize)>,
}

/// What a run leaves behind.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// \[ns\] virtual time flown.
    pub flown: Nanos,
    /// Instructions executed.
    pub instructions: u64,
    /// Resets and when they struck.
    pub resets: Vec<(Nanos, ResetCause)>,
    /// Accesses no peripheral answered, one line each: an address the part does not have, or a shut clock gate.
    pub unanswered: Vec<String>,
    /// Registers of peripherals the emulator has no model of (plain storage), as `INSTANCE.REGISTER`.
    pub unmodelled: BTreeSet<String>,
    /// The statics asked for, in the order of [`Options::statics`].
    pub statics: Vec<Vec<u8>>,
    /// How often each fault did something, by its name.
    pub struck: Struck,
}

/// Why a run could not be made.
#[derive(Debug)]
pub enum Error {
    /// The image.
    Image(ImageError),
    /// The emulator refused it or failed; its own text.
    Emulator(String),
}

impl std::error::Error for Error {}

impl std::fmt::Display for Error {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Error::Image(error) => write!(formatter, "{error}"),
            Error::Emulator(text) => write!(formatter, "the emulator could not run the image: {text}"),
        }
    }
}

impl From<ImageError> for Error {
    fn from(error: ImageError) -> Self {
        Error::Image(error)
    }
}

/// Flies `image` for `duration` nanoseconds of virtual time with [`Options::default`].
///
/// # Errors
///
/// As [`fly_with`].
pub fn fly(
    image: &Image,
    plant: Plant,
    faults: &[Scheduled],
    duration: Nanos,
    bench: &mut dyn Bench,
) -> Result<Report, Error> {
    fly_with(&Options::default(), image, plant, faults, duration, bench)
}

/// Flies `image` for `duration` nanoseconds of virtual time, or until the bench stops it.
///
/// # Errors
///
/// A static the image does not have, or an image the emulator cannot place or boot.
pub fn fly_with(
    options: &Options,
    image: &Image,
    plant: Plant,
    faults: &[Scheduled],
    duration: Nanos,
    bench: &mut dyn Bench,
) -> Result<Report, Error> {
    Ok(fly_keeping(options, image, plant, faults, duration, bench)?.0)
}

/// The same, and the plant as it is afterwards.
///
/// # Errors
///
/// As [`fly_with`].
pub fn fly_keeping(
    options: &Options,
    image: &Image,
    plant: Plant,
    faults: &[Scheduled],
    duration: Nanos,
    bench: &mut dyn Bench,
) -> Result<(Report, SharedPlant), Error> {
    let statics = (options.statics.iter())
        .map(|(name, bytes)| Ok((image.symbol(name)?, *bytes)))
        .collect::<Result<Vec<_>, ImageError>>()?;
    let emulator = |error: &dyn std::fmt::Display| Error::Emulator(error.to_string());
    let chip_options = plant.options;
    let plant = SharedPlant::new(plant);
    let mut stand = Stand::new(plant.clone(), options.covers).map_err(|error| emulator(&error))?;
    stand.mcu.garble_umbilical(options.framing_errors_per_million);
    if options.no_crystal {
        stand.mcu.remove_crystal();
    }
    stand.mcu.set_option_bytes(chip_options);
    // The first stop, one instruction in: the bench's first commands have to be known from the start.
    let session = Session::new(Box::new(stand), 0, VirtualNanos(1)).map_err(|error| emulator(&error))?;
    let mut faults = faults.to_vec();
    faults.sort_by_key(|scheduled| scheduled.at);
    faults.reverse();

    let (to_bench, heard) = sync_channel::<Heard>(1);
    let (to_core, said) = sync_channel::<Said>(1);
    let kept = plant.clone();
    let pilot = Pilot {
        plant,
        faults,
        duration,
        statics,
        log: image.symbol("_SEGGER_RTT").ok(),
        to_bench,
        said,
        next_meeting: 0,
        instructions: 0,
        struck: Struck::new(),
        sent_before: 0,
        static_bytes: Vec::new(),
    };
    let images = [image.placed.clone()];
    let table = image.log_table();
    thread::scope(|scope| {
        let core = scope.spawn(|| {
            emulator::run(session, &Start::new(&images), pilot)
                .map(report)
                .map_err(|error| Error::Emulator(error.to_string()))
        });
        attend(bench, table.as_ref(), &heard, &to_core);
        // Ends a core that still waits to be answered.
        drop(to_core);
        core.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
    .map(|mut report| {
        report.struck.extend(kept.lock().struck());
        (report, kept)
    })
}

/// The bench's side: until the core has ended.
fn attend(bench: &mut dyn Bench, table: Option<&Table>, heard: &Receiver<Heard>, to_core: &SyncSender<Said>) {
    let mut decoder = table.map(rtt::Decoder::new);
    let mut restarts = 0;
    while let Ok(heard) = heard.recv() {
        for (at, byte) in heard.telemetry {
            bench.telemetry(at, &[byte]);
        }
        for (at, byte) in heard.umbilical {
            bench.umbilical(at, &[byte]);
        }
        if restarts != heard.restarts {
            // A frame cut off by a restart would spoil the first one after it.
            restarts = heard.restarts;
            decoder = table.map(rtt::Decoder::new);
        }
        for line in decoder.iter_mut().flat_map(|decoder| decoder.lines(&heard.log)) {
            bench.log(heard.now, &line);
        }
        let flow = bench.advanced(heard.now);
        let commands = (heard.now.div_ceil(MILLISECOND)..meeting_after(heard.now).div_ceil(MILLISECOND))
            .map(|ms| (ms * MILLISECOND, bench.commands(ms * MILLISECOND)))
            .filter(|(_, bytes)| !bytes.is_empty())
            .collect();
        if to_core.send(Said { commands, flow }).is_err() {
            return;
        }
    }
}

fn report(finished: Finished<Stand, Pilot>) -> Report {
    let Finished {
        session, driver, stop, ..
    } = finished;
    let refused = session
        .refused()
        .iter()
        .map(|(at, fault)| format!("{at:#010x}: {fault}"));
    Report {
        flown: stop.map_or(0, |stop| stop.at.0),
        instructions: driver.instructions,
        resets: (session.resets().iter())
            .map(|reset| (reset.at.0, cause(reset.cause)))
            .collect(),
        unanswered: (session.unmapped().iter())
            .map(ToString::to_string)
            .chain(refused)
            .collect(),
        unmodelled: (session.unimplemented().values())
            .map(|access| format!("{}.{}", access.instance, access.register))
            .collect(),
        statics: driver.static_bytes,
        struck: driver.struck,
    }
}

fn cause(cause: device::ResetCause) -> ResetCause {
    match cause {
        device::ResetCause::Model("IWDG") => ResetCause::Watchdog,
        device::ResetCause::Pin => ResetCause::Pin,
        device::ResetCause::PowerOn => ResetCause::PowerOn,
        // The core's own request; no other model of this part asks for one.
        _ => ResetCause::Software,
    }
}
