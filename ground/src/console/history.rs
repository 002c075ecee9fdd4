//! The last minutes of all channels, for plots and rates.
//!
//! In: readings with their arrival time. Out: the values of a channel over a window, and packets a second. Bounded in
//! time and in number, so that a console may stand open for days.

use std::{collections::VecDeque, time::Duration};

use packets::channel::CHANNEL_COUNT;

/// Oldest reading kept.
pub const SPAN: Duration = Duration::from_secs(600);

/// Most readings kept: [`SPAN`] at the unit's fastest cycle, 50 Hz.
const READINGS_KEPT: usize = 30_000;

/// Readings a rate is taken over: two seconds at 5 Hz.
const RATE_OVER: usize = 10;

/// Counts of every channel as [`packets::channel::counts`] gives them.
pub type Counts = [Option<i16>; CHANNEL_COUNT];

/// Readings in order of arrival.
#[derive(Default)]
pub struct History {
    readings: VecDeque<(Duration, Counts)>,
}

impl History {
    /// Keeps a reading and forgets the oldest.
    pub fn push(&mut self, at: Duration, counts: Counts) {
        self.readings.push_back((at, counts));
        let stale = |(oldest, _): &(Duration, Counts)| oldest.saturating_add(SPAN) < at;
        while self.readings.len() > READINGS_KEPT || self.readings.front().is_some_and(stale) {
            self.readings.pop_front();
        }
    }

    /// The newest reading and when it arrived.
    pub fn newest(&self) -> Option<&(Duration, Counts)> {
        self.readings.back()
    }

    /// Values of a channel not older than `window` before `now`: seconds before now (negative), and counts.
    pub fn window(&self, channel: usize, now: Duration, window: Duration) -> impl Iterator<Item = (f64, i16)> {
        let from = now.saturating_sub(window);
        let first = self.readings.partition_point(|(at, _)| *at < from);
        self.readings.range(first..).filter_map(move |(at, counts)| {
            let counts = (*counts.get(channel)?)?;
            Some((at.as_secs_f64() - now.as_secs_f64(), counts))
        })
    }

    /// Packets a second over the last few; `None` until there are two.
    pub fn rate_hz(&self) -> Option<f64> {
        let first = self.readings.len().saturating_sub(RATE_OVER + 1);
        let (from, _) = self.readings.get(first)?;
        let (to, _) = self.readings.back()?;
        let span_s = to.saturating_sub(*from).as_secs_f64();
        (span_s > 0.0).then(|| (self.readings.len() - first - 1) as f64 / span_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYCLE: Duration = Duration::from_millis(200);

    fn filled(cycles: u32) -> History {
        let mut history = History::default();
        for cycle in 0..cycles {
            let mut counts = [None; CHANNEL_COUNT];
            counts[3] = Some(cycle as i16);
            history.push(CYCLE * cycle, counts);
        }
        history
    }

    #[test]
    fn a_window_holds_its_seconds_and_skips_what_was_not_read() {
        let history = filled(51);
        let now = CYCLE * 50;
        let values: Vec<_> = history.window(3, now, CYCLE * 2).map(|(_, counts)| counts).collect();
        assert_eq!(values, [48, 49, 50]);
        assert_eq!(history.window(4, now, CYCLE * 2).count(), 0);
        assert_eq!(history.window(99, now, CYCLE * 2).count(), 0);
    }

    #[test]
    fn five_packets_a_second_are_five() {
        /// Rounding of times in f64 seconds.
        const TOLERANCE_HZ: f64 = 1e-9;
        assert_eq!(filled(1).rate_hz(), None);
        assert!((filled(40).rate_hz().unwrap() - 5.0).abs() < TOLERANCE_HZ);
    }

    #[test]
    fn days_of_packets_are_forgotten() {
        assert_eq!(filled(20_000).readings.len(), 1 + 600 * 5);
        let mut history = History::default();
        for _ in 0..READINGS_KEPT + 10 {
            history.push(CYCLE, [None; CHANNEL_COUNT]);
        }
        assert_eq!(history.readings.len(), READINGS_KEPT);
        assert_eq!(history.rate_hz(), None);
    }
}
