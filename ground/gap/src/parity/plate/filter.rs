//! The attitude of one plate over a whole log: an error-state Kalman filter over nodes, and a smoother backwards.
//!
//! In: [`Samples`], and a [`Model`] of what the plate and the field around it may do. Out: [`Course`]: the states of every node given the
//! whole log, their covariances, and the evidence of the model.
//!
//! Gyros carry the attitude from node to node, forces the velocity. With `q -> exp(th) q`, `th` in n, and `b` a bias, `K` scales and cross
//! axes of the gyros, `a` a bias of the accelerometers, the steps are
//!
//! ```text
//! th' = th - S b - T K          S, T: sums of a node ([`crate::parity::plate::node`])
//! v'  = v + (sum of f + g) + th x (sum of f) - S a
//! ```
//!
//! Seen is the mean field of a node, `y = B + e + n + R h + d R (w x m) - th x y`: `e` what any room adds to the field, `n` what is added beside
//! and stays in n (a magnet in the room), `h` what is fixed to the plate (iron, bias), `d` the delay of the magnetometers
//! against the gyros, which nothing but a reference could tell from other motions, and which is free therefore. And once a second the velocity, which is none within what a unit that stays about a place
//! may have: a tilt of `t` rad makes `9.8 t` m/s a second of velocity that is not there.
//!
//! Backwards it is the fixed-interval smoother of Rauch et al. (1965), its errors those of the group.

use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};

use super::{
    node::{Calibration, Node},
    samples::Samples,
};

/// States: th, b, v, h, e, d, K, a, n.
const STATES: usize = 31;
const BIAS: usize = 3;
const VELOCITY: usize = 6;
const IRON: usize = 9;
const PLACE: usize = 12;
const DELAY: usize = 15;
const MATRIX: usize = 16;
const FORCE_BIAS: usize = 25;
const BESIDE: usize = 28;

/// \[s\] between nodes: the field of a place changes little within it, and ten minutes are 3000 nodes.
pub const NODE_S: f64 = 0.2;

/// \[s\] between looks at the velocity: for so long a hand's velocity stays alike.
const VELOCITY_S: f64 = 1.0;

/// [m/s] of a unit that stands still, assumed: a table that shakes by a millimetre at a hertz.
const STILL_M_S: f64 = 0.005;

/// What holds the velocity of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stay {
    /// It stands still.
    Still,
    /// It stays about a place.
    About,
    /// Nothing: it flies.
    Flies,
}

type State = SVector<f64, STATES>;
type Square = SMatrix<f64, STATES, STATES>;

/// What a plate and the field around it may do: standard deviations.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    /// \[uT\] field in n, and [m/s2] gravity, positive down.
    pub field_n_ut: Vector3<f64>,
    /// [m/s2]
    pub gravity_m_s2: f64,
    /// [rad/s] of a gyro's sample, and of its bias.
    pub gyro: [f64; 2],
    /// Of gyro scales and cross axes.
    pub matrix: [f64; 2],
    /// Of what a turn is off by beyond scales and cross axes.
    pub bent: f64,
    /// [m/s2] of an accelerometer's sample, and of its bias; and of its scale.
    pub force: [f64; 3],
    /// \[uT\] of the mean field of a node: one sample's, for neighbours need not be independent.
    pub field: f64,
    /// \[s\] delay of the magnetometers against the gyros.
    pub delay_s: f64,
    /// \[uT\] iron at the begin, and [uT/sqrt(s)] how it wanders.
    pub iron: [f64; 2],
    /// The same of what stays in n.
    pub beside: [f64; 2],
    /// \[uT\] what the place adds, and \[s\] for how long it is alike.
    pub place: [f64; 2],
    /// [m/s] how fast a unit moves that stays about a place.
    pub velocity: f64,
    /// \[rad\] tilt and heading at the begin.
    pub begin: [f64; 2],
}

/// A node, given the whole log.
#[derive(Clone, Debug)]
pub struct At {
    /// \[s\]
    pub t_s: f64,
    /// Body to n.
    pub q_nb: UnitQuaternion<f64>,
    /// The others; the first three are nothing.
    pub state: State,
    /// Theirs; the first three of a turn in n.
    pub covariance: Square,
    /// Whether it rests.
    pub is_rest: bool,
}

impl At {
    /// \[uT\] what is fixed to the plate, in b.
    pub fn iron(&self) -> Vector3<f64> {
        self.state.fixed_rows::<3>(IRON).into_owned()
    }

    /// \[uT\] what is added and stays in n.
    pub fn beside(&self) -> Vector3<f64> {
        self.state.fixed_rows::<3>(BESIDE).into_owned()
    }

    /// \[rad\] one sigma of a turn about each axis of b.
    pub fn sigmas_b(&self) -> Vector3<f64> {
        let of_n: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(0, 0).into_owned();
        let dcm = *self.q_nb.to_rotation_matrix().matrix();
        (dcm.transpose() * of_n * dcm).diagonal().map(|own| own.max(0.0).sqrt())
    }
}

/// A log along a model.
pub struct Course {
    /// Rising.
    pub nodes: Vec<At>,
    /// \[nats\] evidence of the model.
    pub evidence: f64,
    /// Mean square of what a look at the field and at the velocity was off by, in its sigmas, a degree of freedom.
    pub misfit: [f64; 2],
}

/// One step forwards.
struct Step {
    filtered: At,
    predicted: (UnitQuaternion<f64>, State, Square),
    transition: Square,
}

/// Rate samples at which nodes begin, and the last.
pub fn begins(samples: &Samples) -> Vec<usize> {
    let t_s = &samples.rates.t_s;
    let mut begins = vec![0];
    for (at, own_s) in t_s.iter().enumerate() {
        if own_s - t_s[begins[begins.len() - 1]] >= NODE_S - 1e-9 {
            begins.push(at);
        }
    }
    begins
}

impl Course {
    /// Of a log whose attitude is about this at the begin; `stays` says of every node what holds its velocity.
    pub fn of(samples: &Samples, begins: &[usize], stays: &[Stay], begin: UnitQuaternion<f64>, model: &Model) -> Self {
        let mut steps = Vec::with_capacity(begins.len());
        let (evidence, misfit) = forwards(samples, begins, stays, begin, model, &mut |step| steps.push(step));
        Self {
            nodes: backwards(steps),
            evidence,
            misfit,
        }
    }
}

/// \[nats\] evidence of a model: every look is predicted from those before it alone.
pub fn evidence(samples: &Samples, begins: &[usize], stays: &[Stay], begin: UnitQuaternion<f64>, model: &Model) -> f64 {
    forwards(samples, begins, stays, begin, model, &mut |_| ()).0
}

/// Where it begins.
fn begun(t_s: f64, q_nb: UnitQuaternion<f64>, model: &Model) -> At {
    let mut sigmas = State::zeros();
    let mut put = |from: usize, size: usize, sigma: f64| (from..from + size).for_each(|at| sigmas[at] = sigma);
    put(0, 2, model.begin[0]);
    put(2, 1, model.begin[1]);
    put(BIAS, 3, model.gyro[1]);
    put(VELOCITY, 3, model.velocity);
    put(IRON, 3, model.iron[0]);
    put(PLACE, 3, model.place[0]);
    put(BESIDE, 3, model.beside[0]);
    put(DELAY, 1, model.delay_s);
    put(MATRIX, 9, model.matrix[1]);
    (0..3).for_each(|axis| sigmas[MATRIX + 4 * axis] = model.matrix[0]);
    let variances = sigmas.map(|sigma| (sigma * sigma).max(1e-18));
    let mut covariance = Square::from_diagonal(&variances);
    (0..3).for_each(|axis| covariance[(FORCE_BIAS + axis, FORCE_BIAS + axis)] = model.force[1].powi(2));
    At {
        t_s,
        q_nb,
        state: State::zeros(),
        covariance,
        is_rest: false,
    }
}

fn forwards(
    samples: &Samples,
    begins: &[usize],
    stays: &[Stay],
    begin: UnitQuaternion<f64>,
    model: &Model,
    keep: &mut dyn FnMut(Step),
) -> (f64, [f64; 2]) {
    let (t_s, usual_s) = (&samples.rates.t_s, samples.step_s());
    let mut now = begun(t_s[0], begin, model);
    let (mut evidence, mut misfit, mut looks) = (0.0, [0.0; 2], [0.0; 2]);
    let mut looked_s = t_s[0];
    for (pair, stay) in begins.windows(2).zip(stays) {
        let bias: Vector3<f64> = now.state.fixed_rows::<3>(BIAS).into_owned();
        let matrix = Matrix3::from_fn(|row, column| now.state[MATRIX + 3 * row + column]);
        let node = Node::of(
            samples,
            (pair[0], pair[1]),
            now.q_nb,
            Calibration { bias, matrix },
            usual_s,
        );
        let (transition, noise) = moved(&node, model, usual_s);
        let mut state = transition * now.state;
        // What the gyros are off by is in the attitude already.
        state.fixed_rows_mut::<3>(0).fill(0.0);
        let gravity_n = Vector3::new(0.0, 0.0, model.gravity_m_s2);
        let mut velocity = state.fixed_rows_mut::<3>(VELOCITY);
        velocity += node.force_n + gravity_n * node.lasts_s;
        let covariance = transition * now.covariance * transition.transpose() + noise;
        let mut next = At {
            t_s: t_s[pair[1]],
            q_nb: node.q_nb,
            state,
            covariance,
            is_rest: *stay == Stay::Still,
        };
        let predicted = (next.q_nb, next.state, next.covariance);
        let mut look = |kind: usize, slopes: &SMatrix<f64, 3, STATES>, off: Vector3<f64>, sigma: f64, next: &mut At| {
            let (chance, square) = seen(next, slopes, off, sigma);
            evidence += chance;
            misfit[kind] += square;
            looks[kind] += 3.0;
        };
        if let Some((field_n, attitude, change)) = &node.field {
            let mut slopes = SMatrix::<f64, 3, STATES>::zeros();
            slopes.fixed_columns_mut::<3>(0).copy_from(&field_n.cross_matrix());
            slopes.fixed_columns_mut::<3>(IRON).copy_from(attitude);
            slopes.fixed_columns_mut::<3>(PLACE).copy_from(&Matrix3::identity());
            slopes.fixed_columns_mut::<3>(BESIDE).copy_from(&Matrix3::identity());
            slopes.fixed_columns_mut::<1>(DELAY).copy_from(change);
            let off = field_n - model.field_n_ut - slopes * next.state;
            look(0, &slopes, off, model.field, &mut next);
        }
        let sigma = match stay {
            Stay::Still => Some(STILL_M_S),
            Stay::About => (next.t_s - looked_s >= VELOCITY_S).then_some(model.velocity),
            Stay::Flies => None,
        };
        if let Some(sigma) = sigma {
            looked_s = next.t_s;
            let mut slopes = SMatrix::<f64, 3, STATES>::zeros();
            slopes.fixed_columns_mut::<3>(VELOCITY).copy_from(&Matrix3::identity());
            let off = -(slopes * next.state);
            look(1, &slopes, off, sigma, &mut next);
        }
        keep(Step {
            filtered: now,
            predicted,
            transition,
        });
        now = next;
    }
    keep(Step {
        predicted: (now.q_nb, now.state, now.covariance),
        transition: Square::identity(),
        filtered: now,
    });
    let mean = [0, 1].map(|kind| misfit[kind] / f64::max(looks[kind], 1.0));
    (evidence, mean)
}

/// How a node moves the states, and what it adds to their covariance.
fn moved(node: &Node, model: &Model, step_s: f64) -> (Square, Square) {
    let mut transition = Square::identity();
    let mut put = |row: usize, column: usize, block: &Matrix3<f64>| {
        transition.fixed_view_mut::<3, 3>(row, column).copy_from(block);
    };
    put(0, BIAS, &-node.turned);
    put(VELOCITY, 0, &-node.force_n.cross_matrix());
    put(VELOCITY, FORCE_BIAS, &-node.turned);
    let alike = (-node.lasts_s / model.place[1]).exp();
    put(PLACE, PLACE, &(Matrix3::identity() * alike));
    transition.fixed_view_mut::<3, 9>(0, MATRIX).copy_from(&-node.by_matrix);
    let mut noise = Square::zeros();
    let mut put = |from: usize, variance: f64| (from..from + 3).for_each(|at| noise[(at, at)] = variance);
    let turned = model.bent * node.angle;
    let missed = node.missed * node.missed;
    put(
        0,
        model.gyro[0].powi(2) * step_s * node.lasts_s + turned * turned + missed,
    );
    // What scales make of a force that is not gravity's is as long as the push is.
    let pushed = model.force[2] * node.pushed;
    put(
        VELOCITY,
        model.force[0].powi(2) * step_s * node.lasts_s + pushed * pushed,
    );
    put(IRON, model.iron[1].powi(2) * node.lasts_s);
    put(BESIDE, model.beside[1].powi(2) * node.lasts_s);
    put(PLACE, model.place[0].powi(2) * (1.0 - alike * alike));
    (transition, noise)
}

/// Takes three looks at once; their chance \[nats\], and the sum of squares in their sigmas.
fn seen(now: &mut At, slopes: &SMatrix<f64, 3, STATES>, off: Vector3<f64>, sigma: f64) -> (f64, f64) {
    let across = now.covariance * slopes.transpose();
    let spread = slopes * across + Matrix3::identity() * (sigma * sigma);
    let Some(inverse) = spread.try_inverse() else {
        return (0.0, 0.0);
    };
    let gain = across * inverse;
    let change = gain * off;
    now.covariance -= gain * across.transpose();
    now.covariance = 0.5 * (now.covariance + now.covariance.transpose());
    now.state += change;
    let turn: Vector3<f64> = change.fixed_rows::<3>(0).into_owned();
    now.q_nb = UnitQuaternion::from_scaled_axis(turn) * now.q_nb;
    now.state.fixed_rows_mut::<3>(0).fill(0.0);
    let square = off.dot(&(inverse * off));
    let normal = 3.0 * std::f64::consts::TAU.ln() + spread.determinant().ln();
    (-0.5 * (square + normal), square)
}

fn backwards(steps: Vec<Step>) -> Vec<At> {
    let mut nodes: Vec<At> = Vec::with_capacity(steps.len());
    for step in steps.into_iter().rev() {
        let mut own = step.filtered;
        let (q_nb, state, covariance) = step.predicted;
        if let Some(known) = nodes.last()
            && let Some(inverse) = covariance.cholesky()
        {
            let gain = inverse.solve(&(step.transition * own.covariance)).transpose();
            let mut off = known.state - state;
            let turn = (known.q_nb * q_nb.inverse()).scaled_axis();
            off.fixed_rows_mut::<3>(0).copy_from(&turn);
            let change = gain * off;
            own.state += change;
            let turn: Vector3<f64> = change.fixed_rows::<3>(0).into_owned();
            own.q_nb = UnitQuaternion::from_scaled_axis(turn) * own.q_nb;
            own.state.fixed_rows_mut::<3>(0).fill(0.0);
            own.covariance += gain * (known.covariance - covariance) * gain.transpose();
        }
        nodes.push(own);
    }
    nodes.reverse();
    nodes
}
