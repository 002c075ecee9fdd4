//! A small case made here, with and without an effect in it: the way from files to a verdict.

use std::{fmt::Write, fs};

use gap::{
    case::Subject,
    diagnose::{Diagnosis, diagnose},
    terminal,
    verdict::Verdict,
};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use tempfile::TempDir;

/// [s] of the log, at [`RATE_HZ`].
const SECONDS: usize = 240;

const RATE_HZ: usize = 5;

/// [rad/s] white noise of a gyro.
const NOISE: f64 = 0.003;

const CASE: &str = r#"format = "gap-case/1"
name = "injected"
kind = "csv"
unit = "unit.toml"
measured = "measured.csv"
motion = "motion.csv"
[environment]
latitude_deg = 0.0
[windows]
fit = [[0.0, 120.0]]
hold = [[120.0, 240.0]]
"#;

/// Three gyros along the axes of b, turning about x, y and z in turn; gz reads `scale` too much.
fn case(scale: f64) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let mut unit = "name = \"three gyros\"\n".to_owned();
    for (name, axis) in [
        ("gx", "1.0, 0.0, 0.0"),
        ("gy", "0.0, 1.0, 0.0"),
        ("gz", "0.0, 0.0, 1.0"),
    ] {
        let _ = write!(
            unit,
            "[[channel]]\nname = \"{name}\"\nsensor = \"gyro\"\ngroup = \"unit\"\naxis_b = [{axis}]\nlsb = 1.0\n\
             noise_sigma = {NOISE}\nbias_sigma = 0.001\nscale_sigma = 0.001\naxis_sigma_rad = 0.001\nrange = [-6.0, 6.0]\n"
        );
    }
    let mut motion = "t_s,qw,qx,qy,qz\n".to_owned();
    let mut measured = "t_s,gx,gy,gz\n".to_owned();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    // phi(t) = (1 - cos(w t))/2 about z alone, so the rate is w/2 sin(w t) there and nothing elsewhere.
    let w = 0.9;
    for k in 0..=50 * SECONDS {
        let t = k as f64 / 50.0;
        let half = (1.0 - (w * t).cos()) / 4.0;
        let _ = writeln!(motion, "{t:.2},{:.9},0,0,{:.9}", half.cos(), half.sin());
    }
    // Earth's rate at the equator points north, which is x of n; the attitude turns it in the plane x, y of b.
    let earth = 7.292e-5;
    for k in 0..SECONDS * RATE_HZ {
        let t = k as f64 / RATE_HZ as f64;
        let angle = (1.0 - (w * t).cos()) / 2.0;
        let mut noise = || -> f64 { NOISE * Distribution::<f64>::sample(&StandardNormal, &mut random) };
        let rate = w / 2.0 * (w * t).sin();
        let _ = writeln!(
            measured,
            "{t:.1},{:.7},{:.7},{:.7}",
            earth * angle.cos() + noise(),
            -earth * angle.sin() + noise(),
            (1.0 + scale) * rate + noise()
        );
    }
    for (name, text) in [
        ("case.toml", CASE),
        ("unit.toml", &unit),
        ("motion.csv", &motion),
        ("measured.csv", &measured),
    ] {
        fs::write(folder.path().join(name), text).expect("a file");
    }
    folder
}

fn diagnosed(scale: f64, withheld: &[&str]) -> (Subject, Diagnosis) {
    let folder = case(scale);
    let subject = Subject::open(folder.path()).expect("opens");
    let withheld: Vec<String> = withheld.iter().map(|name| (*name).to_owned()).collect();
    let diagnosis = diagnose(&subject, &withheld, &|_, _| {});
    (subject, diagnosis)
}

#[test]
fn a_scale_error_is_found_sized_and_shrunk() {
    let (subject, diagnosis) = diagnosed(0.02, &[]);
    let cause = diagnosis.causes.first().expect("a cause");
    assert_eq!(subject.names(cause.channels.iter().copied()), ["gz"]);
    let likely: Vec<&str> = diagnosis
        .indistinguishable
        .iter()
        .flatten()
        .copied()
        .chain([cause.effect])
        .collect();
    assert!(likely.contains(&"gyro-scale"), "{likely:?}");
    let size = cause.parameters.first().expect("a parameter");
    // Three standard deviations of its own interval.
    assert!(
        (size.value.abs() - 0.02).abs() < 3.0 * size.sigma,
        "{} +- {}",
        size.value,
        size.sigma
    );
    assert!(
        diagnosis.shrink.percent > 90.0 && diagnosis.shrink.interval_percent[0] > 80.0,
        "{:?}",
        diagnosis.shrink.percent
    );
}

#[test]
fn a_healthy_unit_needs_nothing() {
    let (subject, diagnosis) = diagnosed(0.0, &[]);
    assert!(diagnosis.causes.is_empty() && diagnosis.withdrawn.is_empty());
    assert!(diagnosis.none_of_these < 0.1, "{}", diagnosis.none_of_these);
    let screen = terminal::screen(&subject, &diagnosis, "none");
    assert!(screen.contains("NO EFFECT") && screen.lines().count() < 40, "{screen}");
}

#[test]
fn the_verdict_has_every_key_of_the_format() {
    let (subject, diagnosis) = diagnosed(0.02, &[]);
    let text = serde_json::to_string(&Verdict::new(&subject, &diagnosis, "next".to_owned())).expect("finite");
    let verdict: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let keys = [
        "case",
        "format",
        "gap",
        "where",
        "causes",
        "alternatives",
        "indistinguishable",
        "none_of_these",
        "next_experiment",
        "shrink",
    ];
    for key in keys {
        assert!(verdict.get(key).is_some(), "{key}");
    }
    assert_eq!(verdict["format"], "gap-verdict/1");
    assert!(
        verdict["causes"][0]["parameters"]
            .as_object()
            .is_some_and(|parameters| !parameters.is_empty())
    );
    for key in ["hold_before", "hold_recalibrated", "hold_after", "percent"] {
        assert!(verdict["shrink"][key].is_f64(), "{key}");
    }
}
