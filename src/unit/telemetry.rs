//! Every new packet to the telemetry line, in every mode, and derived frames when they are on.

use embassy_futures::select::{Either, select};
use embassy_time::{Duration, with_timeout};
use embedded_io_async::Write;

use super::{
    shared::Shared,
    vote::{Voter, Votes, WAKE_MS},
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
        votes.cast(Voter::Telemetry);
        let next = select(cycles.next_message_pure(), frames.next_message_pure());
        match with_timeout(Duration::from_millis(WAKE_MS), next).await {
            Ok(Either::First(cycle)) => write(&mut line, &cycle.packet).await,
            Ok(Either::Second(frame)) if shared.state.borrow().derived => {
                write(&mut line, &derived::encode(&frame)).await;
            }
            _ => {}
        }
    }
}

/// One whole frame or, when the line is stuck, its loss.
pub(super) async fn write(line: &mut impl Write, bytes: &[u8]) {
    let _ = with_timeout(Duration::from_millis(WRITE_MS), line.write_all(bytes)).await;
}
