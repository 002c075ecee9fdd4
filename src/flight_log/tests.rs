//! The log on a chip in memory: what a mount makes of every state that the log itself leaves, and of some that only a fault leaves.
//!
//! Power cuts and wear on a model of the chip that tears are `host-tests`' business. Here the chip does what it is told, until it is
//! told to fail, and the log's own fields are looked at.

extern crate std;

use core::cell::Cell;
use std::{collections::BTreeMap, rc::Rc, vec::Vec};

use embassy_futures::block_on;

use super::*;
use crate::{
    health::Health,
    nand::{BAD_MARK, MAIN_BYTES, NandError, SPARE_BYTES, SpareBytes},
    packet::PACKET_BYTES,
    sample::{NO_SLOT, SENSOR_COUNT},
};

mod mounted;
mod saved;
mod started;

/// Blocks of a chip of most tests.
const BLOCKS: u16 = 24;

/// A chip in memory.
#[derive(Clone)]
struct Chip {
    blocks: u16,
    pages: BTreeMap<(u16, u8), PageBytes>,
    /// Pages and spare areas read.
    reads: Rc<Cell<u32>>,
    /// Blocks erased, in order.
    erased: Vec<u16>,
    /// Pages programmed.
    programmed: u32,
    /// Programs and erases that still come to be; then the power is gone.
    left: u32,
    /// Pages whose program fails.
    failing: Vec<(u16, u8)>,
    /// Once so many blocks were erased, this block cannot be read.
    silent: Option<(usize, u16)>,
}

impl Chip {
    fn new(blocks: u16) -> Self {
        Chip {
            blocks,
            pages: BTreeMap::new(),
            reads: Rc::default(),
            erased: Vec::new(),
            programmed: 0,
            left: u32::MAX,
            failing: Vec::new(),
            silent: None,
        }
    }

    fn log(&mut self) -> FlightLog<&mut Chip> {
        FlightLog::new(self, BootHeader::default())
    }

    /// One that is mounted.
    fn mounted(&mut self) -> FlightLog<&mut Chip> {
        self.left = u32::MAX;
        let mut log = self.log();
        block_on(log.mount()).expect("mounts");
        log
    }

    /// A start that records so many, as far as the power lasts.
    fn start(&mut self, records: u32) {
        let left = core::mem::replace(&mut self.left, u32::MAX);
        let mut log = self.mounted();
        log.chip.left = left;
        for _ in 0..records {
            if block_on(log.append(&entry())).is_err() {
                break;
            }
        }
        self.left = u32::MAX;
    }

    /// A start whose power goes after so many programs and erases.
    fn start_cut(&mut self, records: u32, after: u32) {
        self.left = after;
        self.start(records);
    }

    fn mark(&mut self, block: u16, page: u8) {
        self.at(block, page)[MAIN_BYTES + BAD_MARK] = 0;
    }

    fn at(&mut self, block: u16, page: u8) -> &mut PageBytes {
        self.pages.entry((block, page)).or_insert([0xFF; PAGE_BYTES])
    }

    /// A page with these records of a log of this epoch, as a boot wrote it.
    fn write(&mut self, at: (u16, u8), (epoch, boot): (u16, u32), [a, b]: [&RecordBytes; 2]) {
        let kind = PageKind::Log;
        let mut bytes = [0; PAGE_BYTES];
        page::compose(&mut bytes, a, b);
        let boot = boot as u16;
        page::address(
            &mut bytes,
            PageAddress {
                block: at.0,
                page: at.1,
            },
            page::Tag { kind, epoch, boot },
        );
        self.pages.insert(at, bytes);
    }

    /// A save of the superblock in its first block, both copies.
    fn save(&mut self, superblock: &Superblock) {
        for page in 0..2 {
            let bytes = superblock::encode(superblock);
            self.write((0, page), (superblock.epoch, superblock.boot), [&bytes, &bytes]);
            let at = PageAddress { block: 0, page };
            let tag = page::Tag {
                kind: PageKind::Superblock,
                epoch: superblock.epoch,
                boot: superblock.boot as u16,
            };
            page::address(self.at(0, page), at, tag);
        }
    }

    /// Keys of the whole packet records of an epoch on the chip, ascending: every page is read.
    fn packets(&self, epoch: u16) -> Vec<Key> {
        let mut keys = Vec::new();
        for bytes in self.pages.range((LOG_START, 0)..).map(|(_, bytes)| bytes) {
            let mut bytes = *bytes;
            let whole = page::correct(&mut bytes);
            for half in (0..2).filter(|half| whole[*half].is_ok()) {
                let bytes = page::record(&bytes, half);
                let key = record::key(bytes).ok().filter(|key| key.epoch == epoch);
                keys.extend(key.filter(|_| record::is_packet(bytes)));
            }
        }
        keys.sort();
        keys.dedup();
        keys
    }
}

impl Nand for Chip {
    fn blocks(&self) -> u16 {
        self.blocks
    }

    async fn identify(&mut self) -> Result<(), NandError> {
        Ok(())
    }

    fn read(&mut self, at: PageAddress, bytes: &mut PageBytes) -> Result<(), NandError> {
        self.reads.set(self.reads.get() + 1);
        if (self.silent).is_some_and(|(erased, block)| self.erased.len() >= erased && block == at.block) {
            return Err(NandError::Timeout);
        }
        *bytes = self
            .pages
            .get(&(at.block, at.page))
            .copied()
            .unwrap_or([0xFF; PAGE_BYTES]);
        Ok(())
    }

    fn read_spare(&mut self, at: PageAddress, bytes: &mut SpareBytes) -> Result<(), NandError> {
        self.reads.set(self.reads.get() + 1);
        let page = self.pages.get(&(at.block, at.page));
        *bytes = page.map_or([0xFF; SPARE_BYTES], |page| *page::spare(page));
        Ok(())
    }

    async fn program(&mut self, at: PageAddress, bytes: &PageBytes) -> Result<(), NandError> {
        self.left = self.left.checked_sub(1).ok_or(NandError::PowerFailing)?;
        if self.failing.contains(&(at.block, at.page)) {
            return Err(NandError::Failed);
        }
        assert!(
            self.pages.insert((at.block, at.page), *bytes).is_none(),
            "programmed twice"
        );
        self.programmed += 1;
        Ok(())
    }

    async fn erase(&mut self, block: u16) -> Result<(), NandError> {
        self.left = self.left.checked_sub(1).ok_or(NandError::PowerFailing)?;
        self.pages.retain(|(of, _), _| *of != block);
        self.erased.push(block);
        Ok(())
    }
}

fn entry() -> Entry {
    Entry {
        start_us: 0,
        packet: [0; PACKET_BYTES],
        slots_us: [NO_SLOT; SENSOR_COUNT],
        flight: false,
        health: Health(0),
        estimate: None,
    }
}

/// A packet record with this key.
fn packet(boot: u32, seq: u32) -> RecordBytes {
    record::encode_entry(Key { epoch: 0, boot, seq }, &entry())
}

/// A boot header with this key.
fn header(boot: u32) -> RecordBytes {
    record::encode_header(Key { epoch: 0, boot, seq: 0 }, &BootHeader::default())
}
