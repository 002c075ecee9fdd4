use twin::{
    effect::{Locality, by_name},
    environment::Environment,
    motion::Tumble,
    predict::{Scene, Twin, emems, thesis_slot_s},
};

use super::*;
use crate::{
    input::{log::Series, reference::Reference, windows::Fit},
    library::products::Products,
};

/// Of readings of some 30 uT, from which a step of a thousandth of 0.5 uT is taken: a few times 1e-16 * 30 / 5e-4.
const ROUNDING: f64 = 1e-9;

/// Asks of a problem of so many packets, some of which one channel lacks.
fn posed(ask: impl FnOnce(&mut Problem)) {
    let environment = Environment::laboratory();
    let scene = Scene::new(&Tumble::new(), &environment, 0.0, 40.0, 0.02);
    let starts_s: Vec<f64> = (0..101).map(|row| 0.2 * f64::from(row)).collect();
    let twin = Twin::new(emems(thesis_slot_s), environment, scene, starts_s).expect("a twin");
    let whole = Series {
        rows: (0..101).collect(),
        values: vec![0.0; 101],
    };
    let mut fit = Fit {
        channels: vec![whole; twin.unit().channels.len()],
    };
    let holed = twin.unit().channel("m2y").expect("a channel");
    fit.channels[holed] = Series {
        rows: (0..101).step_by(2).collect(),
        values: vec![0.0; 51],
    };
    let reference = Reference::default();
    ask(&mut Problem::new(&twin, &fit, &reference));
}

fn line(hz: f64) -> Cause {
    Cause {
        effect: by_name("mains-alias").expect("in the library"),
        locality: Locality::Unit,
        variant: hz,
    }
}

/// The columns of a line, carried and held.
fn both(problem: &Problem, hz: f64) -> (Vec<Column>, Vec<Column>) {
    let cause = line(hz);
    let carrier = Carrier::of(problem, &cause).expect("a wave");
    let carried = carrier.columns(cause.effect.wave(hz).expect("a wave"));
    let zero = Active {
        theta: vec![0.0; carried.len()],
        cause,
    };
    let columns = problem.twin.jacobian(&[zero], 0);
    let held = columns.iter().map(|column| Column::of(problem.in_noise(column, None)));
    (carried.into_iter().map(|(column, _)| column).collect(), held.collect())
}

fn is_near(one: &Entries, other: &Entries) -> bool {
    one.len() == other.len()
        && one.iter().zip(other).all(|((channel, own), (other, others))| {
            channel == other && (own - others).amax() < ROUNDING * others.amax().max(1.0)
        })
}

#[test]
fn a_carried_column_is_the_derivative_that_it_stands_for() {
    posed(|problem| {
        // A line of the mains, and what has its phase in the cycle.
        for hz in [59.99, 60.01, -49.98] {
            let (carried, held) = both(problem, hz);
            assert_eq!(carried.len(), held.len());
            for (own, other) in carried.iter().zip(&held) {
                assert!(is_near(&own.entries(), &other.entries()), "{hz}");
                assert_eq!(own.channels(), other.channels());
            }
        }
    });
}

#[test]
fn its_inner_products_are_those_of_its_values() {
    posed(|problem| {
        let (carried, held) = both(problem, 60.01);
        let size = held[0].dot(&held[0]);
        for (one, own) in carried.iter().zip(&held) {
            for (other, others) in carried.iter().zip(&held) {
                let expected = own.dot(others);
                for found in [
                    one.dot(other),
                    one.dot(others),
                    own.dot(other),
                    one.dot_entries(&others.entries()),
                ] {
                    assert!((found - expected).abs() < ROUNDING * size, "{found} {expected}");
                }
            }
        }
    });
}

#[test]
fn a_course_of_other_noise_stays_one_course() {
    posed(|problem| {
        let (carried, held) = both(problem, 60.01);
        let mut products = [carried, held].map(|columns| {
            let mut products = Products::default();
            columns.into_iter().for_each(|column| {
                products.push(problem, column);
            });
            products
        });
        let before = problem.frames.clone();
        let mut louder = before.clone();
        louder
            .iter_mut()
            .for_each(|frame| frame.reweigh(&frame.weights.map(|_| 3.0)));
        problem.reframe(louder);
        products
            .iter_mut()
            .for_each(|products| products.reframe(problem, &before));
        let [carried, held] = &products;
        for place in 0..held.len() {
            assert!(is_near(&carried.column(place), &held.column(place)), "{place}");
        }
    });
}

/// Of fifteen instants most begin late, and some after all samples.
#[test]
fn a_column_that_begins_late_is_what_it_would_be_as_a_whole() {
    let late = |first: usize| DVector::from_fn(101, |row, _| if row < first { 0.0 } else { (row as f64).sin() });
    let held = |first: usize| Column::of(vec![(3, late(first))]);
    for first in [0, 7, 50, 51, 63, 64, 99, 101] {
        assert_eq!(held(first).entries(), [(3, late(first))], "{first}");
        for other in [0, 52, 80, 101] {
            let expected = late(first).dot(&late(other));
            assert_eq!(held(first).dot(&held(other)), expected, "{first} {other}");
            assert_eq!(
                held(first).dot_entries(&vec![(3, late(other))]),
                expected,
                "{first} {other}"
            );
        }
    }
}
