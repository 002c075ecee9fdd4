//! What became of a flight, in figures.
//!
//! In: what [`crate::digest`] finds, one thing at a time. Out: counts and [`Spread`]s, and [`Summary::rows`] to print.
//! The packet period is taken between packets that follow each other; jitter is the largest deviation of one such
//! period from their mean.

use emems::{
    derived::Derived,
    sample::{NO_SLOT, Reading, SENSOR_COUNT},
};

use packets::{
    reach::{self, Tally},
    stream::{Reason, Reject, sequence::Step},
};

/// Least, most, mean and standard deviation of something.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// How many values.
    pub count: u64,
    /// Least.
    pub least: f64,
    /// Most.
    pub most: f64,
    /// Mean.
    pub mean: f64,
    squares: f64,
}

impl Spread {
    /// Takes one more value (Welford's recurrence, which does not cancel over a day of equal periods).
    pub fn add(&mut self, value: f64) {
        (self.least, self.most) = match self.count {
            0 => (value, value),
            _ => (self.least.min(value), self.most.max(value)),
        };
        self.count += 1;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
    }

    /// Standard deviation; 0 for fewer than two values.
    pub fn sigma(&self) -> f64 {
        (self.squares / self.count.saturating_sub(1).max(1) as f64).sqrt()
    }

    /// Largest deviation from the mean.
    pub fn jitter(&self) -> f64 {
        (self.most - self.mean).max(self.mean - self.least)
    }

    /// `mean ..., least ..., most ...` in thousandths of what was added, or a dash for nothing.
    fn milli(&self, unit: &str) -> String {
        match self.count {
            0 => "-".into(),
            _ => format!(
                "mean {:.3} {unit}, least {:.3}, most {:.3}",
                1e3 * self.mean,
                1e3 * self.least,
                1e3 * self.most
            ),
        }
    }
}

/// The figures.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Intact packets.
    pub packets: u64,
    /// Packets missed according to the counter.
    pub missed: u64,
    /// Packets whose counter repeats the one before.
    pub repeated: u64,
    /// Packets whose counter jumped.
    pub jumped: u64,
    /// Derived frames.
    pub derived: u64,
    /// Lines that the unit said to people.
    pub lines: u64,
    /// Stretches of bytes that are no frame.
    pub stretches: u64,
    /// Bytes in them.
    pub rejected_bytes: u64,
    /// Bytes of the frame or line of text that was on the line when the stream ended.
    pub cut_off_bytes: u64,
    /// Packets in which each sensor failed, reading order.
    pub failed: [u64; SENSOR_COUNT],
    /// Packets in which sensors stood at the end of their range or gave impossible codes.
    pub reach: Tally,
    /// \[s\] period between packets that follow each other.
    pub period_s: Spread,
    /// \[s\] from the start of a cycle to the closing of its packet.
    pub cycle_s: Spread,
    /// \[s\] from the first to the last sensor sampled in a cycle.
    pub span_s: Spread,
    /// \[s\] when each sensor is sampled after the start of the cycle, reading order.
    pub slot_s: [Spread; SENSOR_COUNT],
}

impl Summary {
    /// Counts a packet, its step from the one before, and the period if it was timed.
    pub fn packet(&mut self, reading: &Reading, step: Step, period_s: Option<f64>) {
        self.packets += 1;
        match step {
            Step::First | Step::Next => {}
            Step::Missed(count) => self.missed += u64::from(count),
            Step::Repeated => self.repeated += 1,
            Step::Jumped => self.jumped += 1,
        }
        for (slot, failed) in self.failed.iter_mut().enumerate() {
            *failed += u64::from(reading.errors.contains(slot));
        }
        self.reach.add(reading);
        if let Some(period_s) = period_s {
            self.period_s.add(period_s);
        }
    }

    /// Counts a derived frame.
    pub fn derived(&mut self, derived: &Derived) {
        self.derived += 1;
        self.cycle_s.add(1e-6 * f64::from(derived.cycle_us));
        let mut sampled = Spread::default();
        for (slot_us, spread) in derived.slots_us.iter().zip(&mut self.slot_s) {
            if *slot_us != NO_SLOT {
                let slot_s = 1e-6 * f64::from(*slot_us);
                spread.add(slot_s);
                sampled.add(slot_s);
            }
        }
        if sampled.count > 1 {
            self.span_s.add(sampled.most - sampled.least);
        }
    }

    /// Counts the last stretch of a stream: one that is the beginning of a frame is no damage.
    pub fn end(&mut self, reject: &Reject) {
        match reject.reason {
            Reason::CutOff { .. } | Reason::Line => self.cut_off_bytes = reject.length,
            _ => self.reject(reject),
        }
    }

    /// Counts a stretch of bytes.
    pub fn reject(&mut self, reject: &Reject) {
        self.stretches += 1;
        self.rejected_bytes += reject.length;
    }

    /// What to print: a name and its value.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let mut rows = vec![
            ("packets", self.packets.to_string()),
            ("missed", self.missed.to_string()),
            (
                "packets with sensor errors",
                reach::by_sensor(&self.failed).unwrap_or_else(|| "none".into()),
            ),
        ];
        rows.extend(self.reach.rows());
        if self.period_s.count > 0 {
            rows.push(("packet period", self.period_s.milli("ms")));
            rows.push(("packet jitter", format!("{:.4} ms", 1e3 * self.period_s.jitter())));
        }
        if self.derived > 0 {
            rows.push(("derived frames", self.derived.to_string()));
            rows.push(("read cycle", self.cycle_s.milli("ms")));
            rows.push(("last minus first slot", self.span_s.milli("ms")));
        }
        if self.repeated + self.jumped > 0 {
            rows.push((
                "counter",
                format!("repeated {} times, jumped {} times", self.repeated, self.jumped),
            ));
        }
        if self.lines > 0 {
            rows.push(("lines of text", self.lines.to_string()));
        }
        if self.stretches > 0 {
            rows.push((
                "not decoded",
                format!("{} bytes in {} stretches", self.rejected_bytes, self.stretches),
            ));
        }
        if self.cut_off_bytes > 0 {
            rows.push(("cut off at the end", format!("{} bytes", self.cut_off_bytes)));
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use emems::sample::Errors;

    use super::*;

    /// Rounding of a few double operations on values near one.
    const ROUNDING: f64 = 1e-15;

    #[test]
    fn a_spread_knows_mean_ends_and_deviation() {
        let mut spread = Spread::default();
        [0.2, 0.2001, 0.1998].into_iter().for_each(|value| spread.add(value));
        assert!((spread.mean - 0.599_9 / 3.0).abs() < ROUNDING);
        assert!((spread.jitter() - (0.599_9 / 3.0 - 0.1998)).abs() < ROUNDING);
        assert!((spread.sigma() - 1.527_525_231_651_973e-4).abs() < ROUNDING);
        assert_eq!((spread.least, spread.most), (0.1998, 0.2001));
    }

    #[test]
    fn errors_are_told_by_sensor() {
        let mut summary = Summary::default();
        let failing = Reading {
            errors: Errors(0b1000_0000_0000_0010),
            ..Reading::unread(0)
        };
        summary.packet(&failing, Step::First, None);
        summary.packet(&failing, Step::Missed(3), None);
        assert_eq!(
            summary.rows(),
            [
                ("packets", "2".into()),
                ("missed", "3".into()),
                (
                    "packets with sensor errors",
                    "accelerometer 2: 2, thermometer 4: 2".into()
                ),
            ]
        );
    }

    #[test]
    fn clipped_sensors_are_told() {
        let mut summary = Summary::default();
        let mut clipped = Reading::unread(0);
        clipped.acc_p[0][2] = 2047;
        summary.packet(&clipped, Step::First, None);
        let row = ("packets at the end of range", "accelerometer 1: 1".to_string());
        assert!(summary.rows().contains(&row), "{:?}", summary.rows());
    }

    #[test]
    fn timed_packets_have_a_period_in_ms() {
        let mut summary = Summary::default();
        let healthy = Reading {
            errors: Errors(0),
            ..Reading::unread(0)
        };
        summary.packet(&healthy, Step::First, None);
        summary.packet(&healthy, Step::Next, Some(0.2));
        summary.packet(&healthy, Step::Next, Some(0.2001));
        let rows = summary.rows();
        assert_eq!(rows[2].1, "none");
        assert_eq!(rows[3].1, "mean 200.050 ms, least 200.000, most 200.100");
        assert_eq!(rows[4], ("packet jitter", "0.0500 ms".into()));
    }
}
