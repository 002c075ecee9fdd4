//! What is derived from a cycle: the whole estimation, once its packet is on the line.
//!
//! The step holds the processor for as long as it takes. So it comes after everybody else has had the cycle: telemetry has
//! handed its packet to the DMA, and half an interval lies between the closing of a cycle and the next fast sample. What can be
//! done before, for the readings of the accelerometers between two cycles, is.
//!
//! After each step the filter is kept in retained memory, and after a reset in FLIGHT it goes on from there: in micro-gravity
//! there is no vertical to find the attitude by. In WAIT it is found afresh, which takes a second and needs no belief in what the
//! unit was turned through meanwhile. After a power cut in FLIGHT it goes on from the log's newest record, unless the first
//! second of readings tells better.
//!
//! From the end of a step to the next one nothing of the estimation changes but the sums of what is read between cycles. A checksum
//! over the rest finds a bit that flipped meanwhile, and the estimation goes on from what was kept. One that flips in the few
//! milliseconds of a step is not found.

use embassy_futures::{
    select::{Either, select},
    yield_now,
};

use super::{
    clock::{never, now},
    rail,
    shared::{Cycle, Shared},
    site,
    vote::{Voter, Votes},
};
use crate::{
    board::{Board, Oscillator, Retained},
    derived::{Derived, Start},
    estimate::{Estimate, Estimator, KEPT_BYTES},
    health::Health,
    mode::{Mode, State},
    resume::{self, POWER_CUT, Pulse},
    retained::ATTITUDE,
};

/// Derives for ever.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, estimator: &mut Estimator, memory: &B::Retained) -> ! {
    let Some(mut cycles) = shared.cycle_reader() else {
        never().await
    };
    let mut kept = [0; KEPT_BYTES];
    if shared.set_loaded.take() {
        estimator.renew(&shared.calibration.get(), &shared.site());
    }
    if shared.safe.get() {
        // It may be what ended the starts before; and once it is older than one start, nobody knows how old it is.
        ATTITUDE.forget(memory);
    } else {
        go_on(shared, estimator, memory, &mut kept);
    }
    let mut left = estimator.ram_sum::<B>(&kept);
    loop {
        let next = select(cycles.next_message_pure(), shared.force.wait());
        let cycle = match votes.waiting(Voter::Estimate, next).await {
            Either::First(cycle) => cycle,
            Either::Second((counter, force)) => {
                if !shared.safe.get() {
                    estimator.take_force(counter, &force);
                }
                continue;
            }
        };
        votes.waiting(Voter::Estimate, yield_now()).await;
        let state = shared.state.get();
        let health = cycle
            .health
            .with_if(Health::RECORDER_REFUSED, shared.recorder_refused.get())
            .with_if(
                Health::INTERNAL_OSCILLATOR,
                shared.start.oscillator == Oscillator::Internal,
            );
        if shared.safe.get() {
            let health = health.with(Health::SAFE_MODE);
            let start = shared.start.in_short();
            shared.publish_derived(derive(&cycle, state, health, start, 0, Estimate::NOTHING));
            continue;
        }
        let is_as_left = estimator.ram_sum::<B>(&kept) == left;
        let may_begin = state.mode == Mode::Wait || !estimator.filter().aligned;
        let is_elsewhere = site::take(shared, memory, may_begin, cycle.sample.start_us);
        let is_renewed = shared.set_loaded.take() || is_elsewhere;
        if is_renewed {
            estimator.renew(&shared.calibration.get(), &shared.site());
        }
        mend_set(shared, estimator);
        if !(is_as_left || is_renewed) {
            restore(shared, estimator, memory, &mut kept);
        }
        if let Some(found) = shared.attitude_found.take() {
            estimator.resume_near(&found, POWER_CUT);
        }
        let began = now();
        let estimate = estimator.step(&cycle.sample, &cycle.increments);
        let estimate_us = now().saturating_duration_since(began).as_micros() as u32;
        shared.publish_derived(derive(
            &cycle,
            state,
            health,
            shared.start.in_short(),
            estimate_us,
            estimate,
        ));
        if state.mode == Mode::Wait {
            know_rail(shared, estimator);
        }
        keep(estimator, memory, &mut kept);
        left = estimator.ram_sum::<B>(&kept);
    }
}

/// Goes on from what was kept in retained memory after the latest step where a bit of the estimation's RAM has flipped since: a reset
/// that takes no time. Not inlined: it is seldom.
#[cold]
#[inline(never)]
fn restore(shared: &Shared, estimator: &mut Estimator, memory: &impl Retained, kept: &mut [u8; KEPT_BYTES]) {
    let is_whole = ATTITUDE.recall(memory, kept).map(<[u8]>::len) == Some(KEPT_BYTES);
    estimator.restore(&shared.calibration.get(), &shared.site(), is_whole.then_some(&*kept));
    shared.say(format_args!(
        "a flipped bit of the attitude filter was found: it {}",
        if is_whole {
            "goes on from its copy"
        } else {
            "begins anew"
        }
    ));
}

/// Puts right what a flipped bit of the RAM has made of the calibration set in use. Not inlined: a set is large.
#[inline(never)]
fn mend_set(shared: &Shared, estimator: &mut Estimator) {
    let mut set = shared.calibration.get();
    if estimator.mend_set(&mut set, shared.set_sum.get()) {
        shared.calibration.set(set);
        shared.say(format_args!("a flipped bit of the calibration was put right"));
    }
}

/// Has the attitude know the launch rail: a rail that is new, or an attitude that is.
#[inline(never)]
fn know_rail(shared: &Shared, estimator: &mut Estimator) {
    let rail = shared.rail.get();
    if !rail.is_none()
        && let Some(met) = estimator.know_nose(&rail.nose(), shared.rail_is_new.get())
    {
        rail::met(shared, met);
    }
}

/// Goes on from what was kept before a reset in FLIGHT.
fn go_on(shared: &Shared, estimator: &mut Estimator, memory: &impl Retained, kept: &mut [u8; KEPT_BYTES]) {
    let start = &shared.start;
    let was_in_flight = start.resume.is_some_and(|resume| resume.mode == Mode::Flight);
    let found = ATTITUDE.recall(memory, kept).map(<[u8]>::len);
    if was_in_flight && found == Some(KEPT_BYTES) {
        let pulse = Pulse::recall(memory).unwrap_or_default();
        let outage = resume::outage(Estimator::kept_at_us(kept), start.reset, pulse, start.crash.as_ref());
        estimator.resume(kept, outage);
    }
}

fn keep(estimator: &mut Estimator, memory: &impl Retained, kept: &mut [u8; KEPT_BYTES]) {
    if estimator.keep(kept) {
        ATTITUDE.keep(memory, kept);
    } else {
        ATTITUDE.forget(memory);
    }
}

fn derive(cycle: &Cycle, state: State, health: Health, start: Start, estimate_us: u32, estimate: Estimate) -> Derived {
    let reading = &cycle.sample.reading;
    Derived {
        counter: reading.counter,
        start_us: cycle.sample.start_us,
        mode: state.mode,
        health: health
            .with(Health(reading.errors.0.into()))
            .with_if(Health::RECORDING, state.recording),
        start: Some(start),
        cycle_us: cycle.cycle_us,
        slots_us: cycle.sample.slots_us,
        increments: cycle.increments,
        estimate_us,
        estimate,
    }
}
