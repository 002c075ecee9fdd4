//! The covariance's work for a window, put off to the steps after it.
//!
//! In: a window's [`Passage`] and what its scalars saw. Out, a stage a step: the covariance over the window and after the
//! scalars. The state has all of them at once, because gains need only products of the covariance with what the scalars
//! see ([`super::innovation`]); nothing asks for the covariance itself before the next window. Steps that are long take
//! more of it, so that at 5 Hz it is done three steps after the window; if it is not when the next one closes, what is left
//! is done then.

use super::{
    covariance::{Covariance, Seen},
    innovation::INNOVATIONS,
    passage::Passage,
    state::{Row, State},
};

/// How much of it a stage takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pace {
    /// Attitude, velocity, or three scalars: steps of 20 ms come so often.
    Small,
    /// Attitude and velocity, or half of the scalars.
    Large,
}

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Attitude,
    Velocity,
    /// The scalars from this one on.
    Scalars(usize),
    Done,
}

/// What is still to be done.
#[derive(Clone, Debug)]
pub(super) struct Pending {
    pub passage: Passage,
    /// What the scalars of the window saw, in their order.
    seen: [Seen; INNOVATIONS],
    /// How many there are.
    scalars: usize,
    stage: Stage,
}

impl Pending {
    pub fn nothing() -> Self {
        Pending {
            passage: Passage::default(),
            seen: [Seen::default(); INNOVATIONS],
            scalars: 0,
            stage: Stage::Done,
        }
    }

    /// Forgets the scalars.
    pub fn clear(&mut self) {
        self.scalars = 0;
    }

    /// What the scalars so far saw, and the place for the next with `P h'` as the passage leaves it; `None` if there are
    /// as many as may be.
    pub fn next(&mut self, start: &State, row: &Row) -> Option<(&[Seen], &mut Seen)> {
        let (seen, free) = self.seen.split_at_mut_checked(self.scalars)?;
        let own = free.first_mut()?;
        self.passage.carry(start, row, &mut own.column);
        Some((seen, own))
    }

    /// Keeps what was put in that place.
    pub fn keep(&mut self) {
        self.scalars += 1;
    }

    /// All of its passage and its scalars.
    pub fn begin(&mut self) {
        self.stage = Stage::Attitude;
    }

    /// Whether there is nothing to be done.
    pub fn is_done(&self) -> bool {
        self.stage == Stage::Done
    }

    /// Whether the covariance is neither that of the window before nor that of this one.
    pub fn is_half_done(&self) -> bool {
        matches!(self.stage, Stage::Velocity | Stage::Scalars(_))
    }

    /// One stage.
    pub fn work(&mut self, covariance: &mut Covariance, pace: Pace) {
        if self.stage == Stage::Attitude {
            covariance.predict_attitude(&self.passage);
            self.stage = Stage::Velocity;
            if pace == Pace::Small {
                return;
            }
        }
        self.stage = match self.stage {
            Stage::Velocity => {
                covariance.predict_velocity(&self.passage);
                self.scalars_from(0)
            }
            Stage::Scalars(first) => {
                let most = if pace == Pace::Small {
                    3
                } else {
                    self.scalars.div_ceil(2)
                };
                let last = first + most;
                for seen in self.seen.iter().take(self.scalars.min(last)).skip(first) {
                    covariance.update(seen);
                }
                self.scalars_from(last)
            }
            Stage::Attitude | Stage::Done => Stage::Done,
        };
    }

    fn scalars_from(&self, first: usize) -> Stage {
        if first < self.scalars {
            Stage::Scalars(first)
        } else {
            Stage::Done
        }
    }
}
