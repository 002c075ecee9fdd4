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
//! Windows that were not measured ([`Phase::is_measured`]) are left out. Work is cut into blocks of starts for all cores,
//! and a block is done at all averaging times before the next, while it is in the core's cache. A block starts its moving
//! sums afresh, which also keeps rounding from adding up.

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
    /// Averaging time \[s\].
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
        self.disjoint.join(other.disjoint);
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

/// Windows taken at once.
const LANES: usize = 4;
/// Starts in a block: with what the shorter averaging times see behind them they fit a core's own cache.
const BLOCK: usize = 1 << 14;

/// All deviations at the given averaging factors, on all cores; `progress` is called with the share of each finished
/// block. Factors for which no window fits give points without windows.
pub fn sweep(phase: &Phase, factors: &[usize], progress: impl Fn(f64) + Sync) -> Vec<Point> {
    let sums: Vec<f64> = phase.angle.par_chunks(BLOCK).map(|block| block.iter().sum()).collect();
    let share = 1.0 / sums.len().max(1) as f64;
    let blocks: Vec<Vec<Point>> = (0..sums.len())
        .into_par_iter()
        .map(|number| {
            let of = |&factor: &usize| block(phase, &sums, factor, number * BLOCK);
            let points = factors.iter().map(of).collect();
            progress(share);
            points
        })
        .collect();
    let empty = |&factor: &usize| Point {
        factor,
        tau_s: factor as f64 * phase.step_s,
        ..Point::default()
    };
    let mut points: Vec<Point> = factors.iter().map(empty).collect();
    // In the order of the blocks, so that the sum is the same on any number of cores.
    for block in blocks {
        points.iter_mut().zip(block).for_each(|(point, part)| point.join(part));
    }
    points
}

/// A block's part of a point; empty where no window starts in it.
fn block(phase: &Phase, sums: &[f64], m: usize, start: usize) -> Point {
    let windows = phase.angle.len().saturating_sub(2 * m);
    let range = start..windows.min(start + BLOCK);
    if range.is_empty() {
        return Point::default();
    }
    let x = &phase.angle;
    // Where there is no moving sum there is none to start.
    let s = if start + 3 * m <= x.len() {
        let sum = |window: usize| sum_from(x, sums, start + window * m, m);
        (sum(2) - sum(1)) - (sum(1) - sum(0))
    } else {
        0.0
    };
    let mut point = if phase.is_complete() {
        complete_block(x, m, range.clone(), s)
    } else {
        gapped_block(phase, m, range.clone(), s)
    };
    for k in (start.next_multiple_of(m)..range.end).step_by(m) {
        if phase.is_complete() || phase.is_measured(k, 2 * m) {
            point.disjoint.add((x[k + 2 * m] - x[k + m]) - (x[k + m] - x[k]));
        }
    }
    point
}

/// The sum of `count` angles from `start`, whole blocks of them from `sums`.
fn sum_from(x: &[f64], sums: &[f64], start: usize, count: usize) -> f64 {
    let (first, last) = (start.div_ceil(BLOCK), (start + count) / BLOCK);
    if first >= last {
        return x[start..start + count].iter().sum();
    }
    x[start..first * BLOCK].iter().sum::<f64>()
        + sums[first..last].iter().sum::<f64>()
        + x[last * BLOCK..start + count].iter().sum::<f64>()
}

/// Splits a block's windows into those with a third difference and the few at the record's end without.
fn with_third(points: usize, m: usize, range: &Range<usize>) -> usize {
    points.saturating_sub(3 * m).clamp(range.start, range.end)
}

fn complete_block(x: &[f64], m: usize, range: Range<usize>, moving_sum: f64) -> Point {
    let third_end = with_third(x.len(), m, &range);
    let has_moving = range.start + 3 * m <= x.len();
    let mut s = moving_sum;
    let (mut seconds, mut movings, mut thirds) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    // Nothing, where no third difference fits.
    let at = |offset: usize| {
        x.get(range.start + offset..third_end + offset)
            .unwrap_or(&[])
            .chunks_exact(LANES)
    };
    for (((x0, x1), x2), x3) in at(0).zip(at(m)).zip(at(2 * m)).zip(at(3 * m)) {
        // Steps are summed within the lanes first: the chain from one moving sum to the next is then one addition long.
        let mut step = [0.0; LANES];
        for lane in 0..LANES {
            let here = (x2[lane] - x1[lane]) - (x1[lane] - x0[lane]);
            step[lane] = ((x3[lane] - x2[lane]) - (x2[lane] - x1[lane])) - here;
            seconds[lane] += here * here;
            thirds[lane] += step[lane] * step[lane];
        }
        let so_far = [0.0, step[0], step[0] + step[1], step[0] + (step[1] + step[2])];
        for lane in 0..LANES {
            let sum = s + so_far[lane];
            movings[lane] += sum * sum;
        }
        s += (step[0] + step[1]) + (step[2] + step[3]);
    }
    let total = |lanes: [f64; LANES]| lanes.iter().sum::<f64>();
    let (mut second, mut moving, mut third) = (total(seconds), total(movings), total(thirds));
    let done = range.start + (third_end - range.start) / LANES * LANES;
    for k in done..range.end {
        let here = (x[k + 2 * m] - x[k + m]) - (x[k + m] - x[k]);
        second += here * here;
        // The last moving sum has no third difference after it.
        if k <= third_end && has_moving {
            moving += s * s;
        }
        if k < third_end {
            let step = (x[k + 3 * m] - x[k + 2 * m]) - (x[k + 2 * m] - x[k + m]) - here;
            third += step * step;
            s += step;
        }
    }
    let count = third_end - range.start;
    let last_moving = has_moving && third_end < range.end;
    let of = |sum, windows| MeanSquare { sum, windows };
    Point {
        second: of(second, range.len()),
        moving: of(moving, count + usize::from(last_moving)),
        third: of(third, count),
        ..Point::default()
    }
}

fn gapped_block(phase: &Phase, m: usize, range: Range<usize>, moving_sum: f64) -> Point {
    let x = &phase.angle;
    let third_end = with_third(x.len(), m, &range);
    let mut point = Point::default();
    let mut s = moving_sum;
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

#[cfg(test)]
#[path = "deviation/tests.rs"]
mod tests;
