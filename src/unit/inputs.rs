//! Lift-off and micro-g, debounced; lift-off begins FLIGHT.

use embassy_time::Duration;

use super::{
    clock::next_on_grid,
    shared::Shared,
    vote::{Voter, Votes},
};
use crate::{
    board::{Board, Discretes},
    discrete::{Debounce, POLL_US},
    mode::Cause,
};

/// After a cycle, between two fast samples of the gyros.
const PHASE: Duration = Duration::from_millis(12);

/// Polls for ever.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, mut lines: B::Discretes) -> ! {
    let (mut lift_off, mut micro_g) = (Debounce::default(), Debounce::default());
    let interval = Duration::from_micros(POLL_US);
    let mut poll = next_on_grid(interval, PHASE);
    loop {
        let levels = (lift_off.poll(lines.lift_off()), micro_g.poll(lines.micro_g()));
        shared.discretes.set(levels);
        if shared.change(Cause::LiftOff, |state| state.lift_off(levels.0)) {
            shared.say(format_args!("lift-off: FLIGHT, recording"));
        }
        votes.waiting(Voter::Inputs, shared.clock.until(poll)).await;
        poll = poll.saturating_add(interval);
    }
}
