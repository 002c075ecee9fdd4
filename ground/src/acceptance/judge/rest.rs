//! At rest: noise, frozen values, bias of the gyros, temperatures.

use packets::channel::Quantity;

use super::Finding;
use crate::acceptance::{
    evidence::{Evidence, Stage, channel, spread},
    limits,
};

/// Every line of the half minute at rest.
pub fn rest(evidence: &Evidence) -> Vec<Finding> {
    let Some(stretch) = evidence.stretch(Stage::Rest) else {
        return Vec::new();
    };
    let of = |quantity: Quantity, plate: usize, axis: usize| {
        let values = evidence.counts(stretch, channel(quantity, plate, axis));
        spread(&values).map(|(mean, sd)| (mean * quantity.scale().0 + quantity.scale().1, sd * quantity.scale().0))
    };
    let mut found = Vec::new();
    let kinds = [
        (
            "accelerometer",
            Quantity::SpecificForce,
            3,
            limits::ACC_NOISE,
            1.0,
            "m/s2",
        ),
        ("magnetometer", Quantity::Field, 3, limits::MAG_NOISE_UT, 1.0, "uT"),
        (
            "gyro",
            Quantity::Rate,
            1,
            limits::GYRO_NOISE,
            1_f64.to_degrees(),
            "deg/s",
        ),
    ];
    for (name, quantity, axes, nominal, unit, unit_name) in kinds {
        for plate in 0..4 {
            let noise: Vec<f64> = (0..axes)
                .filter_map(|axis| of(quantity, plate, axis))
                .map(|(_, sd)| sd)
                .collect();
            let part = format!("{name} {}", plate + 1);
            let limit = limits::NOISE_FACTOR * nominal;
            let least = noise.iter().copied().fold(f64::INFINITY, f64::min);
            let most = noise.iter().copied().fold(0.0, f64::max);
            let is_whole = noise.len() == axes;
            let (measured, good, check) = if !is_whole {
                ("not read".into(), false, "see its self-test".to_owned())
            } else if least == 0.0 {
                let check =
                    format!("{part} repeats one value: it does not convert; its supply and reset, then replace it");
                ("always the same value".into(), false, check)
            } else {
                let check = format!("was it at rest? Then decoupling and supply of {part}; then replace it");
                (format!("{:.3} {unit_name}", most * unit), most <= limit, check)
            };
            let limit = format!("{:.3} {unit_name}", limit * unit);
            found.push(Finding {
                part,
                what: "noise at rest",
                measured,
                limit,
                good,
                check,
            });
        }
    }
    for plate in 0..4 {
        let Some((bias, _)) = of(Quantity::Rate, plate, 0) else {
            continue;
        };
        let bias_deg_s = bias.to_degrees();
        found.push(Finding {
            part: format!("gyro {}", plate + 1),
            what: "bias at rest",
            measured: format!("{bias_deg_s:+.2} deg/s"),
            limit: format!("{} deg/s", limits::GYRO_BIAS_DEG_S),
            good: bias_deg_s.abs() <= limits::GYRO_BIAS_DEG_S,
            check: "was it at rest? Then mechanical stress of its solder joints; then replace it".into(),
        });
    }
    found.extend(temperatures(&of));
    found
}

fn temperatures(of: &dyn Fn(Quantity, usize, usize) -> Option<(f64, f64)>) -> Vec<Finding> {
    let mean = |quantity: Quantity, plate: usize| of(quantity, plate, 0).map(|(mean, _)| mean);
    let mut all: Vec<f64> = (0..4).filter_map(|plate| mean(Quantity::Temperature, plate)).collect();
    all.sort_by(f64::total_cmp);
    let Some(median) = all.get(all.len() / 2).copied() else {
        return Vec::new();
    };
    let kinds = [
        ("thermometer", Quantity::Temperature, limits::TEMPERATURE_C),
        ("gyro", Quantity::GyroTemperature, limits::GYRO_TEMPERATURE_C),
    ];
    let mut found = Vec::new();
    for (name, quantity, limit) in kinds {
        for plate in 0..4 {
            let Some(value) = mean(quantity, plate) else { continue };
            found.push(Finding {
                part: format!("{name} {}", plate + 1),
                what: "temperature",
                measured: format!("{value:.1} degC"),
                limit: format!("{median:.1} within {limit} degC"),
                good: (value - median).abs() <= limit,
                check: "is something near it warm? Then its solder joints; then replace it".into(),
            });
        }
    }
    found
}
