//! A unit that is moved by hand before an optical system: a reference that errs more than the unit, and a magnet that is brought
//! and taken away.

use std::fmt::Write;

use crate::written::written;
use gap::{
    diagnose::{Diagnosis, diagnose},
    input::case::Subject,
    null::{model::Model, problem::Problem},
    search::scatter::scatters,
};
use nalgebra::{UnitQuaternion, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

/// \[s\] of the log.
const SECONDS: usize = 120;

/// \[Hz\] of the log, and of the record.
const RATE_HZ: [usize; 2] = [25, 100];

/// [rad/s] white noise of a gyro, and \[uT\] of a magnetometer.
const NOISE: [f64; 2] = [0.003, 0.3];

/// \[rad\] noise of the optical system: from sample to sample it turns into rates of 0.03 rad/s, ten times a gyro's noise.
const OPTICS_RAD: f64 = 2e-4;

/// \[uT\] field in n.
const FIELD: [f64; 3] = [17.0, 0.3, 41.0];

const CASE: &str = r#"[environment]
latitude_deg = 0.0
field_n_ut = [17.0, 0.3, 41.0]
field_sigma_ut = 0.1
[reference]
attitude_sigma_rad = 0.0005
[windows]
fit = [[0.0, 20.0], [40.0, 60.0], [80.0, 100.0]]
hold = [[20.0, 40.0], [60.0, 80.0], [100.0, 120.0]]
"#;

/// At rest for the first and the last fifteen seconds, where the record holds nothing but its errors.
fn attitude(t_s: f64) -> UnitQuaternion<f64> {
    let rise = |x: f64| x.clamp(0.0, 1.0).powi(3) * (10.0 - 15.0 * x.clamp(0.0, 1.0) + 6.0 * x.clamp(0.0, 1.0).powi(2));
    let moved = rise((t_s - 15.0) / 5.0) * rise((SECONDS as f64 - 15.0 - t_s) / 5.0);
    UnitQuaternion::from_euler_angles(
        moved * 0.8 * (1.9 * t_s).sin(),
        moved * 0.9 * (1.3 * t_s).sin(),
        moved * (1.5 * (0.7 * t_s).sin() + 0.1 * t_s),
    )
}

/// What is seen.
struct Seen {
    case: String,
    /// \[uT\] of a magnet at the magnetometers.
    iron_b: Vector3<f64>,
    /// \[s\] when it is there.
    iron_s: [f64; 2],
    /// \[uT\] that each magnetometer's calibration is off by.
    zero: f64,
    /// How much more each magnetometer scatters than described.
    louder: [f64; 3],
    /// Whether the record has y the other way round.
    is_reversed: bool,
}

impl Default for Seen {
    fn default() -> Self {
        Seen {
            case: CASE.to_owned(),
            iron_b: Vector3::zeros(),
            iron_s: [45.0, 90.0],
            zero: 0.0,
            louder: [1.0; 3],
            is_reversed: false,
        }
    }
}

fn diagnosed(seen: &Seen) -> Diagnosis {
    diagnose(&opened(seen), &[], &|_, _| {})
}

fn opened(seen: &Seen) -> Subject {
    let mut unit = "name = \"three gyros and three magnetometers\"\n".to_owned();
    let axes = ["1.0, 0.0, 0.0", "0.0, 1.0, 0.0", "0.0, 0.0, 1.0"];
    for (sensor, letter, noise) in [("gyro", 'g', NOISE[0]), ("magnetometer", 'm', NOISE[1])] {
        for (axis, name) in axes.iter().zip(["x", "y", "z"]) {
            let _ = write!(
                unit,
                "[[channel]]\nname = \"{letter}{name}\"\nsensor = \"{sensor}\"\ngroup = \"unit\"\naxis_b = [{axis}]\nlsb = 1.0\n\
                 noise_sigma = {noise}\nbias_sigma = {}\nscale_sigma = 0.002\naxis_sigma_rad = 0.002\nrange = [-200.0, 200.0]\n",
                0.3 * noise
            );
        }
    }
    let mut random = Xoshiro256PlusPlus::seed_from_u64(23);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut motion = "t_s,qw,qx,qy,qz\n".to_owned();
    for k in 0..=RATE_HZ[1] * SECONDS {
        let t_s = k as f64 / RATE_HZ[1] as f64;
        let off = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| OPTICS_RAD * normal()));
        let q = attitude(t_s) * off;
        let j = if seen.is_reversed { -q.j } else { q.j };
        let _ = writeln!(motion, "{t_s:.2},{:.9},{:.9},{j:.9},{:.9}", q.w, q.i, q.k);
    }
    let mut measured = "t_s,gx,gy,gz,mx,my,mz\n".to_owned();
    for k in 0..SECONDS * RATE_HZ[0] {
        let t_s = k as f64 / RATE_HZ[0] as f64;
        let q = attitude(t_s);
        let rate_b = (attitude(t_s - 5e-5).inverse() * attitude(t_s + 5e-5)).scaled_axis() / 1e-4;
        let iron_b = if (seen.iron_s[0]..seen.iron_s[1]).contains(&t_s) {
            seen.iron_b
        } else {
            Vector3::zeros()
        };
        let field_b = q.inverse() * Vector3::from(FIELD) + iron_b.add_scalar(seen.zero);
        let _ = write!(measured, "{t_s:.2}");
        let noises = [[NOISE[0]; 3], seen.louder.map(|louder| louder * NOISE[1])].concat();
        for (value, noise) in rate_b.iter().chain(field_b.iter()).zip(noises) {
            let _ = write!(measured, ",{:.6}", value + noise * normal());
        }
        measured.push('\n');
    }
    let folder = written("seen", &seen.case, &unit, &motion, &measured);
    Subject::open(folder.path()).expect("opens")
}

#[test]
fn a_reference_that_errs_more_than_the_unit_is_no_gap() {
    let diagnosis = diagnosed(&Seen::default());
    // Were the record taken for exact, it would be 2.8.
    assert!((0.7..1.3).contains(&diagnosis.gap), "{}", diagnosis.gap);
    assert!(diagnosis.causes.is_empty(), "{:?}", diagnosis.causes);
    assert!(diagnosis.none_of_these < 0.5, "{:?}", diagnosis.leftover.aspects);
}

/// The likeliest effect on the scatter: its name, its channels, and what it was sized to in the first of them.
fn scattered(seen: &Seen) -> (&'static str, Vec<usize>, f64) {
    let subject = opened(seen);
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let found = scatters(&problem, &Model::around(&problem, Vec::new()), &[]);
    let first = found.first().expect("an effect on the scatter");
    (first.effect.page().name, first.channels.clone(), first.thetas[0][0])
}

#[test]
fn what_the_reference_leaves_open_slowly_hides_no_noise() {
    let (name, channels, size) = scattered(&Seen {
        case: CASE.replace("field_sigma_ut = 0.1", "field_sigma_ut = 0.25"),
        louder: [1.25, 1.0, 1.0],
        ..Seen::default()
    });
    assert_eq!((name, channels.as_slice()), ("noise-level", [3].as_slice()));
    assert!((size - 0.25).abs() < 0.05, "{size}");
}

/// A supply that is not quiet: six in a hundred more noise are 5 nats in each, which is not worth the price of naming it.
#[test]
fn noise_that_is_a_little_louder_in_all_of_a_kind_is_seen_in_all_together() {
    let (name, channels, _) = scattered(&Seen {
        louder: [1.06; 3],
        ..Seen::default()
    });
    assert_eq!((name, channels.as_slice()), ("noise-level", [3, 4, 5].as_slice()));
}

#[test]
fn a_magnet_that_is_brought_and_taken_away_is_named_with_its_time() {
    let iron_b = Vector3::new(5.0, -3.0, 20.0);
    let diagnosis = diagnosed(&Seen {
        iron_b,
        ..Seen::default()
    });
    let cause = diagnosis.causes.first().expect("a cause");
    assert_eq!(cause.effect, "hard-iron");
    for (sized, truth) in cause.parameters.iter().zip(iron_b.iter()) {
        assert!((sized.value - truth).abs() < 4.0 * sized.sigma, "{sized:?} {truth}");
    }
    let seconds: Vec<f64> = cause
        .when
        .split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect();
    assert!(
        (seconds[0] - 45.0).abs() < 0.5 && (seconds[1] - 90.0).abs() < 0.5,
        "{}",
        cause.when
    );
    let onset = diagnosis
        .place
        .passage
        .and_then(|passage| passage.onset)
        .expect("an onset");
    assert!(onset.interval_s[0] <= 45.04 && 45.0 <= onset.interval_s[1], "{onset:?}");
    assert!(diagnosis.shrink.interval_percent[0] > 90.0, "{:?}", diagnosis.shrink);
}

/// It shrinks no held-out gap, so nothing has told it from a stand-in.
#[test]
fn a_magnet_that_no_held_out_sample_has_seen_is_no_name() {
    let diagnosis = diagnosed(&Seen {
        iron_b: Vector3::new(1.5, -1.0, 2.0),
        iron_s: [43.0, 57.0],
        // Recalibration has a gap to shrink.
        zero: 0.3,
        ..Seen::default()
    });
    assert!(diagnosis.causes.is_empty(), "{:?}", diagnosis.causes);
    assert!(
        diagnosis.alternatives[0].0 == "hard-iron" && diagnosis.none_of_these > 0.5,
        "{:?} {}",
        diagnosis.alternatives,
        diagnosis.none_of_these
    );
}

/// The columns of a current that switches are those of a magnet while it is on.
#[test]
fn a_magnet_that_stays_is_no_current_that_switches() {
    let diagnosis = diagnosed(&Seen {
        iron_b: Vector3::new(1.5, -1.0, 2.0),
        iron_s: [0.0, SECONDS as f64],
        ..Seen::default()
    });
    let said = diagnosis.causes.iter().map(|cause| (cause.effect, cause.probability));
    let all: Vec<_> = said.chain(diagnosis.alternatives.iter().copied()).collect();
    let current: f64 = (all.iter().filter(|(name, _)| *name == "current-field"))
        .map(|(_, probability)| probability)
        .sum();
    assert!(all[0].0 == "hard-iron" && current < 0.1, "{all:?}");
}

#[test]
fn a_record_with_an_axis_reversed_is_named_and_the_rest_is_judged_along_the_true_motion() {
    let diagnosis = diagnosed(&Seen {
        is_reversed: true,
        ..Seen::default()
    });
    let names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect).collect();
    assert_eq!(names, ["reference-sign"]);
    assert!(diagnosis.none_of_these < 0.5, "{:?}", diagnosis.leftover.aspects);
}
