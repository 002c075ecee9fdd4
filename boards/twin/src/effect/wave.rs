//! A wave of one frequency, at the instants at which channels feel it.

use core::f64::consts::TAU;

/// A wave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// \[Hz\] its frequency.
    pub hz: f64,
    /// Whether its phase is that of the cycle, one for all channels, and not that of the instant.
    pub is_of_cycle: bool,
}

impl Wave {
    /// Sine and cosine in a channel that is read so long \[s\] after the start of the cycle and feels it at `t_s`.
    pub fn sine_cosine(self, t_s: f64, slot_s: f64) -> (f64, f64) {
        let later_s = if self.is_of_cycle { slot_s } else { 0.0 };
        (TAU * self.hz * (t_s - later_s)).sin_cos()
    }
}
