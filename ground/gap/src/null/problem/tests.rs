use twin::{
    effect::Locality,
    environment::Environment,
    motion::Tumble,
    predict::{Scene, emems},
};

use super::*;
use crate::input::log::Series;

/// What all plates share and what each has of its own stand in for each other: taken away one by one, neither explains much.
#[test]
fn parts_of_one_effect_that_share_channels_are_one_name_and_are_taken_away_together() {
    let environment = Environment::laboratory();
    let scene = Scene::new(&Tumble::new(), &environment, 0.0, 20.0, 0.05);
    let twin = Twin::new(emems(|_| 0.0), environment, scene, vec![0.0, 5.0, 10.0]).expect("a twin");
    let series = || Series {
        rows: vec![0, 1, 2],
        values: vec![0.0; 3],
    };
    let fit = Fit {
        channels: (0..twin.unit().channels.len()).map(|_| series()).collect(),
    };
    let reference = Reference::default();
    let problem = Problem::new(&twin, &fit, &reference);
    let channel = |name: &str| Locality::Channel(name.to_owned());
    let model = [
        Component::always("hard-iron", Locality::All, &[1.0; 12]),
        Component::always("gyro-scale", channel("g1"), &[1.0; 1]),
        Component::always("hard-iron", Locality::Common, &[1.0; 3]),
        Component::always("gyro-scale", channel("g2"), &[1.0; 1]),
        Component::always("hard-iron", Locality::Common, &[1.0; 3]),
    ];
    assert_eq!(problem.parts(&model, 0), [0, 2, 4]);
    assert_eq!(problem.parts(&model, 1), [1], "another gyro is another effect");
    assert_eq!(problem.parts(&model, 2), [0, 2], "twice at one place is two events");

    let field = twin.unit().channel("m1x").expect("a channel");
    let of = |parts: &[usize]| {
        let added = problem.added(&model, parts);
        let own = added.into_iter().find(|(index, _)| *index == field);
        own.expect("touched").1[1]
    };
    assert!((of(&[0, 2, 4]) - of(&[0]) - of(&[2]) - of(&[4])).abs() < 1e-9);
    assert!(of(&[0]).abs() > 0.1 && of(&[2]).abs() > 0.1, "each adds something");
}
