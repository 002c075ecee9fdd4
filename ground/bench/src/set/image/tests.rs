use emems::unit::Settings;

use super::*;

const RANGES: Ranges = Ranges {
    acceleration: Settings::NOMINAL.acceleration,
    field: Settings::NOMINAL.field,
    rate: Settings::NOMINAL.rate,
};
/// f32 rounding of values up to some hundred counts.
const ROUNDING: f64 = 1e-4;

/// A gyro two per cent off nominal, with temperature terms about 25 degC.
fn gyro(k: u8) -> Entry {
    let axis = unit::Set::nominal(RANGES).gyro[usize::from(k)];
    let sensitivity_b = axis.axis_b.cast::<f64>() * (1.02 / f64::from(axis.scale));
    Entry {
        name: name(Channel(24 + k)),
        sensor: "gyro".into(),
        part: String::new(),
        method: "rate-table".into(),
        sensitivity_b: sensitivity_b.into(),
        bias_counts: vec![-12.5, 0.5, 0.01],
        scale_per_k: vec![2e-4],
        reference_c: Some(25.0),
        valid_c: Some([0.0, 40.0]),
        scatter_counts: 2.7,
        freedom: 18,
        covariance: (0..7)
            .map(|row| (0..7).map(|column| if row == column { 0.01 } else { 0.0 }).collect())
            .collect(),
        delay_s: None,
        lever_m: None,
    }
}

fn set() -> Set {
    let mut set = Set::new("e-MEMS 7");
    (set.serial, set.number) = (7, 3);
    set.merge((0..4).map(gyro).collect());
    set
}

#[test]
fn the_unit_reads_back_what_was_calibrated_at_every_temperature() {
    let image = image(&set(), RANGES).expect("accepted");
    let loaded = unit::Set::load(&image.set.encode(), RANGES, 7).expect("loads");
    assert_eq!(loaded, image.set);
    assert_eq!((loaded.identity.set, loaded.identity.methods[2]), (3, Method::LmsEc));
    assert_eq!(
        (loaded.lowest_c, loaded.reference_c, loaded.highest_c),
        (0.0, 20.0, 40.0)
    );
    let entry = gyro(1);
    for (celsius, rate_b) in [
        (0.0, [0.5, -1.0, 2.0]),
        (20.0, [0.0, 0.0, 0.0]),
        (40.0, [-2.0, 0.1, 1.0]),
    ] {
        let (t, rate_b) = (celsius - 25.0, Vector3::from(rate_b));
        let counts = (1.0 + 2e-4 * t) * entry.sensitivity().dot(&rate_b) - 12.5 + 0.5 * t + 0.01 * t * t;
        let axis = loaded.gyro[1];
        let above_c = celsius - 20.0;
        let scale = f64::from(axis.scale_at(above_c as f32));
        let value = scale * (counts - f64::from(axis.bias_counts_at(above_c as f32)));
        let truth = axis.axis_b.cast::<f64>().dot(&rate_b);
        // Half a count of rounding would be 6e-4; the chord of the scale costs 1e-5 of 2 rad/s.
        assert!((value - truth).abs() < ROUNDING, "{celsius}: {value} {truth}");
    }
}

#[test]
fn what_nobody_calibrated_stays_nominal_and_is_named() {
    let image = image(&set(), RANGES).expect("accepted");
    assert_eq!(image.nominal.len(), 24);
    assert_eq!((image.nominal[0].as_str(), image.nominal[23].as_str()), ("a1x", "m4z"));
    let nominal = unit::Set::nominal(RANGES);
    assert_eq!(
        (image.set.acc, image.set.uncertainty[0]),
        (nominal.acc, nominal.uncertainty[0])
    );
    // 0.1 counts of 800 per rad/s.
    assert!((f64::from(image.set.uncertainty[2].bias) - 0.1 / entry_scale()).abs() < 1e-7);
    let mut three = set();
    three.channels.pop();
    let three = super::image(&three, RANGES).expect("accepted");
    assert_eq!(
        three.set.uncertainty[2], nominal.uncertainty[2],
        "one nominal gyro is as unsure as ever"
    );
}

fn entry_scale() -> f64 {
    gyro(0).sensitivity().norm()
}

#[test]
fn an_ellipsoid_does_not_make_directions_sure() {
    let mut set = set();
    for entry in &mut set.channels {
        entry.method = "ellipsoid".into();
    }
    let image = image(&set, RANGES).expect("accepted");
    let nominal = unit::Set::nominal(RANGES);
    assert_eq!(image.set.uncertainty[2].direction, nominal.uncertainty[2].direction);
    assert!(image.set.uncertainty[2].scale < nominal.uncertainty[2].scale);
    assert_eq!(image.set.identity.methods[2], Method::MvSec);
}

#[test]
fn what_does_not_fit_is_refused_with_the_channel() {
    let refuse = |change: &dyn Fn(&mut Entry), why: &str| {
        let mut set = set();
        change(&mut set.channels[2]);
        let error = image(&set, RANGES).expect_err(why).to_string();
        assert!(error.contains(why), "{error}");
    };
    refuse(&|entry| entry.name = "g5".into(), "no channel g5");
    refuse(&|entry| entry.sensor = "accelerometer".into(), "g3 is no gyro");
    refuse(&|entry| entry.bias_counts.push(1e-3), "degree 3");
    refuse(
        &|entry| entry.scale_per_k = vec![0.0, 1e-4],
        "leaves a straight line by",
    );
    refuse(&|entry| entry.scale_per_k = vec![0.05], "leaves a straight line by");
    refuse(&|entry| entry.valid_c = Some([41.0, 60.0]), "g3 holds from 41.0");
    refuse(
        &|entry| entry.method = "ellipsoid".into(),
        "g3 comes from another method",
    );
    refuse(
        &|entry| entry.sensitivity_b = entry.sensitivity_b.map(|c| -c),
        "gyro 3: over 10 deg from nominal",
    );
    refuse(
        &|entry| entry.sensitivity_b = entry.sensitivity_b.map(|c| c / 3.0),
        "gyro 3: scale not within",
    );
}
