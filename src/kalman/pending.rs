//! What is put off of a window to the steps after it: of the state, then of the covariance.
//!
//! In: a window's [`Passage`] and what its scalars saw. Out, a stage a step: the correction of the state ([`super::compare`])
//! and what the field tells of the iron, then the covariance over the window and after the scalars. The state goes first,
//! because gains need only products of the covariance with what the scalars see ([`super::innovation`]); nothing asks for
//! the covariance itself before the next window. At 50 Hz no step has more than three times the work of a plain one, and the
//! state is corrected four steps after its window. Steps that are long have the correction with the window, and take more
//! of the rest, so that at 5 Hz it is done three or four steps later; if it is not when the next one closes, what is left
//! is done then.

use super::{
    covariance::Covariance,
    innovation::INNOVATIONS,
    joseph::Seen,
    passage::Passage,
    state::{Row, State},
};

/// How much of it a stage takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pace {
    /// The passage, or two scalars: steps of 20 ms come so often.
    Small,
    /// The passage and two scalars, or four.
    Large,
}

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// Of the state: [`Filter::look`](super::Filter), ...
    Look,
    /// ... `compare_velocity`, ...
    Velocity,
    /// ... `compare_field` ...
    Field,
    /// ... and `correct`.
    Correct,
    /// Of what is known of the iron.
    Learn,
    /// Of the covariance: over the window, ...
    Passage,
    /// ... and after the scalars from this one on.
    Scalars(usize),
    Done,
}

/// What is still to be done.
#[derive(Clone, Debug)]
pub(super) struct Pending {
    pub passage: Passage,
    /// Columns of the velocity at the end of the window, before its scalars.
    velocity: [State; 2],
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
            velocity: [State::ZERO; 2],
            seen: [Seen::NOTHING; INNOVATIONS],
            scalars: 0,
            stage: Stage::Done,
        }
    }

    /// What the scalars so far saw, and the place for the next with `P h'` as the passage leaves it; `None` if there are
    /// as many as may be.
    pub fn next(&mut self, start: &State, row: &Row) -> Option<(&[Seen], &mut Seen)> {
        let (seen, free) = self.seen.split_at_mut_checked(self.scalars)?;
        let own = free.first_mut()?;
        self.passage.carry(start, row, &mut own.column);
        if let Row::Velocity(axis) = *row {
            self.velocity[axis].become_as(&own.column);
        }
        Some((seen, own))
    }

    /// Keeps what was put in that place.
    pub fn keep(&mut self) {
        self.scalars = self.scalars.saturating_add(1);
    }

    /// All of a window of this passage.
    pub fn begin(&mut self) {
        self.scalars = 0;
        self.stage = Stage::Look;
    }

    /// What comes next.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Whether the state is still to be corrected.
    pub fn corrects(&self) -> bool {
        matches!(
            self.stage,
            Stage::Look | Stage::Velocity | Stage::Field | Stage::Correct
        )
    }

    /// A stage of the state is done.
    pub fn go_on(&mut self) {
        self.stage = match self.stage {
            Stage::Look => Stage::Velocity,
            Stage::Velocity => Stage::Field,
            Stage::Field => Stage::Correct,
            Stage::Correct => Stage::Learn,
            Stage::Learn => Stage::Passage,
            of_covariance => of_covariance,
        };
    }

    /// Whether there is nothing to be done.
    pub fn is_done(&self) -> bool {
        self.stage == Stage::Done
    }

    /// Whether the covariance is neither that of the window before nor that of this one.
    pub fn is_half_done(&self) -> bool {
        matches!(self.stage, Stage::Scalars(_))
    }

    /// One stage of the covariance.
    pub fn work(&mut self, covariance: &mut Covariance, pace: Pace) {
        let mut scalars = match pace {
            Pace::Small => 2,
            Pace::Large => 4,
        };
        if self.stage == Stage::Passage {
            let velocity = (!self.passage.velocity_lost).then_some(&self.velocity);
            covariance.predict(&self.passage, velocity);
            self.stage = self.scalars_from(0);
            // As much work as two.
            scalars -= 2;
        }
        if let Stage::Scalars(first) = self.stage {
            let last = usize::saturating_add(first, scalars).min(self.scalars);
            for two in self.seen.get(first..last).unwrap_or_default().chunks(2) {
                match two {
                    [one, other] => covariance.update(one, other),
                    [one] => covariance.update(one, &Seen::NOTHING),
                    _ => {}
                }
            }
            self.stage = self.scalars_from(last);
        }
    }

    fn scalars_from(&self, first: usize) -> Stage {
        if first < self.scalars {
            Stage::Scalars(first)
        } else {
            Stage::Done
        }
    }
}

#[cfg(test)]
mod tests;
