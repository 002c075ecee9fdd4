//! A track: positions that a receiver or a radar saw, each with its sigmas, on a clock that need not be the log's.
//!
//! In: CSV or CSV.GZ with `t_s,px_m,py_m,pz_m,sx_m,sy_m,sz_m`: position in n (north, east, down; from any origin) and one sigma of each.
//! Out: [`Fixes`], and how they lie along a motion ([`Aligned`]).
//!
//! Where the track begins, how fast the unit is then and by how much the clocks differ are not known; the specific force along
//! an attitude is the acceleration, and integrated twice it is the position:
//!
//! ```text
//! p(t) = p0 + v0 t + P(t),   P'' = C_nb f + g;   fix k is p(t_k + offset) + noise
//! ```
//!
//! `p0`, `v0` and the offset are those of least squares, the offset by Gauss and Newton's steps. They begin where the log's motion
//! explains most of the track ([`begin`]): an attitude that is off leaves an acceleration that changes slowly, so beside `P` a
//! cubic is free there, and the energy that `P` takes off the cubic's is compared over all offsets at which both meet.
//!
//! n is flat and does not turn, and gravity is the same everywhere: at a height of 10 km gravity is off by 0.03 m/s2, as is the
//! acceleration by the turning Earth at 200 m/s. A track whose sigmas do not hold that does not fit, and is not used.
//!
//! Refuses, naming file and line, what is no number, sigmas that are not above zero, and fewer than [`LEAST_FIXES`] fixes.

use std::path::Path;

use nalgebra::{DMatrix, DVector, SVector, Vector3};
use twin::recording::Table;

use crate::{input::case::CaseError, parity::smooth::trajectory::Trajectory};

/// Fixes from which more is known than a begin, a velocity and an offset.
pub const LEAST_FIXES: usize = 8;

/// Fixes along a log at most; more are thinned evenly, which is as if the receiver had been slower.
const MOST_FIXES: usize = 100;

/// Fixes at most that the begin of the offset is sought with.
const BEGUN_WITH: usize = 400;

/// \[s\] steps of the offset that its begin is sought in: a push of ten times gravity moves a track by 3 m meanwhile.
const OFFSET_STEP_S: f64 = 0.25;

/// Gauss and Newton's steps of the offset at most, and \[s\] the last one.
const OFFSET_STEPS: usize = 20;
const OFFSET_SETTLED_S: f64 = 1e-5;

const COLUMNS: [&str; 6] = ["px_m", "py_m", "pz_m", "sx_m", "sy_m", "sz_m"];

/// A position on the track's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// \[s\] on its own clock.
    pub t_s: f64,
    /// \[m\] in n.
    pub position_n: Vector3<f64>,
    /// \[m\] one sigma along each axis of n.
    pub sigmas_n: Vector3<f64>,
}

/// A track.
#[derive(Clone, Debug, Default)]
pub struct Fixes {
    /// In the order of time.
    pub fixes: Vec<Fix>,
}

impl Fixes {
    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read, or has too few fixes.
    pub fn open(path: &Path) -> Result<Self, CaseError> {
        let table = Table::open(path, &COLUMNS)?;
        let located = table.series(COLUMNS)?;
        let lines = located.lines.clone();
        let series = located.series;
        let fix = |(t_s, value): (&f64, &SVector<f64, 6>)| Fix {
            t_s: *t_s,
            position_n: value.fixed_rows::<3>(0).into_owned(),
            sigmas_n: value.fixed_rows::<3>(3).into_owned(),
        };
        let fixes: Vec<Fix> = series.t_s().iter().zip(series.values()).map(fix).collect();
        if let Some(at) = fixes.iter().position(|fix| fix.sigmas_n.min() <= 0.0) {
            let key = format!("line {}, sx_m, sy_m, sz_m", lines[at]);
            let problem = "hold a sigma that is not above zero; write how well the position is known, in metres";
            return Err(CaseError::key(path, key, problem));
        }
        if fixes.len() < LEAST_FIXES {
            let problem = format!("are {}; a track needs {LEAST_FIXES} fixes and more", fixes.len());
            return Err(CaseError::key(path, "rows", problem));
        }
        Ok(Self { fixes })
    }

    /// Those that lie in a span \[s\] of the log with this offset, thinned.
    pub fn within(&self, (from_s, to_s): (f64, f64), offset_s: f64) -> Self {
        let is_in = |fix: &&Fix| (from_s..=to_s).contains(&(fix.t_s + offset_s));
        let fixes: Vec<Fix> = self.fixes.iter().filter(is_in).copied().collect();
        thinned(fixes, MOST_FIXES)
    }

    /// \[s\] from the first to the last.
    fn span_s(&self) -> (f64, f64) {
        (self.fixes[0].t_s, self.fixes[self.fixes.len() - 1].t_s)
    }
}

fn thinned(fixes: Vec<Fix>, most: usize) -> Fixes {
    let every = fixes.len().div_ceil(most).max(1);
    Fixes {
        fixes: fixes.into_iter().step_by(every).collect(),
    }
}

/// \[s\] the offset to begin with, `t_log = t_track + offset`; none where the two never meet for [`LEAST_FIXES`] fixes. Where no
/// offset explains anything, clocks are taken to be the same.
pub fn begin(track: &Fixes, trajectory: &Trajectory) -> Option<f64> {
    let course = Displacement::of(trajectory);
    let track = thinned(track.fixes.clone(), BEGUN_WITH);
    let (first_s, last_s) = track.span_s();
    let (from_s, to_s) = trajectory.span_s();
    let steps = ((to_s - from_s + last_s - first_s) / OFFSET_STEP_S).ceil() as usize;
    let mut best: Option<(f64, f64)> = None;
    let same = std::iter::once(0.0);
    for offset_s in same.chain((0..=steps).map(|step| from_s - last_s + OFFSET_STEP_S * step as f64)) {
        let is_in = |fix: &&Fix| (from_s..=to_s).contains(&(fix.t_s + offset_s));
        let own: Vec<Fix> = track.fixes.iter().filter(is_in).copied().collect();
        if own.len() < LEAST_FIXES {
            continue;
        }
        let gain = explained(&own, &course, offset_s);
        if best.is_none_or(|(known, _)| gain > known) {
            best = Some((gain, offset_s));
        }
    }
    best.map(|(_, offset_s)| offset_s)
}

/// Energy that a motion takes off what a cubic leaves of fixes.
fn explained(fixes: &[Fix], course: &Displacement, offset_s: f64) -> f64 {
    let (first_s, last_s) = (fixes[0].t_s, fixes[fixes.len() - 1].t_s);
    let mut gain = 0.0;
    for axis in 0..3 {
        let weight = |fix: &Fix| 1.0 / fix.sigmas_n[axis];
        let cubic = DMatrix::from_fn(fixes.len(), 4, |row, power| {
            let part = (fixes[row].t_s - first_s) / (last_s - first_s).max(f64::EPSILON);
            weight(&fixes[row]) * part.powi(power as i32)
        });
        let own = cubic.qr().q();
        let left = |of: &dyn Fn(&Fix) -> f64| {
            let seen = DVector::from_iterator(fixes.len(), fixes.iter().map(|fix| weight(fix) * of(fix)));
            seen.norm_squared() - own.tr_mul(&seen).norm_squared()
        };
        let alone = left(&|fix| fix.position_n[axis]);
        gain += alone - left(&|fix| fix.position_n[axis] - course.at(fix.t_s + offset_s).0[axis]);
    }
    gain
}

/// Position and velocity along a trajectory that begins at rest at the origin of n, exact where its acceleration is linear
/// between two nodes.
pub struct Displacement<'a> {
    trajectory: &'a Trajectory,
    /// [m/s2], [m/s] and \[m\] at each node, in n.
    nodes: Vec<[Vector3<f64>; 3]>,
}

impl<'a> Displacement<'a> {
    /// Of a trajectory.
    pub fn of(trajectory: &'a Trajectory) -> Self {
        let h = trajectory.step_s();
        let mut nodes: Vec<[Vector3<f64>; 3]> = Vec::with_capacity(trajectory.states.len());
        for state in &trajectory.states {
            let acc_n = state.q_nb * trajectory.acceleration_b(state);
            let (velocity_n, position_n) = match nodes.last() {
                Some([before_n, velocity_n, position_n]) => (
                    velocity_n + 0.5 * h * (before_n + acc_n),
                    position_n + h * velocity_n + h * h / 6.0 * (2.0 * before_n + acc_n),
                ),
                None => (Vector3::zeros(), Vector3::zeros()),
            };
            nodes.push([acc_n, velocity_n, position_n]);
        }
        Self { trajectory, nodes }
    }

    /// \[m\] and [m/s] in n at an instant; beyond the ends with the last acceleration.
    pub fn at(&self, t_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let h = self.trajectory.step_s();
        let place = ((t_s - self.trajectory.from_s) / h).floor().max(0.0) as usize;
        let place = place.min(self.nodes.len() - 2);
        let [acc_n, velocity_n, position_n] = self.nodes[place];
        let since_s = t_s - self.trajectory.at_s(place);
        let slope_n = (self.nodes[place + 1][0] - acc_n) / h;
        (
            position_n + since_s * (velocity_n + since_s * (0.5 * acc_n + since_s / 6.0 * slope_n)),
            velocity_n + since_s * (acc_n + 0.5 * since_s * slope_n),
        )
    }
}

/// A fix beside a motion.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// \[s\] on the log's clock.
    pub t_s: f64,
    /// In its sigmas, along each axis of n.
    pub off_n: Vector3<f64>,
}

/// A track along a motion.
pub struct Aligned {
    /// \[s\] `t_log = t_track + offset`.
    pub offset_s: f64,
    /// Three a fix, in their sigmas, of which begin, velocity and offset are taken.
    pub off: DVector<f64>,
    /// Orthonormal columns of begin and velocity.
    pub begun: DMatrix<f64>,
    /// How the rows change with the offset \[1/s\], begin and velocity taken off.
    pub by_offset: DVector<f64>,
}

impl Aligned {
    /// Of fixes with an offset that is near.
    pub fn of(fixes: &[Fix], trajectory: &Trajectory, near_s: f64) -> Self {
        let course = Displacement::of(trajectory);
        let rows = 3 * fixes.len();
        let (first_s, last_s) = (fixes[0].t_s, fixes[fixes.len() - 1].t_s);
        // Six columns: where it begins and how fast, along each axis.
        let begun = DMatrix::from_fn(rows, 6, |row, column| {
            let fix = &fixes[row / 3];
            if row % 3 != column % 3 {
                return 0.0;
            }
            let part = (fix.t_s - first_s) / (last_s - first_s).max(f64::EPSILON);
            let own = if column < 3 { 1.0 } else { part };
            own / fix.sigmas_n[row % 3]
        });
        let begun = begun.qr().q();
        let apart = |seen: DVector<f64>| &seen - &begun * begun.tr_mul(&seen);
        let rows_of = |of: &dyn Fn(&Fix) -> Vector3<f64>| {
            let each = fixes.iter().flat_map(|fix| {
                let own = of(fix).component_div(&fix.sigmas_n);
                [own.x, own.y, own.z]
            });
            DVector::from_iterator(rows, each)
        };
        let off = |offset_s: f64| apart(rows_of(&|fix| fix.position_n - course.at(fix.t_s + offset_s).0));
        let slope = |offset_s: f64| apart(rows_of(&|fix| course.at(fix.t_s + offset_s).1));
        let mut offset_s = near_s;
        for _ in 0..OFFSET_STEPS {
            let by_offset = slope(offset_s);
            let Some(step_s) = step(&by_offset, &off(offset_s), trajectory) else {
                break;
            };
            offset_s += step_s;
            if step_s.abs() < OFFSET_SETTLED_S {
                break;
            }
        }
        Self {
            offset_s,
            off: off(offset_s),
            by_offset: slope(offset_s),
            begun,
        }
    }

    /// Each of its fixes.
    pub fn beside(&self, fixes: &[Fix]) -> Vec<Beside> {
        let own = |(fix, off): (&Fix, &[f64])| Beside {
            t_s: fix.t_s + self.offset_s,
            off_n: Vector3::from_column_slice(off),
        };
        fixes.iter().zip(self.off.as_slice().chunks_exact(3)).map(own).collect()
    }

    /// Direction of the rows along which an offset moves them; none where an offset as long as the log moves them by less than a
    /// sigma.
    pub fn direction(&self, trajectory: &Trajectory) -> Option<DVector<f64>> {
        is_told(&self.by_offset, trajectory).then(|| self.by_offset.normalize())
    }
}

fn is_told(by_offset: &DVector<f64>, trajectory: &Trajectory) -> bool {
    let (from_s, to_s) = trajectory.span_s();
    by_offset.norm() * (to_s - from_s) > 1.0
}

/// \[s\] a step of the offset.
fn step(by_offset: &DVector<f64>, off: &DVector<f64>, trajectory: &Trajectory) -> Option<f64> {
    is_told(by_offset, trajectory).then(|| by_offset.dot(off) / by_offset.norm_squared())
}
