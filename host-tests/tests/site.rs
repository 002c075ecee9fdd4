//! A launch site told over the umbilical: taken, kept, replayed, and only where it may be.

use emems::{
    attitude::from_parts,
    derived::Derived,
    estimate::Estimator,
    flight_log::record::Content,
    mode::{Cause, Change},
    site::{Site, Told},
    unit::Settings,
};
use host_tests::{Flight, Flown, MS, S, recorder::contents, replay, world};
use nalgebra::UnitQuaternion;
use twin::{
    motion::{Motion as _, SoundingRocket},
    plant::Plant,
    run::Fault,
};

/// Of Alcantara.
const SITE: &[u8] = b"G_SI2634FF18F7DDFC84020A400F00G_CK";
/// The same with a declination of 20.83 deg east.
const ANOTHER: &[u8] = b"G_SI2634FF180823FC84020A400F00G_CK";
const ZEROS: &[u8] = b"G_SI00000000000000000000000000G_CK";
/// Of the rocket's rail.
const RAIL: &[u8] = b"G_RA1B5821340503G_CK";

const SAID: &str = "gravity 9.780 m/s2 latitude -2.32 declination -20.83 dip -8.92 sd 0.2 deg field 26.24 iron 0.15 uT per g 0.00 deg/s";
const KEPT: &str = "site as before the power cut";

/// A unit with the laboratory's site, on the pad at Alcantara.
fn on_pad() -> Flight {
    Flight {
        plant: Plant::new(world("rocket"), 7),
        ..Flight::ideal(world("rocket"))
    }
    .say(MS, b"G_DL")
}

fn told() -> Told {
    Told::of(&Site::ALCANTARA).expect("a launch site")
}

fn count(flown: &Flown, text: &str) -> usize {
    flown.replies().iter().filter(|line| line.contains(text)).count()
}

fn attitude(frame: &Derived) -> Option<UnitQuaternion<f64>> {
    Some(from_parts(frame.estimate.q_nb?)?.cast())
}

/// \[deg\] error of the last frame's attitude.
fn error(flown: &Flown) -> f64 {
    let q_nb = attitude(flown.derived.last().expect("a frame")).expect("an attitude");
    let truth = SoundingRocket::new(30.0, 9.78).at(15.0).attitude.q_nb;
    q_nb.angle_to(&truth).to_degrees()
}

/// Sites that the estimation took, with when, by the unit's log.
fn taken(flown: &mut Flown) -> Vec<(u64, Told)> {
    let chip = flown.nand.take().expect("a chip");
    let changes = contents(chip).into_values().filter_map(|content| match content {
        Content::Change(Change {
            at_us,
            cause: Cause::SiteTaken(site),
            ..
        }) => Some((at_us, site)),
        _ => None,
    });
    changes.collect()
}

#[test]
fn a_site_is_taken_once_the_second_word_confirms_it() {
    let flown = on_pad().say(5 * S, SITE).fly(15 * S);
    for line in [
        format!("G_SI: {SAID}"),
        "G_SI: send G_CK within 10 s".into(),
        format!("G_SI ok: {SAID}"),
        "site taken".into(),
    ] {
        assert!(flown.replied(&line), "{line}: {:?}", flown.replies());
    }
    // The attitude is found afresh.
    let known = |from_s: u64, to_s: u64| {
        let within = |frame: &&Derived| (from_s * 1_000_000..to_s * 1_000_000).contains(&frame.start_us);
        let frames = flown.derived.iter().filter(within);
        frames.filter(|frame| attitude(frame).is_some()).count()
    };
    assert_eq!((known(3, 5), known(8, 14)), (10, 30));
    assert!(known(5, 7) < 10);
    // Without it north is the laboratory's and the field another.
    let [armed, without] = [&SITE[..30], b"G_ST"].map(|words| on_pad().say(5 * S, words).fly(15 * S));
    assert!(
        !armed.replied("site taken") && !armed.replied("G_SI ok"),
        "{:?}",
        armed.replies()
    );
    assert_eq!(error(&armed).to_bits(), error(&without).to_bits());
    assert_ne!(error(&flown).to_bits(), error(&without).to_bits());
    // By a declination that is wrong by 41 deg the heading is.
    let another = on_pad().say(5 * S, ANOTHER).say(8 * S, RAIL).fly(15 * S);
    let right = on_pad().say(5 * S, SITE).say(8 * S, RAIL).fly(15 * S);
    assert!(right.replied("rail taken") && error(&right) < 2.0, "{}", error(&right));
    assert!(error(&another) > 20.0, "{}", error(&another));
}

#[test]
fn a_wrong_number_is_refused_when_it_comes() {
    for (word, why) in [
        (
            b"G_SI261FFF18F7DDFC84020A400F00G_CK",
            "gravity is not 9.76 to 9.84 m/s2",
        ),
        (
            b"G_SI2671FF18F7DDFC84020A400F00G_CK",
            "gravity is not 9.76 to 9.84 m/s2",
        ),
        (b"G_SI26342329F7DDFC84020A400F00G_CK", "latitude is beyond 90 deg"),
        (b"G_SI2634DCD7F7DDFC84020A400F00G_CK", "latitude is beyond 90 deg"),
        (b"G_SI2634FF184651FC84020A400F00G_CK", "declination is beyond 180 deg"),
        (b"G_SI2634FF18B9AFFC84020A400F00G_CK", "declination is beyond 180 deg"),
        (b"G_SI2634FF18F7DD2135020A400F00G_CK", "dip is beyond 85 deg"),
        (b"G_SI2634FF18F7DDDECB020A400F00G_CK", "dip is beyond 85 deg"),
        (
            b"G_SI2634FF18F7DDFC84000A400F00G_CK",
            "sigma of the field's direction is zero",
        ),
        (b"G_SI2634FF18F7DDFC840207CF0F00G_CK", "field is not 20 to 70 uT"),
        (b"G_SI2634FF18F7DDFC84021B590F00G_CK", "field is not 20 to 70 uT"),
        (b"G_SI2634FF18F7DDFC84020A400000G_CK", "sigma of the iron is zero"),
    ] {
        let flown = on_pad().say(S, word).fly(3 * S);
        let replies = flown.replies();
        assert!(flown.replied(&format!("G_SI no: {why}")), "{why}: {replies:?}");
        // Nothing is armed.
        assert!(
            !flown.replied("send G_CK") && flown.replied("G_CK no: nothing to confirm"),
            "{replies:?}"
        );
        assert!(!flown.replied("site taken"));
    }
}

/// Over a reset it is used from the first cycle on, and a unit in flight goes on with it.
#[test]
fn a_site_lasts_over_a_reset_and_a_unit_in_flight_is_not_changed() {
    let flown = on_pad().say(5 * S, SITE).fault(10 * S, Fault::Reset).fly(15 * S);
    assert_eq!(count(&flown, "site taken"), 2, "{:?}", flown.replies());
    // The memory has it, and the recorder is not asked.
    assert!(!flown.replied(KEPT), "{:?}", flown.replies());
    assert!(error(&flown) < 6.0, "{}", error(&flown));
    let zeros = on_pad().say(5 * S, SITE).say(8 * S, ZEROS);
    let zeros = zeros.fault(10 * S, Fault::Reset).fly(15 * S);
    assert!(zeros.replied("G_SI ok: as compiled in"), "{:?}", zeros.replies());
    let [without, zeros] = [&on_pad().fault(10 * S, Fault::Reset).fly(15 * S), &zeros].map(error);
    assert!((without - zeros).abs() < 0.5, "{without} {zeros}");

    let flying = on_pad().say(4 * S, b"G_MVG_MV").say(6 * S, SITE).fly(9 * S);
    assert!(flying.replied("G_SI no: only in WAIT"), "{:?}", flying.replies());
    // Confirmed, and the mode changes before the next cycle: the site waits for WAIT.
    let late = on_pad().say(5 * S, &[SITE, b"G_MVG_MV"].concat());
    let waiting = late.say(9 * S, b"G_MEG_ME").fly(12 * S);
    assert!(waiting.replied("G_SI ok"), "{:?}", waiting.replies());
    let lines = waiting.replies();
    let place = |text: &str| lines.iter().position(|line| line.contains(text));
    assert!(place("site taken") > place("mode WAIT"), "{lines:?}");
    let during = waiting
        .derived
        .iter()
        .filter(|frame| (5_000_000..9_000_000).contains(&frame.start_us));
    assert!(during.into_iter().all(|frame| attitude(frame).is_some()));
}

/// The superblock has it. A command knows better, even one that comes before the log is heard.
#[test]
fn a_site_lasts_over_a_power_cut_unless_another_was_told_since() {
    let cut = || on_pad().say(5 * S, SITE).fault(10 * S, Fault::PowerCut(0));
    let flown = cut().fly(20 * S);
    assert!(
        flown.replied(KEPT) && flown.replied(&format!("site {SAID}")),
        "{:?}",
        flown.replies()
    );
    assert_eq!(count(&flown, "site taken"), 2, "{:?}", flown.replies());
    // Kept again: a reset after it, and another cut, change nothing; zeros forget it.
    let again = cut().fault(14 * S, Fault::Reset).fault(18 * S, Fault::PowerCut(0));
    let flown = again.say(21 * S, ZEROS).fault(24 * S, Fault::PowerCut(0)).fly(28 * S);
    assert_eq!(count(&flown, KEPT), 2, "{:?}", flown.replies());
    assert_eq!(count(&flown, "site taken"), 5, "{:?}", flown.replies());

    let silent = cut()
        .fault(10 * S + MS / 10, Fault::NandDead(true))
        .say(12 * S, ANOTHER);
    let flown = silent.fault(14 * S, Fault::NandDead(false)).fly(20 * S);
    assert!(flown.replied("declination 20.83"), "{:?}", flown.replies());
    assert!(!flown.replied(KEPT), "{:?}", flown.replies());
}

/// A cut in flight: the attitude goes on from the log at the site of before.
#[test]
fn a_flight_goes_on_after_a_power_cut_at_its_site() {
    let flight = on_pad().say(2 * S, SITE).say(5 * S, RAIL).say(8 * S, b"G_MVG_MV");
    let flight = flight.say(9 * S, b"G_MGG_MG");
    let flown = flight.fault(12 * S, Fault::PowerCut(0)).fly(15 * S);
    assert!(
        flown.replied(KEPT) && flown.replied("mode FLIGHT"),
        "{:?}",
        flown.replies()
    );
    assert!(error(&flown) < 2.0, "{}", error(&flown));
}

/// Cycles whose frame is not, bit for bit, what the estimation makes of it with sites taken at these times \[us\].
fn differing(flown: &Flown, sites: &[(u64, Told)]) -> Vec<u16> {
    let compiled_in = Settings::NOMINAL.site;
    let mut estimator = Estimator::of(&Settings::NOMINAL);
    let mut sites = sites.iter().peekable();
    replay::differing(flown, |frame, sample| {
        while let Some((_, told)) = sites.next_if(|(at_us, _)| *at_us <= frame.start_us) {
            estimator.begin_at(&told.site(&compiled_in));
        }
        estimator.step(sample, &frame.increments)
    })
}

#[test]
fn a_flight_replays_bit_for_bit_with_the_sites_of_its_log() {
    let flight = on_pad()
        .say(3 * S, SITE)
        .say(7 * S, ANOTHER)
        .say(10 * S, ZEROS)
        .say(13 * S, SITE);
    let mut flown = flight.fly(20 * S);
    let sites = taken(&mut flown);
    assert_eq!(sites.len(), 4, "{:?}", flown.replies());
    assert_eq!((sites[0].1, sites[2].1, sites[3].1), (told(), Told::default(), told()));
    assert_eq!(differing(&flown, &sites), []);
    assert!(differing(&flown, &[]).len() > 10);
    for fewer in 0..sites.len() {
        let mut sites = sites.clone();
        sites.remove(fewer);
        assert!(!differing(&flown, &sites).is_empty(), "without {fewer}");
    }
}

/// A unit that starts with a site is, bit for bit, one that has it compiled in.
#[test]
fn a_site_that_is_kept_is_as_good_as_one_compiled_in() {
    // Without a recorder, so that only the memory that survives a reset has it.
    let flight = on_pad().fault(MS, Fault::NandDead(true)).say(3 * S, SITE);
    let flown = flight.fault(6 * S, Fault::Reset).fly(16 * S);
    let frames: Vec<Derived> = flown.derived.clone();
    let restarted = frames
        .iter()
        .rposition(|frame| frame.start_us < 150_000)
        .expect("a start");
    let settings = Settings {
        site: told().site(&Settings::NOMINAL.site),
        ..Settings::NOMINAL
    };
    let mut estimator = Estimator::of(&settings);
    let mut after = Flown::listening(Vec::new());
    after.derived = frames[restarted..].to_vec();
    after.packets = flown.packets.clone();
    assert!(after.derived.len() > 40);
    let as_compiled = replay::differing(&after, |frame, sample| estimator.step(sample, &frame.increments));
    assert_eq!(as_compiled, []);
}
