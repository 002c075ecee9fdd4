//! A reference in whatever columns its instrument writes, made `motion.csv`.
//!
//! In: CSV (.gz) with a header, separated by comma, semicolon or tab. Out: [`ReferenceRecord`]: rows on its own clock in SI, and in words
//! what was taken for what. Recognised, upper or lower case alike:
//!
//! | what | columns | units, by |
//! |---|---|---|
//! | time | t_s, time_s, t, time, timestamp, time_ms, time_us, time_ns | name, else the median step: 1 to 200 ms |
//! | attitude | qw qx qy qz; q0 q1 q2 q3; w x y z with `quat_`; or roll pitch yaw | radians or degrees by name, else degrees from 6.3 on |
//! | place | px_m py_m pz_m; px py pz; pos_x pos_y pos_z; tx ty tz; x y z | by name; else metres, unless the log says millimetres |
//! | temperature | temperature_c | |
//!
//! Whether the attitude is body to navigation or the other way, and which way navigation's axes point, the log decides
//! ([`ReferenceRecord::turned`]). Refused, naming the file: no time, no attitude, a quaternion that is none, time that runs back, fewer than
//! [`FEWEST`] rows.

use std::{io::Read, path::Path};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Rows at least: a second at 50 Hz.
const FEWEST: usize = 50;

/// How far from one the norm of a quaternion may be.
const NORM: f64 = 0.1;

/// Cells of a row to the four numbers of a quaternion, where all are there.
type Attitude = Box<dyn Fn(&[Option<f64>]) -> Option<[f64; 4]>>;

/// Why a reference cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {why}")]
pub struct Refused {
    /// Which.
    pub file: String,
    /// Why, and what to do.
    pub why: String,
}

/// A row.
#[derive(Clone, Debug)]
pub struct Row {
    /// \[s\] on the instrument's clock.
    pub t_s: f64,
    /// As written: to be settled which way it turns.
    pub q: UnitQuaternion<f64>,
    /// \[m\]
    pub place: Option<Vector3<f64>>,
    /// \[degC\]
    pub temperature_c: Option<f64>,
}

/// What an instrument told.
#[derive(Clone, Debug)]
pub struct ReferenceRecord {
    /// Its rows.
    pub rows: Vec<Row>,
    /// What was taken for what.
    pub taken: Vec<String>,
    /// Whether the unit of its places is by name: where it is not, the log decides.
    pub place_is_named: bool,
}

/// How an instrument counts its axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// North, east, down.
    Ned,
    /// East, north, up.
    Enu,
    /// North, west, up.
    Nwu,
}

impl Axes {
    /// All of them, the format's own first.
    pub const ALL: [Axes; 3] = [Axes::Ned, Axes::Enu, Axes::Nwu];

    /// Components of this frame to north, east, down.
    fn to_ned(self) -> UnitQuaternion<f64> {
        match self {
            Axes::Ned => UnitQuaternion::identity(),
            Axes::Enu => UnitQuaternion::from_quaternion(Quaternion::new(0.0, 1.0, 1.0, 0.0)),
            Axes::Nwu => UnitQuaternion::from_quaternion(Quaternion::new(0.0, 1.0, 0.0, 0.0)),
        }
    }
}

impl ReferenceRecord {
    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be used.
    pub fn open(path: &Path) -> Result<Self, Refused> {
        let file = path.display().to_string();
        let refused = |why: String| Refused {
            file: file.clone(),
            why,
        };
        let bytes = gap::input::case::read_bytes(path).map_err(|error| refused(error.to_string()))?;
        ReferenceRecord::read(&bytes[..]).map_err(refused)
    }

    fn read(mut bytes: impl Read) -> Result<Self, String> {
        let mut text = String::new();
        bytes
            .read_to_string(&mut text)
            .map_err(|error| format!("is no text: {error}"))?;
        let header = text.lines().next().unwrap_or_default();
        let separator = [b';', b'\t', b',']
            .into_iter()
            .find(|one| header.as_bytes().contains(one))
            .unwrap_or(b',');
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator)
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(text.as_bytes());
        let columns: Vec<String> = reader
            .headers()
            .map_err(|error| error.to_string())?
            .iter()
            .map(str::to_lowercase)
            .collect();
        let at = |name: &str| columns.iter().position(|column| column == name);
        let all = |names: &[&str]| names.iter().map(|name| at(name)).collect::<Option<Vec<usize>>>();
        let one_of = |sets: &[&[&str]]| {
            sets.iter()
                .find_map(|set| all(set).map(|places| (places, set.join(" "))))
        };
        let mut cells: Vec<Vec<Option<f64>>> = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| error.to_string())?;
            let number = |cell: &str| {
                cell.replace(',', ".")
                    .parse::<f64>()
                    .ok()
                    .filter(|value| value.is_finite())
            };
            cells.push(record.iter().map(number).collect());
        }
        if cells.len() < FEWEST {
            return Err(format!("has {} rows; {FEWEST} are the least", cells.len()));
        }
        let mut taken = Vec::new();
        let (time, of_name) =
            time_column(&columns).ok_or_else(|| format!("has no column of time; it has {}", columns.join(", ")))?;
        let cell = |row: &[Option<f64>], place: usize| row.get(place).copied().flatten();
        let times: Vec<f64> = cells.iter().filter_map(|row| cell(row, time)).collect();
        let unit_s = of_name.or_else(|| time_unit_s(&times)).ok_or("has steps of time that are neither s, ms, us nor ns between 1 and 200 ms; name the column time_ms or the like")?;
        taken.push(format!("time: {}, a unit is {unit_s} s", columns[time]));
        let quaternion = one_of(&[
            &["qw", "qx", "qy", "qz"],
            &["q0", "q1", "q2", "q3"],
            &["quat_w", "quat_x", "quat_y", "quat_z"],
            &["q_w", "q_x", "q_y", "q_z"],
        ]);
        let angles = one_of(&[
            &["roll_rad", "pitch_rad", "yaw_rad"],
            &["roll_deg", "pitch_deg", "yaw_deg"],
            &["roll", "pitch", "yaw"],
        ]);
        let place = one_of(&[
            &["px_m", "py_m", "pz_m"],
            &["px_mm", "py_mm", "pz_mm"],
            &["px", "py", "pz"],
            &["pos_x", "pos_y", "pos_z"],
            &["tx", "ty", "tz"],
            &["x", "y", "z"],
        ]);
        let attitude: Attitude = match (&quaternion, &angles) {
            (Some((places, names)), _) => {
                taken.push(format!("attitude: quaternion {names}, scalar first"));
                let places = places.clone();
                Box::new(move |row| {
                    let all: Option<Vec<f64>> = places.iter().map(|place| cell(row, *place)).collect();
                    all.and_then(|all| all.try_into().ok())
                })
            }
            (None, Some((places, names))) => {
                let largest = cells
                    .iter()
                    .flat_map(|row| places.iter().filter_map(|place| cell(row, *place)))
                    .fold(0.0, |most: f64, value| most.max(value.abs()));
                let is_degrees = names.contains("_deg") || (!names.contains("_rad") && largest > 6.3);
                let unit = if is_degrees { std::f64::consts::PI / 180.0 } else { 1.0 };
                taken.push(format!(
                    "attitude: {names} in {}, yaw first",
                    if is_degrees { "degrees" } else { "radians" }
                ));
                let places = places.clone();
                Box::new(move |row| {
                    let all: Option<Vec<f64>> = places.iter().map(|place| cell(row, *place)).collect();
                    let [roll, pitch, yaw]: [f64; 3] = all?.try_into().ok()?;
                    let q = UnitQuaternion::from_euler_angles(unit * roll, unit * pitch, unit * yaw);
                    Some([q.w, q.i, q.j, q.k])
                })
            }
            (None, None) => {
                return Err(format!(
                    "has no attitude (qw, qx, qy, qz or roll, pitch, yaw); it has {}",
                    columns.join(", ")
                ));
            }
        };
        let metres = place
            .as_ref()
            .map_or(1.0, |(_, names)| if names.contains("_mm") { 1e-3 } else { 1.0 });
        let place_is_named = place.as_ref().is_none_or(|(_, names)| names.contains("_m"));
        if let Some((_, names)) = &place {
            let unit = match (place_is_named, metres < 1.0) {
                (false, _) => "in a unit that the log decides",
                (true, true) => "in millimetres",
                (true, false) => "in metres",
            };
            taken.push(format!("place: {names} {unit}"));
        }
        let warm = at("temperature_c");
        let mut rows: Vec<Row> = Vec::new();
        for (number, row) in cells.iter().enumerate() {
            let line = number + 2;
            let t_s = unit_s * cell(row, time).ok_or_else(|| format!("line {line}: has no time"))?;
            if rows.last().is_some_and(|last| t_s <= last.t_s) {
                return Err(format!("line {line}: time does not go on"));
            }
            // Where the instrument lost sight.
            let Some([w, x, y, z]) = attitude(row) else { continue };
            let q = Quaternion::new(w, x, y, z);
            if (q.norm() - 1.0).abs() > NORM {
                return Err(format!(
                    "line {line}: the quaternion's norm is {:.3}, not 1; are these the right columns?",
                    q.norm()
                ));
            }
            let placed = place.as_ref().and_then(|(places, _)| {
                let all: Option<Vec<f64>> = places.iter().map(|place| cell(row, *place)).collect();
                all.map(|all| Vector3::from_vec(all) * metres)
            });
            rows.push(Row {
                t_s,
                q: UnitQuaternion::from_quaternion(q),
                place: placed,
                temperature_c: warm.and_then(|place| cell(row, place)),
            });
        }
        if rows.len() < FEWEST {
            return Err(format!(
                "has {} rows with an attitude; {FEWEST} are the least",
                rows.len()
            ));
        }
        Ok(ReferenceRecord {
            rows,
            taken,
            place_is_named,
        })
    }

    /// Its places taken for millimetres.
    pub fn in_millimetres(&self) -> Self {
        let mut told = self.clone();
        for row in &mut told.rows {
            row.place = row.place.map(|place| place * 1e-3);
        }
        told
    }

    /// The text of `motion.csv`, these seconds taken off, read as body to navigation or (`is_inverse`) the other way.
    pub fn text(&self, offset_s: f64, axes: Axes, is_inverse: bool) -> String {
        let has_place = self.rows.iter().all(|row| row.place.is_some());
        let has_temperature = self.rows.iter().all(|row| row.temperature_c.is_some());
        let mut text = String::from("t_s,qw,qx,qy,qz");
        text.push_str(if has_place { ",px_m,py_m,pz_m" } else { "" });
        text.push_str(if has_temperature { ",temperature_c\n" } else { "\n" });
        for row in &self.rows {
            let q = ReferenceRecord::turned(row.q, axes, is_inverse);
            text.push_str(&format!(
                "{:.5},{:.10},{:.10},{:.10},{:.10}",
                row.t_s - offset_s,
                q.w,
                q.i,
                q.j,
                q.k
            ));
            if let Some(place) = row.place.filter(|_| has_place) {
                let p = axes.to_ned() * place;
                text.push_str(&format!(",{:.7},{:.7},{:.7}", p.x, p.y, p.z));
            }
            if let Some(temperature_c) = row.temperature_c.filter(|_| has_temperature) {
                text.push_str(&format!(",{temperature_c:.4}"));
            }
            text.push('\n');
        }
        text
    }

    /// `q_nb` of an attitude as written.
    pub fn turned(q: UnitQuaternion<f64>, axes: Axes, is_inverse: bool) -> UnitQuaternion<f64> {
        axes.to_ned() * if is_inverse { q.inverse() } else { q }
    }
}

/// The column of time, and what its name says of its unit \[s\].
fn time_column(columns: &[String]) -> Option<(usize, Option<f64>)> {
    const NAMES: [(&str, Option<f64>); 12] = [
        ("t_s", Some(1.0)),
        ("time_s", Some(1.0)),
        ("t_ms", Some(1e-3)),
        ("time_ms", Some(1e-3)),
        ("t_us", Some(1e-6)),
        ("time_us", Some(1e-6)),
        ("time_ns", Some(1e-9)),
        ("timestamp_ns", Some(1e-9)),
        ("t", None),
        ("time", None),
        ("timestamp", None),
        ("stamp", None),
    ];
    NAMES
        .iter()
        .find_map(|(name, unit_s)| columns.iter().position(|column| column == name).map(|at| (at, *unit_s)))
}

/// \[s\] of a unit, such that the median step is 1 to 200 ms.
fn time_unit_s(times: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let step = *steps.get(steps.len() / 2)?;
    [1.0, 1e-3, 1e-6, 1e-9]
        .into_iter()
        .find(|unit_s| (1e-3..=0.2).contains(&(step * unit_s)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, row: impl Fn(usize) -> String) -> Result<ReferenceRecord, String> {
        let rows: Vec<String> = (0..100).map(row).collect();
        ReferenceRecord::read(format!("{header}\n{}\n", rows.join("\n")).as_bytes())
    }

    #[test]
    fn a_camera_in_milliseconds_millimetres_and_degrees_is_understood() {
        let told = file("Time;Roll;Pitch;Yaw;X;Y;Z", |k| {
            format!("{};90,0;0,0;0,0;{};0,0;0,0", 10 * k, 3 * k)
        });
        let told = told.expect("a reference");
        assert!((told.rows[50].t_s - 0.5).abs() < 1e-12, "{:?}", told.taken);
        assert!(!told.place_is_named);
        assert!((told.in_millimetres().rows[50].place.expect("a place").x - 0.15).abs() < 1e-12);
        assert!((told.rows[0].q.angle().to_degrees() - 90.0).abs() < 1e-9);
    }

    #[test]
    fn up_becomes_down_whichever_way_the_instrument_counts() {
        let up_enu = Axes::Enu.to_ned() * Vector3::z();
        let east_enu = Axes::Enu.to_ned() * Vector3::x();
        assert!((up_enu + Vector3::z()).norm() < 1e-12 && (east_enu - Vector3::y()).norm() < 1e-12);
        assert!((Axes::Nwu.to_ned() * Vector3::y() + Vector3::y()).norm() < 1e-12);
    }

    #[test]
    fn what_is_no_reference_is_refused_by_what_it_lacks() {
        let check = |told: Result<ReferenceRecord, String>, words: &str| {
            let refusal = told.expect_err(words);
            assert!(refusal.contains(words), "{refusal}");
        };
        check(file("t_s,a,b", |k| format!("{k},1,2")), "no attitude");
        check(file("a,qw,qx,qy,qz", |_| "0,1,0,0,0".into()), "no column of time");
        check(file("t_s,qw,qx,qy,qz", |k| format!("{k},2,0,0,0")), "norm is 2");
        check(
            file("t_s,qw,qx,qy,qz", |k| format!("{},1,0,0,0", 5 - k as i32)),
            "line 3: time does not go on",
        );
        check(
            file("t,qw,qx,qy,qz", |k| format!("{},1,0,0,0", 0.5 * k as f64)),
            "steps of time",
        );
    }
}
