//! Specific force that is not the vertical's.

use super::*;

/// [deg] attitude error after 15 s in which vibration, folded down by slow samples, looks like a steady push to the north
/// and upwards.
fn folded(params: Params) -> f32 {
    let rate_b = Vector3::new(0.1, 0.05, 0.0);
    let mut world = World::new(tilted(), params);
    world.fly(20.0, rate_b, nothing);
    let mut q_nb = world.q_nb;
    world.fly(15.0, rate_b, |_, step| {
        q_nb *= from_rotation_vector(rate_b * STEP_S);
        let push_n = Vector3::new(1.5, 0.0, -1.5);
        step.acc.as_mut().unwrap().value_b += q_nb.inverse_transform_vector(&push_n);
    });
    world.off() / DEG
}

#[test]
fn vibration_that_is_folded_down_shows_along_the_vertical() {
    let (with, without) = (
        folded(params()),
        folded(Params {
            acc_excess: 0.0,
            ..params()
        }),
    );
    assert!(with < 0.5 * without, "{with} {without}");
}

#[test]
fn hard_shaking_up_and_down_still_tells_the_vertical() {
    // 12 m/s2 at 0.4 Hz: whole windows are a third of one g off.
    let rate_b = Vector3::new(0.1, 0.0, 0.0);
    let mut world = World::new(tilted(), params());
    world.fly(5.0, rate_b, nothing);
    let mut q_nb = world.q_nb;
    let mut velocities = 0;
    for second in 0..30 {
        let outcome = world.fly(1.0, rate_b, |t_s, step| {
            q_nb *= from_rotation_vector(rate_b * STEP_S);
            let shaken_n = Vector3::z() * (12.0 * ComplexField::sin(2.5 * (second as f32 + t_s)));
            step.acc.as_mut().unwrap().value_b += q_nb.inverse_transform_vector(&shaken_n);
        });
        let found = outcome
            .innovations
            .iter()
            .filter(|record| record.quantity == Quantity::Velocity);
        velocities += found.count();
    }
    world.off_by_less_than(1.0);
    assert!(velocities > 10, "{velocities}");
}
