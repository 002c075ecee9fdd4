//! The recorder's part: packets into the flight log while recording, records out of it while dumping, and what is
//! better done in free time.
//!
//! A chip that is dead, absent or full costs its records and nothing else: the reason is on the console and in the health
//! of every derived frame, and it is tried again every [`RETRY_MS`].

use embassy_time::{Duration, Instant};

use super::{
    clock::now,
    shared::{Cycle, Shared},
    vote::{Voter, Votes},
};
use crate::{
    board::Board,
    derived::Health,
    estimate::Estimate,
    flight_log::{
        FlightLog, LogError,
        record::{self, BootHeader, Entry, Key, Name},
    },
    mode::{Mode, Task},
    nand::{Nand, k9f1208::K9f1208},
};

/// [ms] while a dump waits for the line, how long until the next look.
const STEP_MS: u64 = 1;

/// [ms] otherwise, how long an order to erase or dump may wait.
const IDLE_MS: u64 = 100;

/// [ms] until a chip that failed is tried again.
const RETRY_MS: u64 = 2_000;

/// Serves the recorder for ever.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, bus: B::Nand) {
    let (Some(mut cycles), Some(mut frames)) = (shared.cycle_reader(), shared.derived_reader()) else {
        return;
    };
    let mut recorder = Recorder {
        shared,
        log: FlightLog::new(K9f1208::new(bus, &shared.clock), header(shared)),
        calibration: shared.set_name.borrow().clone(),
        retry: Some(Instant::MIN),
        erasing: false,
        dumped: None,
    };
    loop {
        recorder.mount_if_due().await;
        let wait_ms = recorder.step().await;
        shared.recorder.set(recorder.log.status());
        let next = shared
            .clock
            .within(Duration::from_millis(wait_ms), frames.next_message_pure());
        let Ok(frame) = votes.waiting(Voter::Record, next).await else {
            continue;
        };
        // A cycle comes before what is derived from it, so it is there unless this part was too late for it.
        while let Some(cycle) = cycles.try_next_message_pure() {
            if cycle.sample.start_us == frame.start_us {
                recorder.take(&cycle, &frame.estimate).await;
            }
        }
    }
}

fn header(shared: &Shared) -> BootHeader {
    let name = |text: &str| text.chars().take(16).collect::<Name>();
    BootHeader {
        opened_us: 0,
        firmware: name(env!("CARGO_PKG_VERSION")),
        unit: name(shared.settings.unit),
        calibration: shared.set_name.borrow().clone(),
        period_us: shared.settings.period_ms as u32 * 1000,
    }
}

struct Recorder<'a, N> {
    shared: &'a Shared,
    log: FlightLog<N>,
    /// The set that the log's header names.
    calibration: Name,
    /// When to mount; `None` while mounted.
    retry: Option<Instant>,
    erasing: bool,
    /// The record dumped last: the page after it repeats it.
    dumped: Option<Key>,
}

impl<N: Nand> Recorder<'_, N> {
    async fn mount_if_due(&mut self) {
        if self.retry.is_none_or(|due| now() < due) {
            return;
        }
        match self.log.mount().await {
            Ok(resumed) => {
                self.retry = None;
                self.shared.recorder_error.set(None);
                self.shared.recorder_refused.set(false);
                // Retained memory, where there is some, knows better: it is written each cycle.
                if self.shared.start.resume.is_none() {
                    let mut state = self.shared.state.borrow_mut();
                    state.recovered(resumed.flight, resumed.recording);
                }
            }
            Err(error) => self.fail(error),
        }
    }

    /// Says once what is wrong, and mounts again later unless that cannot help.
    fn fail(&mut self, error: LogError) {
        self.shared.recorder_refused.set(true);
        if self.shared.recorder_error.replace(Some(error)) != Some(error) {
            self.shared.say(format_args!("recorder: {error}"));
        }
        if matches!(error, LogError::Nand(_) | LogError::NotMounted) {
            self.retry = Some(now() + Duration::from_millis(RETRY_MS));
        }
    }

    async fn take(&mut self, cycle: &Cycle, estimate: &Estimate) {
        let (flight, recording) = {
            let state = self.shared.state.borrow();
            (state.mode == Mode::Flight, state.recording)
        };
        if self.retry.is_some() {
            return;
        }
        if let Err(error) = self.log.keep_mode(flight, recording).await {
            return self.fail(error);
        }
        if !recording {
            return;
        }
        if self.calibration != *self.shared.set_name.borrow() {
            self.calibration.clone_from(&self.shared.set_name.borrow());
            self.log.describe(header(self.shared));
        }
        let sample = &cycle.sample;
        let errors = Health(sample.reading.errors.0.into());
        let entry = Entry {
            start_us: sample.start_us,
            packet: cycle.packet,
            slots_us: sample.slots_us,
            flight,
            health: cycle.health.with(errors).with(Health::RECORDING),
            estimate: estimate.kept(),
        };
        match self.log.append(&entry).await {
            Ok(_) => self.shared.recorder_refused.set(false),
            Err(error) => self.fail(error),
        }
    }

    /// A bounded piece of erasing, dumping or preparing; how long to wait for a cycle then [ms].
    async fn step(&mut self) -> u64 {
        if self.shared.erase_ordered.take() {
            match self.log.start_erase().await {
                Ok(()) => {
                    self.erasing = true;
                    self.retry = None;
                    self.shared.recorder_error.set(None);
                    self.shared.recorder_refused.set(false);
                }
                Err(error) => {
                    self.shared.say(format_args!("G_MA failed: {error}"));
                    self.fail(error);
                }
            }
        }
        if self.retry.is_some() {
            return IDLE_MS;
        }
        match self.log.free_time().await {
            // An erase takes milliseconds itself, and everybody else has their turn in them.
            Ok(true) => return 0,
            Ok(false) if self.erasing && self.log.status().erasing.is_none() => {
                self.erasing = false;
                self.shared.say(format_args!("G_MA done: recorder is empty"));
            }
            Ok(false) | Err(LogError::Full | LogError::NotMounted) => {}
            Err(error) => self.fail(error),
        }
        self.dump().await
    }

    async fn dump(&mut self) -> u64 {
        let Task::Dump { next, end } = self.shared.state.borrow().task else {
            self.dumped = None;
            return IDLE_MS;
        };
        if !self.shared.dumped.is_empty() {
            return STEP_MS;
        }
        let used = self.log.status().used;
        let ended = next >= end.min(used);
        let read = if ended { Ok([None, None]) } else { self.log.read(next) };
        let mut state = self.shared.state.borrow_mut();
        // A command may have ended or restarted the dump while the page was read.
        if state.task != (Task::Dump { next, end }) {
            return STEP_MS;
        }
        if ended {
            state.task = Task::Idle;
            self.shared.say(format_args!("dump ends at page {next} of {used}"));
            return IDLE_MS;
        }
        state.task = Task::Dump { next: next + 1, end };
        match read {
            // The second half repeats the page before, where that one is whole: the older record first.
            Ok([newer, older]) => {
                for record in [older, newer].into_iter().flatten() {
                    let key = record::key(record).ok();
                    if key.is_some() && key != self.dumped {
                        self.dumped = key;
                        let _ = self.shared.dumped.try_send((next, *record));
                    }
                }
            }
            Err(error) => self.shared.say(format_args!("page {next} cannot be read: {error}")),
        }
        STEP_MS
    }
}
