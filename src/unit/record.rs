//! The recorder's part: packets into the flight log while recording, records out of it while dumping, and what is
//! better done in free time.
//!
//! A chip that is dead, absent or full costs its records and nothing else: the reason is on the console and in the health
//! of every derived frame, and it is tried again every [`RETRY`]. After a dip of the supply it is tried again at once, and
//! again after twice as long each time; the newest record waits for it. So a dip costs the records of its own duration at most.
//!
//! What the log says of the time before power-on (mode, attitude, rail, site, the calibration set it keeps) is taken once, at the first mount,
//! and where neither retained memory nor a command knows better. A crash record is forgotten when a boot header with it is in the log.

use embassy_time::{Duration, Instant};

use super::{
    calibration,
    clock::{after, never, now},
    rail,
    shared::{Cycle, Shared},
    site,
    vote::{Voter, Votes},
};
use crate::{
    board::{Board, Retained},
    calibration::ENCODED_BYTES,
    estimate::Estimate,
    flight_log::{
        FlightLog, LogError, Resumed,
        record::{self, BootHeader, Entry, Key, Name},
    },
    health::Health,
    mode::{Cause, Mode, State, Task},
    nand::{Nand, NandError, k9f1208::K9f1208},
    retained::{CRASH, SET},
};

/// While a dump waits for the line, how long until the next look.
const STEP: Duration = Duration::from_millis(1);

/// Otherwise, how long an order to erase or dump may wait.
const IDLE: Duration = Duration::from_millis(100);

/// Until a chip that failed is tried again.
const RETRY: Duration = Duration::from_secs(2);

/// Until it is tried again after the supply failed, at first.
const DIP: Duration = Duration::from_millis(10);

/// Serves the recorder for ever.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, bus: B::Nand, memory: &B::Retained) -> ! {
    let (Some(mut cycles), Some(mut frames)) = (shared.cycle_reader(), shared.derived_reader()) else {
        never().await
    };
    let mut recorder = Recorder {
        shared,
        memory,
        log: FlightLog::new(K9f1208::new(bus, &shared.clock), header(shared)),
        calibration: shared.set_name(),
        retry: Some(Instant::MIN),
        dip: DIP,
        crash: shared.start.crash.is_some(),
        missed: None,
        set: [0; ENCODED_BYTES],
        erasing: false,
        dumped: None,
    };
    loop {
        recorder.mount_if_due().await;
        let wait = recorder.step().await;
        shared.recorder.set(recorder.log.status());
        let next = shared.clock.within(wait, frames.next_message_pure());
        let Ok(frame) = votes.waiting(Voter::Record, next).await else {
            continue;
        };
        // A cycle comes before what is derived from it, so it is there unless this part was too late for it.
        while let Some(cycle) = cycles.try_next_message_pure() {
            if cycle.sample.start_us == frame.start_us {
                let entry = recorder.entry(&cycle, &frame.estimate);
                recorder.take(entry).await;
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
        calibration: shared.set_name(),
        period_us: shared.settings.period_ms.saturating_mul(1000) as u32,
        start: Some(shared.start.in_full()),
    }
}

struct Recorder<'a, N, R> {
    shared: &'a Shared,
    memory: &'a R,
    log: FlightLog<N>,
    /// The set that the log's header names.
    calibration: Name,
    /// When to mount; `None` while mounted.
    retry: Option<Instant>,
    /// The next wait for the supply.
    dip: Duration,
    /// What the log was about to take when the supply failed.
    missed: Option<Entry>,
    /// A calibration set on its way from or to the chip.
    set: [u8; ENCODED_BYTES],
    erasing: bool,
    /// There is a crash record that the log does not have yet.
    crash: bool,
    /// The record dumped last: the page after it repeats it.
    dumped: Option<Key>,
}

impl<N: Nand, R: Retained> Recorder<'_, N, R> {
    async fn mount_if_due(&mut self) {
        if self.retry.is_none_or(|due| now() < due) {
            return;
        }
        match self.log.mount().await {
            Ok(resumed) => {
                self.retry = None;
                // Reading goes on in a dip of the supply; whether it is over, the next record tells.
                if self.missed.is_none() {
                    self.forgive();
                }
                rail::found(self.shared, self.memory, resumed.rail);
                site::found(self.shared, resumed.site);
                if self.shared.state.get().awaits_log {
                    self.find_attitude(resumed.flight);
                    let shared = self.shared;
                    shared.change(Cause::Log, |state| state.recovered(resumed));
                }
                if !self.shared.set_known.get()
                    && let Err(error) = self.find_set()
                {
                    return self.fail(error);
                }
                if let Some(entry) = self.missed.take() {
                    self.take(entry).await;
                }
            }
            Err(error) => self.fail(error),
        }
    }

    fn forgive(&mut self) {
        self.dip = DIP;
        self.shared.recorder_error.set(None);
        self.shared.recorder_refused.set(false);
    }

    /// The attitude of the newest record, for the estimation to go on from in flight.
    fn find_attitude(&self, flight: bool) {
        if let Some(newest) = self.log.newest().filter(|_| flight)
            && record::key(newest).is_ok()
            && let (true, _) = record::mode_and_time(newest)
        {
            self.shared.attitude_found.set(record::estimate(newest));
        }
    }

    /// The set that the chip keeps, or the news that it keeps none: both are known over the next reset.
    fn find_set(&mut self) -> Result<(), LogError> {
        let kept = self.log.kept_set(&mut self.set)?.unwrap_or_default();
        // A command may have ordered one meanwhile.
        if !self.shared.set_known.replace(true) {
            SET.keep(self.memory, kept);
            if !kept.is_empty() {
                calibration::take_kept(self.shared, kept);
            }
        }
        Ok(())
    }

    /// Keeps the set that was ordered, or that none was.
    async fn keep_set(&mut self) {
        let set = calibration::to_keep(self.shared);
        let content = set.as_ref().map_or(&[][..], |set| set);
        let kept = self.log.keep_set(content, &mut self.set).await;
        match kept {
            Ok(()) => {
                self.shared.set_to_keep.set(false);
                self.shared.say(format_args!("calibration is kept in the recorder"));
            }
            Err(error) => {
                // After a failure of the chip once more when it is mounted again.
                self.shared.set_to_keep.set(matches!(error, LogError::Nand(_)));
                self.shared
                    .say(format_args!("calibration lasts until power-off only: {error}"));
                self.fail(error);
            }
        }
    }

    /// Says once what is wrong, and mounts again later unless that cannot help.
    fn fail(&mut self, error: LogError) {
        self.shared.recorder_refused.set(true);
        if self.shared.recorder_error.replace(Some(error)) != Some(error) {
            self.shared.say(format_args!("recorder: {error}"));
        }
        let wait = match error {
            LogError::Nand(NandError::PowerFailing) => {
                let wait = self.dip;
                self.dip = Duration::from_ticks(wait.as_ticks().saturating_mul(2)).min(RETRY);
                wait
            }
            LogError::Nand(_) | LogError::NotMounted => RETRY,
            _ => return,
        };
        self.retry = Some(after(wait));
    }

    fn entry(&self, cycle: &Cycle, estimate: &Estimate) -> Entry {
        let sample = &cycle.sample;
        let errors = Health(sample.reading.errors.0.into());
        Entry {
            start_us: sample.start_us,
            packet: cycle.packet,
            slots_us: sample.slots_us,
            flight: self.shared.state.get().mode == Mode::Flight,
            health: cycle.health.with(errors).with(Health::RECORDING),
            estimate: estimate.kept(),
        }
    }

    async fn take(&mut self, entry: Entry) {
        let state = self.shared.state.get();
        let recording = state.recording;
        let power_failed = self.shared.recorder_error.get() == Some(LogError::Nand(NandError::PowerFailing));
        if self.retry.is_some() {
            self.missed = Some(entry).filter(|_| power_failed && recording);
            return;
        }
        match self.try_take(&entry, state).await {
            Ok(()) => {
                if recording || power_failed {
                    self.forgive();
                }
                self.forget_logged_crash();
            }
            Err(error) => {
                self.fail(error);
                let power_failed = error == LogError::Nand(NandError::PowerFailing);
                self.missed = Some(entry).filter(|_| power_failed && recording);
            }
        }
    }

    /// The mode, its changes since the entry before, and the entry if packets are being recorded.
    async fn try_take(&mut self, entry: &Entry, state: State) -> Result<(), LogError> {
        let mode = Resumed {
            flight: state.mode == Mode::Flight,
            recording: state.recording,
            derived: state.derived,
            rail: self.shared.rail.get(),
            site: self.shared.site_told.get().unwrap_or(self.shared.site_in_use.get()),
        };
        self.log.keep_mode(mode).await?;
        let calibration = self.shared.set_name();
        if self.calibration != calibration {
            self.calibration = calibration;
            self.log.describe(header(self.shared));
        }
        while let Some(change) = self.shared.with_changes(|changes| changes.front().copied()) {
            let noted = self.log.note(&change).await;
            if !matches!(noted, Err(LogError::Nand(_) | LogError::NotMounted)) {
                self.shared.with_changes(|changes| changes.pop_front());
            }
            noted?;
        }
        if state.recording {
            self.log.append(entry).await?;
        }
        Ok(())
    }

    /// A crash is forgotten when the log has it.
    fn forget_logged_crash(&mut self) {
        if self.log.is_begun() && core::mem::take(&mut self.crash) {
            CRASH.forget(self.memory);
        }
    }

    /// A bounded piece of erasing, dumping or preparing; how long to wait for a cycle then.
    async fn step(&mut self) -> Duration {
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
        if let Some(due) = self.retry {
            return due.saturating_duration_since(now()).clamp(STEP, IDLE);
        }
        if self.shared.set_to_keep.get() {
            self.keep_set().await;
        }
        match self.log.free_time().await {
            // An erase takes milliseconds itself, and everybody else has their turn in them.
            Ok(true) => return Duration::MIN,
            Ok(false) if self.erasing && self.log.status().erasing.is_none() => {
                self.erasing = false;
                self.shared.say(format_args!("G_MA done: recorder is empty"));
            }
            Ok(false) | Err(LogError::Full | LogError::NotMounted) => {}
            Err(error) => self.fail(error),
        }
        self.dump()
    }

    fn dump(&mut self) -> Duration {
        let Task::Dump { next, end } = self.shared.state.get().task else {
            self.dumped = None;
            return IDLE;
        };
        if !self.shared.dumped.is_empty() {
            return STEP;
        }
        let used = self.log.status().used;
        let ended = next >= end.min(used);
        let read = if ended { Ok([None, None]) } else { self.log.read(next) };
        // A command may have ended or restarted the dump while the page was read.
        if self.shared.state.get().task != (Task::Dump { next, end }) {
            return STEP;
        }
        if ended {
            self.shared.set_task(Task::Idle);
            self.shared.say(format_args!("dump ends at page {next} of {used}"));
            return IDLE;
        }
        self.shared.set_task(Task::Dump {
            next: next.saturating_add(1),
            end,
        });
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
        STEP
    }
}
