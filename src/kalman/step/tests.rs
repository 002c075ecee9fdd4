//! What is believed of a step and of a sample: each number just within its bound and just beyond it.

use super::*;

const PLAIN: Step = Step {
    at_us: 1,
    covered_s: 0.02,
    angle_b: Vector3::new(0.0, 0.0, 0.0),
    angle_variance: 0.0,
    rate_b: Vector3::new(0.0, 0.0, 0.0),
    saturated: false,
    acc: None,
    mag: None,
    lift_off: false,
};

const SAMPLE: Sampled = Sampled {
    value_b: Vector3::new(0.0, 0.0, 0.0),
    variance: 0.0,
    scatter: 0.0,
    at_us: 1,
};

#[test]
fn a_rotation_is_less_than_a_turn_at_a_rate_that_can_be() {
    let is = |step: Step| step.is_a_rotation();
    let angle_b = |angle: f32| Vector3::new(0.6 * angle, 0.0, -0.8 * angle);
    let turned = |angle: f32| Step {
        angle_b: angle_b(angle),
        ..PLAIN
    };
    assert!(
        is(PLAIN) && is(turned(0.999 * LONGEST_TURN)) && !is(turned(1.001 * LONGEST_TURN)) && !is(turned(f32::NAN))
    );
    let at_rate = |rate: f32| Step {
        rate_b: angle_b(rate),
        ..PLAIN
    };
    assert!(is(at_rate(999.0)) && !is(at_rate(1_001.0)));
    let exactly = Step {
        rate_b: Vector3::new(1_000.0, 0.0, 0.0),
        ..PLAIN
    };
    assert!(!is(exactly) && !is(at_rate(f32::INFINITY)));
    let covering = |covered_s: f32| Step { covered_s, ..PLAIN };
    assert!(is(covering(1e-6)) && !is(covering(0.0)) && !is(covering(-1.0)) && !is(covering(f32::NAN)));
    let with = |angle_variance: f32| Step {
        angle_variance,
        ..PLAIN
    };
    assert!(is(with(0.999)) && !is(with(1.0)) && !is(with(-1e-9)) && !is(with(f32::NAN)));
}

#[test]
fn a_sample_is_no_larger_than_a_sensor_could_give() {
    let is = |sampled: Sampled| sampled.is_believable();
    let of = |value: f32| Sampled {
        value_b: Vector3::new(0.6 * value, 0.8 * value, 0.0),
        ..SAMPLE
    };
    assert!(is(SAMPLE) && is(of(9_999.0)) && !is(of(10_001.0)) && !is(of(f32::NAN)));
    let exactly = Sampled {
        value_b: Vector3::new(0.0, 0.0, LONGEST_SAMPLE),
        ..SAMPLE
    };
    assert!(!is(exactly));
    let varying = |variance: f32| Sampled { variance, ..SAMPLE };
    assert!(is(varying(9_999.0)) && !is(varying(LONGEST_SAMPLE)) && !is(varying(-1e-9)) && !is(varying(f32::NAN)));
    let scattered = |scatter: f32| Sampled { scatter, ..SAMPLE };
    assert!(is(scattered(0.99e8)) && !is(scattered(1e8)) && !is(scattered(-1e-9)) && !is(scattered(f32::NAN)));
}

/// What moves between readings is taken for noise of each, and for scatter of their mean, where it shows beside the noise.
#[test]
fn readings_that_move_scatter() {
    let of_readings = |variance: f32| {
        let mut sampled = Sampled {
            variance: 0.25,
            ..SAMPLE
        };
        sampled.is_of_readings_with(variance);
        (sampled.variance, sampled.scatter)
    };
    assert_eq!(of_readings(0.4), (0.25, 0.0));
    assert_eq!(of_readings(0.5), (0.25, 0.0));
    assert_eq!(of_readings(0.75), (0.75, 1.5));
}
