//! The unit flown on the host board: packets out, and the instants at which its sensors sampled.
//!
//! In: a plant. Out: readings by packet, or for [`instants`] the time of each channel's sample after its packet's time
//! zero. Those are found by listening at the parts: a view that writes down when it is asked hears every conversion that is
//! read. A part with a low-pass asks for more: the newest instant of a read first, then the past, as far as nobody has asked for
//! it before. So what is later than all before it is a conversion, and the rest is none.

use std::sync::{Arc, Mutex};

use emems::{
    derived::{self, DERIVED_BYTES, Derived},
    packet,
    sample::Reading,
    unit::Settings,
};
use packets::channel::{CHANNEL_COUNT, CHANNELS, Quantity};
use twin::{
    host::{self, timing::BOOT},
    motion,
    part::{Input, Nanos},
    plant::{Plant, Quality, Views},
    run::{Bench, Flow},
};

/// \[s\] read cycle of the unit's nominal settings.
pub const CYCLE_S: f64 = 0.2;

/// \[s\] flown to learn the instants.
const LISTEN_S: f64 = 6.0;

/// \[s\] that a part's registers may be read after the time stamp of its turn: eight bytes at 400 kHz and the multiplexer's
/// switching are below it, and a conversion in between is the one that is read.
const TRANSFER_S: f64 = 1e-3;

/// When the unit's samples are made.
#[derive(Clone, Debug)]
pub struct Instants {
    /// \[s\] after power-on at which packet 0 has its time zero: its oldest sample.
    pub zero_s: f64,
    /// \[s\] after that at which its cycle begins.
    pub lead_s: f64,
    /// \[s\] each channel's sampling instant after its packet's time zero; at least zero.
    pub slots_s: [f64; CHANNEL_COUNT],
}

/// What the lines said.
#[derive(Default)]
struct Heard {
    readings: Vec<Reading>,
    derived: Vec<Derived>,
    words: Vec<u8>,
}

impl Bench for Heard {
    fn telemetry(&mut self, _at: Nanos, bytes: &[u8]) {
        if let Ok(reading) = packet::decode(bytes) {
            self.readings.push(reading);
        } else if bytes.len() == DERIVED_BYTES {
            self.derived.extend(derived::decode(bytes));
        }
    }

    fn umbilical(&mut self, _at: Nanos, _bytes: &[u8]) {}

    fn log(&mut self, _at: Nanos, _line: &str) {}

    fn commands(&mut self, _now: Nanos) -> Vec<u8> {
        std::mem::take(&mut self.words)
    }

    fn advanced(&mut self, _now: Nanos) -> Flow {
        Flow::Continue
    }
}

/// Flies a plant for `duration_s` after power-on.
pub fn fly(plant: Plant, duration_s: f64) -> Vec<Reading> {
    let mut heard = Heard::default();
    host::fly(plant, Settings::NOMINAL, &[], nanos(duration_s), &mut heard);
    heard.readings
}

/// Sampling instants of the unit of this seed: its parts' clocks have their own phases.
pub fn instants(seed: u64) -> Option<Instants> {
    let source: Arc<dyn twin::truth::TruthSource> = motion::by_name("still")?.into();
    let views = Views::of(&source);
    // One list of times a sensor, in reading order; gyros' temperature is sampled with their rate.
    let asked: Vec<Arc<Mutex<Vec<f64>>>> = (0..16).map(|_| Arc::default()).collect();
    let views = Views {
        force_p: std::array::from_fn(|plate| listened(&views.force_p[plate], &asked[plate])),
        field_p_ut: std::array::from_fn(|plate| listened(&views.field_p_ut[plate], &asked[4 + plate])),
        rate: std::array::from_fn(|plate| listened(&views.rate[plate], &asked[8 + plate])),
        ..views
    };
    let mut heard = Heard {
        words: b"G_DL".to_vec(),
        ..Heard::default()
    };
    let plant = Plant::seeing(&views, source, seed, Quality::NOMINAL);
    host::fly(plant, Settings::NOMINAL, &[], nanos(LISTEN_S), &mut heard);
    let derived = heard.derived.last()?;
    let start_s = 1e-6 * derived.start_us as f64 + 1e-9 * BOOT as f64;
    let packet_zero_s = start_s - CYCLE_S * f64::from(derived.counter);
    let mut slots_s = [0.0; CHANNEL_COUNT];
    for (slot_s, channel) in slots_s.iter_mut().zip(CHANNELS) {
        let read_s = 1e-6 * f64::from(*derived.slots_us.get(channel.slot())?);
        *slot_s = match channel.quantity {
            // Thermometers convert rarely and what they measure is slow.
            Quantity::Temperature | Quantity::GyroTemperature => read_s,
            _ => {
                let times = asked.get(channel.slot())?.lock().ok()?;
                // The conversion that was asked for when the sensor was read: the transfer ends after its time stamp.
                let newest = times
                    .iter()
                    .copied()
                    .filter(|time| *time <= start_s + read_s + TRANSFER_S);
                newest.fold(f64::MIN, f64::max) - start_s
            }
        };
    }
    let earliest = slots_s.iter().copied().fold(f64::MAX, f64::min);
    Some(Instants {
        zero_s: packet_zero_s + earliest,
        lead_s: -earliest,
        slots_s: slots_s.map(|slot_s| slot_s - earliest),
    })
}

fn listened<T: 'static>(view: &Input<T>, asked: &Arc<Mutex<Vec<f64>>>) -> Input<T> {
    let (view, asked) = (view.clone(), asked.clone());
    Arc::new(move |t_s| {
        if let Ok(mut asked) = asked.lock()
            && asked.last().is_none_or(|newest| t_s > *newest)
        {
            asked.push(t_s);
        }
        view(t_s)
    })
}

fn nanos(seconds: f64) -> Nanos {
    (seconds * 1e9) as Nanos
}

#[cfg(test)]
mod tests {
    use super::*;

    /// \[s\] a set of a magnetometer at 75 Hz or an accelerometer at 50 Hz is at most this old, and reading all takes 5 ms.
    const OLDEST: f64 = 0.026;

    #[test]
    fn an_accelerometer_reads_a_ramp_as_of_the_instant_it_is_said_to_sample_at() {
        /// [m/s2] a second; six seconds are within the range, and a count is 2 ms.
        const SLOPE: f64 = 15.0;
        /// \[s\] of its low-pass of 25 Hz.
        const TAU_S: f64 = 1.0 / (std::f64::consts::TAU * 25.0);
        for seed in 1..9 {
            let instants = instants(seed).expect("derived frames");
            let source: Arc<dyn twin::truth::TruthSource> = motion::by_name("still").expect("a motion").into();
            let mut views = Views::of(&source);
            let ramp: Input<nalgebra::Vector3<f64>> =
                Arc::new(|t_s| nalgebra::Vector3::repeat(SLOPE * (t_s - 1.0).max(0.0)));
            views.force_p = std::array::from_fn(|_| ramp.clone());
            let quality = Quality {
                noise: 0.0,
                bias: 0.0,
                ..Quality::NOMINAL
            };
            let readings = fly(Plant::seeing(&views, source, seed, quality), 4.0);
            let reading = readings.iter().find(|reading| reading.counter == 12).expect("a packet");
            for plate in 0..4 {
                let felt = Quantity::SpecificForce.si(reading.acc_p[plate][0]);
                let seen_s = 1.0 + felt / SLOPE + TAU_S;
                let said_s = instants.zero_s + instants.slots_s[3 * plate] + 12.0 * CYCLE_S;
                // Half a count, and a nanosecond.
                assert!(
                    (seen_s - said_s).abs() < 1.1e-3,
                    "seed {seed}, plate {plate}: {seen_s} {said_s}"
                );
            }
        }
    }

    #[test]
    fn samples_are_a_little_older_than_their_reading_and_differ_between_units() {
        // The last one has a magnetometer that converts while it is read.
        let units = [1, 2, 995_367_449_405_017].map(|seed| instants(seed).expect("derived frames"));
        for unit in &units {
            assert!(
                unit.slots_s.iter().all(|slot| (0.0..OLDEST).contains(slot)),
                "{:?}",
                unit.slots_s
            );
        }
        let [one, other, _] = units;
        assert_eq!(one.slots_s[0], one.slots_s[1]);
        assert_ne!(one.slots_s, other.slots_s);
    }
}
