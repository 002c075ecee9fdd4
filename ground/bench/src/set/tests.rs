use nalgebra::Matrix3;

use super::*;
use crate::ellipsoid::{Convention, shape};

fn entry(name: &str) -> Entry {
    Entry {
        name: name.into(),
        sensor: "gyro".into(),
        part: "ADIS16265 0123".into(),
        method: "rate-table".into(),
        sensitivity_b: [0.0, 600.0, 800.0],
        bias_counts: vec![-12.5, 0.5],
        scale_per_k: vec![1e-4],
        reference_c: Some(25.0),
        valid_c: Some([10.0, 40.0]),
        scatter_counts: 2.7,
        freedom: 18,
        covariance: (0..6)
            .map(|k| (0..6).map(|j| if k == j { 0.01 } else { 0.0 }).collect())
            .collect(),
        delay_s: None,
        lever_m: None,
    }
}

fn set() -> Set {
    let mut set = Set::new("e-MEMS 1");
    set.from_file(Path::new("bench/run.csv"), b"abc");
    set.merge(vec![entry("g1"), entry("g2")]);
    set
}

#[test]
fn a_set_is_read_back_as_it_was_written() {
    let text = set().text().expect("text");
    assert_eq!(Set::parse(&text), Ok(set()));
    // FIPS 180-2, example B.1.
    assert_eq!(set().sources[0].file, "run.csv");
    assert!(set().sources[0].sha256.starts_with("ba7816bf8f01cfea"));
}

#[test]
fn what_means_nothing_is_refused() {
    let text = set().text().expect("text");
    for (from, to, why) in [
        ("calibration-set/1", "calibration-set/9", "its format is"),
        ("name = \"g2\"", "name = \"g1\"", "stands in it twice"),
        ("[0.0, 600.0, 800.0]", "[0.0, 0.0, 0.0]", "its sensitivity is zero"),
        (
            "bias_counts = [-12.5, 0.5]",
            "bias_counts = [-12.5]",
            "not a row and a column",
        ),
        ("[0.01, 0.0,", "[-0.01, 0.0,", "symmetric and positive"),
        ("-12.5", "nan", "no number"),
        ("freedom = 18", "freedom = -1", "invalid"),
        ("bias_counts = ", "bias_count = ", "is bias_counts meant?"),
        ("number = ", "numbers = ", "is number meant?"),
        ("sha256 = ", "sha265 = ", "is sha256 meant?"),
    ] {
        let broken = text.replacen(from, to, 1);
        assert_ne!(broken, text, "{from}");
        let error = Set::parse(&broken).expect_err("refused").to_string();
        assert!(error.contains(why), "{error}");
    }
}

#[test]
fn a_change_is_told_in_sigmas_of_both_sets() {
    let mut later = set();
    later.channels[0].sensitivity_b = [0.0, 606.0, 808.0];
    later.channels[0].bias_counts[0] += 1.0;
    later.channels.remove(1);
    later.merge(vec![entry("g3")]);
    let found = diff::diff(&set(), &later);
    assert_eq!(
        (found.gone, found.come),
        (vec!["g2".to_string()], vec!["g3".to_string()])
    );
    let moved = &found.moved[0];
    assert!((moved.scale.change - 0.01).abs() < 1e-12 && moved.axis_rad.change.abs() < 1e-12);
    // sigma of the relative scale: 0.1/1000 and 0.1/1010.
    assert!((moved.scale.sigma - (1e-8_f64 + 1e-8 / 1.0201).sqrt()).abs() < 1e-12);
    assert!((moved.bias.sigmas() - 1.0 / 0.02_f64.sqrt()).abs() < 1e-9);
    let (distance, parameters) = moved.distance.expect("same model");
    assert!((distance - ((100.0 + 1.0) / 0.02_f64).sqrt()).abs() < 1e-9 && parameters == 6);
}

#[test]
fn the_twins_unit_takes_the_calibration_over_and_keeps_the_rest() {
    let unit = "name = \"nominal\"\ncycle_s = 0.2\n[[channel]]\nname = \"g1\"\nsensor = \"gyro\"\nlsb = 0.5\nbits = 14\n\
        [[channel]]\nname = \"g2\"\nsensor = \"gyro\"\nlsb = 0.5\n[[channel]]\nname = \"t1\"\nlsb = 0.0625\n";
    let refined: toml::Table = unit::refine(unit, &set(), None).expect("unit").parse().expect("toml");
    let channel = &refined["channel"][0];
    assert_eq!(channel["lsb"].as_float(), Some(1e-3));
    assert_eq!(channel["bias"].as_float(), Some(-0.0125));
    assert_eq!(channel["bits"].as_integer(), Some(14));
    assert!((channel["axis_b"][2].as_float().expect("axis") - 0.8).abs() < 1e-12);
    assert!((channel["scale_sigma"].as_float().expect("sigma") - 1e-4).abs() < 1e-12);
    assert_eq!(refined["channel"][2]["lsb"].as_float(), Some(0.0625));
    let missing = unit::refine("[[channel]]\nname = \"g1\"\n", &set(), None)
        .expect_err("no g2")
        .to_string();
    assert!(missing.contains("no channel g2"), "{missing}");
    let warm: toml::Table = unit::refine(unit, &set(), Some(35.0))
        .expect("unit")
        .parse()
        .expect("toml");
    assert!((warm["channel"][0]["lsb"].as_float().expect("lsb") - 1e-3 / 1.001).abs() < 1e-12);
}

#[test]
fn an_ellipsoid_becomes_three_channels_in_b() {
    let nine = [1.05, 0.93, 1.12, 25.0, -40.0, 60.0, 0.05, -0.03, 0.02];
    let turn = Matrix3::new(0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0);
    let found = Ellipsoid {
        shape: shape(&nine, Convention::Thesis),
        offset: Vector3::new(25.0, -40.0, 60.0),
        covariance: nalgebra::SMatrix::identity() * 0.04,
        residuals: Vec::new(),
        scatter: 0.5,
        freedom: 221,
        condition: 2.0,
    };
    let names = ["m1x", "m1y", "m1z"].map(String::from);
    let entries = Entry::ellipsoid(&found, &names, "magnetometer", &turn);
    let field_b = Vector3::new(3.0, -7.0, 11.0);
    let counts = found.shape * (turn.transpose() * field_b) + found.offset;
    for (axis, entry) in entries.iter().enumerate() {
        let predicted = entry.sensitivity().dot(&field_b) + entry.bias_counts[0];
        assert!((predicted - counts[axis]).abs() < 1e-12);
        assert_eq!(entry.check(), Ok(()));
        assert!((entry.covariance()[(3, 3)] - 0.04).abs() < 1e-15);
    }
}
