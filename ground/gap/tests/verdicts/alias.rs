//! Two magnetometers, one read four milliseconds after the other: a fifth of a cycle of the mains.

use std::{f64::consts::TAU, fmt::Write};

use crate::written::written;
use gap::{
    diagnose::{Diagnosis, diagnose},
    input::case::Subject,
};
use nalgebra::{UnitQuaternion, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

/// \[s\] of the log, at [`RATE_HZ`].
const SECONDS: usize = 400;

const RATE_HZ: usize = 5;

/// \[uT\] white noise.
const NOISE_UT: f64 = 0.2;

/// \[uT\] field in n.
const FIELD_N_UT: [f64; 3] = [17.0, 0.3, 41.0];

/// \[s\] after the row's time.
const SLOTS_S: [f64; 2] = [0.0, 0.004];

const CASE: &str = r#"[environment]
latitude_deg = 0.0
field_n_ut = [17.0, 0.3, 41.0]
[windows]
fit = [[0.0, 200.0]]
hold = [[200.0, 400.0]]
"#;

fn attitude(t_s: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(0.9 * (0.11 * t_s).sin(), 0.8 * (0.07 * t_s).sin(), 0.05 * t_s)
}

/// What is said of a unit in a field that alternates in n, by so much of 0.5 uT at each instant.
fn diagnosed(course: impl Fn(f64) -> f64) -> Diagnosis {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let (mut unit, mut header) = ("name = \"two magnetometers\"\n".to_owned(), "t_s".to_owned());
    for (plate, slot_s) in SLOTS_S.iter().enumerate() {
        for (axis, along) in [("x", "1.0, 0.0, 0.0"), ("y", "0.0, 1.0, 0.0"), ("z", "0.0, 0.0, 1.0")] {
            let _ = write!(header, ",m{plate}{axis}");
            let _ = write!(
                unit,
                "[[channel]]\nname = \"m{plate}{axis}\"\nsensor = \"magnetometer\"\ngroup = \"plate {plate}\"\n\
                 axis_b = [{along}]\nlsb = 0.01\nnoise_sigma = {NOISE_UT}\nbias_sigma = 0.1\nscale_sigma = 0.001\n\
                 axis_sigma_rad = 0.001\nrange = [-130.0, 130.0]\nslot_s = {slot_s}\n"
            );
        }
    }
    let (mut motion, mut measured) = ("t_s,qw,qx,qy,qz\n".to_owned(), header + "\n");
    for k in 0..=50 * (SECONDS + 1) {
        let t_s = k as f64 / 50.0;
        let q = attitude(t_s);
        let _ = writeln!(motion, "{t_s:.2},{:.9},{:.9},{:.9},{:.9}", q.w, q.i, q.j, q.k);
    }
    for k in 0..SECONDS * RATE_HZ {
        let start_s = k as f64 / RATE_HZ as f64;
        let _ = write!(measured, "{start_s:.2}");
        for slot_s in SLOTS_S {
            let t_s = start_s + slot_s;
            let field_n = Vector3::from(FIELD_N_UT) + 0.5 * course(t_s) * Vector3::new(0.6, -0.3, 0.7);
            for along in (attitude(t_s).inverse() * field_n).iter() {
                let noise: f64 = StandardNormal.sample(&mut random);
                let _ = write!(measured, ",{:.2}", along + NOISE_UT * noise);
            }
        }
        measured.push('\n');
    }
    let folder = written("alias", CASE, &unit, &motion, &measured);
    diagnose(&Subject::open(folder.path()).expect("opens"), &[], &|_, _| {})
}

#[test]
fn the_mains_have_a_phase_for_each_instant() {
    let mains = diagnosed(|t_s| (TAU * 50.006 * t_s).sin());
    let first = mains.causes.first().expect("a cause");
    assert!(
        first.effect == "mains-alias" && first.probability > 0.9,
        "{} {}",
        first.effect,
        first.probability
    );
    assert!(mains.none_of_these < 0.5);
}

#[test]
fn what_is_as_slow_and_has_one_phase_is_none_of_these() {
    let slow = diagnosed(|t_s| (TAU * 0.006 * t_s).sin());
    let names: Vec<_> = slow
        .causes
        .iter()
        .map(|cause| (cause.effect, cause.probability))
        .collect();
    assert!(names.iter().all(|(name, _)| *name != "mains-alias"), "{names:?}");
    assert!(slow.none_of_these > 0.5, "{}", slow.none_of_these);
}
