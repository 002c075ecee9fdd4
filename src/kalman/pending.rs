//! The covariance's work for a window, put off to the steps after it.
//!
//! In: a window's [`Passage`] and what its scalars saw. Out, a stage a step: the covariance over the window and after the
//! scalars. The state has all of them at once, because gains need only products of the covariance with what the scalars
//! see ([`super::innovation`]); nothing asks for the covariance itself before the next window. At most four stages, so
//! that at 5 Hz they are done before it closes; if not, what is left is done then.

use super::{
    covariance::{Covariance, Seen},
    innovation::INNOVATIONS,
    passage::Passage,
};

/// Scalars that one stage takes.
const A_STAGE: usize = 3;

/// What is still to be done.
#[derive(Clone, Debug)]
pub(super) struct Pending {
    pub passage: Passage,
    /// What the scalars of the window saw, in their order.
    pub seen: heapless::Vec<Seen, INNOVATIONS>,
    /// The next stage: the passage, then the scalars.
    stage: Option<usize>,
}

impl Pending {
    pub fn nothing() -> Self {
        Pending {
            passage: Passage::default(),
            seen: heapless::Vec::new(),
            stage: None,
        }
    }

    /// All of its passage and its scalars.
    pub fn begin(&mut self) {
        self.stage = Some(0);
    }

    /// Whether there is nothing to be done.
    pub fn is_done(&self) -> bool {
        self.stage.is_none()
    }

    /// Whether the covariance is neither that of the window before nor that of this one.
    pub fn is_half_done(&self) -> bool {
        self.stage.is_some_and(|stage| stage > 0)
    }

    /// One stage.
    pub fn work(&mut self, covariance: &mut Covariance) {
        let Some(stage) = self.stage else { return };
        if stage == 0 {
            covariance.predict(&self.passage);
        } else {
            let stages = self.seen.chunks(A_STAGE);
            for seen in stages.skip(stage - 1).take(1).flatten() {
                covariance.update(seen);
            }
        }
        self.stage = (A_STAGE * stage < self.seen.len()).then_some(stage + 1);
    }
}
