//! Whether the unit turns or its bias is another, by what force and field do meanwhile, in f64.

use super::*;
use crate::{
    draws::Draws,
    kalman::{Params, field_sums::MeanField},
};

type V = Vector3<f64>;

/// A window of rest of a filter whose bias is known to `sd`.
fn at_rest(draws: &mut Draws, sd: f32) -> Filter {
    let mut filter = Filter::new(Params::ROOM);
    filter.q_nb = draws.attitude();
    filter.bias_b = draws.vector(0.01);
    filter.covariance.know_bias(&[sd; 3]);
    filter.measured.means.duration_s = 1.0;
    filter.measured.means.rate_variance = square(1e-4);
    filter.measured.means.acc_n = Vector3::new(0.0, 0.0, -9.8) + draws.vector(0.5);
    filter.measured.field = Some(MeanField {
        mag_n: Vector3::new(20.0, 0.0, 30.0) + draws.vector(5.0),
        spread: 0.0,
        white: 0.0,
        iron: 0.0,
    });
    filter.correction.begin(filter.params.gate);
    filter
}

#[test]
fn a_contradiction_is_decided_by_how_far_force_and_field_have_turned() {
    let params = Params::ROOM;
    let (recovery_s, coast_s) = (params.recovery_s, params.coast_s);
    let (mut forgotten, mut turns) = (0, 0);
    for seed in 0..400 {
        let mut draws = Draws::of(seed);
        let mut filter = at_rest(&mut draws, 1e-5);
        let most = draws.one_of([0.002, 0.03]);
        let off_b = draws.vector(most);
        let bias_b = filter.bias_b + off_b;
        let lasted_s = draws.one_of([0.999 * recovery_s, recovery_s, 0.999 * coast_s, coast_s]);
        let angle_b = (bias_b.cast::<f64>() - filter.bias_b.cast::<f64>()) * f64::from(lasted_s);
        let part = f64::from(draws.within(-0.2, 1.2));
        // Where both were: now they are where a part of the turn has brought them.
        let now_b: [V; 2] = filter.seen_b().map(|now_b| now_b.cast());
        let then_b = now_b.map(|now_b| now_b - now_b.cross(&angle_b) * part);
        let (mut turned, mut would) = (0.0, 0.0);
        for (then_b, now_b) in then_b.iter().zip(&now_b) {
            let by_turn = then_b.cross(&angle_b);
            turned += by_turn.dot(&(now_b - then_b));
            would += by_turn.norm_squared();
        }
        let least = f64::from(TELLS).powi(2);
        if (would / least - 1.0).abs() < 1e-3 || (turned / would - 0.5).abs() < 1e-2 {
            continue;
        }
        let tells = lasted_s >= recovery_s && would >= least;
        let is_turn = tells && turned > 0.5 * would;
        let asked = tells || lasted_s >= coast_s;
        filter.contradicted = Some(Contradicted {
            lasted_s,
            seen_b: then_b.map(|then_b| then_b.cast()),
        });
        filter.compare_rest(&bias_b);
        let known = filter.covariance.bias();
        let is_forgotten = known == nalgebra::Matrix3::from_diagonal_element(square(params.bias_sd));
        assert_eq!(is_forgotten, asked && !is_turn, "{seed}: {lasted_s} {turned} {would}");
        forgotten += u32::from(is_forgotten);
        turns += u32::from(is_turn);
        // One that was decided begins anew where it goes on; one that was not is older by the window.
        if let Some(contradicted) = &filter.contradicted {
            let expected = if asked { 1.0 } else { lasted_s + 1.0 };
            assert_eq!(contradicted.lasted_s, expected, "{seed}");
            let found = contradicted.seen_b.map(|seen_b| seen_b.cast::<f64>());
            let expected = if asked { now_b } else { then_b };
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).norm() < 1e-6, "{seed}");
            }
        }
    }
    assert!(forgotten > 50 && turns > 30, "{forgotten} {turns}");
}

/// All three axes are taken together or not at all, and what is not taken contradicts.
#[test]
fn rest_is_taken_for_a_bias_within_the_gate_of_each_axis() {
    const SD: f32 = 1e-4;
    let params = Params::ROOM;
    let noise = square(params.rest.bias_sd) + square(1e-4);
    let most = params.gate * nalgebra::ComplexField::sqrt(square(SD) + noise);
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            for (part, is) in [(0.998, true), (1.002, false)] {
                let mut filter = at_rest(&mut Draws::of(1), SD);
                let mut off_b = Vector3::zeros();
                off_b[axis] = side * part * most;
                let bias_b = filter.bias_b + off_b;
                filter.compare_rest(&bias_b);
                assert_eq!(filter.correction.innovations.len(), 3);
                assert!(
                    filter.correction.innovations.iter().all(|record| record.accepted == is),
                    "{axis} {part}"
                );
                assert_eq!(filter.contradicted.is_none(), is, "{axis} {part}");
                assert!(filter.correction.usable);
                // As much of it as the variances say.
                let taken = filter.correction.error.drivers[axis];
                let expected = if is {
                    off_b[axis] * square(SD) / (square(SD) + noise)
                } else {
                    0.0
                };
                assert!((taken - expected).abs() < 1e-3 * most, "{taken} {expected}");
                if is {
                    let mut accepted = at_rest(&mut Draws::of(1), SD);
                    accepted.contradicted = Some(Contradicted {
                        lasted_s: 1.0,
                        seen_b: [Vector3::x(); 2],
                    });
                    accepted.compare_rest(&bias_b);
                    assert!(accepted.contradicted.is_none(), "what is accepted contradicts no more");
                }
            }
        }
    }
}
