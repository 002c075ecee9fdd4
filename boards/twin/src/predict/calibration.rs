//! How far a prediction may be off although the twin is right: calibration, drift, and what the reference knows.
//!
//! In: a [`Twin`]. Out: [`Column`]s, the derivatives of the readings by parameters whose prior sigma the unit's description
//! gives. With columns N and prior variances L the readings have covariance `R + N L N'`, R diagonal with
//! [`Channel::sigma`]. Per channel: bias 1; scale, the input itself; axis, the input along two directions across the
//! axis; drift, a random walk of sigma s per sqrt(s) over T seconds as its first Karhunen-Loeve terms,
//! `sqrt(2/T) sin(x_k t/T)` of variance `(s T/x_k)^2`, x_k = (k - 1/2) pi (they hold 97 % of its power).

use core::f64::consts::{PI, SQRT_2};

use nalgebra::Vector3;

use super::input::{Filters, Look};
use super::{Aim, Twin};
use crate::channel::{Channel, Kind};

/// Terms of the drift.
const DRIFT_TERMS: usize = 8;

/// \[s\] step of the difference quotient by the instant: motions change over tenths of a second.
const INSTANT_STEP_S: f64 = 1e-4;

/// \[s\] of the second: rounding costs it the square.
const BEND_STEP_S: f64 = 2e-3;

/// How well the reference and the field are known, one sigma each; zero for exact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accuracy {
    /// \[rad\] attitude of the truth instrument.
    pub attitude_sigma_rad: f64,
    /// \[s\] over which that error stays alike, as a Matern 3/2 process.
    pub attitude_correlation_s: f64,
    /// \[m\] its position.
    pub position_sigma_m: f64,
    /// \[uT\] the field, and how uniform it is.
    pub field_sigma_ut: f64,
}

/// The derivatives of the readings by one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Of the parameter.
    pub name: String,
    /// Prior standard deviation of the parameter, in its unit.
    pub sigma: f64,
    /// For each channel that depends on it, the derivative of its readings.
    pub entries: Vec<(usize, Vec<f64>)>,
}

impl Twin {
    /// The calibration parameters of one channel whose sigma is not zero.
    pub fn calibration(&self, index: usize) -> Vec<Column> {
        let channel = &self.unit.channels[index];
        let t_s = self.instants_s(index);
        let column = |name: &str, sigma: f64, values: Vec<f64>| Column {
            name: format!("{name}_{}", channel.name),
            sigma,
            entries: vec![(index, values)],
        };
        let mut columns = vec![column("bias", channel.bias_sigma, vec![1.0; t_s.len()])];
        columns.push(column("scale", channel.scale_sigma, self.along(index, channel.axis_b)));
        if channel.sensor != Kind::Thermometer {
            for (name, axis_b) in ["axis_1", "axis_2"].into_iter().zip(channel.across()) {
                columns.push(column(name, channel.axis_sigma_rad, self.along(index, axis_b)));
            }
        }
        columns.extend(
            self.drift(channel, &t_s)
                .map(|(name, sigma, values)| column(&name, sigma, values)),
        );
        columns.retain(|column| column.sigma > 0.0);
        columns
    }

    /// The field's components in n, common to all magnetometers, where `field_sigma_ut` is not zero.
    pub fn field_columns(&self, accuracy: &Accuracy) -> Vec<Column> {
        let magnetometers = || {
            let channels = self.unit.channels.iter().enumerate();
            channels.filter(|(_, channel)| channel.sensor == Kind::Magnetometer)
        };
        let column = |(name, direction_n): (&str, Vector3<f64>)| Column {
            name: name.to_owned(),
            sigma: accuracy.field_sigma_ut,
            entries: magnetometers()
                .map(|(index, channel)| {
                    let felt = self.feels(index).into_iter();
                    (
                        index,
                        felt.map(|feel| channel.axis_b.dot(&feel.to_b(direction_n))).collect(),
                    )
                })
                .collect(),
        };
        let axes = [
            ("field_north", Vector3::x()),
            ("field_east", Vector3::y()),
            ("field_down", Vector3::z()),
        ];
        let columns = axes.into_iter().map(column);
        columns
            .filter(|column| column.sigma > 0.0 && !column.entries.is_empty())
            .collect()
    }

    /// Derivative of one channel's readings by the instant at which it is read.
    pub fn by_instant(&self, index: usize) -> Vec<f64> {
        let pairs = (self.read_at(index, INSTANT_STEP_S).into_iter()).zip(self.read_at(index, -INSTANT_STEP_S));
        pairs
            .map(|(later, earlier)| (later - earlier) / (2.0 * INSTANT_STEP_S))
            .collect()
    }

    /// Second derivative of one channel's readings by the instant at which it is read.
    pub fn bend(&self, index: usize) -> Vec<f64> {
        let [later, now, earlier] = [BEND_STEP_S, 0.0, -BEND_STEP_S].map(|later_s| self.read_at(index, later_s));
        let triples = later.into_iter().zip(now).zip(earlier);
        triples
            .map(|((later, now), earlier)| (later - 2.0 * now + earlier) / (BEND_STEP_S * BEND_STEP_S))
            .collect()
    }

    fn read_at(&self, index: usize, later_s: f64) -> Vec<f64> {
        let channel = &self.unit.channels[index];
        let mut chain = super::Chain::of(channel);
        chain.read_late(move |_| later_s);
        let look = Look::of(&chain, &self.instants_s(index));
        self.filtered(&look, channel.tau_s(), &mut Filters::new())
    }

    /// What this channel would feel along another axis, without its bias.
    fn along(&self, index: usize, axis_b: Vector3<f64>) -> Vec<f64> {
        let channel = &self.unit.channels[index];
        let aim = Aim {
            axis_b,
            ..Aim::of(channel)
        };
        let mut chain = super::Chain::of(channel);
        chain.aim = aim;
        let look = Look::of(&chain, &self.instants_s(index));
        self.filtered(&look, channel.tau_s(), &mut Filters::new())
    }

    fn drift<'a>(&self, channel: &Channel, t_s: &'a [f64]) -> impl Iterator<Item = (String, f64, Vec<f64>)> + 'a {
        let (first, last) = (t_s.first().copied().unwrap_or(0.0), t_s.last().copied().unwrap_or(0.0));
        let span_s = last - first;
        let walk = channel.drift_sigma;
        (1..=DRIFT_TERMS).map(move |term| {
            let x = (term as f64 - 0.5) * PI;
            let shape = t_s.iter().map(|t| SQRT_2 * (x * (t - first) / span_s).sin()).collect();
            (format!("drift_{term}"), walk * span_s.sqrt() / x, shape)
        })
    }
}
