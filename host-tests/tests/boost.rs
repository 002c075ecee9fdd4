//! The attitude through a boost, smooth and spoilt: it says what it knows, and is right about it.

use std::{f64::consts::TAU, sync::Arc};

use emems::{
    calibration::{Ranges, Set},
    derived::Derived,
    estimate::{Estimator, KEPT_BYTES},
    site::Site,
    unit::Settings,
};
use host_tests::{Flight, MS, S};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use twin::{
    environment::{Environment, World},
    host::timing::BOOT,
    motion::{Course, Motion, Pose, Profile, SoundingRocket},
    part::Nanos,
    run::Fault,
    truth::{Truth, TruthSource},
};

/// \[s\] lift-off.
const PAD_S: f64 = 30.0;

fn rocket(course: Course) -> World<SoundingRocket> {
    let environment = Environment::alcantara();
    World {
        motion: SoundingRocket::on(course, PAD_S, environment.gravity),
        environment,
    }
}

fn flight(world: impl TruthSource + 'static) -> Flight {
    Flight::at_alcantara(Arc::new(world))
}

/// Over a stretch of a flight.
#[derive(Debug)]
struct Met {
    /// \[deg\] largest error.
    worst_deg: f64,
    /// \[deg\] root mean square of the error.
    rms_deg: f64,
    /// \[deg\] the same of what was said.
    said_deg: f64,
    /// \[1\] mean of the squared error in its own covariance, a degree of freedom.
    nees: f64,
}

fn met(frames: &[Derived], motion: &impl Motion, from_s: f64, to_s: f64) -> Met {
    met_since(BOOT, frames, motion, from_s, to_s)
}

/// Of frames whose clock started then \[ns\].
fn met_since(started: Nanos, frames: &[Derived], motion: &impl Motion, from_s: f64, to_s: f64) -> Met {
    let (mut count, mut worst, mut square, mut said, mut nees) = (0.0, 0.0_f64, 0.0, 0.0, 0.0);
    for frame in frames {
        let t_s = (frame.increments.end_us as f64 * 1e3 + started as f64) * 1e-9;
        if !(from_s..to_s).contains(&t_s) {
            continue;
        }
        let [w, x, y, z] = frame.estimate.q_nb.expect("an attitude").map(f64::from);
        let found = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let error_n: Vector3<f64> = (motion.at(t_s).attitude.q_nb * found.inverse()).scaled_axis();
        let [nn, ne, nd, ee, ed, dd] = frame.estimate.covariance_n.map(f64::from);
        let covariance_n = Matrix3::new(nn, ne, nd, ne, ee, ed, nd, ed, dd);
        let inverse = covariance_n.try_inverse().expect("a covariance");
        count += 1.0;
        worst = worst.max(error_n.norm());
        square += error_n.norm_squared();
        said += covariance_n.trace();
        nees += error_n.dot(&(inverse * error_n)) / 3.0;
    }
    assert!(count > 4.0 * (to_s - from_s), "{count} attitudes");
    Met {
        worst_deg: worst.to_degrees(),
        rms_deg: f64::sqrt(square / count).to_degrees(),
        said_deg: f64::sqrt(said / count).to_degrees(),
        nees: nees / count,
    }
}

/// Most that the mean NEES of one flight's stretch may be: errors last, so that a stretch is a few independent ones of three
/// degrees of freedom; 3.8 is chi-squared's 99 % of one.
const HONEST: f64 = 3.8;

/// \[deg\] what the attitude through the spin may be off by.
const SPINNING_DEG: f64 = 1.0;

fn is_right(name: &str, met: &Met, within_deg: f64) {
    println!("{name}: {met:?}");
    let near = met.rms_deg < within_deg && met.worst_deg < 3.0 * within_deg;
    assert!(near && met.nees < HONEST, "{name}: {met:?}");
}

#[test]
fn three_turns_a_second_cost_a_degree_and_not_the_attitude() {
    let world = rocket(Course::NOMINAL);
    let motion = world.motion.clone();
    let flown = flight(world).fly(150 * S);
    is_right("boost", &met(&flown.derived, &motion, 36.0, 83.0), SPINNING_DEG);
    is_right("yo-yo", &met(&flown.derived, &motion, 83.0, 97.0), SPINNING_DEG);
    let after = met(&flown.derived, &motion, 97.0, 150.0);
    is_right("micro-gravity", &after, 1.5);
    assert!(after.said_deg < 3.0, "{after:?}");
}

#[test]
fn packets_and_derived_frames_hold_all_that_the_boost_was_estimated_from() {
    let flown = flight(rocket(Course::NOMINAL)).fly(60 * S);
    let settings = Settings {
        site: Site::ALCANTARA,
        ..Settings::NOMINAL
    };
    let mut estimator = Estimator::of(&settings);
    assert!(flown.derived.len() > 290, "{} frames", flown.derived.len());
    for (sample, frame) in flown.sampled() {
        let again = estimator.step(&sample, &frame.increments);
        assert_eq!(again, frame.estimate, "packet {}", frame.counter);
    }
}

#[test]
fn six_turns_a_second_are_followed_too() {
    let world = rocket(Course {
        turns_per_s: 6.0,
        ..Course::NOMINAL
    });
    let motion = world.motion.clone();
    let flown = flight(world).fly(110 * S);
    is_right(
        "six turns",
        &met(&flown.derived, &motion, 70.0, 83.0),
        2.0 * SPINNING_DEG,
    );
    is_right("after", &met(&flown.derived, &motion, 97.0, 110.0), 2.0 * SPINNING_DEG);
}

#[test]
fn a_rocket_that_is_never_despun_keeps_its_attitude() {
    let world = rocket(Course {
        yo_yo: false,
        ..Course::NOMINAL
    });
    let motion = world.motion.clone();
    let flown = flight(world).fly(240 * S);
    is_right("not despun", &met(&flown.derived, &motion, 200.0, 240.0), SPINNING_DEG);
}

/// A rocket whose last motor is lit after the yo-yo, in free fall, and spins it up again.
#[derive(Clone)]
struct Relit {
    first: SoundingRocket,
    /// \[rad\] about x_b, and [m/s2] along it.
    roll: Profile,
    thrust: Profile,
}

/// \[s\] the motor is lit, long after the filter of slow motion has the attitude again, and is burnt out; the rocket is despun.
const RELIT_S: f64 = 150.0;
const BURNT_OUT_S: f64 = 180.0;
const DESPUN_S: f64 = 200.0;

impl Relit {
    /// As the second stage does: 3.2 g within 0.6 s, and three turns a second at half a turn a second in a second.
    fn new(gravity: f64) -> Self {
        let spun = Profile::from_rest(0.0).coast(RELIT_S).ramp_to_rate(3.0 * TAU, 6.0);
        let roll = spun.clone().coast(DESPUN_S - spun.end_s()).ramp_to_rate(0.0, 2.0);
        let lit = Profile::from_rest(0.0).coast(RELIT_S).move_to(3.2 * 9.806_65, 0.6);
        Relit {
            first: SoundingRocket::new(PAD_S, gravity),
            roll,
            thrust: lit.clone().coast(BURNT_OUT_S - lit.end_s()).move_to(0.0, 1.0),
        }
    }
}

impl Motion for Relit {
    fn at(&self, t_s: f64) -> Pose {
        let pose = self.first.at(t_s);
        let attitude = pose.attitude.rolled(self.roll.at(t_s));
        let thrust_n = attitude.q_nb * Vector3::new(self.thrust.at(t_s).value, 0.0, 0.0);
        Pose {
            attitude,
            acc_n: pose.acc_n + thrust_n,
            micro_g: pose.micro_g && t_s < RELIT_S,
            ..pose
        }
    }

    fn duration_s(&self) -> Option<f64> {
        self.first.duration_s()
    }
}

#[test]
fn a_second_ignition_after_the_coast_is_followed_as_the_first() {
    let environment = Environment::alcantara();
    let motion = Relit::new(environment.gravity);
    let world = World {
        motion: motion.clone(),
        environment,
    };
    let flown = flight(world).fly(250 * S);
    let met = |from_s, to_s| met(&flown.derived, &motion, from_s, to_s);
    // The motor is lit in slow motion: the attitude is that of micro-gravity, and stays so.
    let before = met(140.0, RELIT_S);
    is_right("before it is lit", &before, 1.5);
    is_right("spun up again", &met(RELIT_S, 156.0), 1.5);
    is_right("burning", &met(156.0, BURNT_OUT_S), 1.5);
    is_right("burnt out", &met(BURNT_OUT_S, DESPUN_S), 1.5);
    is_right("despun", &met(DESPUN_S, 250.0), 2.0);
}

/// A vehicle whose lift-off line is broken.
struct Unannounced(World<SoundingRocket>);

impl TruthSource for Unannounced {
    fn at(&self, t_s: f64) -> Truth {
        Truth {
            lift_off: false,
            ..self.0.at(t_s)
        }
    }

    fn duration_s(&self) -> Option<f64> {
        self.0.duration_s()
    }
}

#[test]
fn without_the_lift_off_line_the_spin_itself_says_so() {
    let world = rocket(Course::NOMINAL);
    let motion = world.motion.clone();
    let flown = flight(Unannounced(world)).fly(100 * S);
    is_right(
        "no lift-off line",
        &met(&flown.derived, &motion, 50.0, 83.0),
        SPINNING_DEG,
    );
}

#[test]
fn a_plate_that_dies_in_the_boost_costs_accuracy_and_no_attitude() {
    // Slots of plate 2: accelerometer, magnetometer, gyro.
    let world = rocket(Course::NOMINAL);
    let motion = world.motion.clone();
    let flight = [1, 5, 9]
        .into_iter()
        .fold(flight(world), |flight, slot| flight.fault(50 * S, Fault::Silent(slot)));
    let flown = flight.fly(110 * S);
    is_right("a dead plate", &met(&flown.derived, &motion, 50.0, 83.0), SPINNING_DEG);
    is_right("after", &met(&flown.derived, &motion, 97.0, 110.0), SPINNING_DEG);
}

#[test]
fn a_reset_in_the_boost_costs_two_packets_and_not_the_attitude() {
    // At once; after a panic; and by the watchdog, half a second of whose time nobody knows: nine radians of spin.
    // In that second the cone is not seen either: what is said is 4.6 deg.
    for (strikes, fault, settled_s, within_deg) in [
        (60 * S + 77 * MS, Fault::Reset, 0.0, SPINNING_DEG),
        (66 * S + 150 * MS, Fault::Panic, 0.0, SPINNING_DEG),
        (62 * S, Fault::DmaHung, 2.0, 9.0),
    ] {
        let world = rocket(Course::NOMINAL);
        let motion = world.motion.clone();
        let flown = flight(world).fault(strikes, fault).fly(110 * S);
        let [(struck, _)] = flown.report.resets[..] else {
            panic!("{:?}", flown.report.resets)
        };
        let is_new = |pair: &[Derived]| pair[1].start_us < pair[0].start_us;
        let reset = flown.derived.windows(2).position(is_new).expect("a reset") + 1;
        let (before, after) = flown.derived.split_at(reset);
        let without = after.iter().take_while(|frame| frame.estimate.q_nb.is_none()).count();
        let lost = after[without].counter - before[reset - 1].counter - 1;
        assert!(without as u16 + lost <= 2, "{fault:?}: {without} without, {lost} lost");
        let met = |from_s, to_s| met_since(struck + BOOT, after, &motion, from_s, to_s);
        let from_s = struck as f64 * 1e-9 + 0.7 + settled_s;
        is_right("after a reset", &met(from_s, 83.0), within_deg);
        is_right("in micro-gravity", &met(97.0, 110.0), within_deg);
    }
}

/// U9: a bit of either filter has flipped: on the pad, in the spin, in the yo-yo and in micro-gravity. What was kept after the latest
/// step takes its place, in the same packet.
#[test]
fn after_a_flipped_bit_in_the_boost_the_attitude_goes_on_from_its_copy() {
    let world = rocket(Course::NOMINAL);
    let motion = world.motion.clone();
    let flown = flight(world).fly(130 * S);
    let settings = Settings {
        site: Site::ALCANTARA,
        ..Settings::NOMINAL
    };
    let set = Set::compiled_in(Ranges::of(&settings));
    let (mut estimator, mut kept) = (Estimator::of(&settings), [0; KEPT_BYTES]);
    let mut flips_s = vec![20.0, 33.0, 40.0, 50.0, 60.3, 84.0, 90.1, 105.0];
    let mut frames = Vec::new();
    for (sample, frame) in flown.sampled() {
        let struck = flips_s
            .first()
            .is_some_and(|flip_s| frame.start_us as f64 * 1e-6 > *flip_s);
        if struck {
            flips_s.remove(0);
            estimator.restore(&set, &settings.site, Some(&kept));
        }
        let estimate = estimator.step(&sample, &frame.increments);
        estimator.keep(&mut kept);
        frames.push(Derived { estimate, ..*frame });
        assert!(!struck || estimate.q_nb.is_some(), "packet {}", frame.counter);
    }
    assert!(flips_s.is_empty());
    is_right("pad", &met(&frames, &motion, 20.0, 30.0), SPINNING_DEG);
    is_right("boost", &met(&frames, &motion, 36.0, 83.0), SPINNING_DEG);
    is_right("yo-yo", &met(&frames, &motion, 83.0, 97.0), SPINNING_DEG);
    is_right("micro-gravity", &met(&frames, &motion, 97.0, 130.0), 1.5);
}

/// Gyros that stand at their stops from the tenth second on, on a pad that does not move.
struct Stuck(World<SoundingRocket>);

impl TruthSource for Stuck {
    fn at(&self, t_s: f64) -> Truth {
        let mut truth = self.0.at(t_s);
        if t_s > 10.0 {
            // Gyros feel it; the accelerometers' places do too, as when a supply fails that both share.
            truth.rate_b = Vector3::new(9.0, 0.0, 9.0);
        }
        truth
    }

    fn duration_s(&self) -> Option<f64> {
        self.0.duration_s()
    }
}

#[test]
fn gyros_at_their_stops_on_the_pad_make_it_say_that_it_does_not_know() {
    let world = rocket(Course::NOMINAL);
    let motion = world.motion.clone();
    let flown = flight(Stuck(world)).fly(29 * S);
    let last = flown.derived.last().expect("frames");
    if last.estimate.q_nb.is_some() {
        let met = met(&flown.derived[flown.derived.len() - 40..], &motion, 21.0, 28.0);
        println!("{met:?}");
        assert!(met.nees < HONEST, "{met:?}");
    }
}
