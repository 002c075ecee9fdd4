//! The part as its pins see it: latch cycles in, bytes out, busy while it works.
//!
//! In: bytes with CLE, with ALE, or as data, each with its instant. Out: data and status bytes. An operation takes
//! effect when its time is over; a power cut before that tears it. Refuses nothing: cycles that make no sense are
//! ignored, as the part ignores them.

use emems::nand::{MAIN_BYTES, PAGE_BYTES, PAGES_PER_BLOCK, PageAddress, PageBytes};

use super::{Break, Cells, ERASE, Outcome, PROGRAM, READ, TEARS, Tear};
use crate::part::Nanos;

/// Maker and device code.
const ID: [u8; 2] = [0xEC, 0x76];
const READY: u8 = 0x40;
const NOT_PROTECTED: u8 = 0x80;
const FAIL: u8 = 0x01;
/// \[ns\] WP# high before a program or erase command, tWW at least.
const WRITABLE_AFTER: Nanos = 100;

/// What data cycles give.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Output {
    Nothing,
    Data,
    Status,
    Id,
}

/// What takes effect when the part is ready again.
#[derive(Clone)]
enum Work {
    Nothing,
    Read(PageAddress),
    Program(PageAddress, Box<PageBytes>),
    Erase(u16),
}

impl Work {
    /// \[ns\] to give it up, tRST at most.
    fn reset(&self) -> Nanos {
        match self {
            Work::Nothing | Work::Read(_) => 5_000,
            Work::Program(..) => 10_000,
            Work::Erase(_) => 500_000,
        }
    }
}

/// The part.
#[derive(Clone)]
pub struct K9f1208 {
    /// Its cells.
    pub cells: Cells,
    output: Output,
    /// The spare area was asked for.
    spare: bool,
    command: u8,
    address: Vec<u8>,
    data: Box<PageBytes>,
    column: usize,
    work: Work,
    busy_until: Nanos,
    failed: bool,
    protected: bool,
    /// When WP# went high.
    writable_since: Nanos,
    /// Bytes asked of it while it was dead.
    pub dead: u64,
    /// Bytes asked of it while it was not there.
    pub absent: u64,
}

impl K9f1208 {
    /// A part with these cells, ready.
    pub fn new(cells: Cells) -> Self {
        K9f1208 {
            cells,
            output: Output::Nothing,
            spare: false,
            command: 0xFF,
            address: Vec::new(),
            data: Box::new([0xFF; PAGE_BYTES]),
            column: 0,
            work: Work::Nothing,
            busy_until: 0,
            failed: false,
            protected: true,
            writable_since: 0,
            dead: 0,
            absent: 0,
        }
    }

    /// WP#. It also switches the part's high voltage off (K9F1208U0M data sheet, "Data Protection"), so what is under way
    /// then is torn, as when the processor that holds the pin high is reset.
    pub fn protect(&mut self, on: bool, now: Nanos) {
        self.settle(now);
        if on && self.busy(now) {
            self.give_up(now);
        }
        if self.protected && !on {
            self.writable_since = now;
        }
        self.protected = on;
    }

    /// Whether WP# keeps its cells from being changed.
    pub fn is_protected(&self) -> bool {
        self.protected
    }

    /// A byte with CLE high.
    pub fn command(&mut self, byte: u8, now: Nanos) {
        self.settle(now);
        if self.busy(now) && !matches!(byte, 0x70 | 0xFF) {
            return;
        }
        if matches!(byte, 0x80 | 0x60) && !self.protected && now < self.writable_since + WRITABLE_AFTER {
            self.cells.breaks.push(Break::WritableTooShort);
        }
        match byte {
            0x00 | 0x01 | 0x50 => {
                self.output = Output::Data;
                self.spare = byte == 0x50;
                self.column = if self.spare {
                    MAIN_BYTES
                } else {
                    256 * usize::from(byte)
                };
            }
            0x80 => {
                self.data.fill(0xFF);
                self.output = Output::Nothing;
            }
            0x60 => self.output = Output::Nothing,
            0x10 if self.command == 0x80 && self.address.len() >= 4 => {
                let work = Work::Program(self.page(), self.data.clone());
                self.begin(work, PROGRAM, now);
            }
            0xD0 if self.command == 0x60 && self.address.len() >= 3 => {
                self.address.insert(0, 0);
                let work = Work::Erase(self.page().block);
                self.begin(work, ERASE, now);
            }
            0x70 => self.output = Output::Status,
            0x90 => {
                self.output = Output::Id;
                self.column = 0;
            }
            0xFF => {
                // Given up half-way, it is as torn as by a power cut.
                self.give_up(now);
                self.output = Output::Nothing;
                self.failed = false;
            }
            _ => {}
        }
        if byte != 0x70 {
            self.command = byte;
            self.address.clear();
        }
    }

    /// A byte with ALE high.
    pub fn address(&mut self, byte: u8, now: Nanos) {
        self.settle(now);
        if self.busy(now) {
            return;
        }
        self.address.push(byte);
        if self.address.len() == 4 && matches!(self.command, 0x00 | 0x01 | 0x50) {
            self.column = match self.command {
                0x50 => MAIN_BYTES + usize::from(self.address[0] & 0xF),
                half => 256 * usize::from(half) + usize::from(self.address[0]),
            };
            let work = Work::Read(self.page());
            self.begin(work, READ, now);
        }
    }

    /// A data byte towards the part.
    pub fn write(&mut self, byte: u8, now: Nanos) {
        self.settle(now);
        if self.command == 0x80 && self.address.len() >= 4 && self.column < PAGE_BYTES {
            self.data[self.column] = byte;
            self.column += 1;
        }
    }

    /// A data byte from the part.
    pub fn read(&mut self, now: Nanos) -> u8 {
        self.settle(now);
        self.dead += u64::from(self.cells.befalls.dead);
        if self.cells.befalls.absent {
            self.absent += 1;
            return 0xFF;
        }
        match self.output {
            Output::Status => {
                let ready = if self.busy(now) { 0 } else { READY };
                let writable = if self.protected { 0 } else { NOT_PROTECTED };
                ready | writable | if self.failed { FAIL } else { 0 }
            }
            Output::Id => {
                self.column += 1;
                ID.get(self.column - 1).copied().unwrap_or(0)
            }
            Output::Data if self.column < PAGE_BYTES && !self.busy(now) => {
                self.column += 1;
                self.data[self.column - 1]
            }
            _ => 0xFF,
        }
    }

    /// The power goes and comes back: what was under way tears, in the way that `draw` picks.
    pub fn power_cut(&mut self, now: Nanos, draw: usize) {
        self.settle(now);
        self.tear(now, TEARS[draw % TEARS.len()]);
        let counted = (self.dead, self.absent);
        *self = K9f1208::new(self.cells.clone());
        (self.dead, self.absent) = counted;
    }

    fn busy(&self, now: Nanos) -> bool {
        now < self.busy_until || self.cells.befalls.dead
    }

    fn page(&self) -> PageAddress {
        let row = self.address.iter().skip(1).take(3).rev();
        let row = row.fold(0_u32, |row, byte| row << 8 | u32::from(*byte));
        let block = row / u32::from(PAGES_PER_BLOCK);
        PageAddress {
            block: (block % u32::from(self.cells.block_count())) as u16,
            page: (row % u32::from(PAGES_PER_BLOCK)) as u8,
        }
    }

    fn begin(&mut self, work: Work, takes: Nanos, now: Nanos) {
        if self.protected && !matches!(work, Work::Read(_)) {
            // It goes on as if nothing had been asked.
            return;
        }
        (self.work, self.busy_until, self.failed) = (work, now + takes, false);
    }

    /// Lets what is over take effect.
    fn settle(&mut self, now: Nanos) {
        if self.busy(now) {
            return;
        }
        let outcome = match std::mem::replace(&mut self.work, Work::Nothing) {
            Work::Nothing => return,
            Work::Read(at) => {
                *self.data = self.cells.read(at);
                Outcome::Done
            }
            Work::Program(at, bytes) => self.cells.program(at, &bytes),
            Work::Erase(block) => self.cells.erase(block),
        };
        self.failed = outcome == Outcome::Failed;
    }

    /// Leaves what is under way half done, and is busy with that for a while. Asked again meanwhile, it takes no longer.
    fn give_up(&mut self, now: Nanos) {
        let reset = self.work.reset();
        let giving_up = matches!(self.work, Work::Nothing) && now < self.busy_until;
        self.tear(now, Tear::Half);
        if !giving_up {
            self.busy_until = now + reset;
        }
    }

    fn tear(&mut self, now: Nanos, tear: Tear) {
        let work = std::mem::replace(&mut self.work, Work::Nothing);
        if now >= self.busy_until {
            return;
        }
        self.cells.befalls.cut = Some((self.cells.operations + 1, tear));
        match work {
            Work::Program(at, bytes) => self.cells.program(at, &bytes),
            Work::Erase(block) => self.cells.erase(block),
            Work::Nothing | Work::Read(_) => Outcome::Done,
        };
        self.cells.power_on();
    }
}
