//! Phases as they are found, by force and rate alone: means over [`BIN_S`].
//!
//! | phase | while |
//! |---|---|
//! | rest, landed | nothing changes ([`crate::parity::smooth::rests`]), before and after a flight |
//! | thrust | from a force beyond twice gravity for a second on, 20 m/s of velocity, which no hand gives; until less than half of gravity is left along it. A stage may push again |
//! | coast | from then on |
//! | entry | from where, after the least force of the coast, it is beyond half of gravity |
//! | parachute | from where it is never again beyond 1.6 times gravity, if ten seconds and more are left |
//! | spin | a rate beyond a turn a second, or gyros at their stops, for two seconds, in flight |
//!
//! A log without a second of such a force has no flight.

use nalgebra::{DMatrix, DVector, Vector3};
use twin::{
    environment::Environment,
    predict::{Kind, UnitDescription},
};

use crate::{
    input::log::Log,
    parity::{
        phases::{Phase, Stretch},
        smooth::rests::rests,
    },
};

/// \[s\] over which force and rate are averaged: a body's shaking is not seen, a burn-out is.
pub const BIN_S: f64 = 0.5;

/// Times gravity, and bins for which it lasts.
const LAUNCH: f64 = 2.0;
const LAUNCH_BINS: usize = 2;

/// \[s\] after a burn within which another stage may push: what pushes later is air.
const STAGE_S: f64 = 60.0;

/// Times gravity that tells a push, or air that holds a body that falls, from none.
const HELD: f64 = 0.5;

/// \[s\] for which a parachute hangs at least, and times gravity that nothing pulls beyond meanwhile.
const PARACHUTE_S: f64 = 10.0;
const PARACHUTE: f64 = 1.6;

/// [rad/s] a turn a second, and bins for which it lasts.
const SPIN: f64 = std::f64::consts::TAU;
const SPIN_BINS: usize = 4;

/// Force and rate of a bin that begins then.
struct Bin {
    from_s: f64,
    force_b: Vector3<f64>,
    rate: f64,
}

/// As they are found.
pub fn found(log: &Log, unit: &UnitDescription, environment: &Environment) -> Vec<Stretch> {
    let bins = bins(log, unit);
    let rests = rests(log, unit, environment);
    let burns = burns(&bins, environment.gravity);
    let (Some((launch, _)), Some((_, burnt))) = (burns.first(), burns.last()) else {
        let rest = |(from_s, to_s): &(f64, f64)| Stretch {
            phase: Phase::Rest,
            from_s: *from_s,
            to_s: *to_s,
        };
        return rests.iter().map(rest).collect();
    };
    let end_s = bins[bins.len() - 1].from_s + BIN_S;
    let begin_of = |at: usize| bins.get(at).map_or(end_s, |bin| bin.from_s);
    let mut touched = rests.iter().map(|(from_s, _)| *from_s);
    let landed_s = touched.find(|from_s| *from_s > begin_of(*burnt)).unwrap_or(end_s);
    let falls = &bins[*burnt..bins.partition_point(|bin| bin.from_s < landed_s)];
    let (held_s, hung_s) = descent(falls, environment.gravity, landed_s);
    let mut all: Vec<Stretch> = Vec::new();
    let mut put = |phase: Phase, from_s: f64, to_s: f64| {
        if to_s > from_s {
            all.push(Stretch { phase, from_s, to_s });
        }
    };
    for (from_s, to_s) in &rests {
        put(Phase::Rest, *from_s, to_s.min(begin_of(*launch)));
    }
    for (at, (lit, burnt)) in burns.iter().enumerate() {
        put(Phase::Thrust, begin_of(*lit), begin_of(*burnt));
        let until_s = burns.get(at + 1).map_or(held_s, |(lit, _)| begin_of(*lit));
        put(Phase::Coast, begin_of(*burnt), until_s);
    }
    put(Phase::Entry, held_s, hung_s);
    put(Phase::Parachute, hung_s, landed_s);
    put(Phase::Landed, landed_s, end_s);
    let flown = &bins[..bins.partition_point(|bin| bin.from_s < landed_s)];
    let mut at = *launch;
    while at < flown.len() {
        let run = flown[at..].iter().take_while(|bin| bin.rate > SPIN).count();
        if run >= SPIN_BINS {
            put(Phase::Spin, begin_of(at), begin_of(at + run));
        }
        at += run.max(1);
    }
    all
}

/// Bins from and to which a motor pushes; none of a log without a flight.
fn burns(bins: &[Bin], gravity: f64) -> Vec<(usize, usize)> {
    let mut burns = Vec::new();
    let is_pushed = |own: &[Bin]| gravity > 0.0 && own.iter().all(|bin| bin.force_b.norm() > LAUNCH * gravity);
    let mut next = bins.windows(LAUNCH_BINS).position(is_pushed);
    while let Some(lit) = next {
        let pushes: Vector3<f64> = bins[lit..lit + LAUNCH_BINS].iter().map(|bin| bin.force_b).sum();
        let along = |bin: &Bin| bin.force_b.dot(&pushes) / pushes.norm();
        let lasts = bins[lit..].iter().take_while(|bin| along(bin) > HELD * gravity).count();
        let burnt = lit + lasts;
        burns.push((lit, burnt));
        let later = bins[burnt..]
            .iter()
            .take_while(|bin| bin.from_s < bins[burnt - 1].from_s + STAGE_S);
        let stage = &bins[burnt..burnt + later.count()];
        let is_lit = |own: &[Bin]| own.iter().all(|bin| along(bin) > LAUNCH * gravity);
        next = stage.windows(LAUNCH_BINS).position(is_lit).map(|at| burnt + at);
    }
    burns
}

/// \[s\] from when the air holds a fall, and from when it hangs on a parachute, both the end where it does not.
fn descent(falls: &[Bin], gravity: f64, landed_s: f64) -> (f64, f64) {
    let force = |bin: &Bin| bin.force_b.norm();
    let least = (0..falls.len()).min_by(|one, other| force(&falls[*one]).total_cmp(&force(&falls[*other])));
    let held = least.and_then(|least| (least..falls.len()).find(|at| force(&falls[*at]) > HELD * gravity));
    let Some(held) = held else {
        return (landed_s, landed_s);
    };
    let pulls = (held..falls.len())
        .rev()
        .find(|at| force(&falls[*at]) > PARACHUTE * gravity);
    let hung_s = match pulls {
        Some(last) => falls[last].from_s + BIN_S,
        None => falls[held].from_s,
    };
    let is_long = landed_s - hung_s >= PARACHUTE_S;
    (falls[held].from_s, if is_long { hung_s } else { landed_s })
}

/// Means of all accelerometers and of all gyros.
fn bins(log: &Log, unit: &UnitDescription) -> Vec<Bin> {
    let (Some(first_s), Some(last_s)) = (log.start_s.first(), log.start_s.last()) else {
        return Vec::new();
    };
    let count = ((last_s - first_s) / BIN_S).floor() as usize;
    let mean = |kind: Kind, from: u32, to: u32| -> Option<Vector3<f64>> {
        let all = unit
            .channels
            .iter()
            .zip(&log.channels)
            .filter(|(channel, _)| channel.sensor == kind);
        let read = all.filter_map(|(channel, series)| {
            let rows = series.rows.partition_point(|row| *row < from)..series.rows.partition_point(|row| *row < to);
            let values = &series.values[rows];
            let mean = values.iter().sum::<f64>() / values.len() as f64 - channel.bias;
            (!values.is_empty()).then_some((channel.axis_b, mean))
        });
        let (axes, means): (Vec<Vector3<f64>>, Vec<f64>) = read.unzip();
        let axes = DMatrix::from_fn(axes.len(), 3, |row, column| axes[row][column]);
        let solved = (axes.tr_mul(&axes))
            .cholesky()?
            .solve(&axes.tr_mul(&DVector::from_vec(means)));
        Some(Vector3::new(solved[0], solved[1], solved[2]))
    };
    let has_gyros = unit.channels.iter().any(|channel| channel.sensor == Kind::Gyro);
    let bin = |at: usize| {
        let from_s = first_s + at as f64 * BIN_S;
        let from = log.start_s.partition_point(|own| *own < from_s) as u32;
        let to = log.start_s.partition_point(|own| *own < from_s + BIN_S) as u32;
        Some(Bin {
            from_s,
            force_b: mean(Kind::Accelerometer, from, to)?,
            // Gyros that have no sample left stand at their stops.
            rate: mean(Kind::Gyro, from, to).map_or(if has_gyros { f64::INFINITY } else { 0.0 }, |rate| rate.norm()),
        })
    };
    (0..count).filter_map(bin).collect()
}
