//! A slow turn, before weight is gone and after: the filter does not take it for a bias of the gyros.

use std::sync::Arc;

use emems::{estimate::Site, unit::Settings};
use host_tests::{Flight, Flown, MS, S};
use nalgebra::{Unit, Vector3};
use twin::{
    environment::{Environment, World},
    motion::{Attitude, Motion, Pose, Profile},
    plant::{Plant, Quality},
    truth::TruthSource,
};

/// [s] from when on there is no weight, and for how long it flies.
const WEIGHTLESS_S: f64 = 40.0;
const FLOWN_S: u64 = 120;

/// At rest, then turning about a slanting axis, and without weight from [`WEIGHTLESS_S`] on.
struct Coasting {
    angle: Profile,
    gravity_n: Vector3<f64>,
}

impl Motion for Coasting {
    fn at(&self, t_s: f64) -> Pose {
        let axis = Unit::new_normalize(Vector3::new(1.0, 0.4, -0.3));
        let mut pose = Pose::turning(Attitude::level().turned(axis, self.angle.at(t_s)));
        if t_s > WEIGHTLESS_S {
            pose.acc_n = self.gravity_n;
        }
        pose
    }

    fn duration_s(&self) -> Option<f64> {
        None
    }
}

fn turning(rate_deg_s: f64, from_s: f64) -> Flown {
    let environment = Environment::alcantara();
    let angle = Profile::from_rest(0.0)
        .coast(from_s)
        .ramp_to_rate(rate_deg_s.to_radians(), 1.0);
    let world: Arc<dyn TruthSource> = Arc::new(World {
        motion: Coasting {
            angle: angle.coast(1000.0),
            gravity_n: environment.gravity_n(),
        },
        environment,
    });
    Flight {
        plant: Plant::with(world.clone(), 7, Quality::FREE_CLOCKS),
        settings: Settings {
            site: Site::ALCANTARA,
            ..Settings::NOMINAL
        },
        ..Flight::ideal(world)
    }
    .say(MS, b"G_DL")
    .fly(FLOWN_S * S)
}

#[test]
fn a_slow_turn_is_no_bias_with_weight_or_without() {
    /// Cycles at 5 Hz before the turn begins, at rest.
    const KNOWN: usize = 90;
    for from_s in [20.0, WEIGHTLESS_S + 5.0] {
        for rate_deg_s in [0.3, 0.5, 1.0, 1.9, 2.5] {
            let frames = turning(rate_deg_s, from_s).derived;
            let [known, last] = [KNOWN, frames.len() - 1].map(|cycle| frames[cycle].estimate);
            let moved = Vector3::from(last.bias_b) - Vector3::from(known.bias_b);
            let sd = Vector3::from(known.bias_sd).norm();
            assert!(
                moved.norm() < 4.0 * sd,
                "{rate_deg_s} deg/s from {from_s} s: the bias moved by {} deg/s, its deviation was {}",
                moved.norm().to_degrees(),
                sd.to_degrees()
            );
        }
    }
}
