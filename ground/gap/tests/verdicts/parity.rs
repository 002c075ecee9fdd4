//! Logs without a reference, from files to what is said: simulated here along motions of the twin, with and without an effect.

use std::fs;

use clap::Parser;
use gap::{
    command::{GapArguments, run},
    input::case::Subject,
    null::problem::Component,
    parity::{
        analysed, beforehand,
        findings::Findings,
        flight::Flight,
        followed::{Beforehand, Followed},
        name::{By, Fitted},
        smoothed::promises,
        visible::Row,
    },
    probability::outcome::Outcome,
    thresholds::PARITY_SNR,
};
use nalgebra::DMatrix;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use serde_json::Value;
use tempfile::TempDir;
use twin::{
    effect::{Active, Cause, LIBRARY, Locality, by_name},
    motion,
    predict::{Kind, Scene, Twin, UnitDescription, emems, thesis_slot_s},
};

/// \[s\] of a log.
const SECONDS: f64 = 120.0;

/// A case of a unit along a motion, from `from_s` on, whose calibration is off by what its description allows.
pub fn flown(name: &str, from_s: f64, seed: u64, active: &[Active], only: impl Fn(&str) -> bool) -> TempDir {
    flown_in(name, from_s, seed, (active, active), 110.0, only)
}

/// The same with what acts in the fit windows, which end after so many seconds, and in the held-out ones.
fn flown_in(
    name: &str,
    from_s: f64,
    seed: u64,
    (active, active_after): (&[Active], &[Active]),
    fit_s: f64,
    only: impl Fn(&str) -> bool,
) -> TempDir {
    let world = motion::world_by_name(name).expect("a motion");
    let environment = world.environment;
    let mut unit = emems(thesis_slot_s);
    unit.channels.retain(|channel| only(&channel.group));
    let scene = Scene::new(&world.motion, &environment, from_s - 2.0, from_s + SECONDS + 2.0, 0.01);
    let starts_s: Vec<f64> = (0..(SECONDS / 0.2) as usize)
        .map(|row| from_s + 0.2 * row as f64)
        .collect();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut real: UnitDescription = unit.clone();
    for channel in &mut real.channels {
        channel.bias += channel.bias_sigma * normal();
        let scale = 1.0 + channel.scale_sigma * normal();
        let across = channel.across().map(|axis| axis * (channel.axis_sigma_rad * normal()));
        if channel.axis_b.norm() > 0.0 {
            channel.axis_b = (channel.axis_b + across[0] + across[1]) * scale;
        }
    }
    let twin = Twin::new(real, environment, scene, starts_s.clone()).expect("a twin");
    let (readings, readings_after) = (twin.predict(active), twin.predict(active_after));
    let mut text = format!(
        "t_s,{}\n",
        unit.channels
            .iter()
            .map(|channel| channel.name.as_str())
            .collect::<Vec<_>>()
            .join(",")
    );
    for (row, start_s) in starts_s.iter().enumerate() {
        let readings = if start_s - from_s < fit_s {
            &readings
        } else {
            &readings_after
        };
        let cells = unit.channels.iter().zip(readings).map(|(channel, own)| {
            let value = own[row] + channel.noise_sigma * normal();
            format!("{:.9}", channel.logged(value))
        });
        text += &format!("{:.1},{}\n", start_s - from_s, cells.collect::<Vec<_>>().join(","));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let case = format!(
        "format = \"gap-case/1\"\nname = \"{name}\"\nkind = \"csv\"\nunit = \"unit.toml\"\nmeasured = \"measured.csv\"\n\
         [motion_known]\nnone = true\n[environment]\ngravity_m_s2 = {}\nlatitude_deg = {}\nfield_n_ut = [{}, {}, {}]\n\
         [windows]\nfit = [[0.0, {fit_s:.1}]]\nhold = [[{fit_s:.1}, 120.0]]\n",
        environment.gravity,
        environment.latitude.to_degrees(),
        environment.field_n_ut.x,
        environment.field_n_ut.y,
        environment.field_n_ut.z
    );
    for (name, text) in [("case.toml", case), ("unit.toml", unit.text()), ("measured.csv", text)] {
        fs::write(folder.path().join(name), text).expect("a file");
    }
    folder
}

fn found(folder: &TempDir) -> Findings {
    let flight = Flight::open(folder.path()).expect("opens");
    Findings::of(&flight, &[], &|_, _| ()).expect("has redundancy")
}

fn iron(plate: &str, theta: [f64; 3]) -> Active {
    Active {
        cause: Cause {
            effect: by_name("hard-iron").expect("an effect"),
            locality: Locality::Group(plate.to_owned()),
            variant: 0.0,
        },
        theta: theta.to_vec(),
    }
}

fn check_healthy(name: &str, from_s: f64) {
    let findings = found(&flown(name, from_s, 3, &[], |_| true));
    let names: Vec<&str> = findings.names.iter().map(|name| name.effect).collect();
    assert!(names.is_empty(), "{name}: {names:?}");
    assert!((0.97..1.03).contains(&findings.gap[0]), "{name}: {}", findings.gap[0]);
    assert!(findings.none_of_these < 0.5, "{name}: gap {:?}", findings.gap);
    let (named, small): (Vec<_>, Vec<_>) = findings.visible.iter().partition(|row| row.is_visible);
    assert!(!named.is_empty() && !small.is_empty());
    let is_seen = |row: &&Row| row.snr.max(row.smoothed.unwrap_or(0.0)) >= PARITY_SNR;
    assert!(named.iter().all(is_seen), "{name}: {named:?}");
    assert!(named.iter().all(|row| row.smoothed.is_some()), "{name} did not settle");
}

/// Takes the windows out of a case.
fn without_windows(folder: &TempDir) {
    let file = folder.path().join("case.toml");
    let text = fs::read_to_string(&file).expect("a case");
    let (before, _) = text.split_once("[windows]").expect("has windows");
    fs::write(&file, before).expect("writes");
}

#[test]
fn a_log_without_windows_is_parted_in_the_middle_and_a_healthy_one_is_given_no_name() {
    let folder = flown("tumble", 20.0, 3, &[], |_| true);
    without_windows(&folder);
    let flight = Flight::open(folder.path()).expect("opens");
    let held = flight.held.as_ref().expect("is judged");
    assert_eq!((flight.log.start_s.len(), held.start_s.len()), (300, 300));
    assert!(flight.log.start_s[299] < held.start_s[0]);
    let findings = Findings::of(&flight, &[], &|_, _| ()).expect("has redundancy");
    assert!(findings.names.is_empty(), "{:?}", findings.names);
    assert!(
        findings.visible.iter().all(|row| row.smoothed.is_some()),
        "did not settle"
    );
    let texts = analysed(folder.path(), &[], &|_, _| ()).expect("is analysed");
    let (_, screen) = texts.iter().find(|(name, _)| name == "all.txt").expect("a screen");
    assert!(screen.contains("WINDOWS none in case.toml"), "{screen}");
}

#[test]
fn windows_that_take_turns_are_not_used_for_no_motion_is_smoothed_across_what_lies_between() {
    let folder = flown("tumble", 20.0, 3, &[], |_| true);
    let open = |windows: &str| {
        without_windows(&folder);
        let file = folder.path().join("case.toml");
        let text = fs::read_to_string(&file).expect("a case");
        fs::write(&file, text + windows).expect("writes");
        let flight = Flight::open(folder.path()).expect("opens");
        let held = flight.held.as_ref().map_or(0, |held| held.start_s.len());
        (flight.windows.is_some(), flight.log.start_s.len(), held)
    };
    let one = open("[windows]\nfit = [[0.0, 80.0]]\nhold = [[80.0, 120.0]]\n");
    assert_eq!(one, (false, 400, 200));
    // As a flight's folder has them for its reference.
    let turns = open("[windows]\nfit = [[0.0, 30.0], [60.0, 90.0]]\nhold = [[30.0, 60.0], [90.0, 120.0]]\n");
    assert_eq!(turns, (true, 300, 300));
}

#[test]
fn a_boost_is_too_quick_for_the_packets_and_that_is_no_name_but_unknown() {
    let findings = found(&flown("rocket", 60.0, 3, &[], |_| true));
    assert!(findings.names.is_empty(), "{:?}", findings.names);
    assert_eq!(findings.outcome, Outcome::Unknown);
    // Its motion does not settle, and nothing is looked for about one that does not.
    assert!(findings.visible.iter().all(|row| row.smoothed.is_none()));
}

#[test]
fn a_magnet_on_one_plate_is_named_sized_and_said_to_rest_on_parity() {
    let folder = flown("tumble", 20.0, 4, &[iron("plate 3", [1.0, -0.8, 0.6])], |_| true);
    let texts = analysed(folder.path(), &[], &|_, _| ()).expect("an analysis");
    let text = |file: &str| &texts.iter().find(|(name, _)| name == file).expect(file).1;
    let verdict: Value = serde_json::from_str(text("verdict.json")).expect("is JSON");
    assert_eq!(
        (&verdict["format"], &verdict["from"]),
        (&"gap-verdict/2".into(), &"parity".into())
    );
    assert_eq!(verdict["causes"][0]["effect"], "hard-iron");
    assert_eq!(
        verdict["causes"][0]["channels"],
        serde_json::json!(["m3x", "m3y", "m3z"])
    );
    let parameters = verdict["causes"][0]["parameters"].as_object().expect("parameters");
    for (own, truth) in parameters.values().zip([1.0, -0.8, 0.6]) {
        let [value, sigma] = ["value", "sigma"].map(|key| own[key].as_f64().expect("a number"));
        assert!((value - truth).abs() < 4.0 * sigma, "{value} +- {sigma}, truth {truth}");
    }
    let never = verdict["never_named"].as_array().expect("a list");
    assert!(
        ["latency", "mounting"]
            .iter()
            .all(|name| never.contains(&(*name).into())),
        "{never:?}"
    );
    let screen = text("all.txt");
    assert!(screen.find("UNSEEN") < screen.find("CAUSE"), "{screen}");
    assert!(screen.contains("ATTITUDE"), "{screen}");
    let rows = text("attitude.csv").lines().count();
    assert_eq!(rows, 1 + 550, "a line a packet of the fit windows");
}

/// What a force does to each gyro: four of a size that parity, of which gyros have one, does not see.
fn felt() -> Active {
    Active {
        cause: Cause {
            effect: by_name("gyro-g-sensitivity").expect("an effect"),
            locality: Locality::All,
            variant: 0.0,
        },
        theta: [3.0, -2.0, 2.5, -1.5, 3.0, 2.0, -2.5, 1.0, 3.0, 2.0, -3.0, -1.5]
            .map(|k| 2e-4 * k)
            .to_vec(),
    }
}

#[test]
fn what_no_packet_shows_alone_is_named_about_the_smoothed_motion_and_sized() {
    let active = [felt()];
    let findings = found(&flown_in("tumble", 20.0, 4, (&active, &active), 60.0, |_| true));
    let [name] = findings.names.as_slice() else {
        panic!("{:?} or {:?}", findings.names, findings.alternatives);
    };
    assert_eq!((name.effect, name.by), ("gyro-g-sensitivity", By::Smoothing));
    for (own, truth) in name.parameters.iter().zip(&active[0].theta) {
        let (value, sigma) = (own.value, own.sigma);
        assert!((value - truth).abs() < 4.0 * sigma, "{value} +- {sigma}, truth {truth}");
    }
    let promise = name.promise.expect("the held-out windows are asked");
    assert!((promise.factor - 1.0).abs() < 4.0 * promise.sigma, "{promise:?}");
    assert_eq!(findings.outcome, Outcome::Named);
}

#[test]
fn what_the_held_out_windows_do_not_keep_is_not_named_by_smoothing() {
    let active = [felt()];
    let findings = found(&flown_in("tumble", 20.0, 4, (&active, &[]), 60.0, |_| true));
    assert!(findings.names.is_empty(), "{:?}", findings.names);
}

/// Accelerometers of one plate that lose gravity would turn the motion with them: it is made of the others, and is told.
#[test]
fn a_part_that_would_bend_the_motion_is_judged_about_that_of_the_others() {
    let active = [Active {
        cause: Cause {
            effect: by_name("accel-high-pass").expect("an effect"),
            locality: Locality::Group("plate 3".to_owned()),
            variant: 0.125,
        },
        theta: Vec::new(),
    }];
    let folder = flown_in("tumble", 20.0, 4, (&active, &active), 60.0, |_| true);
    let flight = Flight::open(folder.path()).expect("opens");
    let beforehand = beforehand::look(&flight, &[]).expect("packets");
    assert_eq!(flight.names(&beforehand.bending), ["a3x", "a3y", "a3z"]);
    let findings = found(&folder);
    let first = findings.names.first().expect("a name");
    assert_eq!(first.effect, "accel-high-pass", "{:?}", findings.names);
    assert_eq!(first.channels, beforehand.bending);
    let followed = Followed::of(&flight, &flight.log, &beforehand);
    assert!(followed.smoothed(&|_| ()).expect("a motion").is_settled());
}

/// A load that all gyros feel from an instant on, between those tried.
#[test]
fn a_step_is_found_where_it_is_and_is_no_walk() {
    let active = Active {
        cause: Cause {
            effect: by_name("gyro-supply").expect("an effect"),
            locality: Locality::All,
            // The log counts from 20 s on.
            variant: 63.0,
        },
        theta: vec![4e-3, 0.0, -3e-3, 0.0, 5e-3, 0.0, 3e-3, 0.0],
    };
    let findings = found(&flown("tumble", 20.0, 4, &[active], |_| true));
    let [name] = findings.names.as_slice() else {
        panic!("{:?} or {:?}", findings.names, findings.alternatives);
    };
    assert_eq!(name.effect, "gyro-supply");
    let which = name.which.as_deref().expect("when");
    assert!(["a step at 43 s", "a step at 42 s"].contains(&which), "{which}");
}

#[test]
fn what_is_found_beside_a_cause_does_not_speak_against_it() {
    let iron = iron("plate 3", [1.0, -0.8, 0.6]);
    let active = std::slice::from_ref(&iron);
    let folder = flown_in("tumble", 20.0, 4, (active, active), 60.0, |_| true);
    let flight = Flight::open(folder.path()).expect("opens");
    let held = flight.held.as_ref().expect("is judged");
    let followed = Followed::of(&flight, held, &Beforehand::default());
    let fitted = |active: &Active, sigma: f64| {
        let component = Component {
            active: active.clone(),
            span: None,
        };
        let width = active.theta.len();
        (component, DMatrix::from_diagonal_element(width, width, sigma * sigma))
    };
    let not_there = Active {
        cause: Cause {
            effect: by_name("soft-iron").expect("an effect"),
            locality: Locality::Group("plate 3".to_owned()),
            variant: 0.0,
        },
        theta: vec![0.05; 6],
    };
    let of = |causes: &[Fitted]| promises(&followed, causes, &|_| ()).expect("has promises");
    let [alone] = of(&[fitted(&iron, 0.05)])[..] else {
        panic!("one cause has one promise");
    };
    let beside = of(&[fitted(&iron, 0.05), fitted(&not_there, 0.01)]);
    assert_eq!(beside[0], alone);
    let [kept, refuted] = [beside[0], beside[1]].map(|promise| promise.expect("is there").factor);
    assert!((kept - 1.0).abs() < 0.2 && refuted.abs() < 0.2, "{beside:?}");
}

#[test]
fn one_plate_alone_has_no_parity_and_that_is_said() {
    let folder = flown("tumble", 20.0, 5, &[], |group| group == "plate 1");
    let error = analysed(folder.path(), &[], &|_, _| ())
        .expect_err("is refused")
        .to_string();
    assert!(
        error.contains("unit.toml") && error.contains("Parity is empty"),
        "{error}"
    );
}

#[test]
fn what_no_effect_of_the_library_explains_is_called_unknown() {
    let folder = flown("tumble", 20.0, 4, &[iron("plate 3", [1.0, -0.8, 0.6])], |_| true);
    let flight = Flight::open(folder.path()).expect("opens");
    let names = LIBRARY.iter().map(|effect| effect.page().name);
    let withheld: Vec<String> = names.filter(|name| *name != "latency").map(str::to_owned).collect();
    let findings = Findings::of(&flight, &withheld, &|_, _| ()).expect("has redundancy");
    assert!(findings.names.is_empty(), "{:?}", findings.names);
    assert!(findings.none_of_these > 0.5, "gap {:?}", findings.gap);
    assert_eq!(findings.outcome, Outcome::Unknown);
}

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    arguments: GapArguments,
}

#[test]
fn what_needs_a_reference_is_refused_with_a_word_of_what_to_do() {
    let folder = flown("still", 10.0, 3, &[], |_| true);
    let Err(error) = Subject::open(folder.path()) else {
        panic!("a reference where there is none");
    };
    assert!(error.to_string().contains("ground gap CASE"), "{error}");
    let path = folder.path().to_str().expect("a path");
    let line = Line::parse_from(["gap", path, "--against", path]);
    let error = run(&line.arguments).expect_err("is refused").to_string();
    assert!(error.contains("--against needs a case with a motion"), "{error}");
    let case = folder.path().join("case.toml");
    let text = fs::read_to_string(&case).expect("a case");
    fs::write(&case, format!("motion = \"motion.csv\"\n{text}")).expect("a file");
    let error = Flight::open(folder.path()).err().expect("is refused").to_string();
    assert!(error.contains("motion_known.none"), "{error}");
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    /// A line whose slow image is between two that were tried: halfway it has turned over at the end of the fit windows.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_line_of_the_mains_is_found_at_its_frequency_and_goes_on_in_the_held_out_windows() {
        let active = [Active {
            cause: Cause {
                effect: by_name("mains-alias").expect("an effect"),
                locality: Locality::Unit,
                variant: 50.012,
            },
            theta: vec![0.5, -0.3, 0.4, 0.2, 0.4, -0.5],
        }];
        for motion in ["tumble", "rate-table"] {
            let findings = found(&flown_in(motion, 20.0, 4, (&active, &active), 60.0, |_| true));
            let [name] = findings.names.as_slice() else {
                panic!("{motion}: {:?} or {:?}", findings.names, findings.alternatives);
            };
            assert_eq!(name.effect, "mains-alias");
            let promise = name.promise.expect("the held-out windows are asked");
            assert!(
                (promise.factor - 1.0).abs() < 0.2,
                "{motion}: {:?} {promise:?}",
                name.which
            );
        }
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_healthy_unit_at_rest_and_turning_is_given_no_name() {
        check_healthy("still", 10.0);
        check_healthy("tumble", 20.0);
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_healthy_unit_on_every_other_motion_is_given_no_name() {
        for (name, from_s) in [
            ("rate-table", 20.0),
            ("rotation-1", 10.0),
            ("rotation-2", 10.0),
            ("rocket", 120.0),
        ] {
            check_healthy(name, from_s);
        }
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn units_with_few_sensors_and_windows_without_rows_are_told_of_or_refused() {
        let folder = flown("tumble", 20.0, 3, &[], |_| true);
        let measured = fs::read_to_string(folder.path().join("measured.csv")).expect("a file");
        let said = |only: &dyn Fn(Kind) -> bool, most: usize| {
            let mut unit = emems(thesis_slot_s);
            unit.channels.retain(|channel| only(channel.sensor));
            unit.channels.truncate(most);
            fs::write(folder.path().join("unit.toml"), unit.text()).expect("a file");
            let is_kept = |name: &str| name == "t_s" || unit.channels.iter().any(|channel| channel.name == name);
            let heads: Vec<bool> = measured
                .lines()
                .next()
                .expect("a head")
                .split(',')
                .map(is_kept)
                .collect();
            let own = measured.lines().map(|line| {
                let cells = line.split(',').zip(&heads).filter(|(_, is_kept)| **is_kept);
                cells.map(|(cell, _)| cell).collect::<Vec<_>>().join(",") + "\n"
            });
            fs::write(folder.path().join("measured.csv"), own.collect::<String>()).expect("a file");
            analysed(folder.path(), &[], &|_, _| ()).map_err(|error| error.to_string())
        };
        let refused = |said: Result<Vec<(String, String)>, String>, why: &str| {
            let error = said.expect_err("is refused");
            assert!(error.contains(why), "{error}");
        };
        refused(said(&|kind| kind == Kind::Gyro, 3), "Parity is empty");
        refused(said(&|kind| kind == Kind::Thermometer, 4), "Parity is empty");
        for missing in [Kind::Magnetometer, Kind::Accelerometer, Kind::Gyro] {
            let texts = said(&|kind| kind != missing, usize::MAX).expect("has redundancy");
            let screen = texts.iter().find(|(name, _)| name == "all.txt").expect("a screen");
            assert!(screen.1.contains("ATTITUDE"), "{missing:?}: {}", screen.1);
            // Without gyros nobody knows how fast it turned, and what that leaves is not held against anything.
            let is_named = screen.1.contains("CAUSE");
            assert!(!is_named || missing == Kind::Gyro, "{missing:?}: {}", screen.1);
            let is_told = texts.iter().any(|(name, _)| name == "attitude.csv");
            assert!(!is_told || missing != Kind::Gyro, "{missing:?}: {}", screen.1);
        }
        let case = fs::read_to_string(folder.path().join("case.toml")).expect("a file");
        fs::write(
            folder.path().join("case.toml"),
            case.replace("[[0.0, 110.0]]", "[[500.0, 600.0]]"),
        )
        .expect("a file");
        refused(said(&|_| true, usize::MAX), "hold 0 rows");
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn what_is_another_motion_gets_no_name_and_leaves_no_gap() {
        for (effect, locality, theta) in [
            ("latency", Locality::Unit, vec![0.15]),
            ("gravity-value", Locality::Unit, vec![0.2]),
            ("accel-scale", Locality::Common, vec![0.05]),
            ("hard-iron", Locality::Common, vec![9.0, -8.0, 6.0]),
        ] {
            let cause = Cause {
                effect: by_name(effect).expect("an effect"),
                locality,
                variant: 0.0,
            };
            let findings = found(&flown("tumble", 20.0, 6, &[Active { cause, theta }], |_| true));
            let names: Vec<&str> = findings.names.iter().map(|name| name.effect).collect();
            assert!(findings.none_of_these < 0.5, "{effect}: gap {:?}", findings.gap);
            assert!(names.is_empty(), "{effect}: {names:?}");
            assert!((0.97..1.03).contains(&findings.gap[0]), "{effect}: {}", findings.gap[0]);
        }
    }
}
