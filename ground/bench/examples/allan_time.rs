//! How long four deviations at octave averaging times take, beside allantools in the same run.
//!
//! `cargo run --ignore-rust-version --target host-tuple -p emems-bench --example allan_time [POINTS...]` prints a line for each
//! length: the least of five runs, threads started. With `PYTHON` set to an interpreter that has allantools (see
//! `peers/allan.py`), its time and the largest relative difference of any deviation stand beside.

use std::{
    env,
    error::Error,
    fs,
    process::Command,
    time::{Duration, Instant},
};

use bench::allan::{
    deviation::{Deviation, octaves, sweep},
    phase::{Input, Phase},
    series::Series,
};

const RUNS: usize = 5;
/// The four that allantools is timed with.
const FOUR: [Deviation; 4] = [Deviation::Oadev, Deviation::Mdev, Deviation::Tdev, Deviation::Hdev];

fn main() -> Result<(), Box<dyn Error>> {
    let given: Vec<usize> = env::args().skip(1).map(|text| text.parse()).collect::<Result<_, _>>()?;
    let lengths = if given.is_empty() {
        vec![145_312, 10_000_000]
    } else {
        given
    };
    for length in lengths {
        let series = Series::complete(0.05, rates(length))?;
        let mut least = Duration::MAX;
        let mut points = Vec::new();
        for _ in 0..RUNS {
            let start = Instant::now();
            let phase = Phase::new(&series, Input::Rate);
            points = sweep(&phase, &octaves(&phase), |_| ());
            least = least.min(start.elapsed());
        }
        println!("{length} points: {:.2} ms here", 1e3 * least.as_secs_f64());
        let Ok(python) = env::var("PYTHON") else { continue };
        let file = env::temp_dir().join(format!("allan-{}.f64", std::process::id()));
        fs::write(
            &file,
            series
                .values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect::<Vec<u8>>(),
        )?;
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../peers/allan.py");
        let output = Command::new(python).arg(script).arg(&file).arg("20").output();
        fs::remove_file(&file)?;
        let text = String::from_utf8(output?.stdout)?;
        let Some(peer_s) = text
            .lines()
            .find_map(|line| line.strip_prefix("seconds ")?.parse::<f64>().ok())
        else {
            println!(
                "  no allantools: {}",
                text.lines().next().unwrap_or("the script said nothing")
            );
            continue;
        };
        let mut worst = 0.0_f64;
        let mut compared = 0;
        for line in text.lines().filter(|line| !line.starts_with("seconds")) {
            let cells: Vec<&str> = line.split(' ').collect();
            let (Some(deviation), Some(point)) = (
                FOUR.into_iter().find(|deviation| deviation.name() == cells[0]),
                points.iter().find(|point| cells[1].parse() == Ok(point.factor)),
            ) else {
                continue;
            };
            if let (Some(value), Ok(peer)) = (point.value(deviation), cells[2].parse::<f64>()) {
                worst = worst.max((value / peer - 1.0).abs());
                compared += 1;
            }
        }
        println!(
            "  {:.2} ms in allantools, {:.0} times as long; largest of {compared} relative differences {worst:.1e}",
            1e3 * peer_s,
            peer_s / least.as_secs_f64()
        );
    }
    Ok(())
}

/// Rates of all kinds of noise at once, quick to make: xorshift, white and summed.
fn rates(length: usize) -> Vec<f64> {
    let (mut state, mut walk) = (0x9E37_79B9_7F4A_7C15_u64, 0.0);
    let mut draw = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state as f64 / u64::MAX as f64 - 0.5
    };
    (0..length)
        .map(|_| {
            walk += 1e-3 * draw();
            3.0 + walk + draw()
        })
        .collect()
}
