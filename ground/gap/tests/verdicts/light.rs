//! An accelerometer that is warmed by light from one side: no effect of the library is that, and several are a little like it.

use std::fs;

use gap::{diagnose::diagnose, input::case::Subject};
use nalgebra::Vector3;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use twin::{
    motion::{self, Motion},
    predict::Kind,
};

use crate::twin_case::{Log, recorded};

/// \[s\] of the log.
const SECONDS: f64 = 200.0;

/// [m/s2] that the accelerometers of plate 2 are off in full light.
const SWING: [f64; 3] = [0.06, 0.40, 0.17];

/// Which way the face looks that the light falls on.
const FACE_B: [f64; 3] = [0.96, -0.91, 0.91];

/// What takes more than six seconds of a core.
mod long {
    use super::*;

    /// Light does a little like friction. That had 0.91, with the rest of a slow course left in the same channels.
    #[test]
    #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
    fn a_slow_course_beneath_a_name_speaks_against_it_beside_an_exact_reference() {
        let world = motion::world_by_name("rotation-2").expect("a motion");
        // The mean of a minute of light from the north.
        let light = |t_s: f64| {
            let looks = (0..12).map(|back| {
                let q_nb = world.motion.at(t_s - 5.0 * f64::from(back)).attitude.q_nb;
                (q_nb * Vector3::from(FACE_B).normalize()).x.max(0.0)
            });
            looks.sum::<f64>() / 12.0
        };
        let log = Log {
            beyond: &|channel, t_s| match (channel.sensor, channel.group.as_str()) {
                (Kind::Accelerometer, "plate 2") => {
                    let axis = channel.name.chars().last().and_then(|axis| "xyz".find(axis));
                    SWING[axis.expect("an axis")] * light(t_s)
                }
                _ => 0.0,
            },
            ..Log::nominal(&*world.motion, world.environment, (0.0, SECONDS))
        };
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let folder = log.folder(
            "lit",
            move || StandardNormal.sample(&mut random),
            "motion = \"motion.csv\"\n",
            "[windows]\nfit = [[0.0, 130.0]]\nhold = [[130.0, 200.0]]\n",
        );
        let motion = recorded(&*world.motion, 0.0, SECONDS + 1.0);
        fs::write(folder.path().join("motion.csv"), motion).expect("a motion");
        let diagnosis = diagnose(&Subject::open(folder.path()).expect("opens"), &[], &|_, _| {});
        let likely = diagnosis.causes.iter().filter(|cause| cause.probability >= 0.5);
        let likely: Vec<_> = likely.map(|cause| (cause.effect, cause.probability)).collect();
        assert!(likely.is_empty(), "{likely:?}");
    }
}
