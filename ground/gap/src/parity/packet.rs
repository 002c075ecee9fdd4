//! The motion of each packet, eliminated: what a column or a residual keeps that no motion makes.
//!
//! In: the twin along the smoothed motion, the fit windows in units of noise, and how far the derivatives of the motion may be
//! off. Out: [`Motion`], which takes from every packet's samples what its [`UNKNOWNS`] can imitate.
//!
//! With `dt` from the middle of the packet's slots, `w`, `f` and `m` the smoothed rate, force and field at the sample,
//!
//! ```text
//! gyro    a.(dw + dt dw')
//! accel   a.(df + dt (-w x df - dw x f + j) + dw' x r + (dw + dt dw') x (w x r) + w x ((dw + dt dw') x r))
//! mag     a.(dm + dt (-w x dm - dw x m))
//! therm.  dT
//! ```
//!
//! `dw`, `df`, `dm`, `dT` are free; `dw'` and the jerk `j` have prior rows. `[A; P]` is factored by QR with column pivoting,
//! and columns that nothing sees are left out of it, so that a packet with lost samples eliminates no more than it must.

use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;
use twin::predict::{Feel, Kind};

use crate::{
    library::column::Entries,
    null::problem::Problem,
    parity::{course::Course, space::Elimination},
};

/// Rate, its derivative, force, jerk, field, temperature.
pub const UNKNOWNS: usize = 16;

/// Of the largest column: below it a column says the same as others.
const RANK: f64 = 1e-9;

/// Packets whose parts are taken from all channels before those of others: what a processor's cache holds of a hundred columns.
const TOGETHER: usize = 32;

/// Per channel and sample, the row of `Q` that belongs to it.
pub struct Motion {
    /// Packets there are.
    packets: usize,
    /// Channel by channel, the packet of each sample.
    packet: Vec<Vec<usize>>,
    /// Channel by channel, [`UNKNOWNS`] numbers a sample.
    rows: Vec<Vec<f64>>,
}

impl Motion {
    /// Of a problem whose twin goes along this course.
    pub fn of(problem: &Problem, course: &Course) -> Self {
        let channels = &problem.twin.unit().channels;
        let packets = problem.twin.starts_s().len();
        let middle_s = middle_s(problem);
        let feels: Vec<Vec<Feel>> = (0..channels.len()).map(|channel| problem.twin.feels(channel)).collect();
        let mut members: Vec<Vec<(usize, usize)>> = vec![Vec::new(); packets];
        for (channel, frame) in problem.frames.iter().enumerate() {
            for (sample, row) in frame.series.rows.iter().enumerate() {
                members[*row as usize].push((channel, sample));
            }
        }
        let mut motion = Self {
            packets,
            packet: problem
                .frames
                .iter()
                .map(|frame| frame.series.rows.iter().map(|row| *row as usize).collect())
                .collect(),
            rows: problem
                .frames
                .iter()
                .map(|frame| vec![0.0; UNKNOWNS * frame.series.rows.len()])
                .collect(),
        };
        for (packet, members) in members.iter().enumerate() {
            let mut stacked = DMatrix::zeros(members.len() + 6, UNKNOWNS);
            for (at, (channel, sample)) in members.iter().enumerate() {
                let own = &channels[*channel];
                let seen_s = own.slot_s - own.tau_s() - middle_s;
                let slopes = slopes(own.sensor, own.axis_b, own.lever_m, &feels[*channel][packet], seen_s);
                let weight = problem.frames[*channel].weights[*sample];
                slopes
                    .iter()
                    .enumerate()
                    .for_each(|(unknown, slope)| stacked[(at, unknown)] = slope / weight);
            }
            for axis in 0..3 {
                stacked[(members.len() + axis, 3 + axis)] = 1.0 / course.rate_dot_sigmas[packet];
                stacked[(members.len() + 3 + axis, 9 + axis)] = 1.0 / course.jerk_sigmas[packet];
            }
            let (q, rank) = basis(stacked);
            for (at, (channel, sample)) in members.iter().enumerate() {
                let row = &mut motion.rows[*channel][UNKNOWNS * sample..UNKNOWNS * (sample + 1)];
                (0..rank).for_each(|unknown| row[unknown] = q[(at, unknown)]);
            }
        }
        motion
    }
}

impl Elimination for Motion {
    /// `Q'[u; 0]`, packet by packet.
    fn parts(&self, columns: &[&Entries]) -> DMatrix<f64> {
        let mut parts = DMatrix::zeros(UNKNOWNS * self.packets, columns.len());
        if self.packets == 0 {
            return parts;
        }
        let of_columns = parts.as_mut_slice().par_chunks_mut(UNKNOWNS * self.packets);
        of_columns.zip(columns).for_each(|(part, column)| {
            let (own, _) = part.as_chunks_mut::<UNKNOWNS>();
            for (channel, values) in *column {
                let rows = self.rows[*channel].as_chunks::<UNKNOWNS>().0;
                for ((packet, row), value) in self.packet[*channel].iter().zip(rows).zip(values.iter()) {
                    own[*packet].iter_mut().zip(row).for_each(|(sum, q)| *sum += q * value);
                }
            }
        });
        parts
    }

    fn take(&self, parts: &DMatrix<f64>, from: &mut [DMatrix<f64>]) {
        for first in (0..self.packets).step_by(TOGETHER) {
            let channels = self.packet.par_iter().zip(&self.rows).zip(&mut *from);
            channels.for_each(|((packets, rows), from)| {
                let before = |packet: usize| packets.partition_point(|own| *own < packet);
                let samples = before(first)..before(first + TOGETHER);
                let rows = &rows.as_chunks::<UNKNOWNS>().0[samples.clone()];
                let packets = &packets[samples.clone()];
                for (mut from, part) in from.column_iter_mut().zip(parts.column_iter()) {
                    let own = part.as_slice().as_chunks::<UNKNOWNS>().0;
                    let values = &mut from.as_mut_slice()[samples.clone()];
                    for ((value, packet), row) in values.iter_mut().zip(packets).zip(rows) {
                        *value -= dot(&own[*packet], row);
                    }
                }
            });
        }
    }

    fn free(&self, channel: usize) -> f64 {
        let taken: f64 = self.rows[channel].iter().map(|q| q * q).sum();
        self.packet[channel].len() as f64 - taken
    }
}

/// In four sums, of which none waits for the one before.
fn dot(part: &[f64; UNKNOWNS], row: &[f64; UNKNOWNS]) -> f64 {
    let mut sums = [0.0; 4];
    for (parts, row) in part.as_chunks::<4>().0.iter().zip(row.as_chunks::<4>().0) {
        (0..4).for_each(|at| sums[at] += parts[at] * row[at]);
    }
    sums.iter().sum()
}

/// An orthonormal basis of the columns, in the first so many columns of what is returned.
fn basis(stacked: DMatrix<f64>) -> (DMatrix<f64>, usize) {
    let factored = stacked.col_piv_qr();
    let (q, r) = (factored.q(), factored.r());
    let largest = r[(0, 0)].abs();
    let rank = (0..r.nrows().min(r.ncols()))
        .take_while(|at| r[(*at, *at)].abs() > RANK * largest)
        .count();
    (q, rank)
}

#[cfg(test)]
/// Derivatives of a channel's reading in a packet by the unknowns, in physical units.
pub fn slopes_of(problem: &Problem, channel: usize, packet: usize) -> [f64; UNKNOWNS] {
    let own = &problem.twin.unit().channels[channel];
    let seen_s = own.slot_s - own.tau_s() - middle_s(problem);
    slopes(
        own.sensor,
        own.axis_b,
        own.lever_m,
        &problem.twin.feels(channel)[packet],
        seen_s,
    )
}

/// \[s\] the middle of a packet's slots.
fn middle_s(problem: &Problem) -> f64 {
    let channels = &problem.twin.unit().channels;
    channels.iter().map(|channel| channel.slot_s).sum::<f64>() / channels.len() as f64
}

/// Derivatives of a reading by the unknowns.
fn slopes(sensor: Kind, axis_b: Vector3<f64>, lever_m: Vector3<f64>, feel: &Feel, dt: f64) -> [f64; UNKNOWNS] {
    let mut slopes = [0.0; UNKNOWNS];
    let (w, f, m) = (feel.rate_b, feel.force_b, feel.field_b_ut);
    for axis in 0..3 {
        let e = Vector3::ith(axis, 1.0);
        let mut put = |unknown: usize, moved: Vector3<f64>| slopes[unknown + axis] = axis_b.dot(&moved);
        match sensor {
            Kind::Gyro => {
                put(0, e);
                put(3, dt * e);
            }
            Kind::Accelerometer => {
                let carried = e.cross(&w.cross(&lever_m)) + w.cross(&e.cross(&lever_m));
                put(0, carried - dt * e.cross(&f));
                put(3, e.cross(&lever_m) + dt * carried);
                put(6, e - dt * w.cross(&e));
                put(9, dt * e);
            }
            Kind::Magnetometer => {
                put(0, -dt * e.cross(&m));
                put(12, e - dt * w.cross(&e));
            }
            Kind::Thermometer => {}
        }
    }
    if sensor == Kind::Thermometer {
        slopes[UNKNOWNS - 1] = 1.0;
    }
    slopes
}
