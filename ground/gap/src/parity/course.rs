//! A smoothed motion from the packets alone: what every column is made about, and how far neighbours tell its changes.
//!
//! In: the log, the unit, its environment. Out: [`Course`]. Rates are a spline through all gyros, each at its own instant less
//! the delay of its low-pass. An attitude is carried along by them and slowly turned towards gravity (where the specific force
//! is about as large) and field ([`TURNS_TOWARDS_S`], the complementary filter of Mahony 2008). In the frame that it makes,
//! force and field change slowly, and are splines too.
//!
//! It needs to be right to some percent only: what it is off by is eliminated packet by packet ([`crate::parity::packet`]).
//! How far the derivatives may be off is taken from the second differences of the splines themselves, less what noise puts there.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector1, Vector3};
use twin::{
    environment::Environment,
    predict::{Channel, Feel, Kind, Scene, UnitDescription},
};

use crate::{
    input::log::Log,
    parity::{
        spline::{Sample, Spline},
        turning::Holes,
    },
};

/// \[s\] between the states of the scene; no part has a faster low-pass than some of these.
const STEP_S: f64 = 0.02;

/// \[s\] before the first and after the last row: low-passes begin at rest.
const MARGIN_S: f64 = 1.0;

/// \[s\] least distance of knots: faster logs resolve no more of a body's motion than this.
const KNOT_S: f64 = 0.05;

/// \[s\] over which the attitude follows gravity and field.
const TURNS_TOWARDS_S: f64 = 5.0;

/// \[s\] distance of knots of what gravity and field add: a start without steps is one that a smoother can mend.
const TOWARDS_KNOT_S: f64 = 0.5;

/// [rad/s] far above what they add: no smoothing but by the knots.
const TOWARDS_BEND: f64 = 1.0;

/// Part of gravity within which the specific force is taken for it.
const STEADY: f64 = 0.1;

/// How far neighbouring coefficients may be off a line: rates [rad/s], forces [m/s2], fields \[uT\], temperatures \[degC\]. Far above
/// the noise of a packet, so that the motion bends as it likes where it is seen.
const BENDS: [f64; 4] = [1.0, 5.0, 5.0, 0.02];

/// [rad/s3] and [m/s3] floors of what neighbours do not tell: what is stated for a unit on a table (1 rad/s3
/// a knot), and the noise that four plates leave in the slope of a spline with knots of 0.2 s.
const FLOORS: [f64; 2] = [1.0, 0.2];

/// Times the second difference: a derivative may be off by so many times what it changes from knot to knot.
const WIDER: f64 = 3.0;

/// \[s\] to either side over which a motion is as lively.
const ALIKE_S: f64 = 2.0;

/// The motion as the packets tell it.
pub struct Course {
    /// It, in its environment.
    pub scene: Scene,
    /// [rad/s2] row by row, how far the derivative of the rate may be off.
    pub rate_dot_sigmas: Vec<f64>,
    /// [m/s3] the same of the jerk.
    pub jerk_sigmas: Vec<f64>,
}

/// What a course was made of: where a smoother begins.
pub struct Start {
    /// \[s\] from where to where.
    pub span_s: (f64, f64),
    /// \[s\] distance of its knots.
    pub knot_s: f64,
    /// [m/s2] row by row, how far the acceleration may be off nothing.
    pub acc_sigmas: Vec<f64>,
    /// Where nobody knows how fast the unit turned.
    pub holes: Holes,
    rates: Spline<3>,
    /// [rad/s] what gravity and field add to the rates.
    towards: Spline<3>,
}

impl Start {
    /// [rad/s] rate of the attitude that follows gravity and field.
    pub fn rate(&self, t_s: f64) -> Vector3<f64> {
        self.rates.at(t_s) + self.towards.at(t_s)
    }

    /// [rad/s2] its derivative.
    pub fn rate_dot(&self, t_s: f64) -> Vector3<f64> {
        self.rates.derivative(t_s, 1) + self.towards.derivative(t_s, 1)
    }
}

#[cfg(test)]
impl Start {
    /// A unit that may do what it likes, in rows that many.
    pub fn at_will(span_s: (f64, f64), knot_s: f64, rows: usize) -> Self {
        let none = || Spline::fit(span_s, knot_s, 1.0, std::iter::empty());
        Self {
            span_s,
            knot_s,
            acc_sigmas: vec![1.0; rows],
            holes: Holes::default(),
            rates: none(),
            towards: none(),
        }
    }
}

impl Course {
    /// Of a log.
    pub fn of(log: &Log, unit: &UnitDescription, environment: &Environment) -> (Self, Start) {
        let (first, last) = (log.start_s[0], log.start_s[log.start_s.len() - 1]);
        let cycle_s = unit.cycle_s.unwrap_or(0.0);
        let span_s = (first - MARGIN_S, last + cycle_s + MARGIN_S);
        let mut steps: Vec<f64> = log.start_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let knot_s = steps[steps.len() / 2].max(KNOT_S);
        let readings = |kind: Kind| readings(log, unit, kind);
        let rates = Spline::fit(span_s, knot_s, BENDS[0], readings(Kind::Gyro).map(Reading::sample));
        let centred = |reading| centred(reading, &rates);
        let force_b = Spline::fit(
            span_s,
            knot_s,
            BENDS[1],
            readings(Kind::Accelerometer).map(|reading| centred(reading).sample()),
        );
        let field_b = Spline::fit(
            span_s,
            knot_s,
            BENDS[2],
            readings(Kind::Magnetometer).map(Reading::sample),
        );
        let turned = Turned::along(span_s, &rates, &force_b, &field_b, environment);
        let in_n = |reading: Reading| {
            let direction = turned.at(reading.t_s, &rates) * reading.channel.axis_b;
            Sample {
                direction,
                ..reading.sample()
            }
        };
        let forces_n = Spline::fit(
            span_s,
            knot_s,
            BENDS[1],
            readings(Kind::Accelerometer).map(|reading| in_n(centred(reading))),
        );
        let fields_n = Spline::fit(span_s, knot_s, BENDS[2], readings(Kind::Magnetometer).map(in_n));
        let warm = readings(Kind::Thermometer).map(|reading| Sample {
            t_s: reading.t_s,
            direction: Vector1::new(1.0),
            value: reading.value,
            sigma: reading.channel.sigma(),
        });
        let temperatures = Spline::fit(span_s, knot_s.max(1.0), BENDS[3], warm);
        let has_thermometer = unit.channels.iter().any(|channel| channel.sensor == Kind::Thermometer);
        let state = |(node, q_nb): (usize, &UnitQuaternion<f64>)| {
            let t_s = span_s.0 + node as f64 * STEP_S;
            Feel {
                t_s,
                rate_b: rates.at(t_s),
                rate_dot_b: rates.derivative(t_s, 1),
                force_b: q_nb.inverse() * forces_n.at(t_s),
                field_b_ut: q_nb.inverse() * fields_n.at(t_s),
                temperature_c: if has_thermometer {
                    temperatures.at(t_s).x
                } else {
                    environment.temperature_c
                },
                temperature_rate: 0.0,
                q_nb: *q_nb,
                position_n: Vector3::zeros(),
                heading: 0.0,
                heading_rate: 0.0,
                heading_acc: 0.0,
            }
        };
        let states: Vec<Feel> = turned.nodes.iter().enumerate().map(state).collect();
        let floor = |kind: Kind| {
            let own = unit.channels.iter().filter(|channel| channel.sensor == kind);
            own.map(Channel::sigma).fold(0.0, f64::max)
        };
        let open = |spline: &Spline<3>, kind: Kind| lively(spline, &log.start_s, knot_s, floor(kind));
        let course = Self {
            scene: Scene::through(span_s.0, STEP_S, &states),
            rate_dot_sigmas: (open(&rates, Kind::Gyro).iter())
                .map(|bend| knot_s * (FLOORS[0] + WIDER * bend))
                .collect(),
            jerk_sigmas: (open(&forces_n, Kind::Accelerometer).iter())
                .map(|bend| FLOORS[1] + WIDER * knot_s * bend)
                .collect(),
        };
        let start = Start {
            span_s,
            knot_s,
            towards: turned.towards(span_s),
            acc_sigmas: goes_nowhere(&forces_n, &log.start_s, environment.gravity),
            holes: Holes::default(),
            rates,
        };
        (course, start)
    }
}

/// What a channel read, and when, less the delay of its low-pass.
struct Reading<'a> {
    channel: &'a Channel,
    t_s: f64,
    value: f64,
}

impl Reading<'_> {
    fn sample(self) -> Sample<3> {
        Sample {
            t_s: self.t_s,
            direction: self.channel.axis_b,
            value: self.value,
            sigma: self.channel.sigma(),
        }
    }
}

/// What it would have read at the centre.
fn centred<'a>(reading: Reading<'a>, rates: &Spline<3>) -> Reading<'a> {
    let (w, w_dot) = (rates.at(reading.t_s), rates.derivative(reading.t_s, 1));
    let r = reading.channel.lever_m;
    let carried = w_dot.cross(&r) + w.cross(&w.cross(&r));
    let value = reading.value - reading.channel.axis_b.dot(&carried);
    Reading { value, ..reading }
}

fn readings<'a>(log: &'a Log, unit: &'a UnitDescription, kind: Kind) -> impl Iterator<Item = Reading<'a>> {
    let channels = unit.channels.iter().zip(&log.channels);
    channels
        .filter(move |(channel, _)| channel.sensor == kind)
        .flat_map(move |(channel, series)| {
            let after_s = channel.slot_s - channel.tau_s();
            series.rows.iter().zip(&series.values).map(move |(row, value)| Reading {
                channel,
                t_s: log.start_s[*row as usize] + after_s,
                value: value - channel.bias,
            })
        })
}

/// An attitude carried along by rates.
struct Turned {
    from_s: f64,
    nodes: Vec<UnitQuaternion<f64>>,
    /// [rad/s] at the same instants, what gravity and field add to the rates.
    towards: Vec<Vector3<f64>>,
}

impl Turned {
    fn along(
        span_s: (f64, f64),
        rates: &Spline<3>,
        force_b: &Spline<3>,
        field_b: &Spline<3>,
        environment: &Environment,
    ) -> Self {
        let (up_n, north_n) = (-environment.gravity_n(), environment.field_n_ut);
        let mut q_nb = triad(
            [up_n, north_n],
            [force_b.at(span_s.0 + MARGIN_S), field_b.at(span_s.0 + MARGIN_S)],
        );
        let steps = ((span_s.1 - span_s.0) / STEP_S).ceil() as usize;
        let mut nodes = Vec::with_capacity(steps + 1);
        let mut added = Vec::with_capacity(steps + 1);
        for step in 0..=steps {
            nodes.push(q_nb);
            let t_s = span_s.0 + step as f64 * STEP_S;
            let (force, field) = (force_b.at(t_s), field_b.at(t_s));
            let is_steady = (force.norm() - up_n.norm()).abs() < STEADY * up_n.norm();
            let towards = |seen_b: Vector3<f64>, known_n: Vector3<f64>| {
                let known_b = q_nb.inverse() * known_n;
                seen_b.cross(&known_b) / (seen_b.norm() * known_b.norm()).max(f64::EPSILON)
            };
            let mut off = towards(field, north_n);
            if is_steady {
                off += towards(force, up_n);
            }
            added.push(off / TURNS_TOWARDS_S);
            let rate = rates.at(t_s + 0.5 * STEP_S) + off / TURNS_TOWARDS_S;
            q_nb *= UnitQuaternion::from_scaled_axis(rate * STEP_S);
        }
        Self {
            from_s: span_s.0,
            nodes,
            towards: added,
        }
    }

    /// What gravity and field add, without steps.
    fn towards(&self, span_s: (f64, f64)) -> Spline<3> {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let samples = self.towards.iter().enumerate().flat_map(|(step, added)| {
            axes.map(|direction| Sample {
                t_s: self.from_s + step as f64 * STEP_S,
                direction,
                value: direction.dot(added),
                sigma: 1.0,
            })
        });
        Spline::fit(span_s, TOWARDS_KNOT_S, TOWARDS_BEND, samples)
    }

    fn at(&self, t_s: f64, rates: &Spline<3>) -> UnitQuaternion<f64> {
        let node = ((t_s - self.from_s) / STEP_S)
            .round()
            .clamp(0.0, (self.nodes.len() - 1) as f64);
        let since_s = t_s - self.from_s - node * STEP_S;
        self.nodes[node as usize] * UnitQuaternion::from_scaled_axis(rates.at(t_s - 0.5 * since_s) * since_s)
    }
}

/// The attitude that takes two directions of b to those of n, the first exactly (Black 1964); none where they are parallel.
fn triad(in_n: [Vector3<f64>; 2], in_b: [Vector3<f64>; 2]) -> UnitQuaternion<f64> {
    let frame = |[first, second]: [Vector3<f64>; 2]| {
        let x = first.try_normalize(f64::EPSILON)?;
        let y = x.cross(&second).try_normalize(f64::EPSILON)?;
        Some(Matrix3::from_columns(&[x, y, x.cross(&y)]))
    };
    match (frame(in_n), frame(in_b)) {
        (Some(n), Some(b)) => {
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(n * b.transpose()))
        }
        _ => UnitQuaternion::identity(),
    }
}

/// Root mean square second derivative of a spline about each row, as far as noise of `sigma` a reading does not make it: a second
/// difference has six times its variance, and what exceeds that by less than three of its standard deviations is none.
fn lively(spline: &Spline<3>, starts_s: &[f64], knot_s: f64, sigma: f64) -> Vec<f64> {
    let square = |t_s: &f64| spline.derivative(*t_s, 2).norm_squared() / 3.0;
    let squares: Vec<f64> = starts_s.iter().map(square).collect();
    let noise = 6.0 * sigma * sigma / knot_s.powi(4);
    let (mut from, mut to) = (0, 0);
    let about = |now_s: &f64| {
        while starts_s[from] < now_s - ALIKE_S {
            from += 1;
        }
        while to < starts_s.len() && starts_s[to] <= now_s + ALIKE_S {
            to += 1;
        }
        let around = squares[from..to].iter().sum::<f64>() / (to - from) as f64;
        let chance = 1.0 + 3.0 * (2.0 / (3.0 * (to - from) as f64)).sqrt();
        (around - noise * chance).max(0.0).sqrt()
    };
    starts_s.iter().map(about).collect()
}

/// [m/s2] how far the acceleration may be off nothing about each row. A specific force whose size is gravity's within `d` leaves room for an
/// acceleration of `sqrt(2 g d)` across gravity and of `d` along it. A unit that stays on the ground, or hangs on a parachute, has no
/// mean acceleration; under thrust, `d` is so large that this says nothing of its attitude.
fn goes_nowhere(forces_n: &Spline<3>, starts_s: &[f64], gravity: f64) -> Vec<f64> {
    let off = |t_s: &f64| (forces_n.at(*t_s).norm() - gravity).powi(2);
    let squares: Vec<f64> = starts_s.iter().map(off).collect();
    let about = |now_s: &f64| {
        let from = starts_s.partition_point(|start_s| *start_s < now_s - ALIKE_S);
        let to = starts_s.partition_point(|start_s| *start_s <= now_s + ALIKE_S);
        let d = (squares[from..to].iter().sum::<f64>() / (to - from) as f64).sqrt();
        WIDER * ((2.0 * gravity * d).sqrt() + d)
    };
    starts_s.iter().map(about).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_directions_give_the_attitude_that_they_were_seen_from() {
        let truth = UnitQuaternion::from_euler_angles(0.4, -0.7, 2.1);
        let in_n = [Vector3::new(0.0, 0.0, -9.8), Vector3::new(17.0, -6.9, -14.2)];
        let found = triad(in_n, in_n.map(|v| truth.inverse() * v));
        assert!(found.angle_to(&truth) < 1e-9);
    }
}
