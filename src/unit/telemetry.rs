//! Every new packet to the telemetry line, in every mode, and derived frames when they are on.

use embassy_futures::select::{Either, select};
use embassy_time::Duration;
use embedded_io_async::Write;

use super::{
    clock::Clock,
    shared::Shared,
    vote::{Voter, Votes},
};
use crate::{board::Board, derived};

/// [ms] a packet takes 13.5 ms at 115200 baud; a line that takes longer than this is stuck and loses the packet.
const WRITE_MS: u64 = 100;

/// Sends for ever.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, mut line: B::Telemetry) {
    let (Some(mut cycles), Some(mut frames)) = (shared.cycle_reader(), shared.derived_reader()) else {
        return;
    };
    loop {
        let next = select(cycles.next_message_pure(), frames.next_message_pure());
        match votes.waiting(Voter::Telemetry, next).await {
            Either::First(cycle) => write(&shared.clock, &mut line, &cycle.packet).await,
            Either::Second(frame) if shared.is_wanted(&frame) => {
                write(&shared.clock, &mut line, &derived::encode(&frame)).await;
            }
            Either::Second(_) => {}
        }
    }
}

/// One whole frame or, when the line is stuck, its loss.
pub(super) async fn write(clock: &Clock, line: &mut impl Write, bytes: &[u8]) {
    let _ = clock
        .within(Duration::from_millis(WRITE_MS), line.write_all(bytes))
        .await;
}
