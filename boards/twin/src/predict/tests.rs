//! The prediction as a whole: filters, calibration, and what it costs.

use super::*;
use crate::effect::{Cause, Locality, by_name};
use crate::motion::Tumble;

fn twin(unit: UnitDescription) -> Twin {
    let environment = Environment::laboratory();
    let scene = Scene::new(&Tumble::new(), &environment, 0.0, 62.0, 0.01);
    Twin::new(unit, environment, scene, (0..300).map(|k| 0.2 * f64::from(k)).collect()).unwrap()
}

fn active(name: &str, theta: &[f64]) -> Active {
    Active {
        cause: Cause {
            effect: by_name(name).unwrap(),
            locality: Locality::Common,
            variant: 0.0,
        },
        theta: theta.to_vec(),
    }
}

fn furthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_lag_is_a_second_low_pass_whatever_its_size() {
    // A gyro without a low-pass and a lag of tau is a gyro with a low-pass of tau, and the two orders are one.
    let tau_s = 0.0125;
    let with = |bandwidth_hz: Option<f64>| {
        let mut unit = emems(thesis_slot_s);
        for channel in unit.channels.iter_mut().filter(|channel| channel.sensor == Kind::Gyro) {
            channel.bandwidth_hz = bandwidth_hz;
        }
        twin(unit)
    };
    let hz = |tau_s: f64| 1.0 / (core::f64::consts::TAU * tau_s);
    let g2 = emems(thesis_slot_s).channel("g2").unwrap();
    let low_passed = with(Some(hz(tau_s)));
    let lagging = with(None).channel(g2, &[active("gyro-lag", &[tau_s])]).into_owned();
    assert!(furthest(&lagging, &low_passed.channel(g2, &[])) < 1e-9);
    let one = low_passed.channel(g2, &[active("gyro-lag", &[0.03])]).into_owned();
    let other = with(Some(hz(0.03)))
        .channel(g2, &[active("gyro-lag", &[tau_s])])
        .into_owned();
    assert!(furthest(&one, &other) < 1e-9);
    // Two equal ones: the partial fractions divide nothing by nothing, and are moved apart by a ten-thousandth.
    let beside = low_passed
        .channel(g2, &[active("gyro-lag", &[tau_s * 1.01])])
        .into_owned();
    let equal = low_passed.channel(g2, &[active("gyro-lag", &[tau_s])]).into_owned();
    assert!(furthest(&equal, &beside) < 1e-3 && equal.iter().all(|value| value.is_finite()));
}

#[test]
fn a_lead_undoes_a_lag_to_first_order() {
    let twin = twin(emems(thesis_slot_s));
    let g2 = twin.unit().channel("g2").unwrap();
    let nominal = twin.channel(g2, &[]).into_owned();
    let with = |tau_s: f64| twin.channel(g2, &[active("gyro-lag", &[tau_s])]).into_owned();
    let (lag, lead) = (with(1e-4), with(-1e-4));
    for ((lag, lead), nominal) in lag.iter().zip(&lead).zip(&nominal) {
        // Second order: tau times tau' times the second derivative of a rate of 2 rad/s within a second.
        assert!((0.5 * (lag + lead) - nominal).abs() < 1e-6);
    }
    assert!(furthest(&lag, &nominal) > 1e-5);
}

#[test]
fn calibration_columns_are_derivatives_of_the_description() {
    let twin = twin(emems(thesis_slot_s));
    for name in ["a2y", "m3z", "g4", "t1", "tg1"] {
        let index = twin.unit().channel(name).unwrap();
        let columns = twin.calibration(index);
        let is_thermometer = twin.unit().channels[index].sensor == Kind::Thermometer;
        assert_eq!(columns.len(), if is_thermometer { 2 } else { 12 }, "{name}");
        for (column, which) in columns.iter().zip(0..4) {
            let h = 1e-5;
            let moved = |by: f64| {
                let mut unit = twin.unit().clone();
                let channel = &mut unit.channels[index];
                let [first, second] = channel.across();
                match which {
                    0 => channel.bias += by,
                    1 if is_thermometer => return None,
                    1 => channel.axis_b *= 1.0 + by,
                    2 => channel.axis_b += first * by,
                    _ => channel.axis_b += second * by,
                }
                let scene = Scene::new(&Tumble::new(), twin.environment(), 0.0, 62.0, 0.01);
                let moved = Twin::new(unit, *twin.environment(), scene, twin.starts_s().to_vec()).unwrap();
                Some(moved.channel(index, &[]).into_owned())
            };
            let (Some(after), Some(before)) = (moved(h), moved(-h)) else {
                continue;
            };
            let slope: Vec<f64> = after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * h)).collect();
            assert!(furthest(&slope, &column.entries[0].1) < 1e-6, "{}", column.name);
        }
    }
}

#[test]
fn a_random_walk_is_as_large_as_described_at_the_end_of_the_log() {
    let twin = twin(emems(thesis_slot_s));
    let index = twin.unit().channel("a1x").unwrap();
    let drift = twin.calibration(index);
    let variance: f64 = drift[4..]
        .iter()
        .map(|column| (column.sigma * column.entries[0].1[299]).powi(2))
        .sum();
    let walk = twin.unit().channels[index].drift_sigma.powi(2) * 299.0 * 0.2;
    // Eight terms hold 1 - (2/pi^2) sum over the rest = 97.5 % of it.
    assert!((variance / walk - 0.975).abs() < 0.002, "{}", variance / walk);
}

#[test]
fn the_field_columns_are_what_a_field_model_changes() {
    let twin = twin(emems(thesis_slot_s));
    let accuracy = Accuracy {
        field_sigma_ut: 0.3,
        ..Accuracy::default()
    };
    let columns = twin.field_columns(&accuracy);
    let mut of_unit = active("field-model", &[0.0; 3]);
    of_unit.cause.locality = Locality::Unit;
    let effect = twin.jacobian(&[of_unit], 0);
    assert_eq!(columns.len(), 3);
    for (column, effect) in columns.iter().zip(&effect) {
        assert_eq!(column.entries.len(), 12);
        for ((channel, values), (other, expected)) in column.entries.iter().zip(&effect.entries) {
            assert!(channel == other && furthest(values, expected) < 1e-9);
        }
    }
    assert!(twin.field_columns(&Accuracy::default()).is_empty());
}

#[test]
fn beyond_its_range_a_channel_clips() {
    let mut unit = emems(thesis_slot_s);
    for channel in &mut unit.channels {
        channel.range = [-0.5, 0.5];
    }
    let twin = twin(unit);
    assert!(twin.predict(&[]).iter().flatten().all(|value| value.abs() <= 0.5));
}

#[test]
fn the_slope_by_the_instant_is_that_of_a_twin_that_reads_later() {
    let later_s = 1e-3;
    let mut late = emems(thesis_slot_s);
    late.channels.iter_mut().for_each(|channel| channel.slot_s += later_s);
    let (now, late) = (twin(emems(thesis_slot_s)), twin(late));
    for name in ["g2", "a1x", "m3z", "t1"] {
        let index = now.unit().channel(name).unwrap();
        let moved: Vec<f64> = now
            .channel(index, &[])
            .iter()
            .zip(now.by_instant(index))
            .map(|(reading, slope)| reading + slope * later_s)
            .collect();
        // Half of the second derivative times the square of a millisecond: below a millionth of 60 uT or 10 m/s2.
        assert!(furthest(&moved, &late.channel(index, &[])) < 1e-4, "{name}");
        assert_eq!(
            name == "t1",
            now.by_instant(index).iter().all(|slope| slope.abs() < 1e-9),
            "{name}"
        );
    }
}

#[test]
fn the_bend_is_what_the_slope_by_the_instant_leaves() {
    let later_s = 0.02;
    let mut late = emems(thesis_slot_s);
    late.channels.iter_mut().for_each(|channel| channel.slot_s += later_s);
    let (now, late) = (twin(emems(thesis_slot_s)), twin(late));
    for name in ["g2", "a1x", "m3z"] {
        let index = now.unit().channel(name).unwrap();
        let readings = now.channel(index, &[]);
        let straight: Vec<f64> = (readings.iter().zip(now.by_instant(index)))
            .map(|(reading, slope)| reading + slope * later_s)
            .collect();
        let bent: Vec<f64> = (straight.iter().zip(now.bend(index)))
            .map(|(reading, bend)| reading + 0.5 * bend * later_s * later_s)
            .collect();
        let late = late.channel(index, &[]);
        let (straight, bent) = (furthest(&straight, &late), furthest(&bent, &late));
        // What is left is the third derivative's part: a motion of tenths of a second has a tenth of it.
        assert!(bent < 0.2 * straight, "{name}: {bent} {straight}");
    }
}
