//! When an effect is on that comes and goes, beside a reference and a field that err slowly: three magnetometers on a table whose field
//! wanders by as much as the effect.

mod written;

use std::fmt::Write;

use gap::{
    diagnose::diagnose,
    input::case::Subject,
    library::hypotheses::Library,
    null::{interval::Interval, model::Model, problem::Problem},
    unknown::{recognised::recognised, remainder::Setting},
};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use tempfile::TempDir;
use written::written;

/// \[s\] of the log, at [`RATE_HZ`].
const SECONDS: usize = 240;
const RATE_HZ: usize = 10;

/// \[uT\] noise, and how far the field wanders in [`WANDERS_S`].
const NOISE_UT: f64 = 0.3;
const WANDER_UT: f64 = 0.5;
const WANDERS_S: f64 = 40.0;

const CASE: &str = r#"[environment]
latitude_deg = 0.0
field_n_ut = [20.0, 0.0, 40.0]
field_sigma_ut = 0.8
field_wander_sigma_ut = 0.5
field_correlation_s = 40.0
[reference]
attitude_sigma_rad = 0.003
attitude_correlation_s = 20.0
[windows]
fit = [[0.0, 200.0]]
hold = [[200.0, 240.0]]
"#;

/// The field along x of b has `error` \[uT\] of the time \[s\] more than it should.
fn case(seed: u64, error: impl Fn(f64) -> f64) -> TempDir {
    let mut unit = "name = \"three magnetometers\"\n".to_owned();
    for (name, axis) in [
        ("mx", "1.0, 0.0, 0.0"),
        ("my", "0.0, 1.0, 0.0"),
        ("mz", "0.0, 0.0, 1.0"),
    ] {
        let _ = write!(
            unit,
            "[[channel]]\nname = \"{name}\"\nsensor = \"magnetometer\"\ngroup = \"unit\"\naxis_b = [{axis}]\nlsb = 1.0\n\
             noise_sigma = {NOISE_UT}\nbias_sigma = 0.6\nscale_sigma = 0.01\naxis_sigma_rad = 0.01\nrange = [-1200.0, 1200.0]\n"
        );
    }
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let turned = |t_s: f64| 1.5 * (0.4 * t_s).sin();
    let mut motion = "t_s,qw,qx,qy,qz\n".to_owned();
    for k in 0..=50 * SECONDS {
        let t_s = k as f64 / 50.0;
        let half = 0.5 * turned(t_s);
        let _ = writeln!(motion, "{t_s:.2},{:.9},0,0,{:.9}", half.cos(), half.sin());
    }
    let kept = (-1.0 / (WANDERS_S * RATE_HZ as f64)).exp();
    let mut wandered = WANDER_UT * normal();
    let mut measured = "t_s,mx,my,mz\n".to_owned();
    for k in 0..SECONDS * RATE_HZ {
        let t_s = k as f64 / RATE_HZ as f64;
        wandered = kept * wandered + (1.0 - kept * kept).sqrt() * WANDER_UT * normal();
        let (sin, cos) = turned(t_s).sin_cos();
        let north = 20.0 + wandered;
        let _ = writeln!(
            measured,
            "{t_s:.1},{:.5},{:.5},{:.5}",
            north * cos + error(t_s) + NOISE_UT * normal(),
            -north * sin + NOISE_UT * normal(),
            40.0 + NOISE_UT * normal()
        );
    }
    written("passing", CASE, &unit, &motion, &measured)
}

/// What is recognised where nothing was found, by name, with the field along x of b that it is \[uT\] and when it is on.
fn seen(error: impl Fn(f64) -> f64) -> Option<(&'static str, f64, Option<Interval>)> {
    let folder = case(3, error);
    let subject = Subject::open(folder.path()).expect("opens");
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let library = Library::new(&problem, &[], &|_| {});
    let louder = [1.0; 3];
    let setting = Setting::of(&subject, None, &louder);
    let quiet = Model::around(&problem, Vec::new());
    let (chosen, span) = recognised(&problem, &library, &quiet, &[], &setting)?;
    Some((library.hypotheses[chosen.hypothesis].effect(), chosen.theta[0], span))
}

#[test]
fn a_current_that_comes_again_and_again_is_found_with_its_period() {
    let (name, field_ut, on) = seen(|t_s| if (t_s / 37.0).fract() < 0.4 { 1.0 } else { 0.0 }).expect("a current");
    let on = on.expect("an interval");
    assert_eq!(name, "current-field");
    assert!((on.every_s.expect("a period") - 37.0).abs() < 0.4, "{on}");
    assert!((on.stretch.to - on.stretch.from - 14.8).abs() < 1.0, "{on}");
    assert!((field_ut - 1.0).abs() < 0.15, "{field_ut}");
}

#[test]
fn a_magnet_that_is_brought_and_taken_away_is_found_with_its_time() {
    let (name, field_ut, on) = seen(|t_s| if (61.0..113.0).contains(&t_s) { 1.0 } else { 0.0 }).expect("iron");
    let stretch = on.expect("an interval").stretch;
    assert_eq!(name, "hard-iron");
    assert!(
        (stretch.from - 61.0).abs() < 1.0 && (stretch.to - 113.0).abs() < 1.0,
        "{stretch:?}"
    );
    assert!((field_ut - 1.0).abs() < 0.15, "{field_ut}");
}

/// The field wanders by half a microtesla all the time.
#[test]
fn what_a_field_does_that_wanders_is_nothing() {
    assert!(seen(|_| 0.0).is_none());
}

/// Of three wandering fields.
#[test]
fn a_diagnosis_names_a_current_and_nothing_of_a_field_that_wanders() {
    let names = |seed: u64, error: &dyn Fn(f64) -> f64| {
        let folder = case(seed, error);
        let diagnosis = diagnose(&Subject::open(folder.path()).expect("opens"), &[], &|_, _| {});
        let names = diagnosis
            .causes
            .iter()
            .map(|cause| (cause.effect, cause.probability >= 0.5));
        (names.collect::<Vec<_>>(), diagnosis.none_of_these < 0.5)
    };
    for seed in [3, 4, 5] {
        assert_eq!(names(seed, &|_| 0.0), (Vec::new(), true), "{seed}");
    }
    let current = |t_s: f64| if (t_s / 37.0).fract() < 0.4 { 1.0 } else { 0.0 };
    assert_eq!(names(3, &current), (vec![("current-field", true)], true));
}
