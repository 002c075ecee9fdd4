//! What the fast twin costs, by length of the log: `cargo bench --profile dev --ignore-rust-version --target host-tuple -p emems-twin`.
//!
//! The e-MEMS unit, 36 channels, five cycles a second, a tumble tabulated at 100 Hz. "Anew" is a prediction in which every
//! instant, axis and lever arm is another than the nominal, so that nothing kept from before helps.

use std::hint::black_box;
use std::time::Instant;

use twin::effect::{Active, Cause, Locality, by_name};
use twin::environment::Environment;
use twin::motion::Tumble;
use twin::predict::{Scene, Twin, emems, thesis_slot_s};

fn active(name: &str, theta: &[f64]) -> Active {
    Active {
        cause: Cause {
            effect: by_name(name).expect("in the library"),
            locality: Locality::Unit,
            variant: 0.0,
        },
        theta: theta.to_vec(),
    }
}

/// \[ms\] the least of some runs.
fn least_ms<T>(runs: u32, mut run: impl FnMut() -> T) -> f64 {
    let once = |_| {
        let begun = Instant::now();
        black_box(run());
        begun.elapsed().as_secs_f64() * 1e3
    };
    (0..runs).map(once).fold(f64::INFINITY, f64::min)
}

fn main() {
    println!("log       tabulate and prepare   predict anew   one Jacobian column of one channel");
    for (name, minutes) in [("10 min", 10.0), ("1 h", 60.0), ("5 h", 300.0)] {
        let span_s = minutes * 60.0;
        let build = || {
            let environment = Environment::laboratory();
            let scene = Scene::new(&Tumble::new(), &environment, 0.0, span_s, 0.01);
            let starts_s = (0..(span_s * 5.0) as u32).map(|k| 0.2 * f64::from(k)).collect();
            Twin::new(emems(thesis_slot_s), environment, scene, starts_s).expect("no known effects")
        };
        let prepare = least_ms(2, build);
        let twin = build();
        let all = [active("mounting", &[0.01, 0.02, 0.03]), active("latency", &[0.01])];
        let anew = least_ms(3, || twin.predict(&all));
        let mut scale = active("gyro-scale", &[0.0]);
        scale.cause.locality = Locality::Channel("g1".to_owned());
        let column = least_ms(3, || twin.jacobian(core::slice::from_ref(&scale), 0));
        println!("{name:8}  {prepare:17.1} ms  {anew:9.1} ms  {column:12.2} ms");
    }
}
