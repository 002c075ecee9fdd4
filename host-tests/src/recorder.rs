//! Flights of the flight log on a model of its chip, cut as often as one likes, and the verdict on what is left.
//!
//! In: a chip, where the power goes and how each cut tears. Out: a [`Tally`] of records that were acknowledged and are
//! gone, of records that are not what was given, and of the chip's rules broken. The judge reads the chip's raw pages by
//! itself; of the log's code it uses the two decoders only.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::AddAssign,
    sync::atomic::{AtomicBool, Ordering},
};

use embassy_futures::block_on;
use emems::{
    flight_log::{
        FlightLog, LOG_START, LogError, page,
        record::{self, BootHeader, Content, Entry, Key},
    },
    health::Health,
    nand::{PAGES_PER_BLOCK, PageAddress},
    packet::PACKET_BYTES,
    sample::{NO_SLOT, SENSOR_COUNT},
};
use rand_xoshiro::{
    SplitMix64,
    rand_core::{Rng, SeedableRng},
};
use twin::part::nand::{Cells, Tear, Wear};

/// What became of some runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Runs.
    pub runs: u64,
    /// Cuts that struck: the power went while the chip was at an operation.
    pub cuts: u64,
    /// Operations that a cut left neither undone nor done.
    pub torn: u64,
    /// Records acknowledged.
    pub acknowledged: u64,
    /// Of those, how many are not there.
    pub lost: u64,
    /// Records that are there and are not what was given, or twice with different content, or out of order.
    pub wrong: u64,
    /// Rules of the chip that were broken.
    pub breaks: u64,
    /// Refusals of a log that had room and a chip that works.
    pub refused: u64,
}

impl Tally {
    /// What a campaign of cuts has to show: nothing amiss in so many runs, so many cuts that struck, and operations torn by so
    /// many of them. Of the nine ways to tear two leave an operation undone or done, and an erase of a blank block leaves
    /// nothing to tear.
    ///
    /// # Panics
    /// When it does not: a campaign that injects nothing proves nothing.
    pub fn check(&self, runs: u64, cuts: u64, torn: u64) {
        assert!(self.is_clean(), "{self:?}");
        assert!(self.runs >= runs, "fewer than {runs} runs: {self:?}");
        assert!(self.cuts >= cuts, "fewer than {cuts} cuts struck: {self:?}");
        assert!(self.torn >= torn, "cuts that tear nothing: {self:?}");
        assert!(self.acknowledged > self.runs, "nothing was at stake: {self:?}");
    }

    /// Nothing lost, wrong, broken or refused.
    pub fn is_clean(&self) -> bool {
        (self.lost, self.wrong, self.breaks, self.refused) == (0, 0, 0, 0)
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Tally) {
        self.runs += other.runs;
        self.cuts += other.cuts;
        self.torn += other.torn;
        self.acknowledged += other.acknowledged;
        self.lost += other.lost;
        self.wrong += other.wrong;
        self.breaks += other.breaks;
        self.refused += other.refused;
    }
}

/// Every way to wear out.
pub const WEARS: [Wear; 4] = [
    Wear::ProgramFails,
    Wear::EraseFails,
    Wear::ProgramDoesNothing,
    Wear::EraseDoesNothing,
];

/// Entry number `id`; every one is different in every field.
pub fn entry(id: u32) -> Entry {
    let mut random = SplitMix64::seed_from_u64(id.into());
    let mut packet = [0; PACKET_BYTES];
    random.fill_bytes(&mut packet);
    let mut slots_us = [NO_SLOT; SENSOR_COUNT];
    slots_us[id as usize % SENSOR_COUNT] = 4 * (id % 10_000);
    Entry {
        start_us: id.into(),
        packet,
        slots_us,
        flight: id.is_multiple_of(2),
        health: Health(id),
        estimate: None,
    }
}

/// A flight: records are appended, boots are cut short.
pub struct Flown {
    /// The chip afterwards.
    pub chip: Cells,
    /// What was acknowledged, by its key.
    pub acknowledged: BTreeMap<Key, u32>,
    /// Entries that were given to the log, acknowledged or not.
    pub given: u32,
    /// Cuts that struck.
    pub cuts: u64,
    /// Refusals without a cut.
    pub refused: u64,
    /// The log's key was not above all before it.
    pub disorder: u64,
}

impl Flown {
    /// A flight yet to be flown.
    pub fn on(chip: Cells) -> Self {
        Flown {
            chip,
            acknowledged: BTreeMap::new(),
            given: 0,
            cuts: 0,
            refused: 0,
            disorder: 0,
        }
    }

    /// One boot: mounts, appends up to `records`, cut at operation `after` from now if there is a cut.
    pub fn boot(&mut self, records: u32, cut: Option<(u64, Tear)>) {
        self.chip.power_on();
        self.chip.befalls.cut = cut.map(|(after, tear)| (self.chip.operations + after, tear));
        let mut log = log(&mut self.chip);
        let ended: Result<(), LogError> = block_on(async {
            log.mount().await?;
            for _ in 0..records {
                let id = self.given;
                self.given += 1;
                let key = log.append(&entry(id)).await?;
                if self.acknowledged.last_key_value().is_some_and(|(last, _)| *last >= key) {
                    self.disorder += 1;
                }
                self.acknowledged.insert(key, id);
                // Free time comes, but not always.
                if !id.is_multiple_of(3) {
                    log.free_time().await?;
                }
            }
            Ok(())
        });
        if self.chip.off {
            self.cuts += 1;
        } else if let Err(error) = ended {
            println!("refused: {error}");
            self.refused += 1;
        }
    }

    /// The verdict; `excused` keys may be gone.
    pub fn judge(&mut self, excused: &BTreeSet<Key>) -> Tally {
        self.chip.power_on();
        let mut wrong = self.disorder;
        let found = read_all(&mut self.chip, &mut wrong);
        let mut ids = BTreeSet::new();
        for id in found.values() {
            wrong += u64::from(*id >= self.given || !ids.insert(*id));
        }
        let in_order = found.values().zip(found.values().skip(1));
        wrong += in_order.filter(|(before, after)| before >= after).count() as u64;
        let gone = |(key, id): &(&Key, &u32)| found.get(key) != Some(id) && !excused.contains(key);
        Tally {
            runs: 1,
            cuts: self.cuts,
            torn: self.chip.torn,
            acknowledged: self.acknowledged.len() as u64,
            lost: self.acknowledged.iter().filter(gone).count() as u64,
            wrong,
            breaks: self.chip.breaks.len() as u64,
            refused: self.refused,
        }
    }
}

/// The log on a chip, not mounted.
pub fn log(chip: &mut Cells) -> FlightLog<&mut Cells> {
    FlightLog::new(chip, BootHeader::default())
}

/// A chip of so many blocks with three boots of records: 40, 3 and 50.
pub fn three_boots(blocks: u16, seed: u64) -> Flown {
    let mut flown = Flown::on(Cells::new(blocks, &[], seed));
    for records in [40, 3, 50] {
        flown.boot(records, None);
    }
    flown
}

/// The tally of a flight of which nothing may be amiss.
///
/// # Panics
/// When something is.
pub fn nothing_lost(mut flown: Flown) -> Tally {
    let tally = flown.judge(&BTreeSet::new());
    assert!(tally.is_clean(), "{tally:?} {:?}", flown.chip.breaks);
    tally
}

/// Every whole packet record on the chip, by key; counts those that are not what [`entry`] makes.
pub fn read_all(chip: &mut Cells, wrong: &mut u64) -> BTreeMap<Key, u32> {
    let mut found = BTreeMap::new();
    for block in LOG_START..chip.block_count() {
        for page in 0..PAGES_PER_BLOCK {
            let mut bytes = chip.read(PageAddress { block, page });
            if page::is_blank(&bytes) {
                continue;
            }
            let whole = page::correct(&mut bytes);
            for (half, whole) in whole.into_iter().enumerate() {
                if whole.is_err() {
                    continue;
                }
                if let Ok((key, Content::Packet(read))) = record::decode(page::record(&bytes, half)) {
                    let id = read.start_us as u32;
                    *wrong += u64::from(read != entry(id));
                    *wrong += u64::from(found.insert(key, id).is_some_and(|other| other != id));
                }
            }
        }
    }
    found
}

/// Blocks that a flight of a test fills at most.
const LOGGED_BLOCKS: u16 = 150;

/// Packets of a flight on its chip, by key, as far as [`LOGGED_BLOCKS`].
pub fn logged(chip: Cells) -> Vec<(Key, [u8; PACKET_BYTES])> {
    let packets = contents(chip).into_iter();
    packets
        .filter_map(|(key, content)| match content {
            Content::Packet(entry) => Some((key, entry.packet)),
            _ => None,
        })
        .collect()
}

/// Everything of a flight on its chip, by key, as far as [`LOGGED_BLOCKS`].
pub fn contents(mut chip: Cells) -> BTreeMap<Key, Content> {
    let mut found = BTreeMap::new();
    for block in LOG_START..LOG_START + LOGGED_BLOCKS {
        for page in 0..PAGES_PER_BLOCK {
            let mut bytes = chip.read(PageAddress { block, page });
            let whole = page::correct(&mut bytes);
            for half in (0..2).filter(|half| whole[*half].is_ok()) {
                if let Ok((key, content)) = record::decode(page::record(&bytes, half)) {
                    found.insert(key, content);
                }
            }
        }
    }
    found
}

/// Runs `flights` on all cores, each with its number, and adds up. After one that is not clean no other begins: what it shows is
/// known, and the rest of a campaign takes minutes.
pub fn campaign(flights: u64, fly: impl Fn(u64) -> Tally + Sync) -> Tally {
    let workers = std::thread::available_parallelism().map_or(1, |cores| cores.get() as u64);
    let mut total = Tally::default();
    let clean = AtomicBool::new(true);
    std::thread::scope(|scope| {
        let shares = (0..workers).map(|worker| {
            let (fly, clean) = (&fly, &clean);
            scope.spawn(move || {
                let mut tally = Tally::default();
                for flight in (worker..flights).step_by(workers as usize) {
                    if !clean.load(Ordering::Relaxed) {
                        break;
                    }
                    let one = fly(flight);
                    if !one.is_clean() {
                        clean.store(false, Ordering::Relaxed);
                        println!("flight {flight} is not clean: {one:?}");
                    }
                    tally += one;
                }
                tally
            })
        });
        for share in shares.collect::<Vec<_>>() {
            total += share.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        }
    });
    println!("{total:?}");
    total
}

/// A generator for the choices of one run.
pub fn draws(seed: u64, run: u64) -> impl FnMut(u64) -> u64 {
    let mut random = SplitMix64::seed_from_u64(seed ^ run.wrapping_mul(0x9E37_79B9_7F4A_7C15));
    move |below| random.next_u64() % below
}
