//! A real recording of a nine-axis unit as truth.
//!
//! In: CSV or CSV.GZ with `t_s`, `gyr_x..z` [rad/s], `acc_x..z` [m/s2, specific force: +g upwards at rest], `mag_x..z` \[uT\]
//! and optionally `temperature_c`; other columns are ignored, empty cells are no sample. Out: [`Truth`] at any time, so
//! that the twin projects what a real unit felt onto the four plates. Refuses what [`Fault`] lists.
//!
//! The recorded unit's frame s is right-handed with z up at rest; b is right-handed with z down. They are half a turn about
//! x apart: x_b = x_s, y_b = -y_s, z_b = -z_s, for rates, forces and field alike.
//!
//! Between samples everything is interpolated linearly, so the integrated angle over any two samples is that of the
//! trapezoidal rule on the recorded rates and nothing is invented between them. The angular acceleration is the
//! central difference of the rates. The force is that at the recorded unit's own accelerometer, which therefore is the
//! centre of the replayed unit: the plates' lever arms are added by the plant, once, and the recorded unit's own offset from
//! whatever it turned about is already in its force.

mod fault;
mod lines;
mod series;
mod table;
#[cfg(test)]
mod table_tests;

use std::io::Read;
use std::path::Path;

use nalgebra::Vector3;

pub use fault::{Fault, FileError};
pub use series::Series;
pub use table::{Located, MAX_BYTES, MAX_ROWS, Table};

use crate::truth::{Truth, TruthSource};

/// \[degC\] of a recording without a temperature: room.
const ROOM_C: f64 = 25.0;

const GYRO: [&str; 3] = ["gyr_x", "gyr_y", "gyr_z"];
const ACCELEROMETER: [&str; 3] = ["acc_x", "acc_y", "acc_z"];
const MAGNETOMETER: [&str; 3] = ["mag_x", "mag_y", "mag_z"];
const TEMPERATURE: &str = "temperature_c";

/// A recording; its time zero is the start of its window.
#[derive(Clone, Debug)]
pub struct Recording {
    file: String,
    rate_b: Series<3>,
    rate_dot_b: Series<3>,
    force_b: Series<3>,
    field_b_ut: Series<3>,
    temperature_c: Option<Series<1>>,
    from_s: f64,
    to_s: f64,
}

/// What one of a file's units is in ours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// \[s\]
    pub time: f64,
    /// [rad/s]
    pub rate: f64,
    /// [m/s2]
    pub force: f64,
    /// \[uT\]
    pub field: f64,
}

impl Recording {
    /// Reads a file.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        Self::of(&Table::open(path, &Self::columns())?)
    }

    /// Reads the bytes of a file of that name.
    pub fn read(bytes: impl Read, file: &str) -> Result<Self, FileError> {
        Self::of(&Table::read(bytes, file, &Self::columns())?)
    }

    /// Only `from_s` to `to_s` of it, counted from its present start. `to_s` may be later than its end.
    pub fn window(mut self, from_s: f64, to_s: f64) -> Result<Self, FileError> {
        let (first_s, last_s) = (0.0, self.to_s - self.from_s);
        let end_s = to_s.min(last_s);
        if !(first_s <= from_s && from_s < end_s) {
            return Err(FileError {
                file: self.file,
                fault: Fault::EmptyWindow {
                    from_s,
                    to_s,
                    first_s,
                    last_s,
                },
            });
        }
        (self.from_s, self.to_s) = (self.from_s + from_s, self.from_s + end_s);
        Ok(self)
    }

    /// A file in other units: what one of each is in s, rad/s, m/s2 and uT.
    pub fn in_units(mut self, units: Units) -> Self {
        self.rate_b = self.rate_b.with_times_scaled(units.time).map(|rate| rate * units.rate);
        self.rate_dot_b = self.rate_b.clone().slopes();
        self.force_b = self
            .force_b
            .with_times_scaled(units.time)
            .map(|force| force * units.force);
        self.field_b_ut = self
            .field_b_ut
            .with_times_scaled(units.time)
            .map(|field| field * units.field);
        self.temperature_c = self.temperature_c.map(|series| series.with_times_scaled(units.time));
        (self.from_s, self.to_s) = (self.from_s * units.time, self.to_s * units.time);
        self
    }

    /// What was recorded at each sample of the rates, with its time on the file's clock.
    pub fn samples(&self) -> impl Iterator<Item = (f64, Truth)> {
        self.rate_b.t_s().iter().map(|t_s| (*t_s, self.at(t_s - self.from_s)))
    }

    fn columns() -> Vec<&'static str> {
        [&GYRO[..], &ACCELEROMETER, &MAGNETOMETER, &[TEMPERATURE]].concat()
    }

    fn of(table: &Table) -> Result<Self, FileError> {
        let in_b = |names: [&str; 3]| Ok(table.series(names)?.series.map(s_to_b));
        let lines = table.series(GYRO)?.lines;
        let (rate_b, force_b, field_b_ut) = (in_b(GYRO)?, in_b(ACCELEROMETER)?, in_b(MAGNETOMETER)?);
        let temperature_c = match table.has(TEMPERATURE) {
            true => Some(table.series([TEMPERATURE])?.series),
            false => None,
        };
        let (from_s, to_s) = rate_b.span_s();
        let rate_dot_b = rate_b.slopes();
        let steep = |slope: &Vector3<f64>| !slope.iter().all(|value| value.is_finite());
        if let Some(line) = rate_dot_b.values().iter().zip(lines).find(|(slope, _)| steep(slope)) {
            return Err(table.error(Fault::TooSteep { line: line.1 }));
        }
        let file = table.file().to_owned();
        Ok(Self {
            file,
            rate_b,
            rate_dot_b,
            force_b,
            field_b_ut,
            temperature_c,
            from_s,
            to_s,
        })
    }
}

impl TruthSource for Recording {
    fn at(&self, t_s: f64) -> Truth {
        let t_s = (self.from_s + t_s).clamp(self.from_s, self.to_s);
        Truth {
            rate_b: self.rate_b.linear(t_s),
            rate_dot_b: self.rate_dot_b.linear(t_s),
            force_b: self.force_b.linear(t_s),
            field_b_ut: self.field_b_ut.linear(t_s),
            temperature_c: self
                .temperature_c
                .as_ref()
                .map_or(ROOM_C, |temperature| temperature.linear(t_s).x),
            lift_off: false,
            micro_g: false,
        }
    }

    fn duration_s(&self) -> Option<f64> {
        Some(self.to_s - self.from_s)
    }
}

/// From the recorded unit's frame to b: half a turn about x.
fn s_to_b(v: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, -v.y, -v.z)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    const HEADER: &str = "t_s,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z,mag_x,mag_y,mag_z";
    /// Half a second in which the first and last thing is rest; the magnetometer is fresh in every second row only.
    const ROWS: &str = "
10.0,0.001,-0.004,0.005,-0.2,0.3,9.8,0.2,15.8,-38.3,q
10.1,0.1,0.2,0.3,1.0,2.0,9.0,,,,
10.2,0.5,0.4,0.6,1.5,2.5,8.0,1.2,14.8,-39.3,
10.4,0.3,0.4,0.5,1.0,2.0,9.0,1.2,14.8,-39.3,
10.5,0.001,-0.004,0.005,-0.2,0.3,9.8,0.2,15.8,-38.3,
";

    fn recording() -> Recording {
        Recording::read(Cursor::new(format!("{HEADER},q_w{ROWS}")), "rec.csv").unwrap()
    }

    fn refusal(text: String) -> String {
        Recording::read(Cursor::new(text), "rec.csv").unwrap_err().to_string()
    }

    /// Adding and taking away the start of the file, 10 s.
    const ROUNDING: f64 = 1e-12;

    fn near(v: Vector3<f64>, x: f64, y: f64, z: f64) {
        assert!((v - Vector3::new(x, y, z)).norm() < ROUNDING, "{v}");
    }

    #[test]
    fn at_each_sample_it_is_what_was_recorded_half_a_turn_about_x_away() {
        let recording = recording();
        let start = recording.at(0.0);
        near(start.rate_b, 0.001, 0.004, -0.005);
        near(start.force_b, -0.2, -0.3, -9.8);
        near(start.field_b_ut, 0.2, -15.8, 38.3);
        near(recording.at(0.2).rate_b, 0.5, -0.4, -0.6);
        near(recording.at(0.2).force_b, 1.5, -2.5, -8.0);
        assert_eq!(recording.duration_s(), Some(0.5));
        assert_eq!(start.temperature_c, ROOM_C);
    }

    #[test]
    fn the_turn_from_s_to_b_keeps_handedness() {
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()].map(s_to_b);
        assert_eq!(x.cross(&y), z);
    }

    #[test]
    fn a_file_in_other_units_is_the_same_recording() {
        let deg = 1_f64.to_radians();
        let units = Units {
            time: 1e-3,
            rate: deg,
            force: 9.80665,
            field: 100.0,
        };
        let scaled = recording().in_units(units);
        let (was, is) = (recording().at(0.1), scaled.at(1e-4));
        assert!((is.rate_b - was.rate_b * deg).norm() < ROUNDING);
        assert!((is.rate_dot_b - was.rate_dot_b * deg * 1e3).norm() < 1e-9);
        assert!((is.force_b - was.force_b * 9.80665).norm() < ROUNDING);
        assert!((is.field_b_ut - was.field_b_ut * 100.0).norm() < 1e-9);
        assert!((scaled.samples().last().unwrap().0 - 0.0105).abs() < ROUNDING);
    }

    #[test]
    fn a_sensor_without_a_sample_is_interpolated_across() {
        near(recording().at(0.1).field_b_ut, 0.7, -15.3, 38.8);
    }

    #[test]
    fn the_integrated_angle_is_that_of_the_samples() {
        // Trapezoids of gyr_x over 0 to 0.5 s: 0.00505 + 0.03 + 0.08 + 0.01505.
        let recording = recording();
        let steps = 50_000;
        let step = 0.5 / f64::from(steps);
        let angle: f64 = (0..steps)
            .map(|i| recording.at((f64::from(i) + 0.5) * step).rate_b.x * step)
            .sum();
        assert!((angle - 0.1301).abs() < 1e-9, "{angle}");
    }

    #[test]
    fn the_angular_acceleration_is_the_central_difference() {
        near(recording().at(0.1).rate_dot_b, 2.495, -2.02, -2.975);
    }

    #[test]
    fn a_temperature_is_used_where_there_is_one() {
        let text = format!("{HEADER},temperature_c\n0,0,0,0,0,0,9.8,20,0,-40,21\n1,0,0,0,0,0,9.8,20,0,-40,23\n");
        assert_eq!(
            Recording::read(Cursor::new(text), "rec.csv")
                .unwrap()
                .at(0.5)
                .temperature_c,
            22.0
        );
    }

    #[test]
    fn a_window_starts_at_its_own_zero_and_ends_at_its_end() {
        let window = recording().window(0.2, 99.0).unwrap();
        near(window.at(0.0).rate_b, 0.5, -0.4, -0.6);
        near(window.at(-5.0).rate_b, 0.5, -0.4, -0.6);
        near(window.at(99.0).rate_b, 0.001, 0.004, -0.005);
        assert!((window.duration_s().unwrap() - 0.3).abs() < ROUNDING);
    }

    #[test]
    fn a_window_that_leaves_nothing_is_refused() {
        for (from_s, to_s) in [(0.6, 0.9), (0.3, 0.2), (-1.0, 0.2), (f64::NAN, 0.2), (0.1, f64::NAN)] {
            let refused = recording().window(from_s, to_s).is_err();
            assert_eq!(refused, !(from_s == 0.1), "{from_s} to {to_s}");
        }
        assert_eq!(
            recording().window(0.6, 0.9).unwrap_err().to_string(),
            "rec.csv: 0.6 to 0.9 s leaves nothing of it; it lasts from 0 to 0.5 s"
        );
    }

    #[test]
    fn a_missing_sensor_and_a_half_empty_sample_are_refused() {
        assert_eq!(
            refusal("t_s,gyr_x,gyr_y,acc_x,acc_y,acc_z\n0,0,0,0,0,0\n1,0,0,0,0,0\n".to_owned()),
            "rec.csv: line 1 names no column gyr_z; name it in the header, which must have gyr_x,gyr_y,gyr_z"
        );
        assert_eq!(
            refusal(format!("{HEADER}\n0,0,0,0,0,0,9.8,20,0,-40\n1,0,0,0,0,0,9.8,20,,-40\n")),
            "rec.csv: line 3: mag_x,mag_y,mag_z are empty in part; fill all of them, or leave all empty for no sample"
        );
    }
}
