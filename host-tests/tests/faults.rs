//! What fault detection does over hours, and what it costs: false alarms, delays, who is named.

use std::sync::Arc;

use emems::{
    calibration::{CHANNELS, Channel, Channels, Ranges, Set, Temperatures, Uncertainty},
    faults::{Monitor, SensorHealth, Vectors, Verdict},
    unit::Settings,
};
use host_tests::{
    counts::{BIAS, Ill, NOISE, PERIOD_S, Unit},
    world,
};
use twin::truth::TruthSource;

/// A set as a calibration leaves the twin's parts: their biases as the twin draws them, a tenth of a per cent, a milliradian.
fn calibrated() -> Set {
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
struct Flown {
    unit: Unit,
    set: Set,
    monitor: Monitor,
    temperatures: Temperatures,
}

impl Flown {
    fn new(unit: Unit) -> Self {
        Flown::with(unit, calibrated())
    }

    fn with(unit: Unit, set: Set) -> Self {
        Flown {
            unit,
            monitor: Monitor::new(&set),
            set,
            temperatures: Temperatures::default(),
        }
    }

    fn step(&mut self) -> Vectors {
        let reading = self.unit.reading();
        self.temperatures.note(&reading);
        let measured = self.set.apply(&reading, &self.temperatures);
        self.monitor.step(&self.set, &reading, &measured, PERIOD_S as f32)
    }

    /// Axes that are held to be at fault.
    fn accused(&self) -> Channels {
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

/// Onsets of accusations and of "not isolable" in `cycles` of a healthy unit, and cycles with a gated value.
fn false_alarms(unit: Unit, cycles: u64, set: Set) -> (u32, u32, u32) {
    let mut flown = Flown::with(unit, set);
    let (mut accused, mut undecided) = (0, false);
    let mut count = (0, 0, 0);
    for _ in 0..cycles {
        let health = flown.step().health;
        let now = flown.accused().0;
        let is_undecided = health.0 & UNDECIDED != 0;
        if std::env::var("SHOW").is_ok() && (now & !accused != 0 || is_undecided && !undecided) {
            println!("  {:.1} s: {now:07X} {:08X}", flown.unit.now_s(), health.0);
        }
        count.0 += (now & !accused).count_ones();
        count.1 += u32::from(is_undecided && !undecided);
        count.2 += u32::from(health.unused_channels().0 & !now != 0);
        (accused, undecided) = (now, is_undecided);
    }
    count
}

#[test]
fn healthy_units_raise_at_most_one_alarm_in_ten_hours() {
    let motions = ["still", "tumble", "rotation-1", "rotation-2", "rate-table", "rocket"];
    for name in motions {
        let source: Arc<dyn TruthSource> = world(name);
        let length_s = source.duration_s().unwrap_or(600.0).min(600.0);
        let cycles = (length_s / PERIOD_S) as u64;
        let runs = (2.0 * 3600.0 / length_s) as u64;
        let mut sum = (0, 0, 0);
        for seed in 0..runs {
            let found = false_alarms(Unit::new(source.clone(), seed, 1.0), cycles, calibrated());
            sum = (sum.0 + found.0, sum.1 + found.1, sum.2 + found.2);
        }
        println!("{name}: {runs} runs of {length_s} s: {sum:?}");
    }
    let _ = NOISE;
    let _ = Ill::Bias(Channel(0), 0.0);
}
