//! Several effects that have nothing in common, in the readings of one unit: each is named, however many there are. A patchwork for one effect
//! that the library does not have is where that is.

use std::{fmt::Write, fs, path::Path};

use crate::written::written;
use gap::{diagnose::diagnose, input::case::Subject};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use twin::effect::{Active, Cause, Locality, by_name};

/// Iron is ten sigmas of a magnetometer's zero, so that calibration takes it up but for those.
const WRONG: [(&str, Option<&str>, &[f64]); 4] = [
    ("hard-iron", None, &[-9.0, 6.0, 4.0]),
    ("lever-arm", None, &[0.006, -0.004, 0.002]),
    ("gyro-scale", Some("g2"), &[0.04]),
    ("mag-latency", None, &[0.02]),
];

#[test]
fn four_effects_in_three_kinds_of_sensors_are_four_names() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let twin = Subject::open(&golden.join("healthy")).expect("a case").twin;
    let active = |(effect, place, theta): (&str, Option<&str>, &[f64])| Active {
        cause: Cause {
            effect: by_name(effect).expect("an effect"),
            locality: place.map_or(Locality::Common, |own| Locality::Channel(own.to_owned())),
            variant: 0.0,
        },
        theta: theta.to_vec(),
    };
    let wrong = WRONG.map(active);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let channels = &twin.unit().channels;
    let read: Vec<Vec<f64>> = (0..channels.len())
        .map(|index| {
            let exact = twin.channel(index, &wrong);
            let mut noise = || -> f64 { Distribution::<f64>::sample(&StandardNormal, &mut random) };
            exact
                .iter()
                .map(|value| value + channels[index].sigma() * noise())
                .collect()
        })
        .collect();
    let mut measured = format!(
        "t_s,{}\n",
        channels
            .iter()
            .map(|own| own.name.as_str())
            .collect::<Vec<_>>()
            .join(",")
    );
    for (row, start_s) in twin.starts_s().iter().enumerate() {
        let _ = write!(measured, "{start_s:.4}");
        read.iter().for_each(|values| {
            let _ = write!(measured, ",{:.6}", values[row]);
        });
        measured.push('\n');
    }
    let text = |name: &str| fs::read_to_string(golden.join(name)).expect("a file");
    let case = text("healthy/case.toml");
    let settings = &case[case.find("[environment]").expect("an environment")..];
    let motion = packed::read(&golden.join("hand-a.csv.gz"), 1 << 24).expect("a motion");
    let motion = String::from_utf8(motion).expect("text");
    // Readings that are not codes.
    let unit = text("unit-emems.toml").replace("bits = 12\n", "");
    let folder = written("together", settings, &unit, &motion, &measured);
    let subject = Subject::open(folder.path()).expect("a case");
    let diagnosis = diagnose(&subject, &[], &|_, _| {});
    let mut names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect).collect();
    names.sort_unstable();
    assert_eq!(
        names,
        ["gyro-scale", "hard-iron", "lever-arm", "mag-latency"],
        "withdrawn {:?}",
        diagnosis.withdrawn
    );
    assert!(diagnosis.none_of_these < 0.5, "{}", diagnosis.none_of_these);
}
