//! A vibration at 82 Hz in accelerometers at 250 Hz, beside a reference that is used up to 20 Hz: named, and not where it is not there, nor where
//! what wanders is slow.

use std::fmt::Write;

use gap::{diagnose::diagnose, input::case::Subject};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

const RATE_HZ: usize = 250;
const SECONDS: usize = 60;

/// [m/s2] white noise of an accelerometer.
const NOISE: f64 = 0.05;

const CASE: &str = "[environment]\ngravity_m_s2 = 9.8\n[reference]\nattitude_sigma_rad = 0.003\nattitude_correlation_s = 20.0\n\
                    [windows]\nfit = [[0.0, 30.0]]\nhold = [[30.0, 60.0]]\n";

/// A sine at 82 Hz of so many sigmas.
fn sine(sigmas: f64) -> impl Fn(f64) -> f64 {
    move |t_s| sigmas * (std::f64::consts::TAU * 82.33 * t_s).sin()
}

/// Effects that are named of three accelerometers that turn slowly and are shaken by `shaken` \[sigma\] of the time \[s\], with their sizes.
fn named(shaken: impl Fn(f64) -> f64, withheld: &[&str]) -> Vec<(&'static str, Vec<f64>)> {
    let mut unit = "name = \"three accelerometers\"\n".to_owned();
    for (name, axis) in [
        ("ax", "1.0, 0.0, 0.0"),
        ("ay", "0.0, 1.0, 0.0"),
        ("az", "0.0, 0.0, 1.0"),
    ] {
        let _ = write!(
            unit,
            "[[channel]]\nname = \"{name}\"\nsensor = \"accelerometer\"\ngroup = \"unit\"\naxis_b = [{axis}]\nlsb = 1.0\n\
             noise_sigma = {NOISE}\nbias_sigma = 0.02\nscale_sigma = 0.002\naxis_sigma_rad = 0.002\nrange = [-40.0, 40.0]\n"
        );
    }
    let (mut motion, mut measured) = ("t_s,qw,qx,qy,qz\n".to_owned(), "t_s,ax,ay,az\n".to_owned());
    let mut random = Xoshiro256PlusPlus::seed_from_u64(17);
    for k in 0..=RATE_HZ * SECONDS {
        let t_s = k as f64 / RATE_HZ as f64;
        // About x, so that specific force, up in n, is along -z and a little along y of b.
        let roll = 0.4 * (1.1 * t_s).sin();
        let _ = writeln!(
            motion,
            "{t_s:.3},{:.9},{:.9},0,0",
            (0.5 * roll).cos(),
            (0.5 * roll).sin()
        );
        let shaken = shaken(t_s);
        let mut felt = |value: f64, part: f64| {
            let noise: f64 = StandardNormal.sample(&mut random);
            value + NOISE * (noise + part * shaken)
        };
        let (x, y, z) = (
            felt(0.0, 1.0),
            felt(-9.8 * roll.sin(), 0.5),
            felt(-9.8 * roll.cos(), 0.8),
        );
        let _ = writeln!(measured, "{t_s:.3},{x:.6},{y:.6},{z:.6}");
    }
    let folder = crate::written::written("shaken", CASE, &unit, &motion, &measured);
    let subject = Subject::open(folder.path()).expect("opens");
    let withheld: Vec<String> = withheld.iter().map(|name| (*name).to_owned()).collect();
    let diagnosis = diagnose(&subject, &withheld, &|_, _| {});
    let sizes = |cause: &gap::probability::cause::Cause| cause.parameters.iter().map(|sized| sized.value).collect();
    diagnosis
        .causes
        .iter()
        .map(|cause| (cause.effect, sizes(cause)))
        .collect()
}

#[test]
fn a_vibration_too_fast_for_the_reference_is_named_with_its_sizes_and_none_is_where_there_is_none() {
    let shaken = named(sine(0.4), &[]);
    let [("vibration", sizes)] = &shaken[..] else {
        panic!("{shaken:?}");
    };
    assert_eq!(sizes.len(), 3);
    for (size, part) in sizes.iter().zip([1.0, 0.5, 0.8]) {
        assert!((size / (0.4 * part) - 1.0).abs() < 0.1, "{sizes:?}");
    }
    assert_eq!(named(sine(0.0), &[]), []);
    assert_eq!(named(sine(0.4), &["vibration"]), []);
}

/// As a smoothed reference leaves it: some hertz, large, in half of the seconds.
#[test]
fn what_wanders_slowly_is_no_vibration() {
    let wanders = |hz: f64| {
        move |t_s: f64| {
            let phase = std::f64::consts::TAU * hz * (t_s + 0.2 * (0.9 * t_s).sin() + 0.1 * (2.3 * t_s).cos());
            if (0.61 * t_s).sin() > 0.0 {
                30.0 * phase.sin()
            } else {
                0.0
            }
        }
    };
    assert!(named(wanders(7.0), &[]).iter().all(|(name, _)| *name != "vibration"));
    assert!(named(wanders(60.0), &[]).iter().any(|(name, _)| *name == "vibration"));
}
