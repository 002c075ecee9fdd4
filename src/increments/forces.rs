//! The accelerometers between two packets.
//!
//! A packet has one reading of them, and what moves a unit faster than half its packets' rate is folded down: at 5 Hz a
//! hand's shaking looks like tilt. So they are read some times more, evenly between two cycles, each reading with what the
//! gyros had turned by then; the estimation takes the mean (`estimate/force`).

use crate::{geometry::PLATES, sample::NOT_READ};

/// Readings between two cycles.
pub const READINGS: usize = 2;

/// \[ms\] a shorter period has none: its packets are fast enough, and the bus has other things to do.
pub const SHORTEST_PERIOD_MS: u64 = 100;

/// The readings between two cycles, oldest first.
pub type Forces = [Force; READINGS];

/// One reading of the accelerometers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Force {
    /// [LIS331HH counts] x, y, z of each plate, plate frame `p`; [`NOT_READ`] where it was not read.
    pub acc_p: [[i16; 3]; PLATES],
    /// \[rad\] rotation vector in b: what b had turned by since the increment began when the newest fast sample before the
    /// reading was taken.
    pub angle_b: [f32; 3],
    /// \[us\] how much of the increment's time that covers.
    pub covered_us: u32,
    /// \[us\] from that fast sample to the reading, in the mean of its sensors; 0 if it came while they were read.
    pub after_us: u32,
}

impl Force {
    /// No reading.
    pub const NONE: Force = Force {
        acc_p: [[NOT_READ; 3]; PLATES],
        angle_b: [0.0; 3],
        covered_us: 0,
        after_us: 0,
    };

    /// Whether nothing was read.
    pub fn is_none(&self) -> bool {
        self.acc_p == Force::NONE.acc_p
    }
}
