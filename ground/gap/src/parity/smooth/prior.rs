//! What is known of a motion before its log is read: rows of how little it bends, jerks and accelerates.
//!
//! In: a trajectory, its knots, how lively it is. Out: [`Prior`] rows.
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
//! That row takes `|C_bn g|^2 = g^2` for the curvature of its energy `|f + C_bn g|^2` by a turn, which is `|f| g`: the same at rest, and nothing in free
//! fall, where no turn changes what accelerometers feel. Steps that have the smaller one no longer settle on a rocket, so they keep `g^2`; what
//! the attitude is known to once it has settled has the slopes by a turn times `sqrt(min(1, |f| / g))` ([`Prior::known`]).

use std::array::from_fn;

use nalgebra::Vector3;

use crate::{
    parity::course::{Course, Start},
    parity::smooth::{
        basis::{Knots, SUPPORT},
        rows::UNKNOWNS,
        trajectory::Trajectory,
    },
    parity::turning,
};

/// Times their sigmas, rows of the prior between two pieces of a log ([`turning`]): there nothing is known of the motion, and the
/// normal matrix has a factor all the same.
const LOOSE: f64 = 1e3;

/// A row of the prior: where it begins, what it says, what it is off by.
pub struct Prior {
    /// The first unknown.
    pub first: usize,
    /// Derivatives by the unknowns from there on.
    pub slopes: Vec<f64>,
    /// In its sigmas.
    pub off: f64,
    /// Part of the slopes by a turn that the curvature of its energy leaves.
    turning: f64,
}

impl Prior {
    /// Slopes that have the curvature of its energy.
    pub fn known(&self) -> Vec<f64> {
        let part = |at: usize| if at % UNKNOWNS < 3 { self.turning } else { 1.0 };
        let slopes = self.slopes.iter().enumerate();
        slopes.map(|(at, slope)| slope * part(at)).collect()
    }
}

/// What each prior row is off by along a trajectory, in its sigmas.
pub fn off(
    starts_s: &[f64],
    trajectory: &Trajectory,
    course: (&Course, &Start),
    knots: &Knots,
    rests: &[((f64, f64), f64)],
) -> Vec<f64> {
    let priors = all(starts_s, trajectory, course, knots, rests, false);
    priors.map(|prior| prior.off).collect()
}

/// A row at an instant that says that something is none within a sigma, and is what it is. Of each term: the order of the derivative, the
/// first of the three unknowns of a knot, and by how much each changes it.
pub fn row(knots: &Knots, t_s: f64, terms: &[(usize, usize, Vector3<f64>)], sigma: f64, is: f64) -> Prior {
    let weights = |order: usize| knots.weights(t_s, order).1;
    row_at(knots.weights(t_s, 0).0, &weights, terms, sigma, is)
}

/// The same where the first knot and the weights of each order are known.
fn row_at(
    first: usize,
    weights: &dyn Fn(usize) -> [f64; SUPPORT],
    terms: &[(usize, usize, Vector3<f64>)],
    sigma: f64,
    is: f64,
) -> Prior {
    let mut slopes = if terms.is_empty() {
        Vec::new()
    } else {
        vec![0.0; UNKNOWNS * SUPPORT]
    };
    for (order, from, by) in terms {
        for (at, weight) in weights(*order).iter().enumerate() {
            (0..3).for_each(|axis| slopes[UNKNOWNS * at + from + axis] += weight * by[axis] / sigma);
        }
    }
    Prior {
        first: UNKNOWNS * first,
        slopes,
        off: -is / sigma,
        turning: 1.0,
    }
}

/// All rows.
pub fn priors<'a>(
    starts_s: &'a [f64],
    trajectory: &'a Trajectory,
    course: (&'a Course, &'a Start),
    knots: &'a Knots,
    rests: &'a [((f64, f64), f64)],
) -> impl Iterator<Item = Prior> + 'a {
    all(starts_s, trajectory, course, knots, rests, true)
}

/// All rows, without slopes where only what they are off by is asked for.
fn all<'a>(
    starts_s: &'a [f64],
    trajectory: &'a Trajectory,
    (course, start): (&'a Course, &'a Start),
    knots: &'a Knots,
    rests: &'a [((f64, f64), f64)],
    has_slopes: bool,
) -> impl Iterator<Item = Prior> + 'a {
    let row = move |t_s: f64| {
        starts_s
            .partition_point(|start_s| *start_s < t_s)
            .min(starts_s.len() - 1)
    };
    let pieces = start.holes.pieces(starts_s);
    (0..knots.intervals).flat_map(move |interval| {
        let t_s = knots.from_s + (interval as f64 + 0.5) * knots.step_s;
        let weights: [(usize, [f64; SUPPORT]); 4] = from_fn(|order| knots.weights(t_s, order));
        let one = move |terms: &[(usize, usize, Vector3<f64>)], sigma: f64, is: f64| {
            let terms = if has_slopes { terms } else { &[] };
            row_at(weights[0].0, &|order| weights[order].1, terms, sigma, is)
        };
        let [bend, jerk] = trajectory.changes(t_s);
        let row = row(t_s);
        let loose = if turning::is_in_hole(&pieces, t_s) { LOOSE } else { 1.0 };
        // What the motion does in a hole is nothing that a step should make better.
        let counts = if loose > 1.0 { 0.0 } else { 1.0 };
        let rest = rests.iter().find(|((from_s, to_s), _)| (*from_s..*to_s).contains(&t_s));
        let state = trajectory.state(t_s);
        let (w, w_dot, f) = (state.rate_b, state.rate_dot_b, state.force_b);
        let acceleration = trajectory.acceleration_b(&state);
        let gravity = (acceleration - f).norm().max(f64::MIN_POSITIVE);
        let turning = (f.norm() / gravity).min(1.0).sqrt();
        (0..3).flat_map(move |axis| {
            let e = Vector3::ith(axis, 1.0);
            let turn = [
                (3, 0, e),
                (2, 0, e.cross(&w)),
                (1, 0, 2.0 * e.cross(&w_dot)),
                (0, 0, e.cross(&bend)),
            ];
            let turn = one(
                &turn,
                loose * course.rate_dot_sigmas[row] / start.knot_s,
                counts * bend[axis],
            );
            let by_rate = f.cross(&e);
            let moved = [
                (1, 3, e),
                (0, 3, e.cross(&w)),
                (1, 0, by_rate),
                (0, 0, by_rate.cross(&w)),
            ];
            let moved = one(&moved, loose * course.jerk_sigmas[row], counts * jerk[axis]);
            let acc_sigma = rest.map_or(loose * start.acc_sigmas[row], |(_, sigma)| *sigma);
            let still = [(0, 3, e), (0, 0, e.cross(&(acceleration - f)))];
            let still = Prior {
                turning,
                ..one(&still, acc_sigma, counts * acceleration[axis])
            };
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
