use twin::{
    effect::{Active, Cause, Locality, by_name},
    environment::Environment,
    motion::{Motion, Pose, Tumble},
    predict::{Accuracy, Scene, Twin, emems},
};

use nalgebra::Vector3;

use super::*;
use crate::{
    input::{
        log::Series,
        reference::Reference,
        windows::{Fit, Span},
    },
    null::interval::Interval,
};

const ROWS: u32 = 600;

/// \[s\] between them.
const STEP_S: f64 = 0.1;

/// A unit that is turned, and carried to and fro by half a metre.
struct Carried(Tumble);

impl Motion for Carried {
    fn at(&self, t_s: f64) -> Pose {
        self.0.at(t_s)
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }

    fn position_n(&self, t_s: f64) -> Vector3<f64> {
        Vector3::new(
            0.5 * (0.4 * t_s).sin(),
            0.3 * (0.7 * t_s).sin(),
            0.2 * (1.1 * t_s).sin(),
        )
    }
}

/// \[nats\] that an effect, which is in the log, is worth beyond a reference that knows attitude and position so well; infinitely many
/// beyond an exact one.
fn worth(effect: &str, theta: &[f64], [attitude_sigma_rad, position_sigma_m]: [f64; 2], span: Option<Interval>) -> f64 {
    worth_in(0.0, effect, theta, [attitude_sigma_rad, position_sigma_m], span)
}

/// The same in a field whose gradient is known to so many uT/m.
fn worth_in(
    gradient_ut_m: f64,
    effect: &str,
    theta: &[f64],
    [attitude_sigma_rad, position_sigma_m]: [f64; 2],
    span: Option<Interval>,
) -> f64 {
    let environment = Environment::laboratory();
    let scene = Scene::new(&Carried(Tumble::new()), &environment, 0.0, 60.0, 0.01);
    let starts_s: Vec<f64> = (0..ROWS).map(|row| STEP_S * f64::from(row)).collect();
    let twin = Twin::new(emems(|_| 0.0), environment, scene, starts_s).expect("a twin");
    let cause = Cause {
        effect: by_name(effect).expect("an effect"),
        locality: Locality::Common,
        variant: 0.0,
    };
    let theta = theta.to_vec();
    let active = Active { cause, theta };
    let is_on = |row: u32| span.is_none_or(|span| span.contains(STEP_S * f64::from(row)));
    let series = |index: usize| {
        let [without, with] =
            [&[][..], std::slice::from_ref(&active)].map(|model| twin.channel(index, model).into_owned());
        let value = |row: u32| {
            if is_on(row) {
                with[row as usize]
            } else {
                without[row as usize]
            }
        };
        Series {
            rows: (0..ROWS).collect(),
            values: (0..ROWS).map(value).collect(),
        }
    };
    let fit = Fit {
        channels: (0..twin.unit().channels.len()).map(series).collect(),
    };
    let accuracy = Accuracy {
        attitude_sigma_rad,
        attitude_correlation_s: 20.0,
        position_sigma_m,
        field_sigma_ut: 0.0,
    };
    let reference = Reference::stated(accuracy);
    let problem = Problem::new(&twin, &fit, &reference);
    let errors = SlowErrors {
        attitude_sigma_rad,
        attitude_correlation_s: 20.0,
        field_wander_sigma_ut: 0.0,
        field_correlation_s: 10.0,
        field_sigma_ut: 0.0,
        field_gradient_sigma_ut_m: Some(gradient_ut_m),
    };
    let model = [Component { active, span }];
    Beyond::of(&problem, &errors).map_or(f64::INFINITY, |beyond| beyond.nats(&model, 0))
}

#[test]
fn what_neither_does_is_beyond_them() {
    let iron = |accuracy: [f64; 2]| worth("hard-iron", &[10.0, 0.0, 0.0], accuracy, None);
    let [doubted, exact] = [[3e-3, 1e-4], [1e-9, 1e-9]].map(iron);
    assert!(
        (0.5..=1.0).contains(&(doubted / exact)) && doubted > 20.0,
        "{doubted} {exact}"
    );
}

#[test]
fn a_gradient_that_the_room_may_have_is_no_effect() {
    let gradient = |known_ut_m: f64| {
        worth_in(
            known_ut_m,
            "field-gradient",
            &[3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [1e-3, 0.0],
            None,
        )
    };
    let [unknown, none] = [1.5, 0.0].map(gradient);
    // Two sigmas of it.
    assert!(unknown < 0.02 * none && none > 1000.0, "{unknown} {none}");
}

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_slow_tilt_of_two_sigmas_may_be_the_references_and_one_of_twenty_or_a_sudden_one_is_not() {
        let tilt =
            |rad: f64, span: Option<Span>| worth("table-tilt", &[rad, 0.0], [3e-3, 0.0], span.map(Interval::from));
        let [small, large] = [6e-3, 60e-3].map(|rad| tilt(rad, None));
        // That a tilt stays for three correlation times is a little less likely than that it is there once.
        assert!((0.0..=6.0).contains(&small), "{small}");
        assert!(large > 100.0, "{large}");
        // No attitude error of twenty seconds begins between two samples.
        let sudden = tilt(6e-3, Some(Span { from: 20.0, to: 40.0 }));
        assert!(sudden > 3.0 * small, "{sudden} {small}");
    }

    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_lever_arm_of_a_millimetre_may_be_the_references_and_one_of_centimetres_is_not() {
        let arm = |metres: f64, accuracy: [f64; 2]| worth("lever-arm", &[metres, 0.0, 0.0], accuracy, None);
        assert_eq!(
            arm(0.001, [0.0, 1e-4]),
            f64::INFINITY,
            "an exact reference errs by nothing"
        );
        let [small, large, plain] =
            [[0.003, 1e-4], [0.05, 1e-4], [0.003, 0.0]].map(|[metres, sigma_m]| arm(metres, [1e-3, sigma_m]));
        // Three sigmas of the point are worth four and a half nats at most, and more where a position is exact.
        assert!(small <= 4.5 && plain > 1.5 * small, "{small} {plain}");
        assert!((100.0..=1250.0).contains(&large), "{large}");
    }
}
