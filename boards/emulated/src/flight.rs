//! A run of the image on the stand, watched by a [`Bench`].
//!
//! In: image, plant, faults, how long. Out: both lines' bytes and the log to the bench as they come, and a [`Report`].
//!
//! The emulated core runs on a thread of its own, as rigless has it, and the bench on the caller's. The two meet every
//! [`STEP`] of virtual time: that is often enough to watch, and seldom enough that meeting costs nothing. The bench is
//! then asked for the commands of each millisecond of the step to come, so a command is on the line at its own
//! millisecond, and every byte it hears carries its own instant. Refuses an image without the named statics.

use std::{
    collections::BTreeSet,
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread,
};

use defmt_decoder::Table;
use emems::board::ResetCause;
use rigless::{
    device,
    emulator::{self, Driver, Finished, Host, Start, Stop},
    session::Session,
    soc::Width,
    time::VirtualNanos,
};
use twin::{
    part::Nanos,
    plant::Plant,
    run::{Bench, Fault, Flow, Scheduled},
};

use crate::{
    chips::{Line, SharedPlant},
    covers::Covers,
    image::{Image, ImageError},
    rtt,
    stand::Stand,
};

/// [ns] between two meetings of the core and the bench.
pub const STEP: Nanos = 20_000_000;
/// The memory that firmware finds again after a reset, but not after a power cut (memory.x).
const RETAINED: u64 = 0x2001_FF00;
const RETAINED_BYTES: u64 = 256;
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
    /// [ns] virtual time flown.
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
    let plant = SharedPlant::new(plant);
    let mut stand = Stand::new(plant.clone(), options.covers).map_err(|error| emulator(&error))?;
    stand.mcu.garble_umbilical(options.framing_errors_per_million);
    if options.no_crystal {
        stand.mcu.remove_crystal();
    }
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
    .map(|report| (report, kept))
}

/// The next meeting, on the grid of whole steps from power-on, whatever other stops there are.
fn meeting_after(now: Nanos) -> Nanos {
    (now / STEP + 1) * STEP
}

/// What the core has to tell at a meeting.
#[derive(Default)]
struct Heard {
    now: Nanos,
    telemetry: Vec<(Nanos, u8)>,
    umbilical: Vec<(Nanos, u8)>,
    log: Vec<u8>,
    restarts: usize,
}

/// What the bench answers.
struct Said {
    commands: Vec<(Nanos, Vec<u8>)>,
    flow: Flow,
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

/// The core's side: what happens at the instants at which the run stops.
struct Pilot {
    plant: SharedPlant,
    /// Latest first.
    faults: Vec<Scheduled>,
    duration: Nanos,
    statics: Vec<(u64, usize)>,
    log: Option<u64>,
    to_bench: SyncSender<Heard>,
    said: Receiver<Said>,
    /// When the next meeting is.
    next_meeting: Nanos,
    instructions: u64,
    static_bytes: Vec<Vec<u8>>,
}

impl Pilot {
    fn strike(&mut self, session: &mut Session<Stand>, stop: Stop, host: &mut dyn Host) {
        while let Some(scheduled) = self.faults.pop_if(|scheduled| scheduled.at <= stop.at.0) {
            match scheduled.fault {
                Fault::Reset => session.reset_by_pin(stop.at, stop.instruction_count, host),
                Fault::PowerCut(_) => {
                    self.plant.lock().apply(scheduled.fault, stop.at.0);
                    session.board_mut().mcu.cut_power();
                    // The emulator's memory survives; what a power cut loses is lost here (memory.x).
                    for at in (RETAINED..RETAINED + RETAINED_BYTES).step_by(4) {
                        let _ = host.write(at, Width::W32, 0xDEAD_BEEF);
                    }
                    session.reset_by_pin(stop.at, stop.instruction_count, host);
                }
                Fault::DmaHung => session.board_mut().mcu.hang_dma(),
                Fault::SupplyFailing(failing) => session.board_mut().mcu.sag(failing),
                fault => self.plant.lock().apply(fault, stop.at.0),
            }
        }
    }

    /// Tells the bench what was heard and puts its commands on the line; `None` ends the run.
    fn meet(&mut self, session: &mut Session<Stand>, now: Nanos, host: &mut dyn Host) -> Option<()> {
        let restarts = session.resets().len();
        let mcu = &mut session.board_mut().mcu;
        let heard = Heard {
            now,
            telemetry: mcu.telemetry().map(Line::take_heard).unwrap_or_default(),
            umbilical: mcu.umbilical().map(Line::take_heard).unwrap_or_default(),
            log: self.log.map(|block| rtt::drain(host, block)).unwrap_or_default(),
            restarts,
        };
        self.to_bench.send(heard).ok()?;
        let said = self.said.recv().ok()?;
        for (at, bytes) in said.commands {
            if let Some(line) = mcu.umbilical() {
                line.say(at, &bytes);
            }
        }
        (said.flow == Flow::Continue && now < self.duration).then_some(())
    }
}

impl Driver<Stand> for Pilot {
    fn on_stop(&mut self, session: &mut Session<Stand>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        let now = stop.at.0;
        self.strike(session, stop, host);
        if now >= self.next_meeting || now >= self.duration {
            self.next_meeting = meeting_after(now);
            if self.meet(session, now, host).is_none() {
                self.instructions = stop.instruction_count;
                self.static_bytes = (self.statics.iter())
                    .map(|&(address, bytes)| {
                        (address..address + bytes as u64)
                            .map_while(|at| host.read(at, Width::W8).ok())
                            .map(|byte| byte as u8)
                            .collect()
                    })
                    .collect();
                return None;
            }
        }
        let line = session.board_mut().mcu.umbilical();
        // The first byte of a burst needs a stop at its instant; the line itself fetches the others, frame by frame.
        let command = line.and_then(|line| line.next_due()).filter(|&due| due > now);
        let fault = self.faults.last().map(|scheduled| scheduled.at);
        [Some(self.next_meeting), Some(self.duration), command, fault]
            .into_iter()
            .flatten()
            .min()
            .map(VirtualNanos)
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
