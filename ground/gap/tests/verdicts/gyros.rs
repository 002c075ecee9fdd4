//! Three gyros on a table, as files: what the cases made here have in common.

use std::{fmt::Write, fs};

use crate::written::written;
use gap::{
    diagnose::{Diagnosis, diagnose},
    input::case::Subject,
};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use tempfile::TempDir;

/// \[s\] of the log, at [`RATE_HZ`].
pub const SECONDS: usize = 240;

pub const RATE_HZ: usize = 5;

/// [rad/s] white noise of a gyro.
pub const NOISE: f64 = 0.003;

/// [rad/s] pace of the motion.
const W: f64 = 0.9;

const CASE: &str = r#"[environment]
latitude_deg = 0.0
[windows]
fit = [[0.0, 120.0]]
hold = [[120.0, 240.0]]
"#;

/// [rad/s] about z alone: phi(t) = (1 - cos(w t))/2.
pub fn rate(t_s: f64) -> f64 {
    W / 2.0 * (W * t_s).sin()
}

/// Three gyros along the axes of b, turning about z; gz reads `error` [rad/s] of the time \[s\] too much, and its description has
/// these keys too.
pub fn erring(error: impl Fn(f64) -> f64, keys_of_gz: &str) -> TempDir {
    erring_in(11, error, keys_of_gz)
}

/// The same with noise drawn from a seed.
pub fn erring_in(seed: u64, error: impl Fn(f64) -> f64, keys_of_gz: &str) -> TempDir {
    let mut unit = "name = \"three gyros\"\n".to_owned();
    for (name, axis) in [
        ("gx", "1.0, 0.0, 0.0"),
        ("gy", "0.0, 1.0, 0.0"),
        ("gz", "0.0, 0.0, 1.0"),
    ] {
        let _ = write!(
            unit,
            "[[channel]]\nname = \"{name}\"\nsensor = \"gyro\"\ngroup = \"unit\"\naxis_b = [{axis}]\nlsb = 1.0\n\
             noise_sigma = {NOISE}\nbias_sigma = 0.001\nscale_sigma = 0.001\naxis_sigma_rad = 0.001\nrange = [-6.0, 6.0]\n"
        );
    }
    unit += keys_of_gz;
    let mut motion = "t_s,qw,qx,qy,qz\n".to_owned();
    let mut measured = "t_s,gx,gy,gz\n".to_owned();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    for k in 0..=50 * SECONDS {
        let t = k as f64 / 50.0;
        let half = (1.0 - (W * t).cos()) / 4.0;
        let _ = writeln!(motion, "{t:.2},{:.9},0,0,{:.9}", half.cos(), half.sin());
    }
    // Earth's rate at the equator points north, which is x of n; the attitude turns it in the plane x, y of b.
    let earth = 7.292e-5;
    for k in 0..SECONDS * RATE_HZ {
        let t = k as f64 / RATE_HZ as f64;
        let angle = (1.0 - (W * t).cos()) / 2.0;
        let mut noise = || -> f64 { NOISE * Distribution::<f64>::sample(&StandardNormal, &mut random) };
        let _ = writeln!(
            measured,
            "{t:.1},{:.7},{:.7},{:.7}",
            earth * angle.cos() + noise(),
            -earth * angle.sin() + noise(),
            rate(t) + error(t) + noise()
        );
    }
    written("injected", CASE, &unit, &motion, &measured)
}

pub fn diagnosed_in(folder: &TempDir, withheld: &[&str]) -> (Subject, Diagnosis) {
    let subject = Subject::open(folder.path()).expect("opens");
    let withheld: Vec<String> = withheld.iter().map(|name| (*name).to_owned()).collect();
    let diagnosis = diagnose(&subject, &withheld, &|_, _| {});
    (subject, diagnosis)
}

/// Rewrites the cells of measured.csv below its header, given where their row begins.
pub fn rewritten(folder: TempDir, mut change: impl FnMut(&mut [String])) -> TempDir {
    let path = folder.path().join("measured.csv");
    let text = fs::read_to_string(&path).expect("a file");
    let (header, rows) = text.split_once('\n').expect("a header");
    let mut changed = header.to_owned();
    for row in rows.lines() {
        let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
        change(&mut cells);
        changed += &format!("\n{}", cells.join(","));
    }
    fs::write(&path, changed + "\n").expect("a file");
    folder
}
