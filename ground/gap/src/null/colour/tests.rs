use nalgebra::DVector;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use super::*;

const STEP_S: f64 = 0.02;
/// Windows of so many samples, each a gap after the one before.
const WINDOW: usize = 1000;
const WINDOWS: usize = 4;
const SAMPLES: usize = WINDOW * WINDOWS;

const SLOW: Process = Process::Alike {
    sigma: 0.2,
    alike_s: 20.0,
};

fn times_s() -> Vec<f64> {
    let of_window = |window: usize| (0..WINDOW).map(move |at| STEP_S * (2 * window * WINDOW + at) as f64);
    (0..WINDOWS).flat_map(of_window).collect()
}

fn normal(seed: u64) -> impl Iterator<Item = f64> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    std::iter::repeat_with(move || StandardNormal.sample(&mut random))
}

/// Noise that is loud around a quarter of the sampling rate, three times louder from the third window on; and, where it is not left out, what
/// errs slowly.
fn noise(seed: u64, slow: f64) -> DVector<f64> {
    let (mut fresh, mut fresh_slow) = (normal(seed), normal(seed + 1000));
    let times_s = times_s();
    let (mut before, mut value) = ([0.0; 2], 0.0);
    let mut last_s = 0.0;
    DVector::from_fn(SAMPLES, |at, _| {
        let fade = (-(times_s[at] - last_s) / 20.0).exp();
        last_s = times_s[at];
        let fresh_slow = fresh_slow.next().unwrap_or(0.0);
        value = if at == 0 {
            0.2 * fresh_slow
        } else {
            fade * value + 0.2 * (1.0 - fade * fade).sqrt() * fresh_slow
        };
        let own = 0.1 * fresh.next().unwrap_or(0.0) - 0.8 * before[1];
        before = [own, before[0]];
        let louder = if at >= 2 * WINDOW { 3.0 } else { 1.0 };
        louder * own + slow * value
    })
}

fn colour(rest: &DVector<f64>) -> Colour {
    Colour::of(rest, &times_s(), &[SLOW], &vec![vec![(0, 1.0)]; SAMPLES])
}

fn white(colour: &Colour, column: &DVector<f64>) -> DVector<f64> {
    let columns = DMatrix::from_columns(std::slice::from_ref(column));
    colour.applied(columns).column(0).into_owned()
}

/// Standard deviations of chance that each of a hundred must be within. The colour is of one draw and the noise of another, so it is that of
/// two.
const CHANCE: f64 = 4.0 * std::f64::consts::SQRT_2;

#[test]
fn noise_with_the_colour_of_another_draw_is_white_and_of_size_one_in_every_window() {
    let colour = colour(&noise(1, 1.0));
    let white = white(&colour, &noise(2, 1.0));
    for window in 0..WINDOWS {
        let own = white.rows(window * WINDOW, WINDOW);
        // The level is of another draw: it is known to a tenth over two seconds.
        let size = own.norm_squared() / WINDOW as f64;
        assert!((size - 1.0).abs() < 0.15, "window {window}: {size}");
        for lag in 1..=2 * ORDER {
            let alike = own.rows(lag, WINDOW - lag).dot(&own.rows(0, WINDOW - lag)) / own.norm_squared();
            assert!(
                alike.abs() < CHANCE / (WINDOW as f64).sqrt(),
                "window {window}, lag {lag}: {alike}"
            );
        }
    }
}

#[test]
fn a_column_that_is_taken_back_is_itself() {
    let colour = colour(&noise(3, 1.0));
    let column = noise(4, 0.5);
    let again = colour.taken_back(colour.applied(DMatrix::from_columns(std::slice::from_ref(&column))));
    assert!((again.column(0) - &column).amax() < 1e-9 * column.amax());
}

/// Of a magnet of thirty times the noise a fifteenth is left where the colour was taken with it in, enough to find it; beside pieces whose mean
/// was taken it is half of that.
#[test]
fn a_magnet_does_not_hide_in_the_colour_that_it_was_in() {
    let magnet = DVector::from_fn(SAMPLES, |at, _| {
        if (WINDOW / 2..3 * WINDOW / 2).contains(&at) {
            5.0
        } else {
            0.0
        }
    });
    let quiet = noise(5, 0.0);
    let [without, with] = [quiet.clone(), &quiet + &magnet].map(|rest| white(&colour(&rest), &magnet).norm_squared());
    assert!(with > 0.06 * without, "{with} of {without}");
}

/// Where the noise is a hundredth as loud a sine of a tenth of its size is plain.
#[test]
fn a_sine_is_told_where_the_noise_is_quiet() {
    let colour = colour(&noise(6, 0.0));
    let plain = |hz: f64| {
        let sine = DVector::from_fn(SAMPLES, |at, _| (TAU * hz * STEP_S * at as f64).sin());
        white(&colour, &sine).norm_squared()
    };
    // Of this autoregression |1 + 0.8 exp(-2iw)|^2: 3.24 at w = 0, 0.04 at a quarter of the rate.
    let ratio = plain(2.0) / plain(12.5);
    assert!(ratio > 40.0, "{ratio}");
}

#[test]
fn what_is_short_empty_or_nothing_has_no_colour_and_stays_finite() {
    for length in [0, 1, 5, 30] {
        let times_s: Vec<f64> = (0..length).map(|at| at as f64).collect();
        let sees = vec![vec![(0, 1.0)]; length];
        for rest in [DVector::zeros(length), DVector::from_fn(length, |at, _| at as f64)] {
            let colour = Colour::of(&rest, &times_s, &[SLOW], &sees);
            assert!(white(&colour, &rest).iter().all(|value| value.is_finite()), "{length}");
        }
    }
}

#[test]
fn a_dual_has_the_inner_products_of_what_is_made_white() {
    let (colour, column) = (colour(&noise(3, 1.0)), noise(4, 1.0));
    let other = DVector::from_fn(SAMPLES, |at, _| (0.01 * at as f64).cos());
    let [of_white, of_dual] = [white(&colour, &column).dot(&other), column.dot(&colour.dual(&other))];
    assert!(
        (of_white - of_dual).abs() < 1e-9 * of_white.abs(),
        "{of_white} {of_dual}"
    );
}
