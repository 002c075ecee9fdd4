//! The attitude along a stream as it comes, for a page: what the unit sent of it, or else what its estimation makes of the packets.
//!
//! In: items of a stream, each packet with its number. Out: a [`Flight`] whose time is the packet's number times the cycle, plus when
//! in its cycle the gyros were read. Where a derived frame has an attitude, that is taken: it was made with the unit's own
//! calibration and site. Where it has not, the unit's estimation runs here, with the calibration that is compiled in. Of more than [`ESTIMATES_KEPT`]
//! estimates every second, then every fourth and so on are kept, so memory is bounded.

use emems::{
    calibration::{Ranges, Set},
    estimate::Estimator,
    site::Site,
    unit::Settings,
};
use packets::stream::Item;

use crate::{
    cycles::{Cycle, Cycles},
    flight::{EstimatedStep, Flight},
};

/// Estimates that are kept: seven hours at 5 Hz, some 36 MB.
pub const ESTIMATES_KEPT: usize = 1 << 17;

/// An attitude being followed.
pub struct Follow {
    cycles: Cycles,
    estimator: Estimator,
    /// Of the packet whose cycle is not complete.
    number: Option<u64>,
    /// Number of the packet of each estimate, whose time is in its cycle.
    numbers: Vec<u64>,
    estimates: Vec<EstimatedStep>,
    stride: u64,
    seen: u64,
    sent: u64,
}

impl Follow {
    /// Of a unit with this cycle \[ms\], at a site.
    pub fn new(period_ms: u64, site: &Site) -> Self {
        let settings = Settings {
            period_ms,
            ..Settings::NOMINAL
        };
        let set = Set::nominal(Ranges::of(&settings));
        Follow {
            cycles: Cycles::new(settings),
            estimator: Estimator::new(set, site),
            number: None,
            numbers: Vec::new(),
            estimates: Vec::new(),
            stride: 1,
            seen: 0,
            sent: 0,
        }
    }

    /// Takes an item; `number` is the packet's, without wraps, and means nothing of others.
    pub fn take(&mut self, number: u64, item: &Item) {
        let cycle = self.cycles.take(item);
        let before = match item {
            Item::Packet { .. } => self.number.replace(number),
            _ => self.number,
        };
        if let (Some(cycle), Some(before)) = (cycle, before) {
            self.enter(before, &cycle);
        }
    }

    /// At the end of the stream.
    pub fn finish(&mut self) {
        if let (Some(cycle), Some(number)) = (self.cycles.finish(), self.number.take()) {
            self.enter(number, &cycle);
        }
    }

    fn enter(&mut self, number: u64, cycle: &Cycle) {
        let sent = cycle
            .sent
            .as_ref()
            .map(|frame| &frame.estimate)
            .filter(|sent| sent.q_nb.is_some());
        self.sent += u64::from(sent.is_some());
        let estimate = match sent {
            Some(sent) => EstimatedStep::of(cycle, sent, Vec::new()),
            None => EstimatedStep::of(
                cycle,
                &self.estimator.step(&cycle.sample, &cycle.increments),
                Vec::new(),
            ),
        };
        let Some(mut estimate) = estimate else { return };
        self.seen += 1;
        if !(self.seen - 1).is_multiple_of(self.stride) {
            return;
        }
        let start_s = cycle.sample.start_us as f64 * 1e-6;
        estimate.t_s -= start_s;
        if let Some((triad_s, _)) = &mut estimate.triad_nb {
            *triad_s -= start_s;
        }
        self.estimates.push(estimate);
        self.numbers.push(number);
        if self.estimates.len() >= ESTIMATES_KEPT {
            self.estimates = std::mem::take(&mut self.estimates).into_iter().step_by(2).collect();
            self.numbers = self.numbers.iter().copied().step_by(2).collect();
            self.stride *= 2;
        }
    }

    /// What is known, for a cycle \[s\].
    pub fn flight(&self, cycle_s: f64) -> Flight {
        let each = self.estimates.iter().zip(&self.numbers);
        let estimates = each.map(|(estimate, number)| {
            let start_s = *number as f64 * cycle_s;
            EstimatedStep {
                t_s: estimate.t_s + start_s,
                triad_nb: estimate.triad_nb.map(|(triad_s, q_nb)| (triad_s + start_s, q_nb)),
                ..estimate.clone()
            }
        });
        Flight {
            estimates: estimates.collect(),
            ..Flight::default()
        }
    }

    /// Where it is from, in words.
    pub fn about(&self) -> String {
        let whence = match self.sent {
            0 => "estimated here from the packets, by the unit's estimation with the calibration that is compiled in",
            sent if sent == self.seen => "as the unit sent it in its derived frames",
            _ => "as the unit sent it where there are derived frames, else estimated here from the packets",
        };
        let part = match self.stride {
            1 => String::new(),
            stride => format!("; one estimate in {stride} is drawn"),
        };
        format!("Attitude {whence}{part}.")
    }
}

#[cfg(test)]
mod tests {
    use emems::sample::{Errors, Reading};

    use super::*;

    /// At rest and level: gravity on the accelerometers, a field to the north and down. No noise: after some seconds its sensors are
    /// taken for stuck.
    fn still(counter: u16) -> Item {
        let frame = emems::geometry::dcm_bp;
        let counts = |vector: nalgebra::Vector3<f32>, lsb: f32| -> [[i16; 3]; 4] {
            std::array::from_fn(|plate| {
                let v_p = frame(plate).transpose() * vector / lsb;
                [v_p.x as i16, v_p.y as i16, v_p.z as i16]
            })
        };
        let lsb = |quantity: packets::channel::Quantity| quantity.scale().0 as f32;
        let reading = Reading {
            errors: Errors(0),
            acc_p: counts(
                nalgebra::Vector3::new(0.0, 0.0, -9.8),
                lsb(packets::channel::Quantity::SpecificForce),
            ),
            mag_p: counts(
                nalgebra::Vector3::new(20.0, 0.0, 10.0),
                lsb(packets::channel::Quantity::Field),
            ),
            gyro: [0; 4],
            ..Reading::unread(counter)
        };
        Item::Packet { offset: 0, reading }
    }

    fn followed(count: u16, first: u16) -> Follow {
        let mut follow = Follow::new(200, &Site::LABORATORY);
        for k in 0..count {
            follow.take(u64::from(first) + u64::from(k), &still(first + k));
        }
        follow.finish();
        follow
    }

    #[test]
    fn time_is_the_number_of_the_packet_and_attitude_is_found() {
        let flight = followed(14, 100).flight(0.2);
        let last = flight.estimates.last().expect("an attitude");
        assert!((last.t_s - 113.0 * 0.2).abs() < 0.2, "{}", last.t_s);
        let [roll, pitch, _] = last.euler_deg();
        assert!(roll.abs() < 1.0 && pitch.abs() < 1.0, "{roll} {pitch}");
        assert!(flight.estimates.windows(2).all(|pair| pair[0].t_s < pair[1].t_s));
    }

    #[test]
    fn it_says_where_it_is_from() {
        assert!(followed(60, 0).about().starts_with("Attitude estimated here"));
    }
}
