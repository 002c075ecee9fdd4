//! Chapter 6 of the thesis beside ours: both rotation tests, flown by the twin on the host board and estimated on board.
//!
//! In: nothing but a seed. Out: tables. The unit is the nominal one with noise and biases and parameters by MT; what it
//! sends is held against the motion that was flown. Rates: mean and standard deviation of the error about the thesis' axes
//! (sections 6.2.1 and 6.3.1, against the Spatial). Attitude: the same of TRIAD and of the filter; the thesis prints none
//! by axis. Specific force in the poses of Tables 6.2 and 6.4, whose figures are for 9.8 m/s2: two are truncated, and
//! y_e of C in Table 6.4 takes 9.8 where 8.02 belongs.
//!
//! Frame e appears in what is printed only, through [`mirror_e_b`].

use std::sync::Arc;

use emems::{attitude::from_parts, geometry::frame_e::mirror_e_b, unit::Settings};
use nalgebra::{UnitQuaternion, Vector3};
use packets::stream::{Bytes5To8, Decoder};
use twin::{
    environment::Environment,
    host::{self, timing::BOOT},
    motion::{self, Motion, RotationTest},
    part::Nanos,
    plant::Plant,
    run::{Bench, Flow},
    truth::TruthSource,
};

use crate::log::{Cycle, Cycles};

/// [ns] a second.
const S: Nanos = 1_000_000_000;

/// What the thesis prints: error of the rate by LMS EC, mean and standard deviation about x_e, y_e, z_e [deg/s].
const RATES: [[(f64, f64); 3]; 2] = [
    [(-0.1864, 1.6247), (0.1797, 2.3719), (0.1287, 1.4435)],
    [(-0.2108, 1.5829), (0.0504, 1.7855), (0.1718, 2.0876)],
];

/// A pose of Tables 6.2 and 6.4.
struct Pose {
    name: &'static str,
    /// Turns of the test before it.
    after: usize,
    /// [m/s2] as printed, in e.
    printed: [f64; 3],
    /// [m/s2] with every digit, in e.
    exact: [f64; 3],
}

const fn pose(name: &'static str, after: usize, printed: [f64; 3], exact: [f64; 3]) -> Pose {
    Pose {
        name,
        after,
        printed,
        exact,
    }
}

const TEST_1: [Pose; 4] = [
    pose("A", 1, [-8.48, 0.0, 4.9], [-8.487, 0.0, 4.9]),
    pose("B", 3, [-8.48, 0.0, -4.9], [-8.487, 0.0, -4.9]),
    pose("C", 5, [-8.02, -5.62, 0.0], [-8.0277, -5.6210, 0.0]),
    pose("D", 6, [-9.8, 0.0, 0.0], [-9.8, 0.0, 0.0]),
];
const TEST_2: [Pose; 3] = [
    pose("A", 1, [-9.8, 0.0, 0.0], [-9.8, 0.0, 0.0]),
    pose("B", 2, [-8.02, 0.0, 5.62], [-8.0277, 0.0, 5.6210]),
    pose("C", 3, [-5.67, -6.92, 5.62], [-5.6764, -5.6764, 5.6210]),
];

/// [s] from one rest to the next, and how long a rest lasts, of which half a second at its ends is not looked at.
const TURN_AND_REST_S: f64 = 7.0;
const REST_S: f64 = 5.0;
const MARGIN_S: f64 = 0.5;

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

impl Flown {
    /// Flies test 1 or 2.
    pub fn of(test: usize, seed: u64) -> Self {
        let motion = if test == 1 {
            RotationTest::first()
        } else {
            RotationTest::second()
        };
        let seconds = motion.duration_s().unwrap_or_default() as u64;
        let world: Option<Arc<dyn TruthSource>> = motion::by_name(&format!("rotation-{test}")).map(Into::into);
        let mut listener = Listener {
            decoder: Decoder::new(Bytes5To8::Errors),
            cycles: Cycles::new(Settings::NOMINAL),
            heard: Vec::new(),
            asked: false,
        };
        if let Some(world) = world {
            host::fly(
                Plant::new(world, seed),
                Settings::NOMINAL,
                &[],
                seconds * S,
                &mut listener,
            );
        }
        Flown {
            motion,
            cycles: listener.heard,
        }
    }

    /// [s] of the motion at an instant of the unit's clock.
    fn t_s(us: u64) -> f64 {
        (us as f64 * 1e3 + BOOT as f64) * 1e-9
    }

    /// Errors of the rate [deg/s], of TRIAD and of the filter [deg].
    pub fn errors(&self) -> [Errors; 3] {
        let (mut rate, mut triad, mut filter) = (Errors::default(), Errors::default(), Errors::default());
        let earth_n = Environment::laboratory().earth_rate_n();
        for cycle in &self.cycles {
            let Some(sent) = &cycle.sent else { continue };
            let at = |us: u64| self.motion.at(Self::t_s(us)).attitude;
            let error = |parts: Option<[f32; 4]>, truth: UnitQuaternion<f64>| {
                let q_nb: UnitQuaternion<f64> = parts.and_then(from_parts)?.cast();
                Some((truth.inverse() * q_nb).scaled_axis().map(f64::to_degrees))
            };
            // Slots 4 and 9 are in the middle of the vectors and of the gyros.
            let slot = |slot: usize| sent.start_us + u64::from(sent.slots_us[slot]);
            let now = at(slot(9));
            let rate_b = now.rate_nb_b + now.q_nb.inverse() * earth_n;
            let found_b = Vector3::from(sent.estimate.rate_b.map(f64::from));
            rate.0.push((found_b - rate_b).map(f64::to_degrees));
            triad.0.extend(error(sent.estimate.triad_nb, at(slot(4)).q_nb));
            filter
                .0
                .extend(error(sent.estimate.q_nb, at(sent.increments.end_us).q_nb));
        }
        [rate, triad, filter]
    }

    /// [m/s2] mean specific force in e while at rest after so many turns.
    fn force_e(&self, turns: usize) -> Option<Vector3<f64>> {
        let from_s = TURN_AND_REST_S * turns as f64 + MARGIN_S;
        let rest = from_s..from_s + REST_S - 2.0 * MARGIN_S;
        let sent = self.cycles.iter().filter_map(|cycle| cycle.sent.as_ref());
        let resting: Vec<Vector3<f64>> = sent
            .filter(|sent| rest.contains(&Self::t_s(sent.start_us)))
            .map(|sent| mirror_e_b(sent.estimate.force_b.into()).cast())
            .collect();
        (!resting.is_empty()).then(|| resting.iter().sum::<Vector3<f64>>() / resting.len() as f64)
    }
}

/// Both tests as text.
pub fn tables(seed: u64) -> String {
    let mut text = String::new();
    for (test, poses) in [(1, &TEST_1[..]), (2, &TEST_2[..])] {
        let flown = Flown::of(test, seed);
        let [rate, triad, filter] = flown.errors().map(|errors| errors.mean_sd());
        text += &format!("Rotation test {test}: mean and sd of the error      x_e              y_e              z_e\n");
        let mut line = |name: &str, in_b: [(f64, f64); 3]| {
            let cells = [2, 1, 0].map(|axis| format!("{:8.3} {:6.3}  ", in_b[axis].0, in_b[axis].1));
            text += &format!("  {name:<38}{}\n", cells.concat());
        };
        // Printed about x_e, y_e, z_e, which are z, y, x of b.
        let [x_e, y_e, z_e] = RATES[test - 1];
        line("rate, thesis, LMS EC [deg/s]", [z_e, y_e, x_e]);
        line("rate, twin, MT [deg/s]", rate);
        line("attitude, twin, TRIAD [deg]", triad);
        line("attitude, twin, filter [deg]", filter);
        text += &format!(
            "Table 6.{}: specific force [m/s2]       printed                exact, 9.8        twin, MT, {:.4}\n",
            2 * test,
            Settings::NOMINAL.site.gravity
        );
        for pose in poses {
            let three = |v: [f64; 3]| format!("{:7.2} {:6.2} {:6.2}", v[0], v[1], v[2]);
            let twin = flown
                .force_e(pose.after)
                .map_or("-".into(), |force_e| three(force_e.into()));
            text += &format!(
                "  {:<30}{}   {}   {twin}\n",
                pose.name,
                three(pose.printed),
                three(pose.exact)
            );
        }
        text += "\n";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// [m/s2] accelerometer biases of the twin (0.02 on an axis, half of it in the mean) and 1.4 parts in 1000 of gravity.
    const FORCE: f64 = 0.05;

    #[test]
    fn the_twin_stands_in_the_poses_of_the_thesis() {
        for (test, poses) in [(1, &TEST_1[..]), (2, &TEST_2[..])] {
            let flown = Flown::of(test, 7);
            for pose in poses {
                let force_e = flown.force_e(pose.after).expect("a rest");
                let off = (force_e - Vector3::from(pose.exact)).amax();
                assert!(off < FORCE, "test {test} {}: {force_e}", pose.name);
            }
        }
    }

    #[test]
    fn what_is_printed_has_every_row() {
        let text = tables(7);
        for row in [
            "rate, thesis",
            "rate, twin",
            "TRIAD",
            "filter",
            "Table 6.2",
            "Table 6.4",
        ] {
            assert!(text.contains(row), "{row} in\n{text}");
        }
    }
}
