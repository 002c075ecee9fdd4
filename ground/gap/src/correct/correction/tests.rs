//! Corrections as the bench and the unit read them back.

use twin::{
    effect::Locality,
    environment::Environment,
    motion::{Attitude, Motion, Pose, Tumble},
    predict::{Scene, emems},
};

use super::*;
use crate::input::windows::Span;

fn twin() -> Twin {
    let environment = Environment::laboratory();
    let scene = Scene::new(&Tumble::new(), &environment, 0.0, 20.0, 0.05);
    Twin::new(emems(|_| 0.0), environment, scene, vec![0.0, 5.0, 10.0]).expect("a twin")
}

#[test]
fn the_set_of_hard_iron_and_a_scale_is_read_back_by_the_bench_and_the_unit() {
    let twin = twin();
    let iron = Component::always("hard-iron", Locality::Common, &[1.0, -2.0, 0.5]);
    let scale = Component::always("gyro-scale", Locality::Channel("g2".to_owned()), &[0.01]);
    let correction = Correction::of(&twin, &[iron, scale]).expect("correctable");
    let set = Set::parse(&correction.set(&twin).expect("text")).expect("a set");
    let of = |name: &str| {
        let index = twin.unit().channel(name).expect("a channel");
        let entry = set.channels.iter().find(|entry| entry.name == name).expect("an entry");
        (&twin.unit().channels[index], entry)
    };
    let (channel, gyro) = of("g2");
    assert!((gyro.sensitivity().norm() * channel.lsb - 1.01).abs() < 1e-12);
    let (channel, mag) = of("m3y");
    let expected = channel.axis_b.dot(&Vector3::new(1.0, -2.0, 0.5)) / channel.lsb;
    assert!((mag.bias_counts[0] - expected).abs() < 1e-9);
    let ranges = emems::calibration::Ranges::of(&emems::unit::Settings::NOMINAL);
    let image = bench::set::image::image(&set, ranges).expect("the unit accepts it");
    assert!(image.nominal.is_empty());
}

#[test]
fn delays_and_places_stand_in_the_set_and_are_passed_over() {
    let twin = twin();
    let late = Component::always("gyro-latency", Locality::Common, &[0.012]);
    let lever = Component::always("lever-arm", Locality::Group("plate 2".to_owned()), &[0.01, 0.0, 0.0]);
    let correction = Correction::of(&twin, &[late, lever]).expect("correctable");
    let text = correction.set(&twin).expect("text");
    assert_eq!(text.matches("delay_s").count(), 4, "{text}");
    assert_eq!(text.matches("lever_m").count(), 3);
    let set = Set::parse(&text).expect("its keys are the set's");
    let delays = set.channels.iter().filter_map(|entry| entry.delay_s);
    assert!(delays.into_iter().all(|delay_s| (delay_s - 0.012).abs() < 1e-12));
}

/// At rest, warming by half a degree a second.
struct Warming;

impl Motion for Warming {
    fn at(&self, t_s: f64) -> Pose {
        Pose {
            temperature_c: Some(25.0 + 0.5 * t_s),
            ..Pose::turning(Attitude::level())
        }
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }
}

#[test]
fn a_coefficient_that_bends_enters_the_set_as_it_bends() {
    let environment = Environment::laboratory();
    let scene = Scene::new(&Warming, &environment, 0.0, 40.0, 0.05);
    let starts_s: Vec<f64> = (0..40).map(f64::from).collect();
    let twin = Twin::new(emems(|_| 0.0), environment, scene, starts_s).expect("a twin");
    // The last one is beyond what is possible.
    for bend in [0.01, -0.004, 0.03] {
        let mut warm = Component::always("gyro-bias-temperature", Locality::Channel("g2".to_owned()), &[2e-4]);
        warm.active.cause.variant = bend;
        let correction = Correction::of(&twin, std::slice::from_ref(&warm)).expect("correctable");
        let set = Set::parse(&correction.set(&twin).expect("text")).expect("a set");
        let entry = set.channels.iter().find(|entry| entry.name == "g2").expect("an entry");
        let index = twin.unit().channel("g2").expect("a channel");
        let (with, without) = (twin.channel(index, &[warm.active]), twin.channel(index, &[]));
        let reference_c = entry.reference_c.expect("a warm set");
        for ((with, without), feel) in with.iter().zip(&*without).zip(twin.feels(index)) {
            let above_k = feel.temperature_c - reference_c;
            let counts = entry.bias_counts[1] * above_k + entry.bias_counts[2] * above_k * above_k;
            let changed = (with - without) / twin.unit().channels[index].lsb;
            // What is felt is that of the instant which the gyro's filter lets through: 3 ms of half a degree a second.
            assert!(
                (changed - counts).abs() < 1e-3 * (1.0 + changed.abs()),
                "{changed} {counts}"
            );
        }
    }
}

#[test]
fn what_passes_or_is_the_references_fault_is_not_the_units_to_correct() {
    let twin = twin();
    let mut iron = Component::always("hard-iron", Locality::Common, &[1.0, 0.0, 0.0]);
    iron.span = Some(Span { from: 0.0, to: 5.0 }.into());
    let tilt = Component::always("table-tilt", Locality::Unit, &[0.01, 0.0]);
    assert!(Correction::of(&twin, &[iron, tilt]).is_none());
}
