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
    seen: [Seen; INNOVATIONS],
    /// How many there are.
    scalars: usize,
    /// The next stage: the passage, then the scalars.
    stage: Option<usize>,
}

impl Pending {
    pub fn nothing() -> Self {
        Pending {
            passage: Passage::default(),
            seen: [Seen::default(); INNOVATIONS],
            scalars: 0,
            stage: None,
        }
    }

    /// Forgets the scalars.
    pub fn clear(&mut self) {
        self.scalars = 0;
    }

    /// What the scalars so far saw, and the place for the next; `None` if there are as many as may be.
    pub fn next(&mut self) -> Option<(&[Seen], &mut Seen)> {
        let (seen, free) = self.seen.split_at_mut_checked(self.scalars)?;
        Some((seen, free.first_mut()?))
    }

    /// Keeps what was put in that place.
    pub fn keep(&mut self) {
        self.scalars += 1;
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
            let seen = self.seen.iter().take(self.scalars);
            for seen in seen.skip(A_STAGE * (stage - 1)).take(A_STAGE) {
                covariance.update(seen);
            }
        }
        self.stage = (A_STAGE * stage < self.scalars).then_some(stage + 1);
    }
}
