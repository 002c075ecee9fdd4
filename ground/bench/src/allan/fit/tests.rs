use rayon::prelude::*;

use super::{
    super::{
        deviation::{octaves, sweep},
        phase::{Input, Phase},
        series::Series,
        simulate::Noise,
    },
    *,
};

const CONFIDENCE: f64 = 0.95;
const STEP_S: f64 = 0.1;
/// Share of records in which a term is seen that is not there: 2.5 standard deviations are exceeded by 0.6 %, by chi-squared
/// ones somewhat more often.
const FALSE_ALARMS: f64 = 0.02;

fn points(noise: &Noise, count: usize, seed: u64) -> Vec<Point> {
    let series = Series {
        step_s: STEP_S,
        values: noise.rate(count, STEP_S, seed),
        gaps: Vec::new(),
    };
    let phase = Phase::new(&series, Input::Rate);
    sweep(&phase, &octaves(&phase), |_| ())
}

fn fitted(noise: &Noise, count: usize, seed: u64) -> Fit {
    fit(&points(noise, count, seed), STEP_S, &Term::POWER_LAWS, CONFIDENCE).expect("enough points")
}

fn finding(fit: &Fit, term: Term) -> Finding {
    fit.findings
        .iter()
        .find(|(other, _)| *other == term)
        .expect("asked for")
        .1
}

/// Coefficients in the order of [`Term::POWER_LAWS`].
fn truth(noise: &Noise) -> [f64; 5] {
    [
        noise.quantisation,
        noise.arw,
        noise.bias_instability,
        noise.rrw,
        noise.ramp,
    ]
}

#[test]
fn a_rate_walk_and_a_ramp_the_record_is_too_short_for_are_refused_and_bounded() {
    let noise = Noise {
        arw: 0.03,
        rrw: 1e-5,
        ramp: 1e-9,
        ..Noise::default()
    };
    let fit = fitted(&noise, 16_384, 5);
    for (term, truth) in [(Term::RateWalk, 1e-5), (Term::Ramp, 1e-9)] {
        let Finding::NotSeen { below } = finding(&fit, term) else {
            panic!("{}", term.name())
        };
        assert!(below > truth && below.is_finite());
    }
    assert!(matches!(finding(&fit, Term::AngleWalk), Finding::Seen { .. }));
}

#[test]
fn a_long_record_shows_its_ramp_and_its_bias_instability() {
    let ramp = fitted(
        &Noise {
            arw: 0.03,
            ramp: 1e-4,
            ..Noise::default()
        },
        32_768,
        6,
    );
    let Finding::Seen { value, .. } = finding(&ramp, Term::Ramp) else {
        panic!("ramp")
    };
    assert!((value / 1e-4 - 1.0).abs() < 0.05, "{value}");

    let flicker = fitted(
        &Noise {
            arw: 0.01,
            bias_instability: 0.02,
            ..Noise::default()
        },
        65_536,
        7,
    );
    let Finding::Seen { low, high, .. } = finding(&flicker, Term::BiasInstability) else {
        panic!("bias instability")
    };
    assert!(low < 0.02 && 0.02 < high, "{low} {high}");
}

#[test]
fn a_record_of_three_octaves_is_not_asked_for_five_coefficients() {
    let fit = fit(
        &points(
            &Noise {
                arw: 1.0,
                ..Noise::default()
            },
            20,
            8,
        ),
        STEP_S,
        &Term::POWER_LAWS,
        CONFIDENCE,
    );
    assert!(fit.is_none_or(|fit| fit.findings.iter().filter(|(_, finding)| finding.value() > 0.0).count() <= 2));
}

#[test]
fn a_constant_record_has_nothing_to_fit() {
    assert_eq!(
        fit(
            &points(&Noise::default(), 1_000, 9),
            STEP_S,
            &Term::POWER_LAWS,
            CONFIDENCE
        ),
        None
    );
}

/// A line that nobody fits pushes other coefficients below zero; that says nothing about how small they are.
#[test]
fn a_coefficient_below_zero_is_bounded_as_if_at_zero() {
    let noise = Noise {
        arw: 0.01,
        ..Noise::default()
    };
    let below = |line: f64| {
        let mut values = noise.rate(30_000, STEP_S, 10);
        for (k, value) in values.iter_mut().enumerate() {
            *value += line * (0.7 * k as f64).sin();
        }
        let series = Series {
            step_s: STEP_S,
            values,
            gaps: Vec::new(),
        };
        let phase = Phase::new(&series, Input::Rate);
        let points = sweep(&phase, &octaves(&phase), |_| ());
        let fit = fit(&points, STEP_S, &Term::POWER_LAWS, CONFIDENCE).expect("enough points");
        fit.findings.into_iter().map(|(_, finding)| match finding {
            Finding::NotSeen { below } => below,
            Finding::Seen { .. } => f64::INFINITY,
        })
    };
    for (disturbed, clean) in below(0.02).zip(below(0.0)) {
        assert!(
            disturbed > 0.5 * clean || clean.is_infinite(),
            "{disturbed}, where {clean} was clean"
        );
    }
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    /// Of 1,000 records, seven are one standard deviation of the count; the wanted 93 to 97 % are three of them.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn intervals_hold_the_truth_in_93_to_97_of_100_records_whatever_the_noise_is_made_of() {
        let none = Noise::default();
        #[rustfmt::skip]
        let noises = [
            Noise { arw: 0.03, ..none },
            Noise { bias_instability: 0.02, ..none },
            Noise { arw: 0.01, bias_instability: 0.02, ..none },
            Noise { quantisation: 0.01, arw: 0.03, rrw: 0.01, ..none },
            Noise { arw: 0.03, ramp: 1e-3, ..none },
            // A rate walk that the record is too short to show: its bound from above is asked of.
            Noise { arw: 0.03, bias_instability: 0.02, rrw: 0.003, ..none },
        ];
        let covariance = covariance_of(&points(&noises[0], 8_192, 0), STEP_S, &Term::POWER_LAWS);
        for noise in noises {
            let fits = (0..1_000).into_par_iter().map(|seed| {
                let points = points(&noise, 8_192, seed);
                fit_with(&points, &Term::POWER_LAWS, &covariance, CONFIDENCE).expect("enough points")
            });
            let fits: Vec<Fit> = fits.collect();
            println!("{noise:?}");
            for (term, truth) in Term::POWER_LAWS.into_iter().zip(truth(&noise)) {
                let is_seen = |fit: &&Fit| finding(fit, term).value() > 0.0;
                let seen = fits.iter().filter(is_seen).count() as f64 / fits.len() as f64;
                if truth == 0.0 {
                    assert!(seen <= FALSE_ALARMS, "{}: {seen}", term.name());
                    continue;
                }
                let held = fits.iter().filter(|fit| match finding(fit, term) {
                    Finding::Seen { low, high, .. } => low <= truth && truth <= high,
                    Finding::NotSeen { below } => truth <= below,
                });
                let held = held.count() as f64 / fits.len() as f64;
                println!("  {}: seen {seen}, held {held}", term.name());
                // A bound from above that cannot go below zero holds more often than it says where little is there.
                let most = if seen > 0.5 { 0.97 } else { 1.0 };
                assert!((0.93..=most).contains(&held), "{}: {held}", term.name());
            }
        }
    }
}
