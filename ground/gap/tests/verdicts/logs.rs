//! Several logs of one unit in one call: simulated along motions of the twin, with the calibration off by what the description allows,
//! once for the unit and not once a log.

use std::{fs, path::PathBuf};

use gap::together::analysed;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use serde_json::Value;
use tempfile::TempDir;
use twin::{
    effect::{Active, Locality},
    motion,
    predict::{UnitDescription, emems, thesis_slot_s},
};

use crate::twin_case::{Log, active, recorded};

/// \[s\] of a log, and of its fit window.
const SECONDS: f64 = 90.0;
const FIT_S: f64 = 60.0;

/// A unit.
struct Unit {
    described: UnitDescription,
    real: UnitDescription,
}

impl Unit {
    /// One whose calibration is off by what its description allows.
    fn of(seed: u64) -> Self {
        let described = emems(thesis_slot_s);
        let mut real = described.clone();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        for channel in &mut real.channels {
            channel.bias += channel.bias_sigma * normal();
            let scale = 1.0 + channel.scale_sigma * normal();
            let across = channel.across().map(|axis| axis * (channel.axis_sigma_rad * normal()));
            if channel.axis_b.norm() > 0.0 {
                channel.axis_b = (channel.axis_b + across[0] + across[1]) * scale;
            }
        }
        Self { described, real }
    }

    /// A log of it along a motion from `from_s` on; with what moved it where a reference saw that.
    fn log(&self, name: &str, from_s: f64, noise: u64, active: &[Active], has_reference: bool) -> TempDir {
        let world = motion::world_by_name(name).expect("a motion");
        let log = Log {
            described: self.described.clone(),
            real: self.real.clone(),
            active,
            zero_s: from_s,
            ..Log::nominal(&world.motion, world.environment, (from_s, from_s + SECONDS))
        };
        let mut random = Xoshiro256PlusPlus::seed_from_u64(noise);
        let normal = || -> f64 { StandardNormal.sample(&mut random) };
        let first = match has_reference {
            true => "motion = \"motion.csv\"\n",
            false => "[motion_known]\nnone = true\n",
        };
        let windows = format!("[windows]\nfit = [[0.0, {FIT_S}]]\nhold = [[{FIT_S}, {SECONDS}]]\n");
        let folder = log.folder(name, normal, first, &windows);
        let told = recorded(&*world.motion, from_s, SECONDS + 1.0);
        fs::write(folder.path().join("motion.csv"), told).expect("a motion");
        folder
    }
}

fn iron(theta: [f64; 3]) -> Active {
    active("hard-iron", Locality::Group("plate 2".to_owned()), &theta)
}

fn together(logs: &[&TempDir]) -> Value {
    let cases: Vec<PathBuf> = logs.iter().map(|log| log.path().to_owned()).collect();
    let texts = analysed(&cases, false, &[], &|_, _| ()).expect("judged");
    let (_, verdict) = texts
        .iter()
        .find(|(name, _)| name == "verdict.json")
        .expect("a verdict");
    serde_json::from_str(verdict).expect("json")
}

fn causes(verdict: &Value) -> Vec<&str> {
    let all = verdict["causes"].as_array().expect("causes");
    all.iter().filter_map(|cause| cause["effect"].as_str()).collect()
}

#[test]
fn a_log_of_another_unit_is_refused_with_file_and_field() {
    let mut other = Unit::of(3);
    let log = other.log("tumble", 0.0, 1, &[], false);
    other.described.channels[30].scale_sigma = 0.25;
    let name = other.described.channels[30].name.clone();
    let another = other.log("tumble", 20.0, 2, &[], false);
    let cases = [log.path().to_owned(), another.path().to_owned()];
    let error = analysed(&cases, false, &[], &|_, _| ())
        .expect_err("another unit")
        .to_string();
    let file = another.path().join("unit.toml").display().to_string();
    assert!(
        error.contains(&file) && error.contains(&name) && error.contains("scale"),
        "{error}"
    );
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn what_no_log_names_by_itself_is_named_together_and_its_size_is_right() {
        let unit = Unit::of(5);
        let place = Locality::Group("plate 2".to_owned());
        let mut crossed = active("mag-cross-field", place, &[]);
        // Ratio 3 in each log; a name takes some five.
        let parameters = crossed.cause.parameters(&unit.described);
        crossed.theta = parameters.iter().map(|own| 0.45 * own.prior_sigma).collect();
        let logs: Vec<TempDir> = (0..5)
            .map(|log| {
                unit.log(
                    "tumble",
                    30.0 * f64::from(log),
                    7 + log as u64,
                    &[crossed.clone()],
                    false,
                )
            })
            .collect();
        for log in &logs {
            assert!(
                causes(&together(&[log])).is_empty(),
                "one log is enough: make the effect smaller"
            );
        }
        let verdict = together(&logs.iter().collect::<Vec<_>>());
        assert_eq!(causes(&verdict), ["mag-cross-field"], "{}", verdict["alternatives"]);
        let cause = &verdict["causes"][0];
        assert_eq!(cause["channels"], serde_json::json!(["m2x", "m2y", "m2z"]));
        for (parameter, size) in parameters.iter().zip(&crossed.theta) {
            let own = &cause["parameters"][&parameter.name];
            let (value, sigma) = (
                own["value"].as_f64().expect("a value"),
                own["sigma"].as_f64().expect("a sigma"),
            );
            assert!(
                (value - size).abs() < 3.0 * sigma,
                "{} {value} +- {sigma}",
                parameter.name
            );
        }
        let chance = cause["agreement"]["chance"].as_f64();
        assert!(chance.is_some_and(|chance| chance > 0.01), "{cause}");
        assert_eq!(verdict["contradicted"], serde_json::json!([]));
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_unit_with_an_honest_calibration_gets_no_name_from_many_logs() {
        let unit = Unit::of(11);
        let logs =
            [0.0, 30.0, 60.0, 90.0, 120.0, 150.0].map(|from_s| unit.log("tumble", from_s, from_s as u64, &[], false));
        let verdict = together(&logs.each_ref());
        assert!(
            causes(&verdict).is_empty() && verdict["outcome"] == "clean",
            "{}",
            verdict["causes"]
        );
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn what_a_bench_log_alone_shows_is_named_beside_a_flight_that_cannot_see_it() {
        let unit = Unit::of(17);
        let off = [active("lever-arm", Locality::Common, &[0.006, -0.004, 0.002])];
        let bench = unit.log("tumble", 0.0, 1, &off, true);
        let flight = unit.log("tumble", 60.0, 2, &off, false);
        assert!(causes(&together(&[&flight])).is_empty());
        let verdict = together(&[&bench, &flight]);
        assert_eq!(causes(&verdict), ["lever-arm"], "{verdict:#}");
        let each = verdict["causes"][0]["by_log"].as_array().expect("each log");
        let ratio = |at: usize| each[at]["ratio"].as_f64().expect("a ratio");
        assert!(ratio(0) > 8.0 && ratio(1) < 3.0, "{each:?}");
        assert_eq!(verdict["causes"][0]["agreement"], Value::Null);
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn logs_that_contradict_each_other_are_named_and_the_effect_is_not() {
        let unit = Unit::of(23);
        let one = unit.log("tumble", 0.0, 1, &[iron([3.0, 0.0, 0.0])], false);
        let other = unit.log("tumble", 60.0, 2, &[iron([-1.0, 0.0, 2.0])], false);
        let verdict = together(&[&one, &other]);
        assert!(causes(&verdict).is_empty(), "{}", verdict["causes"]);
        assert_eq!(verdict["contradicted"][0]["effect"], "hard-iron");
        assert_eq!(verdict["outcome"], "unknown");
    }
}
