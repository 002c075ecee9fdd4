//! A slow turn, before weight is gone and after: the filter does not take it for a bias of the gyros.

use std::sync::Arc;

use host_tests::{Coasting, Flight, Flown, S};
use nalgebra::Vector3;
use twin::environment::{Environment, World};

/// \[s\] from when on there is no weight, and for how long it flies.
const WEIGHTLESS_S: f64 = 40.0;
const FLOWN_S: u64 = 120;

fn turning(rate_deg_s: f64, from_s: f64) -> Flown {
    let environment = Environment::alcantara();
    let motion = Coasting::turning(rate_deg_s, from_s, 1.0, WEIGHTLESS_S, &environment);
    Flight::at_alcantara(Arc::new(World { motion, environment })).fly(FLOWN_S * S)
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
