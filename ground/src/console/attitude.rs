//! What the unit says of its attitude, in two lines.
//!
//! In: a derived frame's [`Estimate`]. Out: roll, pitch and yaw with their standard deviations about north, east and down;
//! gyro bias with its own; the axes that are not used, and what is not isolable. Without an attitude the first line says
//! so: the unit has not been a second at rest or in motion yet, or was lost.

use emems::{
    attitude::{euler, from_parts},
    calibration::{CHANNELS, Channel},
    estimate::Estimate,
    faults::SensorHealth,
    sample::Kind,
};

/// Axes named one by one; more are counted.
const NAMED: usize = 6;

/// Attitude, and what it rests on.
pub fn lines(estimate: &Estimate) -> [String; 2] {
    [attitude(estimate), sensors(estimate)]
}

fn attitude(estimate: &Estimate) -> String {
    let Some(q_nb) = estimate.q_nb.and_then(from_parts) else {
        return " attitude not known".into();
    };
    let euler = euler(&q_nb);
    let [roll, pitch, yaw] = [euler.roll, euler.pitch, euler.yaw].map(f32::to_degrees);
    let [nn, _, _, ee, _, dd] = estimate.covariance_n;
    let [north, east, down] = [nn, ee, dd].map(|variance| variance.max(0.0).sqrt().to_degrees());
    format!(
        " roll {roll:7.2}  pitch {pitch:6.2}  yaw {yaw:7.2} deg   sd north {north:.2} east {east:.2} down {down:.2}"
    )
}

fn sensors(estimate: &Estimate) -> String {
    let [x, y, z] = estimate.bias_b.map(f32::to_degrees);
    let sd = estimate.bias_sd.map(f32::to_degrees).into_iter().fold(0.0, f32::max);
    format!(
        " bias {x:+.3} {y:+.3} {z:+.3} deg/s  sd {sd:.3}   {}",
        health(estimate.sensors)
    )
}

/// The health word in words.
fn health(sensors: SensorHealth) -> String {
    let unused: Vec<String> = (0..CHANNELS as u8)
        .map(Channel)
        .filter(|channel| !sensors.uses(*channel))
        .map(name)
        .collect();
    let mut said = match unused.len() {
        0 => "all axes used".into(),
        1..=NAMED => format!("not used: {}", unused.join(" ")),
        count => format!("{count} axes not used"),
    };
    for (bit, what) in [
        (SensorHealth::ACCELEROMETERS, "acc fault not isolable"),
        (SensorHealth::MAGNETOMETERS, "mag fault not isolable"),
        (SensorHealth::GYROS, "gyro fault not isolable"),
        (SensorHealth::CALIBRATION, "calibration in doubt"),
    ] {
        if sensors.contains(bit) {
            said = format!("{said}; {what}");
        }
    }
    said
}

/// As the table of sensors has it: `a2x`, `m4z`, `g3`.
fn name(channel: Channel) -> String {
    let plate = channel.plate() + 1;
    let axis = ["x", "y", "z"][usize::from(channel.0) % 3];
    match channel.kind() {
        Kind::Accelerometer => format!("a{plate}{axis}"),
        Kind::Magnetometer => format!("m{plate}{axis}"),
        Kind::Gyro | Kind::Thermometer => format!("g{plate}"),
    }
}

#[cfg(test)]
mod tests {
    use emems::attitude::{Euler, from_euler};

    use super::*;

    #[test]
    fn an_attitude_is_angles_with_what_they_are_worth() {
        let [roll, pitch, yaw] = [10.0_f32, -20.0, 90.0].map(f32::to_radians);
        let q_nb = from_euler(Euler { roll, pitch, yaw });
        let estimate = Estimate {
            q_nb: Some([q_nb.w, q_nb.i, q_nb.j, q_nb.k]),
            covariance_n: [1e-4, 0.0, 0.0, 1e-4, 0.0, 4e-4],
            bias_b: [0.01, -0.02, 0.0],
            bias_sd: [1e-3, 2e-3, 1e-3],
            sensors: SensorHealth(1 << 3 | 1 << 26 | 1 << 30),
            ..Estimate::NOTHING
        };
        assert_eq!(
            lines(&estimate),
            [
                " roll   10.00  pitch -20.00  yaw   90.00 deg   sd north 0.57 east 0.57 down 1.15",
                " bias +0.573 -1.146 +0.000 deg/s  sd 0.115   not used: a2x g3; gyro fault not isolable",
            ]
        );
    }

    #[test]
    fn what_is_not_known_is_said_and_many_axes_are_counted() {
        let estimate = Estimate {
            sensors: SensorHealth(0xFFF),
            ..Estimate::NOTHING
        };
        let [attitude, sensors] = lines(&estimate);
        assert_eq!(attitude, " attitude not known");
        assert!(sensors.ends_with("12 axes not used"), "{sensors}");
    }
}
