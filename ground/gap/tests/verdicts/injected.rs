//! A small case made here, with and without an effect in it: the way from files to a verdict.

use std::fs;

use crate::gyros::{NOISE, RATE_HZ, SECONDS, diagnosed_in, erring, rate, rewritten};
use gap::{
    command::taught,
    diagnose::Diagnosis,
    input::case::Subject,
    report::{terminal, verdict::Verdict},
};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use serde_json::Value;
use tempfile::TempDir;

/// Three gyros along the axes of b, turning about z; gz reads `scale` of the time \[s\] too much.
fn case(scale: impl Fn(f64) -> f64) -> TempDir {
    erring(|t_s| scale(t_s) * rate(t_s), "")
}

fn diagnosed(scale: f64) -> (Subject, Diagnosis) {
    diagnosed_in(&case(|_| scale), &[])
}

#[test]
fn a_scale_error_is_found_sized_and_shrunk() {
    let (subject, diagnosis) = diagnosed(0.02);
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

/// Three gyros of which gz clips: from here on by a parabola, which is not the law that is fitted.
fn clipping(most: f64, bend: f64) -> TempDir {
    let fastest = (0..20 * SECONDS)
        .map(|k| rate(0.05 * k as f64).abs())
        .fold(0.0, f64::max);
    let (most, bend) = (most * fastest, bend * fastest);
    let missing = move |rate: f64| {
        let within = rate.abs() - (most - bend);
        let short = match within {
            _ if within <= 0.0 => 0.0,
            _ if within < 2.0 * bend => within * within / (4.0 * bend),
            _ => within - bend,
        };
        -rate.signum() * short
    };
    erring(|t_s| missing(rate(t_s)), "")
}

/// An amplifier bends before its limit. A hard clip explains nearly all of it, and what that leaves had names of its own.
#[test]
fn a_clip_that_bends_before_its_limit_is_a_saturation_and_nothing_else() {
    let (_, diagnosis) = diagnosed_in(&clipping(0.75, 0.2), &[]);
    let named: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect).collect();
    assert_eq!(named, ["gyro-saturation"], "{}", diagnosis.none_of_these);
    assert!(diagnosis.shrink.percent > 95.0, "{}", diagnosis.shrink.percent);
}

/// Without saturation in the library nothing else is blamed for it.
#[test]
fn a_clip_that_the_library_does_not_have_has_no_name() {
    let (_, diagnosis) = diagnosed_in(&clipping(0.3, 0.01), &["gyro-saturation"]);
    assert!(diagnosis.causes.is_empty(), "{:?}", diagnosis.causes);
    assert!(diagnosis.none_of_these > 0.9, "{}", diagnosis.none_of_these);
}

#[test]
fn a_healthy_unit_needs_nothing() {
    let (subject, diagnosis) = diagnosed(0.0);
    assert!(diagnosis.causes.is_empty() && diagnosis.withdrawn.is_empty());
    // Its prior is 0.15.
    assert!(diagnosis.none_of_these < 0.2, "{}", diagnosis.none_of_these);
    let screen = terminal::screen(&subject, &diagnosis, "none");
    assert!(screen.contains("NO EFFECT") && screen.lines().count() < 40, "{screen}");
}

#[test]
fn a_scale_that_is_gone_in_the_hold_windows_is_withdrawn() {
    let (subject, diagnosis) = diagnosed_in(&case(|t_s| if t_s < 120.0 { 0.02 } else { 0.0 }), &[]);
    assert!(diagnosis.causes.is_empty(), "{:?}", diagnosis.causes);
    assert!(!diagnosis.withdrawn.is_empty());
    let screen = terminal::screen(&subject, &diagnosis, "");
    assert!(screen.contains("withdrawn"), "{screen}");
    // What is judged then is the twin without it.
    assert_eq!(diagnosis.ceiling_percent, None);
    assert!(diagnosis.correction.is_none() && diagnosis.known.is_empty());
}

#[test]
fn a_twin_taught_the_effect_needs_nothing_more() {
    let folder = case(|_| 0.02);
    let (subject, diagnosis) = diagnosed_in(&folder, &[]);
    let unit = taught(&subject, &diagnosis);
    assert_eq!(unit.effects.len(), 1);
    fs::write(folder.path().join("unit.toml"), unit.text()).expect("a file");
    let (_, again) = diagnosed_in(&folder, &[]);
    assert!(again.causes.is_empty(), "{:?}", again.causes);
    // The gap of the fit is that of its noise: 1800 samples, three standard deviations.
    assert!(
        diagnosis.gap > 1.5 && (again.gap - 1.0).abs() < 0.05,
        "{} {}",
        diagnosis.gap,
        again.gap
    );
}

#[test]
fn what_the_unit_can_correct_is_an_entry_of_its_calibration_set() {
    let (subject, diagnosis) = diagnosed(0.02);
    let correction = diagnosis.correction.as_ref().expect("a scale is the unit's to correct");
    let text = correction.set(&subject.twin).expect("text");
    let set = bench::set::Set::parse(&text).expect("a calibration set");
    let entry = set.channels.iter().find(|entry| entry.name == "gz").expect("gz");
    assert!((entry.sensitivity().norm() - 1.02).abs() < 0.002, "{text}");
    let rate = diagnosis
        .stages
        .iter()
        .find(|stage| stage.name == "rate")
        .expect("three gyros");
    assert!(
        rate.after < 0.7 * rate.before && rate.percent.is_some_and(|percent| percent > 80.0),
        "{rate:?}"
    );
    let corrected = rate.corrected.expect("corrected");
    assert!(
        corrected < 0.7 * rate.before && corrected > 0.9 * rate.floor,
        "{rate:?}"
    );
}

/// `verdict.json` as the format's page prints it.
const FORMAT: &str = r#"{ "case": "S07", "format": "gap-verdict/2",
  "gap":  { "before": 7.41, "floor": 1.00, "units": "sigma" },
  "where": [ { "channels": ["g2"], "share": 0.83, "when": "rate about y above 60 deg/s" } ],
  "causes": [ { "effect": "gyro-scale", "channels": ["g2"], "probability": 0.97,
                "parameters": { "scale_error": { "value": 0.0123, "sigma": 0.0004, "unit": "1" } } } ],
  "alternatives": [ { "effect": "gyro-nonlinearity", "probability": 0.02 } ],
  "indistinguishable": [ ["gyro-scale", "reference-scale"] ],
  "none_of_these": 0.01,
  "outcome": "named",
  "remainder": { "present": 0.2, "log_bayes_factor": 1.5, "what": "a slow error of g2", "channels": ["g2"],
                 "size": { "value": 0.002, "interval_90": [0.001, 0.003], "unit": "rad/s" },
                 "sigma": { "value": 0.1, "interval_90": [0.05, 0.15], "unit": "sigma" },
                 "attitude_deg": { "value": 0.3, "interval_90": [0.1, 0.4], "unit": "deg" }, "matters": 0.01 },
  "noise": [ { "sensor": "gyro", "is": ["louder"], "declared": 0.0030, "seen": 0.0042, "by_reference": 0.0, "unit": "rad/s",
               "ratio": [1.3, 1.5], "correlation": 0.02, "repeated": 0.0 } ],
  "next_experiment": "next",
  "shrink": { "hold_before": 7.35, "hold_recalibrated": 6.90, "hold_after": 1.08, "percent": 98.7, "interval_percent": [98.1, 99.1] } }"#;

/// Compares shapes: the same keys everywhere, values of the same type. Lists are compared by their first elements, and the
/// names of parameters are the effect's own.
fn check_shape(expected: &Value, found: &Value, at: &str) {
    match (expected, found) {
        (Value::Object(expected), Value::Object(found)) if at.ends_with("/parameters") => {
            let first = |map: &serde_json::Map<String, Value>| map.values().next().cloned().expect("a parameter");
            check_shape(&first(expected), &first(found), &format!("{at}/*"));
        }
        (Value::Object(expected), Value::Object(found)) => {
            let keys = |map: &serde_json::Map<String, Value>| map.keys().cloned().collect::<Vec<_>>();
            assert_eq!(keys(expected), keys(found), "{at}");
            for (key, value) in expected {
                check_shape(value, &found[key], &format!("{at}/{key}"));
            }
        }
        (Value::Array(expected), Value::Array(found)) => {
            if let (Some(expected), Some(found)) = (expected.first(), found.first()) {
                check_shape(expected, found, &format!("{at}/0"));
            }
        }
        (Value::Number(_), Value::Number(_)) | (Value::String(_), Value::String(_)) => {}
        // Not everything that is left makes an error of attitude.
        (_, Value::Null) if at.ends_with("/attitude_deg") => {}
        _ => panic!("{at}: {found} where the format has {expected}"),
    }
}

#[test]
fn the_verdict_is_exactly_the_formats() {
    let (subject, diagnosis) = diagnosed(0.02);
    let text = serde_json::to_string(&Verdict::new(&subject, &diagnosis, "next".to_owned())).expect("finite");
    let found: Value = serde_json::from_str(&text).expect("JSON");
    let format: Value = serde_json::from_str(FORMAT).expect("JSON");
    check_shape(&format, &found, "");
    assert_eq!(found["format"], format["format"]);
    assert_eq!(found["gap"]["units"], "sigma");
    let probabilities = found["causes"]
        .as_array()
        .expect("causes")
        .iter()
        .chain(found["alternatives"].as_array().expect("alternatives"));
    for named in probabilities {
        let probability = named["probability"].as_f64().expect("a number");
        assert!(
            (0.0..=1.0).contains(&probability)
                && twin::effect::by_name(named["effect"].as_str().expect("a name")).is_some()
        );
    }
}

#[test]
fn a_reading_that_is_late_by_less_than_its_instant_is_known_is_no_effect() {
    // The drift of the second: the ages of two clocks differ more and more.
    let errors: [fn(f64) -> f64; 2] = [
        |t_s| rate(t_s - 0.012) - rate(t_s),
        |t_s| rate(t_s - 1e-4 * t_s) - rate(t_s),
    ];
    for error in errors {
        let said = |keys: &str| {
            let diagnosis = diagnosed_in(&erring(error, keys), &[]).1;
            let causes = diagnosis.causes.iter().map(|cause| cause.probability);
            let others = diagnosis.alternatives.iter().map(|(_, probability)| *probability);
            causes.chain(others).sum::<f64>() + diagnosis.none_of_these
        };
        let (known, unknown) = (said(""), said("instant_sigma_s = 0.012\n"));
        assert!(known > 0.9 && unknown < 0.5, "{known} {unknown}");
    }
}

/// What a part's clock scatters no twin foretells: it is in the floor, as far as the fitted samples show it, and is no gap.
#[test]
fn the_floor_of_a_gap_is_what_a_perfect_twin_leaves() {
    const PERIOD_S: f64 = 0.03;
    // A clock that beats against the cycle, and one in step with it.
    for beats in [true, false] {
        let age_s = |t_s: f64| if beats { (t_s * 3.1).fract() } else { 0.4 } * PERIOD_S;
        let keys = format!("instant_sigma_s = {}\n", PERIOD_S / 12f64.sqrt());
        let folder = erring(|t_s| rate(t_s - age_s(t_s)) - rate(t_s), &keys);
        let shrink = diagnosed_in(&folder, &[]).1.shrink;
        // Of 1,800 held-out samples a gap is off by a sixtieth by chance.
        assert!((shrink.after - shrink.floor).abs() < 0.05, "{shrink:?}");
        assert_eq!(shrink.floor > 1.06, beats, "{shrink:?}");
    }
}

/// What three gyros whose packets are numbered say of readings that are `late_s` \[s\] late.
fn of_late(late_s: impl Fn(f64) -> f64) -> Diagnosis {
    let folder = erring(|t_s| rate(t_s + late_s(t_s)) - rate(t_s), "");
    let change = |name: &str, of: &dyn Fn(String) -> String| {
        let file = folder.path().join(name);
        let text = fs::read_to_string(&file).expect("a file");
        fs::write(file, of(text)).expect("a file");
    };
    change("unit.toml", &|unit| {
        format!("cycle_s = {}\n{unit}", 1.0 / RATE_HZ as f64)
    });
    // The last second was read after the record of the motion ends.
    change("case.toml", &|case| case.replace("240.0]", "239.0]"));
    diagnosed_in(&folder, &[]).1
}

#[test]
fn packets_that_are_lost_again_in_the_held_out_windows_are_lost_packets() {
    let since = |t_s: f64, onset_s: f64| f64::from(t_s >= onset_s);
    // One is lost in the fit windows, which end at 120 s, and two after them.
    let lost = of_late(|t_s| 0.2 * (since(t_s, 61.0) + since(t_s, 150.0) + since(t_s, 201.0)));
    let names: Vec<&str> = lost.causes.iter().map(|cause| cause.effect).collect();
    assert_eq!(names, ["packet-loss"]);
    assert!(
        lost.none_of_these < 0.1 && lost.shrink.after < 1.05,
        "{:?}",
        lost.shrink
    );
    let promise = lost.promises[0].promise.expect("they are lost there");
    assert!((promise.factor - 1.0).abs() < 0.05, "{promise:?}");
    // What else delays it after them is none of these.
    let other = of_late(|t_s| 0.2 * since(t_s, 61.0) + 0.3 * since(t_s, 150.0));
    let believed: f64 = other.causes.iter().map(|cause| cause.probability).sum();
    assert!(believed < 0.5 && other.none_of_these > 0.9, "{:?}", other.causes);
}

#[test]
fn a_channel_without_samples_leaves_the_verdict_to_the_others() {
    let folder = rewritten(case(|_| 0.02), |cells| cells[2].clear());
    let (subject, diagnosis) = diagnosed_in(&folder, &[]);
    let cause = diagnosis.causes.first().expect("a cause");
    assert_eq!(subject.names(cause.channels.iter().copied()), ["gz"]);
    let screen = terminal::screen(&subject, &diagnosis, "");
    assert!(screen.contains("WHERE   gz 99 %"), "{screen}");
}

/// A zero that wanders by a tenth of the noise a sample.
fn wandering() -> impl Fn(f64) -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut zero = 0.0;
    let walk: Vec<f64> = (0..SECONDS * RATE_HZ)
        .map(|_| {
            let step: f64 = StandardNormal.sample(&mut random);
            zero += 0.1 * NOISE * step;
            zero
        })
        .collect();
    move |t_s| walk[(t_s * RATE_HZ as f64).round() as usize]
}

#[test]
fn a_scale_error_is_found_beside_a_walk() {
    let walk = wandering();
    let (_, both) = diagnosed_in(&erring(|t_s| walk(t_s) + 0.02 * rate(t_s), ""), &[]);
    let names: Vec<&str> = both.causes.iter().map(|cause| cause.effect).collect();
    assert!(names.contains(&"gyro-bias-walk") && names.len() == 2, "{names:?}");
    assert!(both.none_of_these < 0.5, "{}", both.none_of_these);
}

/// Twelve sigmas of a zero are worth seventy nats, for the calibration takes up the others, and are all of the gap but for a faint tone.
#[test]
fn a_zero_far_beyond_its_sigma_is_named_beside_a_little_that_is_not_explained() {
    let tone = |t_s: f64| 0.6 * NOISE * (std::f64::consts::TAU * t_s / 17.0).sin();
    let named = |zero: f64| {
        let diagnosis = diagnosed_in(&erring(|t_s| zero + tone(t_s), ""), &[]).1;
        let names = diagnosis.causes.iter().map(|cause| cause.effect);
        (names.collect::<Vec<_>>(), diagnosis.leftover.p)
    };
    let (names, left) = named(0.012);
    assert_eq!(names, ["gyro-bias"], "{left}");
    assert!(left < 0.05, "the tone is not seen: {left}");
}

#[test]
fn a_tone_is_not_called_a_walk_of_the_zero() {
    let walked = diagnosed_in(&erring(wandering(), ""), &[]).1;
    assert_eq!(walked.causes.first().expect("a cause").effect, "gyro-bias-walk");
    assert!(walked.none_of_these < 0.1, "{}", walked.none_of_these);
    let tone = |t_s: f64| 2.0 * NOISE * (std::f64::consts::TAU * t_s / 17.0).sin();
    let hummed = diagnosed_in(&erring(tone, ""), &[]).1;
    assert!(hummed.causes.is_empty(), "{:?}", hummed.causes);
    assert!(hummed.none_of_these > 0.9, "{}", hummed.none_of_these);
}
