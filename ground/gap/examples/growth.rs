//! How time and memory of a diagnosis grow with the length of the log.
//!
//! In: minutes, several. Makes for each a healthy unit's log, tumbling, at 5 Hz in 36 channels with its motion at 50 Hz, and
//! diagnoses it with the whole library. Out, one line a length: seconds to read the case, seconds to diagnose it, and the
//! most memory the process has had so far (Linux only), which is why lengths should rise.
//!
//! ```sh
//! cargo run --ignore-rust-version --target host-tuple -p emems-gap --example growth 10 60 300
//! ```

use std::{error::Error, fmt::Write, fs, time::Instant};

use gap::{diagnose::diagnose, input::case::Subject};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use twin::{
    environment::Environment,
    motion::{Motion, Tumble},
    predict::{Scene, Twin, emems},
};

/// \[s\] a cycle of the unit, and a row of its motion.
const CYCLE_S: f64 = 0.2;
const STEP_S: f64 = 0.02;

fn main() -> Result<(), Box<dyn Error>> {
    println!("| log | rows kept | read [s] | diagnose [s] | most memory [MiB] |\n|---|---:|---:|---:|---:|");
    for minutes in std::env::args().skip(1) {
        let minutes: f64 = minutes.parse()?;
        let folder = tempfile::tempdir()?;
        write(folder.path(), 60.0 * minutes)?;
        let start = Instant::now();
        let subject = Subject::open(folder.path())?;
        let read_s = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let diagnosis = diagnose(&subject, &[], &|_, _| ());
        let diagnose_s = start.elapsed().as_secs_f64();
        let rows = subject.twin.starts_s().len();
        println!(
            "| {minutes} min | {rows} | {read_s:.1} | {diagnose_s:.1} | {} |",
            most_memory_mib().map_or("unknown".to_owned(), |mib| format!("{mib:.0}"))
        );
        if !diagnosis.causes.is_empty() {
            println!("{:?}", diagnosis.causes);
        }
    }
    Ok(())
}

fn write(folder: &std::path::Path, seconds: f64) -> Result<(), Box<dyn Error>> {
    let unit = emems(|_| 0.0);
    let environment = Environment::laboratory();
    let motion = Tumble::new();
    let scene = Scene::new(&motion, &environment, 0.0, seconds, STEP_S);
    let starts_s: Vec<f64> = (0..(seconds / CYCLE_S) as usize)
        .map(|row| row as f64 * CYCLE_S)
        .collect();
    let twin = Twin::new(unit.clone(), environment, scene, starts_s)?;
    let readings = twin.predict(&[]);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(4);
    let mut text = "t_s".to_owned();
    for channel in &unit.channels {
        write!(text, ",{}", channel.name)?;
    }
    for (row, start_s) in twin.starts_s().iter().enumerate() {
        write!(text, "\n{start_s:.1}")?;
        for (channel, readings) in unit.channels.iter().zip(&readings) {
            let noise: f64 = StandardNormal.sample(&mut random);
            write!(
                text,
                ",{:.6}",
                channel.logged(readings[row] + channel.noise_sigma * noise)
            )?;
        }
    }
    fs::write(folder.join("measured.csv"), text)?;
    let mut text = "t_s,qw,qx,qy,qz".to_owned();
    for row in 0..=(seconds / STEP_S) as usize {
        let t_s = row as f64 * STEP_S;
        let q = motion.at(t_s).attitude.q_nb;
        write!(text, "\n{t_s:.2},{:.9},{:.9},{:.9},{:.9}", q.w, q.i, q.j, q.k)?;
    }
    fs::write(folder.join("motion.csv"), text)?;
    fs::write(folder.join("unit.toml"), unit.text())?;
    let [x, y, z] = environment.field_n_ut.into();
    let half = seconds / 2.0;
    fs::write(
        folder.join("case.toml"),
        format!(
            "format = \"gap-case/1\"\nname = \"growth\"\nkind = \"csv\"\nunit = \"unit.toml\"\nmeasured = \"measured.csv\"\n\
             motion = \"motion.csv\"\n[environment]\ngravity_m_s2 = {}\nlatitude_deg = {}\nfield_n_ut = [{x}, {y}, {z}]\n\
             [windows]\nfit = [[0.0, {half}]]\nhold = [[{half}, {seconds}]]\n",
            environment.gravity,
            environment.latitude.to_degrees()
        ),
    )?;
    Ok(())
}

fn most_memory_mib() -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}
