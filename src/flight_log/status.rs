//! How the log stands: fill, bad blocks, corrected bits, the newest record.

use super::record::Key;

/// How the log stands. Pages are counted from its first block; each holds one new record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Status {
    /// Pages that are used or were passed over.
    pub used: u32,
    /// Pages in all.
    pub capacity: u32,
    /// Bad blocks that are remembered.
    pub bad_blocks: u16,
    /// No other can be remembered: there may be more, which are found anew in each start.
    pub more_bad_blocks: bool,
    /// Bits corrected since the start.
    pub corrected: u32,
    /// Half pages that were beyond correction since the start, torn ones included.
    pub uncorrectable: u32,
    /// Pages were read that belong elsewhere: an address line is stuck, or a program went astray.
    pub astray: bool,
    /// Blocks that are still to be erased in free time.
    pub erasing: Option<u32>,
    /// The newest record, and when its cycle began \[us\].
    pub last: Option<(Key, u64)>,
}

impl Status {
    /// \[min\] until the log is full, at a record each `period_ms`.
    pub fn minutes_left(&self, period_ms: u64) -> u64 {
        u64::from(self.capacity.saturating_sub(self.used)).saturating_mul(period_ms) / 60_000
    }
}
