//! A recording that something is done to: what the sensors wrote, what the reference wrote, what is claimed of the place.
//!
//! In: a [`Recording`]. Out: [`Scene`], which the injected effects change, and what the reference says of each row without a gap
//! ([`Scene::followed`]): an effect that goes on while the reference is blind needs a motion there.

use nalgebra::{UnitQuaternion, Vector3};

use super::recording::{Kind, Pose, Recording, Sensor};
use crate::answer::Size;

/// A recording that something is done to.
#[derive(Clone, Debug)]
pub struct Scene {
    /// \[s\] of each row.
    pub times_s: Vec<f64>,
    /// \[s\] between rows.
    pub step_s: f64,
    /// What the sensors wrote.
    pub sensors: Vec<Sensor>,
    /// What the reference wrote.
    pub record: Vec<Pose>,
    /// \[degC\] of each row, where a thermometer was beside the reference.
    pub temperature_c: Option<Vec<f64>>,
    /// Gravity as claimed.
    pub gravity: f64,
    /// Field in n as claimed.
    pub field_n_ut: Option<Vector3<f64>>,
    /// \[rad\]
    pub latitude: f64,
    /// Sizes of what was done that verdicts state too.
    pub sizes: Vec<Size>,
}

impl Scene {
    /// Nothing is done to it yet.
    pub fn new(recording: &Recording) -> Self {
        let environment = &recording.case.environment;
        Scene {
            times_s: recording.times_s.clone(),
            step_s: recording.step_s(),
            sensors: recording.sensors.clone(),
            record: recording.record.clone(),
            temperature_c: None,
            gravity: environment.gravity_m_s2,
            field_n_ut: environment.field_n_ut.map(Vector3::from),
            latitude: environment.latitude_deg.to_radians(),
            sizes: Vec::new(),
        }
    }

    /// The places of the sensors of a kind.
    pub fn of(&self, kind: Kind) -> Vec<usize> {
        (0..self.sensors.len())
            .filter(|at| self.sensors[*at].kind == kind)
            .collect()
    }

    /// Attitude and place of every row: turned evenly through gaps, resting before the first and after the last.
    pub fn followed(&self) -> Vec<(UnitQuaternion<f64>, Vector3<f64>)> {
        let attitudes = without_gaps(
            &self.record,
            |pose| pose.q_nb,
            |one, other, part| one.try_slerp(other, part, 1e-9).unwrap_or(*one),
        );
        let places = without_gaps(
            &self.record,
            |pose| pose.place_n,
            |one, other, part| one.lerp(other, part),
        );
        let still = UnitQuaternion::identity();
        (0..self.record.len())
            .map(|row| {
                let place = places.get(row).copied().unwrap_or_default();
                (attitudes.get(row).copied().unwrap_or(still), place)
            })
            .collect()
    }

    /// The same at the instants of a sensor, a slot beside those of the rows.
    pub fn followed_by(&self, sensor: usize) -> Vec<(UnitQuaternion<f64>, Vector3<f64>)> {
        let rows = self.followed();
        let last = rows.len().saturating_sub(1);
        let at = |row: usize| {
            let instant = (row as f64 + self.sensors[sensor].slot_s / self.step_s).clamp(0.0, last as f64);
            let (from, part) = (instant as usize, instant.fract());
            let [(q_nb, place_n), (q_next, place_next)] = [rows[from], rows[(from + 1).min(last)]];
            (
                q_nb.try_slerp(&q_next, part, 1e-9).unwrap_or(q_nb),
                place_n.lerp(&place_next, part),
            )
        };
        (0..rows.len()).map(at).collect()
    }

    /// Notes a size of each axis of a sensor.
    pub fn sizes_of(&mut self, parameter: &str, sensor: usize, values: &Vector3<f64>) {
        let names = self.sensors[sensor].names.clone();
        self.sizes
            .extend(names.into_iter().zip(values.iter()).map(|(channel, value)| Size {
                parameter: parameter.to_owned(),
                channel: Some(channel),
                value: *value,
            }));
    }

    /// Notes a size that all channels touched have.
    pub fn size(&mut self, parameter: &str, value: f64) {
        self.sizes.push(Size {
            parameter: parameter.to_owned(),
            channel: None,
            value,
        });
    }
}

/// A value for every row; none at all where no row has one.
fn without_gaps<T: Copy>(
    record: &[Pose],
    of: impl Fn(&Pose) -> Option<T>,
    between: impl Fn(&T, &T, f64) -> T,
) -> Vec<T> {
    let known: Vec<(usize, T)> = (record.iter().enumerate())
        .filter_map(|(row, pose)| Some((row, of(pose)?)))
        .collect();
    let mut after = 0;
    (0..if known.is_empty() { 0 } else { record.len() })
        .map(|row| {
            while after < known.len() && known[after].0 < row {
                after += 1;
            }
            match (
                after.checked_sub(1).and_then(|before| known.get(before)),
                known.get(after),
            ) {
                (Some((from, one)), Some((to, other))) => between(one, other, (row - from) as f64 / (to - from) as f64),
                (Some((_, one)), None) | (None, Some((_, one))) => *one,
                (None, None) => known[0].1,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along x at 1 m/s, unseen in its middle; the sensor is 15 ms before its row.
    #[test]
    fn a_sensor_is_where_the_unit_was_at_its_own_instant() {
        let step_s = 0.01;
        let place = |row: usize| Vector3::x() * (row as f64 * step_s);
        let seen = |row: usize| Pose {
            q_nb: Some(UnitQuaternion::identity()),
            place_n: (row != 5).then(|| place(row)),
        };
        let sensor = Sensor {
            kind: Kind::Magnetometer,
            names: ["mx", "my", "mz"].map(str::to_owned),
            slot_s: -0.015,
            lever_b: Vector3::zeros(),
            bias: Vector3::zeros(),
            sigmas: [0.0; 3],
            values: vec![Vector3::zeros(); 10],
        };
        let scene = Scene {
            times_s: (0..10).map(|row| row as f64 * step_s).collect(),
            step_s,
            sensors: vec![sensor],
            record: (0..10).map(seen).collect(),
            temperature_c: None,
            gravity: 9.81,
            field_n_ut: None,
            latitude: 0.0,
            sizes: Vec::new(),
        };
        let places: Vec<f64> = scene.followed_by(0).iter().map(|(_, place_n)| place_n.x).collect();
        for (row, place) in places.iter().enumerate() {
            let expected = (row as f64 * step_s - 0.015).max(0.0);
            assert!((place - expected).abs() < 1e-12, "row {row}: {place}");
        }
    }
}
