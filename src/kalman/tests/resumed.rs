//! Over a reset: what is kept, what is refused, and how far the attitude may have gone meanwhile, in f64.

use super::*;
use crate::{
    draws::{Draws, near},
    kalman::{passage::walks, state::DRIVEN},
};

/// A filter after some seconds of motion, with all that it learns in it; the covariance is that of the latest window.
fn flown(seed: u64) -> World {
    let mut draws = Draws::of(seed);
    let params = Params {
        earth_rate_n: draws.vector(0.01),
        ..params()
    };
    let mut world = World::new(draws.attitude(), params);
    for _ in 0..3 {
        let rate_b = draws.vector(1.0);
        world.fly(1.0, rate_b, |_, step| biased(step));
    }
    world.filter.settle(&mut Outcome::default());
    world.filter.bias_b = draws.vector(0.01);
    world.filter.gyro_matrix = Matrix3::from_fn(|_, _| draws.within(-0.01, 0.01));
    world.filter.rate_b = draws.vector(1.0);
    world
}

fn of(x: f32) -> f64 {
    f64::from(x)
}

fn v(vector: &Vector3<f32>) -> Vector3<f64> {
    vector.cast()
}

/// What an outage must do: rotation in n before, in b after, and the variance of each axis of the attitude.
struct Missed {
    s: f64,
    from_us: u64,
    turned_n: Vector3<f64>,
    turned_b: Vector3<f64>,
    variance: f64,
}

fn missed(
    before: &Filter,
    outage: &Outage,
    step: &Step,
    first_rate_b: Option<Vector3<f64>>,
    bias_variance: f64,
) -> Missed {
    let params = &before.params;
    let from_us = step.at_us - (step.covered_s * 1e6) as u64;
    let s = of(outage.lasted_s) + (from_us.saturating_sub(outage.ended_us)) as f64 * 1e-6;
    let gyro_b = v(&step.rate_b);
    let second_b = gyro_b - before.gyro_matrix.cast::<f64>() * gyro_b - v(&before.bias_b);
    let first_b = first_rate_b.unwrap_or(second_b);
    let fastest = first_b.norm().max(second_b.norm());
    let sd = s * ((second_b - first_b).norm() / 2.0 + 0.1 * fastest) + of(outage.sd_s) * fastest;
    let noise = of(params.angle_noise).powi(2) * (s + 2.0 * of(params.window_s));
    let saturated = if step.saturated {
        (of(params.saturated_rate_sd) * s).powi(2)
    } else {
        0.0
    };
    Missed {
        s,
        from_us,
        turned_n: v(&params.earth_rate_n) * -s,
        turned_b: (first_b + second_b) * (s / 2.0),
        variance: sd * sd + noise + bias_variance * s * s + saturated,
    }
}

fn turned(before: &Filter, missed: &Missed) -> UnitQuaternion<f64> {
    let q: UnitQuaternion<f64> = before.q_nb.cast();
    UnitQuaternion::from_scaled_axis(missed.turned_n) * q * UnitQuaternion::from_scaled_axis(missed.turned_b)
}

fn an_outage(draws: &mut Draws, longest_s: f32) -> (Outage, Step) {
    let outage = Outage {
        lasted_s: draws.within(0.0, longest_s),
        sd_s: draws.within(0.0, 0.02),
        ended_us: draws.one_of([0, 3_000_000, 9_000_000]),
    };
    let mut step = World::new(UnitQuaternion::identity(), params()).step(draws.vector(1.0));
    step.covered_s = draws.within(0.02, 0.3);
    step.at_us = 3_000_000 + draws.below(1_000_000);
    step.saturated = draws.below(3) == 0;
    (outage, step)
}

#[test]
fn an_outage_turns_the_attitude_at_the_mean_rate_and_costs_what_may_have_been_missed() {
    let (mut lost, mut kept) = (0, 0);
    for seed in 0..60 {
        let mut draws = Draws::of(1_000 + seed);
        let longest_s = draws.one_of([0.1, 0.4]);
        let (outage, step) = an_outage(&mut draws, longest_s);
        let mut filter = flown(seed % 6).filter;
        let before = filter.clone();
        let missed = missed(
            &before,
            &outage,
            &step,
            Some(v(&before.rate_b)),
            of(before.covariance.bias().diagonal().max()),
        );
        filter.going = Some(Going::On(outage));
        filter.bridge(&step);
        assert_eq!(filter.going, None);
        let p = before.covariance.matrix();
        let worst = (0..3).map(|k| of(p[(k, k)]) + missed.variance).fold(0.0, f64::max);
        let most = of(before.params.lost_sd).powi(2);
        assert!((worst / most - 1.0).abs() > 1e-5, "no seed is on the edge");
        if worst > most {
            lost += 1;
            assert!(!filter.aligned && filter.q_nb == UnitQuaternion::identity() && filter.bias_b == Vector3::zeros());
            continue;
        }
        kept += 1;
        assert!(filter.aligned && filter.last_us == Some(missed.from_us), "{seed}");
        assert_eq!(filter.settlements, before.settlements.wrapping_add(1));
        let off = filter.q_nb.cast::<f64>().angle_to(&turned(&before, &missed));
        assert!(off < 2e-5, "{seed}: {off}");
        let after = filter.covariance.matrix();
        let walks = walks(&before.params, missed.s as f32);
        for row in 0..after.nrows() {
            for column in 0..after.ncols() {
                let velocity = [row, column].map(|k| (3..DRIVEN).contains(&k));
                let grown = match row {
                    _ if row != column => 0.0,
                    0..3 => missed.variance,
                    3..DRIVEN => of(before.params.velocity_sd).powi(2),
                    k => of(walks[usize::from(k >= DRIVEN + 3)]),
                };
                let was = if velocity[0] || velocity[1] {
                    0.0
                } else {
                    of(p[(row, column)])
                };
                assert!(
                    near(after[(row, column)], was + grown, 1e-4, 1e-12),
                    "{seed} {row} {column}"
                );
            }
        }
    }
    assert!(lost > 5 && kept > 20, "{lost} {kept}");
}

#[test]
fn an_attitude_from_elsewhere_waits_for_the_first_window() {
    let (mut known, mut unknown) = (0, 0);
    for seed in 0..60 {
        let mut draws = Draws::of(2_000 + seed);
        let longest_s = draws.one_of([0.2, 3.0]);
        let (outage, step) = an_outage(&mut draws, longest_s);
        let params = Params {
            earth_rate_n: draws.vector(0.01),
            angle_noise: 0.1,
            window_s: 0.5,
            ..params()
        };
        let mut filter = Filter::new(params);
        let (q_nb, covariance_n) = (draws.attitude(), draws.covariance(0.02));
        let (bias_b, bias_sd) = (draws.vector(0.01), core::array::from_fn(|_| draws.within(1e-4, 1e-2)));
        filter.resume_near(q_nb, covariance_n, (bias_b, bias_sd), outage);
        assert_eq!((filter.q_nb, filter.bias_b, filter.aligned), (q_nb, bias_b, false));
        for k in 0..3 {
            let column = filter.covariance.bias().column(k).into_owned();
            let mut expected = Vector3::zeros();
            expected[k] = square(bias_sd[k]);
            assert_eq!(column, expected);
        }
        let before = filter.clone();
        let worst_bias = bias_sd.iter().fold(0.0, |most: f64, sd| most.max(of(*sd).powi(2)));
        let missed = missed(&before, &outage, &step, None, worst_bias);
        filter.bridge(&step);
        let worst = of(covariance_n.diagonal().max()) + missed.variance;
        let most = of(params.lost_sd).powi(2);
        assert!((worst / most - 1.0).abs() > 1e-5, "no seed is on the edge");
        assert!(!filter.aligned && filter.last_us == Some(missed.from_us));
        assert!(filter.q_nb.cast::<f64>().angle_to(&turned(&before, &missed)) < 2e-5);
        match filter.known_before {
            Some(found) => {
                known += 1;
                assert!(worst < most);
                let grown = Matrix3::from_diagonal_element(missed.variance);
                let expected = covariance_n.cast::<f64>() + grown;
                assert!((found.cast::<f64>() - expected).norm() < 1e-5 * expected.norm());
                // The first window found nothing: it goes on from there, less sure by how the window turned.
                filter.measured.means.angle_variance = 0.125;
                assert!(filter.fall_back() && filter.aligned && filter.known_before.is_none());
                let p = filter.covariance.matrix().cast::<f64>();
                for row in 0..3 {
                    for column in 0..3 {
                        let turned = if row == column { 0.125 } else { 0.0 };
                        assert!(near(
                            p[(row, column)] as f32,
                            expected[(row, column)] + turned,
                            1e-4,
                            1e-7
                        ));
                    }
                }
                for k in 3..DRIVEN {
                    assert!(near(p[(k, k)] as f32, of(params.velocity_sd).powi(2), 1e-6, 0.0));
                }
            }
            None => {
                unknown += 1;
                assert!(worst > most);
                assert!(!filter.fall_back() && !filter.aligned);
            }
        }
    }
    assert!(known > 20 && unknown > 5, "{known} {unknown}");
}

#[test]
fn what_is_kept_comes_back() {
    let mut world = flown(1);
    let mut bytes = [0; KEPT_BYTES];
    assert!(!Filter::new(params()).keep(&mut bytes), "nothing to keep");
    assert_eq!(bytes, [0; KEPT_BYTES]);
    assert!(world.filter.keep(&mut bytes));
    assert_eq!(Some(Filter::kept_at_us(&bytes)), world.filter.last_us);
    let outage = Outage::default();
    let mut after = Filter::new(world.filter.params);
    after.resume(&bytes, outage);
    let kept = |filter: &Filter| ((filter.bias_b, filter.gyro_matrix, filter.rate_b), filter.reference);
    assert_eq!(kept(&after), kept(&world.filter));
    assert!(after.q_nb.angle_to(&world.filter.q_nb) < 1e-6);
    assert!((after.iron.iron_b - world.filter.iron.iron_b).norm() < 1e-4);
    assert!(
        after
            .iron
            .covariance
            .relative_eq(&world.filter.iron.covariance, 1e-4, 1e-4)
    );
    assert_eq!(after.going, Some(Going::On(outage)));
    let mut again = [0; KEPT_BYTES];
    after.covariance.go_on(0.0, 0.0);
    (after.aligned, after.last_us) = (true, world.filter.last_us);
    after.q_nb = world.filter.q_nb;
    assert!(after.keep(&mut again));
    assert_eq!(again, bytes, "the covariance included");
}

/// While the work of a window is half done the covariance kept before stands, and the state is that of now.
#[test]
fn the_covariance_is_kept_when_it_is_complete() {
    let mut world = flown(1);
    world.fly(1.0, Vector3::zeros(), nothing);
    let (mut whole, mut halves) = ([0; KEPT_BYTES], 0);
    let numbers = KEPT_BYTES - 4 * (6 + 3 * 12 + 12 * 13 / 2);
    for _ in 0..60 {
        let before = whole;
        world.fly(STEP_S, Vector3::zeros(), nothing);
        assert!(world.filter.keep(&mut whole));
        assert_ne!(before[..numbers], whole[..numbers]);
        let half = world.filter.pending.is_half_done();
        assert_eq!(world.filter.settled().is_none(), half);
        if half {
            halves += 1;
            assert_eq!(before[numbers..], whole[numbers..]);
        } else {
            let mut copy = world.filter.clone();
            let mut first = None;
            copy.covariance.each_kept(&mut |number| {
                first.get_or_insert(*number);
            });
            let kept = f32::from_le_bytes(core::array::from_fn(|k| whole[numbers + k]));
            assert_eq!(Some(kept), first);
        }
    }
    assert!(halves > 0);
}

#[test]
fn bytes_that_are_no_state_are_refused() {
    let mut world = flown(1);
    let mut bytes = [0; KEPT_BYTES];
    assert!(world.filter.keep(&mut bytes));
    let params = world.filter.params;
    let resumes = |bytes: &[u8; KEPT_BYTES]| {
        let mut filter = Filter::new(params);
        filter.resume(bytes, Outage::default());
        let norm = filter.q_nb.as_vector().norm();
        // A step of Newton's method from as far as a tenth off, or begun anew.
        assert!((norm - 1.0).abs() < 0.005, "{norm}");
        filter.going.is_some()
    };
    assert!(resumes(&bytes));
    // Each number by itself: bias, gyro matrix, iron, covariance. The last of the iron is the twelfth before the covariance.
    let numbers = (KEPT_BYTES - 8) / 4;
    let covariance = 6 + 3 * 12 + 12 * 13 / 2;
    for at in [
        4,
        8,
        numbers - covariance - 12,
        numbers - covariance - 1,
        numbers - covariance,
        numbers - 1,
    ] {
        for wrong in [f32::NAN, f32::INFINITY] {
            let mut other = bytes;
            other[8 + 4 * at..12 + 4 * at].copy_from_slice(&wrong.to_le_bytes());
            assert!(!resumes(&other), "{at}");
        }
    }
    for (squared, is) in [
        (0.89, false),
        (0.91, true),
        (1.09, true),
        (1.11, false),
        (0.0, false),
        (f32::NAN, false),
    ] {
        let mut other = bytes;
        for (part, at) in (0..4).map(|k| (f32::from(u8::from(k == 3)) * ComplexField::sqrt(squared), 8 + 4 * k)) {
            other[at..at + 4].copy_from_slice(&part.to_le_bytes());
        }
        assert_eq!(resumes(&other), is, "{squared}");
    }
    let near = |bias: f32, sd: f32| {
        let mut filter = Filter::new(params);
        let bias_b = Vector3::new(0.0, bias, 0.0);
        let known = (bias_b, [1e-3, sd, 1e-3]);
        filter.resume_near(tilted(), Matrix3::identity(), known, Outage::default());
        filter.going.is_some()
    };
    assert!(near(0.01, 1e-3) && !near(f32::NAN, 1e-3) && !near(0.01, f32::INFINITY));
}
