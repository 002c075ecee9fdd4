//! Noise that is louder than described, beside a reference that errs slowly: in all of six gyros it is the description's, in one it is not.

use std::{fmt::Write, fs};

use crate::gyros::{NOISE, RATE_HZ, SECONDS, diagnosed_in, erring, rate};
use gap::{diagnose::Diagnosis, probability::outcome::Outcome};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

/// The three gyros and three more beside them, each of the six with so many times the noise that is described: white, or each sample alike to
/// the one before by `alike`.
fn diagnosed(louder: [f64; 6], alike: f64) -> Diagnosis {
    let folder = erring(|_| 0.0, "");
    let at = |name: &str| folder.path().join(name);
    let read = |name: &str| fs::read_to_string(at(name)).expect("a file");
    let case = read("case.toml") + "[reference]\nattitude_sigma_rad = 0.003\nattitude_correlation_s = 20.0\n";
    let unit = read("unit.toml");
    let (_, channels) = unit.split_once("[[channel]]").expect("channels");
    let beside = format!("[[channel]]{channels}");
    let beside = beside
        .replace("name = \"g", "name = \"h")
        .replace("\"unit\"", "\"beside\"");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut noise = [0.0; 6];
    let mut measured = "t_s,gx,gy,gz,hx,hy,hz\n".to_owned();
    for row in 0..SECONDS * RATE_HZ {
        let t_s = row as f64 / RATE_HZ as f64;
        let _ = write!(measured, "{t_s:.1}");
        for (gyro, noise) in noise.iter_mut().enumerate() {
            let own: f64 = StandardNormal.sample(&mut random);
            *noise = alike * *noise + (1.0 - alike * alike).sqrt() * own;
            // The Earth's rate is a fortieth of the noise, and a zero has room for it.
            let turning = if gyro % 3 == 2 { rate(t_s) } else { 0.0 };
            let _ = write!(measured, ",{:.7}", turning + NOISE * louder[gyro] * *noise);
        }
        measured.push('\n');
    }
    for (name, text) in [
        ("case.toml", case),
        ("unit.toml", unit + &beside),
        ("measured.csv", measured),
    ] {
        fs::write(at(name), text).expect("a file");
    }
    diagnosed_in(&folder, &[]).1
}

fn names(diagnosis: &Diagnosis) -> Vec<&'static str> {
    diagnosis.causes.iter().map(|cause| cause.effect).collect()
}

/// Three standard deviations of a level and a colour: `sqrt(3/n)` of a channel's 600 fitted samples, `sqrt(pi/2)` times that twice, for both
/// medians, over the root of six channels.
const BY_CHANCE: f64 = 0.14;

/// What is said of the gyros' noise, its level over that declared, and its colour.
fn said(diagnosis: &Diagnosis) -> (Vec<&'static str>, f64, f64) {
    let [gyros] = &diagnosis.noise[..] else {
        panic!("{:?}", diagnosis.noise);
    };
    (gyros.words(), gyros.seen / gyros.declared, gyros.colour)
}

#[test]
fn noise_that_is_louder_in_all_has_no_name_and_in_one_it_has() {
    let all = diagnosed([1.4; 6], 0.0);
    assert_eq!(names(&all), Vec::<&str>::new());
    assert!(
        matches!(all.outcome, Outcome::Clean | Outcome::Recalibrate),
        "{:?}",
        all.outcome
    );
    let one = diagnosed([1.0, 1.4, 1.0, 1.0, 1.0, 1.0], 0.0);
    assert_eq!(names(&one), ["noise-level"]);
}

#[test]
fn noise_that_is_louder_and_coloured_in_all_matters_to_nobody_and_in_one_it_does() {
    let all = diagnosed([1.4; 6], 0.15);
    assert!(all.remainder.matters < 0.5, "{:?}", all.remainder);
    let one = diagnosed([1.0, 1.4, 1.0, 1.0, 1.0, 1.0], 0.15);
    assert!(
        one.remainder.matters > 0.5 || !one.causes.is_empty(),
        "{:?}",
        one.remainder
    );
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn noise_is_told_beside_the_verdict_as_it_is() {
        for (louder, alike, words) in [
            ([1.0; 6], 0.0, &[][..]),
            ([1.0, 2.0, 1.0, 1.0, 1.0, 1.0], 0.0, &[]),
            ([0.7; 6], 0.0, &["quieter"]),
            ([1.4; 6], 0.0, &["louder"]),
            ([1.0; 6], 0.5, &["coloured"]),
            ([1.4; 6], -0.5, &["louder", "coloured"]),
        ] {
            let (own, ratio, colour) = said(&diagnosed(louder, alike));
            assert_eq!(own, words, "{louder:?} {alike}");
            assert!((ratio / louder[0] - 1.0).abs() < BY_CHANCE, "{ratio} of {louder:?}");
            assert!((colour - alike).abs() < BY_CHANCE, "{colour} of {alike}");
        }
    }
}
