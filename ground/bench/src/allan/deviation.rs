//! The deviations themselves, all from one pass over the angle for each averaging time.
//!
//! In: [`Phase`] `x` and an averaging factor `m`, `tau = m tau_0`. Out: mean squares of
//!
//! ```text
//! second difference   d2_k = x_{k+2m} - 2 x_{k+m} + x_k                        ADEV (k = 0, m, 2m, ...), overlapping ADEV
//! third difference    d3_k = x_{k+3m} - 3 x_{k+2m} + 3 x_{k+m} - x_k           HDEV (overlapping)
//! moving sum          s_k  = d2_k + ... + d2_{k+m-1},  s_{k+1} = s_k + d3_k    MDEV, TDEV = tau MDEV / sqrt(3)
//! ```
//!
//! (Riley, *Handbook of Frequency Stability Analysis*, NIST SP 1065, section 5.) The third difference is also the step
//! of the moving sum, so that one loop of constant cost a sample serves all: O(N) per averaging time.
//! Windows that were not measured ([`Phase::is_measured`]) are left out. Work is cut into pieces for all cores; a piece
//! starts its moving sum afresh, which also keeps rounding from adding up.

use std::ops::Range;

use rayon::prelude::*;

use super::phase::Phase;

/// A deviation this module estimates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deviation {
    /// Allan deviation from windows end to end.
    Adev,
    /// Allan deviation from windows at every step.
    Oadev,
    /// Modified Allan deviation.
    Mdev,
    /// Time deviation; for a gyro its unit is an angle.
    Tdev,
    /// Overlapping Hadamard deviation, blind to a constant ramp.
    Hdev,
}

impl Deviation {
    /// All of them, in the order of their columns.
    pub const ALL: [Self; 5] = [Self::Adev, Self::Oadev, Self::Mdev, Self::Tdev, Self::Hdev];

    /// Name of its column.
    pub const fn name(self) -> &'static str {
        ["adev", "oadev", "mdev", "tdev", "hdev"][self as usize]
    }
}

/// A mean of squares, unscaled, and how many squares it is of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeanSquare {
    sum: f64,
    /// How many windows.
    pub windows: usize,
}

impl MeanSquare {
    fn add(&mut self, value: f64) {
        self.sum += value * value;
        self.windows += 1;
    }

    fn join(&mut self, other: Self) {
        self.sum += other.sum;
        self.windows += other.windows;
    }

    fn root(self, divisor: f64) -> Option<f64> {
        (self.windows > 0).then(|| (self.sum / (self.windows as f64 * divisor)).sqrt())
    }
}

/// The mean squares at one averaging time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Averaging factor.
    pub factor: usize,
    /// Averaging time [s].
    pub tau_s: f64,
    disjoint: MeanSquare,
    second: MeanSquare,
    moving: MeanSquare,
    third: MeanSquare,
}

impl Point {
    /// The windows behind a deviation.
    pub fn windows(&self, deviation: Deviation) -> usize {
        self.mean_square(deviation).windows
    }

    /// A deviation's value; none where no window fits.
    pub fn value(&self, deviation: Deviation) -> Option<f64> {
        let tau2 = self.tau_s * self.tau_s;
        let m2 = (self.factor * self.factor) as f64;
        let divisor = match deviation {
            Deviation::Adev | Deviation::Oadev => 2.0 * tau2,
            Deviation::Mdev => 2.0 * tau2 * m2,
            Deviation::Tdev => 6.0 * m2,
            Deviation::Hdev => 6.0 * tau2,
        };
        self.mean_square(deviation).root(divisor)
    }

    const fn mean_square(&self, deviation: Deviation) -> MeanSquare {
        match deviation {
            Deviation::Adev => self.disjoint,
            Deviation::Oadev => self.second,
            Deviation::Mdev | Deviation::Tdev => self.moving,
            Deviation::Hdev => self.third,
        }
    }

    fn join(&mut self, other: Self) {
        self.second.join(other.second);
        self.moving.join(other.moving);
        self.third.join(other.third);
    }
}

/// Averaging factors 1, 2, 4, ... for which a second difference fits.
pub fn octaves(phase: &Phase) -> Vec<usize> {
    let longest = (phase.angle.len().max(1) - 1) / 2;
    std::iter::successors(Some(1_usize), |factor| factor.checked_mul(2))
        .take_while(|factor| *factor <= longest)
        .collect()
}

/// Shortest piece of work: below it handing it to another core costs more than it saves.
const PIECE: usize = 1 << 14;

/// All deviations at the given averaging factors, on all cores; `progress` is called with the share of each finished
/// piece. Factors for which no window fits give points without windows.
pub fn sweep(phase: &Phase, factors: &[usize], progress: impl Fn(f64) + Sync) -> Vec<Point> {
    let mut work: Vec<(usize, Range<usize>)> = Vec::new();
    for (index, &factor) in factors.iter().enumerate() {
        let windows = phase.angle.len().saturating_sub(2 * factor);
        let piece = PIECE.max(4 * factor);
        work.extend(
            (0..windows)
                .step_by(piece)
                .map(|start| (index, start..windows.min(start + piece))),
        );
    }
    let share = 1.0 / work.len().max(1) as f64;
    let pieces: Vec<(usize, Point)> = work
        .into_par_iter()
        .map(|(index, range)| {
            let point = piece(phase, factors[index], range);
            progress(share);
            (index, point)
        })
        .collect();
    let mut points: Vec<Point> = factors
        .iter()
        .map(|&factor| Point {
            factor,
            tau_s: factor as f64 * phase.step_s,
            disjoint: disjoint(phase, factor),
            ..Point::default()
        })
        .collect();
    // In the order of the pieces, so that the sum is the same on any number of cores.
    for (index, point) in pieces {
        points[index].join(point);
    }
    points
}

fn disjoint(phase: &Phase, m: usize) -> MeanSquare {
    let x = &phase.angle;
    let mut sum = MeanSquare::default();
    for k in (0..x.len().saturating_sub(2 * m)).step_by(m.max(1)) {
        if phase.is_complete() || phase.is_measured(k, 2 * m) {
            sum.add(x[k + 2 * m] - 2.0 * x[k + m] + x[k]);
        }
    }
    sum
}

fn piece(phase: &Phase, m: usize, range: Range<usize>) -> Point {
    if phase.is_complete() {
        complete_piece(&phase.angle, m, range)
    } else {
        gapped_piece(phase, m, range)
    }
}

/// Splits a piece's windows into those with a third difference and the few at the record's end without.
fn with_third(points: usize, m: usize, range: &Range<usize>) -> usize {
    points.saturating_sub(3 * m).clamp(range.start, range.end)
}

fn complete_piece(x: &[f64], m: usize, range: Range<usize>) -> Point {
    let third_end = with_third(x.len(), m, &range);
    let (mut second, mut moving, mut third) = (0.0, 0.0, 0.0);
    let at = |offset: usize| &x[range.start + offset..third_end + offset];
    let has_moving = range.start + 3 * m <= x.len();
    let mut s = if has_moving { moving_sum(x, m, range.start) } else { 0.0 };
    if third_end > range.start {
        for (((x0, x1), x2), x3) in at(0).iter().zip(at(m)).zip(at(2 * m)).zip(at(3 * m)) {
            let here = (x2 - x1) - (x1 - x0);
            let step = (x3 - x2) - (x2 - x1) - here;
            second += here * here;
            third += step * step;
            moving += s * s;
            s += step;
        }
    }
    // The last moving sum has no third difference after it.
    let last_moving = has_moving && third_end < range.end;
    if last_moving {
        moving += s * s;
    }
    for k in third_end..range.end {
        let here = (x[k + 2 * m] - x[k + m]) - (x[k + m] - x[k]);
        second += here * here;
    }
    let thirds = third_end - range.start;
    Point {
        second: MeanSquare {
            sum: second,
            windows: range.len(),
        },
        moving: MeanSquare {
            sum: moving,
            windows: thirds + usize::from(last_moving),
        },
        third: MeanSquare {
            sum: third,
            windows: thirds,
        },
        ..Point::default()
    }
}

fn gapped_piece(phase: &Phase, m: usize, range: Range<usize>) -> Point {
    let x = &phase.angle;
    let third_end = with_third(x.len(), m, &range);
    let mut point = Point::default();
    let mut s = if range.start + 3 * m <= x.len() {
        moving_sum(x, m, range.start)
    } else {
        0.0
    };
    for k in range {
        let here = (x[k + 2 * m] - x[k + m]) - (x[k + m] - x[k]);
        if phase.is_measured(k, 2 * m) {
            point.second.add(here);
        }
        // The moving sum looks at 3m - 1 intervals, the third difference at 3m.
        if k + 3 * m <= x.len() && phase.is_measured(k, 3 * m - 1) {
            point.moving.add(s);
        }
        if k < third_end {
            let step = (x[k + 3 * m] - x[k + 2 * m]) - (x[k + 2 * m] - x[k + m]) - here;
            if phase.is_measured(k, 3 * m) {
                point.third.add(step);
            }
            s += step;
        }
    }
    point
}

fn moving_sum(x: &[f64], m: usize, start: usize) -> f64 {
    (start..start + m)
        .map(|k| (x[k + 2 * m] - x[k + m]) - (x[k + m] - x[k]))
        .sum()
}

#[cfg(test)]
#[path = "deviation/tests.rs"]
mod tests;
