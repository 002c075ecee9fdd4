//! The filter of the spin in f32 beside the same in f64.

use std::sync::Arc;

use emems::{
    calibration::{Ranges, Set, Temperatures},
    estimate::Estimator,
    site::Site,
    spin::{Spin, Start, Surroundings, pad::Pad},
    unit::Settings,
};
use host_tests::{Flight, S, reference};
use nalgebra::Matrix3;
use twin::{
    environment::{Environment, World},
    motion::{Levels, Rough, SoundingRocket},
    truth::TruthSource,
};

/// \[s\] lift-off; when the filters begin after power-on, and end.
const PAD_S: f64 = 30.0;
const BEGINS_S: f64 = 31.0;
const ENDS_S: u64 = 120;

/// How far f32 is from f64 over a flight.
#[derive(Debug, Default)]
struct Apart {
    packets: usize,
    /// \[deg\] attitude; \[1\] the same in standard deviations as said.
    attitude_deg: f64,
    in_sd: f64,
    /// [rad/s] rate and bias.
    rate: f64,
    bias: f64,
    /// \[1\] covariance of the attitude, over itself.
    covariance: f64,
}

fn apart(world: impl TruthSource + 'static) -> Apart {
    let flown = Flight::at_alcantara(Arc::new(world)).fly(ENDS_S * S);
    let settings = Settings {
        site: Site::ALCANTARA,
        ..Settings::NOMINAL
    };
    let set = Set::compiled_in(Ranges::of(&settings));
    let mut temperatures = Temperatures::default();
    let mut estimator = Estimator::of(&settings);
    let mut filters: Option<(Spin, reference::spin::Spin)> = None;
    let mut apart = Apart::default();
    for (sample, frame) in flown.sampled() {
        temperatures.note(&sample.reading);
        if (frame.start_us as f64) < BEGINS_S * 1e6 {
            estimator.step(&sample, &frame.increments);
        }
        let Some((spin, reference)) = &mut filters else {
            if frame.increments.end_us as f64 > (PAD_S - 1.0) * 1e6 {
                let start = start(&estimator, frame.increments.end_us);
                filters = Some((Spin::begin(&start, &set), reference::spin::Spin::begin(&start, &set)));
            }
            continue;
        };
        let measured = set.apply(&sample.reading, &temperatures);
        assert!(spin.take(&set, &sample, &measured, &frame.increments));
        reference.take(&set, &sample, &measured, &frame.increments);
        let end_us = frame.increments.end_us;
        let known = spin.known(&set, end_us);
        let between = known.q_nb.cast::<f64>() * reference.attitude_at(end_us).inverse();
        let off_n = between.scaled_axis();
        let p = reference.covariance_n();
        let inverse = p.try_inverse().expect("a covariance");
        let biases = spin.biases().map(f64::from);
        let bias = (0..4)
            .map(|k| (biases[k] - reference.bias[k]).abs())
            .fold(0.0, f64::max);
        apart.packets += 1;
        apart.attitude_deg = apart.attitude_deg.max(off_n.norm().to_degrees());
        apart.in_sd = apart.in_sd.max(off_n.dot(&(inverse * off_n)).sqrt());
        apart.rate = apart
            .rate
            .max((spin.rate_b().cast::<f64>() - reference.rate_b()).norm());
        apart.bias = apart.bias.max(bias);
        let of_covariance = (spin.covariance_n().cast::<f64>() - p).norm() / p.norm();
        apart.covariance = apart.covariance.max(of_covariance);
    }
    apart
}

/// What both begin with.
fn start(estimator: &Estimator, at_us: u64) -> Start<'static> {
    let filter = estimator.filter();
    let params = &filter.params;
    Start {
        at_us,
        q_nb: filter.q_nb,
        covariance_n: filter.attitude_covariance_n(),
        rate_b: nalgebra::Vector3::zeros(),
        rate_sd: 0.05,
        bias_b: filter.bias_b,
        bias_variance: filter.bias_covariance_b().trace() / 3.0,
        pad: &Pad::EMPTY,
        iron_b: nalgebra::Vector3::zeros(),
        iron_covariance: Matrix3::from_diagonal_element(0.15 * 0.15),
        surroundings: Surroundings {
            field_n_ut: filter.reference.field_n_ut().expect("a field"),
            field_sd: params.heading_sd,
            earth_rate_n: params.earth_rate_n,
            bias_per_g: (0.02_f32).to_radians(),
            delays: params.delays,
        },
    }
}

fn smooth() -> World<SoundingRocket> {
    let environment = Environment::alcantara();
    World {
        motion: SoundingRocket::new(PAD_S, environment.gravity),
        environment,
    }
}

/// Most that rounding alone makes of the attitude: each event of a packet (ten slices, three readings of force, four of the field)
/// turns attitude and angle spun, which is at most half a turn, so that its last digit is 2^-22; rounded to half of it, each time to
/// the same side, and never corrected.
fn rounding_deg(packets: usize) -> f64 {
    (packets as f64 * 17.0 * 2.0_f64.powi(-23)).to_degrees()
}

/// Of the covariance: what is said is then right to half a hundredth.
const COVARIANCE: f64 = 0.01;

fn stays(name: &str, apart: &Apart) {
    let most_deg = rounding_deg(apart.packets);
    println!("{name}: {apart:?}, at most {most_deg:.3} deg");
    assert!(apart.packets > 400, "{apart:?}");
    assert!(apart.attitude_deg < most_deg, "{name}: {apart:?}");
    assert!(apart.covariance < COVARIANCE, "{name}: {apart:?}");
}

#[test]
fn f32_stays_with_f64_through_a_boost() {
    stays("smooth", &apart(smooth()));
}

#[test]
fn f32_stays_with_f64_through_a_rough_boost() {
    stays("rough", &apart(Rough::new(smooth(), PAD_S, Levels::ROUGH, 7)));
}
