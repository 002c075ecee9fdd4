//! The smoothed flight: attitude and its covariance from the whole log, before and after each instant.
//!
//! In: a log without a reference, its unit and environment. Out: [`Smoothed`]: a [`Trajectory`] about which the motion is eliminated, and
//! what the log keeps once it is. The steps, a file each:
//!
//! | step | file | gives |
//! |---|---|---|
//! | 1 | [`trajectory`] | where it begins: rates, turned slowly towards gravity and field |
//! | 2 | [`rests`] | when the unit stands still |
//! | 3 | [`rows`], [`basis`] | how a turn and an acceleration change each sample |
//! | 4 | [`smoothing`], [`banded`] | the normal matrix of the motion, its factor, its covariance |
//! | 5 | this one | Gauss and Newton's steps with the calibration beside, until no attitude turns any more |
//!
//! Known of the motion: the field in n, gravity, and how lively it is ([`crate::parity::course`]). Where the unit
//! goes is not known, but that it does not accelerate for long: field, gravity and gyros together give the attitude.
//!
//! The calibration of all channels is fitted in the same step within its sigmas. The covariance holds noise and calibration.

pub mod banded;
pub mod basis;
pub mod rests;
pub mod rows;
pub mod smoothing;
pub mod told;
pub mod trajectory;

use nalgebra::{DMatrix, Matrix3};
use twin::{
    environment::Environment,
    predict::{Twin, UnitDescription},
};

use crate::{
    input::{case::CaseError, log::Log, reference::Reference, windows::Fit},
    null::problem::Problem,
    parity::smooth::{basis::Knots, rows::UNKNOWNS, smoothing::Smoothing, trajectory::Trajectory},
    parity::{
        course::{Course, Start},
        space::Space,
    },
};

/// Gauss and Newton's steps at most.
const MOST_STEPS: usize = 20;

/// \[rad\] the largest turn of a step after which nothing is left to turn: its square is far below any sigma.
const SETTLED_RAD: f64 = 3e-3;

/// [m/s2] how still a unit stands that rests.
const STILL: f64 = 0.003;

/// Knots a packet: two instants of field and force, and gyros between.
const KNOTS_A_ROW: f64 = 2.0;

/// A flight as its log tells it.
pub struct Smoothed {
    /// The motion.
    pub trajectory: Trajectory,
    /// Spans of rest \[s\].
    pub rests: Vec<(f64, f64)>,
    /// Where its knots are.
    pub knots: Knots,
    /// \[rad\] the largest turn of each step.
    pub turns: Vec<f64>,
}

impl Smoothed {
    /// Of a log.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn of(
        log: &Log,
        unit: &UnitDescription,
        environment: &Environment,
        (course, start): (&Course, &Start),
        progress: &dyn Fn(f64),
    ) -> Result<Self, CaseError> {
        let rests = rests::rests(log, unit, environment);
        let mut smoothed = Self {
            trajectory: Trajectory::of(start, &course.scene, environment),
            rests,
            knots: Knots::over(start.span_s, start.knot_s / KNOTS_A_ROW),
            turns: Vec::new(),
        };
        while smoothed.turns.len() < MOST_STEPS && !smoothed.is_settled() {
            progress(smoothed.turns.len() as f64 / MOST_STEPS as f64);
            let twin = smoothed.twin(log, unit, environment)?;
            let (fit, reference) = (fit(log), Reference::default());
            let problem = Problem::new(&twin, &fit, &reference);
            let motion = smoothed.smoothing(&problem, course, start);
            let space = Space::new(&problem, &motion, Vec::new());
            let residual = space.project_residual(problem.residuals(&[]).into_iter().enumerate().collect());
            let correction = motion.correction(&space.motion_part(&residual));
            let within_s = (log.start_s[0], log.start_s[log.start_s.len() - 1]);
            let turn = smoothed.trajectory.correct(&smoothed.knots, &correction, within_s);
            smoothed.turns.push(turn);
        }
        Ok(smoothed)
    }

    /// Whether the last step turned nothing any more.
    pub fn is_settled(&self) -> bool {
        self.turns.last().is_some_and(|turn| *turn < SETTLED_RAD)
    }

    /// The twin along it.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn twin(&self, log: &Log, unit: &UnitDescription, environment: &Environment) -> Result<Twin, CaseError> {
        let scene = self.trajectory.scene();
        Ok(Twin::new(unit.clone(), *environment, scene, log.start_s.clone())?)
    }

    /// The motion about it, to be eliminated.
    pub fn smoothing(&self, problem: &Problem, course: &Course, start: &Start) -> Smoothing {
        let rests: Vec<((f64, f64), f64)> = self.rests.iter().map(|span| (*span, STILL)).collect();
        Smoothing::of(problem, &self.trajectory, (course, start), self.knots, &rests)
    }
}

/// All rows of a log.
pub fn fit(log: &Log) -> Fit {
    Fit {
        channels: log.channels.clone(),
    }
}

/// Covariance of the attitude at instants \[s\]: of a turn in b \[rad2\], noise and calibration together.
pub fn covariances(space: &Space, motion: &Smoothing, instants_s: &[f64]) -> Vec<Matrix3<f64>> {
    let parts = space.open_parts();
    let mut moved = DMatrix::zeros(parts.nrows(), 3 * instants_s.len());
    for (at, part) in parts.row_iter().enumerate() {
        let turned = motion.correction(&part.transpose());
        for (instant, t_s) in instants_s.iter().enumerate() {
            let (first, weights) = motion.turn_rows(*t_s);
            for axis in 0..3 {
                let own = turned[UNKNOWNS * first..].iter().zip(&weights[axis]);
                moved[(at, 3 * instant + axis)] = own.map(|(turned, weight)| turned * weight).sum();
            }
        }
    }
    space.open_factor(&mut moved);
    (instants_s.iter().enumerate())
        .map(|(instant, t_s)| {
            let own = moved.columns(3 * instant, 3);
            let by_calibration = own.tr_mul(&own);
            let by_noise = motion.covariance(*t_s);
            Matrix3::from_fn(|row, column| by_noise[row][column] + by_calibration[(row, column)])
        })
        .collect()
}
