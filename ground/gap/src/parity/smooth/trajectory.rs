//! The motion about which everything is linear: attitude, rate and acceleration at equal steps, consistent with each other.
//!
//! In: the smoothed courses of [`crate::parity::course`] to begin with, and corrections after. Out: [`Scene`], and the state at any node.
//!
//! A correction is a turn `th` in b and an acceleration `s` in n. With the right Jacobian of the rotation group
//! (Chirikjian 2012, 10.86) and `u = J_r(th) th'`
//!
//! ```text
//! q  -> q exp(th)      w -> exp(-th) w + u      w' -> exp(-th) w' - u x (exp(-th) w) + u'      a -> a + s
//! ```
//!
//! so that the rate stays the derivative of the attitude however large a correction is.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use twin::{
    environment::Environment,
    predict::{Feel, Scene},
};

use crate::{parity::course::Start, parity::smooth::basis::Knots};

/// \[s\] between nodes.
const STEP_S: f64 = 0.02;

/// Steps of the integration between two nodes: the midpoint rule is then off by some 1e-5 rad/s where a hand turns the unit.
const SUBSTEPS: usize = 8;

/// \[rad\] of one correction: beyond it the columns that asked for it no longer hold.
const LONGEST_RAD: f64 = 0.5;

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
    /// [m/s2] of the centre.
    pub acc_n: Vector3<f64>,
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
    /// To begin with: `begun` has the first attitude and the temperatures.
    pub fn of(start: &Start, begun: &Scene, environment: &Environment) -> Self {
        let (from_s, to_s) = start.span_s;
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
                acc_n: start.forces_n.at(t_s) + environment.gravity_n(),
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

    /// \[s\] of a node.
    pub fn at_s(&self, node: usize) -> f64 {
        self.from_s + node as f64 * STEP_S
    }

    /// \[s\] first and last node.
    pub fn span_s(&self) -> (f64, f64) {
        (self.from_s, self.at_s(self.states.len() - 1))
    }

    /// The node nearest to an instant.
    pub fn nearest(&self, t_s: f64) -> usize {
        let at = ((t_s - self.from_s) / STEP_S).round().max(0.0) as usize;
        at.min(self.states.len() - 1)
    }

    /// The state at an instant: that of the nearest node, its attitude carried on.
    pub fn attitude(&self, t_s: f64) -> UnitQuaternion<f64> {
        let node = self.nearest(t_s);
        let state = &self.states[node];
        let rate_b = state.rate_b - state.q_nb.inverse() * self.environment.earth_rate_n();
        let since_s = t_s - self.at_s(node);
        state.q_nb * UnitQuaternion::from_scaled_axis(since_s * (rate_b + 0.5 * since_s * state.rate_dot_b))
    }

    /// [rad/s3] and [m/s3] second derivative of the rate and jerk in n, by differences of the nodes about an instant.
    pub fn changes(&self, t_s: f64) -> [Vector3<f64>; 2] {
        let node = self.nearest(t_s).clamp(1, self.states.len() - 2);
        let (before, after) = (&self.states[node - 1], &self.states[node + 1]);
        [
            (after.rate_dot_b - before.rate_dot_b) / (2.0 * STEP_S),
            (after.acc_n - before.acc_n) / (2.0 * STEP_S),
        ]
    }

    /// Takes a correction, whose coefficients are three of the turn and three of the acceleration a knot, or so much of it that nothing
    /// turns by more than [`LONGEST_RAD`]. The largest turn \[rad\] that was asked for within a span \[s\].
    pub fn correct(&mut self, knots: &Knots, correction: &[f64], within_s: (f64, f64)) -> f64 {
        let sum = |t_s: f64, order: usize, from: usize| -> Vector3<f64> {
            let (first, weights) = knots.weights(t_s, order);
            let terms = weights.iter().enumerate();
            terms
                .map(|(at, weight)| {
                    let own = &correction[6 * (first + at) + from..];
                    Vector3::new(own[0], own[1], own[2]) * *weight
                })
                .sum()
        };
        let nodes = 0..self.states.len();
        let turns = nodes.map(|node| (self.at_s(node), sum(self.at_s(node), 0, 0).norm()));
        let (mut largest, mut asked): (f64, f64) = (0.0, 0.0);
        for (t_s, turn) in turns {
            largest = largest.max(turn);
            if (within_s.0..=within_s.1).contains(&t_s) {
                asked = asked.max(turn);
            }
        }
        let part = (LONGEST_RAD / largest).min(1.0);
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
            state.acc_n += part * sum(t_s, 0, 3);
        }
        asked
    }

    /// What the unit feels along it.
    pub fn scene(&self) -> Scene {
        let mut q_before = self.states[0].q_nb.into_inner();
        let mut sign = 1.0;
        let rows: Vec<Feel> = (self.states.iter().zip(&self.temperatures_c))
            .map(|(state, temperature_c)| {
                let to_b = state.q_nb.inverse();
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
                    force_b: to_b * (state.acc_n - self.environment.gravity_n()),
                    field_b_ut: to_b * self.environment.field_n_ut,
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

    /// Along a tumble, without an acceleration.
    fn tumbling() -> (Trajectory, Scene) {
        let environment = Environment::laboratory();
        let scene = Scene::new(&Tumble::new(), &environment, 19.0, 31.0, 0.01);
        let states = (0..=500).map(|node| {
            let feel = scene.feel(20.0 + STEP_S * f64::from(node));
            State {
                q_nb: feel.q_nb,
                rate_b: feel.rate_b,
                rate_dot_b: feel.rate_dot_b,
                acc_n: Vector3::zeros(),
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
        let asked = trajectory.correct(&knots, &correction, (20.0, 30.0));
        assert!((0.3..0.6).contains(&asked), "{asked}");
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
