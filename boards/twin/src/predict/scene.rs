//! What the sensors of the unit are in: a motion in its environment, tabulated, or the rows of a table.
//!
//! In: a [`Motion`] with its span and step, and the [`Environment`]. Out: [`Feel`], the physical state at any instant, and
//! the input of any channel after its low-pass. A channel's input is linear in a few physical quantities (rate, force,
//! angular acceleration, products of rates, field), whatever its axis and lever arm, and so is a low-pass. So these are
//! filtered once for a time constant, and every axis and lever arm that is tried later costs one scalar product.
//!
//! An accelerometer at `r` feels `axis . (f + w' x r + w x (w x r))`; a gyro `axis . w`, Earth rate included; a magnetometer
//! `axis . C_bn field_n`; a thermometer the temperature.

use nalgebra::{Quaternion, SVector, UnitQuaternion, Vector1, Vector3};

use super::grid::{Grid, LowPass};
use super::heading::Heading;
use crate::channel::{Aim, Feel, Kind};
use crate::environment::Environment;
use crate::motion::Motion;

/// The low-passed quantities of one kind of sensor.
#[derive(Clone, Debug)]
pub enum Filter {
    /// Of a gyro.
    Rate(LowPass<3>),
    /// Of an accelerometer.
    Force(LowPass<12>),
    /// Of a magnetometer.
    Field(LowPass<3>),
    /// Of a thermometer.
    Temperature(LowPass<1>),
}

/// A motion in its environment, on a uniform grid of time.
#[derive(Clone, Debug)]
pub struct Scene {
    /// [rad/s] inertial rate in b.
    rate: Grid<3>,
    /// Specific force, angular acceleration, and the products xx yy zz xy xz yz of the rates.
    force: Grid<12>,
    /// \[uT\] field in b.
    field: Grid<3>,
    /// \[degC\]
    temperature: Grid<1>,
    /// Quaternion q_nb and place in n.
    pose: Grid<7>,
    /// \[rad\] turned about the vertical.
    heading: Grid<1>,
}

impl Scene {
    /// `motion` in `environment`, from `from_s` to `to_s` at steps of `step_s`.
    pub fn new(motion: &dyn Motion, environment: &Environment, from_s: f64, to_s: f64, step_s: f64) -> Self {
        let last = (((to_s - from_s) / step_s).round() as usize).max(1);
        // As long as they get: a vector that grows ends up to twice as long.
        let nodes = last + 1;
        let [mut rates, mut fields] = [nodes; 2].map(Vec::with_capacity);
        let (mut forces, mut poses) = (Vec::with_capacity(nodes), Vec::with_capacity(nodes));
        let [mut temperatures, mut headings] = [nodes; 2].map(Vec::with_capacity);
        let mut heading = Heading::default();
        let (earth_n, gravity_n) = (environment.earth_rate_n(), environment.gravity_n());
        let mut sign = 1.0;
        let mut previous: Option<Quaternion<f64>> = None;
        for k in 0..=last {
            let t_s = from_s + k as f64 * step_s;
            let pose = motion.at(t_s);
            let to_b = pose.attitude.q_nb.inverse();
            let earth_b = to_b * earth_n;
            let w = earth_b + pose.attitude.rate_nb_b;
            let w_dot = pose.attitude.rate_dot_nb_b - pose.attitude.rate_nb_b.cross(&earth_b);
            let f = to_b * (pose.acc_n - gravity_n);
            rates.push(w);
            forces.push(force_quantities(f, w_dot, w));
            fields.push(to_b * environment.field_n_ut);
            temperatures.push(Vector1::new(pose.temperature_c.unwrap_or(environment.temperature_c)));
            let q = pose.attitude.q_nb.into_inner();
            headings.push(Vector1::new(heading.follow(q)));
            // q and -q are one attitude, but not to a spline.
            if previous.is_some_and(|previous| previous.dot(&q) < 0.0) {
                sign = -sign;
            }
            previous = Some(q);
            let p = motion.position_n(t_s);
            poses.push(SVector::from([
                sign * q.w,
                sign * q.i,
                sign * q.j,
                sign * q.k,
                p.x,
                p.y,
                p.z,
            ]));
        }
        Self {
            rate: Grid::natural(from_s, step_s, rates),
            force: Grid::natural(from_s, step_s, forces),
            field: Grid::natural(from_s, step_s, fields),
            temperature: Grid::natural(from_s, step_s, temperatures),
            pose: Grid::natural(from_s, step_s, poses),
            heading: Grid::natural(from_s, step_s, headings),
        }
    }

    /// The rows of a table, at 0, 1, 2 s and so on; between them there is nothing, so the channels must have
    /// neither bandwidth nor slots. The rows' `t_s` is not looked at. At least one row.
    pub fn table(rows: &[Feel]) -> Self {
        let mut rows = rows.to_vec();
        // A spline has two ends.
        rows.extend(rows.last().copied());
        Self::through(0.0, 1.0, &rows)
    }

    /// What was truly felt, if every state is another than it is told.
    pub fn retold(&self, truly: impl Fn(&Feel) -> Feel) -> Self {
        let nodes_s: Vec<f64> = self.pose.nodes_s().collect();
        let rows: Vec<Feel> = nodes_s.iter().map(|t_s| truly(&self.feel(*t_s))).collect();
        Self::through(nodes_s[0], nodes_s[1] - nodes_s[0], &rows)
    }

    /// States of the centre every `step_s` from `from_s` on, at least two, whatever told them: the rows' `t_s` and
    /// `temperature_rate` are not looked at.
    pub fn through(from_s: f64, step_s: f64, rows: &[Feel]) -> Self {
        let pose = |row: &Feel| {
            let (q, p) = (row.q_nb.into_inner(), row.position_n);
            SVector::from([q.w, q.i, q.j, q.k, p.x, p.y, p.z])
        };
        let force = |row: &Feel| force_quantities(row.force_b, row.rate_dot_b, row.rate_b);
        let temperature = |row: &Feel| Vector1::new(row.temperature_c);
        Self {
            rate: Grid::natural(from_s, step_s, rows.iter().map(|row| row.rate_b).collect()),
            force: Grid::natural(from_s, step_s, rows.iter().map(force).collect()),
            field: Grid::natural(from_s, step_s, rows.iter().map(|row| row.field_b_ut).collect()),
            temperature: Grid::natural(from_s, step_s, rows.iter().map(temperature).collect()),
            pose: Grid::natural(from_s, step_s, rows.iter().map(pose).collect()),
            heading: Grid::natural(
                from_s,
                step_s,
                rows.iter().map(|row| Vector1::new(row.heading)).collect(),
            ),
        }
    }

    /// The state at `t_s`.
    pub fn feel(&self, t_s: f64) -> Feel {
        // All are on the same instants.
        let spot = self.pose.spot(t_s);
        let (force, pose) = (self.force.on(&spot), self.pose.on(&spot));
        Feel {
            t_s,
            rate_b: self.rate.on(&spot),
            rate_dot_b: force.fixed_rows::<3>(3).into_owned(),
            force_b: force.fixed_rows::<3>(0).into_owned(),
            field_b_ut: self.field.on(&spot),
            temperature_c: self.temperature.on(&spot).x,
            temperature_rate: self.temperature.slope_on(&spot).x,
            q_nb: UnitQuaternion::from_quaternion(Quaternion::new(pose[0], pose[1], pose[2], pose[3])),
            position_n: pose.fixed_rows::<3>(4).into_owned(),
            heading: self.heading.on(&spot).x,
            heading_rate: self.heading.slope_on(&spot).x,
            heading_acc: self.heading.bend_on(&spot).x,
        }
    }

    /// What sensors of this kind feel through a low-pass of `tau_s`.
    pub fn filter(&self, sensor: Kind, tau_s: f64) -> Filter {
        match sensor {
            Kind::Gyro => Filter::Rate(self.rate.low_pass(tau_s)),
            Kind::Accelerometer => Filter::Force(self.force.low_pass(tau_s)),
            Kind::Magnetometer => Filter::Field(self.field.low_pass(tau_s)),
            Kind::Thermometer => Filter::Temperature(self.temperature.low_pass(tau_s)),
        }
    }

    /// Input of a channel of this aim through this filter, at these instants. The filter is one of the aim's kind.
    pub fn inputs(&self, aim: &Aim, filter: &Filter, instants_s: &[f64]) -> Vec<f64> {
        match filter {
            Filter::Rate(low_pass) => along(low_pass, &aim.axis_b, &self.rate, instants_s),
            Filter::Force(low_pass) => along(low_pass, &aim.force_weights(), &self.force, instants_s),
            Filter::Field(low_pass) => along(low_pass, &aim.axis_b, &self.field, instants_s),
            Filter::Temperature(low_pass) => along(low_pass, &Vector1::new(1.0), &self.temperature, instants_s),
        }
    }
}

fn along<const N: usize>(
    low_pass: &LowPass<N>,
    weights: &SVector<f64, N>,
    grid: &Grid<N>,
    instants_s: &[f64],
) -> Vec<f64> {
    let at = |t_s: &f64| low_pass.along(weights, grid, *t_s);
    instants_s.iter().map(at).collect()
}

/// What an accelerometer's input is linear in: force, angular acceleration, products of rates.
fn force_quantities(f: Vector3<f64>, w_dot: Vector3<f64>, w: Vector3<f64>) -> SVector<f64, 12> {
    SVector::from([
        f.x,
        f.y,
        f.z,
        w_dot.x,
        w_dot.y,
        w_dot.z,
        w.x * w.x,
        w.y * w.y,
        w.z * w.z,
        w.x * w.y,
        w.x * w.z,
        w.y * w.z,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::World;
    use crate::motion::Tumble;
    use crate::truth::TruthSource;

    #[test]
    fn between_its_samples_it_is_the_world() {
        let environment = Environment::laboratory();
        let scene = Scene::new(&Tumble::new(), &environment, 0.0, 40.0, 0.01);
        let world = World {
            motion: Tumble::new(),
            environment,
        };
        // h^4/384 times fourth derivatives of order one, and their square root for the third quantity.
        const SPLINE: f64 = 1e-7;
        for k in 0..500 {
            let t = 20.0 + 0.0317 * f64::from(k);
            let (feel, truth) = (scene.feel(t), world.at(t));
            assert!((feel.rate_b - truth.rate_b).norm() < SPLINE);
            assert!((feel.force_b - truth.force_b).norm() < SPLINE);
            assert!((feel.field_b_ut - truth.field_b_ut).norm() < SPLINE * 10.0);
            assert!((feel.rate_dot_b - truth.rate_dot_b).norm() < SPLINE * 10.0);
            assert!((feel.to_b(environment.field_n_ut) - truth.field_b_ut).norm() < SPLINE * 10.0);
        }
    }

    #[test]
    fn the_weights_of_a_lever_arm_are_the_cross_products() {
        let scene = Scene::new(&Tumble::new(), &Environment::laboratory(), 0.0, 40.0, 0.01);
        let aim = Aim {
            sensor: Kind::Accelerometer,
            axis_b: Vector3::new(0.6, -0.5, 0.3),
            lever_m: Vector3::new(0.5, -0.7, 1.1),
        };
        let none = scene.filter(Kind::Accelerometer, 0.0);
        for k in 0..200 {
            let t = 20.0 + 0.05 * f64::from(k);
            let direct = aim.input(&scene.feel(t));
            let [input] = scene.inputs(&aim, &none, &[t])[..] else {
                panic!("one instant has one input");
            };
            assert!((input - direct).abs() < 1e-6, "at {t}");
        }
    }

    #[test]
    fn a_table_is_its_rows() {
        let rows: Vec<Feel> = (0..5)
            .map(|k| Feel {
                rate_b: Vector3::new(0.1 * f64::from(k % 2), -0.2, 0.3 * f64::from(k)),
                ..Scene::new(&Tumble::new(), &Environment::laboratory(), 0.0, 1.0, 0.1).feel(0.0)
            })
            .collect();
        let scene = Scene::table(&rows);
        for (k, row) in rows.iter().enumerate() {
            assert_eq!(scene.feel(k as f64).rate_b, row.rate_b);
            assert_eq!(scene.feel(k as f64).force_b, row.force_b);
        }
        assert_eq!(Scene::table(&rows[..1]).feel(0.0).rate_b, rows[0].rate_b);
    }
}
