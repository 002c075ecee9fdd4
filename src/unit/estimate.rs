//! What is derived from a cycle: the whole estimation, once its packet is on the line.
//!
//! The step holds the processor for as long as it takes. So it comes after everybody else has had the cycle: telemetry has
//! handed its packet to the DMA, and half an interval lies between the closing of a cycle and the next fast sample. What can be
//! done before, for the readings of the accelerometers between two cycles, is.

use embassy_futures::{
    select::{Either, select},
    yield_now,
};

use super::{
    clock::now,
    shared::{Cycle, Shared},
    vote::{Voter, Votes},
};
use crate::{
    board::Oscillator,
    derived::{Derived, Health},
    estimate::{Estimate, Estimator},
    mode::State,
};

/// Derives for ever.
pub async fn run(shared: &Shared, votes: &Votes, estimator: &mut Estimator) {
    let Some(mut cycles) = shared.cycle_reader() else {
        return;
    };
    loop {
        let next = select(cycles.next_message_pure(), shared.force.wait());
        let cycle = match votes.waiting(Voter::Estimate, next).await {
            Either::First(cycle) => cycle,
            Either::Second((counter, force)) => {
                estimator.take_force(counter, &force);
                continue;
            }
        };
        votes.waiting(Voter::Estimate, yield_now()).await;
        let state = *shared.state.borrow();
        let health = cycle
            .health
            .with_if(Health::RECORDER_REFUSED, shared.recorder_refused.get())
            .with_if(
                Health::INTERNAL_OSCILLATOR,
                shared.start.oscillator == Oscillator::Internal,
            );
        if shared.set_loaded.take() {
            estimator.renew(&shared.calibration.borrow(), &shared.settings.site);
        }
        let began = now();
        let estimate = estimator.step(&cycle.sample, &cycle.increments);
        let estimate_us = (now() - began).as_micros() as u32;
        shared.publish_derived(derive(&cycle, state, health, estimate_us, estimate));
    }
}

fn derive(cycle: &Cycle, state: State, health: Health, estimate_us: u32, estimate: Estimate) -> Derived {
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
        estimate_us,
        estimate,
    }
}
