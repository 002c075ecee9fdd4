//! A unit on the pad: with the launch rails and sites of its flight log its attitude comes back bit for bit.

use attitude::told::{self, NothingTold};
use emems::{estimate::Estimator, sample::Sample, unit::Settings};
use host_tests::{Flight as Flown, MS, S, world};
use logs::{
    cycles::Cycle,
    flight::{CrewWord, Flight, Taken},
};
use twin::plant::Plant;

#[test]
fn the_attitude_is_the_units_with_the_site_and_the_rails_of_its_flight_log() {
    let flight = Flown {
        plant: Plant::new(world("rocket"), 7),
        ..Flown::ideal(world("rocket"))
    };
    let flight = flight
        .say(MS, b"G_DL")
        .say(2 * S, b"G_SI2634FF18F7DDFC84020A400F00G_CK")
        .say(5 * S, b"G_RA1B5821340503G_CK")
        // Another sigma: taken again.
        .say(8 * S, b"G_RA1B5821340803G_CK")
        .say(14 * S, b"G_MVG_MV")
        .say(15 * S, b"G_MGG_MG");
    let flown = flight.fly(20 * S);
    let image = flown.nand.as_ref().expect("a chip").image();
    let log = recorder::log::read(&image).expect("a log");
    let taken = told::of(&log, told::boot(&log, flown.packets.iter().map(|(_, packet)| *packet)));
    let kinds: Vec<bool> = (taken.iter().map(|taken| matches!(taken.told, CrewWord::Site(_)))).collect();
    assert_eq!(kinds, [true, false, false], "{taken:?}");
    let cycles: Vec<Cycle> = (flown.derived.iter())
        .map(|frame| Cycle {
            sample: Sample {
                reading: (flown.packets.iter())
                    .find(|(_, packet)| packet.counter == frame.counter)
                    .expect("its packet")
                    .1,
                start_us: frame.start_us,
                slots_us: frame.slots_us,
            },
            increments: frame.increments,
            sent: Some(Box::new(*frame)),
        })
        .collect();
    let settings = Settings::NOMINAL;
    let replayed = |taken: &[Taken]| Flight::of_unit(Estimator::of(&settings), &settings.site, &cycles, taken);
    let all = replayed(&taken);
    assert_eq!((all.replayed[1], all.rails, all.sites), (0, [2, 0], 1));
    // Without one of them, or with a cycle's delay of the site.
    let late = [
        Taken {
            at_us: taken[0].at_us + 1,
            ..taken[0]
        },
        taken[1],
        taken[2],
    ];
    for other in [&taken[..0], &taken[..1], &taken[..2], &taken[1..], &late] {
        assert!(replayed(other).replayed[1] > 0, "{other:?}");
    }
}

#[test]
fn a_file_without_a_record_is_no_flight_log() {
    let path = std::env::temp_dir().join("emems-attitude-no-flight-log");
    std::fs::write(&path, "t_s,gyr_x\n").expect("a file");
    let refused = told::open(&path);
    std::fs::remove_file(&path).expect("the file");
    assert!(matches!(refused, Err(NothingTold::Nothing(_))), "{refused:?}");
}
