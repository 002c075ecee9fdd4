//! The motion about which everything is linear: attitude, rate and acceleration at equal steps, consistent with each other.
//!
//! In: the smoothed courses of [`crate::parity::course`] to begin with, and corrections after. Out: [`Scene`], and the state at any node.
//!
//! A correction is a turn `th` and a specific force `s`, both in b. With the right Jacobian of the rotation group
//! (Chirikjian 2012, 10.86) and `u = J_r(th) th'`
//!
//! ```text
//! q  -> q exp(th)      w -> exp(-th) w + u      w' -> exp(-th) w' - u x (exp(-th) w) + u'      f -> f + s
//! ```
//!
//! so that the rate stays the derivative of the attitude however large a correction is, and so that one turn of the whole flight in
//! n changes neither a rate nor a force: gyros and accelerometers are as they were, however hard a motor pushes.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use twin::{
    environment::Environment,
    predict::{Feel, Scene},
};

use crate::{
    parity::course::Start,
    parity::smooth::{basis::Knots, rows::UNKNOWNS},
    parity::turning,
};

/// \[s\] between nodes.
const STEP_S: f64 = 0.02;

/// Steps of the integration between two nodes: the midpoint rule is then off by some 1e-5 rad/s where a hand turns the unit.
const SUBSTEPS: usize = 8;

/// \[s\] of a difference quotient, short beside the distance of knots.
const SHORT_S: f64 = 1e-4;

/// A state of the centre of the unit.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// Body to north-east-down.
    pub q_nb: UnitQuaternion<f64>,
    /// [rad/s] inertial.
    pub rate_b: Vector3<f64>,
    /// [rad/s2]
    pub rate_dot_b: Vector3<f64>,
    /// [m/s2] specific force at the centre.
    pub force_b: Vector3<f64>,
}

/// States at equal steps.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// \[s\] of the first.
    pub from_s: f64,
    /// All.
    pub states: Vec<State>,
    /// \[degC\] at the same steps.
    temperatures_c: Vec<f64>,
    environment: Environment,
}

impl Trajectory {
    /// To begin with, over all knots: `begun` has the first attitude, the forces and the temperatures.
    pub fn of(start: &Start, knots: &Knots, begun: &Scene, environment: &Environment) -> Self {
        let (from_s, to_s) = knots.span_s();
        let nodes = ((to_s - from_s) / STEP_S).ceil() as usize;
        let earth_n = environment.earth_rate_n();
        let mut q_nb = begun.feel(from_s).q_nb;
        let mut states = Vec::with_capacity(nodes + 1);
        let mut temperatures_c = Vec::with_capacity(nodes + 1);
        for node in 0..=nodes {
            let t_s = from_s + node as f64 * STEP_S;
            states.push(State {
                q_nb,
                rate_b: start.rate(t_s),
                rate_dot_b: start.rate_dot(t_s),
                force_b: begun.feel(t_s).force_b,
            });
            temperatures_c.push(begun.feel(t_s).temperature_c);
            let step_s = STEP_S / SUBSTEPS as f64;
            for substep in 0..SUBSTEPS {
                let rate_b = start.rate(t_s + (substep as f64 + 0.5) * step_s) - q_nb.inverse() * earth_n;
                q_nb *= UnitQuaternion::from_scaled_axis(rate_b * step_s);
            }
        }
        Self {
            from_s,
            states,
            temperatures_c,
            environment: *environment,
        }
    }

    /// \[s\] between nodes.
    pub fn step_s(&self) -> f64 {
        STEP_S
    }

    /// \[s\] of the first node and of the last.
    pub fn span_s(&self) -> (f64, f64) {
        (self.from_s, self.at_s(self.states.len() - 1))
    }

    /// \[s\] of a node.
    pub fn at_s(&self, node: usize) -> f64 {
        self.from_s + node as f64 * STEP_S
    }

    /// The node nearest to an instant.
    pub fn nearest(&self, t_s: f64) -> usize {
        let at = ((t_s - self.from_s) / STEP_S).round().max(0.0) as usize;
        at.min(self.states.len() - 1)
    }

    /// The state at an instant, on the line between two nodes.
    pub fn state(&self, t_s: f64) -> State {
        let at = ((t_s - self.from_s) / STEP_S).floor().max(0.0) as usize;
        let at = at.min(self.states.len() - 2);
        let part = (t_s - self.at_s(at)) / STEP_S;
        let (before, after) = (&self.states[at], &self.states[at + 1]);
        State {
            q_nb: self.attitude(t_s),
            rate_b: before.rate_b.lerp(&after.rate_b, part),
            rate_dot_b: before.rate_dot_b.lerp(&after.rate_dot_b, part),
            force_b: before.force_b.lerp(&after.force_b, part),
        }
    }

    /// The attitude at an instant: that of the nearest node, carried on.
    pub fn attitude(&self, t_s: f64) -> UnitQuaternion<f64> {
        let node = self.nearest(t_s);
        let state = &self.states[node];
        let rate_b = state.rate_b - state.q_nb.inverse() * self.environment.earth_rate_n();
        let since_s = t_s - self.at_s(node);
        state.q_nb * UnitQuaternion::from_scaled_axis(since_s * (rate_b + 0.5 * since_s * state.rate_dot_b))
    }

    /// [m/s2] of gravity.
    pub fn gravity(&self) -> f64 {
        self.environment.gravity
    }

    /// [m/s2] acceleration of a state in its own frame: `f + C_bn g`.
    pub fn acceleration_b(&self, state: &State) -> Vector3<f64> {
        state.force_b + state.q_nb.inverse() * self.environment.gravity_n()
    }

    /// [rad/s3] and [m/s3] second derivative of the rate, and in b the change of the force as n has it, by differences of the nodes
    /// before and after an instant: what they miss of a ripple of the knots is a hundredth.
    pub fn changes(&self, t_s: f64) -> [Vector3<f64>; 2] {
        let at = ((t_s - self.from_s) / STEP_S).floor().max(0.0) as usize;
        let at = at.min(self.states.len() - 2);
        let (before, after) = (&self.states[at], &self.states[at + 1]);
        let to_b = self.attitude(t_s).inverse();
        let force = |state: &State| to_b * (state.q_nb * state.force_b);
        [
            (after.rate_dot_b - before.rate_dot_b) / STEP_S,
            (force(after) - force(before)) / STEP_S,
        ]
    }

    /// \[rad\] the largest turn that a correction asks for in these pieces of a log, whose coefficients are three of the turn and three of the
    /// force a knot.
    pub fn turn(&self, knots: &Knots, correction: &[f64], pieces: &[(f64, f64)]) -> f64 {
        let all = (0..self.states.len()).map(|node| self.at_s(node));
        let seen = all.filter(|t_s| !turning::is_in_hole(pieces, *t_s));
        seen.map(|t_s| part_of(knots, correction, t_s, 0, 0).norm())
            .fold(0.0, f64::max)
    }

    /// Takes a part of a correction.
    pub fn correct(&mut self, knots: &Knots, correction: &[f64], part: f64) {
        let sum = |t_s: f64, order: usize, from: usize| part_of(knots, correction, t_s, order, from);
        // The rate that a turn adds, at an instant.
        let added = |t_s: f64| right_jacobian(&(part * sum(t_s, 0, 0))) * (part * sum(t_s, 1, 0));
        for node in 0..self.states.len() {
            let t_s = self.at_s(node);
            let turn = UnitQuaternion::from_scaled_axis(part * sum(t_s, 0, 0));
            let u = added(t_s);
            let u_dot = (added(t_s + SHORT_S) - added(t_s - SHORT_S)) / (2.0 * SHORT_S);
            let state = &mut self.states[node];
            let rate_b = turn.inverse() * state.rate_b;
            state.rate_dot_b = turn.inverse() * state.rate_dot_b - u.cross(&rate_b) + u_dot;
            state.rate_b = rate_b + u;
            state.q_nb *= turn;
            state.force_b += part * sum(t_s, 0, 3);
        }
    }

    /// What the unit feels along it.
    pub fn scene(&self) -> Scene {
        let mut q_before = self.states[0].q_nb.into_inner();
        let mut sign = 1.0;
        let rows: Vec<Feel> = (self.states.iter().zip(&self.temperatures_c))
            .map(|(state, temperature_c)| {
                // q and -q are one attitude, but not to a spline.
                let q = state.q_nb.into_inner();
                if q.dot(&q_before) < 0.0 {
                    sign = -sign;
                }
                q_before = q;
                Feel {
                    t_s: 0.0,
                    rate_b: state.rate_b,
                    rate_dot_b: state.rate_dot_b,
                    force_b: state.force_b,
                    field_b_ut: state.q_nb.inverse() * self.environment.field_n_ut,
                    temperature_c: *temperature_c,
                    temperature_rate: 0.0,
                    q_nb: UnitQuaternion::new_unchecked(q * sign),
                    position_n: Vector3::zeros(),
                    heading: 0.0,
                    heading_rate: 0.0,
                    heading_acc: 0.0,
                }
            })
            .collect();
        Scene::through(self.from_s, STEP_S, &rows)
    }
}

/// A derivative of a correction's turn, or from the third unknown on of its force.
fn part_of(knots: &Knots, correction: &[f64], t_s: f64, order: usize, from: usize) -> Vector3<f64> {
    let (first, weights) = knots.weights(t_s, order);
    let terms = weights.iter().enumerate();
    terms
        .map(|(at, weight)| {
            let own = &correction[UNKNOWNS * (first + at) + from..];
            Vector3::new(own[0], own[1], own[2]) * *weight
        })
        .sum()
}

/// `J_r` of a turn.
fn right_jacobian(turn: &Vector3<f64>) -> Matrix3<f64> {
    let angle = turn.norm();
    let cross = turn.cross_matrix();
    // Below a milliradian the next terms of both series are 1e-8.
    let (first, second) = if angle < 1e-3 {
        (0.5, 1.0 / 6.0)
    } else {
        (
            (1.0 - angle.cos()) / angle.powi(2),
            (angle - angle.sin()) / angle.powi(3),
        )
    };
    Matrix3::identity() - first * cross + second * cross * cross
}

#[cfg(test)]
mod tests {
    use twin::{motion::Tumble, predict::Scene};

    use super::*;

    /// Along a tumble about one place.
    fn tumbling() -> (Trajectory, Scene) {
        let environment = Environment::laboratory();
        let scene = Scene::new(&Tumble::new(), &environment, 19.0, 31.0, 0.01);
        let states = (0..=500).map(|node| {
            let feel = scene.feel(20.0 + STEP_S * f64::from(node));
            State {
                q_nb: feel.q_nb,
                rate_b: feel.rate_b,
                rate_dot_b: feel.rate_dot_b,
                force_b: feel.force_b,
            }
        });
        let trajectory = Trajectory {
            from_s: 20.0,
            states: states.collect(),
            temperatures_c: vec![25.0; 501],
            environment,
        };
        (trajectory, scene)
    }

    #[test]
    fn after_a_correction_the_rate_is_still_the_derivative_of_the_attitude() {
        let (mut trajectory, _) = tumbling();
        let knots = Knots::over((20.0, 30.0), 0.1);
        let correction: Vec<f64> = (0..6 * knots.coefficients())
            .map(|k| if k % 6 < 3 { 0.3 * (0.031 * k as f64).sin() } else { 0.0 })
            .collect();
        let asked = trajectory.turn(&knots, &correction, &[]);
        assert!((0.3..0.6).contains(&asked), "{asked}");
        trajectory.correct(&knots, &correction, 1.0);
        let earth_n = trajectory.environment.earth_rate_n();
        for node in 100..110 {
            let (before, now, after) = (
                &trajectory.states[node - 1],
                &trajectory.states[node],
                &trajectory.states[node + 1],
            );
            let turned = (before.q_nb.inverse() * after.q_nb).scaled_axis() / (2.0 * STEP_S);
            let rate_b = now.rate_b - now.q_nb.inverse() * earth_n;
            // A central difference is off by h^2/6 of a second derivative of some 10 rad/s3.
            assert!((turned - rate_b).norm() < 2e-3, "{turned} {rate_b}");
            let slope = (after.rate_b - before.rate_b) / (2.0 * STEP_S);
            assert!((slope - now.rate_dot_b).norm() < 0.05, "{slope} {}", now.rate_dot_b);
        }
    }
}
