//! Out of a lock-out, or of not knowing.

use super::*;

#[test]
fn what_triad_found_is_not_turned_by_the_correction_of_its_window_too() {
    // Too sure of a wrong tilt, so that the velocity stays rejected, and open to the field, which goes on correcting the
    // heading until the attitude is found afresh.
    let wrong = from_rotation_vector(Vector3::new(0.0, 0.08, 0.25)) * tilted();
    let known = Matrix3::from_diagonal(&Vector3::new(1e-8, 1e-8, 2e-3));
    let mut world = World::new(tilted(), params());
    world.filter = Filter::resumed(params(), wrong, known);
    let found_afresh = (0..10).any(|_| {
        assert!(world.off() > 10.0 * DEG, "{} deg", world.off() / DEG);
        world.fly(1.0, Vector3::zeros(), nothing).aligned
    });
    assert!(found_afresh);
    world.off_by_less_than(0.01);
}

#[test]
fn half_a_turn_of_initial_error_is_recovered_from_within_half_a_minute() {
    let wrong = tilted() * from_rotation_vector(Vector3::new(0.0, PI, 0.0));
    let mut world = World::new(tilted(), params());
    world.filter = Filter::resumed(params(), wrong, Matrix3::from_diagonal_element(1e-4));
    world.fly(30.0, Vector3::zeros(), nothing);
    world.off_by_less_than(1.0);
}

#[test]
fn a_saturated_spin_is_recovered_from_within_a_minute() {
    let mut world = World::new(tilted(), params());
    world.fly(10.0, Vector3::zeros(), nothing);
    // 720 deg/s about forward, gyros that stop at 320.
    world.fly(20.0, Vector3::new(12.6, 0.0, 0.0), |_, step| {
        step.angle_b.x = 5.6 * STEP_S;
        step.rate_b.x = 5.6;
        step.saturated = true;
    });
    assert!(world.worst_sd_deg() > 30.0, "it must know that it does not know");
    world.fly(60.0, Vector3::new(0.1, 0.0, 0.0), nothing);
    world.off_by_less_than(5.0);
}
