//! What is wrong with the gyros, and how it is learnt.

use super::*;

#[test]
fn a_bias_is_learnt_at_rest_and_the_matrix_in_motion() {
    let bias_b = Vector3::new(0.01, -0.02, 0.005);
    let mut world = World::new(tilted(), params());
    world.fly(30.0, Vector3::zeros(), |_, step| step.angle_b += bias_b * STEP_S);
    assert!((world.filter.bias_b - bias_b).norm() < 1e-4);
    // The gyros read one per cent high about z; half turns to either side show it.
    for turn in 0..40 {
        let rate_b = Vector3::new(0.3, 0.2, if turn % 4 < 2 { 1.5 } else { -1.5 });
        world.fly(4.0, rate_b, |_, step| {
            step.angle_b.z *= 1.01;
            step.angle_b += bias_b * STEP_S;
        });
    }
    world.off_by_less_than(1.0);
    let scale = world.filter.gyro_matrix[(2, 2)];
    assert!((scale - 0.01 / 1.01).abs() < 0.002, "{scale}");
}

#[test]
fn without_the_matrix_the_same_motion_costs_more() {
    let run = |params: Params| {
        let mut world = World::new(tilted(), params);
        world.fly(5.0, Vector3::zeros(), nothing);
        // To and fro, with pauses of another axis between: no bias does the same.
        for turn in 0..15 {
            let rate_b = Vector3::new(0.3, 0.2, [1.5, 0.0, -1.0][turn % 3]);
            world.fly(4.0, rate_b, |_, step| step.angle_b *= 1.01);
        }
        world.off()
    };
    let with = run(params());
    let without = run(Params {
        gyro_matrix_sd: 0.0,
        gyro_matrix_walk: 0.0,
        ..params()
    });
    assert!(with < 0.5 * without, "{with} {without}");
}

#[test]
fn a_rest_that_begins_with_the_end_of_a_motion_teaches_no_wrong_bias() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::new(0.3, -0.2, 0.1), |_, step| biased(step));
    // Easing to a stop, a window long and within the bounds of rest.
    for index in 0..50 {
        let rate_b = Vector3::new(0.0, 0.0, 0.9 * DEG * (1.0 - index as f32 * STEP_S));
        world.fly(STEP_S, rate_b, |_, step| biased(step));
    }
    world.fly(6.0, Vector3::zeros(), |_, step| biased(step));
    let off_b = world.filter.bias_b - GYRO_BIAS_B;
    assert!(off_b.norm() < 0.02 * DEG, "{:?} deg/s", off_b / DEG);
}

#[test]
fn a_bias_that_every_rest_contradicts_is_given_up() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::zeros(), |_, step| biased(step));
    // As an upset in memory leaves it.
    world.filter.bias_b += Vector3::new(1.0 * DEG, 0.0, 0.0);
    world.fly(world.filter.params.recovery_s + 2.0, Vector3::zeros(), |_, step| {
        biased(step)
    });
    let off_b = world.filter.bias_b - GYRO_BIAS_B;
    assert!(off_b.norm() < 0.02 * DEG, "{:?} deg/s", off_b / DEG);
}

#[test]
fn a_few_noisy_samples_are_no_exact_bias() {
    let sd_after = |noise: f32| {
        let mut world = World::new(tilted(), params());
        world.fly(4.0, Vector3::zeros(), |_, step| {
            step.angle_variance = square(noise * STEP_S);
        });
        ComplexField::sqrt(world.filter.bias_covariance_b().trace() / 3.0)
    };
    // Fifty samples a window, three windows after the first.
    let noise = 1.0 * DEG;
    let expected = noise / ComplexField::sqrt(150.0_f32);
    assert!(
        (sd_after(noise) / expected - 1.0).abs() < 0.1,
        "{} {expected}",
        sd_after(noise)
    );
    assert!(sd_after(0.0) < 0.01 * DEG);
}
