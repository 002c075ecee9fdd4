//! A launch rail told over the umbilical: taken, contradicted, kept, and only where it may be.

use emems::{
    derived::Derived, estimate::Estimator, flight_log::record::Content, mode::Cause, rail::Rail, site::Site,
    unit::Settings,
};
use host_tests::{Flight, Flown, MS, S, recorder::contents, replay, world};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion};
use twin::{
    motion::{Motion as _, SoundingRocket},
    plant::Plant,
    run::Fault,
};

/// Of the rocket's rail, azimuth 70 and elevation 85 deg, with sigmas of 0.5 and 0.3 deg.
const RAIL: &[u8] = b"G_RA1B5821340503G_CK";
/// Wrong by 30 deg of azimuth.
const WRONG: &[u8] = b"G_RA271021340503G_CK";

fn on_pad() -> Flight {
    let flight = Flight {
        plant: Plant::new(world("rocket"), 7),
        ..Flight::ideal(world("rocket"))
    };
    // As at the launch site.
    let settings = Settings {
        site: Site::ALCANTARA,
        ..flight.settings
    };
    Flight { settings, ..flight }.say(MS, b"G_DL")
}

/// \[deg\] error of the nose's direction and what the frame says of the whole attitude, in the last frame.
fn last(flown: &Flown) -> [f64; 2] {
    let frame: &Derived = flown.derived.last().expect("a frame");
    let [w, x, y, z] = frame.estimate.q_nb.expect("an attitude").map(f64::from);
    let q_nb = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    let truth = SoundingRocket::new(30.0, 9.78).at(15.0).attitude.q_nb;
    let [nn, ne, nd, ee, ed, dd] = frame.estimate.covariance_n.map(f64::from);
    let covariance_n = Matrix3::new(nn, ne, nd, ne, ee, ed, nd, ed, dd);
    let error_n = (truth * q_nb.inverse()).scaled_axis();
    let off = error_n.norm().to_degrees();
    [off, covariance_n.trace().sqrt().to_degrees()]
}

#[test]
fn a_rail_is_taken_once_the_second_word_confirms_it() {
    let flown = on_pad().say(5 * S, RAIL).fly(15 * S);
    let said = "azimuth 70.00 elevation 85.00 sigma 0.5 0.3 deg";
    for line in [&format!("G_RA: {said}"), "G_RA: send G_CK within 10 s"] {
        assert!(flown.replied(line), "{:?}", flown.replies());
    }
    assert!(flown.replied(&format!("G_RA ok: {said}")), "{:?}", flown.replies());
    assert!(flown.replied("rail taken"), "{:?}", flown.replies());
    let [off, said] = last(&flown);
    assert!(off < 3.0 * said, "{off} {said}");
    let armed = on_pad().say(5 * S, b"G_RA1B5821340503").fly(15 * S);
    assert!(
        !armed.replied("rail taken") && !armed.replied("G_RA ok"),
        "{:?}",
        armed.replies()
    );
}

#[test]
fn a_rail_that_contradicts_the_attitude_is_said_to_and_not_used() {
    let flown = on_pad().say(5 * S, WRONG).fly(15 * S);
    // A chord of 30 deg about the vertical at 85 deg: 2.6 deg.
    assert!(
        flown.replied("rail CONTRADICTS the attitude by 3 deg, not used"),
        "{:?}",
        flown.replies()
    );
    assert!(!flown.replied("rail taken"));
    let without = on_pad().fly(15 * S);
    assert_eq!(last(&flown), last(&without));
    let [off, said] = last(&flown);
    assert!(off < 3.0 * said, "{off} {said}");
}

#[test]
fn a_rail_lasts_over_a_reset_and_a_wrong_number_changes_nothing() {
    let flown = on_pad().say(5 * S, RAIL).fault(10 * S, Fault::Reset).fly(15 * S);
    let taken = flown
        .replies()
        .iter()
        .filter(|line| line.contains("rail taken"))
        .count();
    assert_eq!(taken, 2, "{:?}", flown.replies());
    for (word, why) in [
        (b"G_RA8CA021340503G_CK", "azimuth is not below 360 deg"),
        (b"G_RA1B5823290503G_CK", "elevation is above 90 deg"),
        (b"G_RA1B5821340003G_CK", "a sigma is zero"),
    ] {
        let flown = on_pad().say(5 * S, word).fly(9 * S);
        let replies = flown.replies();
        assert!(flown.replied(&format!("G_RA no: {why}")), "{replies:?}");
        // Refused when it comes: nothing is armed.
        assert!(
            !flown.replied("send G_CK") && flown.replied("G_CK no: nothing to confirm"),
            "{replies:?}"
        );
        assert!(!flown.replied("rail taken"));
    }
    let flying = on_pad().say(4 * S, b"G_MVG_MV").say(6 * S, RAIL).fly(9 * S);
    assert!(flying.replied("G_RA no: only in WAIT"), "{:?}", flying.replies());
}

/// The superblock has it. A command knows better, even one that comes before the log is heard.
#[test]
fn a_rail_lasts_over_a_power_cut_unless_another_was_told_since() {
    let cut = || on_pad().say(5 * S, RAIL).fault(10 * S, Fault::PowerCut(0));
    let flown = cut().fly(20 * S);
    let before = "rail as before the power cut: azimuth 70.00 elevation 85.00 sigma 0.5 0.3 deg";
    assert!(flown.replied(before), "{:?}", flown.replies());
    let replies = flown.replies();
    let taken = replies.iter().filter(|line| line.contains("rail taken")).count();
    assert_eq!(taken, 2, "{replies:?}");
    // Kept again: a reset after it, and another cut, change nothing; twelve zeros forget it.
    let again = cut().fault(14 * S, Fault::Reset).fault(18 * S, Fault::PowerCut(0));
    let replies = again
        .say(21 * S, b"G_RA000000000000G_CK")
        .fault(24 * S, Fault::PowerCut(0));
    let replies = replies.fly(28 * S).replies();
    let found = replies.iter().filter(|line| line.contains(before)).count();
    assert_eq!(found, 2, "{replies:?}");

    let silent = cut()
        .fault(10 * S + MS / 10, Fault::NandDead(true))
        .say(12 * S, b"G_RA1B5821340A0AG_CK");
    let flown = silent.fault(14 * S, Fault::NandDead(false)).fly(20 * S);
    assert!(flown.replied("G_RA ok: azimuth 70.00 elevation 85.00 sigma 1.0 1.0 deg"));
    assert!(!flown.replied("rail as before"), "{:?}", flown.replies());
}

/// The answer is the newest frame's attitude; without one it says so.
#[test]
fn the_pad_alignment_is_said_with_sigmas_and_sensors() {
    let early = on_pad().say(300 * MS, b"G_PA").fly(S);
    assert!(early.replied("G_PA no attitude"), "{:?}", early.replies());
    let flown = on_pad()
        .say(5 * S, RAIL)
        .fault(6 * S, Fault::Silent(5))
        .say(15 * S - 50 * MS, b"G_PA")
        .fly(15 * S);
    let replies = flown.replies();
    let line = replies
        .iter()
        .find_map(|line| line.split("G_PA ").nth(1))
        .expect("an answer");
    let words: Vec<&str> = line.split_whitespace().collect();
    let number = |at: usize| words[at].parse::<f64>().unwrap_or_else(|_| panic!("{line}"));
    for (name, at, truth) in [("azimuth", 0, 70.0), ("elevation", 4, 85.0)] {
        let (value, sd) = (number(at + 1), number(at + 3));
        assert_eq!(words[at], name);
        assert!(sd > 0.0 && sd < 2.0 && (value - truth).abs() < 3.0 * sd, "{line}");
    }
    assert!(flown.replied("G_PA plates 1 amgt 2 a-gt 3 amgt 4 amgt"), "{replies:?}");
}

/// Cycles whose frame is not, bit for bit, what the estimation makes of it with rails taken at these times \[us\], each before the next
/// cycle.
fn differing(flown: &Flown, settings: &Settings, rails: &[(u64, Rail)]) -> Vec<u16> {
    let mut estimator = Estimator::of(settings);
    let mut rails = rails.iter().peekable();
    let differing = replay::differing(flown, |frame, sample| {
        while let Some((_, rail)) = rails.next_if(|(at_us, _)| *at_us < frame.start_us) {
            assert_eq!(estimator.know_nose(&rail.nose(), true), Some(Ok(())), "{rail}");
        }
        estimator.step(sample, &frame.increments)
    });
    assert_eq!(rails.next(), None, "a rail after the flight");
    differing
}

#[test]
fn a_flight_replays_bit_for_bit_with_the_rails_of_its_log() {
    let flight = on_pad()
        .say(5 * S, RAIL)
        // Another sigma: taken again.
        .say(8 * S, b"G_RA1B5821340803G_CK")
        .say(11 * S, WRONG)
        .say(14 * S, b"G_MVG_MV")
        .say(15 * S, b"G_MGG_MG");
    let settings = flight.settings;
    let mut flown = flight.fly(20 * S);
    let chip = flown.nand.take().expect("a chip");
    let rails: Vec<(u64, Rail)> = contents(chip)
        .into_values()
        .filter_map(|content| match content {
            Content::Change(change) => Some(change),
            _ => None,
        })
        .filter_map(|change| match change.cause {
            Cause::RailTaken(rail) => Some((change.at_us, rail)),
            _ => None,
        })
        .collect();
    let azimuth_sds: Vec<u8> = rails.iter().map(|(_, rail)| rail.azimuth_sd).collect();
    assert_eq!(azimuth_sds, [5, 8], "{:?}", flown.replies());
    assert_eq!(differing(&flown, &settings, &rails), []);
    assert!(differing(&flown, &settings, &[]).len() > 10);
    assert!(!differing(&flown, &settings, &rails[..1]).is_empty());
}
