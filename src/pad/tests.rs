extern crate std;

use std::{format, string::ToString as _};

use nalgebra::UnitQuaternion;

use super::*;
use crate::{
    attitude::{Euler, from_euler},
    calibration::Channels,
};

fn pad(azimuth: f32, elevation: f32, roll: f32, covariance_n: [f32; 6]) -> Pad {
    let q = from_euler(Euler {
        roll: roll.to_radians(),
        pitch: elevation.to_radians(),
        yaw: azimuth.to_radians(),
    });
    Pad {
        q_nb: Some([q.w, q.i, q.j, q.k]),
        covariance_n,
        ..Pad::default()
    }
}

/// Variances of a degree, as long as errors are small.
const DEG2: f32 = 3.046_174e-4;

#[test]
fn the_angles_are_those_of_nose_and_body() {
    for (azimuth, elevation, roll) in [(70.0, 85.0, -120.0), (350.25, -12.5, 179.0), (0.0, 0.0, 0.0)] {
        let found = pad(azimuth, elevation, roll, [0.0; 6])
            .alignment()
            .expect("an attitude");
        for (found, told) in [
            (found.azimuth, azimuth),
            (found.elevation, elevation),
            (found.roll, roll),
        ] {
            assert!((found.deg - told).abs() < 0.005, "{found} is not {told}");
            assert!(found.sd_deg < 1e-6);
        }
    }
    assert_eq!(Pad::default().alignment(), None);
}

/// Each variance is what small turns of the attitude really do to the angle.
#[test]
fn sigmas_are_those_of_turned_attitudes() {
    const TURN: f32 = 1e-2;
    let (azimuth, elevation, roll) = (70.0, 80.0, 25.0);
    let straight = pad(azimuth, elevation, roll, [0.0; 6]);
    let [w, x, y, z] = straight.q_nb.expect("an attitude");
    let q_nb = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
    let moved = |axis: usize, turn: f32| {
        let mut turn_n = Vector3::zeros();
        turn_n[axis] = turn;
        let turned = UnitQuaternion::from_scaled_axis(turn_n) * q_nb;
        let pad = Pad {
            q_nb: Some([turned.w, turned.i, turned.j, turned.k]),
            ..straight
        };
        pad.alignment().expect("an attitude")
    };
    for axis in 0..3 {
        let (after, before) = (moved(axis, TURN), moved(axis, -TURN));
        let slope = |after: Angle, before: Angle| ((after.deg - before.deg) / 2.0).abs();
        let mut covariance_n = [0.0; 6];
        covariance_n[[0, 3, 5][axis]] = TURN * TURN;
        let told = pad(azimuth, elevation, roll, covariance_n).alignment().expect("one");
        for (told, after, before) in [
            (told.azimuth, after.azimuth, before.azimuth),
            (told.elevation, after.elevation, before.elevation),
            (told.roll, after.roll, before.roll),
        ] {
            let really = slope(after, before);
            assert!(
                (told.sd_deg - really).abs() < 0.02 * (1.0 + really),
                "axis {axis}: {told}, {really}"
            );
        }
    }
}

#[test]
fn near_the_vertical_azimuth_and_roll_are_not_known_and_the_elevation_is() {
    let found = pad(70.0, 90.0, 0.0, [DEG2, 0.0, 0.0, DEG2, 0.0, DEG2])
        .alignment()
        .expect("one");
    assert_eq!((found.azimuth.sd_deg, found.roll.sd_deg), (180.0, 180.0));
    assert!((found.elevation.sd_deg - 1.0).abs() < 0.01, "{found}");
}

#[test]
fn it_is_said_in_hundredths_of_a_degree() {
    let said = pad(70.0, -5.128, -0.001, [0.0, 0.0, 0.0, 0.0, 0.0, DEG2]);
    assert_eq!(
        said.alignment().expect("one").to_string(),
        "azimuth 70.00 sd 1.00 elevation -5.13 sd 0.00 roll 0.00 sd 0.00 deg"
    );
}

#[test]
fn every_sensor_that_is_not_used_is_a_dash() {
    assert_eq!(
        Pad::default().plates().to_string(),
        "plates 1 amgt 2 amgt 3 amgt 4 amgt"
    );
    let kinds = ['a', 'm', 'g', 't'];
    for (slot, sensor) in crate::sample::SENSORS.iter().enumerate() {
        let mut pad = Pad::default();
        match sensor.kind {
            Kind::Thermometer => pad.errors.insert(slot),
            // One axis of three.
            kind if slot < 8 => pad.sensors.0 = Channels::default().with(kind, 0b010 << (3 * sensor.plate)).0,
            kind => pad.sensors.0 = Channels::default().with(kind, 1 << sensor.plate).0,
        }
        let dashed = kinds.map(|letter| if letter == kinds[slot / 4] { '-' } else { letter });
        let dashed = dashed.iter().collect::<std::string::String>();
        let expected = (0..4).map(|plate| {
            let letters = if plate == sensor.plate { dashed.as_str() } else { "amgt" };
            format!(" {} {letters}", plate + 1)
        });
        assert_eq!(
            pad.plates().to_string(),
            format!("plates{}", expected.collect::<std::string::String>())
        );
    }
    let doubtful = Pad {
        sensors: SensorHealth::GYROS.with_if(SensorHealth::CALIBRATION, true),
        ..Pad::default()
    };
    assert!(
        doubtful
            .plates()
            .to_string()
            .ends_with("4 amgt, gyros disagree, calibration in doubt")
    );
}
