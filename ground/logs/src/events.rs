//! What happened along a flight: lift-off, burn-out, micro-gravity, silence, clipping, missed packets, resets, mode.
//!
//! In: packets by number and derived frames, in order. Out: [`Event`]s by packet number. What lasts is one event from its first packet
//! to its last; it is over when it has not been there for [`QUIET`] packets. A sensor is silent that failed in [`SILENT`] packets at least.
//!
//! Burn-out is where specific force, the mean of the four plates in b (in which what a spin does at the plates cancels), falls below one standard
//! gravity after it was above two, between lift-off and micro-gravity, once a stage: under thrust a rocket is pushed by more than its
//! weight, without it by drag alone.

use emems::{
    derived::Derived,
    geometry::{PLATES, dcm_bp},
    mode::Mode,
    sample::{NOT_READ, Reading, SENSOR_COUNT},
};
use nalgebra::Vector3;
use packets::{
    channel::{Quantity, Reach},
    magnitude::G,
    reach,
    stream::sequence::Step,
};

use crate::table::SLOT_NAMES;

/// Packets without it after which something is over: five seconds.
const QUIET: u64 = 25;

/// Failures in one event below which a sensor is not silent but noisy: those are counted in the summary.
const SILENT: u64 = 3;

/// How a change of mode begins.
const MODE: &str = "mode ";

/// Packets in a row that are above or below a force.
const IN_A_ROW: u32 = 3;

/// Events that are kept.
const EVENTS_KEPT: usize = 500;

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Event {
    /// Number of the packet in which it began.
    pub number: u64,
    /// And of the last one in which it was; the same for an instant.
    pub until: u64,
    /// What.
    pub what: String,
}

#[derive(Clone, Copy, Debug)]
struct Open {
    from: u64,
    last: u64,
    count: u64,
}

/// Conditions that last, in this order: sensors that failed, sensors at the end of their range, micro-gravity, missed packets.
const CONDITIONS: usize = 2 * SENSOR_COUNT + 2;
const MICRO_G: usize = 2 * SENSOR_COUNT;
const MISSED: usize = MICRO_G + 1;

/// Events as they come.
#[derive(Clone, Debug)]
pub struct Events {
    closed: Vec<Event>,
    open: [Option<Open>; CONDITIONS],
    left_out: usize,
    last: u64,
    lift_off: bool,
    thrust: Thrust,
    mode: Option<Mode>,
    starts: Option<u16>,
}

#[derive(Clone, Copy, Debug)]
enum Thrust {
    /// Before lift-off.
    Before,
    /// Packets above two gravities in a row.
    Growing(u32),
    /// Packets below one in a row.
    On(u32),
    Over,
}

impl Default for Events {
    fn default() -> Self {
        Events {
            closed: Vec::new(),
            open: [None; CONDITIONS],
            left_out: 0,
            last: 0,
            lift_off: false,
            thrust: Thrust::Before,
            mode: None,
            starts: None,
        }
    }
}

impl Events {
    /// Takes a packet.
    pub fn packet(&mut self, number: u64, step: Step, reading: &Reading) {
        self.last = number;
        match step {
            Step::Missed(count) => self.during(
                MISSED,
                number.saturating_sub(u64::from(count)),
                number,
                u64::from(count),
            ),
            Step::Jumped => self.instant(number, "counter jumped".into()),
            Step::First | Step::Next | Step::Repeated => {}
        }
        let clipped = reach::sensors(reading, Reach::End);
        for slot in 0..SENSOR_COUNT {
            if reading.errors.contains(slot) {
                self.during(slot, number, number, 1);
            }
            if clipped >> slot & 1 != 0 {
                self.during(SENSOR_COUNT + slot, number, number, 1);
            }
        }
        if reading.micro_g {
            self.thrust = Thrust::Over;
            self.during(MICRO_G, number, number, 1);
        }
        if reading.lift_off && !self.lift_off {
            self.instant(number, "lift-off".into());
            if matches!(self.thrust, Thrust::Before) {
                self.thrust = Thrust::Growing(0);
            }
        }
        self.lift_off = reading.lift_off;
        self.burn(number, reading);
        for condition in 0..CONDITIONS {
            let open = self.open.get(condition).copied().flatten();
            if open.is_some_and(|open| open.last + QUIET < number) {
                self.close(condition);
            }
        }
    }

    /// Takes a derived frame of about the packet before.
    pub fn derived(&mut self, derived: &Derived) {
        let number = self.last;
        if self
            .mode
            .replace(derived.mode)
            .is_some_and(|before| before != derived.mode)
        {
            let what = format!("{MODE}{}", derived.mode.name());
            if !self.recent().any(|event| event.what.starts_with(&what)) {
                self.instant(number, what);
            }
        }
        if let Some(start) = &derived.start
            && self
                .starts
                .replace(start.starts)
                .is_some_and(|before| before != start.starts)
        {
            let reason = format!("{:?}", start.reset).to_lowercase();
            self.instant(number, format!("reset ({reason})"));
        }
    }

    /// Takes a line that the unit says to people: a change of mode with its cause, which a derived frame says without.
    pub fn line(&mut self, text: &str) {
        if !text.starts_with(MODE) {
            return;
        }
        if let Some(without_cause) = self.recent().find(|event| text.starts_with(&event.what)) {
            text.clone_into(&mut without_cause.what);
            return;
        }
        self.instant(self.last, text.to_owned());
    }

    /// What was kept of the last packets.
    fn recent(&mut self) -> impl Iterator<Item = &mut Event> {
        let since = self.last.saturating_sub(QUIET);
        self.closed.iter_mut().filter(move |event| event.number >= since)
    }

    /// All of them in order, the conditions that last to the end among them, and how many more there were.
    pub fn all(&self) -> (Vec<Event>, usize) {
        let mut whole = self.clone();
        for condition in 0..CONDITIONS {
            whole.close(condition);
        }
        whole
            .closed
            .sort_by(|one, other| (one.number, &one.what).cmp(&(other.number, &other.what)));
        (whole.closed, whole.left_out)
    }

    /// Number of the packet in which lift-off was asserted first.
    pub fn lift_off(&self) -> Option<u64> {
        let events = self.closed.iter();
        events
            .filter(|event| event.what == "lift-off")
            .map(|event| event.number)
            .min()
    }

    fn during(&mut self, condition: usize, from: u64, to: u64, count: u64) {
        if let Some(open) = self.open.get_mut(condition) {
            match open {
                Some(open) => (open.last, open.count) = (to, open.count + count),
                None => *open = Some(Open { from, last: to, count }),
            }
        }
    }

    fn close(&mut self, condition: usize) {
        let Some(open) = self.open.get_mut(condition).and_then(Option::take) else {
            return;
        };
        let what = match condition {
            MICRO_G => "micro-gravity".to_string(),
            MISSED => format!("{} packets missed", open.count),
            slot if slot < SENSOR_COUNT && open.count < SILENT => return,
            slot if slot < SENSOR_COUNT => format!("{} silent", SLOT_NAMES[slot]),
            slot => format!("{} clipped", SLOT_NAMES[slot - SENSOR_COUNT]),
        };
        self.keep(Event {
            number: open.from,
            until: open.last,
            what,
        });
    }

    fn instant(&mut self, number: u64, what: String) {
        self.keep(Event {
            number,
            until: number,
            what,
        });
    }

    fn keep(&mut self, event: Event) {
        if self.closed.len() < EVENTS_KEPT {
            self.closed.push(event);
        } else {
            self.left_out += 1;
        }
    }

    fn burn(&mut self, number: u64, reading: &Reading) {
        let Some(force) = force(reading) else { return };
        self.thrust = match self.thrust {
            Thrust::Growing(count) if force > 2.0 * G && count + 1 >= IN_A_ROW => Thrust::On(0),
            Thrust::Growing(count) => Thrust::Growing(if force > 2.0 * G { count + 1 } else { 0 }),
            Thrust::On(count) if force < G && count + 1 >= IN_A_ROW => {
                self.instant(number.saturating_sub(u64::from(IN_A_ROW - 1)), "burn-out".into());
                Thrust::Growing(0)
            }
            Thrust::On(count) => Thrust::On(if force < G { count + 1 } else { 0 }),
            other => other,
        };
    }
}

/// [m/s2] size of the mean specific force of the plates that were read.
fn force(reading: &Reading) -> Option<f64> {
    let plates = (0..PLATES).filter(|plate| !reading.acc_p[*plate].contains(&NOT_READ));
    let (count, sum_b) = plates.fold((0, Vector3::zeros()), |(count, sum_b), plate| {
        let force_p = Vector3::from(reading.acc_p[plate].map(|counts| Quantity::SpecificForce.si(counts)));
        (count + 1, sum_b + dcm_bp(plate).cast::<f64>() * force_p)
    });
    (count > 0).then(|| sum_b.norm() / f64::from(count))
}

#[cfg(test)]
mod tests {
    use emems::sample::Errors;

    use super::*;

    /// Pushed along x of b [m/s2].
    fn pushed(force: f32, lift_off: bool) -> Reading {
        let lsb = Quantity::SpecificForce.scale().0 as f32;
        let acc_p = std::array::from_fn(|plate| {
            let force_p = dcm_bp(plate).transpose() * Vector3::new(force, 0.0, 0.0) / lsb;
            [force_p.x as i16, force_p.y as i16, force_p.z as i16]
        });
        Reading {
            errors: Errors(0),
            acc_p,
            lift_off,
            ..Reading::unread(0)
        }
    }

    fn told(readings: impl IntoIterator<Item = Reading>) -> Vec<(u64, u64, String)> {
        let mut events = Events::default();
        for (number, reading) in readings.into_iter().enumerate() {
            events.packet(number as u64, Step::Next, &reading);
        }
        let (all, left_out) = events.all();
        assert_eq!(left_out, 0);
        all.into_iter()
            .map(|event| (event.number, event.until, event.what))
            .collect()
    }

    #[test]
    fn a_boost_has_lift_off_and_burn_out() {
        let pad = std::iter::repeat_n(pushed(9.8, false), 20);
        let boost = std::iter::repeat_n(pushed(40.0, true), 50);
        let coast = std::iter::repeat_n(pushed(3.0, true), 50);
        let found = told(pad.chain(boost).chain(coast));
        assert_eq!(found, [(20, 20, "lift-off".into()), (70, 70, "burn-out".into())]);
    }

    #[test]
    fn each_stage_burns_out_and_what_brakes_after_micro_gravity_does_not() {
        let stage = |force| std::iter::repeat_n(pushed(force, true), 10);
        let weightless = std::iter::repeat_n(
            Reading {
                micro_g: true,
                ..pushed(0.0, true)
            },
            10,
        );
        let flight = stage(40.0).chain(stage(2.0)).chain(stage(50.0)).chain(stage(1.0));
        let found = told(flight.chain(weightless).chain(stage(40.0)).chain(stage(9.0)));
        let burns: Vec<u64> = found
            .iter()
            .filter(|(.., what)| what == "burn-out")
            .map(|(number, ..)| *number)
            .collect();
        assert_eq!(burns, [10, 30]);
    }

    #[test]
    fn one_outlier_is_no_boost() {
        let coast = (0..100).map(|k| pushed(if k == 50 { 40.0 } else { 3.0 }, k > 5));
        assert_eq!(told(coast), [(6, 6, "lift-off".into())]);
    }

    #[test]
    fn a_silence_is_one_event_from_its_first_packet_to_its_last() {
        let readings = (0..200).map(|k| {
            let mut reading = pushed(9.8, false);
            reading.errors = Errors(if (50..80).contains(&k) && k != 60 || k == 150 {
                1 << 9
            } else {
                0
            });
            reading
        });
        assert_eq!(told(readings), [(50, 79, "g2 silent".into())]);
    }

    #[test]
    fn a_change_of_mode_is_told_once_with_its_cause() {
        let said = "mode FLIGHT: lift-off";
        let frame = |mode| Derived {
            counter: 7,
            mode,
            ..Derived::NONE
        };
        for line_first in [false, true] {
            let mut events = Events::default();
            events.packet(7, Step::First, &pushed(9.8, false));
            events.derived(&frame(Mode::Wait));
            if line_first {
                events.line(said);
            }
            events.derived(&frame(Mode::Flight));
            if !line_first {
                events.line(said);
            }
            events.line("G_ST FLIGHT task none");
            let (all, _) = events.all();
            let told: Vec<_> = all.iter().map(|event| (event.number, event.what.as_str())).collect();
            assert_eq!(told, [(7, said)], "the line first: {line_first}");
        }
    }

    #[test]
    fn what_goes_on_to_the_end_is_told_and_so_are_missed_packets() {
        let mut events = Events::default();
        let mut reading = pushed(9.8, false);
        reading.acc_p[0][2] = 2047;
        events.packet(0, Step::First, &pushed(9.8, false));
        events.packet(8, Step::Missed(7), &reading);
        let (all, _) = events.all();
        let texts: Vec<&str> = all.iter().map(|event| event.what.as_str()).collect();
        assert_eq!(texts, ["7 packets missed", "a1 clipped"]);
        assert_eq!((all[0].number, all[0].until), (1, 8));
    }
}
