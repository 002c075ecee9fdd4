//! Chapter 6 of the thesis beside ours: both rotation tests, flown by the twin on the host board and estimated as on board.
//!
//! In: nothing but a seed. Out: tables. The unit is the nominal one with noise and biases, by MT, and by the parameters
//! that LMS EC and MV SEC find on that very unit ([`calibrated`]); what comes of each is held against the motion that was
//! flown. Rates: mean and standard deviation of the error about the thesis' axes (sections 6.2.1 and 6.3.1, against the
//! Spatial). Attitude: the same of TRIAD and of the filter; the thesis prints none by axis. Specific force in the poses of
//! Tables 6.2 and 6.4, whose figures are for 9.8 m/s2: two are truncated, and y_e of C in Table 6.4 takes 9.8 where 8.02
//! belongs.
//!
//! Frame e appears in what is printed only, through [`mirror_e_b`](emems::geometry::frame_e::mirror_e_b).

pub mod calibrated;
pub mod flown;

use emems::{
    calibration::{Ranges, Set},
    unit::Settings,
};
use nalgebra::Vector3;

use calibrated::NotCalibrated;
use flown::{Estimated, Flown};

/// What the thesis prints: error of the rate by LMS EC, mean and standard deviation about x_e, y_e, z_e [deg/s].
const RATES: [[(f64, f64); 3]; 2] = [
    [(-0.1864, 1.6247), (0.1797, 2.3719), (0.1287, 1.4435)],
    [(-0.2108, 1.5829), (0.0504, 1.7855), (0.1718, 2.0876)],
];

/// A pose of Tables 6.2 and 6.4.
struct Pose {
    name: &'static str,
    /// Turns of the test before it.
    after: usize,
    /// [m/s2] as printed, in e.
    printed: [f64; 3],
    /// [m/s2] with every digit, in e.
    exact: [f64; 3],
}

const fn pose(name: &'static str, after: usize, printed: [f64; 3], exact: [f64; 3]) -> Pose {
    Pose {
        name,
        after,
        printed,
        exact,
    }
}

const TEST_1: [Pose; 4] = [
    pose("A", 1, [-8.48, 0.0, 4.9], [-8.487, 0.0, 4.9]),
    pose("B", 3, [-8.48, 0.0, -4.9], [-8.487, 0.0, -4.9]),
    pose("C", 5, [-8.02, -5.62, 0.0], [-8.0277, -5.6210, 0.0]),
    pose("D", 6, [-9.8, 0.0, 0.0], [-9.8, 0.0, 0.0]),
];
const TEST_2: [Pose; 3] = [
    pose("A", 1, [-9.8, 0.0, 0.0], [-9.8, 0.0, 0.0]),
    pose("B", 2, [-8.02, 0.0, 5.62], [-8.0277, 0.0, 5.6210]),
    pose("C", 3, [-5.67, -6.92, 5.62], [-5.6764, -5.6764, 5.6210]),
];

/// A method with the set it has for the unit.
struct Method {
    name: &'static str,
    set: Set,
}

/// MT: what the datasheets say.
fn mt() -> Set {
    Set::nominal(Ranges::of(&Settings::NOMINAL))
}

/// How many times [`tables`] says that it got on.
pub const STEPS: u64 = 4;

/// [m/s2] what an ideal unit in the laboratory would feel in a pose, in e.
fn felt_e(pose: &Pose) -> Vector3<f64> {
    Vector3::from(pose.exact) * (f64::from(Settings::NOMINAL.site.gravity) / 9.8)
}

/// [m/s2] root mean square over the poses of how far the specific force is off; `None` where a pose was not flown.
fn off(estimated: &Estimated, poses: &[Pose]) -> Option<f64> {
    let square = |pose: &Pose| Some((estimated.force_e(pose.after)? - felt_e(pose)).norm_squared());
    let squares: Vec<f64> = poses.iter().map(square).collect::<Option<_>>()?;
    Some((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// Both tests as text; `done` is called [`STEPS`] times on the way.
///
/// # Errors
/// When a calibration leaves something open.
pub fn tables(seed: u64, done: &dyn Fn()) -> Result<String, NotCalibrated> {
    let of = |name, set| {
        done();
        Method { name, set }
    };
    let methods = [
        Method { name: "MT", set: mt() },
        of("LMS EC", calibrated::lms_ec(seed)?),
        of("MV SEC", calibrated::mv_sec(seed)?),
    ];
    let mut text = String::from(
        "LMS EC calibrates accelerometers and gyros, MV SEC accelerometers and magnetometers; what is left is by MT.\n\n",
    );
    for (test, poses) in [(1, &TEST_1[..]), (2, &TEST_2[..])] {
        let flown = Flown::of(test, seed);
        let runs: Vec<Run> = methods.iter().map(|method| (method, flown.by(method.set))).collect();
        text += &errors(test, &runs);
        text += &forces(test, poses, &runs);
        text += "\n";
        done();
    }
    Ok(text)
}

/// A test by a method.
type Run<'a> = (&'a Method, Estimated<'a>);

/// Rates and attitudes of a test.
fn errors(test: usize, runs: &[Run]) -> String {
    let mut text =
        format!("Rotation test {test}: mean and sd of the error      x_e              y_e              z_e\n");
    let mut line = |name: String, cells: String| text += &format!("  {name:<38}{cells}\n");
    // Printed about x_e, y_e, z_e, which are z, y, x of b.
    let [x_e, y_e, z_e] = RATES[test - 1];
    line("rate, thesis, LMS EC [deg/s]".into(), cells_e([z_e, y_e, x_e]));
    let found: Vec<_> = runs
        .iter()
        .map(|(method, run)| (method, run.errors().map(|errors| errors.mean_sd())))
        .collect();
    for (k, (method, [rate, ..])) in found.iter().enumerate() {
        let earlier = runs[..k].iter().find(|(other, _)| other.set.gyro == method.set.gyro);
        let cells = earlier.map(|(other, _)| format!("  gyros as by {}", other.name));
        line(
            format!("rate, twin, {} [deg/s]", method.name),
            cells.unwrap_or_else(|| cells_e(*rate)),
        );
    }
    for (method, [_, triad, _]) in &found {
        line(format!("attitude, twin, TRIAD, {} [deg]", method.name), cells_e(*triad));
    }
    for (method, [.., filter]) in &found {
        line(
            format!("attitude, twin, filter, {} [deg]", method.name),
            cells_e(*filter),
        );
    }
    text
}

/// Mean and standard deviation about the axes of b, as x_e, y_e, z_e.
fn cells_e(in_b: [(f64, f64); 3]) -> String {
    [2, 1, 0]
        .map(|axis| format!("{:8.3} {:6.3}", in_b[axis].0, in_b[axis].1))
        .join("  ")
}

/// Specific force in the poses of a test.
fn forces(test: usize, poses: &[Pose], runs: &[Run]) -> String {
    let gravity = Settings::NOMINAL.site.gravity;
    let mut text = format!(
        "Table 6.{}: specific force [m/s2], twin's gravity {gravity:.4}\n",
        2 * test
    );
    let mut line = |name: &str, thesis: [String; 2], twin: Vec<String>| {
        let thesis = thesis.map(|cell| format!("{cell:>24}")).concat();
        let twin: String = twin.iter().map(|cell| format!("{cell:>27}")).collect();
        text += &format!("  {name:<8}{thesis}{twin}\n");
    };
    let titles = runs.iter().map(|(method, _)| format!("twin, {}", method.name));
    line("", ["printed", "exact, 9.8"].map(String::from), titles.collect());
    for pose in poses {
        let thesis = |v: [f64; 3]| format!("{:.2} {:6.2} {:6.2}", v[0], v[1], v[2]);
        let twin = |(_, run): &Run| {
            let force_e = run.force_e(pose.after);
            force_e.map_or("-".into(), |v| format!("{:.3} {:7.3} {:7.3}", v.x, v.y, v.z))
        };
        line(
            pose.name,
            [pose.printed, pose.exact].map(thesis),
            runs.iter().map(twin).collect(),
        );
    }
    let off = |(_, run): &Run| off(run, poses).map_or("-".into(), |off| format!("{off:.4}"));
    line("rms off", Default::default(), runs.iter().map(off).collect());
    text
}

#[cfg(test)]
mod tests;
