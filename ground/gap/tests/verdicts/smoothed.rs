//! The attitude of a flight without a reference: held against the truth, beside what is named, and not told.

use crate::parity::flown;
use gap::{
    parity::{
        findings::Findings,
        flight::Flight,
        followed::{Beforehand, Followed},
        smooth::told::Told,
    },
    probability::outcome::Outcome,
};
use twin::{
    effect::{Active, Cause, Locality, by_name},
    motion,
    predict::{emems, thesis_slot_s},
};

#[test]
fn the_smoothed_attitude_of_a_healthy_unit_is_the_truth_within_what_it_says() {
    for (name, from_s) in [("tumble", 20.0), ("rate-table", 20.0)] {
        let flight = Flight::open(flown(name, from_s, 3, &[], |_| true).path()).expect("opens");
        let told = Told::of(&flight, &|_| ()).expect("is smoothed");
        assert_eq!(told.attitudes.len(), 550, "{name}: {:?}", told.turns);
        let (error, said) = held_against(&told, name, from_s);
        let ratio = error / said;
        // A few slow directions carry all of it, so that one flight is no sharp test: three of them within half and twice.
        assert!((0.3..2.0).contains(&ratio), "{name}: {ratio}");
        assert!(said < 1.5, "{name}: {said}");
    }
}

/// Error and sigma of an attitude, root mean squares in degrees.
fn held_against(told: &Told, name: &str, from_s: f64) -> (f64, f64) {
    let motion = motion::world_by_name(name).expect("a motion").motion;
    let (mut square, mut said) = (0.0, 0.0);
    for own in &told.attitudes {
        let truth = motion.at(from_s + own.t_s).attitude.q_nb;
        square += truth.angle_to(&own.q_nb).to_degrees().powi(2);
        said += own.sigmas_b_deg.norm_squared();
    }
    let count = told.attitudes.len().max(1) as f64;
    ((square / count).sqrt(), (said / count).sqrt())
}

#[test]
fn an_attitude_is_smoothed_beside_what_is_named_and_not_told_where_something_is_left() {
    let unit = emems(thesis_slot_s);
    let cause = Cause {
        effect: by_name("gyro-bias").expect("an effect"),
        locality: Locality::Channel("g1".to_owned()),
        variant: 0.0,
    };
    let sigma = cause.parameters(&unit)[0].prior_sigma;
    let active = [Active {
        cause,
        theta: vec![4.0 * sigma],
    }];
    let flight = Flight::open(flown("tumble", 20.0, 3, &active, |_| true).path()).expect("opens");
    let mut findings = Findings::of(&flight, &[], &|_, _| ()).expect("has redundancy");
    assert_eq!(
        findings.outcome,
        Outcome::Named,
        "{:?} {:?}",
        findings.names,
        findings.alternatives
    );
    let followed = Followed::of(&flight, &flight.log, &Beforehand::default());
    let without = held_against(&Told::along(&followed, &|_| ()).expect("is smoothed"), "tumble", 20.0);
    let told = Told::explained(&followed, &findings, &|_| ()).expect("is smoothed");
    let with = held_against(&told, "tumble", 20.0);
    assert!(with.0 < 0.9 * without.0, "{with:?}, without it {without:?}");
    assert!(
        with.0 < 2.0 * with.1 && (1.0..2.0).contains(&(with.1 / without.1)),
        "{with:?}, without it {without:?}"
    );
    for (outcome, why) in [
        (Outcome::Unknown, "that no name explains"),
        (Outcome::PartlyNamed, "that no name explains"),
        (Outcome::Undecided, "which of several"),
    ] {
        findings.outcome = outcome;
        let told = Told::explained(&followed, &findings, &|_| ()).expect("is smoothed");
        assert!(told.csv().is_none() && told.line().contains(why), "{}", told.line());
    }
}

#[test]
fn an_attitude_that_does_not_settle_is_said_and_not_written() {
    let told = Told {
        turns: vec![0.4, 0.3],
        ..Told::default()
    };
    assert!(told.csv().is_none() && told.figure().expect("no plot").is_none());
    assert!(
        told.line()
            .contains("did not settle: step 2 still turned it by 17.19 deg"),
        "{}",
        told.line()
    );
}
