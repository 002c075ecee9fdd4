//! The watchdog is fed only while every part of the unit is alive.
//!
//! Every [`ASK_MS`] all parts are asked; the watchdog is fed, and they are asked again, when all have answered. A part
//! answers whenever it waits for its next work, so one that waits for anything else for ever, or never yields, lets the
//! watchdog bite (fault U1; after F Prime's `Svc::Health`).

use core::{
    cell::Cell,
    future::Future,
    pin::Pin,
    task::{Context, Poll},
};

use embassy_time::Duration;
use pin_project_lite::pin_project;

use super::clock::{Clock, next_on_grid, now};
use crate::board::{Board, Watchdog};

/// A part of the unit.
#[derive(Clone, Copy)]
pub enum Voter {
    Acquire,
    Gyros,
    Telemetry,
    UmbilicalSend,
    UmbilicalListen,
    Inputs,
    Estimate,
    Record,
}

const ALL: u8 = u8::MAX;

/// \[ms\] between questions, as long as all answer. A part may be busy for 190 ms; the watchdog bites after 1 s.
const ASK_MS: u64 = 100;

/// Between two fast samples of the gyros.
const PHASE: Duration = Duration::from_millis(18);

/// Who has answered since all were asked.
#[derive(Default)]
pub struct Votes {
    answered: Cell<u8>,
}

impl Votes {
    /// What `work` gives. While it is waited for, `voter` answers.
    pub fn waiting<F: Future>(&self, voter: Voter, work: F) -> Waiting<'_, F> {
        Waiting {
            work,
            votes: self,
            voter,
        }
    }

    fn answer(&self, voter: Voter) {
        self.answered.set(self.answered.get() | 1 << voter as u8);
    }

    /// Whether all have answered; if so, they are asked again.
    fn all_have_answered(&self) -> bool {
        let all = self.answered.get() == ALL;
        if all {
            self.answered.set(0);
        }
        all
    }
}

pin_project! {
    /// [`Votes::waiting`]. Not an `async fn`: that would hold its future twice.
    pub struct Waiting<'a, F> {
        #[pin]
        work: F,
        votes: &'a Votes,
        voter: Voter,
    }
}

impl<F: Future> Future for Waiting<'_, F> {
    type Output = F::Output;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<F::Output> {
        let this = self.project();
        this.votes.answer(*this.voter);
        this.work.poll(context)
    }
}

/// Feeds the watchdog while every part is alive.
///
/// The question needs no wake of its own: this part's alarm polls the whole unit, and with it every part that waits.
/// `fed_us` is when that last was.
pub async fn run<B: Board>(clock: &Clock, votes: &Votes, mut watchdog: B::Watchdog, fed_us: &Cell<u64>) -> ! {
    let interval = Duration::from_millis(ASK_MS);
    let mut ask = next_on_grid(interval, PHASE);
    loop {
        clock.until(ask).await;
        ask = ask.saturating_add(interval);
        if votes.all_have_answered() {
            watchdog.feed();
            fed_us.set(now().as_micros());
        }
    }
}

#[cfg(test)]
mod tests {
    use core::future::{pending, ready};

    use embassy_futures::{block_on, select::select};

    use super::*;

    const VOTERS: [Voter; 8] = [
        Voter::Acquire,
        Voter::Gyros,
        Voter::Telemetry,
        Voter::UmbilicalSend,
        Voter::UmbilicalListen,
        Voter::Inputs,
        Voter::Estimate,
        Voter::Record,
    ];

    #[test]
    fn a_part_that_waits_answers_and_one_that_never_comes_round_is_missed() {
        let votes = Votes::default();
        for voter in &VOTERS[1..] {
            block_on(select(votes.waiting(*voter, pending::<()>()), ready(())));
        }
        assert_ne!(votes.answered.get(), ALL);
        block_on(votes.waiting(VOTERS[0], ready(())));
        assert_eq!(votes.answered.get(), ALL);
    }

    /// U1: the part that hangs may be any of them.
    #[test]
    fn any_one_of_the_eight_alone_keeps_the_watchdog_from_being_fed() {
        for (number, hung) in VOTERS.into_iter().enumerate() {
            let votes = Votes::default();
            for (_, voter) in VOTERS.into_iter().enumerate().filter(|(other, _)| *other != number) {
                block_on(votes.waiting(voter, ready(())));
            }
            assert!(!votes.all_have_answered(), "voter {number}");
            block_on(votes.waiting(hung, ready(())));
            assert!(votes.all_have_answered());
            assert!(!votes.all_have_answered(), "they are asked again");
        }
    }
}
