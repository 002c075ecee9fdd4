//! One unit flown through a motion on the host board, and what the estimation makes of it with a parameter set.
//!
//! In: a motion in the laboratory and the unit's seed. Out: its cycles, and by each set an [`Estimate`] a cycle; by MT that
//! is what the unit itself sent, bit for bit.

use std::sync::Arc;

use emems::{
    attitude::from_parts,
    calibration::Set,
    estimate::{Estimate, Estimator},
    geometry::frame_e::mirror_e_b,
    unit::Settings,
};
use logs::cycles::{Cycle, Cycles};
use nalgebra::{UnitQuaternion, Vector3};
use packets::stream::{Bytes5To8, Decoder};
use twin::{
    environment::{Environment, World},
    host::{self, timing::BOOT},
    motion::{Motion, RotationTest},
    part::Nanos,
    plant::Plant,
    run::{Bench, Flow},
};

/// \[ns\] a second.
const S: f64 = 1e9;

/// \[s\] from one rest to the next, and how long a rest lasts, of which half a second at its ends is not looked at.
const TURN_AND_REST_S: f64 = 7.0;
const REST_S: f64 = 5.0;
const MARGIN_S: f64 = 0.5;

/// Hears the telemetry line, and asks for derived frames.
struct Listener {
    decoder: Decoder,
    cycles: Cycles,
    heard: Vec<Cycle>,
    asked: bool,
}

impl Bench for Listener {
    fn telemetry(&mut self, _at: Nanos, bytes: &[u8]) {
        for item in self.decoder.push(bytes) {
            self.heard.extend(self.cycles.take(&item));
        }
    }

    fn umbilical(&mut self, _at: Nanos, _bytes: &[u8]) {}

    fn log(&mut self, _at: Nanos, _line: &str) {}

    fn commands(&mut self, _now: Nanos) -> Vec<u8> {
        if std::mem::replace(&mut self.asked, true) {
            return Vec::new();
        }
        b"G_DL".to_vec()
    }

    fn advanced(&mut self, _now: Nanos) -> Flow {
        Flow::Continue
    }
}

/// The cycles of the unit of this seed through a motion in the laboratory, from power-on to the motion's end.
pub fn cycles(motion: impl Motion + 'static, seed: u64) -> Vec<Cycle> {
    let duration = (motion.duration_s().unwrap_or_default() * S) as Nanos;
    let environment = Environment::laboratory();
    let world = Arc::new(World { motion, environment });
    let mut listener = Listener {
        decoder: Decoder::new(Bytes5To8::Errors),
        cycles: Cycles::new(Settings::NOMINAL),
        heard: Vec::new(),
        asked: false,
    };
    let plant = Plant::new(world, seed);
    host::fly(plant, Settings::NOMINAL, &[], duration, &mut listener);
    listener.heard
}

/// \[s\] since power-on at an instant of the unit's clock.
pub fn t_s(us: u64) -> f64 {
    (us as f64 * 1e3 + BOOT as f64) * 1e-9
}

/// Errors about the axes of b.
#[derive(Default)]
pub struct Errors(Vec<Vector3<f64>>);

impl Errors {
    /// Mean and standard deviation about each axis of b.
    pub fn mean_sd(&self) -> [(f64, f64); 3] {
        let count = self.0.len() as f64;
        let mean = self.0.iter().sum::<Vector3<f64>>() / count;
        let squares = self.0.iter().map(|error| (error - mean).map(|part| part * part));
        let sd = (squares.sum::<Vector3<f64>>() / count).map(f64::sqrt);
        [0, 1, 2].map(|axis| (mean[axis], sd[axis]))
    }
}

/// A rotation test, flown.
pub struct Flown {
    motion: RotationTest,
    cycles: Vec<Cycle>,
}

/// A rotation test by one parameter set.
pub struct Estimated<'a> {
    flown: &'a Flown,
    estimates: Vec<Estimate>,
}

impl Flown {
    /// Flies test 1 or 2.
    pub fn of(test: usize, seed: u64) -> Self {
        let motion = if test == 1 {
            RotationTest::first()
        } else {
            RotationTest::second()
        };
        Flown {
            cycles: cycles(motion.clone(), seed),
            motion,
        }
    }

    /// What the estimation that flies makes of it.
    pub fn by(&self, set: Set) -> Estimated<'_> {
        let mut estimator = Estimator::new(set, &Settings::NOMINAL.site);
        let step = |cycle: &Cycle| estimator.step(&cycle.sample, &cycle.increments);
        Estimated {
            flown: self,
            estimates: self.cycles.iter().map(step).collect(),
        }
    }
}

impl Estimated<'_> {
    /// Every cycle with what was made of it.
    fn each(&self) -> impl Iterator<Item = (&Cycle, &Estimate)> {
        self.flown.cycles.iter().zip(&self.estimates)
    }

    /// Whether this is what the unit sent, in every cycle of which it sent something.
    pub fn as_sent(&self) -> bool {
        let mut sent = self
            .each()
            .filter_map(|(cycle, own)| Some((&cycle.sent.as_ref()?.estimate, own)));
        sent.all(|(sent, own)| sent == own)
    }

    /// Errors of the rate [deg/s], of TRIAD and of the filter \[deg\].
    pub fn errors(&self) -> [Errors; 3] {
        let (mut rate, mut triad, mut filter) = (Errors::default(), Errors::default(), Errors::default());
        let earth_n = Environment::laboratory().earth_rate_n();
        for (cycle, estimate) in self.each() {
            let at = |us: u64| self.flown.motion.at(t_s(us)).attitude;
            let error = |parts: Option<[f32; 4]>, truth: UnitQuaternion<f64>| {
                let q_nb: UnitQuaternion<f64> = parts.and_then(from_parts)?.cast();
                Some((truth.inverse() * q_nb).scaled_axis().map(f64::to_degrees))
            };
            // Slots 4 and 9 are in the middle of the vectors and of the gyros.
            let slot = |slot: usize| cycle.sample.start_us + u64::from(cycle.sample.slots_us[slot]);
            let now = at(slot(9));
            let rate_b = now.rate_nb_b + now.q_nb.inverse() * earth_n;
            let found_b = Vector3::from(estimate.rate_b.map(f64::from));
            rate.0.push((found_b - rate_b).map(f64::to_degrees));
            triad.0.extend(error(estimate.triad_nb, at(slot(4)).q_nb));
            filter.0.extend(error(estimate.q_nb, at(cycle.increments.end_us).q_nb));
        }
        [rate, triad, filter]
    }

    /// [m/s2] mean specific force in e while at rest after so many turns.
    pub fn force_e(&self, turns: usize) -> Option<Vector3<f64>> {
        let from_s = TURN_AND_REST_S * turns as f64 + MARGIN_S;
        let rest = from_s..from_s + REST_S - 2.0 * MARGIN_S;
        let resting = self
            .each()
            .filter(|(cycle, _)| rest.contains(&t_s(cycle.sample.start_us)));
        let forces: Vec<Vector3<f64>> = resting
            .map(|(_, estimate)| mirror_e_b(estimate.force_b.into()).cast())
            .collect();
        (!forces.is_empty()).then(|| forces.iter().sum::<Vector3<f64>>() / forces.len() as f64)
    }
}
