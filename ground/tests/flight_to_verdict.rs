//! From a flight to a verdict: the folder of a flight is a gap case, what was done to the unit is found, and its twin flies.

use std::{
    fs,
    path::{Path, PathBuf},
};

use clap::Parser;
use flight::{interrupt::Interrupt, plan};
use gap::{
    against::against,
    command::{analysed, taught},
    diagnose::{Diagnosis, diagnose},
    input::case::{CaseError, Subject},
    kept::{Kept, text},
};
use ground::{
    case::{
        checked::checked,
        made::{self, made},
    },
    fly,
};
use twin::predict::UnitDescription;

#[derive(Parser)]
struct Words {
    #[command(flatten)]
    arguments: plan::FlyArguments,
}

#[derive(Parser)]
struct New {
    #[command(flatten)]
    arguments: made::NewCaseArguments,
}

/// Flies on the host board; the folder.
fn flown(out: &Path, words: &str) -> PathBuf {
    let all = ["fly", "--host", "--quiet", "--out"].into_iter().map(str::to_owned);
    let all = all
        .chain([out.display().to_string()])
        .chain(words.split(' ').map(str::to_owned));
    let words = Words::try_parse_from(all).unwrap_or_else(|error| panic!("{error}"));
    let landed = fly::flown(&words.arguments, &Interrupt::default()).unwrap_or_else(|error| panic!("{error}"));
    landed.folder
}

/// A set with a magnetometer on it, of a flight that turned every way.
fn calibrated(flight: &Path, set: &Path) {
    #[derive(Parser)]
    struct Words {
        #[command(flatten)]
        arguments: bench::calibrate::CalibrateArguments,
    }
    let (log, unit) = (flight.join("packets.txt"), flight.join("unit.toml"));
    let words = [
        "calibrate",
        "ellipsoid",
        &log.display().to_string(),
        "--channels=m1x,m1y,m1z",
        // Norm of the laboratory's field.
        "--strength=23.2uT",
        "--unit",
        &unit.display().to_string(),
        "--set",
        &set.display().to_string(),
        "--even-if-not-good",
    ]
    .map(str::to_owned);
    let words = Words::try_parse_from(words).unwrap_or_else(|error| panic!("{error}"));
    match bench::calibrate::run(&words.arguments) {
        Ok(()) | Err(bench::calibrate::CalibrateError::NotGood) => {}
        Err(error) => panic!("{error}"),
    }
}

fn diagnosed(case: &Path) -> (Subject, Diagnosis) {
    let subject = Subject::open(case).unwrap_or_else(|error| panic!("{error}"));
    let diagnosis = diagnose(&subject, &[], &|_, _| ());
    (subject, diagnosis)
}

/// The gap that noise and calibration errors make: biases are drawn with 0.45 of the noise, so 36 of them make the mean square
/// 1.2 +- 0.05.
const HEALTHY: std::ops::Range<f64> = 0.97..1.18;

#[test]
fn the_answer_is_kept_apart_and_an_analysis_until_the_case_changes() {
    let place = tempfile::tempdir().expect("a folder");
    let case = flown(place.path(), "--motion tumble --duration 60s --with accel-bias=0.4@a2");
    let answer = case.join("answer.toml");
    assert!(
        fs::read_to_string(&answer)
            .expect("an answer")
            .contains("\"accel-bias\"")
    );
    let spoken: Vec<String> = ["summary.txt", "index.html", "case.toml", "unit.toml"]
        .into_iter()
        .map(|name| fs::read_to_string(case.join(name)).expect(name))
        .collect();
    assert!(
        spoken.iter().all(|text| !text.contains("accel-bias")),
        "the answer is told elsewhere too"
    );
    let kept = || Kept::of(&case, &[]).expect("a case");
    let analysis = analysed(&case, &[]).expect("an analysis");
    kept().write(&analysis).expect("kept");
    fs::remove_file(&answer).expect("removed");
    let again = kept().read().expect("still there: an answer is no part of the case");
    assert_eq!(text(&again, "verdict.json"), text(&analysis, "verdict.json"));
    assert_eq!(
        text(&analysed(&case, &[]).expect("an analysis"), "verdict.json"),
        text(&analysis, "verdict.json"),
        "without the answer the verdict is the same"
    );
    let motion = fs::read_to_string(case.join("motion.csv")).expect("a motion");
    fs::write(case.join("motion.csv"), motion.replacen("25.0000", "25.0001", 1)).expect("written");
    assert!(kept().read().is_none());
}

#[test]
fn a_unit_is_flown_as_described_and_a_strange_one_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let case = flown(place.path(), "--motion tumble --duration 20s");
    let unit = UnitDescription::open(&case.join("unit.toml")).expect("a description");
    assert_eq!(unit.channels.len(), 36);
    assert!(
        unit.channels.iter().all(|channel| channel.slot_s.abs() < 0.03),
        "read within a conversion of the cycle's start"
    );
    let text = fs::read_to_string(case.join("unit.toml")).expect("a description");
    fs::write(case.join("unit.toml"), text.replacen("noise_sigma", "noise_sigmas", 1)).expect("written");
    let refused = Subject::open(&case)
        .err()
        .map(|error: CaseError| error.to_string())
        .unwrap_or_default();
    assert!(
        refused.contains("noise_sigmas") && refused.contains("is noise_sigma meant?"),
        "{refused}"
    );
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_real_log_and_its_reference_become_a_case_on_one_clock() {
        let place = tempfile::tempdir().expect("a folder");
        let flight = flown(
            place.path(),
            "--motion tumble --duration 100s --derived --seed 9 --reference optical",
        );
        // As a camera system writes: its own clock in milliseconds, east-north-up, millimetres, semicolons.
        let late_s = 7.25;
        let motion = fs::read_to_string(flight.join("motion.csv")).expect("a motion");
        let mut camera = String::from("time;qw;qx;qy;qz;x;y;z\n");
        let half = 0.5_f64.sqrt();
        let to_enu = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(0.0, half, half, 0.0));
        for line in motion.lines().skip(1) {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
            let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
                cells[1], cells[2], cells[3], cells[4],
            ));
            let q = to_enu * q;
            let millis = 1e3 * (cells[0] + late_s);
            let place = to_enu * nalgebra::Vector3::new(cells[5], cells[6], cells[7]) * 1e3;
            camera.push_str(&format!(
                "{millis:.3};{};{};{};{};{:.4};{:.4};{:.4}\n",
                q.w, q.i, q.j, q.k, place.x, place.y, place.z
            ));
        }
        let camera_file = place.path().join("camera.csv");
        fs::write(&camera_file, camera).expect("a reference");
        let case = place.path().join("case");
        let arguments = |out: &Path, more: &[&str]| {
            let log = flight.join("packets.txt").display().to_string();
            let (reference, out) = (camera_file.display().to_string(), out.display().to_string());
            let fixed = [
                "new",
                "--log",
                &log,
                "--reference",
                &reference,
                "--out",
                &out,
                "--latitude-deg=-23.2111",
            ];
            New::try_parse_from([&fixed[..], more].concat())
                .unwrap_or_else(|error| panic!("{error}"))
                .arguments
        };
        let said = made(&arguments(&case, &[])).unwrap_or_else(|error| panic!("{error}"));
        assert!(said.contains("Enu") && said.contains("in millimetres"), "{said}");
        let told = said.split_once("reference minus log ").expect("clocks").1;
        let offset_s: f64 = told
            .split(' ')
            .next()
            .and_then(|number| number.parse().ok())
            .expect("an offset");
        let sigma_s: f64 = told
            .split(' ')
            .nth(2)
            .and_then(|number| number.parse().ok())
            .expect("a sigma");
        assert!((offset_s - late_s).abs() < 4.0 * sigma_s && sigma_s < 3e-3, "{said}");
        let (_, diagnosis) = diagnosed(&case);
        let named: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect).collect();
        assert!(named.is_empty() && diagnosis.gap < 1.2, "{named:?} {}", diagnosis.gap);
        assert!(!diagnosis.is_unexplained(), "{}", diagnosis.none_of_these);
        let whole = checked(&case);
        assert!(whole.is_whole() && !whole.text().contains("look"), "{}", whole.text());

        // With what `calibrate` says of a magnetometer, the case has its parameters and how well they are known.
        let set = place.path().join("set.toml");
        calibrated(&flight, &set);
        let with_set = place.path().join("with-set");
        let said = made(&arguments(&with_set, &["--set", &set.display().to_string()]))
            .unwrap_or_else(|error| panic!("{error}"));
        assert!(said.contains("3 channels and their sigmas"), "{said}");
        let [before, after] = [&case, &with_set].map(|folder| {
            let unit = UnitDescription::open(&folder.join("unit.toml")).expect("a description");
            unit.channels[unit.channel("m1x").expect("a channel")].clone()
        });
        assert!(
            after.bias_sigma < before.bias_sigma && after.bias_sigma > 0.0,
            "{after:?}"
        );
        assert!((after.lsb / before.lsb - 1.0).abs() < 0.05 && after.lsb != before.lsb);
        let (_, diagnosis) = diagnosed(&with_set);
        assert!(diagnosis.causes.is_empty() && diagnosis.gap < 1.2, "{}", diagnosis.gap);

        // A clock that is off is said to be.
        let off = place.path().join("off");
        made(&arguments(&off, &["--offset-s=7.35"])).unwrap_or_else(|error| panic!("{error}"));
        assert!(self::checked(&off).text().contains("take that off"));
        // A log of another run is none.
        let other = flown(place.path(), "--motion hand --duration 60s");
        let mut strange = arguments(&place.path().join("strange"), &[]);
        strange.log = other.join("packets.txt");
        let refused = made(&strange).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(refused.contains("not alike at any offset"), "{refused}");
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn an_undisturbed_flight_is_a_case_without_a_gap_whatever_recorded_it() {
        let place = tempfile::tempdir().expect("a folder");
        for reference in ["exact", "optical", "table"] {
            let words = format!("--motion tumble --duration 120s --seed 3 --reference {reference}");
            let case = flown(place.path(), &words);
            let (_, diagnosis) = diagnosed(&case);
            let named: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect).collect();
            assert!(named.is_empty(), "{reference}: {named:?}");
            assert!(!diagnosis.is_unexplained(), "{reference}: {}", diagnosis.none_of_these);
            assert!(HEALTHY.contains(&diagnosis.gap), "{reference}: {}", diagnosis.gap);
            let shrink = &diagnosis.shrink;
            // Four standard errors of the root mean square of 10,000 samples.
            let noise = 4.0 / (2.0 * 10_000.0_f64).sqrt();
            let above = shrink.recalibrated / shrink.floor - 1.0;
            // What a camera puts into forces and rates is told from the octave above, which white noise fills the most: too much.
            // Were nothing left in these 16 of the 32 channels, this would be the root of a half.
            let below = if reference == "optical" {
                0.5_f64.sqrt() - 1.0
            } else {
                -noise
            };
            assert!(
                (below..noise).contains(&above),
                "{reference}: {} {}",
                shrink.recalibrated,
                shrink.floor
            );
        }
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn what_was_done_to_the_unit_is_named_corrected_and_flown_as_a_twin() {
        let place = tempfile::tempdir().expect("a folder");
        let with = "--with gyro-scale=0.02@g2 --seed 4 --reference optical";
        let case = flown(place.path(), &format!("--motion tumble --duration 150s {with}"));
        let (subject, diagnosis) = diagnosed(&case);
        let cause = diagnosis.causes.first().expect("a cause");
        assert_eq!(cause.effect, "gyro-scale", "{:?}", diagnosis.alternatives);
        assert_eq!(subject.names(cause.channels.iter().copied()), ["g2"]);
        let size = &cause.parameters[0];
        assert!(
            (size.value - 0.02).abs() < 4.0 * size.sigma,
            "{} +- {}",
            size.value,
            size.sigma
        );

        // Another flight of the same unit, which was not diagnosed: before and after.
        let corrected = taught(&subject, &diagnosis);
        let other = flown(
            place.path(),
            &format!("--motion hand --duration 120s --flight 1 {with}"),
        );
        let compared = against(&other, &corrected).expect("a case");
        let gyros = compared.pairs.iter().find(|pair| pair.name == "gyros").expect("gyros");
        assert!(gyros.before > 1.4 && gyros.after < 1.1, "{:?}", compared.pairs);

        // The twin itself as registers: its flight has the effect, and its own description predicts it.
        let file = place.path().join("corrected.toml");
        fs::write(&file, corrected.text()).expect("a description");
        let motion = case.join("motion.csv");
        let words = format!(
            "--motion-file {} --unit {} --duration 120s --seed 4",
            motion.display(),
            file.display()
        );
        let twin = flown(place.path(), &words);
        let nominal = Subject::open_with(&twin, |unit| unit.effects.clear()).expect("a case");
        let seen = diagnose(&nominal, &[], &|_, _| ());
        assert_eq!(seen.causes.first().map(|cause| cause.effect), Some("gyro-scale"));
        let (_, own) = diagnosed(&twin);
        assert!(own.causes.is_empty() && HEALTHY.contains(&own.gap), "{}", own.gap);
    }

    /// At rest a camera's rate is its noise, and the residual minus that: a factor of -1, of all gyros.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_table_that_rests_between_its_turns_has_no_factor_before_a_camera() {
        let place = tempfile::tempdir().expect("a folder");
        let (_, diagnosis) = diagnosed(&flown(place.path(), "--motion rotation-1 --reference optical"));
        assert!(diagnosis.causes.is_empty(), "{:?}", diagnosis.causes);
        assert!(!diagnosis.is_unexplained(), "{}", diagnosis.none_of_these);
    }
}
