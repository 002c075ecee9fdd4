//! What the unit itself can correct: an effect as parameters of its calibration set.
//!
//! In: the effects found. Out: a [`Correction`]: how each channel responds with them in, for the estimation
//! ([`Response`]), and the set as text, in the format of `ground calibration` ([`bench::set`]), every channel in it.
//!
//! Bias, axis, scale and place are read off the effect's own action on the channel's chain; a temperature coefficient is
//! the effect's parameter with its bend, which a scale has none of in the set; a delay or a lag is a delay. What is not
//! always on, what changes the scatter, and what is the reference's fault is not the unit's to correct and is left out: each
//! effect's page says so ([`CorrectedAs`]).
//!
//! The unit's image of a set has no delay and no place. They stand in it as `delay_s` and `lever_m`, which `calibration apply`
//! passes over: the first belongs into the estimator's `Delays`, the second into the unit's `place_b`.

use bench::set::{Entry, Set, SetError};
use nalgebra::{Matrix3, Vector3};
use twin::{
    effect::{Active, CorrectedAs, Site},
    predict::{Chain, Channel, Kind, Twin},
};

use crate::{holdout::attitude::Response, null::problem::Component};

/// What the unit's calibration needs.
#[derive(Clone, Debug)]
pub struct Correction {
    /// In the unit's channel order.
    pub responses: Vec<Response>,
    /// Effects it corrects.
    pub effects: Vec<&'static str>,
    /// Channels it changes.
    pub channels: Vec<usize>,
}

impl Correction {
    /// Of the effects among these that the unit can correct; `None` where there is none.
    pub fn of(twin: &Twin, components: &[Component]) -> Option<Self> {
        let unit = twin.unit();
        let mut correction = Correction {
            responses: unit.channels.iter().map(Response::nominal).collect(),
            effects: Vec::new(),
            channels: Vec::new(),
        };
        for component in components.iter().filter(|component| component.span.is_none()) {
            let active = &component.active;
            let page = active.cause.effect.page();
            let Some(way) = page.corrected_as else {
                continue;
            };
            correction.effects.push(page.name);
            for index in active.cause.channels(unit) {
                add(way, active, twin, index, &mut correction.responses[index]);
                correction.channels.push(index);
            }
        }
        correction.channels.sort_unstable();
        correction.channels.dedup();
        (!correction.channels.is_empty()).then_some(correction)
    }

    /// The calibration set.
    ///
    /// # Errors
    /// When the set cannot be written as text.
    pub fn set(&self, twin: &Twin) -> Result<String, SetError> {
        let unit = twin.unit();
        let temperatures = twin.feels(0).into_iter().map(|feel| feel.temperature_c);
        let range_c = temperatures.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| {
            (low.min(t), high.max(t))
        });
        let mut set = Set::new(unit.name.clone());
        let sensed = || {
            let pairs = unit.channels.iter().zip(&self.responses);
            pairs.filter(|(channel, _)| channel.sensor != Kind::Thermometer)
        };
        set.channels = sensed()
            .map(|(channel, response)| entry(channel, response, twin.environment().temperature_c, range_c))
            .collect();
        set.text()
    }
}

/// Adds an effect to the response of one channel that it touches.
fn add(way: CorrectedAs, active: &Active, twin: &Twin, index: usize, response: &mut Response) {
    let unit = twin.unit();
    let channel = &unit.channels[index];
    let starts_s = twin.starts_s();
    let site = Site {
        unit,
        index,
        channel,
        environment: twin.environment(),
        log_s: (
            starts_s.first().copied().unwrap_or_default(),
            starts_s.last().copied().unwrap_or_default(),
        ),
    };
    let own = (0..active.theta.len()).find(|parameter| active.cause.touched_by(*parameter, unit).contains(&index));
    let theta = own.map_or(0.0, |parameter| active.theta[parameter]);
    match way {
        CorrectedAs::Chain => {
            let mut chain = Chain::of(channel);
            active.act(&site, &mut chain);
            response.sensitivity_b += chain.aim.axis_b - channel.axis_b;
            response.bias += chain.bias - channel.bias;
            response.lever_m += chain.aim.lever_m - channel.lever_m;
            response.delay_s += chain.lag_s;
        }
        CorrectedAs::BiasPerKelvin => {
            response.bias_per_k += theta;
            response.bias_per_k2 += theta * bend(active, starts_s);
        }
        CorrectedAs::ScalePerKelvin => response.scale_per_k += theta * (1.0 + bend(active, starts_s) * skew_k(twin)),
        CorrectedAs::Delay => response.delay_s += theta,
        CorrectedAs::Skew => response.delay_s -= theta * site.read_position() as f64,
    }
}

/// [1/K] of a temperature coefficient: beyond the values that are possible it is the last of them.
fn bend(active: &Active, starts_s: &[f64]) -> f64 {
    let (bend, possible) = (active.cause.variant, active.cause.effect.between(starts_s));
    match possible.as_slice() {
        [least, .., most] => bend.max(*least).min(*most),
        _ => bend,
    }
}

/// \[K\] by which a parabola over the log's temperatures has the slope of a line: the unit's set has no bent scale.
fn skew_k(twin: &Twin) -> f64 {
    let standard_c = twin.environment().temperature_c;
    let above_k = twin.feels(0).into_iter().map(|feel| feel.temperature_c - standard_c);
    let (squares, cubes) = above_k.fold((0.0, 0.0), |(squares, cubes), k| (squares + k * k, cubes + k * k * k));
    if squares > 0.0 { cubes / squares } else { 0.0 }
}

/// A channel of the set: `counts = (1 + k dT) S.x + b + b' dT + b'' dT^2`, its covariance that of the unit's description.
fn entry(channel: &Channel, response: &Response, standard_c: f64, range_c: (f64, f64)) -> Entry {
    let counts = 1.0 / channel.lsb;
    let is_warm = (response.bias_per_k != 0.0 || response.scale_per_k != 0.0) && range_c.0 < range_c.1;
    let mut bias_counts = vec![response.bias * counts];
    let mut scale_per_k = Vec::new();
    if response.bias_per_k != 0.0 || response.bias_per_k2 != 0.0 {
        bias_counts.push(response.bias_per_k * counts);
    }
    if response.bias_per_k2 != 0.0 {
        bias_counts.push(response.bias_per_k2 * counts);
    }
    if response.scale_per_k != 0.0 {
        scale_per_k.push(response.scale_per_k);
    }
    let axis_b: Vector3<f64> = channel.axis_b;
    let along = axis_b * axis_b.transpose();
    let of_sensitivity = (along * channel.scale_sigma.powi(2)
        + (Matrix3::identity() - along) * channel.axis_sigma_rad.powi(2))
        * counts.powi(2);
    let size = 3 + bias_counts.len() + scale_per_k.len();
    let variance = |row: usize, column: usize| match (row, column) {
        (0..3, 0..3) => of_sensitivity[(row, column)],
        (3, 3) => (channel.bias_sigma * counts).powi(2),
        _ => 0.0,
    };
    Entry {
        name: channel.name.clone(),
        sensor: match channel.sensor {
            Kind::Accelerometer => "accelerometer",
            Kind::Magnetometer => "magnetometer",
            Kind::Gyro | Kind::Thermometer => "gyro",
        }
        .to_owned(),
        part: String::new(),
        method: "gap".to_owned(),
        sensitivity_b: (response.sensitivity_b * counts).into(),
        bias_counts,
        scale_per_k,
        reference_c: is_warm.then_some(standard_c),
        valid_c: is_warm.then_some([range_c.0, range_c.1]),
        scatter_counts: channel.sigma() * counts,
        freedom: 0,
        covariance: (0..size)
            .map(|row| (0..size).map(|column| variance(row, column)).collect())
            .collect(),
        delay_s: (response.delay_s != 0.0).then_some(response.delay_s),
        lever_m: (response.lever_m != channel.lever_m).then(|| response.lever_m.into()),
    }
}

#[cfg(test)]
mod tests;
