//! A correction that comes some steps after its window.

use super::*;

/// [rad/s] turns about all axes.
fn rate_b(second: usize) -> Vector3<f32> {
    let (sin, cos) = ComplexField::sin_cos(0.7 * second as f32);
    Vector3::new(0.8 * sin, 0.6 * cos, 0.5)
}

/// Half a minute of turns begun 3 deg off, by gyros with a bias; `change` after every step, with the filter's window just
/// closed or not.
fn turned(change: impl Fn(&mut Filter)) -> World {
    let mut world = World::new(tilted(), params());
    let wrong = from_rotation_vector(Vector3::new(0.03, -0.04, 0.02)) * tilted();
    world.filter = Filter::resumed(params(), wrong, Matrix3::from_diagonal_element(2e-3));
    for second in 0..30 {
        for _ in 0..50 {
            world.fly(STEP_S, rate_b(second), |_, step| biased(step));
            change(&mut world.filter);
        }
    }
    world.fly(CORRECTED_S, Vector3::zeros(), |_, step| biased(step));
    world
}

#[test]
fn it_leaves_the_state_that_one_at_once_would_have() {
    let late = turned(|_| {});
    let at_once = turned(|filter| filter.correct_now(&mut Outcome::default()));
    let apart = angle_between(&late.filter.q_nb, &at_once.filter.q_nb);
    // What is of second order in corrections of degrees.
    assert!(apart < 0.003 * DEG, "{} deg", apart / DEG);
    let biases_apart = (late.filter.bias_b - at_once.filter.bias_b).norm();
    assert!(biases_apart < 1e-3 * GYRO_BIAS_B.norm(), "{biases_apart} rad/s");
}

#[test]
fn it_comes_in_the_fourth_step_after_the_window() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::zeros(), nothing);
    while world.filter.window.duration_s > 0.0 {
        world.fly(STEP_S, Vector3::zeros(), nothing);
    }
    for step in 1..=5 {
        let outcome = world.fly(STEP_S, Vector3::zeros(), nothing);
        assert_eq!(outcome.innovations.is_empty(), step != 4, "{step}");
    }
}
