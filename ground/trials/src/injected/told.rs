//! What a recording's sensors should have written if the reference and the description are right, and what they wrote.
//!
//! In: a scene. Out: of a sensor, in blocks of [`BLOCK_S`], the mean of what it wrote less its zero, less what the record says, and
//! what the record says. Differences are taken over some rows, and the readings go through the same: a turn from `x - h` to `x + h`
//! against the mean rate between, the second difference of a place over `h` against the readings' mean under a triangle,
//!
//! ```text
//! w = 2 log(q(x-h)* q(x+h)) / 2h + C_bn w_earth     f = C_bn ((s(x-h) - 2 s(x) + s(x+h)) / h^2 - g),  s = p + C_nb lever     m = C_bn m_n
//! ```
//!
//! at `x = t + slot`. So neither is noisier than it need be, and what the reference blurs is blurred in both.

use nalgebra::{UnitQuaternion, Vector3};

use super::{
    recording::{Kind, Pose, Sensor},
    scene::Scene,
    series,
};

/// \[s\] of a block.
pub const BLOCK_S: f64 = 0.1;

/// \[s\] over which a turn and a place are differenced.
const TURN_S: f64 = 0.014;
const PLACE_S: f64 = 0.0175;

/// Rate of the Earth \[rad/s\].
const EARTH: f64 = 7.292_115e-5;

/// A sensor in blocks; NaN where the reference is blind in most of one.
#[derive(Clone, Debug)]
pub struct Blocks {
    /// \[s\] the middle of each.
    pub times_s: Vec<f64>,
    /// What was written less what should have been.
    pub misfit: Vec<Vector3<f64>>,
    /// What should have been.
    pub told: Vec<Vector3<f64>>,
    /// Attitude and place.
    pub poses: Vec<(UnitQuaternion<f64>, Vector3<f64>)>,
}

const NOTHING: Vector3<f64> = Vector3::new(f64::NAN, f64::NAN, f64::NAN);

/// The record between two rows.
fn at(record: &[Pose], row: f64) -> Option<(UnitQuaternion<f64>, Option<Vector3<f64>>)> {
    let whole = row.floor();
    let part = row - whole;
    let before = record.get(usize::try_from(whole as i64).ok()?)?;
    let after = if part == 0.0 {
        before
    } else {
        record.get(whole as usize + 1)?
    };
    let q_nb = before.q_nb?.try_slerp(&after.q_nb?, part, 1e-9)?;
    Some((
        q_nb,
        before
            .place_n
            .zip(after.place_n)
            .map(|(one, other)| one.lerp(&other, part)),
    ))
}

/// What the record says a sensor should have written in a row, after the differencing above.
fn told(scene: &Scene, sensor: &Sensor, row: usize) -> Option<Vector3<f64>> {
    let x = row as f64 + sensor.slot_s / scene.step_s;
    let to_b = |q_nb: UnitQuaternion<f64>, v_n: Vector3<f64>| q_nb.inverse() * v_n;
    match sensor.kind {
        Kind::Gyro => {
            let h = rows(TURN_S, scene.step_s) as f64;
            let (before, now, after) = (
                at(&scene.record, x - h)?,
                at(&scene.record, x)?,
                at(&scene.record, x + h)?,
            );
            let earth_n = EARTH * Vector3::new(scene.latitude.cos(), 0.0, -scene.latitude.sin());
            Some((before.0.inverse() * after.0).scaled_axis() / (2.0 * h * scene.step_s) + to_b(now.0, earth_n))
        }
        Kind::Accelerometer => {
            let h = rows(PLACE_S, scene.step_s) as f64;
            let place = |row: f64| {
                let (q_nb, place_n) = at(&scene.record, row)?;
                Some((q_nb, place_n? + q_nb * sensor.lever_b))
            };
            let (before, now, after) = (place(x - h)?, place(x)?, place(x + h)?);
            let acc_n = (after.1 - 2.0 * now.1 + before.1) / (h * scene.step_s).powi(2);
            Some(to_b(now.0, acc_n - Vector3::z() * scene.gravity))
        }
        Kind::Magnetometer => Some(to_b(at(&scene.record, x)?.0, scene.field_n_ut?)),
    }
}

fn rows(time_s: f64, step_s: f64) -> usize {
    ((time_s / step_s).round() as usize).max(1)
}

/// A sensor of a scene in blocks.
pub fn blocks(scene: &Scene, sensor: &Sensor) -> Blocks {
    let zeroed: Vec<Vector3<f64>> = sensor.values.iter().map(|value| value - sensor.bias).collect();
    let written = match sensor.kind {
        Kind::Gyro => series::mean(&zeroed, rows(TURN_S, scene.step_s)),
        Kind::Accelerometer => triangle(&zeroed, rows(PLACE_S, scene.step_s)),
        Kind::Magnetometer => zeroed,
    };
    let size = rows(BLOCK_S, scene.step_s);
    let followed = scene.followed();
    let mut blocks = Blocks {
        times_s: Vec::new(),
        misfit: Vec::new(),
        told: Vec::new(),
        poses: Vec::new(),
    };
    for from in (0..written.len() / size).map(|block| block * size) {
        let seen: Vec<(Vector3<f64>, Vector3<f64>)> = (from..from + size)
            .filter_map(|row| Some((written[row], told(scene, sensor, row)?)))
            .filter(|(written, _)| written.iter().all(|value| value.is_finite()))
            .collect();
        let count = seen.len() as f64;
        let (misfit, told) = match 2 * seen.len() > size {
            true => (
                seen.iter().map(|(written, told)| written - told).sum::<Vector3<f64>>() / count,
                seen.iter().map(|(_, told)| told).sum::<Vector3<f64>>() / count,
            ),
            false => (NOTHING, NOTHING),
        };
        let middle = from + size / 2;
        blocks.times_s.push(scene.times_s[middle]);
        blocks.misfit.push(misfit);
        blocks.told.push(told);
        blocks.poses.push(followed[middle]);
    }
    blocks
}

/// The mean under a triangle whose ends are `half` rows away, which is that of a second difference over as many.
fn triangle(values: &[Vector3<f64>], half: usize) -> Vec<Vector3<f64>> {
    let (half, last) = (half as isize, values.len() as isize - 1);
    let weight = |offset: isize| (half - offset.abs()) as f64 / (half * half) as f64;
    let at = |row: isize| values[row.clamp(0, last) as usize];
    (0..=last)
        .map(|row| (1 - half..half).map(|offset| at(row + offset) * weight(offset)).sum())
        .collect()
}
