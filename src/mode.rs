//! WAIT and FLIGHT: which command is accepted when, what it starts, and what survives a reset.
//!
//! In: commands, lift-off, time. Out: a [`Reply`] for the console and an [`Action`] for whoever does the work.
//!
//! One flipped bit turns G_ME (to WAIT) into G_MA (erase) or G_MG (record), G_MT (send packets) into G_MV (to FLIGHT) or
//! G_Mt (stop). So no word that one bit makes of another acts alone: G_MV, G_ME, G_MG, G_MT and G_Mt take effect when sent
//! twice in a row, G_MA when followed by the different G_CA, each within [`CONFIRM_WITHIN_US`]; any other word in between
//! withdraws them.
//!
//! The same holds for the calibration set: G_CL (use and keep the one sent) and G_CX (forget the one kept) are armed, and
//! take effect with the different G_CK. So are and do G_RA, the launch rail, and G_SI, the launch site.
//!
//! Lift-off needs no confirmation: its debounced edge starts FLIGHT and recording. Only G_ME leaves FLIGHT.
//!
//! After power-on the mode is WAIT until the log was heard. What it says of the time before is taken once, and not after
//! a command or lift-off, which know better; so a log that is mounted again later changes nothing.

use crate::{command::Command, rail::Rail, site};

/// \[us\] time within which a confirmation counts.
pub const CONFIRM_WITHIN_US: u64 = 10_000_000;

/// The unit's mode (thesis: ESPERA, VOO; App. A.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Mode {
    /// On the pad: everything may be asked for.
    #[default]
    Wait,
    /// In flight: recording may be started, nothing may be erased.
    Flight,
}

impl Mode {
    /// Its name on the console.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Wait => "WAIT",
            Mode::Flight => "FLIGHT",
        }
    }
}

/// What changed the mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Cause {
    /// G_MV or G_ME.
    Command,
    /// The lift-off line.
    LiftOff,
    /// The log, after a power cut.
    Log,
    /// G_MA: nothing changes, but an erase was armed.
    EraseArmed,
    /// G_CA: nothing changes, but the log was erased.
    Erased,
    /// G_RA: nothing changes, but the launch rail did.
    Rail,
    /// Nothing changes, but the attitude took this rail after the latest cycle that had begun by then.
    RailTaken(Rail),
    /// Nothing changes, but the estimation began afresh at this launch site, with the cycle that began at this time.
    SiteTaken(site::Told),
}

impl Cause {
    /// Its name on the lines.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Command => "command",
            Cause::LiftOff => "lift-off",
            Cause::Log => "log, as before the power cut",
            Cause::EraseArmed => "an erase of the log armed",
            Cause::Erased => "the log erased",
            Cause::Rail => "the launch rail set",
            Cause::RailTaken(_) => "the launch rail taken",
            Cause::SiteTaken(_) => "the launch site taken",
        }
    }
}

/// A change of mode, as it is announced and logged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Change {
    /// \[us\] when, since the unit's clock started.
    pub at_us: u64,
    /// The mode from then on.
    pub mode: Mode,
    /// Whether packets are recorded from then on.
    pub recording: bool,
    /// What changed it.
    pub cause: Cause,
}

/// What the umbilical is busy with in WAIT. Reading sensors and telemetry never stop and are no tasks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Task {
    /// Nothing.
    #[default]
    Idle,
    /// New packets go to the umbilical.
    SendPackets,
    /// Pages `next..end` of the log go to the umbilical.
    Dump {
        /// Number of the next page.
        next: u32,
        /// Number after the last.
        end: u32,
    },
}

/// What a command makes the unit do besides changing this state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Action {
    /// Nothing more.
    None,
    /// Erase the recorder.
    Erase,
    /// Report.
    Report(Command),
    /// Run the sensors' self-test.
    SelfTest,
    /// Take, use or read a calibration set.
    Calibration(Command),
    /// Lie on this launch rail.
    Rail(Rail),
    /// Be at this launch site.
    Site(site::Told),
}

/// Why a command was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Refusal {
    /// It belongs to the other mode.
    Mode(Mode),
    /// Nothing to confirm, or too late.
    NothingToConfirm,
    /// The lift-off line is asserted.
    LiftOff,
    /// A number of it cannot be: why.
    Number(&'static str),
}

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Reply {
    /// Accepted.
    Done(Action),
    /// Send this command within [`CONFIRM_WITHIN_US`] to make it so.
    Confirm(Command),
    /// Refused.
    Refused(Refusal),
}

/// Mode, task and what waits for confirmation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// Mode.
    pub mode: Mode,
    /// Task.
    pub task: Task,
    /// Packets are being recorded.
    pub recording: bool,
    /// Derived frames are on.
    pub derived: bool,
    /// The log may know the mode from before power-on, and has not been heard yet.
    pub awaits_log: bool,
    pending: Option<Pending>,
    lift_off: bool,
}

/// What the unit was doing, as the flight log tells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Resumed {
    /// It was in FLIGHT.
    pub flight: bool,
    /// It was recording.
    pub recording: bool,
    /// Derived frames were on.
    pub derived: bool,
    /// The launch rail it lay on.
    pub rail: Rail,
    /// The launch site it was at.
    pub site: site::Told,
}

/// What waits for confirmation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Pending {
    /// What was armed.
    armed: Command,
    /// The command that confirms it.
    with: Command,
    /// \[us\] until when.
    until_us: u64,
}

/// Two copies of what of a state must not change by itself, the second one complemented, against flipped bits of the RAM
/// (fault U9).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Copies([u8; 2]);

impl Copies {
    /// Of a state as it is to be.
    pub fn of(state: &State) -> Self {
        let vital = state.vital();
        Copies([vital, !vital])
    }

    /// Makes state and copies what two of the three are; whether there was anything to put right.
    pub fn mend(&mut self, state: &mut State) -> bool {
        let [one, other] = self.0;
        let found = *self;
        if one == !other {
            let found = state.vital();
            state.restore(one);
            return found != one;
        }
        *self = Copies::of(state);
        *self != found
    }
}

impl State {
    /// What of it must not change by itself, in one byte.
    fn vital(&self) -> u8 {
        let flags = [self.mode == Mode::Flight, self.recording, self.derived, self.awaits_log];
        flags.into_iter().fold(0, |vital, flag| vital << 1 | u8::from(flag))
    }

    /// Makes that so again.
    fn restore(&mut self, vital: u8) {
        let flag = |bit: u8| vital >> bit & 1 == 1;
        self.mode = if flag(3) { Mode::Flight } else { Mode::Wait };
        (self.recording, self.derived, self.awaits_log) = (flag(2), flag(1), flag(0));
    }

    /// Takes what the log says of the time before power-on, if it is the first to say something of the mode.
    pub fn recovered(&mut self, before: Resumed) {
        if !core::mem::take(&mut self.awaits_log) {
            return;
        }
        self.derived |= before.derived;
        if before.flight {
            self.enter(Mode::Flight);
            self.recording = before.recording;
        }
    }

    /// Takes a command that came at `now_us`.
    pub fn command(&mut self, command: Command, now_us: u64) -> Reply {
        let pending = self.pending.take().filter(|pending| now_us <= pending.until_us);
        let armed = pending
            .filter(|pending| pending.with == command)
            .map(|pending| pending.armed);
        let confirmed = armed.is_some();
        match command {
            Command::Flight | Command::Wait if !confirmed => self.confirm(command, command, now_us),
            Command::Flight => self.enter(Mode::Flight),
            Command::Wait => self.enter(Mode::Wait),
            Command::Status | Command::Version | Command::Alignment | Command::Help => {
                Reply::Done(Action::Report(command))
            }
            Command::LeaveSafeMode => Reply::Done(Action::None),
            Command::DerivedOn | Command::DerivedOff => {
                self.derived = command == Command::DerivedOn;
                Reply::Done(Action::None)
            }
            Command::Record => self.only_in(Mode::Flight, |state| {
                if !confirmed {
                    return state.confirm(command, command, now_us);
                }
                state.recording = true;
                Reply::Done(Action::None)
            }),
            Command::Erase => self.only_in(Mode::Wait, |state| {
                if state.lift_off {
                    return Reply::Refused(Refusal::LiftOff);
                }
                state.confirm(command, Command::ConfirmErase, now_us)
            }),
            Command::ConfirmErase => self.only_in(Mode::Wait, |state| {
                if !confirmed {
                    return Reply::Refused(Refusal::NothingToConfirm);
                }
                state.task = Task::Idle;
                Reply::Done(Action::Erase)
            }),
            Command::SendPackets | Command::Stop if !confirmed => {
                self.only_in(Mode::Wait, |state| state.confirm(command, command, now_us))
            }
            Command::SendPackets => self.start(Task::SendPackets),
            Command::Dump => self.start(Task::Dump { next: 0, end: u32::MAX }),
            Command::DumpRange { first, count } => self.start(Task::Dump {
                next: first,
                end: first.saturating_add(count),
            }),
            Command::Stop => self.start(Task::Idle),
            Command::SelfTest => self.only_in(Mode::Wait, |_| Reply::Done(Action::SelfTest)),
            Command::SetWord { .. } | Command::ReadSet => {
                self.only_in(Mode::Wait, |_| Reply::Done(Action::Calibration(command)))
            }
            Command::LoadSet | Command::ForgetSet | Command::Rail(_) | Command::Site(_) => {
                self.only_in(Mode::Wait, |state| match command.fault() {
                    Some(why) => Reply::Refused(Refusal::Number(why)),
                    None => state.confirm(command, Command::ConfirmSet, now_us),
                })
            }
            Command::ConfirmSet => self.only_in(Mode::Wait, |_| match armed {
                Some(Command::Rail(rail)) => Reply::Done(Action::Rail(rail)),
                Some(Command::Site(site)) => Reply::Done(Action::Site(site)),
                Some(armed) => Reply::Done(Action::Calibration(armed)),
                None => Reply::Refused(Refusal::NothingToConfirm),
            }),
        }
    }

    /// Takes the debounced lift-off line. Its rising edge, and its level at start, begin FLIGHT and recording; a line
    /// that is stuck asserted does not hold the unit there against G_ME.
    pub fn lift_off(&mut self, asserted: bool) -> bool {
        let begins = asserted && !self.lift_off;
        self.lift_off = asserted;
        if begins {
            self.pending = None;
            self.enter(Mode::Flight);
            self.recording = true;
        }
        begins
    }

    fn enter(&mut self, mode: Mode) -> Reply {
        self.awaits_log = false;
        if self.mode != mode {
            self.mode = mode;
            self.task = Task::Idle;
            self.recording = false;
        }
        Reply::Done(Action::None)
    }

    fn start(&mut self, task: Task) -> Reply {
        self.only_in(Mode::Wait, |state| {
            state.task = task;
            Reply::Done(Action::None)
        })
    }

    fn confirm(&mut self, armed: Command, with: Command, now_us: u64) -> Reply {
        let until_us = now_us.saturating_add(CONFIRM_WITHIN_US);
        self.pending = Some(Pending { armed, with, until_us });
        Reply::Confirm(with)
    }

    fn only_in(&mut self, mode: Mode, accept: impl FnOnce(&mut Self) -> Reply) -> Reply {
        if self.mode == mode {
            accept(self)
        } else {
            Reply::Refused(Refusal::Mode(mode))
        }
    }
}

#[cfg(test)]
mod tests;
