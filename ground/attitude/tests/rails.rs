//! A unit on the launch rail: with the rails of its flight log its attitude comes back bit for bit.

use attitude::rails::{self, NoRails};
use emems::{estimate::Estimator, sample::Sample, site::Site, unit::Settings};
use host_tests::{Flight as Flown, MS, S, world};
use logs::{
    cycles::Cycle,
    flight::{Flight, Taken},
};
use twin::plant::Plant;

#[test]
fn the_attitude_is_the_units_with_the_rails_of_its_flight_log() {
    let flight = Flown {
        plant: Plant::new(world("rocket"), 7),
        ..Flown::ideal(world("rocket"))
    };
    let settings = Settings {
        site: Site::ALCANTARA,
        ..flight.settings
    };
    let flight = Flown { settings, ..flight }
        .say(MS, b"G_DL")
        .say(5 * S, b"G_RA1B5821340503G_CK")
        // Another sigma: taken again.
        .say(8 * S, b"G_RA1B5821340803G_CK")
        .say(14 * S, b"G_MVG_MV")
        .say(15 * S, b"G_MGG_MG");
    let flown = flight.fly(20 * S);
    let image = flown.nand.as_ref().expect("a chip").image();
    let rails = rails::of(&recorder::log::read(&image).expect("a log"));
    let azimuth_sds: Vec<u8> = rails.iter().map(|taken| taken.rail.azimuth_sd).collect();
    assert_eq!(azimuth_sds, [5, 8]);
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
    let replayed = |rails: &[Taken]| Flight::of_unit(Estimator::of(&settings), &cycles, rails);
    let all = replayed(&rails);
    assert_eq!((all.replayed[1], all.rails), (0, [2, 0]));
    for fewer in [&rails[..0], &rails[..1]] {
        assert!(replayed(fewer).replayed[1] > 10, "{} rails", fewer.len());
    }
}

#[test]
fn a_file_without_a_record_is_no_flight_log() {
    let path = std::env::temp_dir().join("emems-attitude-no-flight-log");
    std::fs::write(&path, "t_s,gyr_x\n").expect("a file");
    let refused = rails::read(&path);
    std::fs::remove_file(&path).expect("the file");
    assert!(matches!(refused, Err(NoRails::Nothing(_))), "{refused:?}");
}
