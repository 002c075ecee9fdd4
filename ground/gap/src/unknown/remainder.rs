//! The unknown as a hypothesis with a size: what is left that no effect explains, how large it is, and whether that matters.
//!
//! In: the problem, a finished model, its floor, and the bars of the case. Out: [`Remainder`], the discrepancy that matters most: a slow
//! course ([`crate::unknown::slow`]), or the energy of one channel whatever its course ([`crate::unknown::fast`]).
//!
//! With thousands of samples everything is significant, so significance decides nothing by itself. A discrepancy matters with the
//! probability that it is there (its Bayes factor, all of them sharing even odds) times that of its size being above a bar. The bar is
//! the user's, in degrees of attitude or in growth of the gap, whichever is smaller, but never below what the reference itself may be off
//! by. A slow course goes on, and its growth is that of the gap in its own channels; what is fast is averaged, and its growth is that of
//! the gap of its sensor.
//! Degrees: a specific force over gravity, a field over its horizontal part, a rate over the time constant of a filter, each as far
//! as the sensor weighs among those of its kind.

use nalgebra::{Matrix3, Vector3};
use twin::predict::Kind;

use super::{
    fast::{Bar, Fast, excesses, sensor},
    slow::{Beside, Slow, Where},
};
use crate::{
    input::case::{Bars, SlowErrors},
    null::{model::Model, problem::Problem},
    thresholds::{CHANCE, FILTER_S, SAID, sigmas},
};

/// Quantiles of an interval: 5 %, the middle, 95 %.
const QUANTILES: [f64; 3] = [0.05, 0.5, 0.95];

/// The same in standard deviations of a Gaussian.
const GAUSSIAN: [f64; 3] = [-1.645, 0.0, 1.645];

/// Part of a field that counts as horizontal at least: nearer to the pole a magnetometer gives no heading.
const LEAST_LEVEL: f64 = 0.02;

/// What is judged with.
#[derive(Clone, Copy, Debug)]
pub struct Setting<'a> {
    /// How reference and field err slowly.
    pub slow: &'a SlowErrors,
    /// What is too small to care about.
    pub bars: &'a Bars,
    /// How much more each channel scatters by the model.
    pub louder: &'a [f64],
    /// Channels whose scatter the model explains: their energy is no remainder.
    pub scattered: &'a [usize],
    /// Channels whose mean over time the model leaves open, such as a zero that wanders: nothing slow is seen in them.
    pub wandering: &'a [usize],
}

/// What is left.
#[derive(Clone, Debug, PartialEq)]
pub struct Remainder {
    /// Probability that it is there at all.
    pub present: f64,
    /// ln of its odds against nothing.
    pub log_bayes_factor: f64,
    /// In words; empty where nothing can be said.
    pub what: String,
    /// Where.
    pub channels: Vec<usize>,
    /// 5 %, 50 % and 95 % of its root mean square, in [`Remainder::unit`].
    pub size: [f64; 3],
    /// Of the size.
    pub unit: &'static str,
    /// The same in sigma of a sample of its channels.
    pub sigma: [f64; 3],
    /// \[deg\] the same as attitude; `None` where it has no direct effect on that.
    pub attitude_deg: Option<[f64; 3]>,
    /// Probability that it is there and above the bar.
    pub matters: f64,
    /// Whether it is a slow course, not energy of any course.
    pub is_slow: bool,
    /// The bar over the middle of the size.
    bar_over_size: f64,
}

/// Nothing that can be said.
impl Default for Remainder {
    fn default() -> Self {
        Remainder {
            present: 0.0,
            log_bayes_factor: 0.0,
            what: String::new(),
            channels: Vec::new(),
            size: [0.0; 3],
            unit: "1",
            sigma: [0.0; 3],
            attitude_deg: None,
            matters: 0.0,
            is_slow: false,
            bar_over_size: f64::INFINITY,
        }
    }
}

/// The slow courses that a model leaves, or leaves without one of its effects, each with its evidence and size.
pub fn courses(problem: &Problem, beside: &Beside, setting: &Setting, without: Option<usize>) -> Vec<Slow> {
    beside.courses(without, &|slow| bar(problem, slow, setting))
}

/// Probability that one of several slow courses is there, and that it is there and above its bar.
pub fn judged(problem: &Problem, slow: &Slow, setting: &Setting, several: usize) -> [f64; 2] {
    let present = present(slow.posterior.log_bayes_factor, several);
    [present, present * slow.posterior.above(bar(problem, slow, setting))]
}

/// Probability of one of several discrepancies, which share even odds, by the ln of its own odds.
fn present(log_bayes_factor: f64, several: usize) -> f64 {
    1.0 / (1.0 + several.max(1) as f64 * (-log_bayes_factor).exp())
}

/// What a model leaves.
pub fn remainder(problem: &Problem, model: &Model, floor: &[Vec<f64>], setting: &Setting) -> Remainder {
    let beside = Beside::of(problem, model, setting, None);
    let slow = beside.map_or_else(Vec::new, |beside| courses(problem, &beside, setting, None));
    let fast = excesses(problem, model, floor, setting).into_iter();
    let fast: Vec<Fast> = fast.filter(|fast| !setting.scattered.contains(&fast.channel)).collect();
    let several = slow.len() + fast.len();
    let of_slow = slow.iter().map(|slow| {
        let bar = bar(problem, slow, setting);
        let size = QUANTILES.map(|share| slow.posterior.quantile(share));
        let [present, matters] = judged(problem, slow, setting, several);
        Remainder {
            present,
            log_bayes_factor: slow.posterior.log_bayes_factor,
            what: words(problem, slow.place),
            channels: slow.channels.clone(),
            size,
            unit: unit(problem, slow.place),
            sigma: size.map(|size| size * slow.sigmas_per_unit),
            attitude_deg: degrees(problem, slow.place).map(|degrees| size.map(|size| size * degrees)),
            matters,
            is_slow: true,
            bar_over_size: bar / size[1],
        }
    });
    let is_there = |fast: &Fast| present(fast.log_bayes_factor, several) > SAID;
    let sensor_of = |channel: usize| sensor(&problem.twin.unit().channels, channel);
    let of_sensor = Bar::of(&fast, setting.bars, sensor_of, is_there);
    let of_fast = fast.iter().map(|fast| {
        // All frequencies are in it: what the reference errs by slowly too, which an axis across gravity sees more of than others.
        let off = sigmas(CHANCE) * off(problem, Where::Sensor(fast.channel), setting.slow) / fast.sigma;
        let bar = of_sensor.over(fast).max(off * off);
        let sigma = GAUSSIAN.map(|many| (fast.excess + many * fast.error).max(0.0).sqrt());
        let present = present(fast.log_bayes_factor, several);
        Remainder {
            present,
            log_bayes_factor: fast.log_bayes_factor,
            what: format!(
                "energy above the floor in {}",
                problem.twin.unit().channels[fast.channel].name
            ),
            channels: vec![fast.channel],
            size: sigma.map(|sigma| sigma * fast.sigma),
            unit: unit(problem, Where::Sensor(fast.channel)),
            sigma,
            attitude_deg: None,
            matters: present * likelier_above(fast.excess, fast.error, bar),
            is_slow: false,
            bar_over_size: bar.sqrt() / sigma[1],
        }
    });
    // What matters most; of what matters alike, what is surest and nearest to its bar.
    let rank = |one: &Remainder| (one.matters, one.present / one.bar_over_size.max(f64::MIN_POSITIVE));
    let largest = of_slow.chain(of_fast).max_by(|one, other| {
        let (one, other) = (rank(one), rank(other));
        one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1))
    });
    largest.unwrap_or_default()
}

/// Probability that a Gaussian value is above a bar.
fn likelier_above(value: f64, error: f64, bar: f64) -> f64 {
    0.5 * statrs::function::erf::erfc((bar - value) / error.max(f64::MIN_POSITIVE) / std::f64::consts::SQRT_2)
}

/// [physical unit] size from which a slow discrepancy matters.
fn bar(problem: &Problem, slow: &Slow, setting: &Setting) -> f64 {
    let sigma = ((1.0 + setting.bars.gap_sigma).powi(2) - 1.0).sqrt() / slow.sigmas_per_unit.max(f64::MIN_POSITIVE);
    let attitude = degrees(problem, slow.place).map_or(f64::INFINITY, |degrees| setting.bars.attitude_deg / degrees);
    sigma
        .min(attitude)
        .max(sigmas(CHANCE) * off(problem, slow.place, setting.slow))
}

fn kind(problem: &Problem, place: Where) -> Option<Kind> {
    match place {
        Where::Sensor(channel) => Some(problem.twin.unit().channels[channel].sensor),
        Where::VectorB(kind) | Where::VectorN(kind) => Some(kind),
        Where::Rotation | Where::Factor(_) | Where::Delay(_) => None,
    }
}

/// [physical unit] what the reference or the field may be off by.
fn off(problem: &Problem, place: Where, errors: &SlowErrors) -> f64 {
    let attitude = errors.attitude_sigma_rad;
    match (kind(problem, place), place) {
        (Some(Kind::Accelerometer), _) => problem.twin.environment().gravity * attitude,
        (Some(Kind::Magnetometer), _) => {
            (errors.field_wander_sigma_ut).hypot(problem.twin.environment().field_n_ut.norm() * attitude)
        }
        (Some(Kind::Gyro), _) => 3f64.sqrt() * attitude / errors.attitude_correlation_s,
        (_, Where::Rotation) => attitude,
        _ => 0.0,
    }
}

/// \[deg\] of attitude that one unit makes.
fn degrees(problem: &Problem, place: Where) -> Option<f64> {
    let environment = problem.twin.environment();
    if place == Where::Rotation {
        return Some(1f64.to_degrees());
    }
    let kind = kind(problem, place)?;
    let field = environment.field_n_ut;
    let rad = match kind {
        Kind::Accelerometer => environment.gravity.recip(),
        Kind::Magnetometer => field.x.hypot(field.y).max(LEAST_LEVEL * field.norm()).recip(),
        Kind::Gyro => FILTER_S,
        Kind::Thermometer => return None,
    };
    let part = match place {
        Where::Sensor(channel) => weight(problem, channel),
        _ => 1.0,
    };
    (rad.is_finite()).then(|| (rad * part).to_degrees())
}

/// \[deg\] of attitude that slow errors of some channels make, each with its root mean square in physical units: of the kind that makes most.
pub fn attitude_deg(problem: &Problem, slow: &[(usize, f64)]) -> f64 {
    let channels = &problem.twin.unit().channels;
    let of_kind = |kind: Kind| {
        let own = slow.iter().filter(|(channel, _)| channels[*channel].sensor == kind);
        let square: f64 = own.map(|(channel, rms)| weight(problem, *channel) * rms * rms).sum();
        degrees(problem, Where::VectorB(kind)).map_or(0.0, |degrees| degrees * square.sqrt())
    };
    let kinds = [Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer];
    kinds.into_iter().map(of_kind).fold(0.0, f64::max)
}

/// How far one sensor moves the vector of its kind: `|(S'S)^-1 s|`; 1 where its kind has no three axes.
fn weight(problem: &Problem, channel: usize) -> f64 {
    let channels = &problem.twin.unit().channels;
    let own = &channels[channel];
    let of_kind = channels.iter().filter(|other| other.sensor == own.sensor);
    let square: Matrix3<f64> = of_kind.map(|other| other.axis_b * other.axis_b.transpose()).sum();
    let vector: Option<Vector3<f64>> = square.cholesky().map(|factor| factor.solve(&own.axis_b));
    vector
        .map(|vector| vector.norm())
        .filter(|weight| weight.is_finite() && *weight < 1.0)
        .unwrap_or(1.0)
}

fn unit(problem: &Problem, place: Where) -> &'static str {
    match (kind(problem, place), place) {
        (Some(kind), _) => kind.unit(),
        (None, Where::Rotation) => "rad",
        (None, Where::Delay(_)) => "s",
        (None, _) => "1",
    }
}

fn words(problem: &Problem, place: Where) -> String {
    match place {
        Where::Sensor(channel) => format!("a slow error of {}", problem.twin.unit().channels[channel].name),
        Where::VectorB(kind) => format!("a slow vector that stands in the body, in all {}", kind.plural()),
        Where::VectorN(kind) => format!("a slow vector that stands in the room, in all {}", kind.plural()),
        Where::Rotation => "a slow rotation against the reference, of all sensors".to_owned(),
        Where::Factor(kind) => format!("a factor that changes slowly, of all {}", kind.plural()),
        Where::Delay(kind) => format!("a delay that changes slowly, of all {}", kind.plural()),
    }
}
