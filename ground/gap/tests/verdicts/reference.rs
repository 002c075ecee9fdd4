//! Names beside a reference that errs slowly: three gyros whose table is told to 3 mrad.

use std::{f64::consts::TAU, fs};

use crate::gyros::{RATE_HZ, SECONDS, diagnosed_in, erring, rate, rewritten};
use gap::{
    input::case::{SlowErrors, Subject},
    library::hypotheses::Library,
    null::{model::Model, problem::Problem},
    search::{
        in_colour::attribute_in_colour,
        readings::{Chosen, attribute},
    },
    unknown::{
        fast::within_stretches,
        recognised::recognised,
        remainder::{Setting, remainder},
    },
};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use tempfile::TempDir;

/// gz reads `error` [rad/s] of the time \[s\] too much.
fn beside_reference(error: impl Fn(f64) -> f64) -> TempDir {
    let folder = erring(error, "");
    let file = folder.path().join("case.toml");
    let case = fs::read_to_string(&file).expect("a file");
    let reference = "[reference]\nattitude_sigma_rad = 0.003\nattitude_correlation_s = 20.0\n";
    fs::write(&file, case + reference).expect("a file");
    folder
}

/// What is left is judged with nothing found on the scatter.
fn setting(subject: &Subject) -> Setting<'_> {
    Setting {
        slow: &subject.slow,
        bars: &subject.bars,
        louder: &[1.0; 3],
        scattered: &[],
        wandering: &[],
    }
}

/// What is recognised where nothing was found, by name.
fn seen(error: impl Fn(f64) -> f64) -> Option<(&'static str, Chosen)> {
    let folder = beside_reference(error);
    let subject = Subject::open(folder.path()).expect("opens");
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let library = Library::new(&problem, &[], &|_| {});
    let quiet = Model::around(&problem, Vec::new());
    let chosen = recognised(&problem, &library, &quiet, &[], &setting(&subject))?;
    Some((library.hypotheses[chosen.hypothesis].effect(), chosen))
}

/// A bias is one number, and a free course that says the same has thirty-two.
#[test]
fn a_slow_error_with_the_law_of_an_effect_is_recognised_and_another_is_not() {
    let (name, chosen) = seen(|_| 0.01).expect("a bias of ten sigmas");
    assert_eq!(name, "gyro-bias");
    // The calibration takes up its part: a twenty-sixth, for the prior that fits best is five of its sigmas.
    assert!((chosen.theta[0] - 0.01).abs() < 0.001, "{}", chosen.theta);
    assert!(chosen.rivals.iter().any(|rival| !rival.is_named));
    // No effect switches its sign twice at instants of its own.
    let switched = |t_s: f64| if (37.0..81.0).contains(&t_s) { 0.01 } else { -0.01 };
    let other = seen(switched).map(|(name, _)| name);
    assert_eq!(other, None);
    assert!(seen(|_| 0.0).is_none());
}

/// A search gives an effect the size that it has where the calibration could take its place too. Both are priors about zero that share what they
/// explain by their variances: to a bias of 0.1 rad/s beside a calibration of 0.01 the usual size of 0.01 leaves a half, five times that
/// 25/26.
#[test]
fn a_search_leaves_a_large_effect_its_size_beside_the_calibration() {
    let folder = beside_reference(|_| 0.1);
    let file = folder.path().join("unit.toml");
    let unit = fs::read_to_string(&file).expect("a file");
    fs::write(&file, unit.replace("bias_sigma = 0.001", "bias_sigma = 0.01")).expect("a file");
    let subject = Subject::open(folder.path()).expect("opens");
    let mut problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let mut library = Library::new(&problem, &[], &|_| {});
    let found = attribute(&problem, &mut library, &|_| {});
    let found = attribute_in_colour(&mut problem, &mut library, &subject.slow, found, &|_| {});
    let chosen = found.chosen.first().expect("a bias of ten sigmas");
    assert_eq!(library.hypotheses[chosen.hypothesis].effect(), "gyro-bias");
    assert!((chosen.theta[0] - 0.1 * 25.0 / 26.0).abs() < 0.002, "{}", chosen.theta);
}

/// What counts against a name beside such a reference: a tone of seven sigmas, and not as much that is slow, which courses judge.
#[test]
fn what_is_fast_has_energy_within_stretches_and_what_is_slow_has_not() {
    let energy = |error: &dyn Fn(f64) -> f64| {
        let folder = beside_reference(error);
        let subject = Subject::open(folder.path()).expect("opens");
        let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
        let floor: Vec<Vec<f64>> = problem.sigmas.iter().map(|own| vec![1.0; own.len()]).collect();
        let quiet = Model::around(&problem, Vec::new());
        within_stretches(&problem, &quiet, &floor, &setting(&subject))
    };
    let fast = energy(&|t_s| 0.03 * (TAU * 1.9 * t_s).sin());
    let slow = energy(&|t_s| 0.03 * (TAU * 0.02 * t_s).sin());
    // 600 rows in stretches of two, of which a tone at 1.9 of 5 Hz keeps nine tenths: half of (0.03/0.003)^2 each.
    assert!((20_000.0..30_000.0).contains(&fast[2]), "{fast:?}");
    assert_eq!([fast[0], fast[1]], [0.0; 2]);
    assert!(slow[2] < 0.02 * fast[2], "{slow:?}");
}

/// A tone of one and a half sigmas in one of three gyros makes their gap grow by a sixth. A reference that is told to ten times as little may have put
/// it there: two sigmas of its rate are 1.7 of the gyro's.
#[test]
fn energy_matters_if_it_is_more_than_the_reference_errs_by_slowly() {
    let folder = beside_reference(|t_s| 0.0045 * (TAU * 1.9 * t_s).sin());
    let subject = Subject::open(folder.path()).expect("opens");
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let floor: Vec<Vec<f64>> = problem.sigmas.iter().map(|own| vec![1.0; own.len()]).collect();
    let quiet = Model::around(&problem, Vec::new());
    let beside = |attitude_sigma_rad: f64| {
        let slow = SlowErrors {
            attitude_sigma_rad,
            ..subject.slow
        };
        let setting = Setting {
            slow: &slow,
            ..setting(&subject)
        };
        remainder(&problem, &quiet, &floor, &setting)
    };
    let [known, unknown] = [0.003, 0.03].map(beside);
    assert!(
        known.matters > 0.9 && known.what == "energy above the floor in gz",
        "{known:?}"
    );
    assert!(unknown.matters < 0.1, "{unknown:?}");
}

/// A gyro that bends by a hundredth at a radian per second is a quarter of its noise and certain; by three quarters of that it is still
/// significant after two minutes, and could be the reference's.
#[test]
fn what_neither_matters_nor_is_certain_has_no_name() {
    let names = |bend: f64| {
        let diagnosis = diagnosed_in(&beside_reference(|t_s| bend * rate(t_s).powi(2)), &[]).1;
        let names = diagnosis.causes.iter().map(|cause| cause.effect);
        let found = diagnosis
            .promises
            .iter()
            .any(|promised| promised.effect.starts_with("gyro"));
        (names.collect::<Vec<_>>(), found)
    };
    assert_eq!(names(0.04), (vec!["gyro-nonlinearity"], true));
    assert_eq!(names(0.0125), (vec!["gyro-nonlinearity"], true));
    assert_eq!(names(0.009), (Vec::new(), true));
}

/// \[rad/s\] a zero that walks by so much in the square root of a second, at every row.
fn walk(seed: u64, size: f64) -> impl Fn(f64) -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut zero = 0.0;
    let steps = (0..=SECONDS * RATE_HZ).map(|_| {
        let step: f64 = StandardNormal.sample(&mut random);
        zero += size * step / (RATE_HZ as f64).sqrt();
        zero
    });
    let zeros: Vec<f64> = steps.collect();
    move |t_s| zeros[(t_s * RATE_HZ as f64).round() as usize]
}

/// Names where windows that are fitted and windows that judge take turns.
fn named_in_turns(error: impl Fn(f64) -> f64) -> Vec<&'static str> {
    let folder = beside_reference(error);
    let file = folder.path().join("case.toml");
    let case = fs::read_to_string(&file).expect("a file");
    let every = |first: usize| {
        let windows = (first..SECONDS)
            .step_by(20)
            .map(|from| format!("[{from}.0, {}.0]", from + 10));
        windows.collect::<Vec<_>>().join(", ")
    };
    let turns = case
        .replace("fit = [[0.0, 120.0]]", &format!("fit = [{}]", every(0)))
        .replace("hold = [[120.0, 240.0]]", &format!("hold = [{}]", every(10)));
    assert_ne!(case, turns);
    fs::write(&file, turns).expect("a file");
    let (_, diagnosis) = diagnosed_in(&folder, &[]);
    diagnosis.causes.iter().map(|cause| cause.effect).collect()
}

/// It begins in a window that judges, where no fit can tell when: what is said to be left is not what was placed wrongly.
#[test]
fn what_begins_between_fitted_windows_keeps_its_name() {
    for begins_s in [193.0, 197.0] {
        let named = named_in_turns(|t_s| if t_s > begins_s { 0.02 } else { 0.0 });
        assert_eq!(named, ["gyro-supply"], "{begins_s} s");
    }
}

/// Its largest rates are short by what the reference may err by.
#[test]
fn a_gyro_that_stops_inside_its_range_is_named() {
    let named = |most: f64, withheld: &[&str]| {
        let stopped = rewritten(beside_reference(|_| 0.0), |cells| {
            let rate: f64 = cells[3].parse().expect("a number");
            cells[3] = format!("{:.7}", rate.clamp(-most, most));
        });
        let (subject, diagnosis) = diagnosed_in(&stopped, withheld);
        let named: Vec<_> = diagnosis
            .causes
            .iter()
            .map(|cause| (cause.effect, cause.channels.clone()))
            .collect();
        (named, subject.masked[2].clipped > 0)
    };
    assert_eq!(named(0.448, &[]), (vec![("gyro-saturation", vec![2])], true));
    assert_eq!(named(0.448, &["gyro-saturation"]), (Vec::new(), true));
    assert_eq!(named(0.6, &[]), (Vec::new(), false));
}

/// What the stamps of the record leave open, with an accelerometer so far [m] from the centre.
fn open_beside(folder: &TempDir, lever_m: Option<f64>) -> Vec<String> {
    let path = |name: &str| folder.path().join(name);
    let read = |name: &str| fs::read_to_string(path(name)).expect("a file");
    if let Some(lever_m) = lever_m {
        let accelerometer = format!(
            "\n[[channel]]\nname = \"ax\"\nsensor = \"accelerometer\"\ngroup = \"unit\"\naxis_b = [1.0, 0.0, 0.0]\nlsb = 1.0\n\
             noise_sigma = 0.01\nrange = [-60.0, 60.0]\nlever_m = [{lever_m}, 0.0, 0.0]\n"
        );
        fs::write(path("unit.toml"), read("unit.toml") + &accelerometer).expect("a file");
        let rows = read("measured.csv").replace('\n', ",0.0\n").replacen(",0.0", ",ax", 1);
        fs::write(path("measured.csv"), rows).expect("a file");
        let case = read("case.toml").replace("[environment]\n", "[environment]\ngravity_m_s2 = 9.8\n");
        fs::write(path("case.toml"), case).expect("a file");
    }
    let subject = Subject::open(folder.path()).expect("opens");
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let open = problem.reference.iter().map(|column| column.name.clone());
    open.collect()
}

/// An accelerometer at the centre of a unit that turns about the vertical feels nothing of it; one at 1 m does, and sees when.
#[test]
fn stamps_are_open_where_gyros_alone_see_the_motion() {
    let beside = |lever_m| open_beside(&beside_reference(|_| 0.0), lever_m);
    assert_eq!(beside(None), ["reference_instant"]);
    assert_eq!(beside(Some(0.0)), ["reference_instant"]);
    assert_eq!(beside(Some(1.0)), Vec::<String>::new());
    assert_eq!(open_beside(&erring(|_| 0.0, ""), None), Vec::<String>::new());
}

/// A row of the record is 20 ms. Of a gyro with codes the part is known.
#[test]
fn a_gyro_is_read_when_its_row_says_and_one_with_codes_when_its_part_converts() {
    let instant_s = |folder: &TempDir| {
        let subject = Subject::open(folder.path()).expect("opens");
        let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
        let column = problem.open(2).iter().find(|column| column.name == "instant_gz");
        column.expect("an open instant").sigma
    };
    let of_part_s = 1.0 / 256.0 / 12f64.sqrt();
    let recorded = beside_reference(|_| 0.0);
    assert!((instant_s(&recorded) - 0.03 * 0.02).abs() < 1e-6);
    assert!((instant_s(&erring(|_| 0.0, "")) - of_part_s).abs() < 1e-9);
    let file = recorded.path().join("unit.toml");
    let coded = fs::read_to_string(&file).expect("a file") + "bits = 14\n";
    fs::write(&file, coded).expect("a file");
    assert!((instant_s(&recorded) - of_part_s).abs() < 1e-9);
}

/// Half a row of the record, which is one of 20 ms.
#[test]
fn gyros_alone_are_not_late_by_less_than_a_row_of_the_record() {
    let late = |late_s: f64| {
        let causes = diagnosed_in(&beside_reference(|t_s| rate(t_s - late_s) - rate(t_s)), &[])
            .1
            .causes;
        causes.iter().map(|cause| cause.effect).collect::<Vec<_>>()
    };
    assert_eq!(late(0.01), Vec::<&str>::new());
    assert!(!late(0.1).is_empty());
}

/// The two are the same effect there. By what it does where it is small the one that was not chosen has nothing of so long a delay.
#[test]
fn late_gyros_and_a_late_unit_of_gyros_alone_are_not_told_apart() {
    let late_s = 0.4;
    let (_, diagnosis) = diagnosed_in(&beside_reference(|t_s| rate(t_s - late_s) - rate(t_s)), &[]);
    let sets = &diagnosis.indistinguishable;
    let is_one_set = |set: &Vec<_>| set.contains(&"latency") && set.contains(&"gyro-latency");
    assert!(sets.iter().any(is_one_set), "{sets:?}");
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    /// A walk is a course that nobody knows, but one with the spectrum of a walk, and it says where the zero is between the windows. Not every walk
    /// moves far, and one that moves far resembles a supply that sags now and then; neither may have another name.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_zero_that_walks_is_named_and_a_slow_wave_is_no_walk() {
        let named: Vec<_> = (1..=5).flat_map(|seed| named_in_turns(walk(seed, 0.001))).collect();
        assert!(
            named.len() >= 3 && named.iter().all(|name| *name == "gyro-bias-walk"),
            "{named:?}"
        );
        assert!(!named_in_turns(|t_s| 0.02 * (TAU * t_s / 55.0).sin()).contains(&"gyro-bias-walk"));
        assert_eq!(named_in_turns(walk(5, 0.00002)), Vec::<&str>::new());
    }
}
