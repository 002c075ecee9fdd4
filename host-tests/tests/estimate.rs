//! The estimation on board: what it finds in flight, and that a host finds the same bits again.

use emems::{
    derived::{self, Derived},
    estimate::Estimator,
    sample::{Reading, Sample},
    unit::Settings,
};
use host_tests::{Flight, Flown, MS, S, world};
use nalgebra::{Quaternion, UnitQuaternion};
use twin::{
    host::timing::BOOT,
    motion::{Motion, RotationTest},
    plant::Plant,
};

/// A nominal unit with noise and biases, its derived frames on from the first.
fn flight(motion: &str, seed: u64) -> Flight {
    Flight {
        plant: Plant::new(world(motion), seed),
        ..Flight::ideal(world(motion))
    }
    .say(MS, b"G_DL")
}

/// Derived frames, each with its packet.
fn pairs(flown: &Flown) -> Vec<(Reading, Derived)> {
    let with_frame = |(_, reading): &(u64, Reading)| {
        let frame = flown.derived.iter().find(|frame| frame.counter == reading.counter)?;
        Some((*reading, *frame))
    };
    flown.packets.iter().filter_map(with_frame).collect()
}

/// The frames with the estimates that a host computes from them and their packets.
fn replayed(pairs: &[(Reading, Derived)], settings: &Settings) -> Vec<Derived> {
    let mut estimator = Estimator::of(settings);
    let again = |(reading, frame): &(Reading, Derived)| {
        let sample = Sample {
            reading: *reading,
            start_us: frame.start_us,
            slots_us: frame.slots_us,
        };
        Derived {
            estimate: estimator.step(&sample, &frame.increments),
            ..*frame
        }
    };
    pairs.iter().map(again).collect()
}

/// Bit for bit, by way of what is sent.
fn assert_reproduced(flown: &Flown, settings: &Settings, least: usize) {
    let pairs = pairs(flown);
    assert!(pairs.len() >= least, "{} frames", pairs.len());
    for ((_, sent), again) in pairs.iter().zip(replayed(&pairs, settings)) {
        assert_eq!(derived::encode(sent), derived::encode(&again), "cycle {}", sent.counter);
    }
}

#[test]
fn a_host_reproduces_every_bit_of_the_unit_s_estimate_from_its_telemetry() {
    for motion in ["tumble", "rotation-2"] {
        let flown = flight(motion, 7).fly(60 * S);
        assert_reproduced(&flown, &Settings::NOMINAL, 290);
        let attitudes = flown.derived.iter().filter(|frame| frame.estimate.q_nb.is_some());
        assert!(attitudes.count() > 280, "{motion}");
    }
}

fn attitude(parts: [f32; 4]) -> UnitQuaternion<f64> {
    let [w, x, y, z] = parts.map(f64::from);
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

fn probe(motion: &str, seconds: u64) {
    let flown = flight(motion, 7).fly(seconds * S);
    let truth = RotationTest::first();
    let second = RotationTest::second();
    for (n, frame) in flown.derived.iter().enumerate() {
        let c = frame.increments.gyro.map(|g| g.count);
        if frame.increments.covered_us < 195_000 || c != [20; 4] {
            println!(
                "GAP {} {} {c:?}  {:08X} {:08X}",
                frame.counter, frame.increments.covered_us, frame.estimate.sensors.0, frame.health.0
            );
        }
        if n % 1000 == 0 {
            let t_s = (frame.increments.end_us as f64 * 1e3 + BOOT as f64) * 1e-9;
            let q = if motion == "rotation-1" {
                truth.at(t_s)
            } else {
                second.at(t_s)
            }
            .attitude
            .q_nb;
            let err = |p: Option<[f32; 4]>| p.map(|p| (q.inverse() * attitude(p)).scaled_axis().map(f64::to_degrees));
            println!(
                "{t_s:7.3} triad {:?} kalman {:?} sd {:?} bias {:?} health {:08X}",
                err(frame.estimate.triad_nb).map(|e| format!("{:6.2} {:6.2} {:6.2}", e.x, e.y, e.z)),
                err(frame.estimate.q_nb).map(|e| format!("{:6.2} {:6.2} {:6.2}", e.x, e.y, e.z)),
                [0, 3, 5].map(|k| frame.estimate.covariance_n[k].sqrt().to_degrees()),
                frame.estimate.bias_b.map(|b| b.to_degrees()),
                frame.estimate.sensors.0
            );
        }
    }
}

#[test]
fn probe_it() {
    probe("rotation-1", 100);
    probe("rotation-2", 80);
}
