use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use twin::{
    environment::Environment,
    motion::Tumble,
    predict::{Scene, emems},
};

use super::*;
use crate::input::log::Series;

/// \[m/s^2\] of the error an octave above.
const OCTAVE: f64 = 0.3;

/// A minute of a tumble, and readings that are off by the noise of each sensor, by `below` times the octave and by what `more` adds.
fn level_of(below: f64, more: impl Fn(usize, &Twin) -> Vec<f64>) -> f64 {
    let (unit, environment) = (emems(|_| 0.0), Environment::laboratory());
    let scene = Scene::new(&Tumble::new(), &environment, 0.0, 60.0, 0.01);
    let starts_s: Vec<f64> = (0..300).map(|row| 0.2 * f64::from(row)).collect();
    let twin = Twin::new(unit, environment, scene, starts_s).expect("a twin");
    let mut noise = Xoshiro256PlusPlus::seed_from_u64(1);
    let channels = twin.unit().channels.iter().enumerate();
    let channels = channels.map(|(index, channel)| {
        let predicted = twin.channel(index, &[]);
        let mut normal = |sigma: f64| -> f64 {
            let standard: f64 = StandardNormal.sample(&mut noise);
            sigma * standard
        };
        let values = predicted.iter().zip(more(index, &twin));
        Series {
            rows: (0..300).collect(),
            values: values
                .map(|(value, more)| value + more + normal(channel.sigma()) + normal(below * OCTAVE))
                .collect(),
        }
    });
    let fit = Fit {
        channels: channels.collect(),
    };
    let levels = levels(&twin, &fit, Kind::Accelerometer, &|_, _| OCTAVE, 1.0);
    assert_eq!(levels.len(), 12);
    levels.into_iter().map(|(_, level)| level).fold(0.0, f64::max)
}

fn nothing(_: usize, twin: &Twin) -> Vec<f64> {
    vec![0.0; twin.starts_s().len()]
}

#[test]
fn the_log_tells_how_much_of_the_octave_above_is_below() {
    for below in [0.2, 0.5, 0.9] {
        let told = level_of(below, nothing);
        // The largest of a few medians of four, each of 300 samples: 1 / sqrt(2 * 300) is a twenty-fifth.
        assert!((told / below - 1.0).abs() < 0.1, "{below}: {told}");
    }
    assert!(level_of(0.0, nothing) < 0.1);
    assert_eq!(level_of(3.0, nothing), 1.0, "no more than the most");
}

#[test]
fn a_calibration_that_is_off_and_a_sensor_that_is_loud_are_no_error_of_the_reference() {
    let off = |index: usize, twin: &Twin| -> Vec<f64> {
        let reading = twin.channel(index, &[]);
        reading.iter().map(|value| 0.3 + 0.05 * value).collect()
    };
    let told = level_of(0.3, off);
    assert!((0.27..0.33).contains(&told), "{told}");
    let loud = |index: usize, twin: &Twin| -> Vec<f64> {
        let size = if index < 3 { 2.0 } else { 0.0 };
        let rows = 0..twin.starts_s().len();
        rows.map(|row| if row % 2 == 0 { size } else { -size }).collect()
    };
    let told = level_of(0.3, loud);
    assert!((0.25..0.4).contains(&told), "{told}");
}
