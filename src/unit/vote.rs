//! The watchdog is fed only while every part of the unit is alive.
//!
//! A part votes each time it comes round its loop. It is alive while its last vote is younger than its allowance; one
//! that waits for ever, or never yields, lets the watchdog bite (fault U1; after F Prime's `Svc::Health`).

use core::cell::Cell;

use embassy_time::{Duration, Instant, Timer};

use crate::board::{Board, Watchdog};

/// A part of the unit.
#[derive(Clone, Copy)]
pub enum Voter {
    Acquire,
    Gyros,
    Telemetry,
    UmbilicalSend,
    UmbilicalListen,
    Inputs,
    Estimate,
    Record,
}

const VOTERS: usize = 8;

/// [ms] how old a vote may be. Parts that wait for packets, lines or bytes wake at least every [`WAKE_MS`].
const ALLOWANCE_MS: u64 = 400;

/// [ms] longest a part may sleep without a vote.
pub const WAKE_MS: u64 = 100;

const FEED_MS: u64 = 50;

/// When each part voted last.
#[derive(Default)]
pub struct Votes {
    last_ms: [Cell<u64>; VOTERS],
}

impl Votes {
    /// Says that `voter` is alive.
    pub fn cast(&self, voter: Voter) {
        self.last_ms[voter as usize].set(Instant::now().as_millis());
    }

    fn all_alive(&self, now_ms: u64) -> bool {
        self.last_ms
            .iter()
            .all(|last_ms| now_ms.saturating_sub(last_ms.get()) <= ALLOWANCE_MS)
    }
}

/// Feeds the watchdog while every part is alive.
pub async fn run<B: Board>(votes: &Votes, mut watchdog: B::Watchdog) {
    loop {
        if votes.all_alive(Instant::now().as_millis()) {
            watchdog.feed();
        }
        Timer::after(Duration::from_millis(FEED_MS)).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_silent_part_is_enough_to_starve_the_watchdog() {
        let votes = Votes::default();
        assert!(votes.all_alive(ALLOWANCE_MS));
        for last_ms in &votes.last_ms[1..] {
            last_ms.set(1000);
        }
        assert!(!votes.all_alive(1000));
        votes.last_ms[0].set(1000);
        assert!(votes.all_alive(1000 + ALLOWANCE_MS));
    }
}
