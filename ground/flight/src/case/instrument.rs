//! A reference instrument: a motion as it would have been recorded.
//!
//! In: attitude, place and temperature at any instant, and where the log's clock begins. Out: the text of `motion.csv` after
//! the case format: `t_s,qw,qx,qy,qz,px_m,py_m,pz_m,temperature_c`, t_s on the log's clock.
//!
//! An instrument is a rate and two sigmas. Its errors are white: each attitude is turned by a rotation vector of three normals,
//! each position moved by three; the case states the same sigmas.
//!
//! Refused: a centre that moves, before an instrument that sees attitude only: it would be diagnosed as a unit that is shaken.

use std::fmt::Write;

use nalgebra::{UnitQuaternion, Vector3};
use trials::scene::Record;
use twin::part::signal::Noise;

/// \[m\] way of the centre that an instrument without positions may overlook: at 0.5 Hz it is 0.01 m/s2, a fifth of an
/// accelerometer's noise.
const STILL_M: f64 = 1e-3;

/// What saw the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Instrument {
    /// The truth itself at 100 Hz
    #[default]
    Exact,
    /// A camera system: 200 Hz, attitude to 0.2 mrad, position to 0.1 mm
    Optical,
    /// The encoders of a three-axis table: 100 Hz, attitude to 24 urad (5"), no position
    Table,
}

/// The centre moves, and the instrument does not see that.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the centre moves ({most_m:.3} m), which the encoders of a table do not see; take --reference exact or optical"
)]
pub struct Unseen {
    /// \[m\] the farthest it was from its start.
    pub most_m: f64,
}

/// What there is to see, by seconds since power-on.
pub struct Scenery<'a> {
    /// Attitude q_nb and place in n.
    pub record: &'a Record,
    /// \[degC\]
    pub temperature_c: &'a dyn Fn(f64) -> f64,
}

impl Instrument {
    /// \[Hz\] records a second.
    pub fn rate_hz(self) -> f64 {
        match self {
            Instrument::Exact | Instrument::Table => 100.0,
            Instrument::Optical => 200.0,
        }
    }

    /// \[rad\] of an attitude, about each axis; 0 is exact. Camera: markers 0.3 m apart, each to 0.06 mm. Table: 18 bits.
    pub fn attitude_sigma_rad(self) -> f64 {
        match self {
            Instrument::Exact => 0.0,
            Instrument::Optical => 2e-4,
            Instrument::Table => 2.4e-5,
        }
    }

    /// \[m\] of a position along each axis; `None` where there is none.
    pub fn position_sigma_m(self) -> Option<f64> {
        match self {
            Instrument::Exact => Some(0.0),
            Instrument::Optical => Some(1e-4),
            Instrument::Table => None,
        }
    }

    /// The record from `from_s` to `to_s` of the log's clock, whose zero is `zero_s` after power-on.
    ///
    /// # Errors
    /// When the centre moves and this instrument does not see it.
    pub fn record(self, scenery: &Scenery, zero_s: f64, [from_s, to_s]: [f64; 2], seed: u64) -> Result<String, Unseen> {
        let mut text = String::from("t_s,qw,qx,qy,qz");
        if self.position_sigma_m().is_some() {
            text.push_str(",px_m,py_m,pz_m");
        }
        text.push_str(",temperature_c\n");
        let noise = Noise::new(seed).stream(u64::from_le_bytes(*b"referenc"));
        let step_s = 1.0 / self.rate_hz();
        let first = (from_s / step_s).ceil() as i64;
        let last = (to_s / step_s).floor() as i64;
        let start_n = (scenery.record)(zero_s + first as f64 * step_s).1;
        for row in first..=last {
            let t_s = row as f64 * step_s;
            let (q_nb, place_n) = (scenery.record)(zero_s + t_s);
            let errors = |of: u64| Vector3::from_fn(|axis, _| noise.stream(of + axis as u64).normal(row as u64));
            let q = q_nb * UnitQuaternion::from_scaled_axis(self.attitude_sigma_rad() * errors(0));
            // Writing to a string cannot fail.
            let _ = write!(text, "{t_s:.4},{:.10},{:.10},{:.10},{:.10}", q.w, q.i, q.j, q.k);
            match self.position_sigma_m() {
                Some(sigma_m) => {
                    let p = place_n + sigma_m * errors(3);
                    let _ = write!(text, ",{:.9},{:.9},{:.9}", p.x, p.y, p.z);
                }
                None => {
                    let most_m = (place_n - start_n).norm();
                    if most_m > STILL_M {
                        return Err(Unseen { most_m });
                    }
                }
            }
            let _ = writeln!(text, ",{:.4}", (scenery.temperature_c)(zero_s + t_s));
        }
        Ok(text)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use trials::followed::Follower;
    use twin::motion::{Motion, Recorded, SoundingRocket, Tumble};

    use super::*;

    fn record(instrument: Instrument, motion: impl Motion + 'static, zero_s: f64, to_s: f64) -> Result<String, Unseen> {
        let follower = Follower::new(Arc::new(motion), zero_s + to_s);
        let record: Record = Arc::new(move |t_s| (follower.at(t_s).attitude.q_nb, follower.position_n(t_s)));
        let scenery = Scenery {
            record: &record,
            temperature_c: &|_| 25.0,
        };
        instrument.record(&scenery, zero_s, [-0.3, to_s], 3)
    }

    fn read(text: &str) -> Recorded {
        Recorded::read(std::io::Cursor::new(text.to_owned().into_bytes()), "motion.csv").expect("a motion")
    }

    #[test]
    fn an_exact_record_gives_the_motion_back_on_the_logs_clock() {
        let zero_s = 0.35;
        let back = read(&record(Instrument::Exact, Tumble::new(), zero_s, 60.0).expect("a record"));
        let tumble = Tumble::new();
        for step in 0..500 {
            let t_s = 8.0 + 0.1 * f64::from(step);
            let (told, truly) = (back.at(t_s).attitude, tumble.at(t_s + zero_s).attitude);
            assert!(told.q_nb.angle_to(&truly.q_nb) < 1e-7, "{t_s}");
            assert!((told.rate_nb_b - truly.rate_nb_b).norm() < 1e-5, "{t_s}");
        }
    }

    #[test]
    fn a_rocket_is_followed_by_its_acceleration() {
        let rocket = || SoundingRocket::new(5.0, 9.7804);
        let back = read(&record(Instrument::Exact, rocket(), 0.0, 60.0).expect("a record"));
        for step in 0..400 {
            let t_s = 12.0 + 0.1 * f64::from(step);
            let error = back.at(t_s).acc_n - rocket().at(t_s).acc_n;
            assert!(error.norm() < 0.05, "{t_s}: {error}");
        }
    }

    #[test]
    fn a_camera_errs_by_what_it_says_and_a_table_refuses_what_it_cannot_see() {
        let text = record(Instrument::Optical, Tumble::new(), 0.0, 50.0).expect("a record");
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
            .collect();
        assert_eq!(rows.len(), 10_061);
        let tumble = Tumble::new();
        let energy = |row: &Vec<f64>| {
            let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(row[1], row[2], row[3], row[4]));
            let turn = (tumble.at(row[0]).attitude.q_nb.inverse() * q).angle();
            [turn * turn / 3.0, row[5] * row[5]]
        };
        let [attitude, place] =
            [0, 1].map(|at| (rows.iter().map(|row| energy(row)[at]).sum::<f64>() / 10_061.0).sqrt());
        // Five standard errors of a standard deviation of so many.
        assert!((attitude / 2e-4 - 1.0).abs() < 0.04, "{attitude}");
        assert!((place / 1e-4 - 1.0).abs() < 0.04, "{place}");
        let refused = record(Instrument::Table, SoundingRocket::new(5.0, 9.7804), 0.0, 60.0);
        assert!(refused.expect_err("it flies").to_string().contains("--reference exact"));
    }
}
