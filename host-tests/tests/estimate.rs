//! The estimation on board: what it finds in flight, and that a host finds the same bits again.

use std::sync::Arc;

use emems::{
    calibration::{Channel, Ranges, Set},
    derived::{self, Derived},
    estimate::Estimator,
    increments::{Force, Increments, forces::READINGS},
    sample::{Kind, Reading, Sample},
    unit::Settings,
};
use host_tests::{Flight, Flown, MS, S, set_words, world};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use twin::{
    environment::Environment,
    host::timing::BOOT,
    motion::{Motion, RotationTest, Still, Tumble},
    plant::Plant,
    run::Fault,
    truth::{Truth, TruthSource},
};

/// A nominal unit with noise and biases, its derived frames on from the first.
fn flight(motion: &str, seed: u64) -> Flight {
    Flight {
        plant: Plant::new(world(motion), seed),
        ..Flight::ideal(world(motion))
    }
    .say(MS, b"G_DL")
}

/// The nominal set of a unit whose parts have no noise: what rounding makes is all that is left.
fn set_without_noise() -> Set {
    let mut set = Set::nominal(Ranges::of(&Settings::NOMINAL));
    let axes = (set.acc.iter_mut()).chain(&mut set.mag).chain(&mut set.gyro);
    axes.for_each(|axis| axis.noise = axis.scale.abs() / 12_f32.sqrt());
    set
}

/// A sensor that repeats itself is frozen, unless its set says that it has no noise to change a code with.
#[test]
fn parts_without_noise_are_believed_when_the_set_says_so() {
    let told = |set: &Set| {
        let flown = Flight::ideal(world("still"))
            .say(MS, b"G_DL")
            .say(S, &set_words(set))
            .say(5 * S, b"G_CL")
            .say(6 * S, b"G_CK")
            .fly(60 * S);
        assert!(flown.replied("G_CL ok"), "{:?}", flown.replies());
        let late = flown.derived.iter().filter(|frame| frame.start_us > 45_000_000);
        late.map(|frame| frame.estimate.triad_nb.is_some()).collect::<Vec<_>>()
    };
    let believed = told(&set_without_noise());
    assert!(
        believed.len() > 50 && believed.iter().all(|found| *found),
        "{believed:?}"
    );
    assert!(
        told(&Set::nominal(Ranges::of(&Settings::NOMINAL)))
            .iter()
            .all(|found| !found)
    );
}

/// Derived frames, each with its packet.
fn pairs(flown: &Flown) -> Vec<(Reading, Derived)> {
    let with_packet = |frame: &Derived| {
        let packet = flown
            .packets
            .iter()
            .find(|(_, reading)| reading.counter == frame.counter)?;
        Some((packet.1, *frame))
    };
    flown.derived.iter().filter_map(with_packet).collect()
}

/// Computes every estimate again, and compares it bit for bit by way of what is sent.
fn assert_reproduced(flown: &Flown, settings: &Settings, least: usize) {
    let pairs = pairs(flown);
    assert!(pairs.len() >= least, "{} frames", pairs.len());
    let mut estimator = Estimator::of(settings);
    for (reading, frame) in pairs {
        let sample = Sample {
            reading,
            start_us: frame.start_us,
            slots_us: frame.slots_us,
        };
        let again = Derived {
            estimate: estimator.step(&sample, &frame.increments),
            ..frame
        };
        assert_eq!(
            derived::encode(&frame),
            derived::encode(&again),
            "cycle {}",
            frame.counter
        );
    }
}

#[test]
fn a_host_reproduces_every_bit_of_the_unit_s_estimate_from_its_telemetry() {
    // The rocket's seconds are those of its spin-up, its spin, and the way back.
    for (motion, seconds) in [("tumble", 60), ("rotation-2", 60), ("rocket", 110)] {
        let flown = flight(motion, 7).fly(seconds * S);
        assert_reproduced(&flown, &Settings::NOMINAL, 5 * seconds as usize - 10);
        let attitudes = flown.derived.iter().filter(|frame| frame.estimate.q_nb.is_some());
        assert!(attitudes.count() > 5 * seconds as usize - 20, "{motion}");
    }
}

#[test]
fn at_fifty_hertz_no_packet_is_lost_and_frames_come_as_the_line_has_room() {
    const PERIOD_MS: u64 = 20;
    let settings = Settings {
        period_ms: PERIOD_MS,
        ..Settings::NOMINAL
    };
    let flown = Flight {
        settings,
        ..flight("tumble", 7)
    }
    .fly(20 * S);
    assert!(flown.packets.len() > 970, "{} packets", flown.packets.len());
    for pair in flown.packets.windows(2) {
        assert_eq!(pair[1].1.counter, pair[0].1.counter + 1);
    }
    // 902 bytes take 78.3 ms, and 6.4 ms of 20 are free beside the packet: one frame in thirteen cycles.
    for pair in flown.derived.windows(2) {
        assert_eq!(pair[1].counter, pair[0].counter + 13);
    }
    let last = flown.derived.last().expect("frames");
    let truth = Tumble::new().at((last.increments.end_us as f64 * 1e3 + BOOT as f64) * 1e-9);
    let found = attitude(last.estimate.q_nb.expect("an attitude"));
    assert!(
        found.angle_to(&truth.attitude.q_nb).to_degrees() < TUMBLING_DEG,
        "{last:?}"
    );
}

/// \[deg\] of the whole attitude after ten seconds of tumbling: the clocks of the parts are worth milliseconds, and that at
/// 130 deg/s.
const TUMBLING_DEG: f64 = 2.0;

fn attitude(parts: [f32; 4]) -> UnitQuaternion<f64> {
    let [w, x, y, z] = parts.map(f64::from);
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// Mean and standard deviation of an error about each axis of b.
#[derive(Default)]
struct Errors(Vec<Vector3<f64>>);

impl Errors {
    fn mean(&self) -> Vector3<f64> {
        self.0.iter().sum::<Vector3<f64>>() / self.0.len() as f64
    }

    fn sd(&self) -> Vector3<f64> {
        let mean = self.mean();
        let squares = self.0.iter().map(|error| (error - mean).map(|part| part * part));
        (squares.sum::<Vector3<f64>>() / self.0.len() as f64).map(f64::sqrt)
    }

    /// In the thesis' order: x_e is down, y_e right, z_e forward.
    fn in_e(&self) -> String {
        let (mean, sd) = (self.mean(), self.sd());
        format!(
            "x_e {:7.3} {:6.3}   y_e {:7.3} {:6.3}   z_e {:7.3} {:6.3}",
            mean.z, sd.z, mean.y, sd.y, mean.x, sd.x
        )
    }
}

/// \[deg\] what no component of the filter's error may reach on average, or scatter by: half a degree of magnetometer bias
/// (0.1 uT of 18 over four plates is 0.2), accelerometer bias and the filter's own noise.
const ATTITUDE_DEG: f64 = 0.5;
/// [deg/s] the same of the rate: biases of 0.0015 rad/s on four gyros, and 12.5 ms of lag in turns of 28 deg/s2.
const RATE_DEG_S: f64 = 0.6;

/// Chapter 6 of the thesis: error of the rate, mean and standard deviation in deg/s about x_e, y_e, z_e.
const THESIS_RATES: [&str; 2] = [
    "x_e  -0.186  1.625   y_e   0.180  2.372   z_e   0.129  1.444",
    "x_e  -0.211  1.583   y_e   0.050  1.786   z_e   0.172  2.088",
];

#[test]
fn both_rotation_tests_of_chapter_6_are_followed_to_half_a_degree() {
    for (number, motion) in [RotationTest::first(), RotationTest::second()].into_iter().enumerate() {
        let name = ["rotation-1", "rotation-2"][number];
        let seconds = motion.duration_s().expect("it ends") as u64;
        let flown = flight(name, 7).fly(seconds * S);
        let (mut rate, mut triad, mut kalman) = (Errors::default(), Errors::default(), Errors::default());
        let earth_n = Environment::laboratory().earth_rate_n();
        for frame in &flown.derived {
            let at = |us: u64| motion.at((us as f64 * 1e3 + BOOT as f64) * 1e-9).attitude;
            let error = |parts: [f32; 4], truth: UnitQuaternion<f64>| {
                (truth.inverse() * attitude(parts)).scaled_axis().map(f64::to_degrees)
            };
            // Gyros are read some 3 ms into the cycle, accelerometers and magnetometers half a millisecond and two.
            let now = at(frame.start_us + u64::from(frame.slots_us[9]));
            let rate_b = now.rate_nb_b + now.q_nb.inverse() * earth_n;
            let found_b = Vector3::from(frame.estimate.rate_b.map(f64::from));
            rate.0.push((found_b - rate_b).map(f64::to_degrees));
            let seen = at(frame.start_us + u64::from(frame.slots_us[4]));
            triad
                .0
                .extend(frame.estimate.triad_nb.map(|parts| error(parts, seen.q_nb)));
            let end = at(frame.increments.end_us);
            kalman.0.extend(frame.estimate.q_nb.map(|parts| error(parts, end.q_nb)));
        }
        println!("test {} mean, sd    rate [deg/s]", number + 1);
        println!("  thesis, LMS EC      {}", THESIS_RATES[number]);
        println!("  twin, MT            {}", rate.in_e());
        println!("                      attitude [deg]; the thesis prints none by axis");
        println!("  twin, TRIAD         {}", triad.in_e());
        println!("  twin, Kalman filter {}", kalman.in_e());
        assert!(kalman.0.len() + 10 > flown.derived.len());
        assert!(kalman.mean().amax() < ATTITUDE_DEG && kalman.sd().amax() < ATTITUDE_DEG);
        assert!(rate.mean().amax() < RATE_DEG_S && rate.sd().amax() < RATE_DEG_S);
        assert!(kalman.sd().amax() < triad.sd().amax(), "the filter is the smoother");
    }
}

/// Level and facing north, and shaken along north from 20 s on: at 5 Hz one sample a packet sees 4.95 Hz as 0.05.
struct Shaken(Arc<dyn TruthSource>);

impl TruthSource for Shaken {
    fn at(&self, t_s: f64) -> Truth {
        let mut truth = self.0.at(t_s);
        if t_s > 20.0 {
            truth.force_b.x += 3.0 * (std::f64::consts::TAU * 4.95 * t_s).sin();
        }
        truth
    }

    fn duration_s(&self) -> Option<f64> {
        self.0.duration_s()
    }
}

#[test]
fn shaking_faster_than_the_packets_is_no_tilt() {
    let shaken = Shaken(world("still"));
    let truth_nb = Still::level().attitude.q_nb;
    let flown = Flight {
        plant: Plant::new(Arc::new(shaken), 7),
        ..Flight::ideal(world("still"))
    }
    .say(MS, b"G_DL")
    .fly(90 * S);
    assert_reproduced(&flown, &Settings::NOMINAL, 440);
    // The same cycles as packets alone have them.
    let mut alone = Estimator::of(&Settings::NOMINAL);
    let (mut as_read, mut by_packets) = (0.0_f64, 0.0_f64);
    for (reading, frame) in pairs(&flown) {
        assert!(frame.counter < 2 || !frame.increments.forces.iter().any(|force| force.is_none()));
        let sample = Sample {
            reading,
            start_us: frame.start_us,
            slots_us: frame.slots_us,
        };
        let increments = Increments {
            forces: [Force::NONE; READINGS],
            ..frame.increments
        };
        let q_nb = alone.step(&sample, &increments).q_nb;
        if frame.start_us > 30_000_000 {
            let off = |parts: Option<[f32; 4]>| attitude(parts.expect("an attitude")).angle_to(&truth_nb).to_degrees();
            as_read = as_read.max(off(frame.estimate.q_nb));
            by_packets = by_packets.max(off(q_nb));
        }
    }
    println!("at most {as_read:.2} deg, by packets alone {by_packets:.2} deg");
    assert!(
        as_read < 3.0 * ATTITUDE_DEG && by_packets > 10.0 * as_read,
        "{as_read} {by_packets}"
    );
}

#[test]
fn a_dead_plate_is_in_the_health_word_and_costs_no_attitude() {
    // Slots of plate 2: accelerometer, magnetometer, gyro.
    let flight = [1, 5, 9].iter().fold(flight("rotation-1", 3), |flight, slot| {
        flight.fault(20 * S, Fault::Silent(*slot))
    });
    let flown = flight.fly(60 * S);
    assert_reproduced(&flown, &Settings::NOMINAL, 290);
    let last = flown.derived.last().expect("frames");
    for channel in [
        Channel::of(Kind::Accelerometer, 3),
        Channel::of(Kind::Magnetometer, 5),
        Channel::of(Kind::Gyro, 1),
    ] {
        assert!(!last.estimate.sensors.uses(channel), "{channel}");
    }
    assert!(last.estimate.sensors.uses(Channel::of(Kind::Gyro, 0)));
    let truth = RotationTest::first().at((last.increments.end_us as f64 * 1e3 + BOOT as f64) * 1e-9);
    let found = attitude(last.estimate.q_nb.expect("an attitude"));
    assert!(found.angle_to(&truth.attitude.q_nb).to_degrees() < 3.0 * ATTITUDE_DEG);
}
