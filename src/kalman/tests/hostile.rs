//! Bad input, gaps, long runs.

use super::*;

#[test]
fn a_short_gap_is_bridged_and_a_long_one_starts_afresh() {
    let rate_b = Vector3::new(0.0, 0.0, 0.5);
    let gap = |gap_s: f32| {
        let mut world = World::new(tilted(), params());
        world.fly(20.0, rate_b, nothing);
        let sd = world.worst_sd_deg();
        world.at_us += (gap_s * 1e6) as u64;
        world.q_nb *= from_rotation_vector(rate_b * gap_s);
        let outcome = world.fly(STEP_S, rate_b, nothing);
        (world, outcome, sd)
    };
    let (mut world, outcome, _) = gap(0.5);
    assert_eq!(outcome.refusal, None);
    world.off_by_less_than(1.0);
    let (bias_before, _) = (world.filter.bias_b, world.fly(2.0, rate_b, nothing));
    let (mut world, outcome, _) = gap(3600.0);
    assert_eq!(outcome.refusal, Some(Refusal::Gap));
    assert!(!world.filter.aligned);
    assert!(
        (world.filter.bias_b - bias_before).norm() < 1e-6,
        "what was learnt of the gyros stays"
    );
    world.fly(2.0, rate_b, nothing);
    world.off_by_less_than(1.0);
}

#[test]
fn a_gap_widens_the_covariance() {
    let mut world = World::new(tilted(), params());
    world.fly(20.0, Vector3::zeros(), nothing);
    let before = world.worst_sd_deg();
    world.fly(0.9, Vector3::zeros(), |_, step| step.angle_b.x = f32::NAN);
    world.fly(0.1, Vector3::zeros(), |_, step| {
        step.acc = None;
        step.mag = None;
    });
    assert!(world.worst_sd_deg() > 1.5 * before, "{before} {}", world.worst_sd_deg());
}

#[test]
fn time_that_stands_still_or_goes_back_is_left_out() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::new(0.1, 0.0, 0.0), nothing);
    let before = world.filter.clone();
    for back_us in [0, 1, 1_000_000] {
        let step = Step {
            at_us: world.at_us - back_us,
            covered_s: STEP_S,
            angle_b: Vector3::repeat(0.1),
            angle_variance: 0.0,
            rate_b: Vector3::zeros(),
            saturated: false,
            acc: None,
            mag: None,
            lift_off: false,
        };
        assert_eq!(world.filter.step(&step).refusal, Some(Refusal::NotLater));
    }
    assert_eq!(world.filter.attitude(), before.attitude());
}

#[test]
fn rubbish_in_any_input_leaves_the_state_finite_and_is_recovered_from() {
    const BAD: [f32; 7] = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN_POSITIVE,
        0.0,
        -1e30,
    ];
    for bad in BAD {
        for channel in 0..14 {
            let mut world = World::new(tilted(), params());
            world.fly(5.0, Vector3::new(0.1, 0.0, 0.0), nothing);
            world.fly(3.0, Vector3::new(0.1, 0.0, 0.0), |_, step| match channel {
                0..3 => step.angle_b[channel] = bad,
                3..6 => step.rate_b[channel - 3] = bad,
                6..9 => step.acc.as_mut().unwrap().value_b[channel - 6] = bad,
                9..12 => step.mag.as_mut().unwrap().value_b[channel - 9] = bad,
                12 => step.covered_s = bad,
                _ => step.angle_variance = bad,
            });
            world.fly(20.0, Vector3::new(0.1, 0.0, 0.0), nothing);
            world.off_by_less_than(5.0);
        }
    }
}

/// Nothing that comes in leads there, so it is put there.
#[test]
fn iron_that_is_no_number_begins_the_filter_anew() {
    let rate_b = Vector3::new(0.1, 0.0, 0.05);
    let mut world = World::new(tilted(), params());
    world.fly(5.0, rate_b, nothing);
    world.filter.iron.each(&mut |number| *number = f32::NAN);
    world.filter.iron.go_on();
    assert!(!world.filter.iron.is_finite());
    for _ in 0..100 {
        world.at_us += STEP_US;
        world.q_nb = renormalised(world.q_nb * from_rotation_vector(rate_b * STEP_S));
        let step = world.step(rate_b);
        world.filter.step(&step);
    }
    // It fails at any step whose state is no number.
    world.fly(20.0, rate_b, nothing);
    world.off_by_less_than(1.0);
}

#[test]
fn one_bad_sample_costs_itself_and_not_its_window() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::zeros(), nothing);
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let outcome = world.fly(1.0 + CORRECTED_S, Vector3::zeros(), |t_s, step| {
            if t_s < STEP_S {
                step.acc.as_mut().unwrap().value_b.x = bad;
                step.mag.as_mut().unwrap().value_b.z = bad;
            }
        });
        assert_eq!(
            (outcome.innovations.len(), outcome.aligned),
            (INNOVATIONS, false),
            "{bad}"
        );
        assert!(outcome.innovations.iter().all(|record| record.accepted));
    }
}

#[test]
fn zero_vectors_and_collinear_ones_do_not_align_it() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::zeros(), |_, step| {
        step.mag.as_mut().unwrap().value_b.fill(0.0)
    });
    assert!(!world.filter.aligned);
    world.fly(5.0, Vector3::zeros(), |_, step| {
        step.mag.as_mut().unwrap().value_b = step.acc.unwrap().value_b
    });
    assert!(!world.filter.aligned);
    world.fly(2.0, Vector3::zeros(), nothing);
    world.off_by_less_than(0.1);
}

#[test]
fn the_covariance_stays_positive_for_a_day_at_rest() {
    // 86,400 windows; one step a window.
    let mut world = World::new(
        tilted(),
        Params {
            longest_gap_s: 2.0,
            ..params()
        },
    );
    for _ in 0..86_400 {
        world.at_us += 1_000_000;
        let acc_b = world.q_nb.inverse_transform_vector(&Vector3::new(0.0, 0.0, -GRAVITY));
        let mag_b = world.q_nb.inverse_transform_vector(&World::field_n());
        let sampled = |value_b| {
            Some(Sampled {
                value_b,
                variance: 0.0,
                scatter: 0.0,
                at_us: world.at_us,
            })
        };
        world.filter.step(&Step {
            at_us: world.at_us,
            covered_s: 1.0,
            angle_b: Vector3::zeros(),
            angle_variance: 0.0,
            rate_b: Vector3::zeros(),
            saturated: false,
            acc: sampled(acc_b),
            mag: sampled(mag_b),
            lift_off: false,
        });
    }
    let least = world.filter.covariance().matrix().symmetric_eigenvalues().min();
    assert!(least > 0.0, "{least}");
    assert!((world.filter.q_nb.norm() - 1.0).abs() < 1e-6);
    world.off_by_less_than(0.05);
}

/// N3: an attitude of which nothing is known (10 rad2), and measurements that claim to be exact (1e-8), with parameters that take
/// their word for it. The covariance stays definite, which in f32 it does only by the floor of the noise, and above its own floors; an
/// attitude that is wrong by half a turn is found afresh by TRIAD.
#[test]
fn a_huge_covariance_and_tiny_noise_leave_it_finite_definite_and_right() {
    let exact = Params {
        velocity_sd: 1e-4,
        velocity_rest_sd: 1e-4,
        velocity_lasts_s: 0.0,
        acc_error: 1e-4,
        heading_sd: 1e-4,
        dip_sd: 1e-4,
        field_lasts_s: 0.0,
        ..params()
    };
    for params in [params(), exact] {
        for (rate_b, wrong_rad) in [Vector3::zeros(), Vector3::new(0.05, 0.1, 0.0)]
            .into_iter()
            .flat_map(|rate_b| [0.0, 0.3, 3.0].map(|wrong_rad| (rate_b, wrong_rad)))
        {
            let mut world = World::new(tilted(), params);
            let wrong = from_rotation_vector(Vector3::new(0.6, -0.5, 0.6) * wrong_rad);
            world.filter = Filter::resumed(params, wrong * world.q_nb, Matrix3::from_diagonal_element(10.0));
            assert!(world.filter.covariance().worst() >= 10.0);
            let mut afresh = 0;
            // A window, and the work on it.
            for _ in 0..300 {
                let outcome = world.fly(0.2, rate_b, |_, step| {
                    step.acc.as_mut().unwrap().variance = 1e-8;
                    step.mag.as_mut().unwrap().variance = 1e-8;
                });
                afresh += u32::from(outcome.aligned);
                // As a matrix of correlations, so that radians and metres a second compare.
                let p = world.filter.covariance().matrix();
                let scaled =
                    p.map_with_location(|row, column, value| value / (p[(row, row)] * p[(column, column)]).sqrt());
                let least = scaled.symmetric_eigenvalues().min();
                assert!(least > 0.0, "{wrong_rad} rad, {} rad/s: {least}", rate_b.x);
                // Of the attitude, as covariance.rs has it, to rounding.
                assert!((0..3).all(|k| p[(k, k)] >= 0.999e-9));
            }
            assert!(wrong_rad < 1.0 || afresh > 0, "{wrong_rad} rad were never found afresh");
            world.off_by_less_than(0.5);
        }
    }
}
