//! How a reference and a field err slowly, and what each channel sees of that.
//!
//! In: how large these errors are and over which time they stay alike ([`SlowErrors`]), a channel and what it feels. Out: the
//! [`processes`] that [`super::whitening`] takes out, an attitude error (Matern 3/2) and a field error (Ornstein-Uhlenbeck) along the axes of
//! n, and how much of their states a sample sees.

use nalgebra::Vector3;
use twin::predict::{Channel, Feel, Kind};

use crate::{input::case::SlowErrors, null::whitening::Process};

/// What a sensor feels of the vector that it looks along.
pub fn felt_b(kind: Kind, feel: &Feel) -> Vector3<f64> {
    match kind {
        Kind::Accelerometer => feel.force_b,
        Kind::Gyro => feel.rate_b,
        Kind::Magnetometer => feel.field_b_ut,
        Kind::Thermometer => Vector3::zeros(),
    }
}

/// What a channel sees of an attitude error about the axes of n, of its rate, and of a field error along them.
pub fn sees(channel: &Channel, feel: &Feel) -> [f64; 9] {
    let [axis_n, turned_n] =
        [channel.axis_b, channel.axis_b.cross(&felt_b(channel.sensor, feel))].map(|v_b| feel.q_nb * v_b);
    let mut seen = [0.0; 9];
    // n.C(v + v x phi) for a vector v that stands in n.
    if matches!(channel.sensor, Kind::Accelerometer | Kind::Magnetometer) {
        seen[..3].copy_from_slice(turned_n.as_slice());
    }
    if channel.sensor == Kind::Gyro {
        seen[3..6].copy_from_slice(axis_n.as_slice());
    }
    if channel.sensor == Kind::Magnetometer {
        seen[6..].copy_from_slice(axis_n.as_slice());
    }
    seen
}

/// The three axes of the attitude and of the field.
pub fn processes(errors: &SlowErrors) -> [Process; 6] {
    let attitude = Process::Matern {
        sigma: errors.attitude_sigma_rad,
        alike_s: errors.attitude_correlation_s,
    };
    let field = Process::Alike {
        sigma: errors.field_wander_sigma_ut,
        alike_s: errors.field_correlation_s,
    };
    [attitude, attitude, attitude, field, field, field]
}

/// [unit/sqrt(s)] by which zeros walk where their description says less: accelerometers, gyros, magnetometers (nine recordings of BROAD).
const WALKS: [f64; 3] = [3e-4, 1e-6, 2e-3];

/// The walk of a channel's zero.
pub fn zero_walk(channel: &Channel) -> Process {
    let least = match channel.sensor {
        Kind::Accelerometer => WALKS[0],
        Kind::Gyro => WALKS[1],
        Kind::Magnetometer => WALKS[2],
        Kind::Thermometer => 0.0,
    };
    Process::Walk {
        per_root_s: channel.drift_sigma.max(least),
    }
}

/// Which states, and how much of each, a channel sees of such processes that begin `at`: an angle's rate is its second state.
pub fn of_states(seen: &[f64; 9], at: &[usize]) -> Vec<(usize, f64)> {
    let state = |of: usize| match of {
        0..3 => at[of],
        3..6 => at[of - 3] + 1,
        _ => at[of - 3],
    };
    let parts = seen.iter().enumerate().filter(|(_, part)| **part != 0.0);
    parts.map(|(of, part)| (state(of), *part)).collect()
}
