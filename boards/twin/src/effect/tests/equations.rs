//! Effects against their own equations, by hand from what is felt.

use super::{physics::changed_unit, *};

#[test]
fn a_temperature_coefficient_bends_by_its_part_of_a_degree() {
    // 2e-4 rad/s a degree and 1 % more of it with each: told apart by hand from the temperatures felt.
    let nominal = twin(SPARSE);
    let index = nominal.unit().channel("g3").unwrap();
    let cause = Cause {
        effect: by_name("gyro-bias-temperature").unwrap(),
        locality: Locality::Channel("g3".to_owned()),
        variant: 0.01,
    };
    let theta = vec![2e-4];
    let with = nominal.channel(index, &[Active { cause, theta }]).into_owned();
    let without = nominal.channel(index, &[]);
    for ((with, without), feel) in with.iter().zip(&*without).zip(nominal.feels(index)) {
        let above_k = feel.temperature_c - 25.0;
        let by_hand = 2e-4 * above_k + 2e-6 * above_k * above_k;
        assert!((with - without - by_hand).abs() < 1e-6, "{} {by_hand}", with - without);
    }
}

#[test]
fn eddy_currents_obey_their_equation() {
    // tau y' + y = n.m, the derivative by central differences of units read a little earlier and later; what a delay of tau
    // leaves of it is of second order, and large by this measure.
    let (tau_s, step_s) = (0.03, 1e-3);
    let read_at = |later_s: f64| changed_unit(|_, channel| channel.slot_s += later_s);
    let with = |name: &str, later_s: f64| {
        let cause = Cause {
            effect: by_name(name).unwrap(),
            locality: if name == "eddy-current" {
                Locality::Unit
            } else {
                Locality::Common
            },
            variant: 0.0,
        };
        let theta = vec![tau_s];
        let own = read_at(later_s);
        own.channel(own.unit().channel("m2x").unwrap(), &[Active { cause, theta }])
            .into_owned()
    };
    let nominal = read_at(0.0);
    let field = nominal.channel(nominal.unit().channel("m2x").unwrap(), &[]);
    let left = |name: &str| {
        let [before, now, after] = [-step_s, 0.0, step_s].map(|later_s| with(name, later_s));
        let rest = (0..field.len()).map(|row| {
            let slope = (after[row] - before[row]) / (2.0 * step_s);
            (tau_s * slope + now[row] - field[row]).abs()
        });
        rest.fold(0.0, f64::max)
    };
    let (currents, delay) = (left("eddy-current"), left("mag-latency"));
    assert!(currents < 0.01 * delay && delay > 0.05, "{currents} against {delay} uT");
}
