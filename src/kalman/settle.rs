//! The work for a window, stage by stage, and what may be asked of the covariance meanwhile.
//!
//! In: what is [`super::pending`]. Out: the covariance as of the last window, or as it was when it was last complete.

use super::{
    Filter, HALF_A_MILLISECOND, Outcome,
    covariance::Covariance,
    pending::{Pace, Stage},
    seconds,
};

impl Filter {
    /// Covariance of the error state as of the last window; what is pending is done on a copy.
    pub fn covariance(&self) -> Covariance {
        let mut copy = self.clone();
        copy.settle(&mut Outcome::default());
        copy.covariance.keep_bounds();
        copy.covariance
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

    /// Leaves the next step to others: what is pending waits for the one after it, but for what is known of the iron, which is little.
    pub fn spare(&mut self) {
        self.spared = true;
    }

    /// One stage of what is pending; at its end the covariance is looked at.
    pub(super) fn work(&mut self, pace: Pace, outcome: &mut Outcome) {
        let stage = self.pending.stage();
        self.pending.go_on();
        match stage {
            Stage::Look => self.look(),
            Stage::Velocity => self.compare_velocity(),
            Stage::Field => self.compare_field(),
            Stage::Correct => self.correct(outcome),
            Stage::Learn => {
                self.learn_iron();
                if pace == Pace::Large {
                    self.work_on_covariance(pace);
                }
            }
            _ => self.work_on_covariance(pace),
        }
    }

    fn work_on_covariance(&mut self, pace: Pace) {
        self.pending.work(&mut self.covariance, pace);
        if self.pending.is_done() {
            self.settlements = self.settlements.wrapping_add(1);
            self.unsound = !self.covariance.keep_bounds();
            if !self.covariance.is_finite() {
                // Nothing can lead here with finite input; the radiation that flips a bit of the state can.
                self.begin_anew();
            }
        }
    }

    /// What is pending of the state.
    pub(super) fn correct_now(&mut self, outcome: &mut Outcome) {
        while self.pending.corrects() {
            self.work(Pace::Large, outcome);
        }
    }

    /// All that is pending.
    pub(super) fn settle(&mut self, outcome: &mut Outcome) {
        self.correct_now(outcome);
        self.settle_covariance();
    }

    /// What is pending of the covariance, and of the iron before it.
    pub(super) fn settle_covariance(&mut self) {
        if self.pending.stage() == Stage::Learn {
            self.pending.go_on();
            self.learn_iron();
        }
        while !self.pending.is_done() {
            self.work_on_covariance(Pace::Large);
        }
    }
}
