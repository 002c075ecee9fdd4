//! A telemetry stream to all that is wanted of it at once: entries in order, and what a page says of it.
//!
//! In: bytes, and the instant they were complete where it is known. Out: [`StreamEntry`]s as they are found, and at the end the
//! [`Record`]. Memory does not grow with the stream, so a log of any size can be read.

use emems::{derived::Derived, sample::Reading, site::Site, unit::Settings};

use packets::stream::{
    Bytes5To8, Decoder, Item, Reject,
    sequence::{CYCLE_S, Sequence, Step},
};

use crate::record::Record;

/// Something found in the stream.
#[derive(Clone, Debug, PartialEq)]
pub enum StreamEntry {
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
    /// What the unit says to people.
    Line {
        /// Offset in the stream.
        offset: u64,
        /// Without `>` and line end.
        text: String,
    },
    /// Bytes that are no frame.
    Reject(Reject),
}

/// Digests one stream.
#[derive(Default)]
pub struct Digest {
    decoder: Decoder,
    sequence: Sequence,
    last_s: Option<f64>,
    record: Record,
}

impl Digest {
    /// At the start of a stream of a unit with this cycle \[s\], at a site.
    pub fn new(bytes_5_to_8: Bytes5To8, cycle_s: f64, site: &Site) -> Self {
        Digest {
            decoder: Decoder::new(bytes_5_to_8),
            record: Record::new(cycle_s, site),
            ..Digest::default()
        }
    }

    /// At the start of a stream of which no page is wanted: nobody's attitude is estimated.
    pub fn summing(bytes_5_to_8: Bytes5To8) -> Self {
        let mut digest = Digest::new(bytes_5_to_8, CYCLE_S, &Settings::NOMINAL.site);
        digest.record.attitude = None;
        digest
    }

    /// At the start of the stream of a flight from this site.
    pub fn at(site: &Site) -> Self {
        Digest {
            record: Record::new(CYCLE_S, site),
            ..Digest::default()
        }
    }

    /// Takes the next bytes, the last of them complete at `at_s`.
    pub fn push(&mut self, at_s: Option<f64>, bytes: &[u8]) -> Vec<StreamEntry> {
        let items = self.decoder.push(bytes);
        items.into_iter().map(|item| self.enter(at_s, item)).collect()
    }

    /// Ends the stream.
    pub fn finish(mut self) -> (Vec<StreamEntry>, Record) {
        let last = std::mem::take(&mut self.decoder).finish();
        if let Some(reject) = &last {
            self.record.summary.end(reject);
        }
        if let Some(attitude) = &mut self.record.attitude {
            attitude.finish();
        }
        (last.map(StreamEntry::Reject).into_iter().collect(), self.record)
    }

    fn enter(&mut self, at_s: Option<f64>, item: Item) -> StreamEntry {
        match &item {
            Item::Packet { offset, reading } => {
                let (number, step) = self.sequence.number(reading.counter);
                let period_s = match (step, self.last_s, at_s) {
                    (Step::Next, Some(last_s), Some(at_s)) => Some(at_s - last_s),
                    _ => None,
                };
                self.last_s = at_s;
                self.record.packet(number, step, &item, period_s);
                StreamEntry::Packet {
                    number,
                    step,
                    offset: *offset,
                    reading: *reading,
                }
            }
            Item::Derived { derived, .. } => {
                self.record.derived(&item);
                StreamEntry::Derived(derived.clone())
            }
            Item::Line { offset, text } => {
                self.record.line(text);
                StreamEntry::Line {
                    offset: *offset,
                    text: text.clone(),
                }
            }
            Item::Reject(reject) => {
                self.record.summary.reject(reject);
                StreamEntry::Reject(*reject)
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
        let (_, Record { summary, envelope, .. }) = digest.finish();
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
        let (rest, Record { summary, .. }) = digest.finish();
        entries.extend(rest);
        let found: Vec<String> = (entries.iter())
            .map(|entry| match entry {
                StreamEntry::Packet { number, step, .. } => format!("{number} {step:?}"),
                StreamEntry::Derived(_) => "derived".into(),
                StreamEntry::Line { offset, text } => format!("offset {offset}: {text}"),
                StreamEntry::Reject(reject) => reject.to_string(),
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
