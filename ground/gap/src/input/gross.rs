//! What is grossly wrong with a table before any physics: commands that contradict the data, plugs and polarities.
//!
//! In: the positions of a table and the nominal channels. Out: [`Gross`], with commands and axes put right in place.
//!
//! A physical effect of a percent cannot be seen behind a sign; so the sign comes first, and from all rows: that a
//! command is not what was done is a finding about the command, and the fit of effects still reads only its own rows.
//! Rows are judged by consensus ([`bench::consensus`]), channels by how found axes compare with nominal ones
//! ([`bench::wiring`]). A row that no exchange of axes or signs explains is left out.

use bench::{
    consensus::{Claim, Reading, contradictions},
    response::{Observation, Orders, Response},
    wiring::{surely_inverted, wirings},
};
use nalgebra::Vector3;
use twin::predict::{Channel, Kind};

use crate::input::case::Position;

/// A command that is not what was done.
#[derive(Clone, Debug, PartialEq)]
pub struct Contradicted {
    /// Number of the position.
    pub seq: f64,
    /// How it must be read; `None` where no reading agrees and the row is left out.
    pub reading: Option<Reading>,
}

/// A channel's steadiness between positions of the same command.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeat {
    /// Its index in the unit.
    pub channel: usize,
    /// \[1\] largest relative change of its answer between two repeats of a command.
    pub change: f64,
}

/// Everything gross that was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gross {
    /// Commands that contradict the data.
    pub contradicted: Vec<Contradicted>,
    /// Sets of positions that could be blamed instead, equally well.
    pub otherwise: Vec<Vec<f64>>,
    /// Channels whose output is inverted in every simplest reading of the wiring.
    pub inverted: Vec<usize>,
    /// The simplest reading of wiring and frame, in words; empty where all is as drawn.
    pub wiring: String,
    /// Wirings that fit as well as that one.
    pub as_good: usize,
    /// Steadiness of every channel that repeats a command.
    pub repeats: Vec<Repeat>,
}

impl Gross {
    /// Whether anything was put right.
    pub fn is_none(&self) -> bool {
        self.contradicted.is_empty() && self.wiring.is_empty()
    }
}

/// Looks, and puts commands and axes right. Channels that read differently are never taken for another kind of sensor.
pub fn put_right(positions: &mut Vec<Position>, channels: &mut [Channel]) -> Gross {
    let mut gross = Gross::default();
    for sensor in [Kind::Gyro, Kind::Accelerometer] {
        let own: Vec<usize> = (0..channels.len())
            .filter(|index| channels[*index].sensor == sensor)
            .collect();
        if !own.is_empty() {
            commands(positions, sensor, &own, &mut gross);
            plugs(positions, sensor, &own, channels, &mut gross);
            gross
                .repeats
                .extend(own.iter().filter_map(|channel| repeat(positions, sensor, *channel)));
        }
    }
    gross
}

fn excitation_b(position: &Position, sensor: Kind) -> Vector3<f64> {
    match sensor {
        Kind::Accelerometer => position.force_b,
        _ => position.rate_b,
    }
}

fn commands(positions: &mut Vec<Position>, sensor: Kind, own: &[usize], gross: &mut Gross) {
    let whole: Vec<usize> = (0..positions.len())
        .filter(|row| own.iter().all(|channel| positions[*row].values[*channel].is_some()))
        .collect();
    let claims: Vec<Claim> = whole
        .iter()
        .map(|row| Claim {
            excitation_b: excitation_b(&positions[*row], sensor),
            values: own
                .iter()
                .filter_map(|channel| positions[*row].values[*channel])
                .collect(),
        })
        .collect();
    let found = contradictions(&claims);
    let seq = |row: &usize| positions[whole[*row]].seq;
    gross
        .otherwise
        .extend(found.alternatives.iter().map(|rows| rows.iter().map(seq).collect()));
    let mut without = Vec::new();
    for one in found.contradictions {
        let row = whole[one.row];
        let position = &mut positions[row];
        gross.contradicted.push(Contradicted {
            seq: position.seq,
            reading: one.reading,
        });
        match (one.reading, sensor) {
            (Some(reading), Kind::Accelerometer) => position.force_b = reading.of(&position.force_b),
            (Some(reading), _) => position.rate_b = reading.of(&position.rate_b),
            (None, _) => without.push(position.seq),
        }
    }
    positions.retain(|position| !without.contains(&position.seq));
}

fn plugs(positions: &[Position], sensor: Kind, own: &[usize], channels: &mut [Channel], gross: &mut Gross) {
    let found = own.iter().map(|channel| {
        let observation = |position: &Position| {
            Some(Observation {
                excitation_b: excitation_b(position, sensor),
                temperature_c: 0.0,
                value: position.values[*channel]?,
            })
        };
        let observations: Vec<Observation> = positions.iter().filter_map(observation).collect();
        Response::fit(&observations, Orders::default()).map(|response| response.axis_b())
    });
    // Positions that leave an axis open tell nothing about plugs.
    let Ok(found_b) = found.collect::<Result<Vec<Vector3<f64>>, _>>() else {
        return;
    };
    let nominal_b: Vec<Vector3<f64>> = own.iter().map(|channel| channels[*channel].axis_b).collect();
    let list = wirings(&found_b, &nominal_b);
    let Some(simplest) = list.first().filter(|wiring| !wiring.honest()) else {
        return;
    };
    let names: Vec<String> = own.iter().map(|channel| channels[*channel].name.clone()).collect();
    gross
        .inverted
        .extend(surely_inverted(&list).into_iter().map(|k| own[k]));
    gross.wiring = simplest.words(&names);
    gross.as_good = list.len() - 1;
    for (k, channel) in own.iter().enumerate() {
        let sign = if simplest.inverted[k] { -1.0 } else { 1.0 };
        channels[*channel].axis_b = simplest.frame.of(&nominal_b[simplest.axis[k]]) * sign;
    }
}

/// Antagonist pairs of the same command, compared: half their difference is free of bias and Earth rate.
fn repeat(positions: &[Position], sensor: Kind, channel: usize) -> Option<Repeat> {
    /// Commands nearer than this share are one and the same.
    const SAME: f64 = 1e-3;
    let mut halves: Vec<(Vector3<f64>, f64)> = Vec::new();
    let mut change: Option<f64> = None;
    let mut free: Vec<&Position> = positions.iter().collect();
    while !free.is_empty() {
        let first = free.remove(0);
        let x = excitation_b(first, sensor);
        let opposite = |other: &&Position| (x + excitation_b(other, sensor)).norm() < SAME * x.norm();
        let Some(second) = free.iter().position(opposite).map(|at| free.remove(at)) else {
            continue;
        };
        let (Some(one), Some(other)) = (first.values[channel], second.values[channel]) else {
            continue;
        };
        let half = 0.5 * (one - other);
        for (before_b, before) in &halves {
            let sign = if (x - before_b).norm() < SAME * x.norm() {
                1.0
            } else if (x + before_b).norm() < SAME * x.norm() {
                -1.0
            } else {
                continue;
            };
            // Across its axis a channel answers with little, and the quotient of that is noise.
            if before.abs() > 0.1 * x.norm() {
                let this = (sign * half / before - 1.0).abs();
                change = Some(change.unwrap_or(0.0).max(this));
            }
        }
        halves.push((x, half));
    }
    change.map(|change| Repeat { channel, change })
}
