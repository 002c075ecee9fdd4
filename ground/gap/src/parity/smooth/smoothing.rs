//! The motion as one smooth course, eliminated: what a column or a residual keeps that no such course makes.
//!
//! In: the problem along a trajectory, its knots, and how far the course may bend. Out: [`Smoothing`]. With the rows `A` of
//! [`crate::parity::smooth::rows`] and the prior rows `P`, `N = A'A + P'P = L L'` is banded, and `<u, v> = u'v - (L^-1 A'u)'(L^-1 A'v)`
//! is what is left of a product once the motion is marginalised. This is a smoother in information form, with the same gains
//! for residual, calibration and every effect (Rosenberg 1973, de Jong 1991).
//!
//! Prior rows, at the middle of every interval, for they miss a ripple of the knots themselves otherwise: the second derivative of the
//! rate and the jerk are as far from nothing as the log's own second differences tell ([`crate::parity::course`]); they carry the
//! trajectory's own as their residual. With a turn `th`, a force `s` and `dw = th' + w x th`
//!
//! ```text
//! rate           th''' + w x th'' + 2 w' x th' + w'' x th
//! jerk           s' + w x s + dw x f
//! acceleration   s + (C_bn g) x th
//! ```
//!
//! A turn of the whole flight in n changes no rate and no force, and costs nothing but in the last row: that alone ties the attitude to
//! gravity. The acceleration is none, within what the size of the specific force leaves room for, and where the unit rests within much
//! less.
//!
//! The temperature of a row is free, as it is in [`crate::parity::packet`].

use std::cell::OnceCell;

use nalgebra::{DVector, Vector3};
use twin::predict::{Feel, Kind};

use crate::{
    library::products::Entries,
    null::problem::Problem,
    parity::smooth::{
        banded::{Banded, Factor, Inverse},
        basis::{Knots, SUPPORT},
        rows::{Rows, UNKNOWNS, width},
        trajectory::Trajectory,
    },
    parity::{
        course::{Course, Start},
        space::Elimination,
    },
};

/// A motion that is eliminated.
pub struct Smoothing {
    /// Where its knots are.
    pub knots: Knots,
    rows: Vec<Rows>,
    width: usize,
    factor: Factor,
    inverse: OnceCell<Inverse>,
    priors: Vec<Prior>,
    /// Rows of the log, and of each thermometer the row of every sample and its part of the temperature.
    log_rows: usize,
    warm: Vec<Vec<(usize, f64)>>,
}

/// A row of the prior: where it begins, what it says, what it is off by.
struct Prior {
    first: usize,
    slopes: Vec<f64>,
    off: f64,
}

impl Smoothing {
    /// About a trajectory; `rests` are the spans \[s\] in which the unit does not move from its place, with the standard deviation of its
    /// acceleration there.
    pub fn of(
        problem: &Problem,
        trajectory: &Trajectory,
        course: (&Course, &Start),
        knots: Knots,
        rests: &[((f64, f64), f64)],
    ) -> Self {
        let scene = trajectory.scene();
        let feel = |t_s: f64| -> Feel { scene.feel(t_s) };
        let width = width(problem, &knots);
        let channels = 0..problem.frames.len();
        let rows: Vec<Rows> = channels
            .map(|channel| Rows::of(problem, channel, &knots, &feel, width))
            .collect();
        let size = UNKNOWNS * (knots.coefficients() + width / UNKNOWNS);
        let mut normal = Banded::zeros(size, width);
        for own in &rows {
            for (first, slopes) in own.first.iter().zip(own.slopes.chunks_exact(width)) {
                normal.add(UNKNOWNS * first, slopes);
            }
        }
        let priors: Vec<Prior> = priors(problem.twin.starts_s(), trajectory, course, &knots, rests).collect();
        priors.iter().for_each(|prior| normal.add(prior.first, &prior.slopes));
        Self {
            knots,
            rows,
            width,
            inverse: OnceCell::new(),
            factor: normal.factor(),
            priors,
            log_rows: problem.twin.starts_s().len(),
            warm: warm(problem),
        }
    }

    /// `L^-1 P'r` of the prior rows, with what they are off by along the trajectory that they were made about.
    pub fn prior(&self) -> DVector<f64> {
        self.prior_of(self.priors.iter().map(|prior| prior.off))
    }

    /// The same with what they are off by along another.
    pub fn prior_of(&self, off: impl Iterator<Item = f64>) -> DVector<f64> {
        let mut right = vec![0.0; self.factor.size()];
        for (prior, off) in self.priors.iter().zip(off) {
            let own = right[prior.first..].iter_mut().zip(&prior.slopes);
            own.for_each(|(sum, slope)| *sum += slope * off);
        }
        self.factor.forward(&mut right);
        DVector::from_vec(right)
    }

    fn inverse(&self) -> &Inverse {
        self.inverse.get_or_init(|| self.factor.inverse())
    }

    /// The correction that a part comes to: coefficients of turn and force, knot by knot.
    pub fn correction(&self, part: &DVector<f64>) -> Vec<f64> {
        let mut solved = part.as_slice()[..self.factor.size()].to_vec();
        self.factor.backward(&mut solved);
        solved
    }

    /// Covariance of the turn at an instant \[rad2\] with the calibration known.
    pub fn covariance(&self, t_s: f64) -> [[f64; 3]; 3] {
        let (first, own) = self.turn_rows(t_s);
        std::array::from_fn(|one| {
            std::array::from_fn(|other| self.inverse().between(UNKNOWNS * first, &own[one], &own[other]))
        })
    }

    /// The first knot of a turn at an instant, and the weights of its three components from there on.
    pub fn turn_rows(&self, t_s: f64) -> (usize, [Vec<f64>; 3]) {
        let (first, weights) = self.knots.weights(t_s, 0);
        let component = |axis: usize| {
            let mut own = vec![0.0; UNKNOWNS * weights.len()];
            (weights.iter().enumerate()).for_each(|(at, weight)| own[UNKNOWNS * at + axis] = *weight);
            own
        };
        (first, [component(0), component(1), component(2)])
    }
}

impl Elimination for Smoothing {
    fn part(&self, column: &Entries) -> DVector<f64> {
        let size = self.factor.size();
        let mut part = DVector::zeros(size + self.log_rows);
        for (channel, values) in column {
            let own = &self.rows[*channel];
            let samples = own.first.iter().zip(own.slopes.chunks_exact(self.width));
            for ((first, slopes), value) in samples.zip(values.iter()).filter(|(_, value)| **value != 0.0) {
                let sum = &mut part.as_mut_slice()[UNKNOWNS * first..UNKNOWNS * first + self.width];
                sum.iter_mut()
                    .zip(slopes)
                    .for_each(|(sum, slope)| *sum += slope * value);
            }
            for ((row, share), value) in self.warm[*channel].iter().zip(values.iter()) {
                part[size + row] += share * value;
            }
        }
        self.factor.forward(&mut part.as_mut_slice()[..size]);
        part
    }

    fn imitated(&self, part: &DVector<f64>) -> Vec<DVector<f64>> {
        let size = self.factor.size();
        let solved = self.correction(part);
        let of_channel = |(own, warm): (&Rows, &Vec<(usize, f64)>)| {
            if !warm.is_empty() {
                let values = warm.iter().map(|(row, share)| share * part[size + row]);
                return DVector::from_iterator(warm.len(), values);
            }
            let samples = own.first.iter().zip(own.slopes.chunks_exact(self.width));
            let values = samples.map(|(first, slopes)| {
                let about = &solved[UNKNOWNS * first..UNKNOWNS * first + self.width];
                about.iter().zip(slopes).map(|(own, slope)| own * slope).sum()
            });
            DVector::from_iterator(own.first.len(), values)
        };
        self.rows.iter().zip(&self.warm).map(of_channel).collect()
    }

    fn free(&self, channel: usize) -> f64 {
        if !self.warm[channel].is_empty() {
            let taken: f64 = self.warm[channel].iter().map(|(_, share)| share * share).sum();
            return self.warm[channel].len() as f64 - taken;
        }
        let own = &self.rows[channel];
        let samples = own.first.iter().zip(own.slopes.chunks_exact(self.width));
        let taken: f64 = samples
            .map(|(first, slopes)| self.inverse().between(UNKNOWNS * first, slopes, slopes))
            .sum();
        own.first.len() as f64 - taken
    }
}

/// Of each thermometer, the row of every sample and its part of a unit vector along the temperature of that row.
fn warm(problem: &Problem) -> Vec<Vec<(usize, f64)>> {
    let channels = &problem.twin.unit().channels;
    let is_warm = |channel: usize| channels[channel].sensor == Kind::Thermometer;
    let mut squares = vec![0.0; problem.twin.starts_s().len()];
    for (channel, frame) in problem.frames.iter().enumerate() {
        if !is_warm(channel) {
            continue;
        }
        let samples = frame.series.rows.iter().zip(frame.weights.iter());
        samples.for_each(|(row, weight)| squares[*row as usize] += 1.0 / (weight * weight));
    }
    let of = |(channel, frame): (usize, &crate::null::problem::Frame)| -> Vec<(usize, f64)> {
        if !is_warm(channel) {
            return Vec::new();
        }
        let samples = frame.series.rows.iter().zip(frame.weights.iter());
        samples
            .map(|(row, weight)| (*row as usize, 1.0 / (weight * squares[*row as usize].sqrt())))
            .collect()
    };
    problem.frames.iter().enumerate().map(of).collect()
}

/// What each prior row is off by along a trajectory, in its sigmas.
pub fn off(
    starts_s: &[f64],
    trajectory: &Trajectory,
    course: (&Course, &Start),
    knots: &Knots,
    rests: &[((f64, f64), f64)],
) -> Vec<f64> {
    let priors = priors(starts_s, trajectory, course, knots, rests);
    priors.map(|prior| prior.off).collect()
}

fn priors<'a>(
    starts_s: &'a [f64],
    trajectory: &'a Trajectory,
    (course, start): (&'a Course, &'a Start),
    knots: &'a Knots,
    rests: &'a [((f64, f64), f64)],
) -> impl Iterator<Item = Prior> + 'a {
    let row = move |t_s: f64| {
        starts_s
            .partition_point(|start_s| *start_s < t_s)
            .min(starts_s.len() - 1)
    };
    let one = move |t_s: f64, terms: &[(usize, usize, Vector3<f64>)], sigma: f64, is: f64| {
        let first = knots.weights(t_s, 0).0;
        let mut slopes = vec![0.0; UNKNOWNS * SUPPORT];
        for (order, from, by) in terms {
            let (_, weights) = knots.weights(t_s, *order);
            for (at, weight) in weights.iter().enumerate() {
                (0..3).for_each(|axis| slopes[UNKNOWNS * at + from + axis] += weight * by[axis] / sigma);
            }
        }
        Prior {
            first: UNKNOWNS * first,
            slopes,
            off: -is / sigma,
        }
    };
    (0..knots.intervals).flat_map(move |interval| {
        let t_s = knots.from_s + (interval as f64 + 0.5) * knots.step_s;
        let [bend, jerk] = trajectory.changes(t_s);
        let row = row(t_s);
        let rest = rests.iter().find(|((from_s, to_s), _)| (*from_s..*to_s).contains(&t_s));
        let state = trajectory.state(t_s);
        let (w, w_dot, f) = (state.rate_b, state.rate_dot_b, state.force_b);
        let acceleration = trajectory.acceleration_b(&state);
        (0..3).flat_map(move |axis| {
            let e = Vector3::ith(axis, 1.0);
            let turn = [
                (3, 0, e),
                (2, 0, e.cross(&w)),
                (1, 0, 2.0 * e.cross(&w_dot)),
                (0, 0, e.cross(&bend)),
            ];
            let turn = one(t_s, &turn, course.rate_dot_sigmas[row] / start.knot_s, bend[axis]);
            let by_rate = f.cross(&e);
            let moved = [
                (1, 3, e),
                (0, 3, e.cross(&w)),
                (1, 0, by_rate),
                (0, 0, by_rate.cross(&w)),
            ];
            let moved = one(t_s, &moved, course.jerk_sigmas[row], jerk[axis]);
            let acc_sigma = rest.map_or(start.acc_sigmas[row], |(_, sigma)| *sigma);
            let still = [(0, 3, e), (0, 0, e.cross(&(acceleration - f)))];
            let still = one(t_s, &still, acc_sigma, acceleration[axis]);
            [turn, moved, still]
        })
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;
    use twin::{environment::Environment, motion::Tumble, predict::Scene};

    use super::*;

    /// A tumble of ten seconds, with all that is known of it.
    fn tumbling() -> (Trajectory, Course, Start, Knots, Vec<f64>) {
        let environment = Environment::laboratory();
        let scene = Scene::new(&Tumble::new(), &environment, 19.0, 31.0, 0.01);
        let starts_s: Vec<f64> = (0..50).map(|row| 20.0 + 0.2 * f64::from(row)).collect();
        let knots = Knots::over((20.0, 30.0), 0.1);
        let start = Start::at_will((20.0, 30.0), 0.2, 50);
        let trajectory = Trajectory::of(&start, &knots, &scene, &environment);
        let course = Course {
            scene,
            rate_dot_sigmas: vec![0.3; 50],
            jerk_sigmas: vec![0.5; 50],
        };
        (trajectory, course, start, knots, starts_s)
    }

    #[test]
    fn prior_rows_say_what_a_correction_changes() {
        let (mut trajectory, course, start, knots, starts_s) = tumbling();
        // A ripple of the knots is in it, and the ends are.
        let correction: Vec<f64> = (0..UNKNOWNS * knots.coefficients())
            .map(|k| 1e-4 * ((1.7 * k as f64).sin() + if (k / UNKNOWNS).is_multiple_of(2) { 0.5 } else { -0.5 }))
            .collect();
        let rests = [((22.0, 24.0), 0.01)];
        let about = (&course, &start);
        let priors: Vec<Prior> = priors(&starts_s, &trajectory, about, &knots, &rests).collect();
        let before: Vec<f64> = priors.iter().map(|prior| prior.off).collect();
        trajectory.correct(&knots, &correction, 1.0);
        let after = off(&starts_s, &trajectory, about, &knots, &rests);
        for kind in 0..3 {
            let (mut energy, mut missed) = (0.0, 0.0);
            for row in (kind..priors.len()).step_by(3) {
                let own = correction[priors[row].first..].iter().zip(&priors[row].slopes);
                let said: f64 = own.map(|(size, slope)| size * slope).sum();
                energy += said * said;
                missed += (before[row] - after[row] - said).powi(2);
            }
            // A difference of nodes misses sixteen thousandths of a ripple of the knots.
            assert!(missed.sqrt() < 0.03 * energy.sqrt(), "{kind}: {missed} of {energy}");
        }
    }

    #[test]
    fn a_turn_of_the_whole_flight_costs_nothing_but_gravity() {
        let (mut trajectory, course, start, knots, starts_s) = tumbling();
        let about = (&course, &start);
        let before = off(&starts_s, &trajectory, about, &knots, &[]);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.3, 0.2));
        trajectory
            .states
            .iter_mut()
            .for_each(|state| state.q_nb = turn * state.q_nb);
        let after = off(&starts_s, &trajectory, about, &knots, &[]);
        let changed = |kind: usize| -> f64 {
            let rows = (kind..before.len()).step_by(3);
            rows.map(|row| (after[row] - before[row]).abs()).fold(0.0, f64::max)
        };
        // The rate of the Earth is told apart from it by 7e-5 rad/s, which turns a force of ten by as much a second.
        assert!(changed(0) < 1e-9 && changed(1) < 1e-2, "{} {}", changed(0), changed(1));
        assert!(changed(2) > 1.0, "{}", changed(2));
    }
}
