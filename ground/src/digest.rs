//! A telemetry stream to all that is wanted of it at once: entries in order, figures, and what a plot shows.
//!
//! In: bytes, and the instant they were complete where it is known. Out: [`Entry`]s as they are found; [`Summary`] and
//! [`Envelope`] at any time. Memory does not grow with the stream, so a log of any size can be read.

use emems::{derived::Derived, sample::Reading};

use packets::stream::{
    Bytes5To8, Decoder, Item, Reject,
    sequence::{Sequence, Step},
};

use crate::{envelope::Envelope, summary::Summary};

/// Something found in the stream.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A packet.
    Packet {
        /// Its number: the counter without its wraps.
        number: u64,
        /// How it follows the one before.
        step: Step,
        /// Offset in the stream.
        offset: u64,
        /// What it says.
        reading: Reading,
    },
    /// A derived frame.
    Derived(Box<Derived>),
    /// Bytes that are no frame.
    Reject(Reject),
}

/// Digests one stream.
#[derive(Debug, Default)]
pub struct Digest {
    decoder: Decoder,
    sequence: Sequence,
    last_s: Option<f64>,
    summary: Summary,
    envelope: Envelope,
}

impl Digest {
    /// At the start of a stream.
    pub fn new(bytes_5_to_8: Bytes5To8) -> Self {
        Digest {
            decoder: Decoder::new(bytes_5_to_8),
            ..Digest::default()
        }
    }

    /// Takes the next bytes, the last of them complete at `at_s`.
    pub fn push(&mut self, at_s: Option<f64>, bytes: &[u8]) -> Vec<Entry> {
        let items = self.decoder.push(bytes);
        items.into_iter().map(|item| self.enter(at_s, item)).collect()
    }

    /// Ends the stream.
    pub fn finish(mut self) -> (Vec<Entry>, Summary, Envelope) {
        let last = std::mem::take(&mut self.decoder).finish();
        if let Some(reject) = &last {
            self.summary.end(reject);
        }
        (
            last.map(Entry::Reject).into_iter().collect(),
            self.summary,
            self.envelope,
        )
    }

    fn enter(&mut self, at_s: Option<f64>, item: Item) -> Entry {
        match item {
            Item::Packet { offset, reading } => {
                let (number, step) = self.sequence.number(reading.counter);
                let period_s = match (step, self.last_s, at_s) {
                    (Step::Next, Some(last_s), Some(at_s)) => Some(at_s - last_s),
                    _ => None,
                };
                self.last_s = at_s;
                let missed = match step {
                    Step::Missed(count) => u32::from(count),
                    _ => 0,
                };
                self.summary.packet(&reading, step, period_s);
                self.envelope.add(number, &reading, missed, period_s);
                Entry::Packet {
                    number,
                    step,
                    offset,
                    reading,
                }
            }
            Item::Derived { derived, .. } => {
                self.summary.derived(&derived);
                Entry::Derived(derived)
            }
            Item::Reject(reject) => {
                self.summary.reject(&reject);
                Entry::Reject(reject)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use emems::packet::encode;

    use super::*;

    /// Rounding of a difference of two instants.
    const ROUNDING_S: f64 = 1e-15;

    fn packet(counter: u16) -> [u8; 156] {
        encode(&Reading::unread(counter))
    }

    #[test]
    fn only_packets_that_follow_each_other_have_a_period() {
        let mut digest = Digest::default();
        digest.push(Some(0.1), &packet(1));
        digest.push(Some(0.3), &packet(2));
        digest.push(Some(0.9), &packet(5));
        digest.push(Some(1.1001), &packet(6));
        let (_, summary, envelope) = digest.finish();
        assert_eq!((summary.packets, summary.missed, summary.period_s.count), (4, 2, 2));
        assert!((summary.period_s.most - 0.2001).abs() < ROUNDING_S);
        assert_eq!(envelope.bins().len(), 6);
    }

    #[test]
    fn entries_come_in_the_order_of_the_stream() {
        let mut digest = Digest::default();
        let mut entries = digest.push(
            None,
            &[b"boot".as_slice(), &packet(0xFFFF), &packet(1), b"@00"].concat(),
        );
        let (rest, summary, _) = digest.finish();
        entries.extend(rest);
        let found: Vec<String> = (entries.iter())
            .map(|entry| match entry {
                Entry::Packet { number, step, .. } => format!("{number} {step:?}"),
                Entry::Derived(_) => "derived".into(),
                Entry::Reject(reject) => reject.to_string(),
            })
            .collect();
        assert_eq!(
            found,
            [
                "offset 0, 4 bytes: not part of a frame",
                "65535 First",
                "65537 Missed(1)",
                "offset 316, 3 bytes: frame cut off after 3 of 156 bytes",
            ]
        );
        assert_eq!(
            (summary.stretches, summary.rejected_bytes, summary.cut_off_bytes),
            (1, 4, 3)
        );
        assert_eq!(summary.failed, [2; 16]);
    }
}
