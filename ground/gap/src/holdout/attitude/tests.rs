use twin::{
    effect::{Active, Cause, Locality, by_name},
    environment::Environment,
    motion::{Still, Tumble},
    predict::{Scene, emems},
};

use super::*;

/// \[s\] of a log.
const SECONDS: f64 = 60.0;

/// The unit, read at once and without low-passes, so that a row is an instant.
fn twin_of(motion: &dyn twin::motion::Motion) -> Twin {
    let mut unit = emems(|_| 0.0);
    unit.channels.iter_mut().for_each(|channel| channel.bandwidth_hz = None);
    let environment = Environment::laboratory();
    let scene = Scene::new(motion, &environment, 0.0, SECONDS, 0.01);
    let starts_s = (0..(SECONDS / 0.2) as usize).map(|row| row as f64 * 0.2).collect();
    Twin::new(unit, environment, scene, starts_s).expect("a twin")
}

fn tracked(twin: &Twin, active: &[Active], change: impl Fn(&mut Response, &Channel)) -> (Track, Vec<f64>, Vec<f64>) {
    let estimation = Estimation::new(twin, (0..twin.starts_s().len()).collect());
    let respond = |channel: &Channel| {
        let mut response = Response::nominal(channel);
        change(&mut response, channel);
        response
    };
    let responses: Vec<Response> = twin.unit().channels.iter().map(respond).collect();
    let track = estimation.track(&twin.predict(active), &responses);
    let reference = estimation.reference();
    let errors = |found: &[Option<UnitQuaternion<f64>>]| -> Vec<f64> {
        let pairs = found.iter().zip(&reference).skip(100);
        pairs
            .filter_map(|(found, truth)| Some(found.as_ref()?.angle_to(truth).to_degrees()))
            .collect()
    };
    let (triad, filter) = (errors(&track.triad), errors(&track.filter));
    (track, triad, filter)
}

fn most(errors: &[f64]) -> f64 {
    assert!(!errors.is_empty());
    errors.iter().copied().fold(0.0, f64::max)
}

#[test]
fn the_nominal_twin_at_rest_has_no_error() {
    let twin = twin_of(&Still::level());
    let (track, triad, filter) = tracked(&twin, &[], |_, _| {});
    // f32 of TRIAD and filter, and the gyros' own rotation of the Earth.
    assert!(most(&triad) < 1e-3, "{}", most(&triad));
    assert!(most(&filter) < 0.02, "{}", most(&filter));
    let gravity = twin.environment().gravity;
    assert!((track.vectors[0][7].expect("force") - Vector3::new(0.0, 0.0, -gravity)).norm() < 1e-9);
}

/// Hard iron of 3 uT forward on all plates: heading is off by its part across the level field.
fn iron() -> Active {
    Active {
        cause: Cause {
            effect: by_name("hard-iron").expect("in the library"),
            locality: Locality::Common,
            variant: 0.0,
        },
        theta: vec![0.0, 3.0, 0.0],
    }
}

#[test]
fn hard_iron_turns_the_heading_and_a_response_that_knows_it_turns_it_back() {
    let twin = twin_of(&Still::level());
    let (_, triad, _) = tracked(&twin, &[iron()], |_, _| {});
    let level = Vector3::new(17.0_f64, -6.9, 0.0);
    let seen = level + Vector3::new(0.0, 3.0, 0.0);
    let expected = (level.dot(&seen) / level.norm() / seen.norm()).acos().to_degrees();
    assert!((most(&triad) - expected).abs() < 0.01, "{} {expected}", most(&triad));
    let (_, corrected, _) = tracked(&twin, &[iron()], |response, channel| {
        if channel.sensor == Kind::Magnetometer {
            response.bias += 3.0 * channel.axis_b.y;
        }
    });
    assert!(most(&corrected) < 1e-3, "{}", most(&corrected));
}

#[test]
fn a_lever_arm_is_taken_off() {
    let twin = twin_of(&Tumble::new());
    let (known, ..) = tracked(&twin, &[], |_, _| {});
    let (forgotten, ..) = tracked(&twin, &[], |response, _| response.lever_m = Vector3::zeros());
    let feels = twin.feels(0);
    let error = |track: &Track| -> f64 {
        let rows = 1..feels.len() - 1;
        rows.filter_map(|row| Some((track.vectors[0][row]? - feels[row].force_b).norm()))
            .fold(0.0, f64::max)
    };
    // What is left is the difference quotient of the rates over 0.4 s.
    assert!(
        error(&known) < 0.5 * error(&forgotten),
        "{} {}",
        error(&known),
        error(&forgotten)
    );
}

/// The unit of the thesis, 118.8 ms a cycle, with its low-passes.
#[test]
fn sensors_read_one_after_another_see_one_instant() {
    let unit = emems(twin::predict::thesis_slot_s);
    let environment = Environment::laboratory();
    let scene = Scene::new(&Tumble::new(), &environment, 0.0, SECONDS, 0.01);
    let starts_s = (5..(SECONDS / 0.2) as usize - 5).map(|row| row as f64 * 0.2).collect();
    let twin = Twin::new(unit, environment, scene, starts_s).expect("a twin");
    let (_, triad, _) = tracked(&twin, &[], |_, _| {});
    // The rate changes within the 119 ms; not carried, the last sensor is ten degrees late.
    assert!(most(&triad) < 3.0, "{}", most(&triad));
    let (_, late, _) = tracked(&twin, &[], |response, _| response.delay_s = 0.1);
    assert!(most(&late) > 2.0 * most(&triad), "{} {}", most(&late), most(&triad));
}

#[test]
fn a_row_without_three_axes_has_no_vector() {
    let twin = twin_of(&Still::level());
    let mut readings = twin.predict(&[]);
    for (channel, readings) in twin.unit().channels.iter().zip(&mut readings) {
        if channel.sensor == Kind::Gyro && channel.name != "g1" && channel.name != "g2" {
            readings[5] = f64::NAN;
        }
    }
    let responses: Vec<Response> = twin.unit().channels.iter().map(Response::nominal).collect();
    let track = Estimation::new(&twin, (0..10).collect()).track(&readings, &responses);
    assert!(track.vectors[1][5].is_none() && track.vectors[1][4].is_some());
}
