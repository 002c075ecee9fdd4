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
//! | 4 | [`prior`], [`smoothing`], [`banded`] | the normal matrix of the motion, its factor, its covariance |
//! | 5 | this one | Gauss and Newton's steps with the calibration beside, until no attitude turns any more |
//! | 6 | [`holding`], [`tied`] (by [`crate::parity::known`]) | further steps with what else is known of the motion, once it has settled without |
//! | 7 | [`beside`] | further steps with what is named in the model |
//!
//! A step that does not make the energy of residuals and prior smaller is halved. Within [`LINEAR_RAD`] one factor serves several
//! steps (the chord method: Ortega and Rheinboldt 1970, 7.1). It has settled where the last step turned nothing by more than
//! [`SETTLED_RAD`] and made that energy smaller by no more than its standard deviation `sqrt(2 n)`; where it has not, it says so.
//!
//! Known of the motion: the field in n, gravity, and how lively it is ([`crate::parity::course`]). Where the unit
//! goes is not known, but that it does not accelerate for long: field, gravity and gyros together give the attitude.
//!
//! The calibration of all channels is fitted in the same step within its sigmas. The covariance holds noise and calibration.

pub mod banded;
pub mod basis;
mod beside;
mod holding;
pub mod prior;
pub mod rests;
pub mod rows;
pub mod smoothing;
pub mod tied;
pub mod told;
pub mod trajectory;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3};
use twin::{
    environment::Environment,
    predict::{Memory, Twin, UnitDescription},
};

use crate::{
    input::{case::CaseError, log::Log, reference::Reference, windows::Fit},
    library::column::Entries,
    null::problem::Problem,
    parity::{
        course::{Course, Start},
        known::{
            instants::Kept,
            simulated::Belief,
            ties::{Ties, Use},
            track::Beside,
        },
        smooth::{
            basis::Knots,
            rows::past_s,
            smoothing::{Slopes, Smoothing},
            trajectory::{State, Trajectory},
        },
        space::Space,
        turning::Holes,
    },
};

/// Gauss and Newton's steps at most: 22 simulated flights took 3 to 9.
const MOST_STEPS: usize = 40;

/// \[rad\] that steps may turn the attitude together before everything is made linear again: what columns are off by within
/// it moves nothing by more than a tenth of what the step itself did.
const LINEAR_RAD: f64 = 0.1;

/// \[rad\] the largest turn of a step after which nothing is left to turn: a third of the smallest sigma that was seen (0.17 deg).
const SETTLED_RAD: f64 = 1e-3;

/// \[rad\] of one step: beyond it the columns that asked for it no longer hold.
const LONGEST_RAD: f64 = 0.5;

/// Part of a step below which none is taken: where a twentieth of it makes nothing better, it leads nowhere.
const LEAST_PART: f64 = 0.05;

/// [m/s2] how still a unit stands that rests.
const STILL: f64 = 0.003;

/// Part of gravity below which a unit falls: from there on a turn is known to no more than the root of two times what steps take it for.
const LIGHT: f64 = 0.5;

/// Part of a piece of a log in which a unit falls that is said to fall: what a burn or an entry adds at its ends tells no gravity either.
const FALLS: f64 = 0.9;

/// Share of the calibration's norm to which it is known in a step: one that moves the attitude by a millionth of its sigma.
const NEAR: f64 = 1e-6;

/// The same in a step after one so long that others will follow: an inexact step of Newton's (Dembo, Eisenstat and Steihaug 1982).
const FAR: f64 = 1e-3;

/// Knots a packet: two instants of field and force, and gyros between.
const KNOTS_A_ROW: f64 = 2.0;

/// A log, and what its motion begins with.
#[derive(Clone, Copy)]
pub struct About<'a> {
    /// It.
    pub log: &'a Log,
    /// Whose it is.
    pub unit: &'a UnitDescription,
    /// Where.
    pub environment: &'a Environment,
    /// How lively the motion is.
    pub course: &'a Course,
    /// Where it begins.
    pub start: &'a Start,
}

/// What is left along a trajectory.
struct At {
    /// What a step makes smaller: the energy of the residuals with the calibration fitted, and that of the prior rows.
    cost: f64,
    /// In units of noise.
    residuals: Entries,
    /// In their sigmas.
    prior: Vec<f64>,
    /// Rows of a track, in theirs.
    track: Option<DVector<f64>>,
}

impl At {
    /// Standard deviation of a sum of as many squares of normal numbers.
    fn chance(&self) -> f64 {
        let samples: usize = self.residuals.iter().map(|(_, values)| values.len()).sum();
        let track = self.track.as_ref().map_or(0, DVector::len);
        (2.0 * (samples + self.prior.len() + track) as f64).sqrt()
    }
}

/// A flight as its log tells it.
#[derive(Clone)]
pub struct Smoothed {
    /// The motion.
    pub trajectory: Trajectory,
    /// Spans of rest \[s\].
    pub rests: Vec<(f64, f64)>,
    /// Where its knots are.
    pub knots: Knots,
    /// \[rad\] the largest turn of each step.
    pub turns: Vec<f64>,
    /// What it is tied to besides.
    pub ties: Ties,
    /// What became of the track; none where there is none.
    pub track: Option<Use>,
    /// Its fixes beside the motion, used or not; empty where they never met.
    pub beside_track: Vec<Beside>,
    /// What became of the simulated trajectory.
    pub belief: Option<Belief>,
    /// What became of attitudes at instants; none where none are told.
    pub attitudes: Option<Vec<Kept>>,
    /// By how much the last step made the energy of residuals and prior smaller.
    gain: f64,
    /// Standard deviation that this energy has by chance.
    chance: f64,
}

impl Smoothed {
    /// Of a log, in which the unit rests in these spans \[s\].
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn of(about: &About, rests: Vec<(f64, f64)>, progress: &dyn Fn(f64)) -> Result<Self, CaseError> {
        let About {
            log,
            unit,
            environment,
            course,
            start,
        } = about;
        let (first_s, last_s) = (log.start_s[0], log.start_s[log.start_s.len() - 1]);
        let slots_s = || unit.channels.iter().map(|channel| channel.slot_s);
        let (earliest_s, latest_s) = (slots_s().fold(0.0, f64::min), slots_s().fold(0.0, f64::max));
        // No further than samples reach: nothing holds the motion there.
        let span_s = (first_s + earliest_s - past_s(unit), last_s + latest_s);
        let knots = Knots::over(span_s, start.knot_s / KNOTS_A_ROW);
        let mut smoothed = Self {
            trajectory: Trajectory::of(start, &knots, &course.scene, environment),
            rests,
            knots,
            turns: Vec::new(),
            ties: Ties::default(),
            track: None,
            beside_track: Vec::new(),
            belief: None,
            attitudes: None,
            gain: f64::INFINITY,
            chance: 0.0,
        };
        smoothed.settle(about, progress)?;
        Ok(smoothed)
    }

    /// Steps until it has settled, or none helps any more.
    fn settle(&mut self, about: &About, progress: &dyn Fn(f64)) -> Result<(), CaseError> {
        let until = self.turns.len() + MOST_STEPS;
        let mut near = None;
        while self.turns.len() < until && !self.is_settled() {
            if !self.steps(about, until, &mut near, progress)? {
                break;
            }
        }
        Ok(())
    }

    /// Linearises about the trajectory, and steps as long as that holds. A step that makes the cost no smaller is halved; whether
    /// some part of each did.
    fn steps(
        &mut self,
        about: &About,
        until: usize,
        near: &mut Near,
        progress: &dyn Fn(f64),
    ) -> Result<bool, CaseError> {
        let (log, course) = (about.log, (about.course, about.start));
        let (fit, reference) = (fit(log), Reference::default());
        let twin = self.twin(log, about.unit, about.environment)?;
        let problem = Problem::new(&twin, &fit, &reference);
        let motion = self.smoothing(&problem, course.0, course.1);
        let mut space = Space::open_still(&problem, &motion, Vec::new());
        let mut now = self.at(&problem, log, course)?;
        let pieces = about.start.holes.pieces(&log.start_s);
        let mut turned = 0.0;
        while self.turns.len() < until && turned < LINEAR_RAD && !self.is_settled() {
            progress(self.turns.len() as f64 / MOST_STEPS as f64);
            let prior = motion.prior_of(now.prior.iter().copied(), now.track.as_ref());
            let part = motion_part(&mut space, now.residuals, &prior, near, self.turns.last());
            let correction = motion.correction(&part);
            let turn = self.trajectory.turn(&self.knots, &correction, &pieces);
            self.turns.push(turn);
            turned += turn;
            let (before, cost) = (self.trajectory.clone(), now.cost);
            let mut part = (LONGEST_RAD / turn).min(1.0);
            let next = loop {
                self.trajectory.correct(&self.knots, &correction, part);
                let next = self.at(&problem, log, course)?;
                if next.cost < cost {
                    break Some(next);
                }
                self.trajectory = before.clone();
                part /= 2.0;
                if part < LEAST_PART {
                    break None;
                }
            };
            let Some(next) = next else {
                self.gain = 0.0;
                return Ok(false);
            };
            (self.gain, self.chance) = (cost - next.cost, next.chance());
            now = next;
        }
        Ok(true)
    }

    /// What the log leaves along the trajectory, with the calibration as a problem has it.
    fn at(&self, problem: &Problem, log: &Log, course: (&Course, &Start)) -> Result<At, CaseError> {
        let twin = self.twin(log, problem.twin.unit(), problem.twin.environment())?;
        let mut prior = prior::off(&log.start_s, &self.trajectory, course, &self.knots, &self.still());
        prior.extend(self.ties.rows(&self.trajectory, &self.knots).iter().map(|row| row.off));
        let track = self.ties.aligned(&self.trajectory).map(|aligned| aligned.off);
        let mut cost: f64 = prior.iter().map(|off| off * off).sum();
        cost += track.as_ref().map_or(0.0, DVector::norm_squared);
        let mut residuals = Entries::new();
        let mut memory = Memory::default();
        for (channel, frame) in problem.frames.iter().enumerate() {
            let predicted = twin.channel_with(channel, &[], &mut memory);
            let samples = (frame.series.rows.iter().zip(&frame.series.values)).zip(frame.weights.iter());
            let values = samples.map(|((row, value), weight)| (value - predicted[*row as usize]) / weight);
            let residual = DVector::from_iterator(frame.weights.len(), values);
            cost += residual.norm_squared() - frame.open_part(&residual).norm_squared();
            residuals.push((channel, residual));
        }
        Ok(At {
            cost,
            residuals,
            prior,
            track,
        })
    }

    /// Whether the last step turned nothing any more, and made the residuals no smaller than chance makes them.
    pub fn is_settled(&self) -> bool {
        self.turns.last().is_some_and(|turn| *turn < SETTLED_RAD) && self.gain.abs() < self.chance
    }

    /// \[s\] pieces of a log that nothing ties to the others, and in which the unit falls: there no sensor shows a turn about the field, and
    /// the rotation of the Earth, the one thing left that does, has a curvature that a step takes for another. An attitude
    /// that is told there ties it.
    pub fn lost(&self, starts_s: &[f64], holes: &Holes) -> Vec<(f64, f64)> {
        let pieces = holes.pieces(starts_s);
        if pieces.len() < 2 {
            return Vec::new();
        }
        let light = LIGHT * self.trajectory.gravity();
        let is_lost = |(from_s, to_s): &(f64, f64)| {
            let is_in = |t_s: f64| (*from_s..=*to_s).contains(&t_s);
            let is_told = self.ties.attitudes.all.iter().any(|own| is_in(own.t_s));
            let falls = |t_s: &f64| self.trajectory.state(*t_s).force_b.norm() < light;
            let own = || starts_s.iter().copied().filter(|t_s| is_in(*t_s));
            !is_told && own().filter(falls).count() as f64 >= FALLS * own().count() as f64
        };
        pieces.into_iter().filter(is_lost).collect()
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
        self.with(problem, (course, start), Slopes::OfSteps)
    }

    /// The same where its covariance is another: in free fall. None elsewhere.
    pub fn in_free_fall(&self, problem: &Problem, course: &Course, start: &Start) -> Option<Smoothing> {
        let gravity = self.trajectory.gravity();
        let is_light = |state: &State| state.force_b.norm() < LIGHT * gravity;
        let is_any = self.trajectory.states.iter().any(is_light);
        is_any.then(|| self.with(problem, (course, start), Slopes::Known))
    }

    fn with(&self, problem: &Problem, course: (&Course, &Start), slopes: Slopes) -> Smoothing {
        let beside = self.ties.rows(&self.trajectory, &self.knots);
        let motion = Smoothing::of(
            problem,
            &self.trajectory,
            course,
            self.knots,
            &self.still(),
            beside,
            slopes,
        );
        match self.ties.aligned(&self.trajectory) {
            Some(aligned) => motion.tied(&self.ties.fixes, &aligned, &self.trajectory),
            None => motion,
        }
    }

    fn still(&self) -> Vec<((f64, f64), f64)> {
        self.rests.iter().map(|span| (*span, STILL)).collect()
    }
}

/// What marginalised the calibration about a motion nearby, where there was one.
type Near = Option<Cholesky<f64, Dyn>>;

/// The motion's part of what the calibration leaves of a residual, in a space in which that may be open still. From one motion to the next
/// the calibration's matrix changes little, so the factor of one serves others. A step that will be followed by others need not be exact.
fn motion_part(
    space: &mut Space,
    residual: Entries,
    prior: &DVector<f64>,
    near: &mut Near,
    last: Option<&f64>,
) -> DVector<f64> {
    let share = if last.is_some_and(|turn| *turn > LINEAR_RAD) {
        FAR
    } else {
        NEAR
    };
    let known = near.as_ref().filter(|_| space.factor().is_none());
    if let Some(part) = known.and_then(|near| space.motion_part_near(&residual, prior, near, share)) {
        return part;
    }
    if space.factor().is_none() {
        space.marginalise();
        *near = space.factor().cloned();
    }
    space.motion_part(&space.project_residual(residual, prior))
}

/// All rows of a log.
pub fn fit(log: &Log) -> Fit {
    Fit {
        channels: log.channels.clone(),
    }
}

/// Covariance of the attitude at instants \[s\]: of a turn in b \[rad2\], noise and calibration together.
///
/// `parts` are what the motion can imitate of calibration and nulls ([`Space::open_parts`]).
pub fn covariances(space: &Space, motion: &Smoothing, parts: DMatrix<f64>, instants_s: &[f64]) -> Vec<Matrix3<f64>> {
    let mut moved = motion.turned(parts, instants_s);
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
