//! A motion recorded by a truth instrument: attitude, and perhaps position and temperature, against time.
//!
//! In: CSV or CSV.GZ with `t_s,qw,qx,qy,qz` (q_nb, Hamilton, scalar first) and optionally `px_m,py_m,pz_m` (in n) and
//! `temperature_c`; empty cells, where the instrument lost sight, are interpolated across. Out: a [`Motion`] on the clock of
//! the file. Refuses what [`Fault`] lists.
//!
//! The attitude is interpolated by a cubic spline p(t) on the four components, made continuous in sign, and then
//! normalised: q = p/|p|. It goes through every sample and is twice continuously differentiable, so the angular
//! acceleration has no jumps (piecewise slerp has jumps in the rate itself, which lever arms turn into false
//! accelerations); and its derivatives are exact and short. With p* the conjugate, and because p* p is real,
//!
//! ```text
//! w  = 2 Im(p* p') / |p|^2
//! w' = 2 Im(p* p'') / |p|^2 - 2 (p.p') / |p|^2 w
//! ```

use std::io::Read;
use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector4};

use super::spline::{Sample, Spline};
use super::{Attitude, Motion, Pose};
use crate::recording::{Fault, FileError, Located, Series, Table};

const ATTITUDE: [&str; 4] = ["qw", "qx", "qy", "qz"];
const POSITION: [&str; 3] = ["px_m", "py_m", "pz_m"];
const TEMPERATURE: &str = "temperature_c";

/// \[Hz\] corners to which the record of an instrument that errs is smoothed, of attitude and position.
pub const CORNERS_HZ: [f64; 2] = [20.0, 10.0];

/// How far from one the norm of a recorded quaternion may be. Rounding to two decimals costs 0.01; a wrong column more.
const NORM_TOLERANCE: f64 = 0.1;
/// Cosine of half the largest turn between samples, 120 deg: from 180 deg on the way round is anyone's guess.
const COARSEST: f64 = 0.5;

/// A recorded motion.
#[derive(Clone, Debug)]
pub struct Recorded {
    attitude: Spline<4>,
    position: Option<Spline<3>>,
    temperature_c: Option<Series<1>>,
}

impl Recorded {
    /// Reads a file.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        Self::of(&Table::open(path, &Self::columns())?)
    }

    /// Reads the bytes of a file of that name.
    pub fn read(bytes: impl Read + 'static, file: &str) -> Result<Self, FileError> {
        Self::of(&Table::read(bytes, file, &Self::columns())?)
    }

    /// The same motion with what is above these corners smoothed away, without phase: for a truth instrument whose noise,
    /// differentiated once (attitude) or twice (position), is more than the unit's own.
    pub fn smoothed(&self, attitude_hz: f64, position_hz: f64) -> Self {
        let step_s = self.step_s();
        Self {
            attitude: self.attitude.smoothed(attitude_hz, step_s),
            position: self
                .position
                .as_ref()
                .map(|position| position.smoothed(position_hz, step_s)),
            temperature_c: self.temperature_c.clone(),
        }
    }

    /// What is used of the record of an instrument that errs: a hand or a table moves below [`CORNERS_HZ`], what is above is error.
    pub fn used(&self) -> Self {
        self.smoothed(CORNERS_HZ[0], CORNERS_HZ[1])
    }

    /// The same with an octave more.
    pub fn finer(&self) -> Self {
        self.smoothed(2.0 * CORNERS_HZ[0], 2.0 * CORNERS_HZ[1])
    }

    /// \[s\] its usual step between attitudes: the median.
    pub fn step_s(&self) -> f64 {
        let mut steps: Vec<f64> = self.attitude.t_s().windows(2).map(|pair| pair[1] - pair[0]).collect();
        let middle = steps.len() / 2;
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// \[s\] where the instrument lost sight: from the last attitude before to the first after, where these are more than
    /// one and a half usual steps apart.
    pub fn lost_s(&self) -> Vec<(f64, f64)> {
        let longest = 1.5 * self.step_s();
        let neighbours = self.attitude.t_s().windows(2).map(|pair| (pair[0], pair[1]));
        neighbours.filter(|(before, after)| after - before > longest).collect()
    }

    /// \[s\] its first and last attitude.
    pub fn span_s(&self) -> (f64, f64) {
        self.attitude.span_s()
    }

    fn columns() -> Vec<&'static str> {
        [&ATTITUDE[..], &POSITION, &[TEMPERATURE]].concat()
    }

    fn of(table: &Table) -> Result<Self, FileError> {
        let quaternions = continuous(table.series(ATTITUDE)?).map_err(|fault| table.error(fault))?;
        let position = match POSITION.iter().any(|column| table.has(column)) {
            true => Some(Spline::natural(about_the_middle(table.series(POSITION)?.series))),
            false => None,
        };
        let temperature_c = match table.has(TEMPERATURE) {
            true => Some(table.series([TEMPERATURE])?.series),
            false => None,
        };
        Ok(Self {
            attitude: Spline::natural(quaternions),
            position,
            temperature_c,
        })
    }
}

impl Motion for Recorded {
    fn at(&self, t_s: f64) -> Pose {
        Pose {
            acc_n: self
                .position
                .as_ref()
                .map_or(Vector3::zeros(), |position| position.at(t_s).acc),
            temperature_c: self.temperature_c.as_ref().map(|temperature| temperature.linear(t_s).x),
            ..Pose::turning(attitude(&self.attitude.at(t_s)))
        }
    }

    fn duration_s(&self) -> Option<f64> {
        Some(self.attitude.span_s().1)
    }

    fn position_n(&self, t_s: f64) -> Vector3<f64> {
        self.position
            .as_ref()
            .map_or(Vector3::zeros(), |position| position.at(t_s).value)
    }
}

/// Positions about their mean. Where an instrument has its zero says nothing: a field that differs from place to place is as told where the
/// unit was, and not where a laboratory has its corner.
fn about_the_middle(position: Series<3>) -> Series<3> {
    let middle = position.values().iter().sum::<Vector3<f64>>() / position.values().len() as f64;
    position.map(|value| value - middle)
}

/// The quaternions at unit norm, each with the sign that is nearer to the one before: q and -q are one attitude, but not
/// to a spline. Over lines without an attitude any turn is allowed: what lies between is not known anyway.
fn continuous(recorded: Located<4>) -> Result<Series<4>, Fault> {
    let mut previous: Option<Vector4<f64>> = None;
    let mut previous_line = 0;
    recorded.try_map(|line, q| {
        let norm = q.norm();
        if (norm - 1.0).abs() > NORM_TOLERANCE {
            return Err(Fault::NotAnAttitude { line, norm });
        }
        let mut q = q / norm;
        if let Some(previous) = previous {
            let cos_half = previous.dot(&q);
            if cos_half.abs() < COARSEST && line == previous_line + 1 {
                return Err(Fault::TooCoarse {
                    line,
                    degrees: 2.0 * cos_half.abs().acos().to_degrees(),
                });
            }
            q *= cos_half.signum();
        }
        (previous, previous_line) = (Some(q), line);
        Ok(q)
    })
}

/// The attitude p/|p| with the derivatives that follow from those of p.
fn attitude(p: &Sample<4>) -> Attitude {
    let [value, rate, acc] = [p.value, p.rate, p.acc].map(|v| Quaternion::new(v[0], v[1], v[2], v[3]));
    let (back, square) = (value.conjugate(), value.norm_squared());
    let rate_nb_b = (back * rate).imag() * 2.0 / square;
    let stretch = 2.0 * value.dot(&rate) / square;
    Attitude {
        q_nb: UnitQuaternion::from_quaternion(value),
        rate_nb_b,
        rate_dot_nb_b: (back * acc).imag() * 2.0 / square - rate_nb_b * stretch,
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::io::Cursor;

    use super::*;
    use crate::motion::{Tumble, check};

    fn read(text: &str) -> Result<Recorded, String> {
        Recorded::read(Cursor::new(text.to_owned()), "hand.csv").map_err(|error| error.to_string())
    }

    /// A minute of the tumble at 100 Hz with nine decimals, every second quaternion negated, and no sight at `lost`.
    fn tumble(lost: impl Fn(u32) -> bool) -> Recorded {
        let mut text = "t_s,qw,qx,qy,qz\n".to_owned();
        for i in 0..=6000 {
            let t = f64::from(i) * 0.01;
            let q = Tumble::new().at(t).attitude.q_nb.into_inner() * if i % 2 == 0 { 1.0 } else { -1.0 };
            match lost(i) {
                true => writeln!(text, "{t:.2},,,,").unwrap(),
                false => writeln!(text, "{t:.2},{:.9},{:.9},{:.9},{:.9}", q.w, q.i, q.j, q.k).unwrap(),
            }
        }
        read(&text).unwrap()
    }

    /// Largest difference in (rate, angular acceleration) between the recorded tumble and the tumble, away from its end,
    /// where a natural spline forces the second derivative to zero.
    fn errors(recorded: &Recorded) -> (f64, f64) {
        (0..5500)
            .map(|i| (f64::from(i) + 0.5) * 0.01)
            .fold((0.0, 0.0), |(rate, acc), t| {
                let (is, was) = (recorded.at(t).attitude, Tumble::new().at(t).attitude);
                let rate_error = (is.rate_nb_b - was.rate_nb_b).norm();
                (
                    f64::max(rate, rate_error),
                    f64::max(acc, (is.rate_dot_nb_b - was.rate_dot_nb_b).norm()),
                )
            })
    }

    #[test]
    fn its_derivatives_are_those_of_its_attitude() {
        check::derivatives(&tumble(|_| false), 0.0, 60.0);
    }

    #[test]
    fn coarse_samples_keep_their_derivatives_exact() {
        // 60 to 100 deg apart the spline leaves the unit sphere by up to a fifth, so that every term of w' counts.
        let rows = "0,1,0,0,0\n1,0.8,0.6,0,0\n2,0.5,0.5,0.7,0.1\n3,0.1,0.3,0.3,0.9\n4,0.1,-0.4,0.4,0.8\n";
        check::derivatives(&read(&format!("t_s,qw,qx,qy,qz\n{rows}")).unwrap(), 0.01, 3.99);
    }

    #[test]
    fn a_sampled_motion_comes_back_with_its_rates_and_accelerations() {
        let (rate, acc) = errors(&tumble(|_| false));
        // Spline truncation h^3 and h^2 / 12 of a motion of 1 rad/s, at h = 10 ms; rounding 1e-9 / h and / h^2.
        assert!(rate < 1e-5 && acc < 1e-3, "{rate} rad/s, {acc} rad/s2");
    }

    #[test]
    fn lost_sight_is_spanned_smoothly() {
        // Lost for 0.1 s each second: ten times the step, so a hundred to a thousand times the truncation.
        let (rate, acc) = errors(&tumble(|i| i % 100 > 90));
        assert!(rate < 2e-3 && acc < 0.1, "{rate} rad/s, {acc} rad/s2");
    }

    #[test]
    fn position_becomes_acceleration_and_temperature_is_interpolated() {
        let mut text = "t_s,qw,qx,qy,qz,px_m,py_m,pz_m,temperature_c\n".to_owned();
        for i in 0..=100 {
            let t = f64::from(i) * 0.02;
            writeln!(text, "{t},1,0,0,0,{},0,{},{}", t.sin(), 2.0 * (3.0 * t).cos(), 20.0 + t).unwrap();
        }
        let pose = read(&text).unwrap().at(1.005);
        let expected = Vector3::new(-1.005_f64.sin(), 0.0, -18.0 * 3.015_f64.cos());
        assert!((pose.acc_n - expected).norm() < 0.01, "{}", pose.acc_n);
        assert!((pose.temperature_c.unwrap() - 21.005).abs() < 1e-9);
    }

    #[test]
    fn positions_are_about_their_mean_wherever_an_instrument_has_its_zero() {
        let rows = |corner: f64| {
            let of = |t: f64| format!("{t},1,0,0,0,{},{},{}\n", corner + t, -corner, 0.5 * t * t);
            let rows: String = [0.0, 1.0, 2.0, 3.0].map(of).concat();
            read(&format!("t_s,qw,qx,qy,qz,px_m,py_m,pz_m\n{rows}")).unwrap()
        };
        let (here, elsewhere) = (rows(0.0), rows(-1.25));
        for t_s in [0.0, 0.5, 2.0, 3.0] {
            assert!((here.position_n(t_s) - elsewhere.position_n(t_s)).norm() < 1e-12);
        }
        assert!((elsewhere.position_n(2.0) - Vector3::new(0.5, 0.0, 0.25)).norm() < 1e-12);
    }

    #[test]
    fn where_it_lost_sight_is_known() {
        let recorded = read("t_s,qw,qx,qy,qz\n0,1,0,0,0\n1,1,0,0,0\n2,,,,\n3,1,0,0,0\n4,1,0,0,0\n").unwrap();
        assert_eq!(recorded.lost_s(), [(1.0, 3.0)]);
        assert_eq!((recorded.step_s(), recorded.span_s()), (1.0, (0.0, 4.0)));
    }

    #[test]
    fn out_of_sight_it_may_turn_any_way() {
        let recorded = read("t_s,qw,qx,qy,qz\n0,1,0,0,0\n1,1,0,0,0\n2,,,,\n3,0,1,0,0\n4,0,1,0,0\n").unwrap();
        assert_eq!(recorded.lost_s(), [(1.0, 3.0)]);
    }

    #[test]
    fn it_ends_with_the_file_and_stays_there() {
        let recorded = read("t_s,qw,qx,qy,qz\n1,1,0,0,0\n2,0.8,0.6,0,0\n").unwrap();
        assert_eq!(recorded.duration_s(), Some(2.0));
        assert_eq!(recorded.at(99.0), recorded.at(2.0));
        assert_eq!(recorded.at(-99.0), recorded.at(1.0));
    }

    #[test]
    fn what_is_no_attitude_is_refused() {
        for (rows, message) in [
            (
                "0,1,0,0,0\n1,0,0,0,0\n",
                "hand.csv: line 3: the norm of qw,qx,qy,qz is 0; an attitude has norm 1",
            ),
            (
                "0,1,0,0,0\n1,3,0,0,4\n",
                "hand.csv: line 3: the norm of qw,qx,qy,qz is 5; an attitude has norm 1",
            ),
            (
                "0,1,0,0,0\n1,0,1,0,0\n",
                "hand.csv: line 3: turned by 180 deg since the attitude before; record at least every 120 deg",
            ),
            (
                "0,1,0,0,0\n1,1,0,,0\n",
                "hand.csv: line 3: qw,qx,qy,qz are empty in part; fill all of them, or leave all empty for no sample",
            ),
            (
                "0,1,0,0,0\n1,,,,\n",
                "hand.csv: 1 lines have qw,qx,qy,qz; at least 2 are needed",
            ),
        ] {
            assert_eq!(read(&format!("t_s,qw,qx,qy,qz\n{rows}")).unwrap_err(), message);
        }
    }

    #[test]
    fn half_a_position_is_refused() {
        assert_eq!(
            read("t_s,qw,qx,qy,qz,px_m\n0,1,0,0,0,0\n1,1,0,0,0,0\n").unwrap_err(),
            "hand.csv: line 1 names no column py_m; name it in the header, which must have px_m,py_m,pz_m"
        );
    }
}
