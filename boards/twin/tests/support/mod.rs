//! What the tests of the twin share: the practice cases, and a least-squares fit of an effect beside the calibration.
#![allow(dead_code)]

use std::io::Read;
use std::path::{Path, PathBuf};

use emems::packet;
use emems::sample::Reading;
use nalgebra::{DMatrix, DVector};
use twin::effect::Active;
use twin::environment::Environment;
use twin::motion::Recorded;
use twin::predict::{Column, Scene, Twin, UnitDescription};
use twin::recording::Table;

/// A file of the cases: in `data/`, or where `EMEMS_DATA` says that the whole set lies.
pub fn file(name: &str) -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data").join(name);
    match std::env::var_os("EMEMS_DATA") {
        Some(whole) if !own.exists() => Path::new(&whole).join(name),
        _ => own,
    }
}

/// A log of packets with its twin.
pub struct Case {
    pub twin: Twin,
    /// Readings of each channel [physical unit]; NaN where there is none.
    pub measured: Vec<Vec<f64>>,
}

/// One `[case]`: its folder, motion and field; all the rest is the same in all of them.
pub fn case(name: &str, motion: &str, field_n_ut: [f64; 3]) -> Case {
    let unit = UnitDescription::open(&file("unit-emems.toml")).unwrap();
    let motion = Recorded::open(&file(&format!("motion/{motion}.csv.gz"))).unwrap();
    let environment = Environment {
        gravity: 9.7864,
        latitude: (-23.2111_f64).to_radians(),
        field_n_ut: field_n_ut.into(),
        temperature_c: 25.0,
    };
    let (from_s, to_s) = motion.span_s();
    let scene = Scene::new(&motion, &environment, from_s, to_s, motion.step_s());
    let (counters, measured) = packets(&file(&format!("practice/{name}/measured.txt.gz")), &unit);
    let starts_s = counters.iter().map(|&k| 0.2 * f64::from(k)).collect();
    Case {
        twin: Twin::new(unit, environment, scene, starts_s).unwrap(),
        measured,
    }
}

/// A log of a nine-axis unit with its optical reference smoothed at these corners \[Hz\], of attitude and position; samples the
/// reference did not see are left out.
pub fn optical(name: &str, gravity: f64, field_n_ut: [f64; 3], corners_hz: Option<[f64; 2]>) -> Case {
    let folder = file(&format!("practice/{name}"));
    let unit = UnitDescription::open(&folder.join("unit.toml")).unwrap();
    let recorded = Recorded::open(&folder.join("motion.csv.gz")).unwrap();
    let motion = corners_hz.map_or(recorded.clone(), |[attitude, position]| {
        recorded.smoothed(attitude, position)
    });
    let environment = Environment {
        gravity,
        latitude: 52.51_f64.to_radians(),
        field_n_ut: field_n_ut.into(),
        temperature_c: 25.0,
    };
    let names: Vec<&str> = unit.channels.iter().map(|channel| channel.name.as_str()).collect();
    let table = Table::open(&folder.join("measured.csv.gz"), &names).unwrap();
    let starts_s: Vec<f64> = table.series([names[0]]).unwrap().series.t_s().to_vec();
    // Half a second beside a gap the spline still bends towards it.
    let lost = [(f64::MIN, recorded.span_s().0), (recorded.span_s().1, f64::MAX)]
        .into_iter()
        .chain(recorded.lost_s());
    let lost: Vec<(f64, f64)> = lost.map(|(from_s, to_s)| (from_s - 0.5, to_s + 0.5)).collect();
    let seen = |t_s: f64| !lost.iter().any(|(from_s, to_s)| *from_s < t_s && t_s < *to_s);
    let channel = |name: &&str| {
        let series = table.series([*name]).unwrap().series;
        starts_s
            .iter()
            .map(|t_s| if seen(*t_s) { series.linear(*t_s).x } else { f64::NAN })
            .collect()
    };
    let measured = names.iter().map(channel).collect();
    let (from_s, to_s) = motion.span_s();
    let scene = Scene::new(&motion, &environment, from_s, to_s, motion.step_s());
    Case {
        twin: Twin::new(unit, environment, scene, starts_s).unwrap(),
        measured,
    }
}

fn packets(path: &Path, unit: &UnitDescription) -> (Vec<u16>, Vec<Vec<f64>>) {
    let mut text = Vec::new();
    flate2::read::MultiGzDecoder::new(std::fs::File::open(path).unwrap())
        .read_to_end(&mut text)
        .unwrap();
    let mut counters = Vec::new();
    let mut measured = vec![Vec::new(); unit.channels.len()];
    for line in text.split(|&byte| byte == b'\n') {
        let Ok(reading) = packet::decode(line) else { continue };
        counters.push(reading.counter);
        for ((counts, channel), series) in counts(&reading).into_iter().zip(&unit.channels).zip(&mut measured) {
            let read = counts != i16::MIN && !(channel.name.starts_with('m') && counts == -4096);
            series.push(if read {
                f64::from(counts) * channel.lsb
            } else {
                f64::NAN
            });
        }
    }
    (counters, measured)
}

/// In the order of the channels of the unit.
fn counts(reading: &Reading) -> Vec<i16> {
    let vectors = reading.acc_p.iter().chain(&reading.mag_p).flatten();
    let scalars = reading
        .gyro
        .iter()
        .chain(&reading.gyro_temperature)
        .chain(&reading.temperature);
    vectors.chain(scalars).copied().collect()
}

/// What a fit found.
pub struct Fit {
    /// The effects' parameters, with their standard deviations.
    pub theta: Vec<Vec<f64>>,
    pub sigma: Vec<f64>,
    /// Root mean square of the standardised residual of the channels looked at, before and after.
    pub before: f64,
    pub after: f64,
    /// What the fit makes of each of these channels' samples; NaN where there is none.
    pub explained: Vec<Vec<f64>>,
}

/// Gauss-Newton from zero on the effects and the calibration of these channels, each held by its prior.
pub fn fit(case: &Case, active: &[Active], channels: &[usize]) -> Fit {
    let twin = &case.twin;
    let mut active = active.to_vec();
    let calibration: Vec<Column> = channels.iter().flat_map(|&channel| twin.calibration(channel)).collect();
    let mut psi = DVector::zeros(calibration.len());
    let (mut before, mut after, mut sigma, mut explained) = (0.0, 0.0, Vec::new(), Vec::new());
    for step in 0..3 {
        let own: Vec<Column> = (0..active.len()).flat_map(|of| twin.jacobian(&active, of)).collect();
        let columns: Vec<&Column> = calibration.iter().chain(&own).collect();
        let now: Vec<f64> = psi
            .iter()
            .copied()
            .chain(active.iter().flat_map(|a| a.theta.clone()))
            .collect();
        let (mut normal, mut score) = (
            DMatrix::zeros(columns.len(), columns.len()),
            DVector::zeros(columns.len()),
        );
        let (mut energy, mut count) = (0.0, 0.0);
        explained.clear();
        for &channel in channels {
            let weight = 1.0 / twin.unit().channels[channel].sigma();
            let mut residual = twin.channel(channel, &active).into_owned();
            for (residual, measured) in residual.iter_mut().zip(&case.measured[channel]) {
                *residual = measured - *residual;
            }
            let touching: Vec<(usize, &[f64])> = columns
                .iter()
                .enumerate()
                .filter_map(|(i, column)| Some((i, column.entries.iter().find(|(c, _)| *c == channel)?.1.as_slice())))
                .collect();
            for &(i, values) in touching.iter().filter(|(i, _)| *i < psi.len()) {
                for (residual, value) in residual.iter_mut().zip(values) {
                    *residual -= psi[i] * value;
                }
            }
            let pairs = case.measured[channel].iter().zip(&residual);
            explained.push(pairs.map(|(measured, residual)| measured - residual).collect());
            let present: Vec<usize> = (0..residual.len()).filter(|&k| residual[k].is_finite()).collect();
            energy += present.iter().map(|&k| (residual[k] * weight).powi(2)).sum::<f64>();
            count += present.len() as f64;
            for &(i, a) in &touching {
                score[i] += present.iter().map(|&k| a[k] * residual[k]).sum::<f64>() * weight * weight;
                for &(j, b) in &touching {
                    normal[(i, j)] += present.iter().map(|&k| a[k] * b[k]).sum::<f64>() * weight * weight;
                }
            }
        }
        if step == 0 {
            before = (energy / count).sqrt();
        }
        after = (energy / count).sqrt();
        for (i, column) in columns.iter().enumerate() {
            normal[(i, i)] += column.sigma.powi(-2);
            score[i] -= now[i] * column.sigma.powi(-2);
        }
        let covariance: DMatrix<f64> = normal.try_inverse().unwrap();
        let moved: DVector<f64> = &covariance * score;
        psi += moved.rows(0, psi.len());
        let open = psi.len();
        sigma = (open..columns.len()).map(|i| covariance[(i, i)].sqrt()).collect();
        for (theta, moved) in active
            .iter_mut()
            .flat_map(|a| &mut a.theta)
            .zip(moved.iter().skip(open))
        {
            *theta += moved;
        }
    }
    Fit {
        theta: active.into_iter().map(|a| a.theta).collect(),
        sigma,
        before,
        after,
        explained,
    }
}
