//! What a window says against the definitions of it, in f64 and from the samples one by one.

extern crate std;

use std::vec::Vec;

use super::*;
use crate::draws::{Draws, near};

type V = Vector3<f64>;

/// What one window was given.
#[derive(Default)]
struct Given {
    /// Mean attitude, increment, covered and gap \[s\], variance.
    turns: Vec<(Matrix3<f64>, V, f64, f64, f64)>,
    /// Specific force in n, variance and scatter.
    acc: Vec<(V, f64, f64)>,
}

fn sum(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |sum, value| sum + value)
}

fn total(values: impl Iterator<Item = V>) -> V {
    values.fold(V::zeros(), |sum, value| sum + value)
}

impl Given {
    fn duration(&self) -> f64 {
        sum(self.turns.iter().map(|turn| turn.2 + turn.3))
    }

    fn covered(&self) -> f64 {
        sum(self.turns.iter().map(|turn| turn.2))
    }

    fn count(&self) -> f64 {
        self.acc.len() as f64
    }

    fn mean(&self) -> V {
        total(self.acc.iter().map(|acc| acc.0)) / self.count()
    }

    /// By trapezoids from the last sample of the window before.
    fn integral_mean(&self, before: &Given) -> V {
        let Some(began) = before.acc.last() else {
            return self.mean();
        };
        let ends = core::iter::once(began.0).chain(self.acc.iter().map(|acc| acc.0));
        let ends: Vec<V> = ends.collect();
        total(ends.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0)) / self.count()
    }

    fn noise(&self) -> f64 {
        sum(self.acc.iter().map(|acc| acc.1)) / self.count()
    }

    fn spread(&self) -> f64 {
        let mean = self.mean();
        let apart = sum(self.acc.iter().map(|acc| (acc.0 - mean).norm_squared())) / self.count();
        (apart - 3.0 * self.noise()).max(0.0) + sum(self.acc.iter().map(|acc| acc.2)) / self.count()
    }

    /// Of a component of a sample: its noise, or what no line through the two samples before foresaw.
    fn missed(&self, before: &Given) -> f64 {
        let all: Vec<V> = before.acc.iter().chain(&self.acc).map(|acc| acc.0).collect();
        let first = before.acc.len().max(2);
        let off = (first..all.len()).map(|k| all[k] - (all[k - 1] + (all[k - 1] - all[k - 2])));
        // The three samples of a line have one, two and one parts of it: six variances of each of three components.
        let unforeseen = sum(off.map(|off| off.norm_squared() / 6.0)) / 3.0 / self.count();
        if unforeseen > f64::from(BEYOND_NOISE) * self.noise() {
            unforeseen
        } else {
            self.noise()
        }
    }
}

/// Two windows, one after the other, of samples drawn at random. What moves, and how much, is another for each seed.
fn two(seed: u64) -> (Window, Params, [Given; 2], Means, bool) {
    let mut draws = Draws::of(seed);
    let mut window = Window::EMPTY;
    let mut given = [Given::default(), Given::default()];
    let params = Params {
        acc_scale_error: draws.within(0.0, 0.3),
        acc_excess: draws.within(0.0, 0.3),
        ..Params::ROOM
    };
    let mut before = Means::default();
    let shaken = draws.one_of([0.01, 0.1, 1.0, 4.0]);
    let turning = draws.one_of([0.005, 0.02, 1.0]);
    let variance = draws.one_of([1e-6, 0.01, 0.3]);
    let scatter = draws.one_of([0.0, 0.5]);
    let steady_b = draws.vector(turning);
    let off_by = draws.one_of([0.0, 3.0]);
    let off_n = draws.vector(off_by);
    let lift_off = draws.below(3) == 0;
    for (number, given) in given.iter_mut().enumerate() {
        if number == 1 {
            before = window.means(&params, lift_off);
            window.follow(&before);
        }
        for _ in 0..5 + draws.below(10) {
            let covered_s = draws.within(0.05, 0.2);
            let gap_s = if draws.below(4) == 0 {
                draws.within(0.01, 0.1)
            } else {
                0.0
            };
            let dcm = draws.dcm();
            let gyro_b = (steady_b + draws.vector(0.2 * turning)) * covered_s;
            let of_angle = draws.within(0.0, 1e-6);
            window.turn(&dcm, &gyro_b, covered_s, gap_s, of_angle);
            let turn = (
                dcm.cast(),
                gyro_b.cast(),
                covered_s.into(),
                gap_s.into(),
                of_angle.into(),
            );
            given.turns.push(turn);
            let acc_n = Vector3::new(0.0, 0.0, -params.gravity) + off_n + draws.vector(shaken);
            let sampled = Sampled {
                value_b: acc_n,
                variance: draws.within(0.5, 1.5) * variance,
                scatter: draws.within(0.5, 1.5) * scatter,
                at_us: 0,
            };
            window.take_acc(&acc_n, &sampled, params.gravity);
            given
                .acc
                .push((acc_n.cast(), sampled.variance.into(), sampled.scatter.into()));
        }
    }
    window.gyro_variance = draws.within(0.0, 1e-6);
    (window, params, given, before, lift_off)
}

const SEEDS: u64 = 400;

#[test]
fn means_are_those_of_the_samples() {
    let (mut rests, mut verticals, mut missed) = (0, 0, 0);
    for seed in 0..SEEDS {
        let (window, params, [first, second], before, lift_off) = two(seed);
        let found = window.means(&params, lift_off);
        let is = |found: f32, expected: f64, what: &str| {
            assert!(near(found, expected, 1e-4, 3e-5), "{seed}: {what} {found} {expected}");
        };
        let are = |found: &[f32], expected: &[f64], what: &str| {
            found
                .iter()
                .zip(expected)
                .for_each(|(found, expected)| is(*found, *expected, what));
        };
        let (covered, duration) = (second.covered(), second.duration());
        let rate_b = total(second.turns.iter().map(|turn| turn.1)) / covered;
        is(found.duration_s, duration, "duration");
        are(found.rate_b.as_slice(), rate_b.as_slice(), "rate");
        let square = |x: f64| x * x;
        let of = |x: f32| f64::from(x);
        assert!(near(
            found.rate_variance,
            of(window.gyro_variance) / square(covered),
            1e-4,
            0.0
        ));
        are(found.acc_n.as_slice(), second.mean().as_slice(), "force");
        let spread = second.spread();
        assert!(
            near(found.acc_spread, spread, 1e-3, 2e-4),
            "{seed}: {} {spread}",
            found.acc_spread
        );
        // Rates weighted by the time each lasted.
        let apart = |turn: &(Matrix3<f64>, V, f64, f64, f64)| (turn.1 / turn.2 - rate_b).norm_squared() * turn.2;
        let rate_spread = sum(second.turns.iter().map(apart)) / covered;
        let g = of(params.gravity);
        let near_one_g = (second.mean().norm() - g).abs() < 0.2 * g + 0.2 * spread.sqrt();
        let is_vertical = |window: &Given| {
            let near_one_g = (window.mean().norm() - g).abs() < 0.2 * g + 0.2 * window.spread().sqrt();
            let wild = window.acc.iter().any(|acc| (acc.0.norm() - g).abs() >= 0.1 * g);
            near_one_g && !(lift_off && wild)
        };
        let vertical = is_vertical(&second);
        let rest = !lift_off
            && near_one_g
            && rate_b.norm() < of(params.rest.rate)
            && rate_spread < square(of(params.rest.rate_spread))
            && spread < square(of(params.rest.acc_spread));
        let judged = (found.near_one_g, found.vertical, found.rest);
        assert_eq!(judged, (near_one_g, vertical, rest), "{seed}");
        (rests, verticals) = (rests + u32::from(rest), verticals + u32::from(vertical));
        let vertical_s = if vertical { duration } else { 0.0 };
        is(found.vertical_s, vertical_s, "vertical");
        let gained = second.integral_mean(&first) * vertical_s;
        are(found.velocity_change_n.as_slice(), &gained.as_slice()[..2], "velocity");
        // By how much force exceeds one g: a mean over three seconds, of which this window is a part. Of thrust and drag nothing stays.
        let is_of_flight = |window: &Given| lift_off && !is_vertical(window);
        let of_first = first.mean().norm() - g;
        let excess_before = if is_of_flight(&first) {
            0.0
        } else {
            of_first * (first.duration() / 3.0).min(1.0)
        };
        is(before.excess, excess_before, "excess before");
        let now = second.integral_mean(&first).norm() - g;
        let excess = if is_of_flight(&second) {
            0.0
        } else {
            excess_before + (now - excess_before) * (duration / 3.0).min(1.0)
        };
        is(found.excess, excess, "excess");
        let of_sample = second.missed(&first);
        missed += u32::from(of_sample > second.noise());
        let variance = square(vertical_s)
            * (square(of(params.acc_error))
                + square(of(params.acc_scale_error)) * spread
                + square(of(params.acc_excess) * excess)
                + of_sample / second.count());
        assert!(
            near(found.velocity_change_variance, variance, 2e-3, 1e-5),
            "{seed}: {variance} {found:?}"
        );
        let velocity = if rest {
            square(of(params.velocity_rest_sd))
        } else {
            square(of(params.velocity_sd)) + square(of(params.velocity_per_spread_s)) * spread
        };
        assert!(near(found.velocity_variance, velocity, 1e-3, 1e-6), "{seed}");
        let angle = sum(second.turns.iter().map(|turn| turn.4));
        assert!(near(found.angle_variance, angle, 1e-4, 0.0), "{seed}");
        let tilt = square(0.0175) + (0.2 + 1.0 / second.count()) * spread / square(g);
        assert!(near(found.tilt_variance, tilt, 1e-3, 0.0), "{seed}: {tilt} {found:?}");
        let lasting = square(of(params.velocity_sd)) * (of(params.velocity_lasts_s) / duration).max(1.0);
        let start = (lasting + 0.1 * spread).sqrt();
        assert!(near(found.start_velocity_sd(&params), start, 1e-3, 0.0), "{seed}");
    }
    // Each of them was seen often enough, and not always.
    for count in [rests, verticals, missed] {
        assert!(count > 20 && count < SEEDS as u32 - 20, "{rests} {verticals} {missed}");
    }
}

/// `-integral dcm_nb (1, gyro)`, and its integral as samples at the ends of steps see it.
#[test]
fn the_drive_is_the_integral_of_attitude_and_increments() {
    for seed in 0..SEEDS {
        let (window, _, [_, given], ..) = two(seed);
        let mut drive = [[0.0; DRIVERS]; 3];
        let mut integral = [[0.0; DRIVERS]; 3];
        for (dcm, gyro_b, covered_s, gap_s, _) in &given.turns {
            for axis in 0..3 {
                for k in 0..3 {
                    drive[axis][k] -= dcm[(axis, k)] * covered_s;
                    for j in 0..3 {
                        drive[axis][3 + 3 * k + j] -= dcm[(axis, k)] * gyro_b[j];
                    }
                }
                for k in 0..DRIVERS {
                    integral[axis][k] += drive[axis][k] * (covered_s + gap_s);
                }
            }
        }
        for (found, expected) in [(&window.drive, &drive), (&window.drive_integral, &integral)] {
            for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
                assert!(near(*found, *expected, 1e-4, 1e-5), "{seed}: {found} {expected}");
            }
        }
    }
}

/// In axes that are turned all that is kept in n turns with them: what the window says turns too, the window after it included.
#[test]
fn turned_axes_turn_all_that_is_kept_in_n() {
    for seed in 0..50 {
        let (window, params, ..) = two(seed);
        let turned = Draws::of(seed).dcm();
        let mut other = window.clone();
        other.turn_axes(&turned);
        let (found, expected) = (other.means(&params, false), window.means(&params, false));
        assert!((found.acc_n - turned * expected.acc_n).norm() < 1e-4);
        for (found, expected) in [
            (other.drive, window.drive),
            (other.drive_integral, window.drive_integral),
        ] {
            for k in 0..DRIVERS {
                let column = |drive: &[[f32; DRIVERS]; 3]| Vector3::new(drive[0][k], drive[1][k], drive[2][k]);
                assert!((column(&found) - turned * column(&expected)).norm() < 1e-5);
            }
        }
        let ends = [(other.acc.before_n, window.acc.before_n)];
        for (found, expected) in ends.iter().flat_map(|(found, expected)| found.iter().zip(expected)) {
            assert!((found.unwrap() - turned * expected.unwrap()).norm() < 1e-4);
        }
        assert!((other.acc.began_n.unwrap() - turned * window.acc.began_n.unwrap()).norm() < 1e-4);
        // A window without a step has nothing but them.
        let mut next = window.clone();
        next.follow(&expected);
        next.turn_axes(&turned);
        assert!((next.acc.began_n.unwrap() - turned * window.acc.before_n[0].unwrap()).norm() < 1e-4);
    }
}

/// A window of one second with one g, at the thresholds of rest: each of them by itself.
#[test]
fn rest_ends_at_each_of_its_thresholds() {
    let params = Params {
        gravity: 8.0,
        rest: super::super::Rest {
            acc_spread: 0.5,
            ..Params::ROOM.rest
        },
        ..Params::ROOM
    };
    // Rates that halve exactly, and forces in eighths: nothing is rounded.
    let rests = |rate: f32, rate_spread: f32, acc_spread: f32| {
        let mut window = Window::EMPTY;
        for sign in [1.0, -1.0] {
            let angle_b = Vector3::new((rate + sign * rate_spread) * 0.5, 0.0, 0.0);
            window.turn(&Matrix3::identity(), &angle_b, 0.5, 0.0, 0.0);
            let acc_n = Vector3::new(0.0, 0.0, -8.0 + sign * acc_spread);
            let sampled = Sampled {
                value_b: acc_n,
                variance: 0.0,
                scatter: 0.0,
                at_us: 0,
            };
            window.take_acc(&acc_n, &sampled, params.gravity);
        }
        (window.means(&params, false).rest, window.means(&params, true).rest)
    };
    let (rate, spread) = (params.rest.rate, params.rest.rate_spread);
    assert_eq!(rests(0.999 * rate, 0.0, 0.0), (true, false));
    assert_eq!(rests(rate, 0.0, 0.0), (false, false));
    assert_eq!(rests(0.0, 0.999 * spread, 0.0), (true, false));
    assert_eq!(rests(0.0, spread, 0.0), (false, false));
    assert_eq!(rests(0.0, 0.0, 0.49), (true, false));
    assert_eq!(rests(0.0, 0.0, 0.5), (false, false));
}

/// A step in which the gyros were not heard says nothing of their rate.
#[test]
fn a_rest_with_a_gap_in_it_is_a_rest() {
    let mut window = Window::EMPTY;
    for covered_s in [0.5, 0.0, 0.5] {
        window.turn(&Matrix3::identity(), &Vector3::zeros(), covered_s, 0.5 - covered_s, 0.0);
        let acc_n = Vector3::new(0.0, 0.0, -Params::ROOM.gravity);
        let sampled = Sampled {
            value_b: acc_n,
            variance: 0.0,
            scatter: 0.0,
            at_us: 0,
        };
        window.take_acc(&acc_n, &sampled, Params::ROOM.gravity);
    }
    assert!(window.means(&Params::ROOM, false).rest);
}

/// Without gyros, or without samples of force, nothing is divided by nothing.
#[test]
fn a_window_with_nothing_in_it_says_nothing() {
    let mut window = Window::EMPTY;
    window.turn(&Matrix3::identity(), &Vector3::zeros(), 0.0, 0.5, 0.0);
    let means = window.means(&Params::ROOM, false);
    assert_eq!(
        (means.duration_s, means.rest, means.vertical, means.near_one_g),
        (0.5, false, false, false)
    );
    assert_eq!(
        (means.acc_n, means.excess, means.velocity_change_variance),
        (Vector3::zeros(), 0.0, 0.0)
    );
    assert_eq!(means.rate_b, Vector3::zeros());
}

/// A force within a part of one g, just within and just beyond it either way.
#[test]
fn near_is_within_the_part_on_either_side() {
    for gravity in [9.806_65, 3.7] {
        for part in [0.1, 0.2] {
            for (off, is) in [(0.999, true), (1.001, false)] {
                for side in [-1.0, 1.0] {
                    let acc_n = Vector3::new(0.48, -0.6, 0.64) * (gravity * (1.0 + side * off * part));
                    assert_eq!(is_near(&acc_n, gravity, part), is, "{gravity} {part} {off} {side}");
                }
            }
            assert!(is_near(&Vector3::new(0.0, 0.0, gravity), gravity, part));
        }
    }
}
