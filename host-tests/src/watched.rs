//! A unit under watch: what befalls it, how soon that is seen, and who is named.
//!
//! In: a [`Unit`] and its ills. Out: an [`Outcome`] each, and a [`Tally`] of many.

use emems::{
    calibration::{CHANNELS, Channel, Channels, Ranges, Set, Temperatures, Uncertainty},
    faults::{Monitor, SensorHealth, Vectors, Verdict},
    unit::Settings,
};

use crate::{
    counts::{BIAS, Ill, NOISE, PERIOD_S, Unit, sensor},
    world,
};

/// A set as a calibration leaves the twin's parts: their biases as the twin draws them, a tenth of a per cent, a milliradian.
pub fn calibrated() -> Set {
    let mut set = Set::nominal(Ranges::of(&Settings::NOMINAL));
    set.uncertainty = BIAS.map(|bias| Uncertainty {
        bias: bias as f32,
        scale: 1e-3,
        direction: 1e-3,
    });
    set.place_sigma = 1e-3;
    set
}

/// A unit and its monitor.
#[derive(Clone)]
pub struct Flown {
    /// What is flown.
    pub unit: Unit,
    /// Its parameters.
    pub set: Set,
    /// What watches it.
    pub monitor: Monitor,
    /// What is believed of its temperatures.
    pub temperatures: Temperatures,
}

impl Flown {
    /// With a calibrated set.
    pub fn new(unit: Unit) -> Self {
        Flown::with(unit, calibrated())
    }

    /// With another set.
    pub fn with(unit: Unit, set: Set) -> Self {
        Flown {
            unit,
            monitor: Monitor::new(&set),
            set,
            temperatures: Temperatures::default(),
        }
    }

    /// Flies a cycle.
    pub fn step(&mut self) -> Vectors {
        let reading = self.unit.reading();
        self.temperatures.note(&reading);
        let measured = self.set.apply(&reading, &self.temperatures);
        self.monitor.step(&self.set, &reading, &measured, PERIOD_S as f32)
    }

    /// Axes that are held to be at fault.
    pub fn accused(&self) -> Channels {
        let mut accused = Channels::default();
        for n in 0..CHANNELS as u8 {
            if self.monitor.verdict(Channel(n)) != Verdict::Sound {
                accused.insert(Channel(n));
            }
        }
        accused
    }
}

const UNDECIDED: u32 = SensorHealth::ACCELEROMETERS.0 | SensorHealth::MAGNETOMETERS.0 | SensorHealth::GYROS.0;

/// Onsets of accusations and of "not isolable" in `cycles` of a healthy unit.
pub fn false_alarms(unit: Unit, cycles: u64, set: Set) -> (u32, u32) {
    let mut flown = Flown::with(unit, set);
    let (mut accused, mut undecided) = (0, false);
    let mut count = (0, 0);
    for _ in 0..cycles {
        let health = flown.step().health;
        let now = flown.accused().0;
        let is_undecided = health.0 & UNDECIDED != 0;
        count.0 += (now & !accused).count_ones();
        count.1 += u32::from(is_undecided && !undecided);
        (accused, undecided) = (now, is_undecided);
    }
    count
}

/// How a fault on an axis went.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outcome {
    /// \[s\] from the first faulty cycle to the alarm.
    pub delay_s: Option<f64>,
    /// \[s\] until somebody was accused.
    pub named_s: Option<f64>,
    /// Axes accused at the end.
    pub accused: Channels,
    /// Somebody said "not isolable".
    pub undecided: bool,
    /// \[rad\] largest difference of the direction of force or field from what the same unit finds when healthy.
    pub jump: f64,
}

/// \[s\] the tumble begins.
const REST_S: f64 = 10.0;

/// A unit that learns for `learns_s`, falls ill, and is watched for `watched_s`.
pub fn fall_ill(unit: Unit, learns_s: f64, watched_s: f64, ills: &[Ill]) -> Outcome {
    let mut flown = Flown::new(unit);
    let mut outcome = Outcome::default();
    let (mut sum, mut cycles) = (nalgebra::Vector3::zeros(), 0.0);
    while flown.unit.now_s() < learns_s {
        let now_s = flown.unit.now_s();
        let rate_b = flown.step().rate_b.vector_b;
        // What a filter finds on the pad: the mean rate at rest, good to the noise over the root of the cycles.
        if now_s < REST_S || flown.unit.at_rest() {
            (sum, cycles) = (sum + rate_b, cycles + 1.0);
        }
    }
    flown.monitor.know_bias(sum / cycles, 3e-4);
    // The same unit, the same noise, and nothing befalls it.
    let mut healthy = flown.clone();
    let start_s = flown.unit.now_s();
    for ill in ills {
        flown.unit.ills.push((start_s, 1e9, *ill));
    }
    let before = flown.accused();
    while flown.unit.now_s() < start_s + watched_s {
        let now_s = flown.unit.now_s();
        let vectors = flown.step();
        let sound = healthy.step();
        outcome.undecided |= vectors.health.0 & UNDECIDED != 0;
        let accused = flown.accused() != before;
        let alarmed = accused || vectors.health.0 & UNDECIDED != 0;
        let since_s = now_s - start_s;
        outcome.delay_s = outcome.delay_s.or(alarmed.then_some(since_s));
        outcome.named_s = outcome.named_s.or(accused.then_some(since_s));
        let jump = (vectors.force_b.vector_b.angle(&sound.force_b.vector_b))
            .max(vectors.field_b_ut.vector_b.angle(&sound.field_b_ut.vector_b));
        outcome.jump = outcome.jump.max(f64::from(jump));
    }
    outcome.accused = flown.accused();
    outcome
}

/// Noise of a triad axis.
pub fn sigma(channel: u8) -> f64 {
    NOISE[usize::from(channel / 12)]
}

/// Ills and how they went.
#[derive(Debug, Default)]
pub struct Tally {
    /// How many.
    pub tried: u32,
    /// Somebody was accused, or it was said not to be isolable.
    pub detected: u32,
    /// Exactly those at fault were accused.
    pub named: u32,
    /// A sensor on a healthy plate was accused.
    pub wrong: u32,
    /// \[rad\] largest jump of any.
    pub jump: f64,
    /// \[s\] longest delay of any.
    pub delay_s: f64,
}

impl Tally {
    /// Counts one, in which these were at fault.
    pub fn add(&mut self, outcome: &Outcome, guilty: Channels) {
        let plates = |channels: Channels| {
            let of = (0..CHANNELS as u8).filter(|n| channels.contains(Channel(*n)));
            of.fold(0_u16, |plates, n| plates | 1 << Channel(n).plate() << (4 * (n / 12)))
        };
        self.tried += 1;
        self.detected += u32::from(outcome.delay_s.is_some());
        self.named += u32::from(outcome.accused == guilty);
        self.wrong += u32::from(plates(outcome.accused) & !plates(guilty) != 0);
        self.jump = self.jump.max(outcome.jump);
        self.delay_s = self.delay_s.max(outcome.delay_s.unwrap_or(f64::INFINITY));
    }

    /// At least this part of those tried.
    pub fn is(&self, part: f64, count: u32) -> bool {
        f64::from(count) >= part * f64::from(self.tried)
    }
}

/// One ill in a motion on several seeds: [`Tally`] of those accused after `watched_s`.
pub fn ills(name: &str, watched_s: f64, each: impl Fn(u64) -> (Vec<Ill>, Channels), rounds: u64) -> Tally {
    let mut tally = Tally::default();
    for round in 0..rounds {
        let (ills, guilty) = each(round);
        let unit = Unit::new(world(name), 6000 + round, 1.0);
        tally.add(&fall_ill(unit, 60.0, watched_s, &ills), guilty);
    }
    tally
}

/// Axes of the sensor of a channel.
pub fn whole_sensor(channel: u8) -> Channels {
    sensor(Channel(channel)).fold(Channels::default(), |all, n| Channels(all.0 | 1 << n))
}

/// Prints a tally of which every try must have been named in time, and nobody wrongly.
pub fn all_named(what: &str, tally: Tally, most_s: f64) {
    println!("{what}: {tally:?}");
    assert!(
        tally.named == tally.tried && tally.wrong == 0 && tally.delay_s <= most_s,
        "{what}: {tally:?}"
    );
}
