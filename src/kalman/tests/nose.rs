//! A nose whose direction is measured from outside.

use super::*;

/// A unit on a rail at this elevation whose field is 3 deg of declination off, after 20 s.
fn on_a_rail(elevation_deg: f32) -> World {
    let pointing = Euler {
        roll: 0.4,
        pitch: elevation_deg * DEG,
        yaw: 70.0 * DEG,
    };
    let field = Reference::known(40.0, 60.0 * DEG, 3.0 * DEG);
    let mut world = World::new(from_euler(pointing), Params { field, ..params() });
    // And the correction by the last window.
    world.fly(20.5, Vector3::zeros(), nothing);
    assert!(world.filter.may_know_nose());
    world
}

fn nose(azimuth_deg: f32, elevation_deg: f32) -> Nose {
    let sd = 0.3 * DEG;
    Nose {
        azimuth: azimuth_deg * DEG,
        elevation: elevation_deg * DEG,
        azimuth_sd: sd,
        elevation_sd: sd,
    }
}

/// \[deg\] error about the vertical, and its standard deviation.
fn heading(world: &World) -> [f32; 2] {
    let error_n = (world.q_nb * world.filter.attitude().inverse()).scaled_axis();
    [
        error_n.z.abs() / DEG,
        ComplexField::sqrt(world.filter.attitude_covariance_n().m33) / DEG,
    ]
}

#[test]
fn a_slanting_rail_tells_the_heading_and_an_upright_one_does_not() {
    for (elevation_deg, most_deg) in [(5.0, 0.5), (45.0, 0.6), (85.0, 4.0)] {
        let mut world = on_a_rail(elevation_deg);
        let [before_deg, _] = heading(&world);
        assert!(before_deg > 2.0, "{before_deg} deg");
        assert_eq!(world.filter.know_nose(&nose(70.0, elevation_deg)), Ok(()));
        let [after_deg, sd_deg] = heading(&world);
        assert!(
            after_deg < most_deg && after_deg <= before_deg,
            "{elevation_deg} deg: {after_deg}"
        );
        assert!(after_deg < 3.0 * sd_deg, "{elevation_deg} deg: {after_deg} {sd_deg}");
        assert!(sd_deg > 0.2, "one witness of 0.3 deg leaves {sd_deg} deg");
        assert!(world.filter.covariance().matrix().symmetric_eigenvalues().min() > 0.0);
    }
}

/// A crew that is wrong by 30 deg, on slanting rails and upright ones.
#[test]
fn a_rail_that_contradicts_the_attitude_is_refused_and_leaves_it_as_it_is() {
    for elevation_deg in [30.0, 60.0, 80.0] {
        let mut world = on_a_rail(elevation_deg);
        let before = world.filter.attitude();
        let off = world.filter.know_nose(&nose(100.0, elevation_deg)).unwrap_err();
        // By a chord of the circle about the vertical; the heading itself is 3 deg off.
        let expected = 2.0 * ComplexField::asin(ComplexField::cos(elevation_deg * DEG) * ComplexField::sin(15.0 * DEG));
        assert!(
            (off - expected).abs() < 3.5 * DEG,
            "{} {} deg",
            off / DEG,
            expected / DEG
        );
        assert!(angle_between(&world.filter.attitude(), &before) < 1e-5);
        let [off_deg, sd_deg] = heading(&world);
        assert!(off_deg < 3.0 * sd_deg, "{off_deg} {sd_deg} deg");
    }
    let mut world = on_a_rail(45.0);
    assert!(
        world.filter.know_nose(&nose(250.0, 45.0)).is_err(),
        "the other way round"
    );
    assert!(world.filter.know_nose(&nose(70.0, 15.0)).is_err(), "too low");
}
