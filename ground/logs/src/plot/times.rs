//! The time axis of a flight, and what lasts along it.
//!
//! In: an [`Envelope`]. Out: lines and spans over time. Lines break where nothing was read.

use crate::plot::attitude::Clock;
use chart::Axis;

use crate::envelope::{Bin, Envelope};

/// Times of bins on a page.
pub struct Times<'a> {
    envelope: &'a Envelope,
    /// \[s\] from packet to packet.
    pub cycle_s: f64,
    /// How times stand on the page.
    pub clock: Clock,
    /// Where packets were missed.
    pub missed: Vec<(f64, f64)>,
    /// Where micro-gravity was asserted.
    pub micro_g: Vec<(f64, f64)>,
}

impl<'a> Times<'a> {
    /// Of a flight with at least one bin; zero of the page's time is `zero_s` of the log's.
    pub fn of(envelope: &'a Envelope, cycle_s: f64, zero_s: f64) -> Self {
        let length_s = envelope.bins().len() as f64 * envelope.packets_per_bin() as f64 * cycle_s;
        let mut times = Times {
            envelope,
            cycle_s,
            clock: Clock::of(length_s),
            missed: Vec::new(),
            micro_g: Vec::new(),
        };
        times.on(Clock {
            zero_s,
            ..times.clock.clone()
        });
        times
    }

    /// Puts it on another clock.
    pub fn on(&mut self, clock: Clock) {
        self.clock = clock;
        let several = self.envelope.packets_per_bin() > 1;
        self.missed = self.spans(|bin| bin.packets == 0 || (several && bin.missed > 0));
        self.micro_g = self.spans(|bin| bin.micro_g);
    }

    /// Where a packet of some number is on the axis.
    pub fn at(&self, number: f64) -> f64 {
        self.clock.at(number * self.cycle_s)
    }

    /// From the first packet to the last.
    pub fn ends(&self) -> (f64, f64) {
        let last = self.envelope.bins().len().saturating_sub(1);
        (self.middle(0) - self.half_bin(), self.middle(last) + self.half_bin())
    }

    /// The axis.
    pub fn axis(&self) -> Axis {
        let (first, last) = self.ends();
        self.clock.axis().between(first, last)
    }

    /// A line through the least and the most of each bin, broken where there is none.
    pub fn line(&self, values: impl Fn(&Bin) -> Option<(f64, f64)>) -> Vec<(f64, f64)> {
        let half = 0.5 * self.half_bin();
        let mut line = Vec::new();
        for (index, bin) in self.envelope.bins().iter().enumerate() {
            let time = self.middle(index);
            match values(bin) {
                Some((least, most)) if most > least => line.extend([(time - half, least), (time + half, most)]),
                Some((value, _)) => line.push((time, value)),
                None => line.push((time, f64::NAN)),
            }
        }
        line
    }

    /// From when to when bins have some property.
    pub fn spans(&self, has: impl Fn(&Bin) -> bool) -> Vec<(f64, f64)> {
        let mut spans: Vec<(f64, f64)> = Vec::new();
        let mut open = false;
        for (index, bin) in self.envelope.bins().iter().enumerate() {
            let (from, to) = (
                self.middle(index) - self.half_bin(),
                self.middle(index) + self.half_bin(),
            );
            let here = has(bin);
            match spans.last_mut() {
                Some(span) if here && open => span.1 = to,
                _ if here => spans.push((from, to)),
                _ => {}
            }
            open = here;
        }
        spans
    }

    fn half_bin(&self) -> f64 {
        0.5 * self.envelope.packets_per_bin() as f64 * self.cycle_s / self.clock.unit_s
    }

    fn middle(&self, index: usize) -> f64 {
        self.at(self.envelope.middle(index))
    }
}
