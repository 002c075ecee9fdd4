use std::collections::VecDeque;

use emems::{
    flight_log::record::{Entry, Key, encode_entry},
    health::Health,
    packet,
    sample::{Reading, SENSOR_COUNT},
};

use super::*;
use crate::log;

const USED: u32 = 40;
/// A page of the log that gives nothing.
const HOLE: u32 = 17;

/// A unit at the other end: answers G_ST and G_LR, garbles some bytes, is unplugged after some.
struct Unit {
    heard: Vec<u8>,
    says: VecDeque<u8>,
    sent: usize,
    garble_every: usize,
    unplugged_after: usize,
}

fn unit(garble_every: usize, unplugged_after: usize) -> Unit {
    Unit {
        heard: Vec::new(),
        says: VecDeque::new(),
        sent: 0,
        garble_every,
        unplugged_after,
    }
}

fn record_of(page: u32) -> record::RecordBytes {
    let entry = Entry {
        start_us: u64::from(page),
        packet: packet::encode(&Reading::unread(page as u16)),
        slots_us: [0; SENSOR_COUNT],
        flight: true,
        health: Health(0),
        estimate: None,
    };
    let key = Key {
        epoch: 0,
        boot: 1,
        seq: page + 1,
    };
    encode_entry(key, &entry)
}

impl Unit {
    fn answer(&mut self) {
        if self.heard == b"G_ST" {
            self.says
                .extend(format!(">G_ST WAIT task none\r\n>G_ST recorder {USED} of 9 pages, 0 bad\r\n").bytes());
            self.heard.clear();
        } else if self.heard.len() == 16 {
            let number = |from: usize| {
                let text = String::from_utf8_lossy(&self.heard[from..from + 6]).into_owned();
                u32::from_str_radix(&text, 16).expect("hexadecimal")
            };
            let (first, count) = (number(4), number(10));
            self.says.extend(b">G_LR ok: WAIT\r\n");
            for page in (first..(first + count).min(USED)).filter(|page| *page != HOLE) {
                let record = record_of(page);
                self.says.extend(record::packet(&record).expect("a packet"));
                self.says.extend(dump::encode(page, &record));
            }
            self.says.extend(b">dump ends at page 40 of 40\r\n");
            self.heard.clear();
        }
    }
}

impl Write for Unit {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.heard.extend_from_slice(bytes);
        self.answer();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Unit {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.sent >= self.unplugged_after {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        let count = bytes.len().min(self.says.len()).min(37);
        for (slot, byte) in bytes.iter_mut().zip(self.says.drain(..count)) {
            self.sent += 1;
            let garbled = self.garble_every != 0 && self.sent.is_multiple_of(self.garble_every) && byte != b'\n';
            *slot = if garbled { byte ^ 4 } else { byte };
        }
        Ok(count)
    }
}

fn pages(file: &[u8]) -> Vec<u32> {
    let mut pages: Vec<u32> = frames(file).map(|(page, _)| page).collect();
    pages.sort_unstable();
    pages.dedup();
    pages
}

fn all() -> Vec<u32> {
    (0..USED).filter(|page| *page != HOLE).collect()
}

#[test]
fn a_dump_holds_every_page_and_says_which_gave_nothing() {
    let mut file = Vec::new();
    let pulled = pull(&mut unit(0, usize::MAX), &[], &mut file, 0..u32::MAX, |_, _| {}).expect("pulled");
    assert_eq!(pages(&file), all());
    assert_eq!((pulled.pages, pulled.with_records, pulled.without), (40, 39, 1));
    assert_eq!(log::read(&file).expect("a log").packets.len(), 39);
}

#[test]
fn damaged_pages_are_asked_for_again() {
    let mut file = Vec::new();
    // Every third record has a wrong bit somewhere.
    pull(&mut unit(1_511, usize::MAX), &[], &mut file, 0..u32::MAX, |_, _| {}).expect("pulled");
    assert_eq!(pages(&file), all());
}

#[test]
fn wherever_it_is_unplugged_it_goes_on_and_ends_whole() {
    for unplugged_after in (50..15_000).step_by(487) {
        let mut file = Vec::new();
        let broken = pull(&mut unit(0, unplugged_after), &[], &mut file, 0..u32::MAX, |_, _| {});
        assert!(
            matches!(broken, Err(DumpError::Line(_))) || broken.is_ok(),
            "{broken:?}"
        );
        let before = file.clone();
        let pulled = pull(&mut unit(0, usize::MAX), &before, &mut file, 0..u32::MAX, |_, _| {}).expect("pulled");
        assert_eq!(pages(&file), all(), "unplugged after {unplugged_after}");
        assert_eq!(pulled.from_before as usize, pages(&before).len());
    }
}

#[test]
fn a_range_is_what_is_pulled() {
    let mut file = Vec::new();
    let pulled = pull(&mut unit(0, usize::MAX), &[], &mut file, 5..9, |_, _| {}).expect("pulled");
    assert_eq!((pages(&file), pulled.pages), (vec![5, 6, 7, 8], 4));
}

#[test]
fn a_silent_unit_is_given_up() {
    struct Silent;
    impl Read for Silent {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(io::ErrorKind::TimedOut.into())
        }
    }
    impl Write for Silent {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let outcome = pull(&mut Silent, &[], &mut Vec::new(), 0..u32::MAX, |_, _| {});
    assert!(matches!(outcome, Err(DumpError::Silent)));
}

/// Of the latest boot, and of each the last.
#[test]
fn the_rail_and_the_site_that_the_latest_boot_took_are_said() {
    use emems::{
        mode::{Change, Mode},
        rail::Rail,
        site::Told,
    };
    let mut log = Log::default();
    assert_eq!(taken(&log), "");
    let rail = |azimuth| {
        Cause::RailTaken(Rail {
            azimuth,
            elevation: 8_500,
            azimuth_sd: 5,
            elevation_sd: 3,
        })
    };
    let site = Cause::SiteTaken(Told::of_bytes([
        0x26, 0x34, 0xFF, 0x18, 0xF7, 0xDD, 0xFC, 0x84, 2, 0x0A, 0x40, 15, 0,
    ]));
    let mut note = |boot, seq, cause| {
        let change = Change {
            at_us: 0,
            mode: Mode::Wait,
            recording: false,
            cause,
        };
        log.changes.insert(Key { epoch: 0, boot, seq }, change);
    };
    note(1, 1, site);
    note(2, 1, rail(100));
    note(2, 2, rail(200));
    let said = taken(&log);
    assert!(
        said.starts_with("launch rail: azimuth 2.00 elevation 85.00 sigma 0.5 0.3 deg\n"),
        "{said}"
    );
    assert!(
        said.ends_with("launch site: none taken by boot 2, the latest, as far as these pages say\n"),
        "{said}"
    );
}
