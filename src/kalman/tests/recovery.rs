//! Out of a lock-out.

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
