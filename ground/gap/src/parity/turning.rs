//! Rows in which nobody knows how fast the unit turns: too many gyros stand at their stops.
//!
//! In: a log and its unit. Out: [`Holes`], the rows that are left out, and the pieces of a log that they part.
//!
//! Everything here is linear about a rate: a packet's unknowns are small changes of it, and samples of one packet lie some tenths of a
//! second apart. Of a clipped gyro the log keeps no sample. Where those that are left do not span three axes for longer than a spline
//! bridges, the rate between is a guess; about a guess that is wrong by turns a second nothing is linear, and what is left there is
//! neither noise nor an effect. A rocket's spin leaves 18 sigma in its packets, and those on the pad and in micro-gravity say nothing
//! beside it. So such rows are left out, and [`BESIDE`] to either side, whose splines are held by rows that are gone.
//!
//! A gyro that clips below what its description says has samples, at another stop; its rows stay.

use std::ops::Range;

use nalgebra::Matrix3;
use twin::predict::{Kind, UnitDescription};

use crate::input::log::Log;

/// Rows without a rate that a spline bridges: as many as its knots are held from one side.
const BRIDGED: usize = 2;

/// Rows to either side of a stretch without a rate: a cubic spline's coefficient reaches two knots, which are a row apart.
const BESIDE: usize = 2;

/// Least eigenvalue of the sum of squares of the axes of gyros that tell a rate: of three axes it is their volume that vanishes where
/// they lie in a plane; five degrees beside one the rate is eleven times as uncertain as along the others.
pub const SPANS: f64 = 0.01;

/// Stretches of a log in which nobody knows the rate.
#[derive(Clone, Debug, Default)]
pub struct Holes {
    rows: Vec<Range<usize>>,
    /// \[s\] the start of the first row of each and of its last.
    spans_s: Vec<(f64, f64)>,
}

impl Holes {
    /// Of a log.
    pub fn of(log: &Log, unit: &UnitDescription) -> Self {
        let mut axes = vec![Matrix3::<f64>::zeros(); log.start_s.len()];
        for (channel, series) in unit.channels.iter().zip(&log.channels) {
            if channel.sensor == Kind::Gyro {
                let square = channel.axis_b * channel.axis_b.transpose();
                series.rows.iter().for_each(|row| axes[*row as usize] += square);
            }
        }
        let is_told: Vec<bool> = axes
            .iter()
            .map(|sum| sum.symmetric_eigenvalues().min() > SPANS)
            .collect();
        let mut rows = Vec::new();
        let mut from = 0;
        for stretch in is_told.chunk_by(|one, other| one == other) {
            let to = from + stretch.len();
            if !stretch[0] && stretch.len() > BRIDGED {
                rows.push(from.saturating_sub(BESIDE)..(to + BESIDE).min(is_told.len()));
            }
            from = to;
        }
        let span_s = |rows: &Range<usize>| (log.start_s[rows.start], log.start_s[rows.end - 1]);
        Self {
            spans_s: rows.iter().map(span_s).collect(),
            rows,
        }
    }

    /// Of these rows, those in which the rate is known. All of them where fewer than `least` are left: there the unit's gyros never tell a rate.
    pub fn without(&self, rows: Vec<usize>, least: usize) -> Vec<usize> {
        let is_known = |row: &usize| self.rows.iter().all(|hole| !hole.contains(row));
        let kept: Vec<usize> = rows.iter().copied().filter(is_known).collect();
        if kept.len() < least { rows } else { kept }
    }

    /// \[s\] the start of the first row of each and of its last, to be put elsewhere in time with the rows of the log.
    pub fn spans_s_mut(&mut self) -> &mut [(f64, f64)] {
        &mut self.spans_s
    }

    /// \[s\] pieces of rows between which a hole was left out. Windows that are parted and packets that were lost part nothing.
    pub fn pieces(&self, starts_s: &[f64]) -> Vec<(f64, f64)> {
        let is_whole = |one: &f64, next: &f64| !self.spans_s.iter().any(|(from_s, to_s)| one < from_s && to_s < next);
        let pieces = starts_s.chunk_by(is_whole);
        pieces.map(|own| (own[0], own[own.len() - 1])).collect()
    }
}

/// Whether an instant lies in a hole between two pieces.
pub fn is_in_hole(pieces: &[(f64, f64)], t_s: f64) -> bool {
    let next = pieces.partition_point(|(from_s, _)| *from_s <= t_s);
    next > 0 && next < pieces.len() && pieces[next - 1].1 < t_s
}

#[cfg(test)]
mod tests {
    use twin::predict::{emems, thesis_slot_s};

    use super::*;

    /// A log of forty rows in which gyros have a sample where this says so.
    fn log(unit: &UnitDescription, has: impl Fn(usize, usize) -> bool) -> Log {
        let mut log = Log::empty(unit.channels.len());
        (0..40).for_each(|row| log.begin_row(0.2 * f64::from(row)));
        let mut gyro = 0;
        for (channel, series) in unit.channels.iter().zip(&mut log.channels) {
            let is_gyro = channel.sensor == Kind::Gyro;
            for row in (0..40).filter(|row| !is_gyro || has(gyro, *row)) {
                series.rows.push(row as u32);
                series.values.push(0.0);
            }
            gyro += usize::from(is_gyro);
        }
        log
    }

    fn left(has: impl Fn(usize, usize) -> bool) -> Vec<usize> {
        let unit = emems(thesis_slot_s);
        Holes::of(&log(&unit, has), &unit).without((0..40).collect(), 16)
    }

    #[test]
    fn rows_whose_gyros_stand_at_their_stops_are_left_out_with_their_neighbours() {
        let spins = |row: usize| (20..26).contains(&row);
        let expected: Vec<usize> = (0..18).chain(28..40).collect();
        assert_eq!(left(|gyro, row| gyro < 2 || !spins(row)), expected);
        // Three of the tetrahedron's four tell a rate.
        assert_eq!(left(|gyro, row| gyro < 3 || !spins(row)).len(), 40);
    }

    #[test]
    fn what_a_spline_bridges_stays_and_so_does_a_log_that_never_tells_a_rate() {
        assert_eq!(left(|_, row| row != 20 && row != 21).len(), 40);
        assert_eq!(left(|_, row| !(20..23).contains(&row)).len(), 40 - 7);
        assert_eq!(left(|gyro, _| gyro == 0).len(), 40);
    }

    #[test]
    fn a_hole_that_is_put_later_with_its_rows_parts_them_still() {
        let unit = emems(thesis_slot_s);
        let mut holes = Holes::of(&log(&unit, |_, row| !(20..23).contains(&row)), &unit);
        let rows = holes.without((0..40).collect(), 16);
        // Two seconds were lost before the hole, which is as long.
        let later_s = |start_s: f64| if start_s > 1.0 { start_s + 2.0 } else { start_s };
        let starts: Vec<f64> = rows.iter().map(|row| later_s(0.2 * *row as f64)).collect();
        assert_eq!(holes.pieces(&starts).len(), 1, "the hole is where it was told");
        for (from_s, to_s) in holes.spans_s_mut() {
            (*from_s, *to_s) = (later_s(*from_s), later_s(*to_s));
        }
        assert_eq!(holes.pieces(&starts).len(), 2);
    }

    #[test]
    fn pieces_are_parted_by_what_is_left_out_and_not_by_lost_packets_or_windows() {
        let unit = emems(thesis_slot_s);
        let holes = Holes::of(&log(&unit, |_, row| !(20..23).contains(&row)), &unit);
        let starts = |rows: &[usize]| -> Vec<f64> { rows.iter().map(|row| 0.2 * *row as f64).collect() };
        let every: Vec<usize> = (0..40).collect();
        let found = holes.pieces(&starts(&holes.without(every.clone(), 16)));
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(
            is_in_hole(&found, 4.3) && !is_in_hole(&found, 3.1) && !is_in_hole(&found, 5.1) && !is_in_hole(&found, 9.0)
        );
        // Windows to either side of a hole are parted by it, and two on one side are not.
        let behind: Vec<usize> = (0..10).chain(27..40).collect();
        assert_eq!(holes.pieces(&starts(&behind)).len(), 2);
        let parted: Vec<usize> = (0..5).chain(12..18).collect();
        assert_eq!(holes.pieces(&starts(&parted)).len(), 1);
        // Where the rows stay after all nothing is parted.
        assert_eq!(holes.pieces(&starts(&every)).len(), 1);
        let lost: Vec<usize> = every.iter().copied().filter(|row| !(5..18).contains(row)).collect();
        assert_eq!(Holes::default().pieces(&starts(&lost)).len(), 1);
    }
}
