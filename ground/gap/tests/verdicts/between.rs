//! What of an effect is no parameter: a time constant, an onset, when it comes again; and which of those that are the same here.

use std::fs;

use crate::gyros::{diagnosed_in, erring, erring_in, rate};
use gap::{
    holdout::fit_error::FitError,
    input::{case::Subject, log::Series, reference::Reference, windows::Fit},
    library::hypotheses::Library,
    null::{interval::Interval, model::Model, problem::Problem},
    report::terminal,
    search::{interval_sums::Residual, periodic::again, readings::attribute},
};
use tempfile::TempDir;
use twin::{
    effect::LIBRARY,
    environment::Environment,
    motion::Tumble,
    predict::{Kind, Scene, Twin, emems},
};

#[test]
fn a_warm_up_between_those_tried_is_one_and_not_the_two_beside_it() {
    // Nine prior sigmas: two of half the size would be likelier by a quarter of 9^2 nats, did they count as two.
    let warm = diagnosed_in(&erring(|t_s| 0.027 * (-t_s / 57.0).exp(), ""), &[]).1;
    let names: Vec<&str> = warm.promises.iter().map(|promised| promised.effect).collect();
    assert_eq!((names.as_slice(), warm.causes.len()), (["gyro-warm-up"].as_slice(), 1));
    let which = warm.causes[0].which.as_deref().expect("a time constant");
    let tau_s: f64 = which.split(' ').find_map(|word| word.parse().ok()).expect("a number");
    // A fiftieth of its amplitude is noise, and its zero is open.
    assert!((tau_s - 57.0).abs() < 4.0, "{which}");
}

/// \[s\] time constants of a warm-up, none of which is tried as it is.
const TAUS_S: [f64; 12] = [
    53.7, 57.9, 64.2, 66.3, 71.8, 97.1, 101.4, 108.9, 113.6, 122.3, 128.7, 141.2,
];

/// How far the time constant that is found for a warm-up of `tau_s` is off, in standard deviations of what it is said to be
/// off by; each in noise of its own.
fn off(tau_s: f64) -> f64 {
    let folder = erring_in(tau_s as u64, |t_s| 0.02 * (-t_s / tau_s).exp(), "");
    let subject = Subject::open(folder.path()).expect("opens");
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let mut library = Library::new(&problem, &[], &|_| {});
    let found = attribute(&problem, &mut library, &|_| {});
    let hypothesis = &library.hypotheses[found.chosen[0].hypothesis];
    assert_eq!(hypothesis.effect(), "gyro-warm-up", "{tau_s} s");
    let model = Model::around(&problem, found.model(&library));
    let error = FitError::of(&problem, &model).with_value(&problem, &model, 0, hypothesis);
    let variance = error.covariance[(error.slopes.len() - 1, error.slopes.len() - 1)];
    let found_s = hypothesis.cause.variant;
    println!("{tau_s} s: {found_s:.1} +- {:.1} s", variance.sqrt());
    (found_s - tau_s) / variance.sqrt()
}

#[test]
fn a_time_constant_is_off_by_as_much_as_is_said() {
    let off = TAUS_S.map(off);
    let rms = (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
    // Of twelve draws, 99 in 100 within half as much again; moved as long as that is worth a tenth of a nat, which is half a
    // standard deviation.
    assert!((0.4..1.5).contains(&rms), "{off:?}");
}

#[test]
fn an_onset_beside_other_variants_is_moved_to_where_it_is() {
    // A supply's variants are a ramp and onsets; 71 s is none of them.
    let folder = erring(|t_s| if t_s > 71.0 { 0.02 } else { 0.0 }, "");
    let said = diagnosed_in(&folder, &["gyro-bias"]).1;
    let supply = said
        .causes
        .iter()
        .find(|cause| cause.effect == "gyro-supply")
        .expect("a supply");
    assert!(
        supply.which.as_deref().is_some_and(|told| told.contains("71")),
        "{:?}",
        supply.which
    );
}

#[test]
fn one_of_a_set_that_cannot_be_told_apart_is_a_cause_and_corrects_nothing() {
    // A sine of one frequency: a delay and a lag are the same.
    let folder = erring(|t_s| rate(t_s - 0.02) - rate(t_s), "");
    let (subject, said) = diagnosed_in(&folder, &[]);
    let cause = said.causes.first().expect("a cause");
    assert!(
        cause.probability < 0.5 && cause.any() > 0.9,
        "{} of {}",
        cause.probability,
        cause.any()
    );
    assert!(said.indistinguishable.iter().any(|set| set.contains(&cause.effect)));
    assert!(said.correction.is_none() && said.known.is_empty());
    let screen = terminal::screen(&subject, &said, "");
    assert!(screen.contains("perhaps"), "{screen}");
}

/// When a constant error of gz is on, and the nats that gains over always.
fn when_on(error: impl Fn(f64) -> f64) -> Option<(Interval, f64)> {
    when_on_of(&erring(error, ""))
}

fn when_on_of(folder: &TempDir) -> Option<(Interval, f64)> {
    let subject = Subject::open(folder.path()).expect("opens");
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let rest: Vec<_> = (0..3).map(|channel| problem.residual(channel, &[])).collect();
    let one = problem.frames[2].weights.map(|weight| 1.0 / weight);
    again(&problem, &Residual::of(&problem, &rest), &[vec![(2, one)]], &[0.01])
}

#[test]
fn what_comes_again_is_found_with_its_period() {
    const EVERY_S: f64 = 17.3;
    let (on, gain) = when_on(|t_s| if (t_s / EVERY_S).fract() < 0.35 { 0.002 } else { 0.0 }).expect("it comes again");
    let every_s = on.every_s.expect("a period");
    assert!((every_s - EVERY_S).abs() < 0.05 && gain > 20.0, "{on}: {gain} nats");
    let (from, length) = (on.stretch.from.rem_euclid(every_s), on.stretch.to - on.stretch.from);
    assert!(
        from.min(every_s - from) < 0.5 && (length - 0.35 * EVERY_S).abs() < 0.5,
        "{on}"
    );
    // What is there once does not, nor does noise, nor do a few damaged samples.
    let damaged = |t_s: f64| {
        [20.2, 37.8, 55.0, 61.4]
            .iter()
            .filter(|at_s| (t_s - **at_s).abs() < 0.05)
            .count() as f64
    };
    for error in [
        &(|_: f64| 0.0) as &dyn Fn(f64) -> f64,
        &|t_s| if t_s > 50.0 { 0.002 } else { 0.0 },
        &|t_s| 0.05 * damaged(t_s),
    ] {
        let none = when_on(error);
        assert!(none.is_none(), "{none:?}");
    }
}

/// Of what is on in the fitted samples the middle third has two seconds of 32, for windows and period are as they are.
#[test]
fn what_comes_again_is_not_asked_where_windows_do_not_show_it() {
    const EVERY_S: f64 = 17.3;
    let folder = erring(|t_s| if (t_s / EVERY_S).fract() < 0.35 { 0.006 } else { 0.0 }, "");
    let file = folder.path().join("case.toml");
    let case = fs::read_to_string(&file).expect("a file");
    let few = case.replace("[[0.0, 120.0]]", "[[0.0, 40.0], [52.0, 54.0], [80.0, 120.0]]");
    assert_ne!(case, few);
    fs::write(&file, few).expect("a file");
    let (on, _) = when_on_of(&folder).expect("it comes again");
    let every_s = on.every_s.expect("a period");
    assert!((every_s - EVERY_S).abs() < 0.05, "{on}");
}

#[test]
fn what_is_predicted_is_of_one_fit_where_the_calibration_can_take_the_place_of_the_effect() {
    // A part of a delay of 20 ms may be the instants of the channels.
    let folder = erring(|t_s| rate(t_s - 0.02) - rate(t_s), "instant_sigma_s = 0.003\n");
    let subject = Subject::open(folder.path()).expect("opens");
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let mut library = Library::new(&problem, &[], &|_| {});
    let found = attribute(&problem, &mut library, &|_| {});
    let mut components = found.model(&library);
    components[0].active.theta[0] += 0.004;
    let model = Model::around(&problem, components);
    for (channel, (frame, rest)) in problem.frames.iter().zip(&model.fitted.rest).enumerate() {
        let rows = frame
            .series
            .rows
            .iter()
            .zip(&frame.series.values)
            .zip(frame.weights.iter());
        let left = rows.map(|((row, value), weight)| (value - model.predicted[channel][*row as usize]) / weight);
        let off: f64 = left.zip(rest.iter()).map(|(left, rest)| (left - rest).powi(2)).sum();
        assert!(off < 1.0, "channel {channel}: {off}");
    }
}

/// A current that is switched on and iron that is brought are the same readings. At 0.13 uT the search for the iron's instants, which asks for
/// more than an effect whose onset is tried, finds none of its own.
#[test]
fn the_stretch_of_a_current_is_lent_to_iron() {
    const ROWS: u32 = 600;
    let environment = Environment::laboratory();
    let starts_s: Vec<f64> = (0..ROWS).map(|row| 0.2 * f64::from(row)).collect();
    let scene = Scene::new(&Tumble::new(), &environment, 0.0, 120.0, 0.01);
    let twin = Twin::new(emems(|_| 0.0), environment, scene, starts_s.clone()).expect("no effect is named");
    let channels = &twin.unit().channels;
    let fit = |values: &dyn Fn(usize, usize) -> f64| {
        let series = |channel: usize| Series {
            rows: (0..ROWS).collect(),
            values: (0..starts_s.len()).map(|row| values(channel, row)).collect(),
        };
        Fit {
            channels: (0..channels.len()).map(series).collect(),
        }
    };
    let exact = Reference::default();
    let nothing = fit(&|_, _| 0.0);
    let predicted = Problem::new(&twin, &nothing, &exact).predictions(&[]);
    let log = fit(&|channel, row| {
        let own = &channels[channel];
        let is_on = own.sensor == Kind::Magnetometer && own.group == "plate 1" && starts_s[row] > 64.3;
        predicted[channel][row] + if is_on { 0.13 * own.axis_b.x } else { 0.0 }
    });
    let problem = Problem::new(&twin, &log, &exact);
    let names = LIBRARY.iter().map(|effect| effect.page().name);
    let others = names.filter(|name| !["hard-iron", "current-field"].contains(name));
    let others: Vec<String> = others.map(str::to_owned).collect();
    let mut library = Library::new(&problem, &others, &|_| {});
    let found = attribute(&problem, &mut library, &|_| {});
    let rivals = &found.chosen.first().expect("something is there").rivals;
    let gain = |name: &str| {
        let own = rivals
            .iter()
            .filter(|rival| library.hypotheses[rival.hypothesis].effect() == name);
        own.map(|rival| rival.gain).fold(f64::NEG_INFINITY, f64::max)
    };
    // They differ by no more than the prior of an onset, one of 18 values.
    let gains = ["hard-iron", "current-field"].map(gain);
    assert!((gains[0] - gains[1]).abs() < 18f64.ln() && gains[0] > 0.0, "{gains:?}");
}
