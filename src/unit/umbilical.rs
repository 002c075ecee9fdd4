//! The umbilical: commands in, replies, packets and records out.
//!
//! Every reply is one line `>...\r\n`, without `@` or `$`, between whole frames; a reader of packets passes over it.

use embassy_futures::select::{Either, Either4, select, select4};
use embedded_io_async::Read;

use super::{
    calibration,
    clock::{never, now},
    rail,
    shared::Shared,
    site,
    telemetry::Out,
    vote::{Voter, Votes},
};
use crate::{
    board::{Board, Retained},
    calibration::load::Arriving,
    command::{COMMANDS, Command, Heard, Parser, word_of},
    crash::{CrashCause, CrashRecord},
    derived,
    flight_log::{dump, record},
    mode::{Action, Cause, Refusal, Reply, Task},
};

/// Sends for ever.
pub async fn send<B: Board>(shared: &Shared, votes: &Votes, line: B::UmbilicalTx) -> ! {
    let (Some(mut cycles), Some(mut frames)) = (shared.cycle_reader(), shared.derived_reader()) else {
        never().await
    };
    let mut out = Out {
        line,
        clock: &shared.clock,
        votes,
        voter: Voter::UmbilicalSend,
    };
    if let Some(crash) = &shared.start.crash {
        shared.say(format_args!(
            "crash before this start: {:?} at {} {}",
            crash.cause,
            At(crash),
            crash.place
        ));
    }
    shared.say(format_args!(
        "e-MEMS {} started: {:?}",
        env!("CARGO_PKG_VERSION"),
        shared.start.reset
    ));
    let brown_out = shared.start.options.brown_out;
    if brown_out.falls_short() {
        shared.say(format_args!(
            "brown-out reset at {} mV, the board asks for {}",
            brown_out.set_mv, brown_out.asked_mv
        ));
    }
    if shared.safe.get() {
        let starts = shared.start.starts.without_health;
        shared.say(format_args!(
            "SAFE MODE: start {starts} without a minute of health; no estimation, no commands; G_XN leaves it"
        ));
    }
    loop {
        let next = select4(
            shared.replies.receive(),
            shared.dumped.receive(),
            cycles.next_message_pure(),
            frames.next_message_pure(),
        );
        let next = select(shared.announced[1].receive(), next);
        let next = match votes.waiting(out.voter, next).await {
            Either::First(text) => {
                out.say(&text).await;
                continue;
            }
            Either::Second(next) => next,
        };
        let sending = shared.state.get().task == Task::SendPackets;
        match next {
            Either4::First(reply) => out.say(&reply).await,
            Either4::Second((page, record)) => {
                if let Some(packet) = record::packet(&record) {
                    out.write(packet).await;
                }
                out.write(&dump::encode(page, &record)).await;
            }
            Either4::Third(cycle) if sending => out.write(&cycle.packet).await,
            Either4::Fourth(frame) if sending && shared.is_wanted(&frame) => {
                out.write(&derived::encode(&frame)).await;
            }
            _ => {}
        }
    }
}

/// Listens for ever.
pub async fn listen<B: Board>(shared: &Shared, votes: &Votes, mut line: B::UmbilicalRx, memory: &B::Retained) -> ! {
    let (mut parser, mut arriving) = (Parser::default(), Arriving::default());
    let mut lost = 0_u32;
    let mut bytes = [0; 32];
    loop {
        let heard = match votes.waiting(Voter::UmbilicalListen, line.read(&mut bytes)).await {
            Ok(count) => bytes.get(..count).unwrap_or_default(),
            Err(_) => {
                // What follows a damaged byte does not go on the word before it.
                parser.forget();
                lost = lost.saturating_add(1);
                &[]
            }
        };
        for byte in heard {
            if let Some(heard) = parser.hear(*byte, now().as_micros()) {
                // An answer of many lines waits for room behind a transmitter that may be stuck.
                votes
                    .waiting(Voter::UmbilicalListen, answer(shared, memory, &mut arriving, heard))
                    .await;
            }
        }
        shared.umbilical_noise.set(parser.passed_over.saturating_add(lost));
    }
}

async fn answer(shared: &Shared, memory: &impl Retained, arriving: &mut Arriving, heard: Heard) {
    let command = match heard {
        Heard::Command(command) => command,
        Heard::Unknown(word) => {
            return shared.say(format_args!("{} no: unknown, G_HE lists the words", Printable(&word)));
        }
        Heard::BadDigit { word, digit, found } => {
            return shared.say(format_args!(
                "{} no: digit {digit} is 0x{found:02X}, not 0-9 or A-F",
                Printable(&word)
            ));
        }
    };
    if command == Command::LeaveSafeMode {
        let safe = if shared.safe.take() { "left" } else { "was not on" };
        return shared.say(format_args!("G_XN ok: safe mode {safe}"));
    }
    let only_asks = matches!(command, Command::Status | Command::Version | Command::Help);
    if shared.safe.get() && !only_asks {
        return shared.say(format_args!(
            "{} no: safe mode, G_XN leaves it",
            Printable(word_of(command))
        ));
    }
    let reply = shared.change(Cause::Command, |state| state.command(command, now().as_micros()));
    let word = Printable(word_of(command));
    if let (Reply::Confirm(_), Command::LoadSet) = (reply, command)
        && let Err(why) = calibration::sent(shared, arriving)
    {
        return shared.say(format_args!("G_CL no: {why}"));
    }
    if reply == Reply::Confirm(Command::ConfirmErase) {
        shared.note(Cause::EraseArmed);
    }
    match reply {
        Reply::Confirm(with) => {
            match command {
                Command::Rail(rail) => shared.say(format_args!("{word}: {rail}")),
                Command::Site(site) => shared.say(format_args!("{word}: {site}")),
                _ => {}
            }
            shared.say(format_args!("{word}: send {} within 10 s", Printable(word_of(with))));
        }
        Reply::Refused(Refusal::Mode(mode)) => shared.say(format_args!("{word} no: only in {}", mode.name())),
        Reply::Refused(Refusal::NothingToConfirm) => shared.say(format_args!("{word} no: nothing to confirm")),
        Reply::Refused(Refusal::Number(why)) => shared.say(format_args!("{word} no: {why}")),
        Reply::Refused(Refusal::LiftOff) => shared.say(format_args!("{word} no: lift-off line is asserted")),
        Reply::Done(Action::None) => {
            let mode = shared.state.get().mode.name();
            shared.say(format_args!("{word} ok: {mode}"));
        }
        Reply::Done(Action::Erase) => {
            shared.erase_ordered.set(true);
            shared.note(Cause::Erased);
            match shared.recorder_error.get() {
                None => shared.say(format_args!("{word} ok: erasing {} pages", shared.recorder.get().used)),
                Some(error) => shared.say(format_args!("{word} ok: erase ordered, but recorder: {error}")),
            }
        }
        Reply::Done(Action::SelfTest) => {
            shared.self_test_ordered.signal(());
            shared.say(format_args!(
                "{word} ok: sixteen sensors, about 5 s; keep the unit still"
            ));
        }
        Reply::Done(Action::Calibration(command)) => calibration::answer(shared, memory, arriving, command).await,
        Reply::Done(Action::Rail(rail)) => rail::set(shared, memory, rail),
        Reply::Done(Action::Site(site)) => site::set(shared, site),
        Reply::Done(Action::Report(Command::Help)) => help(shared).await,
        Reply::Done(Action::Report(Command::Version)) => {
            shared.say(format_args!("{word}: e-MEMS {}", env!("CARGO_PKG_VERSION")));
        }
        Reply::Done(Action::Report(Command::Alignment)) => alignment(shared),
        Reply::Done(Action::Report(_)) => status(shared),
    }
}

async fn help(shared: &Shared) {
    for entry in &COMMANDS {
        shared
            .tell(format_args!("{} {}", Printable(entry.word), entry.meaning))
            .await;
    }
}

fn alignment(shared: &Shared) {
    let pad = shared.pad.get();
    match pad.alignment() {
        Some(alignment) => shared.say(format_args!("G_PA {alignment}")),
        None => shared.say(format_args!("G_PA no attitude")),
    }
    shared.say(format_args!("G_PA {}", pad.plates()));
}

fn status(shared: &Shared) {
    let state = shared.state.get();
    let (lift_off, micro_g) = shared.discretes.get();
    let recorder = shared.recorder.get();
    let resets = shared.start.resets();
    shared.say(format_args!(
        "G_ST {} task {} recording {} derived {}{}",
        state.mode.name(),
        match state.task {
            Task::Idle => "none",
            Task::SendPackets => "G_MT",
            Task::Dump { .. } => "G_Ml",
        },
        u8::from(state.recording),
        u8::from(state.derived),
        if shared.safe.get() { " SAFE MODE" } else { "" }
    ));
    shared.say(format_args!(
        "G_ST lift-off {} micro-g {} errors {:04X} noise {} lost {}",
        u8::from(lift_off),
        u8::from(micro_g),
        shared.errors.get().0,
        shared.umbilical_noise.get(),
        shared.lines_lost.get()
    ));
    shared.say(format_args!(
        "G_ST recorder {} of {} pages, {} bad blocks, {} bits corrected, {} halves lost, {} min left",
        recorder.used,
        recorder.capacity,
        recorder.bad_blocks,
        recorder.corrected,
        recorder.uncorrectable,
        recorder.minutes_left(shared.settings.period_ms)
    ));
    match (shared.recorder_error.get(), recorder.erasing) {
        (Some(error), _) => shared.say(format_args!("G_ST recorder: {error}")),
        (None, Some(left)) => shared.say(format_args!("G_ST recorder: erasing, {left} blocks left")),
        (None, None) => match recorder.last {
            Some((key, start_us)) => shared.say(format_args!(
                "G_ST recorder: last record {} of boot {}, epoch {}, at {} ms",
                key.seq,
                key.boot,
                key.epoch,
                start_us / 1000
            )),
            None => shared.say(format_args!("G_ST recorder: empty")),
        },
    }
    shared.say(format_args!(
        "G_ST started {:?} resets {resets} up {} s, starts without a minute of health {}",
        shared.start.reset,
        now().as_secs(),
        shared.start.starts.without_health
    ));
    if let Some(crash) = &shared.start.crash {
        shared.say(format_args!(
            "G_ST crash {:?} at {} {} lr {:08X} after {} ms",
            crash.cause,
            At(crash),
            crash.place,
            crash.lr,
            crash.uptime_us / 1000
        ));
    }
    let (stack, options) = ((shared.start.stack_use)(), &shared.start.options);
    shared.say(format_args!(
        "G_ST clock {} stack {} of {} bytes brown-out {} mV of {} read-out {} dips {} image {:08X}",
        shared.start.oscillator.name(),
        stack.used,
        stack.size,
        options.brown_out.set_mv,
        options.brown_out.asked_mv,
        options.read_out,
        shared.supply_dips.get(),
        shared.image.get().unwrap_or_default()
    ));
}

/// Where a crash was: the line of a panic, the program counter of a fault.
struct At<'a>(&'a CrashRecord);

impl core::fmt::Display for At<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.0.cause {
            CrashCause::Panic => write!(f, "{}", self.0.at),
            _ => write!(f, "{:08X}", self.0.at),
        }
    }
}

/// Letters as they came; what a terminal might take for a command is a dot.
struct Printable<'a>(&'a [u8]);

impl core::fmt::Display for Printable<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        for byte in self.0 {
            let safe = byte.is_ascii_alphanumeric() || *byte == b'_';
            core::fmt::Write::write_char(f, if safe { char::from(*byte) } else { '.' })?;
        }
        Ok(())
    }
}
