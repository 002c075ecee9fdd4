//! The recorder's part: packets into it while recording, records out of it while dumping, and erasing in free time.

use embassy_time::Duration;

use super::{
    shared::Shared,
    vote::{Voter, Votes},
};
use crate::{
    board::Board,
    mode::Task,
    recorder::{Record, Recorder, RecorderError},
};

/// [ms] while dumping or erasing, how long to wait for a cycle before the next step.
const STEP_MS: u64 = 1;

/// [ms] otherwise, how long an order to erase or dump may wait.
const IDLE_MS: u64 = 100;

/// Serves the recorder for ever.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, mut recorder: B::Recorder) {
    let Some(mut cycles) = shared.cycle_reader() else {
        return;
    };
    loop {
        shared.recorder.set(recorder.status());
        let busy = step(shared, &mut recorder).await;
        let wait = Duration::from_millis(if busy { STEP_MS } else { IDLE_MS });
        let next = shared.clock.within(wait, cycles.next_message_pure());
        let Ok(cycle) = votes.waiting(Voter::Record, next).await else {
            continue;
        };
        if shared.state.borrow().recording {
            let record = Record {
                start_us: cycle.sample.start_us,
                packet: cycle.packet,
            };
            let refused = recorder.append(&record).await.is_err();
            if refused && !shared.recorder_refused.replace(refused) {
                shared.say(format_args!("recorder refuses: full, erasing or failed; G_ST tells"));
            }
            shared.recorder_refused.set(refused);
        }
    }
}

/// A bounded piece of erasing or dumping; whether there is more.
async fn step(shared: &Shared, recorder: &mut impl Recorder) -> bool {
    if shared.erase_ordered.take() {
        recorder.start_erase();
    }
    if recorder.status().erasing.is_some() {
        match recorder.erase_step().await {
            Ok(0) => shared.say(format_args!("G_MA done: recorder is empty")),
            Ok(_) => {}
            Err(_) => shared.say(format_args!("G_MA failed: recorder memory error")),
        }
        return true;
    }
    let Task::Dump { next, end } = shared.state.borrow().task else {
        return false;
    };
    let until = end.min(recorder.status().used);
    if shared.dumped.is_full() {
        return true;
    }
    let found = if next < until {
        recorder.read(next).await
    } else {
        Err(RecorderError::NoSuchRecord)
    };
    let mut state = shared.state.borrow_mut();
    // A command may have ended or restarted the dump while the record was read.
    if state.task != (Task::Dump { next, end }) {
        return true;
    }
    match found {
        Ok(record) => {
            let _ = shared.dumped.try_send(record.packet);
            state.task = Task::Dump { next: next + 1, end };
            true
        }
        Err(RecorderError::NoSuchRecord) => {
            state.task = Task::Idle;
            shared.say(format_args!("dump ends at record {next} of {}", recorder.status().used));
            false
        }
        Err(_) => {
            state.task = Task::Dump { next: next + 1, end };
            shared.say(format_args!("record {next} cannot be read"));
            true
        }
    }
}
