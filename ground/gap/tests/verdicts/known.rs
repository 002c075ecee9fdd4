//! What is known of a motion that nobody recorded: a track on a clock of its own, and a trajectory that was simulated.

use std::{fmt::Write, fs, path::Path};

use crate::twin_case::Log;
use gap::parity::{
    analysed, codes,
    flight::Flight,
    followed::{Beforehand, Followed},
    known::{simulated::Belief, ties::Use},
    smooth::told::Told,
};
use nalgebra::{UnitQuaternion, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use serde_json::Value;
use tempfile::TempDir;
use twin::{
    environment::Environment,
    kinematics::{Attitude, Motion, Pose, Profile},
};

/// \[s\] of a log.
const SECONDS: f64 = 100.0;

/// \[s\] the track's clock is behind the log's.
const OFFSET_S: f64 = 37.4;

/// \[m\] one sigma of a fix along each axis.
const SIGMA_M: f64 = 3.0;

/// 15 s on a rail, 12 s of a push of four times gravity up and to the north, then free fall, slowly turning.
struct Thrown {
    along: [Profile; 3],
    angles: [Profile; 3],
    /// \[s\] when the push ends.
    burnt_s: f64,
}

impl Thrown {
    /// Whose push takes so many seconds.
    fn new(pushed_s: f64) -> Self {
        let from_rest = |value: f64| Profile::from_rest(value).coast(15.0);
        let pushed = |rate: f64| from_rest(0.0).ramp_to_rate(rate, pushed_s).coast(90.0);
        Self {
            along: [pushed(130.0), pushed(-20.0), pushed(-450.0)],
            angles: [
                from_rest(0.2).ramp_to_rate(0.25, 20.0).coast(90.0),
                from_rest(1.2).move_to(0.5, 50.0).coast(90.0),
                from_rest(0.4).ramp_to_rate(-0.05, 20.0).coast(90.0),
            ],
            burnt_s: 15.0 + pushed_s,
        }
    }

    /// [m/s2] and \[m\] that gravity gives it, from burn-out on within a second whole.
    fn fallen(&self, t_s: f64) -> [f64; 2] {
        let gravity = Environment::alcantara().gravity;
        let (begun, whole) = (
            (t_s - self.burnt_s).clamp(0.0, 1.0),
            (t_s - self.burnt_s - 1.0).max(0.0),
        );
        [
            gravity * begun,
            gravity * (begun.powi(3) / 6.0 + 0.5 * whole + 0.5 * whole.powi(2)),
        ]
    }
}

impl Motion for Thrown {
    fn at(&self, t_s: f64) -> Pose {
        let [roll, pitch, yaw] = [0, 1, 2].map(|axis| self.angles[axis].at(t_s));
        let acc = |axis: usize| self.along[axis].at(t_s).acc;
        Pose {
            acc_n: Vector3::new(acc(0), acc(1), acc(2) + self.fallen(t_s)[0]),
            ..Pose::turning(Attitude::level().yawed(yaw).pitched(pitch).rolled(roll))
        }
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }

    fn position_n(&self, t_s: f64) -> Vector3<f64> {
        let [x, y, z] = [0, 1, 2].map(|axis| self.along[axis].at(t_s).value);
        Vector3::new(x, y, z + self.fallen(t_s)[1])
    }
}

/// Of a flight whose log is of one push, with these other lines in case.toml.
fn flown(seed: u64, more: &str) -> (TempDir, Thrown) {
    let motion = Thrown::new(12.0);
    let windows = format!("[windows]\nfit = [[0.0, 90.0]]\nhold = [[90.0, 100.0]]\n{more}");
    let (site, span_s) = (Environment::alcantara(), (0.0, SECONDS));
    let folder = Log::nominal(&motion, site, span_s).folder("thrown", noise(seed), "", &windows);
    (folder, motion)
}

fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    move || StandardNormal.sample(&mut random)
}

const TRACK: &str = "[motion_known]\ntrack = \"track.csv\"\n";

/// A track of a motion, one fix a second, beside a case.
fn tracked(folder: &Path, motion: &Thrown, sigma_m: f64) {
    let mut normal = noise(7);
    let mut text = "t_s,px_m,py_m,pz_m,sx_m,sy_m,sz_m\n".to_owned();
    for second in 0..100 {
        let t_s = f64::from(second) + 0.3;
        let seen =
            motion.position_n(t_s) + Vector3::new(200.0, -50.0, -40.0) + sigma_m * Vector3::from_fn(|_, _| normal());
        let [x, y, z] = seen.into();
        let _ = writeln!(
            text,
            "{:.3},{x:.3},{y:.3},{z:.3},{SIGMA_M},{SIGMA_M},{SIGMA_M}",
            t_s - OFFSET_S
        );
    }
    fs::write(folder.join("track.csv"), text).expect("a track");
}

fn told(folder: &TempDir) -> Told {
    let flight = Flight::open(folder.path()).expect("opens");
    let coded = codes::look(&flight.log, &flight.unit);
    Told::along(&Followed::of(&flight, &flight.log, &Beforehand::found(&coded)), &|_| ()).expect("follows")
}

/// Error and stated sigma of an attitude as root mean squares \[deg\].
fn off(told: &Told, motion: &Thrown) -> (f64, f64) {
    let (mut error, mut stated) = (0.0, 0.0);
    for own in &told.attitudes {
        error += own
            .q_nb
            .angle_to(&motion.at(own.t_s).attitude.q_nb)
            .to_degrees()
            .powi(2);
        stated += own.sigmas_b_deg.norm_squared();
    }
    let count = told.attitudes.len() as f64;
    ((error / count).sqrt(), (stated / count).sqrt())
}

#[test]
fn a_track_on_another_clock_holds_the_attitude_and_tells_its_offset() {
    let (folder, motion) = flown(1, TRACK);
    tracked(folder.path(), &motion, SIGMA_M);
    let with = told(&folder);
    let (found, sigma_s) = with.track.expect("is known");
    println!("{}", found.line(sigma_s));
    let Use::Used(fit) = found else {
        panic!("{found:?}");
    };
    let sigma_s = sigma_s.expect("the push shows the clock");
    assert!((fit.offset_s - OFFSET_S).abs() < 4.0 * sigma_s, "{fit:?} {sigma_s}");
    assert!(sigma_s < 0.05 && (0.8..1.2).contains(&fit.gap), "{fit:?} {sigma_s}");
    forget(&folder);
    let without = told(&folder);
    let (own, alone) = (off(&with, &motion), off(&without, &motion));
    println!("with {own:?} without {alone:?}");
    assert!(own.1 < 0.9 * alone.1 && own.0 < 2.5 * own.1, "{own:?} {alone:?}");
}

/// Says that nothing is known of the motion of a case.
fn forget(folder: &TempDir) {
    let case = folder.path().join("case.toml");
    let text = fs::read_to_string(&case).expect("a case");
    let (before, _) = text.split_once("[motion_known]").expect("knows something");
    fs::write(&case, before).expect("writes");
}

#[test]
fn a_track_of_another_flight_is_not_used_and_said_so() {
    let (folder, _) = flown(1, TRACK);
    tracked(folder.path(), &Thrown::new(20.0), SIGMA_M);
    let with = told(&folder);
    let (found, sigma_s) = with.track.expect("is known");
    println!("{}", found.line(sigma_s));
    assert!(matches!(found, Use::Misfit(_) | Use::Unsettled), "{found:?}");
    assert!(found.line(sigma_s).contains("not used") && found.line(sigma_s).contains("of another flight"));
    // Nothing of it is left in the attitude.
    forget(&folder);
    let alone = told(&folder);
    assert_eq!(with.csv(), alone.csv());
}

#[test]
fn a_track_whose_sigmas_are_too_small_is_not_used() {
    let (folder, motion) = flown(1, TRACK);
    tracked(folder.path(), &motion, 2.0 * SIGMA_M);
    let told = told(&folder);
    let (found, _) = told.track.expect("is known");
    assert!(
        matches!(found, Use::Misfit(fit) if (1.8..2.2).contains(&fit.gap)),
        "{found:?}"
    );
    // The page shows how it lies all the same.
    let squares: f64 = told.beside_track.iter().map(|own| own.off_n.norm_squared() / 3.0).sum();
    let size = (squares / told.beside_track.len() as f64).sqrt();
    assert!((1.7..2.2).contains(&size), "{size}");
    assert!(told.track_figure().expect("is drawn").is_some());
}

/// A trajectory as it was simulated before the flight, its heading off by some degrees, beside a case.
fn simulated(folder: &Path, motion: &Thrown, late_s: f64, heading_deg: f64) {
    let mut text = "t_s,qw,qx,qy,qz,px_m,py_m,pz_m\n".to_owned();
    let about_down = UnitQuaternion::from_scaled_axis(Vector3::z() * heading_deg.to_radians());
    for step in -20..2040 {
        let t_s = f64::from(step) * 0.05;
        let (q_nb, p) = (
            about_down * motion.at(t_s - late_s).attitude.q_nb,
            about_down * motion.position_n(t_s - late_s),
        );
        let q = q_nb.quaternion();
        let _ = writeln!(
            text,
            "{t_s:.2},{:.8},{:.8},{:.8},{:.8},{:.4},{:.4},{:.4}",
            q.w, q.i, q.j, q.k, p.x, p.y, p.z
        );
    }
    fs::write(folder.join("trajectory.csv"), text).expect("a trajectory");
}

const SIMULATED: &str = "[motion_known]\nsimulated = \"trajectory.csv\"\n[motion_known.distrust]\n\
    rest = { attitude_deg = 1.0, acceleration_m_s2 = 0.1 }\nthrust = { attitude_deg = 1.0, acceleration_m_s2 = 3.0 }\n\
    coast = { attitude_deg = 2.0 }\n";

#[test]
fn a_simulated_trajectory_holds_the_motion_no_further_than_it_is_trusted() {
    let (folder, motion) = flown(1, SIMULATED);
    simulated(folder.path(), &motion, 0.0, 0.5);
    let with = told(&folder);
    let belief = with.belief.expect("is known");
    println!("{}", belief.line());
    assert!(
        matches!(belief, Belief::Used { chance, .. } if chance > 0.01),
        "{belief:?}"
    );
    forget(&folder);
    let alone = told(&folder);
    let (own, alone) = (off(&with, &motion), off(&alone, &motion));
    println!("with {own:?} without {alone:?}");
    // Rows of a phase know no more than one: the sigma does not collapse to a thousandth of the distrust.
    assert!(
        (0.3 * alone.1..alone.1).contains(&own.1) && own.0 < 2.5 * own.1,
        "{own:?} {alone:?}"
    );
}

#[test]
fn a_simulated_trajectory_of_another_flight_is_refused_plainly() {
    let (folder, motion) = flown(1, SIMULATED);
    let other = Thrown::new(20.0);
    for (motion, late_s, heading_deg, what) in [
        (&other, 0.0, 0.0, "in thrust its acceleration"),
        (&motion, 4.0, 0.0, "in coast its attitude"),
        (&motion, 0.0, 15.0, "its attitude"),
    ] {
        simulated(folder.path(), motion, late_s, heading_deg);
        let with = told(&folder);
        let line = with.belief.expect("is known").line();
        println!("{line}");
        assert!(
            line.contains("this trajectory is not of this flight") && line.contains(what),
            "{line}"
        );
        assert!(with.csv().is_some());
    }
}

#[test]
fn what_does_not_go_together_is_refused_naming_file_and_key() {
    let refused = |more: &str, track: Option<&str>| {
        let (folder, motion) = flown(1, more);
        simulated(folder.path(), &motion, 0.0, 0.0);
        if let Some(track) = track {
            fs::write(folder.path().join("track.csv"), track).expect("a track");
        }
        let error = Flight::open(folder.path()).err().expect("is refused");
        error.to_string()
    };
    let both = refused("[motion_known]\nnone = true\ntrack = \"track.csv\"\n", None);
    assert!(
        both.contains("case.toml: motion_known.none: says that nothing is known"),
        "{both}"
    );
    let bare = refused("[motion_known]\nsimulated = \"trajectory.csv\"\n", None);
    assert!(
        bare.contains("motion_known.simulated: needs how far each phase"),
        "{bare}"
    );
    let none = refused(&SIMULATED.replace("= 1.0", "= 0.0"), None);
    assert!(
        none.contains("motion_known.distrust: has a size that is not above zero"),
        "{none}"
    );
    let absent = refused(TRACK, None);
    assert!(absent.contains("track.csv: cannot be read"), "{absent}");
    let header = "t_s,px_m,py_m,pz_m,sx_m,sy_m,sz_m\n";
    let short = refused(TRACK, Some(&format!("{header}0,0,0,0,1,1,1\n1,0,0,0,1,1,1\n")));
    assert!(short.contains("track.csv: rows: are 2; a track needs 8"), "{short}");
    let sigma = refused(TRACK, Some(&format!("{header}0,0,0,0,1,1,1\n1,0,0,0,1,0,1\n")));
    assert!(
        sigma.contains("track.csv: line 3, sx_m, sy_m, sz_m: hold a sigma"),
        "{sigma}"
    );
}

/// `attitude_at` of a motion at these instants, turned by some degrees about the vertical, as angles and as a quaternion by turns.
fn pointed(motion: &Thrown, instants: &[(f64, f64)], sigma_deg: f64) -> String {
    let mut text = String::new();
    for (at, (t_s, heading_deg)) in instants.iter().enumerate() {
        let about_down = UnitQuaternion::from_scaled_axis(Vector3::z() * heading_deg.to_radians());
        let q_nb = about_down * motion.at(*t_s).attitude.q_nb;
        let _ = writeln!(text, "[[motion_known.attitude_at]]\nt_s = {t_s}");
        let _ = if at % 2 == 0 {
            let (roll, pitch, yaw) = q_nb.euler_angles();
            let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
            writeln!(
                text,
                "azimuth_deg = {yaw}\nazimuth_sigma_deg = {sigma_deg}\nelevation_deg = {pitch}\nelevation_sigma_deg = {sigma_deg}\n\
                 roll_deg = {roll}\nroll_sigma_deg = {sigma_deg}"
            )
        } else {
            let q = q_nb.quaternion();
            writeln!(
                text,
                "q_nb = [{}, {}, {}, {}]\nsigmas_deg = [{sigma_deg}, {sigma_deg}, {sigma_deg}]",
                q.w, q.i, q.j, q.k
            )
        };
    }
    text
}

#[test]
fn attitudes_at_some_instants_hold_the_motion_and_one_that_is_wrong_is_left_out_and_named() {
    let motion = Thrown::new(12.0);
    let (folder, motion) = flown(1, &pointed(&motion, &[(5.0, 0.0), (45.0, 0.0), (70.0, 25.0)], 0.1));
    let with = told(&folder);
    let kept = with.kept.clone().expect("is known");
    let flight = Flight::open(folder.path()).expect("opens");
    println!("{}", with.known_lines(&flight.known));
    assert_eq!(
        kept.iter().map(|own| own.is_used).collect::<Vec<_>>(),
        [true, true, false]
    );
    let lines = with.known_lines(&flight.known);
    assert!(lines.contains("the attitude at 70.0 s is not used"), "{lines}");
    assert_eq!(with.known_json(&flight.known)["attitude_at"][2]["is_used"], false);
    let alone = told(&flown(1, "").0);
    let (own, alone) = (off(&with, &motion), off(&alone, &motion));
    println!("with {own:?} without {alone:?}");
    assert!(own.1 < 0.8 * alone.1 && own.0 < 2.5 * own.1, "{own:?} {alone:?}");
    // At the instant itself it is known to a tenth of a degree about each axis.
    let at = with
        .attitudes
        .iter()
        .find(|own| (own.t_s - 45.0).abs() < 0.1)
        .expect("a row");
    assert!(at.sigmas_b_deg.amax() < 0.11, "{at:?}");
}

#[test]
fn an_attitude_that_cannot_be_is_refused_with_its_key() {
    let good =
        "t_s = 5.0\nazimuth_deg = 70.0\nazimuth_sigma_deg = 0.5\nelevation_deg = 85.0\nelevation_sigma_deg = 0.5\n";
    let (folder, _) = flown(1, &format!("[[motion_known.attitude_at]]\n{good}"));
    Flight::open(folder.path()).expect("opens");
    let case = folder.path().join("case.toml");
    let text = fs::read_to_string(&case).expect("a case");
    for (before, after, key) in [
        ("elevation_deg = 85.0", "elevation_deg = 95.0", "elevation_deg"),
        (
            "azimuth_sigma_deg = 0.5",
            "azimuth_sigma_deg = 0.0",
            "azimuth_sigma_deg",
        ),
        ("azimuth_sigma_deg = 0.5\n", "", "azimuth_sigma_deg"),
        ("azimuth_deg = 70.0\nazimuth_sigma_deg = 0.5\n", "", "azimuth_deg"),
        ("t_s = 5.0", "t_s = 5.0\nq_nb = [1.0, 0.0, 0.0, 0.0]", "q_nb"),
        (
            good,
            "t_s = 5.0\nq_nb = [1.0, 1.0, 0.0, 0.0]\nsigmas_deg = [1.0, 1.0, 1.0]\n",
            "q_nb",
        ),
        (good, "t_s = 5.0\nq_nb = [1.0, 0.0, 0.0, 0.0]\n", "sigmas_deg"),
        (
            good,
            "t_s = 5.0\nq_nb = [1.0, 0.0, 0.0, 0.0]\nsigmas_deg = [1.0, -1.0, 1.0]\n",
            "sigmas_deg",
        ),
        ("t_s = 5.0", "t_s = nan", "t_s"),
        ("t_s = 5.0", "t_s = 5.0\nazimut_deg = 3.0", "azimut_deg"),
    ] {
        assert!(text.contains(before), "{before}");
        fs::write(&case, text.replace(before, after)).expect("writes");
        let error = Flight::open(folder.path()).err().expect("is refused").to_string();
        assert!(error.contains("case.toml") && error.contains(key), "{key}: {error}");
    }
    let none = text.replace("[[motion_known", "[motion_known]\nnone = true\n[[motion_known");
    fs::write(&case, none).expect("writes");
    let error = Flight::open(folder.path()).err().expect("is refused").to_string();
    assert!(error.contains("motion_known.none"), "{error}");
}

#[test]
fn windows_in_free_fall_alone_say_that_a_turn_about_the_field_is_hardly_known() {
    // From 32 s on it falls freely: the field tells two axes, and gyros tie the instants.
    let motion = Thrown::new(12.0);
    let of = |fit: &str, more: &str| {
        let windows = format!("[windows]\nfit = {fit}\nhold = [[90.0, 100.0]]\n{more}");
        let span_s = (0.0, SECONDS);
        let log = Log::nominal(&motion, Environment::alcantara(), span_s);
        told(&log.folder("thrown", noise(1), "", &windows))
    };
    let falling = of("[[32.0, 90.0]]", "");
    let (error, stated) = off(&falling, &motion);
    println!("in free fall alone: off {error}, stated {stated}");
    assert!(
        !falling.attitudes.is_empty() && error < 3.0 * stated,
        "{error} {stated}"
    );
    let whole = off(&of("[[0.0, 90.0]]", ""), &motion);
    println!("from the pad on: {whole:?}");
    assert!(whole.0 < 3.0 * whole.1 && whole.1 < 1.0, "{whole:?}");
    // So an attitude that is known at one instant is believed.
    let pointed = of("[[32.0, 90.0]]", &pointed(&motion, &[(60.0, 0.0)], 0.2));
    let own = off(&pointed, &motion);
    println!("with one attitude: {own:?} {:?}", pointed.kept);
    assert!(own.0 < 3.0 * own.1 && own.1 < 1.0, "{own:?}");
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn the_screen_and_the_verdict_say_what_became_of_what_is_known() {
        let known = SIMULATED.replace("[motion_known]\n", TRACK);
        let (folder, motion) = flown(2, &known);
        tracked(folder.path(), &motion, SIGMA_M);
        simulated(folder.path(), &motion, 0.0, 0.5);
        let texts = analysed(folder.path(), &[], &|_, _| ()).expect("is judged");
        let text = |name: &str| &texts.iter().find(|(own, _)| own == name).expect("is there").1;
        println!("{}", text("all.txt"));
        assert!(text("all.txt").contains("NOMINAL the simulated trajectory: holds the motion"));
        assert!(text("all.txt").contains("TRACK   89 fixes") || text("all.txt").contains("TRACK   90 fixes"));
        let verdict: Value = serde_json::from_str(text("verdict.json")).expect("JSON");
        assert_eq!(verdict["motion_known"]["track"]["is_used"], true);
        assert_eq!(verdict["motion_known"]["simulated"]["is_used"], true);
        let offset = verdict["motion_known"]["track"]["clock_offset_s"]["value"]
            .as_f64()
            .expect("a number");
        assert!((offset - OFFSET_S).abs() < 0.03, "{offset}");
        let phases = verdict["phases"].as_array().expect("a list");
        assert_eq!(verdict["phases_from"], "found");
        let of = |name: &str| {
            let own = phases.iter().find(|own| own["phase"] == name).expect("is there");
            ["from_s", "to_s"].map(|key| own[key].as_f64().expect("a number"))
        };
        // Half a second of pushing as hard as gravity comes later and goes sooner.
        let ([lit_s, burnt_s], [coasts_s, _]) = (of("thrust"), of("coast"));
        assert!((15.0..18.0).contains(&lit_s) && (24.0..28.5).contains(&burnt_s) && (coasts_s - burnt_s).abs() < 1e-9);
        // A healthy unit is given no name, with or without a track.
        assert!(verdict["causes"].as_array().expect("a list").is_empty(), "{verdict}");
        assert!(text("index.html").contains("NOMINAL"));
        assert!(text("index.html").contains("The track beside the motion that it holds"));
    }
}
