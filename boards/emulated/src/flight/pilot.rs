//! The core's side of a run: faults at their instants, meetings with the bench, the end.

use std::sync::mpsc::{Receiver, SyncSender};

use rigless::{
    chip::uart::Rate,
    device::Level,
    emulator::{Driver, Host, InterruptLine, Stop},
    session::Session,
    soc::Width,
    time::VirtualNanos,
};
use twin::{
    fault::Struck,
    part::Nanos,
    run::{Fault, Flow, Scheduled},
};

use crate::{
    chips::{Line, SharedPlant},
    rtt,
    stand::Stand,
};

/// \[ns\] between two meetings of the core and the bench.
pub const STEP: Nanos = 20_000_000;

/// The memory that firmware finds again after a reset, but not after a power cut (memory.x).
const RETAINED: u64 = 0x2001_E000;
const RETAINED_BYTES: u64 = 8192;
/// What the unit's state and stack live in (memory.x).
const RAM: u64 = 0x2000_0000;
const RAM_BYTES: u64 = 0x1_E000;

/// The next meeting, on the grid of whole steps from power-on, whatever other stops there are.
pub(super) fn meeting_after(now: Nanos) -> Nanos {
    (now / STEP + 1) * STEP
}

/// What the core has to tell at a meeting.
#[derive(Default)]
pub(super) struct Heard {
    pub(super) now: Nanos,
    pub(super) telemetry: Vec<(Nanos, u8)>,
    pub(super) umbilical: Vec<(Nanos, u8)>,
    pub(super) log: Vec<u8>,
    pub(super) restarts: usize,
}

/// What the bench answers.
pub(super) struct Said {
    pub(super) commands: Vec<(Nanos, Vec<u8>)>,
    pub(super) flow: Flow,
}

/// Flips a bit of some memory, counted round it.
fn flip(host: &mut dyn Host, from: u64, bytes: u64, bit: u32) {
    let at = from + u64::from(bit) / 8 % bytes;
    if let Ok(byte) = host.read(at, Width::W8) {
        let _ = host.write(at, Width::W8, byte ^ 1 << (bit % 8));
    }
}

/// The interrupt of EXTI line 16, RM0090 table 62.
const VOLTAGE_DETECTOR: InterruptLine = InterruptLine::new(1).expect("a line of the core");

/// The core's side: what happens at the instants at which the run stops.
pub(super) struct Pilot {
    pub(super) plant: SharedPlant,
    /// Latest first.
    pub(super) faults: Vec<Scheduled>,
    pub(super) duration: Nanos,
    pub(super) statics: Vec<(u64, usize)>,
    pub(super) log: Option<u64>,
    pub(super) to_bench: SyncSender<Heard>,
    pub(super) said: Receiver<Said>,
    /// When the next meeting is.
    pub(super) next_meeting: Nanos,
    pub(super) instructions: u64,
    /// Strokes of the processor's own faults, by name.
    pub(super) struck: Struck,
    /// Frames on the umbilical when its disturbance began.
    pub(super) sent_before: u64,
    pub(super) static_bytes: Vec<Vec<u8>>,
}

impl Pilot {
    fn strike(&mut self, session: &mut Session<Stand>, stop: Stop, host: &mut dyn Host) {
        while let Some(scheduled) = self.faults.pop_if(|scheduled| scheduled.at <= stop.at.0) {
            match scheduled.fault {
                Fault::Reset => {
                    *self.struck.entry("reset").or_default() += 1;
                    session.reset_by_pin(stop.at, stop.instruction_count, host);
                }
                Fault::PowerCut(_) => {
                    *self.struck.entry("power-cut").or_default() += 1;
                    self.plant.lock().apply(scheduled.fault, stop.at.0);
                    session.board_mut().mcu.cut_power();
                    // The emulator's memory survives; what a power cut loses is lost here (memory.x).
                    for at in (RETAINED..RETAINED + RETAINED_BYTES).step_by(4) {
                        let _ = host.write(at, Width::W32, 0xDEAD_BEEF);
                    }
                    session.reset_by_pin(stop.at, stop.instruction_count, host);
                }
                Fault::DmaHung => {
                    *self.struck.entry("dma-hung").or_default() += 1;
                    session.board_mut().mcu.hang_dma();
                }
                Fault::SupplyFailing(failing) => {
                    *self.struck.entry("supply").or_default() += u64::from(failing);
                    if session.board_mut().mcu.sag(failing) {
                        // An edge: the line to the core falls again at once, and its interrupt stays pending.
                        for level in [Level::High, Level::Low] {
                            host.set_interrupt(VOLTAGE_DETECTOR, level);
                        }
                    }
                }
                Fault::CrystalLost => {
                    *self.struck.entry("crystal-lost").or_default() += 1;
                    session.board_mut().mcu.remove_crystal();
                }
                Fault::UmbilicalNoise(noise) => {
                    session.board_mut().mcu.disturb_umbilical(noise);
                    self.count_damaged(session, "umbilical-noise", noise);
                }
                Fault::UmbilicalBreak(held) => {
                    let mcu = &mut session.board_mut().mcu;
                    mcu.garble_umbilical(if held { Rate::EVERY_WORD } else { 0 });
                    if let Some(line) = mcu.umbilical() {
                        line.hold_low(stop.at.0, held);
                    }
                    self.count_damaged(session, "umbilical-break", held);
                }
                Fault::KeptFlip(bit) => {
                    *self.struck.entry("kept-flip").or_default() += 1;
                    flip(host, RETAINED, RETAINED_BYTES, bit);
                    session.reset_by_pin(stop.at, stop.instruction_count, host);
                }
                Fault::RamFlip(bit) => {
                    *self.struck.entry("ram-flip").or_default() += 1;
                    flip(host, RAM, RAM_BYTES, bit);
                }
                fault => self.plant.lock().apply(fault, stop.at.0),
            }
        }
    }

    /// Counts the frames between the beginning of a disturbance and its end.
    fn count_damaged(&mut self, session: &mut Session<Stand>, name: &'static str, begins: bool) {
        let sent = session.board_mut().mcu.umbilical().map_or(0, |line| line.sent());
        if begins {
            self.sent_before = sent;
        } else {
            *self.struck.entry(name).or_default() += sent - self.sent_before;
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
