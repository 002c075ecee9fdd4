//! The recorder as the unit sees it, and one that keeps the newest flight in RAM.
//!
//! In: records, one a packet. Out: whether each is kept, and the kept ones by number. Refuses to append when full or
//! while erasing, and says so; it never overwrites.

use heapless::Vec;

use crate::packet::PACKET_BYTES;

/// What is kept of one cycle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// [us] start of the cycle, since the unit's clock started.
    pub start_us: u64,
    /// The 156 bytes, verbatim.
    pub packet: [u8; PACKET_BYTES],
}

/// How full the recorder is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct RecorderStatus {
    /// Records kept.
    pub used: u32,
    /// Records that fit.
    pub capacity: u32,
    /// An erase is under way: how many steps are left.
    pub erasing: Option<u32>,
}

/// Why the recorder refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum RecorderError {
    /// No room is left; nothing was overwritten.
    Full,
    /// An erase is under way.
    Erasing,
    /// No record has this number.
    NoSuchRecord,
    /// The memory did not answer or failed.
    Memory,
}

/// Where packets are recorded. Every method is bounded in time and touches no other part of the unit.
#[allow(async_fn_in_trait)]
pub trait Recorder {
    /// Keeps a record; `Ok` means it is durable.
    async fn append(&mut self, record: &Record) -> Result<(), RecorderError>;
    /// Record number `index`, oldest first.
    async fn read(&mut self, index: u32) -> Result<Record, RecorderError>;
    /// Starts erasing everything; [`Recorder::erase_step`] does the work.
    fn start_erase(&mut self);
    /// A bounded part of a started erase (at most 3 ms); returns how many are left.
    async fn erase_step(&mut self) -> Result<u32, RecorderError>;
    /// How full it is.
    fn status(&self) -> RecorderStatus;
}

/// A recorder that lives elsewhere, so that moving its owner does not move ten kilobytes.
impl<R: Recorder> Recorder for &mut R {
    async fn append(&mut self, record: &Record) -> Result<(), RecorderError> {
        R::append(self, record).await
    }

    async fn read(&mut self, index: u32) -> Result<Record, RecorderError> {
        R::read(self, index).await
    }

    fn start_erase(&mut self) {
        R::start_erase(self);
    }

    async fn erase_step(&mut self) -> Result<u32, RecorderError> {
        R::erase_step(self).await
    }

    fn status(&self) -> RecorderStatus {
        R::status(self)
    }
}

/// A recorder in RAM for `N` records: it survives neither reset nor power cut.
#[derive(Default)]
pub struct MemoryRecorder<const N: usize> {
    records: Vec<Record, N>,
    erasing: bool,
}

impl<const N: usize> MemoryRecorder<N> {
    /// An empty recorder.
    pub const fn new() -> Self {
        MemoryRecorder {
            records: Vec::new(),
            erasing: false,
        }
    }
}

impl<const N: usize> Recorder for MemoryRecorder<N> {
    async fn append(&mut self, record: &Record) -> Result<(), RecorderError> {
        if self.erasing {
            return Err(RecorderError::Erasing);
        }
        self.records.push(record.clone()).map_err(|_| RecorderError::Full)
    }

    async fn read(&mut self, index: u32) -> Result<Record, RecorderError> {
        self.records
            .get(index as usize)
            .cloned()
            .ok_or(RecorderError::NoSuchRecord)
    }

    fn start_erase(&mut self) {
        self.erasing = true;
    }

    async fn erase_step(&mut self) -> Result<u32, RecorderError> {
        self.records.clear();
        self.erasing = false;
        Ok(0)
    }

    fn status(&self) -> RecorderStatus {
        RecorderStatus {
            used: self.records.len() as u32,
            capacity: N as u32,
            erasing: self.erasing.then_some(1),
        }
    }
}

#[cfg(test)]
mod tests {
    use embassy_futures::block_on;

    use super::*;

    fn record(start_us: u64) -> Record {
        Record {
            start_us,
            packet: [b'0'; PACKET_BYTES],
        }
    }

    #[test]
    fn a_full_recorder_says_so_and_overwrites_nothing() {
        let mut recorder = MemoryRecorder::<2>::new();
        assert_eq!(block_on(recorder.append(&record(1))), Ok(()));
        assert_eq!(block_on(recorder.append(&record(2))), Ok(()));
        assert_eq!(block_on(recorder.append(&record(3))), Err(RecorderError::Full));
        assert_eq!(block_on(recorder.read(0)), Ok(record(1)));
        assert_eq!(block_on(recorder.read(2)), Err(RecorderError::NoSuchRecord));
    }

    #[test]
    fn nothing_is_recorded_until_an_erase_is_done() {
        let mut recorder = MemoryRecorder::<2>::new();
        let _ = block_on(recorder.append(&record(1)));
        recorder.start_erase();
        assert_eq!(block_on(recorder.append(&record(2))), Err(RecorderError::Erasing));
        assert_eq!(block_on(recorder.erase_step()), Ok(0));
        assert_eq!(
            recorder.status(),
            RecorderStatus {
                used: 0,
                capacity: 2,
                erasing: None
            }
        );
    }
}
