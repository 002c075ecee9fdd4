//! What is derived from a cycle.

use super::{
    shared::{Cycle, Shared},
    vote::{Voter, Votes},
};
use crate::{
    board::Oscillator,
    derived::{Derived, Health},
    mode::State,
};

/// Derives for ever.
pub async fn run(shared: &Shared, votes: &Votes) {
    let Some(mut cycles) = shared.cycle_reader() else {
        return;
    };
    loop {
        let cycle = votes.waiting(Voter::Estimate, cycles.next_message_pure()).await;
        let state = *shared.state.borrow();
        let health = cycle
            .health
            .with_if(Health::RECORDER_REFUSED, shared.recorder_refused.get())
            .with_if(
                Health::INTERNAL_OSCILLATOR,
                shared.start.oscillator == Oscillator::Internal,
            );
        shared.publish_derived(derive(&cycle, state, health));
    }
}

fn derive(cycle: &Cycle, state: State, health: Health) -> Derived {
    let reading = &cycle.sample.reading;
    Derived {
        counter: reading.counter,
        start_us: cycle.sample.start_us,
        mode: state.mode,
        health: health
            .with(Health(reading.errors.0.into()))
            .with_if(Health::RECORDING, state.recording),
        cycle_us: cycle.cycle_us,
        slots_us: cycle.sample.slots_us,
        increments: cycle.increments,
    }
}
