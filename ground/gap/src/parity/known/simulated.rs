//! A trajectory that was simulated before the flight: a mean of the motion, with a distrust that its author states phase by phase.
//!
//! In: a file in the form of a reference's (`t_s,qw,qx,qy,qz`, `q_nb`, on the clock of the log, and perhaps `px_m,py_m,pz_m`), the phases of
//! the log, `[motion_known.distrust]`. Out: [`Simulated`]: rows for the smoother, and whether the trajectory is of this flight.
//!
//! What a simulation is off by stays alike through a phase: all rows of a phase together know no more than one. So each of its `n` rows
//! has `sqrt(n)` times the distrust. With `e` the turn from the simulated attitude to the smoothed one and `a` the simulated
//! acceleration in n they change by
//!
//! ```text
//! attitude       J_r(e)^-1 th                    (Chirikjian 2012, 10.86)
//! acceleration   s + (C_bn (g - a)) x th
//! ```
//!
//! Of this flight: with the motion as the log alone tells it, the mean over a phase of `e' (sigma^2 I + C)^-1 e`, `C` being the covariance
//! of the log's own attitude in the middle of it, has a chi-square law of three degrees of freedom where the error stays alike, and
//! scatters less about the same mean where it does not. So has the mean of the acceleration's, whose `C` is `[f]x C [f]x'` and the noise of
//! the accelerometers. Whether the errors of several phases go together (a heading does, a thrust does not) nobody states, so the sum
//! over phases has no law. It is of another flight where the least of the chances, times how many there are, is below one in a thousand
//! ([`SELDOM`]; Bonferroni, which holds whichever way they go together).
//!
//! Refuses a file without positions where a distrust of accelerations is stated.

use std::path::Path;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use twin::{
    motion::{Motion, Recorded},
    recording::Table,
};

use crate::{
    input::case::{CaseError, Distrust, Distrusts},
    parity::{
        phases::{Phase, Stretch},
        smooth::{
            basis::Knots,
            prior::{Prior, row},
            trajectory::{State, Trajectory},
        },
    },
    report::verdict::rounded,
    thresholds::SELDOM,
};

/// A stretch of the log in which a trajectory is believed within a distrust.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// Which phase.
    pub stretch: Stretch,
    /// How far.
    pub distrust: Distrust,
}

/// A trajectory that was simulated.
#[derive(Clone, Debug)]
pub struct Simulated {
    record: Recorded,
    /// Where it is believed.
    pub held: Vec<Held>,
}

impl Simulated {
    /// Of a file, along the phases of a log.
    ///
    /// # Errors
    /// When it cannot be read, or has no positions and needs them.
    pub fn open(path: &Path, distrusts: &Distrusts, phases: &[Stretch]) -> Result<Self, CaseError> {
        let record = Recorded::open(path)?;
        let has_positions = Table::open(path, &["px_m"])?.has("px_m");
        let (from_s, to_s) = record.span_s();
        let held: Vec<Held> = phases
            .iter()
            .filter_map(|stretch| {
                let distrust = of(distrusts, stretch.phase)?;
                let (from_s, to_s) = (stretch.from_s.max(from_s), stretch.to_s.min(to_s));
                let stretch = Stretch {
                    from_s,
                    to_s,
                    ..*stretch
                };
                (from_s < to_s).then_some(Held { stretch, distrust })
            })
            .collect();
        if !has_positions && held.iter().any(|own| own.distrust.acceleration_m_s2.is_some()) {
            let problem = "is absent, and a distrust of its acceleration is stated; add px_m,py_m,pz_m, or take acceleration_m_s2 out";
            return Err(CaseError::key(path, "px_m", problem));
        }
        Ok(Self { record, held })
    }

    /// Rows that hold a motion to it.
    pub fn rows(&self, trajectory: &Trajectory, knots: &Knots) -> Vec<Prior> {
        let mut rows = Vec::new();
        for held in &self.held {
            let instants_s: Vec<f64> = instants(held, knots).collect();
            let wider = (instants_s.len() as f64).sqrt();
            for t_s in instants_s {
                let (state, off) = self.off(trajectory, t_s);
                let by_turn = right_jacobian_inverse(&off.turn_b);
                let sigma = wider * held.distrust.attitude_deg.to_radians();
                for axis in 0..3 {
                    let by = by_turn.row(axis).transpose();
                    rows.push(row(knots, t_s, &[(0, 0, by)], sigma, off.turn_b[axis]));
                }
                let Some(sigma) = held.distrust.acceleration_m_s2 else {
                    continue;
                };
                let known_b = trajectory.acceleration_b(&state) - state.force_b - off.told_b;
                for axis in 0..3 {
                    let e = Vector3::ith(axis, 1.0);
                    let terms = [(0, 3, e), (0, 0, e.cross(&known_b))];
                    rows.push(row(knots, t_s, &terms, wider * sigma, off.acceleration_b[axis]));
                }
            }
        }
        rows
    }

    /// Instants \[s\] in the middle of the stretches that lie within knots, of which a covariance of the attitude is asked for.
    pub fn middles_s(&self, knots: &Knots) -> Vec<f64> {
        let middle = |held: &Held| {
            let own: Vec<f64> = instants(held, knots).collect();
            own.get(own.len() / 2).copied()
        };
        self.held.iter().filter_map(middle).collect()
    }

    /// Whether it is of the flight whose motion the log alone tells so, with the covariance of a turn in b at each of
    /// [`Simulated::middles_s`] and the noise of an accelerometer [m/s2].
    pub fn judged(&self, trajectory: &Trajectory, knots: &Knots, covariances: &[Matrix3<f64>], noise: f64) -> Belief {
        let mut energies = Vec::new();
        let mut worst: Option<Off> = None;
        let stretches = self.held.iter().filter(|held| instants(held, knots).next().is_some());
        for (held, covariance) in stretches.zip(covariances) {
            let offs: Vec<(State, At)> = instants(held, knots).map(|t_s| self.off(trajectory, t_s)).collect();
            let mut judge =
                |what: &'static str, stated: f64, unit: &'static str, own: &dyn Fn(&(State, At)) -> Apart| {
                    let (mut mean, mut square) = (0.0, 0.0);
                    for at in &offs {
                        let (off, more) = own(at);
                        let whole = more + Matrix3::identity() * stated.powi(2);
                        mean += whole.try_inverse().map_or(0.0, |inverse| off.dot(&(inverse * off)));
                        square += off.norm_squared() / 3.0;
                    }
                    let count = offs.len() as f64;
                    energies.push(mean / count);
                    if worst.as_ref().is_none_or(|known| known.energy < mean / count) {
                        worst = Some(Off {
                            phase: held.stretch.phase,
                            what,
                            energy: mean / count,
                            size: (square / count).sqrt(),
                            stated,
                            unit,
                        });
                    }
                };
            judge(
                "attitude",
                held.distrust.attitude_deg.to_radians(),
                "deg",
                &|(_, at)| (at.turn_b, *covariance),
            );
            if let Some(stated) = held.distrust.acceleration_m_s2 {
                judge("acceleration", stated, "m/s2", &|(state, at)| {
                    let by_turn = state.force_b.cross_matrix();
                    let more = by_turn * covariance * by_turn.transpose() + Matrix3::identity() * noise.powi(2);
                    (at.acceleration_b, more)
                });
            }
        }
        let Some(worst) = worst else {
            return Belief::Elsewhere;
        };
        let chance = chance(&energies);
        if chance < SELDOM {
            Belief::OfAnother(worst)
        } else {
            Belief::Used { chance, worst }
        }
    }

    /// How far a motion is from it.
    fn off(&self, trajectory: &Trajectory, t_s: f64) -> (State, At) {
        let (state, pose) = (trajectory.state(t_s), self.record.at(t_s));
        let to_b: UnitQuaternion<f64> = state.q_nb.inverse();
        let told_b = to_b * pose.acc_n;
        let at = At {
            turn_b: (pose.attitude.q_nb.inverse() * state.q_nb).scaled_axis(),
            acceleration_b: trajectory.acceleration_b(&state) - told_b,
            told_b,
        };
        (state, at)
    }
}

/// Probability at most that the largest of energies of three degrees of freedom each is as large, however they go together.
fn chance(energies: &[f64]) -> f64 {
    let largest = energies.iter().fold(0.0, |largest: f64, own| largest.max(*own));
    let one = ChiSquared::new(3.0).map_or(0.0, |law| law.sf(largest));
    (one * energies.len() as f64).min(1.0)
}

/// How far something is off, and the covariance of how well the log knows it.
type Apart = (Vector3<f64>, Matrix3<f64>);

/// How far a motion is from a simulated one, in b.
struct At {
    turn_b: Vector3<f64>,
    acceleration_b: Vector3<f64>,
    /// [m/s2] the simulated one.
    told_b: Vector3<f64>,
}

/// Where it is furthest off.
#[derive(Clone, Copy, Debug)]
pub struct Off {
    phase: Phase,
    what: &'static str,
    energy: f64,
    size: f64,
    stated: f64,
    unit: &'static str,
}

impl Off {
    /// In words.
    fn told(&self) -> String {
        let of = |size: f64| {
            if self.what == "attitude" {
                size.to_degrees()
            } else {
                size
            }
        };
        format!(
            "in {} its {} is off by {:.2} {} about each axis, where {:.2} are distrusted",
            self.phase.word(),
            self.what,
            of(self.size),
            self.unit,
            of(self.stated)
        )
    }
}

/// What became of a simulated trajectory.
#[derive(Clone, Copy, Debug)]
pub enum Belief {
    /// It is in; with the probability at most that one of this flight is as far off.
    Used {
        /// That.
        chance: f64,
        /// Where it is furthest off.
        worst: Off,
    },
    /// It is of another flight.
    OfAnother(Off),
    /// No phase in which it is believed lies in the fit windows.
    Elsewhere,
    /// With it the motion does not settle.
    Unsettled,
}

impl Belief {
    /// A line.
    pub fn line(&self) -> String {
        let told = match self {
            Belief::Used { chance, worst } => format!(
                "holds the motion; furthest off {}; as far by chance in {:.0} of 100 flights at most",
                worst.told(),
                100.0 * chance
            ),
            Belief::OfAnother(worst) => format!(
                "not used: this trajectory is not of this flight, or its clock is not the log's: {}; chance does that less than once \
                 in a thousand flights. Windows without a rest do not tell the log's own attitude well enough to judge by",
                worst.told()
            ),
            Belief::Elsewhere => {
                "not used: no phase whose distrust is stated lies in the fit windows and in its time".to_owned()
            }
            Belief::Unsettled => "not used: with it the motion does not settle".to_owned(),
        };
        format!("NOMINAL the simulated trajectory: {told}\n")
    }

    /// The same as JSON.
    pub fn json(&self) -> Value {
        let why = |why: &str| json!({ "is_used": false, "why": why });
        match self {
            Belief::Used { chance, worst } => {
                json!({ "is_used": true, "chance": rounded(*chance, 4), "furthest_off": worst.told() })
            }
            Belief::OfAnother(worst) => why(&format!("not of this flight: {}", worst.told())),
            Belief::Elsewhere => why("no phase whose distrust is stated lies in the fit windows and in its time"),
            Belief::Unsettled => why("with it the motion does not settle"),
        }
    }
}

/// Instants of rows: the middles of the intervals in a stretch.
fn instants(held: &Held, knots: &Knots) -> impl Iterator<Item = f64> {
    let (from_s, to_s, knots) = (held.stretch.from_s, held.stretch.to_s, *knots);
    let middles = (0..knots.intervals).map(move |interval| knots.from_s + (interval as f64 + 0.5) * knots.step_s);
    middles.filter(move |t_s| (from_s..to_s).contains(t_s))
}

fn of(distrusts: &Distrusts, phase: Phase) -> Option<Distrust> {
    match phase {
        Phase::Rest => distrusts.rest,
        Phase::Thrust => distrusts.thrust,
        Phase::Coast => distrusts.coast,
        Phase::Entry => distrusts.entry,
        Phase::Parachute => distrusts.parachute,
        Phase::Landed => distrusts.landed,
        // Lies across the others.
        Phase::Spin => None,
    }
}

/// `J_r^-1` of a turn of less than half a revolution.
pub fn right_jacobian_inverse(turn: &Vector3<f64>) -> Matrix3<f64> {
    let (angle, cross) = (turn.norm(), turn.cross_matrix());
    // Below a hundredth the next term of the series is 1e-7.
    let second = if angle < 1e-2 {
        1.0 / 12.0
    } else {
        1.0 / angle.powi(2) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    Matrix3::identity() + 0.5 * cross + second * cross * cross
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_that_all_phases_share_is_one_error_and_not_many() {
        // 1 in 27 each; were they five errors, their sum would be 1 in 5000.
        assert!(chance(&[8.5; 5]) > 0.1);
        // 16.3 is once in a thousand, and 21 once in ten thousand.
        assert!(chance(&[1.0, 17.0]) > SELDOM && chance(&[1.0, 21.0, 2.0]) < SELDOM);
        assert!((chance(&[0.0, 0.0]) - 1.0).abs() < f64::EPSILON);
    }

    #[test]
    fn the_right_jacobian_is_that_of_a_composed_turn() {
        for turn in [Vector3::new(0.003, -0.002, 0.004), Vector3::new(0.4, -0.9, 1.3)] {
            let small = Vector3::new(2e-6, -1e-6, 3e-6);
            let both = UnitQuaternion::from_scaled_axis(turn) * UnitQuaternion::from_scaled_axis(small);
            let moved = both.scaled_axis() - turn;
            let said = right_jacobian_inverse(&turn) * small;
            assert!((moved - said).norm() < 1e-4 * small.norm(), "{moved} {said}");
        }
    }
}
