//! Which gyro the vectors contradict.
//!
//! In, each cycle: the rate without each of the four gyros in turn, and the directions of acceleration and field. Out: the
//! gyro without which the rates turn the directions of some seconds ago into those of now, if it is one and one only.
//!
//! A direction fixed in n turns in b by `dv/dt = -w x v`. For each of the four hypotheses the directions at the start of a
//! stretch of up to [`STRETCH_S`] are carried along; a fault of gyro `i` by `b` turns every hypothesis but the `i`-th away
//! by `1.2 b t`. The cost of a hypothesis is half the squared angle between carried and measured, in variances: of the
//! directions, of the gyros' noise (as the square root of time) and of their biases (as time). Accepted is a hypothesis that
//! fits, with every other worse by [`MARGIN`], some thousand times less likely. What turns about the only direction there is (field
//! alone in micro-gravity) makes no difference and leaves the question open.

use nalgebra::Vector3;

use crate::{attitude::from_rotation_vector, geometry::PLATES};

/// \[s\] after which the directions of now are the new start.
const STRETCH_S: f32 = 10.0;
/// \[s\] before which noise says little.
const SHORTEST_S: f32 = 2.0;
/// Between the costs of the best and the second hypothesis.
const MARGIN: f32 = 8.0;
/// Variance of the worst component of a rate out of three gyros, in that of one: 2 1.054^2 + 0.667^2 (errata of section 3.4).
const OUT_OF_THREE: f32 = 2.7;
/// Cost up to which a hypothesis fits: chi-square of four degrees of freedom, 1e-4, halved.
const FITS: f32 = 12.0;

/// A measured direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction {
    /// Unit vector.
    pub(super) along_b: Vector3<f32>,
    /// \[rad2\] variance of either angle.
    pub(super) variance: f32,
}

/// How sure the rates are.
#[derive(Clone, Copy, Debug)]
pub(super) struct RateError {
    /// [rad/s] of the noise of one gyro in one cycle.
    pub(super) noise: f32,
    /// [rad/s] of a component of the bias that is left.
    pub(super) bias: f32,
}

/// A direction at the start of the stretch, carried along by the rate without each gyro.
#[derive(Clone, Copy, Debug)]
struct Carried {
    start: Direction,
    now_b: [Vector3<f32>; PLATES],
}

/// The stretch.
#[derive(Clone, Debug)]
pub(super) struct VectorRate {
    pub(super) error: RateError,
    carried: [Option<Carried>; 2],
    /// [rad/s] rates of the cycle before, and of the one before that.
    rates_b: [Option<[Vector3<f32>; PLATES]>; 2],
    elapsed_s: f32,
}

impl VectorRate {
    pub(super) fn new(error: RateError) -> Self {
        VectorRate {
            error,
            carried: [None; 2],
            rates_b: [None; 2],
            elapsed_s: 0.0,
        }
    }

    /// Forgets the stretch; the next cycle begins one.
    pub(super) fn pause(&mut self) {
        self.rates_b = [None; 2];
    }

    /// Takes a cycle: rates without each gyro, and acceleration and field where they are directions fixed in n.
    pub(super) fn step(
        &mut self,
        rates_b: Option<[Vector3<f32>; PLATES]>,
        dt_s: Option<f32>,
        directions: [Option<Direction>; 2],
    ) -> Option<usize> {
        let [before_b, earlier_b] = self.rates_b;
        self.rates_b = [rates_b, before_b];
        let (Some(now_b), Some(before_b), Some(dt_s)) = (rates_b, before_b, dt_s) else {
            self.rates_b = [rates_b, None];
            self.begin(directions);
            return None;
        };
        self.elapsed_s += dt_s;
        for k in 0..PLATES {
            // Through three points where there are (Adams and Moulton): a tumble at 5 Hz bends too much for two.
            let mean_b = match earlier_b {
                Some(earlier_b) => (now_b[k] * 5.0 + before_b[k] * 8.0 - earlier_b[k]) / 12.0,
                None => (now_b[k] + before_b[k]) / 2.0,
            };
            let back = from_rotation_vector(mean_b * -dt_s);
            for carried in self.carried.iter_mut().flatten() {
                carried.now_b[k] = back * carried.now_b[k];
            }
        }
        let guilty = if self.elapsed_s >= SHORTEST_S {
            self.contradicted(dt_s, directions)
        } else {
            None
        };
        if self.elapsed_s >= STRETCH_S || guilty.is_some() {
            self.begin(directions);
        }
        guilty
    }

    fn begin(&mut self, directions: [Option<Direction>; 2]) {
        self.elapsed_s = 0.0;
        self.carried = directions.map(|direction| {
            direction.map(|start| Carried {
                start,
                now_b: [start.along_b; PLATES],
            })
        });
    }

    fn contradicted(&self, dt_s: f32, directions: [Option<Direction>; 2]) -> Option<usize> {
        let drift = self.error.bias * self.elapsed_s;
        let walk = self.error.noise * self.error.noise * dt_s * self.elapsed_s;
        let turned = drift * drift + OUT_OF_THREE * walk;
        let mut costs = [0.0; PLATES];
        for (carried, now) in self.carried.iter().zip(directions) {
            let (Some(carried), Some(now)) = (carried, now) else {
                continue;
            };
            let variance = carried.start.variance + now.variance + turned;
            for (cost, expected_b) in costs.iter_mut().zip(carried.now_b) {
                *cost += (now.along_b - expected_b).norm_squared() / (2.0 * variance);
            }
        }
        let best = (0..PLATES).fold(0, |best, k| if costs[k] < costs[best] { k } else { best });
        let clear = (0..PLATES).all(|k| k == best || costs[k] > costs[best] + MARGIN);
        (costs[best] < FITS && clear).then_some(best)
    }
}

#[cfg(test)]
mod tests;
