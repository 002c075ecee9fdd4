//! The field of a window against the reference, and learning it, in f64 from the samples one by one.

extern crate std;

use std::vec::Vec;

use super::*;
use crate::draws::{Draws, near};

type V = Vector3<f64>;

fn of(x: f32) -> f64 {
    f64::from(x)
}

/// Samples in b, the matrices that take them to n, and variances.
fn samples(draws: &mut Draws, apart: f32) -> Vec<(Vector3<f32>, Matrix3<f32>, f32)> {
    let about_b = draws.vector(30.0);
    let start = draws.attitude();
    let count = 2 + draws.below(10);
    let sample = |draws: &mut Draws| {
        let turned = start * crate::attitude::from_rotation_vector(draws.vector(apart));
        let dcm = turned.to_rotation_matrix().into_inner();
        (about_b + draws.vector(8.0 * apart), dcm, draws.within(0.0, 0.5))
    };
    (0..count).map(|_| sample(draws)).collect()
}

fn sums(samples: &[(Vector3<f32>, Matrix3<f32>, f32)]) -> FieldSums {
    let mut sums = FieldSums::NONE;
    assert!(sums.if_any().is_none());
    samples
        .iter()
        .for_each(|(mag_b, dcm, variance)| sums.take(mag_b, dcm, *variance));
    sums
}

/// Mean in n, mean square distance from it, mean variance, without the iron.
fn mean(samples: &[(Vector3<f32>, Matrix3<f32>, f32)], iron_b: &Vector3<f32>) -> (V, f64, f64) {
    let count = samples.len() as f64;
    let in_n = |(mag_b, dcm, _): &(Vector3<f32>, Matrix3<f32>, f32)| dcm.cast::<f64>() * (mag_b - iron_b).cast();
    let mean = samples.iter().map(in_n).fold(V::zeros(), |sum, value| sum + value) / count;
    let apart = samples
        .iter()
        .map(|sample| (in_n(sample) - mean).norm_squared())
        .sum::<f64>()
        / count;
    (
        mean,
        apart,
        samples.iter().map(|sample| of(sample.2)).sum::<f64>() / count,
    )
}

#[test]
fn the_mean_field_is_that_of_the_samples_without_the_iron() {
    let params = Params::ROOM;
    for seed in 0..200 {
        let mut draws = Draws::of(seed);
        let apart = draws.one_of([0.01, 0.3, 1.0]);
        let samples = samples(&mut draws, apart);
        let sums = sums(&samples);
        let iron_b = draws.vector(5.0);
        let found = sums.if_any().expect("samples").mean(&iron_b);
        let (mean, apart, noise) = mean(&samples, &iron_b);
        assert!((found.mag_n.cast::<f64>() - mean).norm() < 1e-4);
        let spread = (apart - 3.0 * noise).max(0.0);
        assert!(
            near(found.spread, spread, 1e-3, 3e-3),
            "{seed}: {} {spread}",
            found.spread
        );
        let white = (spread + noise) / samples.len() as f64;
        assert!(near(found.white, white, 1e-3, 2e-3), "{seed}: {} {white}", found.white);
        let unrest = of(params.field_spread).powi(2) * spread + white;
        assert!(near(found.unrest(&params), unrest, 1e-3, 2e-3));
        let disturbance = draws.within(0.0, 0.1);
        let direction = of(params.start_field_sd).powi(2)
            + of(params.disturbance).powi(2) * of(disturbance)
            + (0.2 * spread + white) / mean.norm_squared();
        assert!(near(
            found.direction_sd(&params, disturbance),
            direction.sqrt(),
            1e-3,
            1e-6
        ));
        let turned = draws.dcm();
        let mut other = sums;
        other.turn_axes(&turned);
        assert!((other.mean(&iron_b).mag_n - turned * found.mag_n).norm() < 1e-4);
    }
}

#[test]
fn the_field_is_compared_across_itself() {
    let params = Params {
        heading_sd: 0.3,
        dip_sd: 0.2,
        ..Params::ROOM
    };
    for seed in 0..300 {
        let mut draws = Draws::of(seed);
        let (norm, dip, declination) = (
            draws.within(20.0, 60.0),
            draws.within(-1.4, 1.4),
            draws.within(-3.0, 3.0),
        );
        let reference = Reference::known(norm, dip, declination);
        let known_n = reference.field_n_ut().expect("known");
        let (norm, dip, declination) = (of(norm), of(dip), of(declination));
        let expected_n = V::new(dip.cos() * declination.cos(), dip.cos() * declination.sin(), dip.sin()) * norm;
        assert!((known_n.cast::<f64>() - expected_n).norm() < 1e-4 * norm);
        let heading = V::new(declination.cos(), declination.sin(), 0.0);
        assert!((reference.heading_n().cast::<f64>() - heading).norm() < 1e-6);
        let mean = MeanField {
            mag_n: known_n + draws.vector(10.0),
            spread: draws.within(0.0, 9.0),
            white: draws.within(1.0, 4.0),
            iron: draws.within(0.0, 1.0),
        };
        let duration_s = draws.within(0.3, 3.0);
        let found = reference.compare(&params, duration_s, &mean).expect("a heading");
        let m: V = mean.mag_n.cast();
        let found_dip = m.z.atan2(m.xy().norm());
        let off = {
            let off = m.y.atan2(m.x) - declination;
            off.sin().atan2(off.cos())
        };
        let residuals = [-dip.cos() * off, dip - found_dip];
        let disturbance = (m.norm() / norm - 1.0).powi(2) + (found_dip - dip).powi(2);
        let unrest = of(params.field_spread).powi(2) * of(mean.spread) + of(mean.white);
        let seen = of(params.disturbance).powi(2) * disturbance + unrest / norm.powi(2);
        // What an attitude error about an axis of n does to each: by a small turn.
        let of_turn = |axis: usize| {
            const SMALL: f64 = 1e-6;
            let mut turn = V::zeros();
            turn[axis] = SMALL;
            let turned = expected_n - turn.cross(&expected_n);
            let east = -dip.cos() * {
                let off = turned.y.atan2(turned.x) - declination;
                off.sin().atan2(off.cos())
            };
            [east / SMALL, (dip - turned.z.atan2(turned.xy().norm())) / SMALL]
        };
        let sds = [of(params.heading_sd) * dip.cos(), of(params.dip_sd)];
        let lasts = (of(params.field_lasts_s) / of(duration_s)).max(1.0);
        for (k, scalar) in found.scalars.iter().enumerate() {
            assert!(
                near(scalar.residual, residuals[k], 1e-4, 1e-5),
                "{seed} {k}: {scalar:?} {residuals:?}"
            );
            for axis in 0..3 {
                assert!(
                    near(scalar.row_n[axis], of_turn(axis)[k], 1e-3, 1e-4),
                    "{seed} {k} {axis}: {scalar:?}"
                );
            }
            assert!(near(scalar.noise.alone, sds[k].powi(2) + seen, 1e-4, 0.0), "{seed} {k}");
            assert!(
                near(scalar.noise.lasting, sds[k].powi(2) * lasts + seen, 1e-4, 0.0),
                "{seed} {k}"
            );
        }
        assert!(near(found.disturbance, disturbance, 1e-3, 1e-6), "{seed}");
        assert!(near(found.horizontal, dip.cos(), 1e-5, 0.0), "{seed}");
        let of_reference = sds[0].powi(2) + (unrest - of(mean.iron)) / norm.powi(2);
        assert!(near(found.of_reference, of_reference, 1e-4, 1e-9), "{seed}");
        // The same disturbance about a vertical that force has found.
        let acc_n = Vector3::new(0.0, 0.0, -9.0) + draws.vector(2.0);
        let down = -acc_n.cast::<f64>().normalize();
        let dip_found = core::f64::consts::FRAC_PI_2 - m.normalize().dot(&down).acos();
        let disturbance = (m.norm() / norm - 1.0).powi(2) + (dip_found - dip).powi(2);
        assert!(
            near(reference.disturbance(&mean.mag_n, &acc_n), disturbance, 1e-3, 1e-5),
            "{seed}"
        );
    }
}

#[test]
fn a_field_along_the_vertical_or_none_tells_no_heading() {
    let mean = |mag_n: Vector3<f32>| MeanField {
        mag_n,
        spread: 0.0,
        white: 0.0,
        iron: 0.0,
    };
    let reference = Reference::known(40.0, 1.0, 0.3);
    let tells = |reference: &Reference, mag_n| reference.compare(&Params::ROOM, 1.0, &mean(mag_n)).is_some();
    assert!(tells(&reference, Vector3::new(0.02, 0.039, 40.0)));
    assert!(!tells(&reference, Vector3::new(0.02, 0.034, 40.0)));
    assert!(!tells(&reference, Vector3::zeros()));
    assert!(!tells(&Reference::unknown(), Vector3::new(20.0, 0.0, 30.0)));
    assert_eq!(Reference::unknown().field_n_ut(), None);
    assert_eq!(Reference::unknown().disturbance(&Vector3::x(), &Vector3::z()), 0.0);
}

/// Windows of one field, learnt one after the other, against the mean of all of them weighted by how long they lasted.
#[test]
fn a_reference_is_the_mean_of_the_windows_while_it_is_young() {
    let params = Params::ROOM;
    for seed in 0..60 {
        let mut draws = Draws::of(seed);
        let at_site = draws.below(2) == 0;
        let declination = draws.within(-1.0, 1.0);
        let mut reference = if at_site {
            Reference::at_site(declination)
        } else {
            Reference::unknown()
        };
        let iron_b = draws.vector(3.0);
        let (mut weighted_n, mut turned, mut lasted_s, mut found_at) = (V::zeros(), Matrix3::<f64>::zeros(), 0.0, 0.0);
        for _ in 0..30 {
            let samples = samples(&mut draws, 0.1);
            let duration_s = draws.within(0.5, 2.0);
            reference.learn(&params, duration_s, &sums(&samples), &iron_b);
            let learning = lasted_s < of(params.learn_s);
            if learning {
                lasted_s += of(duration_s);
                weighted_n += mean(&samples, &Vector3::zeros()).0 * of(duration_s);
                let dcms = samples
                    .iter()
                    .fold(Matrix3::zeros(), |sum, sample| sum + sample.1.cast::<f64>());
                turned += dcms * (of(duration_s) / samples.len() as f64);
            }
            let field_n = (weighted_n - turned * iron_b.cast::<f64>()) / lasted_s;
            assert!(near(reference.norm_ut, field_n.norm(), 1e-4, 1e-3), "{seed}");
            assert!(
                near(reference.dip, field_n.z.atan2(field_n.xy().norm()), 1e-4, 1e-4),
                "{seed}"
            );
            let points_at = field_n.y.atan2(field_n.x);
            if learning {
                found_at = points_at;
            }
            if at_site {
                assert_eq!(reference.declination, declination);
            } else {
                assert!(near(reference.declination, points_at - found_at, 1e-4, 1e-3), "{seed}");
            }
        }
        assert!(lasted_s >= 20.0);
        // Iron that is learnt later turns the field away from where it was found, as long as it is the same iron.
        let other_b = iron_b + draws.vector(3.0);
        let mut later = reference;
        later.follow(&params, &other_b);
        let field_n = (weighted_n - turned * other_b.cast::<f64>()) / lasted_s;
        assert!(near(later.norm_ut, field_n.norm(), 1e-4, 1e-3), "{seed}");
        if !at_site {
            let off = field_n.y.atan2(field_n.x) - found_at;
            assert!(near(later.declination.sin(), off.sin(), 1e-3, 1e-3), "{seed}: {off}");
        }
        // Another iron: the field without the one before stands, whatever is learnt of the new one.
        let (norm_ut, dip) = (later.norm_ut, later.dip);
        later.have_other_iron(&params, &other_b);
        later.follow(&params, &draws.vector(20.0));
        assert!(
            near(later.norm_ut, norm_ut.into(), 1e-4, 0.0) && near(later.dip, dip.into(), 1e-4, 1e-5),
            "{seed}"
        );
    }
}

#[test]
fn a_young_reference_is_learnt_afresh_with_other_iron() {
    let params = Params::ROOM;
    let mut draws = Draws::of(1);
    let window = sums(&samples(&mut draws, 0.1));
    for (reference, afresh) in [
        (Reference::unknown(), Reference::unknown()),
        (Reference::at_site(0.3), Reference::at_site(0.3)),
    ] {
        let mut young = reference;
        young.learn(&params, 0.999 * params.learn_s, &window, &Vector3::zeros());
        let learnt = young;
        young.follow(&params, &Vector3::x());
        assert_eq!(young, learnt);
        let mut complete = reference;
        complete.learn(&params, params.learn_s, &window, &Vector3::zeros());
        let stood = complete;
        young.have_other_iron(&params, &Vector3::x());
        assert_eq!(young, afresh);
        complete.have_other_iron(&params, &Vector3::x());
        assert_eq!((complete.norm_ut, complete.learnt_s), (stood.norm_ut, stood.learnt_s));
        assert_eq!(complete.turned, Matrix3::zeros());
    }
    // That of a site is not learnt at all.
    let mut known = Reference::known(40.0, 1.0, 0.1);
    known.learn(&params, 1.0, &window, &Vector3::zeros());
    known.follow(&params, &Vector3::x());
    assert_eq!(known, Reference::known(40.0, 1.0, 0.1));
}
