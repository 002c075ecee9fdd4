//! Every new packet to the telemetry line, in every mode, derived frames when they are on, and a line
//! `>mode FLIGHT: lift-off\r\n` at every change of mode. A reader of packets passes over the others.

use embassy_futures::select::{Either3, select3};
use embassy_time::Duration;
use embedded_io_async::Write;

use super::{
    clock::{Clock, never},
    shared::{Line, Shared},
    vote::{Voter, Votes},
};
use crate::{board::Board, derived};

/// \[ms\] a packet takes 13.5 ms at 115200 baud; a line that takes longer than this is stuck and loses the packet.
const WRITE_MS: u64 = 100;

/// Sends for ever.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, mut line: B::Telemetry) {
    let (Some(mut cycles), Some(mut frames)) = (shared.cycle_reader(), shared.derived_reader()) else {
        never().await
    };
    loop {
        let next = select3(
            cycles.next_message_pure(),
            frames.next_message_pure(),
            shared.announced[0].receive(),
        );
        match votes.waiting(Voter::Telemetry, next).await {
            Either3::First(cycle) => write(&shared.clock, &mut line, &cycle.packet).await,
            Either3::Second(frame) if shared.is_wanted(&frame) => {
                write(&shared.clock, &mut line, &derived::encode(&frame)).await;
            }
            Either3::Second(_) => {}
            Either3::Third(text) => say(&shared.clock, &mut line, &text).await,
        }
    }
}

/// A line for whoever reads text.
pub(super) async fn say(clock: &Clock, line: &mut impl Write, text: &Line) {
    write(clock, line, b">").await;
    write(clock, line, text.as_bytes()).await;
    write(clock, line, b"\r\n").await;
}

/// One whole frame or, when the line is stuck, its loss.
pub(super) async fn write(clock: &Clock, line: &mut impl Write, bytes: &[u8]) {
    let _ = clock
        .within(Duration::from_millis(WRITE_MS), line.write_all(bytes))
        .await;
}
