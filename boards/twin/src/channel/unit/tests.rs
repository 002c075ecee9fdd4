//! Descriptions read, written and refused.

use super::*;
use crate::predict::{emems, thesis_slot_s};

const GYRO: &str = "name = \"u\"\n[[channel]]\nname = \"g\"\nsensor = \"gyro\"\ngroup = \"p\"\naxis_b = [0.0, 0.6, 0.8]\nlsb = 0.5\n\
                    noise_sigma = 0.1\n";

fn read(text: &str) -> Result<UnitDescription, String> {
    UnitDescription::read(text, "unit.toml").map_err(|error| error.to_string())
}

#[test]
fn what_it_writes_it_reads_again() {
    let unit = emems(thesis_slot_s);
    let again = read(&unit.text()).unwrap();
    assert_eq!(again.channels.len(), 36);
    for (again, channel) in again.channels.iter().zip(&unit.channels) {
        // Axes are normalised again: rounding.
        assert!((again.axis_b - channel.axis_b).norm() < 1e-15);
        let axis_b = channel.axis_b;
        assert_eq!(
            Channel {
                axis_b,
                ..again.clone()
            },
            *channel
        );
    }
}

#[test]
fn what_is_left_out_has_the_value_of_the_format() {
    let unit = read(GYRO).unwrap();
    let channel = &unit.channels[0];
    assert_eq!((unit.cycle_s, channel.bits, channel.bandwidth_hz), (None, None, None));
    assert_eq!((channel.bias, channel.slot_s, channel.tau_s()), (0.0, 0.0, 0.0));
    assert_eq!(channel.logged(1e9), 1e9);
    // Without bits nothing is rounded, and rounding is no noise.
    assert_eq!((channel.logged(0.3), channel.sigma()), (0.3, 0.1));
}

#[test]
fn a_count_is_rounded_clipped_and_noisier_by_its_step() {
    let unit = read(&format!("{GYRO}bits = 4\nrange = [-2.0, 2.0]\n")).unwrap();
    let channel = &unit.channels[0];
    assert_eq!([0.3, 0.2, -9.0].map(|value| channel.logged(value)), [0.5, 0.0, -2.0]);
    assert!((channel.sigma() - (0.01 + 0.25_f64 / 12.0).sqrt()).abs() < 1e-15);
}

#[test]
fn two_directions_across_an_axis_make_a_right_handed_frame_with_it() {
    for channel in emems(thesis_slot_s)
        .channels
        .iter()
        .filter(|channel| channel.sensor != Kind::Thermometer)
    {
        let [first, second] = channel.across();
        assert!((channel.axis_b.cross(&first) - second).norm() < 1e-12);
        assert!((first.norm() - 1.0).abs() < 1e-12 && first.dot(&channel.axis_b).abs() < 1e-12);
    }
}

#[test]
fn what_cannot_be_is_refused_by_file_channel_and_key() {
    let changed = |from: &str, to: &str| read(&GYRO.replace(from, to)).unwrap_err();
    assert_eq!(
        changed("[0.0, 0.6, 0.8]", "[0.0, 0.6, 0.9]"),
        "unit.toml: channel g: axis_b must have length one"
    );
    assert_eq!(
        changed("0.5", "0.0"),
        "unit.toml: channel g: lsb must be finite and above zero"
    );
    assert_eq!(
        changed("0.1", "-0.1"),
        "unit.toml: channel g: noise_sigma must be finite and not below zero"
    );
    assert_eq!(
        changed("0.1", "nan"),
        "unit.toml: channel g: noise_sigma must be finite and not below zero"
    );
    assert_eq!(
        read(&format!("{GYRO}range = [2.0, -2.0]\n")).unwrap_err(),
        "unit.toml: channel g: range must be [least, most]"
    );
    let twice = format!("{GYRO}{}", &GYRO[GYRO.find("[[").unwrap()..]);
    assert_eq!(
        read(&twice).unwrap_err(),
        "unit.toml: channel g: name is used twice; give every channel its own"
    );
    assert_eq!(
        read("name = \"u\"\nchannel = []\n").unwrap_err(),
        "unit.toml: has no [[channel]]; describe at least one"
    );
    for (from, to, key) in [
        ("lsb", "lbs", "lbs"),
        ("gyro", "gyros", "gyros"),
        ("group = \"p\"\n", "", "group"),
    ] {
        let message = changed(from, to);
        assert!(message.starts_with("unit.toml: ") && message.contains(key), "{message}");
    }
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let error = UnitDescription::open(Path::new("no/unit.toml"))
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("no/unit.toml: cannot be read (No such file"),
        "{error}"
    );
}
