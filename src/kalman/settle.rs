//! When the covariance's work for a window is done, and what may be asked of it meanwhile.
//!
//! In: what is [`super::pending`]. Out: the covariance as of the last window, or as it was when it was last complete.

use super::{Filter, HALF_A_MILLISECOND, covariance::Covariance, pending::Pace, seconds};

impl Filter {
    /// Covariance of the error state as of the last window; what is pending is done on a copy.
    pub fn covariance(&self) -> Covariance {
        let (mut covariance, mut pending) = (self.covariance.clone(), self.pending.clone());
        while !pending.is_done() {
            pending.work(&mut covariance, Pace::Large);
        }
        covariance.keep_bounds();
        covariance
    }

    /// The covariance as it was when it was last complete, and how often that was so, round and round; `None` while the
    /// work of a window is half done.
    pub fn settled(&self) -> Option<(&Covariance, u8)> {
        let settled = (&self.covariance, self.settlements);
        (!self.pending.is_half_done()).then_some(settled)
    }

    /// Whether a step that ends then completes a window. If the gyros were heard.
    pub fn closes_at(&self, at_us: u64) -> bool {
        let since_s = self
            .last_us
            .map_or(0.0, |last_us| seconds(at_us.saturating_sub(last_us)));
        self.window.duration_s + since_s >= self.params.window_s - HALF_A_MILLISECOND
    }

    /// Leaves the next step to others: what is pending waits for the one after it.
    pub fn spare(&mut self) {
        self.spared = true;
    }

    /// One stage of what is pending; at its end the covariance is looked at.
    pub(super) fn work(&mut self, pace: Pace) {
        self.pending.work(&mut self.covariance, pace);
        if self.pending.is_done() {
            self.settlements = self.settlements.wrapping_add(1);
            self.unsound = !self.covariance.keep_bounds();
            if !self.covariance.is_finite() {
                // Nothing can lead here with finite input; the radiation that flips a bit of the state can.
                *self = Filter::new(self.params);
            }
        }
    }

    /// All that is pending.
    pub(super) fn settle(&mut self) {
        while !self.pending.is_done() {
            self.work(Pace::Large);
        }
    }
}
