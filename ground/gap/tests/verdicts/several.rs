//! Several effects at once beside an exact reference.

use std::fmt::Write;

use crate::{
    gyros::diagnosed_in,
    twin_case::{Log, active},
};
use gap::{
    input::case::Subject,
    null::{
        model::Model,
        problem::{Component, Problem},
    },
    probability::contribution::imitated,
};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use tempfile::TempDir;
use twin::{
    effect::{Active, Locality},
    kinematics::Motion,
    motion,
};

/// \[s\] of the log.
const SECONDS: f64 = 240.0;

/// A unit that tumbles with these effects.
fn tumbled(active: &[Active]) -> TempDir {
    let world = motion::world_by_name("tumble").expect("a motion");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    let log = Log {
        active,
        ..Log::nominal(&world.motion, world.environment, (0.0, SECONDS))
    };
    let folder = log.folder(
        "several",
        || StandardNormal.sample(&mut random),
        "motion = \"motion.csv\"\n",
        "[windows]\nfit = [[0.0, 60.0], [120.0, 180.0]]\nhold = [[60.0, 120.0], [180.0, 240.0]]\n",
    );
    let mut rows = "t_s,qw,qx,qy,qz\n".to_owned();
    for row in 0..=(50.0 * SECONDS) as usize {
        let t_s = 0.02 * row as f64;
        let q_nb = world.motion.at(t_s).attitude.q_nb;
        let _ = writeln!(
            rows,
            "{t_s:.2},{:.12},{:.12},{:.12},{:.12}",
            q_nb.w, q_nb.i, q_nb.j, q_nb.k
        );
    }
    std::fs::write(folder.path().join("motion.csv"), rows).expect("a file");
    folder
}

/// Four in the same gyro leave nothing: they are no patchwork for something else.
#[test]
fn four_effects_in_one_gyro_that_leave_nothing_are_named() {
    let at = |channel: &str| Locality::Channel(channel.to_owned());
    let made = [
        active("gyro-g-sensitivity", at("g1"), &[6e-4, 0.0, 3e-4]),
        active("gyro-nonlinearity", at("g1"), &[4e-3, 5e-3]),
        active("gyro-bias", at("g1"), &[-0.016]),
        active("gyro-misalignment", at("g1"), &[-0.02, 0.015]),
    ];
    let folder = tumbled(&made);
    let (_, diagnosis) = diagnosed_in(&folder, &[]);
    let mut named: Vec<&str> = (diagnosis.causes.iter())
        .filter(|cause| cause.probability >= 0.5)
        .map(|cause| cause.effect)
        .collect();
    named.sort_unstable();
    assert_eq!(
        named,
        [
            "gyro-bias",
            "gyro-g-sensitivity",
            "gyro-misalignment",
            "gyro-nonlinearity"
        ],
        "{:?}",
        diagnosis.withdrawn
    );
}

/// A step five seconds after the start is nearly a zero that moved: nine tenths of its energy are. But its evidence is the step.
#[test]
fn the_whole_of_an_effect_counts_only_where_its_evidence_is_a_calibration_that_is_strained() {
    let at = |plate: &str| Locality::Group(plate.to_owned());
    let mut step = active("accel-hysteresis", at("plate 2"), &[0.2; 3]);
    step.cause.variant = 5.0;
    let bias = active("accel-bias", at("plate 3"), &[0.3; 3]);
    let folder = tumbled(&[step.clone(), bias.clone()]);
    let subject = Subject::open(folder.path()).expect("opens");
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let components = [step, bias].map(|active| Component { active, span: None });
    let wholes = imitated(&problem, &Model::around(&problem, components.to_vec()));
    assert_eq!(wholes[0], 0.0);
    assert!(wholes[1] > 1e4, "{wholes:?}");
}
