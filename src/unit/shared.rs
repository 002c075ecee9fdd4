//! What the parts of the unit share: the state, the newest cycles and derived frames, and replies for the console.

use core::cell::{Cell, RefCell};

use embassy_sync::{
    blocking_mutex::raw::NoopRawMutex,
    channel::Channel,
    pubsub::{PubSubChannel, Subscriber},
    signal::Signal,
};
use heapless::{Deque, String};

use super::{
    Settings,
    clock::{Clock, now},
};
use crate::{
    board::{OptionBytes, Oscillator, ResetCause, StackUse},
    calibration::{Ranges, Set},
    crash::CrashRecord,
    derived::{self, DERIVED_BYTES, Derived},
    flight_log::{
        self, LogError,
        record::{self, Name, RecordBytes},
    },
    health::Health,
    increments::{Force, Increments, Integrator},
    mode::{Cause, Change, Copies, State, Task},
    packet::PACKET_BYTES,
    pad::Pad,
    rail::Rail,
    resume::{Resume, Starts},
    sample::{Errors, Sample},
    site::{self, Site},
};

/// Everything one read cycle gave.
#[derive(Clone)]
pub struct Cycle {
    /// What was measured, and when.
    pub sample: Sample,
    /// Its packet.
    pub packet: [u8; PACKET_BYTES],
    /// The gyros since the packet before.
    pub increments: Increments,
    /// What the packet has no bits for.
    pub health: Health,
    /// \[us\] from the start of the cycle to the closing of its packet.
    pub cycle_us: u32,
}

/// A reader may be busy with one while the next arrives, and a derived frame keeps a line busy for 78 ms, in which four
/// cycles of a unit at 50 Hz come, and packets of 14 ms take their time to be gone. A reader that is later than that loses the oldest.
const CYCLES: usize = 5;
const FRAMES: usize = 2;

/// Of both lines, 8N1.
const LINE_BAUD: u64 = 115_200;
pub const BITS_PER_BYTE: u64 = 10;

/// Changes of mode that wait for a line or for the log: two commands a second apart, and lift-off.
const CHANGES: usize = 4;

type Cycles = PubSubChannel<NoopRawMutex, Cycle, CYCLES, 4, 0>;
type DerivedFrames = PubSubChannel<NoopRawMutex, Derived, FRAMES, 3, 0>;

/// A reader of the cycles.
pub type CycleReader<'a> = Subscriber<'a, NoopRawMutex, Cycle, CYCLES, 4, 0>;
/// A reader of the derived frames.
pub type DerivedReader<'a> = Subscriber<'a, NoopRawMutex, Derived, FRAMES, 3, 0>;

/// Bytes of the longest line that is said to people, without `>` and line end.
pub const LONGEST_LINE: usize = 128;

/// A line for the console, without its end.
pub type Line = String<LONGEST_LINE>;

/// A record on its way from the recorder's part to the umbilical's, and the page it came from.
pub type Dumped = (u32, RecordBytes);

/// What the board says of this start.
pub struct Start {
    /// Why the unit started.
    pub reset: ResetCause,
    /// How often it started.
    pub starts: Starts,
    /// What it was doing before.
    pub resume: Option<Resume>,
    /// The crash before this start.
    pub crash: Option<CrashRecord>,
    /// What its time comes from.
    pub oscillator: Oscillator,
    /// What the chip's option bytes say.
    pub options: OptionBytes,
    /// How much of the stack has been used.
    pub stack_use: fn() -> StackUse,
}

impl Start {
    /// How it started, as derived frames have it.
    pub fn in_short(&self) -> derived::Start {
        derived::Start {
            reset: self.reset,
            crash: self.crash.as_ref().map(|crash| crash.cause),
            starts: self.starts.since_power_on,
        }
    }

    /// How it started, as the log has it.
    pub fn in_full(&self) -> record::Start {
        record::Start {
            reset: self.reset,
            starts: self.starts.since_power_on,
            crash: self.crash.clone(),
        }
    }

    /// Resets since power-on, the one before this start among them.
    pub fn resets(&self) -> u16 {
        self.starts.since_power_on.saturating_sub(1)
    }
}

/// The shared state. Everything in it is touched between two awaits only.
pub struct Shared {
    /// The clock all parts wait on.
    pub clock: Clock,
    /// What was chosen.
    pub settings: Settings,
    /// What the board says of this start.
    pub start: Start,
    /// Safe mode: nothing is estimated, and of commands only those that ask are taken.
    pub safe: Cell<bool>,
    /// Mode, task, confirmations.
    pub state: Cell<State>,
    /// The gyros' running integration.
    pub integrator: RefCell<Integrator>,
    /// Debounced lift-off and micro-g.
    pub discretes: Cell<(bool, bool)>,
    /// The recorder, as of its last action.
    pub recorder: Cell<flight_log::Status>,
    /// Why it cannot be used.
    pub recorder_error: Cell<Option<LogError>>,
    /// The recorder refused the last packet.
    pub recorder_refused: Cell<bool>,
    /// An erase was ordered and has not begun.
    pub erase_ordered: Cell<bool>,
    /// A self-test was ordered.
    pub self_test_ordered: Signal<NoopRawMutex, ()>,
    /// The sensor under test, by reading order: not to be read.
    pub testing: Cell<Option<usize>>,
    /// A reading waited for the sensor bus in vain: the self-test in a transfer gives it up.
    pub bus_wanted: Signal<NoopRawMutex, ()>,
    /// Error identifier of the newest cycle.
    pub errors: Cell<Errors>,
    /// Lines for the console that found no room.
    pub lines_lost: Cell<u32>,
    /// Dips of the supply since power-on; those of the latest packet's time before a reset are missing.
    pub supply_dips: Cell<u16>,
    /// Bytes lost or passed over on the umbilical.
    pub umbilical_noise: Cell<u32>,
    /// The calibration set in use.
    pub calibration: Cell<Set>,
    /// Its name in the log: what was compiled in, or number and checksum of what was loaded.
    set_name: Cell<Name>,
    /// It was loaded and the estimation does not use it yet.
    pub set_loaded: Cell<bool>,
    /// The set in use is known to be the one to use: it was kept over a reset, or ordered. Otherwise the recorder is asked.
    pub set_known: Cell<bool>,
    /// It was ordered, and the recorder is to keep it.
    pub set_to_keep: Cell<bool>,
    /// The attitude that the log was left with before a power cut in flight, for the estimation.
    pub attitude_found: Cell<Option<record::Estimate>>,
    /// \[us\] when the watchdog was last fed.
    pub fed_us: Cell<u64>,
    /// Checksum of the firmware's image, once it was read to its end.
    pub image: Cell<Option<u32>>,
    /// Copies of the state.
    copies: Cell<Copies>,
    /// Checksum of the calibration set in use.
    pub set_sum: Cell<u32>,
    /// Changes of mode that are not in the log yet.
    changes: Cell<Deque<Change, CHANGES>>,
    /// How the unit lies, as of the newest derived frame.
    pub pad: Cell<Pad>,
    /// The launch rail.
    pub rail: Cell<Rail>,
    /// It is known to be the one: it was ordered, or kept over a reset. Otherwise the recorder is asked.
    pub rail_known: Cell<bool>,
    /// The attitude has not been held against it.
    pub rail_is_new: Cell<bool>,
    /// The launch site of the estimation.
    pub site_in_use: Cell<site::Told>,
    /// Another, which the estimation does not use yet.
    pub site_told: Cell<Option<site::Told>>,
    /// It is known to be the one: it was ordered, or kept over a reset. Otherwise the recorder is asked.
    pub site_known: Cell<bool>,
    /// A reading of the accelerometers between two cycles, and the counter of the one it comes before.
    pub force: Signal<NoopRawMutex, (u16, Force)>,
    cycles: Cycles,
    derived: DerivedFrames,
    /// Lines for the console.
    pub replies: Channel<NoopRawMutex, Line, 8>,
    /// Lines that go before them, and the same ones for telemetry: changes of mode.
    pub announced: [Channel<NoopRawMutex, Line, CHANGES>; 2],
    /// Records read from the recorder for the umbilical: as many as a page holds.
    pub dumped: Channel<NoopRawMutex, Dumped, 2>,
}

impl Shared {
    /// The state at start.
    pub fn new(settings: Settings, start: Start) -> Self {
        let state = Resume::state(start.resume);
        let set = Set::compiled_in(Ranges::of(&settings));
        Shared {
            clock: Clock::new(),
            settings,
            state: Cell::new(state),
            copies: Cell::new(Copies::of(&state)),
            image: Cell::default(),
            set_sum: Cell::new(set.checksum()),
            safe: Cell::new(start.starts.ask_for_safe_mode()),
            start,
            integrator: RefCell::new(Integrator::new(settings.rate.deg_s_per_count().to_radians())),
            discretes: Cell::default(),
            recorder: Cell::default(),
            recorder_error: Cell::default(),
            recorder_refused: Cell::default(),
            erase_ordered: Cell::default(),
            self_test_ordered: Signal::new(),
            testing: Cell::default(),
            bus_wanted: Signal::new(),
            errors: Cell::default(),
            lines_lost: Cell::default(),
            supply_dips: Cell::default(),
            umbilical_noise: Cell::default(),
            calibration: Cell::new(set),
            set_name: Cell::new(settings.calibration.chars().take(16).collect()),
            set_loaded: Cell::default(),
            set_known: Cell::default(),
            set_to_keep: Cell::default(),
            attitude_found: Cell::default(),
            fed_us: Cell::default(),
            changes: Cell::default(),
            pad: Cell::default(),
            rail: Cell::default(),
            rail_known: Cell::default(),
            rail_is_new: Cell::default(),
            site_in_use: Cell::default(),
            site_told: Cell::default(),
            site_known: Cell::default(),
            force: Signal::new(),
            cycles: PubSubChannel::new(),
            derived: PubSubChannel::new(),
            replies: Channel::new(),
            announced: [Channel::new(), Channel::new()],
            dumped: Channel::new(),
        }
    }

    /// Where the unit is, for the estimation.
    pub fn site(&self) -> Site {
        self.site_in_use.get().site(&self.settings.site)
    }

    /// A reader of every cycle from now on. There are as many places as parts that call this, so it is never `None`.
    pub fn cycle_reader(&self) -> Option<CycleReader<'_>> {
        self.cycles.subscriber().ok()
    }

    /// A reader of every derived frame from now on.
    pub fn derived_reader(&self) -> Option<DerivedReader<'_>> {
        self.derived.subscriber().ok()
    }

    /// Gives a cycle to every reader; one that is behind loses its oldest.
    pub fn publish_cycle(&self, cycle: Cycle) {
        self.errors.set(cycle.sample.reading.errors);
        self.cycles.immediate_publisher().publish_immediate(cycle);
    }

    /// Whether a derived frame is to be sent: they are on, and the line has room for it beside the packets. A unit that is
    /// too fast for all of them sends as many as there is time for; each stands for itself.
    pub fn is_wanted(&self, frame: &Derived) -> bool {
        const fn line_us(bytes: usize) -> u64 {
            (bytes as u64 * BITS_PER_BYTE * 1_000_000).div_ceil(LINE_BAUD)
        }
        let free_us = self
            .settings
            .period_ms
            .saturating_mul(1000)
            .saturating_sub(line_us(PACKET_BYTES))
            .max(1);
        let every = line_us(DERIVED_BYTES).div_ceil(free_us);
        self.state.get().derived && u64::from(frame.counter).is_multiple_of(every)
    }

    /// Gives a derived frame to every reader.
    pub fn publish_derived(&self, derived: Derived) {
        self.pad.set(Pad::of(&derived));
        self.derived.immediate_publisher().publish_immediate(derived);
    }

    /// Puts right what a flipped bit of the RAM has made of the state: of it and its two copies two agree.
    pub fn mend(&self) {
        let (mut copies, mut state) = (self.copies.get(), self.state.get());
        if copies.mend(&mut state) {
            self.state.set(state);
            self.copies.set(copies);
            self.say(format_args!("a flipped bit of the mode was put right"));
        }
    }

    /// Changes the state. A change of mode is announced on both lines and waits for the log.
    pub fn change<T>(&self, cause: Cause, act: impl FnOnce(&mut State) -> T) -> T {
        self.mend();
        let before = self.state.get();
        let mut after = before;
        let outcome = act(&mut after);
        self.state.set(after);
        self.copies.set(Copies::of(&after));
        if after.mode != before.mode {
            let text = line(format_args!("mode {}: {}", after.mode.name(), cause.name()));
            for announced in &self.announced {
                let _ = announced.try_send(text.clone());
            }
            self.note(cause);
        }
        outcome
    }

    /// What the umbilical is busy with from now on.
    pub fn set_task(&self, task: Task) {
        let mut state = self.state.get();
        state.task = task;
        self.state.set(state);
    }

    /// Leaves for the log what has happened to mode or log.
    pub fn note(&self, cause: Cause) {
        self.note_at(now().as_micros(), cause);
    }

    /// The same, of what happened at another time \[us\].
    pub fn note_at(&self, at_us: u64, cause: Cause) {
        let state = self.state.get();
        self.with_changes(|changes| {
            if changes.is_full() {
                changes.pop_front();
            }
            let _ = changes.push_back(Change {
                at_us,
                mode: state.mode,
                recording: state.recording,
                cause,
            });
        });
    }

    /// Works on the changes of mode that are not in the log yet, oldest first.
    pub fn with_changes<T>(&self, act: impl FnOnce(&mut Deque<Change, CHANGES>) -> T) -> T {
        let mut changes = self.changes.take();
        let outcome = act(&mut changes);
        self.changes.set(changes);
        outcome
    }

    /// Name of the calibration set in use.
    pub fn set_name(&self) -> Name {
        let name = self.set_name.take();
        self.set_name.set(name.clone());
        name
    }

    /// Uses another set from the next cycle on.
    pub fn use_set(&self, set: &Set, name: Name) {
        self.calibration.set(*set);
        self.set_sum.set(set.checksum());
        self.set_name.set(name);
        self.set_known.set(true);
        self.set_loaded.set(true);
    }

    /// Puts a line on the console, unless eight already wait: telemetry and reading come before talking. Those that are lost
    /// are counted.
    pub fn say(&self, text: core::fmt::Arguments<'_>) {
        if self.replies.try_send(line(text)).is_err() {
            self.lines_lost.set(self.lines_lost.get().saturating_add(1));
        }
    }

    /// Puts a line on the console when there is room: for answers of many lines, of which none may be missing.
    pub fn tell(&self, text: core::fmt::Arguments<'_>) -> impl Future<Output = ()> {
        self.replies.send(line(text))
    }
}

/// As much of the text as a line holds.
fn line(text: core::fmt::Arguments<'_>) -> Line {
    struct Cut(Line);
    impl core::fmt::Write for Cut {
        fn write_str(&mut self, text: &str) -> core::fmt::Result {
            // One letter at a time: a piece that does not fit as a whole would be left out as a whole.
            text.chars()
                .try_for_each(|letter| self.0.push(letter))
                .map_err(|_| core::fmt::Error)
        }
    }
    let mut cut = Cut(Line::new());
    let _ = core::fmt::Write::write_fmt(&mut cut, text);
    log_line!(cut.0.as_str());
    cut.0
}
