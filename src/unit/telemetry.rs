//! Every new packet to the telemetry line, in every mode, derived frames when they are on, and a line
//! `>mode FLIGHT: lift-off\r\n` at every change of mode. A reader of packets passes over the others.

use embassy_futures::select::{Either3, select3};
use embassy_time::Duration;
use embedded_io_async::Write;

use super::{
    clock::{Clock, never},
    shared::{BITS_PER_BYTE, Line, Shared},
    vote::{Voter, Votes},
};
use crate::{board::Board, derived};

/// \[baud\] the slowest line there may be: a packet takes 162.5 of the 200 ms to the next one there, and 13.5 at 115200.
const SLOWEST_BAUD: u64 = 9600;

/// \[ms\] a write may take longer by, because the estimation holds the processor meanwhile: for less than that.
const SPARE_MS: u64 = 20;

/// Sends for ever.
pub async fn run<B: Board>(shared: &Shared, votes: &Votes, line: B::Telemetry) -> ! {
    let (Some(mut cycles), Some(mut frames)) = (shared.cycle_reader(), shared.derived_reader()) else {
        never().await
    };
    let mut out = Out {
        line,
        clock: &shared.clock,
        votes,
        voter: Voter::Telemetry,
    };
    loop {
        let next = select3(
            cycles.next_message_pure(),
            frames.next_message_pure(),
            shared.announced[0].receive(),
        );
        match votes.waiting(out.voter, next).await {
            Either3::First(cycle) => out.write(&cycle.packet).await,
            Either3::Second(frame) if shared.is_wanted(&frame) => out.write(&derived::encode(&frame)).await,
            Either3::Second(_) => {}
            Either3::Third(text) => out.say(&text).await,
        }
    }
}

/// A line out, and the part that writes to it: it votes while it writes, for a slow line takes as long as its packets do.
pub(super) struct Out<'a, W> {
    pub line: W,
    pub clock: &'a Clock,
    pub votes: &'a Votes,
    pub voter: Voter,
}

impl<W: Write> Out<'_, W> {
    /// A line for whoever reads text.
    pub async fn say(&mut self, text: &Line) {
        self.write(b">").await;
        self.write(text.as_bytes()).await;
        self.write(b"\r\n").await;
    }

    /// One whole frame, or its loss on a line that takes longer than the slowest there may be: it is stuck.
    pub async fn write(&mut self, bytes: &[u8]) {
        let line_ms = (bytes.len() as u64).saturating_mul(BITS_PER_BYTE * 1000) / SLOWEST_BAUD;
        let limit = Duration::from_millis(line_ms.saturating_add(SPARE_MS));
        let written = self.clock.within(limit, self.line.write_all(bytes));
        let _ = self.votes.waiting(self.voter, written).await;
    }
}
