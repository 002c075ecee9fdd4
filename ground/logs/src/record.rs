//! All that a page says of a flight, while the flight is read once.
//!
//! In: items of its stream, packets with their number. Out: summary, envelope, events, spectra, attitude. Memory does not grow with
//! the flight.

use crate::follow::Follow;
use emems::{site::Site, unit::Settings};
use packets::stream::{Item, sequence::Step};

use crate::{envelope::Envelope, events::Events, spectra::Spectra, summary::Summary};

/// A flight so far.
pub struct Record {
    /// Figures.
    pub summary: Summary,
    /// Every channel, by bins.
    pub envelope: Envelope,
    /// What happened.
    pub events: Events,
    /// By frequency.
    pub spectra: Spectra,
    /// How it was turned; `None` where nobody wants to know.
    pub attitude: Option<Follow>,
}

impl Record {
    /// Of a unit with this cycle \[s\], at a site.
    pub fn new(cycle_s: f64, site: &Site) -> Self {
        Record {
            summary: Summary::default(),
            envelope: Envelope::default(),
            events: Events::default(),
            spectra: Spectra::default(),
            attitude: Some(Follow::new((1e3 * cycle_s).round() as u64, site)),
        }
    }

    /// Takes a packet: its number, how it follows the one before, and the time between them where that was seen \[s\].
    pub fn packet(&mut self, number: u64, step: Step, item: &Item, period_s: Option<f64>) {
        let Item::Packet { reading, .. } = item else { return };
        let missed = match step {
            Step::Missed(count) => u32::from(count),
            _ => 0,
        };
        let sound = packets::reach::without_impossible(*reading);
        self.summary.packet(reading, step, period_s);
        self.envelope.add(number, reading, missed, period_s);
        self.events.packet(number, step, &sound);
        self.spectra.packet(number, &sound);
        let item = Item::Packet {
            offset: 0,
            reading: sound,
        };
        if let Some(attitude) = &mut self.attitude {
            attitude.take(number, &item);
        }
    }

    /// Takes a derived frame.
    pub fn derived(&mut self, item: &Item) {
        if let Item::Derived { derived, .. } = item {
            self.summary.derived(derived);
            self.events.derived(derived);
            if let Some(attitude) = &mut self.attitude {
                attitude.take(0, item);
            }
        }
    }

    /// Takes a line that the unit says to people.
    pub fn line(&mut self, text: &str) {
        self.summary.lines += 1;
        self.events.line(text);
    }
}

impl Default for Record {
    fn default() -> Self {
        Record::new(packets::stream::sequence::CYCLE_S, &Settings::NOMINAL.site)
    }
}
