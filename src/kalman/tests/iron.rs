//! Iron of the unit that comes and goes, and iron that is not the unit's.

use super::*;

/// \[uT\] a small magnet at a finger's breadth, as one was stuck to a real unit.
const MAGNET_B: Vector3<f32> = Vector3::new(-6.0, -1.0, 58.0);

/// Turns for `duration_s` about an axis that changes every second, with `magnet_b` \[uT\] on the unit.
fn turn(world: &mut World, duration_s: u32, magnet_b: Vector3<f32>) {
    for second in 0..duration_s {
        let (sin, cos) = ComplexField::sin_cos(0.7 * second as f32);
        world.fly(1.0, Vector3::new(1.5 * sin, 1.5 * cos, 1.0), |_, step| {
            step.mag.as_mut().unwrap().value_b += magnet_b;
        });
    }
}

#[test]
fn a_magnet_that_comes_and_goes_is_learnt_and_forgotten() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::zeros(), nothing);
    for magnet_b in [MAGNET_B, Vector3::zeros(), MAGNET_B * 0.2] {
        let missed_ut = |world: &World| (world.filter.iron.iron_b - magnet_b).norm();
        turn(&mut world, 6, magnet_b);
        assert!(missed_ut(&world) < 5.0, "{} uT", missed_ut(&world));
        turn(&mut world, 20, magnet_b);
        assert!(missed_ut(&world) < 2.0, "{} uT", missed_ut(&world));
        world.off_by_less_than(1.0);
    }
}

fn begun_beside_a_magnet(params: Params) -> f32 {
    let mut world = World::new(
        tilted(),
        Params {
            field: Reference::unknown(),
            ..params
        },
    );
    // A second of slow turning before: the magnet hardly averages out of it.
    world.fly(1.0, Vector3::new(0.2, 0.1, 0.3), |_, step| {
        step.mag.as_mut().unwrap().value_b += MAGNET_B;
    });
    turn(&mut world, 15, MAGNET_B);
    world.off()
}

#[test]
fn begun_in_motion_beside_a_magnet_it_finds_its_heading() {
    let off = begun_beside_a_magnet(params());
    assert!(off < 3.0 * DEG, "{} deg", off / DEG);
    let without = begun_beside_a_magnet(Params {
        iron_sd_ut: 0.0,
        ..params()
    });
    assert!(without > 10.0 * DEG, "{} deg", without / DEG);
}

#[test]
fn a_magnet_on_its_way_past_is_no_iron_of_the_unit() {
    let mut world = World::new(tilted(), params());
    world.fly(5.0, Vector3::zeros(), nothing);
    for second in 0..10 {
        let (sin, cos) = ComplexField::sin_cos(0.7 * second as f32);
        let mut q_nb = world.q_nb;
        let rate_b = Vector3::new(1.5 * sin, 1.5 * cos, 1.0);
        world.fly(1.0, rate_b, |t_s, step| {
            q_nb *= from_rotation_vector(rate_b * STEP_S);
            let swing = 5.0 * (second as f32 + t_s);
            let passing_n = Vector3::new(ComplexField::sin(swing), ComplexField::cos(swing), 0.5) * 30.0;
            step.mag.as_mut().unwrap().value_b += q_nb.inverse_transform_vector(&passing_n);
        });
    }
    let found_b = world.filter.iron.iron_b;
    assert!(found_b.norm() < 0.5, "{found_b}");
}

/// \[deg\] heading error at the end of a rest with a little iron, and after a minute of turning that shows it.
fn headings_with_little_iron(field: Reference) -> [f32; 2] {
    let iron_b = Vector3::new(0.0, 2.0, 0.0);
    let mut world = World::new(UnitQuaternion::identity(), Params { field, ..params() });
    world.fly(25.0, Vector3::zeros(), |_, step| {
        step.mag.as_mut().unwrap().value_b += iron_b;
    });
    let at_first = world.off() / DEG;
    turn(&mut world, 60, iron_b);
    assert!((world.filter.iron.iron_b - iron_b).norm() < 0.5);
    [at_first, world.off() / DEG]
}

#[test]
fn north_that_was_found_stays_and_that_of_a_site_comes_true() {
    let [at_first, found] = headings_with_little_iron(Reference::unknown());
    assert!(at_first > 5.0 && (found - at_first).abs() < 1.0, "{at_first} {found}");
    let [at_first, of_site] = headings_with_little_iron(Reference::at_site(0.0));
    assert!(at_first > 5.0 && of_site < found - 1.0, "{at_first} {of_site}");
}

#[test]
fn a_magnetic_step_turns_the_heading_by_less_than_two_degrees() {
    let mut world = World::new(tilted(), params());
    world.fly(20.0, Vector3::zeros(), nothing);
    let q_nb = world.q_nb;
    for direction_n in [Vector3::y(), Vector3::x(), -Vector3::z()] {
        world.fly(30.0, Vector3::zeros(), |_, step| {
            step.mag.as_mut().unwrap().value_b += q_nb.inverse_transform_vector(&(direction_n * 20.0));
        });
        world.off_by_less_than(2.0);
        world.fly(10.0, Vector3::zeros(), nothing);
    }
}

/// It is not used at all while the gyros know better; a tenth of a degree is what they leave of the step's own window.
#[test]
fn gyros_keep_the_heading_beside_a_magnet() {
    let mut world = World::new(tilted(), params());
    world.fly(20.0, Vector3::zeros(), nothing);
    for field_n in [Vector3::new(0.0, 20.0, 0.0), Vector3::new(-10.0, 17.32, 0.0)] {
        let q_nb = world.q_nb;
        world.fly(15.0, Vector3::zeros(), |_, step| {
            step.mag.as_mut().unwrap().value_b += q_nb.inverse_transform_vector(&field_n);
        });
        world.off_by_less_than(0.1);
        world.fly(20.0, Vector3::zeros(), nothing);
    }
}

/// S19: iron of 20 uT that spins beside the magnetometers, from a wheel to a slow table. The field never takes the attitude with it.
#[test]
fn iron_that_goes_round_turns_the_heading_by_less_than_two_degrees() {
    for turns_a_second in [0.02, 0.03, 0.05, 0.1, 0.3, 1.0, 2.45, 9.0] {
        for axis in 0..3 {
            let spin = |world: &mut World, from_s: u32, to_s: u32| {
                (from_s..to_s)
                    .map(|second| {
                        let outcome = world.fly(1.0, Vector3::zeros(), |t_s, step| {
                            let angle = 2.0 * PI * turns_a_second * (second as f32 + t_s);
                            let (sin, cos) = ComplexField::sin_cos(angle);
                            let mut iron_b = Vector3::zeros();
                            (iron_b[axis], iron_b[(axis + 1) % 3]) = (20.0 * cos, 20.0 * sin);
                            step.mag.as_mut().unwrap().value_b += iron_b;
                        });
                        assert!(
                            !outcome.aligned,
                            "{turns_a_second} Hz: found afresh by a disturbed field"
                        );
                        world.off() / DEG
                    })
                    .fold(0.0, f32::max)
            };
            let mut world = World::new(tilted(), params());
            world.fly(20.0, Vector3::zeros(), nothing);
            let worst_deg = spin(&mut world, 0, 60);
            assert!(
                worst_deg < 2.0,
                "{turns_a_second} Hz about axis {axis}: {worst_deg} deg"
            );
            let mut afterwards = World {
                filter: world.filter.clone(),
                ..world
            };
            afterwards.fly(20.0, Vector3::zeros(), nothing);
            afterwards.off_by_less_than(2.0);
            // Nor in minutes.
            spin(&mut world, 60, 300);
            assert!(
                world.jump < 2.0 * DEG,
                "{turns_a_second} Hz: {} deg at once",
                world.jump / DEG
            );
        }
    }
}
