//! Lift-off and micro-g, debounced; lift-off begins FLIGHT.

use embassy_time::{Duration, Instant};

use super::{
    shared::Shared,
    vote::{Voter, Votes},
};
use crate::{
    board::{Board, Discretes},
    discrete::{Debounce, POLL_US},
};

/// Polls for ever.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, mut lines: B::Discretes) {
    let (mut lift_off, mut micro_g) = (Debounce::default(), Debounce::default());
    let mut poll = Instant::now();
    loop {
        let levels = (lift_off.poll(lines.lift_off()), micro_g.poll(lines.micro_g()));
        shared.discretes.set(levels);
        if shared.state.borrow_mut().lift_off(levels.0) {
            shared.say(format_args!("lift-off: FLIGHT, recording"));
        }
        poll += Duration::from_micros(POLL_US);
        votes.waiting(Voter::Inputs, shared.clock.until(poll)).await;
    }
}
