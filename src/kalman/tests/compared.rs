//! What becomes of the state by one window's field, by a nose, and by finding the attitude afresh.

use super::*;
use crate::{
    draws::{Draws, near},
    kalman::{
        field::{Compared, Scalar},
        innovation::Noise,
        spell::Shown,
    },
};

/// A filter that knows its attitude to `sd` about each axis and nothing else, a window of one second behind it.
fn known(sd: f32) -> Filter {
    let mut filter = Filter::resumed(params(), tilted(), Matrix3::from_diagonal_element(square(sd)));
    filter.measured.means.duration_s = 1.0;
    filter.pending.begin();
    filter.look();
    filter.pending.go_on();
    filter.pending.go_on();
    filter
}

/// A field that is off by these in the east and in the meridian.
fn compared(residuals: [f32; 2], noise: Noise) -> Compared {
    let rows_n = [Vector3::z(), Vector3::y()];
    let quantities = [Quantity::FieldEast, Quantity::FieldMeridian];
    Compared {
        scalars: core::array::from_fn(|k| Scalar {
            quantity: quantities[k],
            residual: residuals[k],
            row_n: rows_n[k],
            noise,
        }),
        disturbance: 0.0,
        horizontal: 1.0,
        of_reference: 1.0,
    }
}

#[test]
fn a_field_is_accepted_if_both_its_scalars_are() {
    let noise = Noise {
        alone: 1e-4,
        lasting: 1e-3,
    };
    // Five standard deviations of 0.0141 are 0.0707.
    for (residuals, accepted) in [
        ([0.07, 0.07], [true, true]),
        ([0.071, 0.07], [false, true]),
        ([0.07, -0.071], [true, false]),
        ([-0.071, 0.071], [false, false]),
    ] {
        let mut filter = known(0.01);
        filter.measured.compared = Some(compared(residuals, noise));
        filter.compare_field();
        let found: heapless::Vec<bool, 7> = filter.correction.innovations.iter().map(|one| one.accepted).collect();
        assert_eq!(found, accepted);
        assert_eq!(
            filter.measured.field_accepted,
            Some(accepted == [true, true]),
            "{residuals:?}"
        );
        // The gain takes an error that lasts for one witness; the residual shows it once.
        for (axis, k) in [(2, 0), (1, 1)] {
            let gain = 1e-4 / (1e-4 + 1e-3);
            let expected = if accepted[k] { gain * residuals[k] } else { 0.0 };
            assert!(
                near(filter.correction.error.driven[axis], expected.into(), 1e-3, 1e-9),
                "{residuals:?} {k}"
            );
            let record = filter.correction.innovations[k];
            assert!(near(record.variance, 2e-4, 1e-3, 0.0));
            let ratio = f64::from(residuals[k]).powi(2) / (25.0 * 2e-4);
            assert!(near(record.test_ratio, ratio, 1e-3, 0.0), "{record:?}");
        }
    }
    let mut none = known(0.01);
    none.measured.compared = None;
    none.compare_field();
    assert_eq!(none.measured.field_accepted, None);
}

/// In a spell the field that is used has the spell's variance beside its own.
#[test]
fn in_a_spell_the_field_has_what_that_has_shown() {
    let noise = Noise {
        alone: 1e-4,
        lasting: 1e-3,
    };
    let mut filter = known(0.5);
    let disturbance = 0.04;
    filter.measured.compared = Some(Compared {
        disturbance,
        ..compared([0.1, 0.0], noise)
    });
    filter.compare_field();
    assert!(filter.spell.lasts());
    let variance = square(filter.params.disturbance) * disturbance;
    let gain = 0.25 / (0.25 + variance + 1e-4);
    assert!(near(filter.correction.error.driven[2], (gain * 0.1).into(), 1e-3, 0.0));
    // An attitude that is known better than that keeps its heading.
    let mut sure = known(0.01);
    sure.measured.compared = Some(Compared {
        disturbance,
        ..compared([0.0; 2], noise)
    });
    sure.compare_field();
    assert!(sure.correction.innovations.iter().all(|one| !one.accepted) && sure.correction.usable);
}

/// The two scalars of a nose, one after the other, against the same in f64 by dense matrices; with what is in doubt about the vertical.
#[test]
fn a_nose_is_compared_across_itself() {
    let mut doubts = 0;
    for seed in 0..60 {
        let mut draws = Draws::of(seed);
        let mut filter = Filter::new(params());
        let covariance_n = draws.covariance(1e-3);
        filter.covariance.align(&covariance_n);
        filter.q_nb = from_euler(Euler {
            roll: draws.within(-3.0, 3.0),
            pitch: draws.within(-0.5, 1.4),
            yaw: draws.within(-3.0, 3.0),
        });
        filter.aligned = true;
        if seed % 2 == 0 {
            // A contradiction that the field has stood by for less.
            let shown = Shown {
                duration_s: 1.0,
                disturbance: 0.0,
                residual: 0.1,
                of_state: 1e-6,
                of_reference: 1e-6,
                horizontal: 0.5,
            };
            filter.spell.go_on(&params(), &shown);
            doubts += 1;
        }
        let doubt = f64::from(filter.doubt());
        assert_eq!(doubt > 0.0, seed % 2 == 0);
        let forward: Vector3<f64> = filter.q_nb.cast::<f64>() * Vector3::x();
        let nose = Nose {
            azimuth: forward.y.atan2(forward.x) as f32 + draws.within(-0.03, 0.03),
            elevation: -forward.z.asin() as f32 + draws.within(-0.03, 0.03),
            azimuth_sd: draws.within(0.01, 0.05),
            elevation_sd: draws.within(0.01, 0.05),
        };
        let unsound = seed % 3 == 0;
        filter.unsound = unsound;
        let before = filter.clone();
        assert_eq!(filter.know_nose(&nose), Ok(()), "{seed}");
        assert_eq!(
            (filter.unsound, filter.settlements),
            (unsound, before.settlements.wrapping_add(1))
        );
        let (azimuth, elevation) = (f64::from(nose.azimuth), f64::from(nose.elevation));
        let along = |azimuth: f64, elevation: f64| {
            Vector3::new(
                elevation.cos() * azimuth.cos(),
                elevation.cos() * azimuth.sin(),
                -elevation.sin(),
            )
        };
        let small = 1e-5;
        let east = (along(azimuth + small, elevation) - along(azimuth, elevation)).normalize();
        let up = (along(azimuth, elevation + small) - along(azimuth, elevation)).normalize();
        let sds = [
            elevation.cos() * f64::from(nose.azimuth_sd),
            f64::from(nose.elevation_sd),
        ];
        let mut p = covariance_n.cast::<f64>();
        let mut error = Vector3::zeros();
        for (k, across) in [east, up].into_iter().enumerate() {
            let h = forward.cross(&across);
            let residual = -across.dot(&forward) - h.dot(&error);
            let of_state = h.dot(&(p * h));
            let record = filter.correction.innovations[k];
            assert!(
                near(record.residual, residual, 1e-3, 1e-5),
                "{seed} {k}: {record:?} {residual}"
            );
            let variance = of_state + sds[k].powi(2) + doubt * h.z.powi(2);
            assert!(
                near(record.variance, variance, 1e-3, 0.0),
                "{seed} {k}: {record:?} {variance}"
            );
            let gain = p * h / (of_state + sds[k].powi(2));
            error += gain * residual;
            p -= gain * (p * h).transpose();
        }
        assert!(
            (filter.covariance.attitude().cast::<f64>() - p).norm() < 1e-3 * p.norm(),
            "{seed}"
        );
        let expected = UnitQuaternion::from_scaled_axis(error) * before.q_nb.cast::<f64>();
        assert!(filter.q_nb.cast::<f64>().angle_to(&expected) < 1e-5, "{seed}");
    }
    assert!(doubts > 20);
}

/// A nose beyond the gate is refused with the angle it is off by, and so is one behind.
#[test]
fn a_nose_that_is_refused_says_how_far_it_is_off() {
    for seed in 0..40 {
        let mut draws = Draws::of(seed);
        let mut filter = Filter::resumed(params(), draws.attitude(), Matrix3::from_diagonal_element(1e-6));
        let before = filter.q_nb;
        let forward: Vector3<f64> = before.cast::<f64>() * Vector3::x();
        let nose = Nose {
            azimuth: draws.within(-3.0, 3.0),
            elevation: draws.within(-1.5, 1.5),
            azimuth_sd: 1e-3,
            elevation_sd: 1e-3,
        };
        let (azimuth, elevation) = (f64::from(nose.azimuth), f64::from(nose.elevation));
        let horizontal = elevation.cos();
        let along = Vector3::new(horizontal * azimuth.cos(), horizontal * azimuth.sin(), -elevation.sin());
        let off = forward.angle(&along);
        let found = filter.know_nose(&nose).expect_err("both are known to a milliradian");
        assert!(near(found, off, 1e-4, 1e-5), "{seed}: {found} {off}");
        assert_eq!(filter.q_nb, before);
    }
    // Behind, where nothing across it shows.
    let mut filter = Filter::resumed(
        params(),
        UnitQuaternion::identity(),
        Matrix3::from_diagonal_element(1e-6),
    );
    let behind = Nose {
        azimuth: PI,
        elevation: 0.0,
        azimuth_sd: 1e-3,
        elevation_sd: 1e-3,
    };
    let found = filter.know_nose(&behind).expect_err("behind");
    assert!(near(found, core::f64::consts::PI, 1e-4, 0.0), "{found}");
}

#[test]
fn a_nose_waits_for_an_attitude_and_for_its_correction() {
    let mut world = World::new(tilted(), params());
    assert!(!world.filter.may_know_nose(), "no attitude yet");
    world.fly(3.0, Vector3::zeros(), nothing);
    let (mut may, mut must_wait) = (0, 0);
    for _ in 0..60 {
        world.fly(STEP_S, Vector3::zeros(), nothing);
        let corrects = world.filter.pending.corrects();
        assert_eq!(world.filter.may_know_nose(), !corrects);
        (may, must_wait) = (may + u32::from(!corrects), must_wait + u32::from(corrects));
    }
    assert!(may > 20 && must_wait >= 4, "{may} {must_wait}");
    world.filter.aligned = false;
    assert!(!world.filter.may_know_nose());
}

/// An attitude that is not known any more is found afresh, if that makes it much better; the covariance is settled for it only
/// where it may have to be.
#[test]
fn an_attitude_that_is_lost_is_found_afresh() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::zeros(), nothing);
    // With a window's measurements, whose work on the covariance is yet to be done.
    let flown = |world: &World| {
        let mut filter = world.filter.clone();
        filter.rejected_s = [0.0; 2];
        filter.measured.means.angle_variance = 0.0;
        filter.settle(&mut Outcome::default());
        filter.pending.begin();
        (0..5).for_each(|_| filter.pending.go_on());
        filter.pending.passage.velocity_lost = true;
        filter
    };
    let most_known = {
        let mut filter = flown(&world);
        assert!(filter.align(1e3));
        filter.covariance.worst()
    };
    let with = |variance: f32, lost: f32| {
        let mut filter = flown(&world);
        filter.covariance.align(&Matrix3::from_diagonal_element(variance));
        filter.pending.passage = Default::default();
        filter.pending.passage.velocity_lost = true;
        filter.params.lost_sd = ComplexField::sqrt(lost);
        filter
    };
    // TRIAD is taken within the variance it is given, and not beyond.
    assert!(with(1.0, 1.0).align(1.02 * most_known) && !with(1.0, 1.0).align(0.5 * most_known));
    let lost = 2.0 * most_known;
    for (variance, found) in [
        (0.9 * lost, false),
        (1.1 * lost, false),
        (9.0 * most_known, false),
        (14.0 * most_known, true),
    ] {
        let mut filter = with(variance, lost);
        assert_eq!(filter.recover(), found, "{}", variance / lost);
        assert!(filter.pending.is_done());
    }
    let lost = 20.0 * most_known;
    for (variance, found) in [(0.98 * lost, false), (1.02 * lost, true)] {
        assert_eq!(with(variance, lost).recover(), found, "{}", variance / lost);
    }
    // Half of it, with what the window adds: until then nothing is settled.
    for (variance, added, settled) in [
        (0.3, 0.1, false),
        (0.3, 0.25, true),
        (0.49, 0.0, false),
        (0.51, 0.0, true),
    ] {
        let mut filter = with(variance * lost, lost);
        filter.measured.means.angle_variance = added * lost;
        assert!(!filter.recover());
        assert_eq!(filter.pending.is_done(), settled, "{variance} {added}");
    }
}
