//! The umbilical: what is said, and what the unit answers and does.

use emems::packet;
use host_tests::world;
use host_tests::{Flight, Flown, MS, S, set_words};

fn still() -> Flight {
    Flight::ideal(world("still"))
}

/// Packets that came over the umbilical.
fn packets_in(flown: &Flown) -> usize {
    flown
        .umbilical
        .split(|byte| *byte == packet::START)
        .filter(|rest| {
            rest.get(..packet::PACKET_BYTES - 1)
                .is_some_and(|body| packet::decode(&[&[packet::START], body].concat()).is_ok())
        })
        .count()
}

#[test]
fn help_lists_every_word_and_version_and_status_answer() {
    let flown = still()
        .say(S, b"G_HE")
        .say(2 * S, b"G_VE")
        .say(3 * S, b"G_ST")
        .fly(4 * S);
    let replies = flown.replies();
    for entry in &emems::command::COMMANDS {
        let line = format!("{} {}", String::from_utf8_lossy(entry.word), entry.meaning);
        assert!(replies.contains(&line), "{line} in {replies:#?}");
    }
    assert!(flown.replied("G_VE: e-MEMS 0.1.0"), "{replies:#?}");
    assert!(flown.replied("G_ST WAIT task none recording 0"), "{replies:#?}");
    assert!(flown.replied("G_ST clock crystal stack 0 of 0 bytes"), "{replies:#?}");
}

#[test]
fn packets_go_to_the_umbilical_between_g_mt_and_g_mt_small() {
    let flown = still().say(S, b"G_MTG_MT").say(3 * S, b"G_MtG_Mt").fly(5 * S);
    assert_eq!(packets_in(&flown), 10);
    assert!(flown.replied("G_MT ok"));
}

#[test]
fn telemetry_never_stops_whatever_is_asked() {
    let words: Vec<u8> = emems::command::COMMANDS.iter().flat_map(|entry| *entry.word).collect();
    let mut flight = still();
    for second in 1..20 {
        flight = flight.say(second * S, &words).say(second * S + 300 * MS, b"G_AT");
    }
    let flown = flight.fly(22 * S);
    assert!(
        flown.periods().iter().all(|period| period.abs_diff(200 * MS) <= MS),
        "{:?}",
        flown.periods()
    );
    assert!(flown.strange.is_empty());
}

#[test]
fn a_flight_is_recorded_dumped_and_erased() {
    let flown = still()
        .say(S, b"G_MV")
        .say(S + 100 * MS, b"G_MV")
        .say(2 * S, b"G_MGG_MG")
        .say(4 * S, b"G_MEG_ME")
        .say(5 * S, b"G_Ml")
        .say(7 * S, b"G_LR000002000003")
        .say(8 * S, b"G_MA")
        .say(9 * S, b"G_CA")
        .say(10 * S, b"G_ST")
        .fly(11 * S);
    assert!(
        flown.replied("G_MV: send G_MV within 10 s") && flown.replied("G_MV ok: FLIGHT"),
        "{:?}",
        flown.replies()
    );
    // Of pages 2 to 4 the first holds the change to FLIGHT, the others records; page 1 repeats nothing: no boot came before.
    assert_eq!(packets_in(&flown), 10 + 2, "{:?}", flown.replies());
    assert!(
        // With the arming of the erase; then header and erase, which begin the new log.
        flown.replied("G_CA ok: erasing 15 pages") && flown.replied("recorder 3 of"),
        "{:?}",
        flown.replies()
    );
}

#[test]
fn refusals_give_the_reason() {
    let flown = still()
        .say(S, b"G_MGG_MG")
        .say(2 * S, b"G_CA")
        .say(3 * S, b"G_MX")
        .say(4 * S, b"G_LR00Z")
        .fly(5 * S);
    for reply in [
        "G_MG no: only in FLIGHT",
        "G_CA no: nothing to confirm",
        "G_MX no: unknown",
        "G_LR no: digit 2 is 0x5A",
    ] {
        assert!(flown.replied(reply), "{reply} in {:?}", flown.replies());
    }
}

#[test]
fn every_sensor_passes_its_self_test_and_packets_go_on() {
    let flown = still().say(2 * S, b"G_AT").fly(12 * S);
    assert!(flown.replied("G_AT done: 16 of 16 passed"), "{:#?}", flown.replies());
    assert!(flown.second(11).iter().all(|reading| reading.errors.0 == 0));
}

/// The set the unit says it uses.
fn read_back(flown: &Flown) -> Vec<u8> {
    let replies = flown.replies();
    let hex: String = replies
        .iter()
        .filter_map(|line| line.strip_prefix("G_CR "))
        .filter_map(|line| line.split(' ').nth(1))
        .collect();
    let byte = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal");
    (0..hex.len()).step_by(2).map(byte).collect()
}

#[test]
fn a_calibration_set_is_loaded_only_whole_and_sound_and_in_wait() {
    let settings = emems::unit::Settings::NOMINAL;
    let nominal = emems::calibration::Set::nominal(emems::calibration::Ranges::of(&settings));
    let mut own = nominal;
    own.identity.unit = 7;
    own.identity.set = 5;
    own.gyro[2].bias_counts = -12.5;
    let sent = set_words(&own);
    let good = still()
        .say(S, &sent)
        .say(3 * S, b"G_CLG_CK")
        .say(4 * S, b"G_CR")
        .fly(6 * S);
    assert!(good.replied("G_CL ok: set 5 of unit 7"), "{:?}", good.replies());
    assert_eq!(read_back(&good), own.encode());
    assert_eq!(good.second(5).len(), 5, "packets go on");

    let mut spoilt = sent.clone();
    spoilt[16 * 40 + 10] ^= 1;
    for (words, why) in [
        (&sent[16..], "G_CL no: 1 words missing, the first at 0000"),
        (&spoilt[..], "G_CL no: checksum"),
    ] {
        let flown = still()
            .say(S, words)
            .say(3 * S, b"G_CLG_CK")
            .say(4 * S, b"G_CR")
            .fly(6 * S);
        assert!(flown.replied(why), "{why}: {:?}", flown.replies());
        assert_eq!(read_back(&flown), nominal.encode(), "{why}");
    }

    let mut foreign = own;
    foreign.identity.unit = 9;
    let foreign = [&sent[..], b"G_CLG_CK", &set_words(&foreign)[..], b"G_CLG_CK"].concat();
    let numbered = still().say(S, &foreign).say(6 * S, b"G_CR").fly(8 * S);
    let why = "G_CL no: of unit 9, this is unit 7";
    assert!(numbered.replied(why), "{:?}", numbered.replies());
    assert_eq!(read_back(&numbered), own.encode());

    let flying = still()
        .say(S, b"G_MV")
        .say(S + 100 * MS, b"G_MV")
        .say(2 * S, &sent)
        .say(4 * S, b"G_CL")
        .say(5 * S, b"G_MEG_ME")
        .say(6 * S, b"G_CLG_CR")
        .fly(8 * S);
    assert!(flying.replied("G_CL no: only in WAIT"), "{:?}", flying.replies());
    assert!(
        flying.replied("G_CL no: 284 words missing"),
        "nothing was taken in FLIGHT"
    );
    assert_eq!(read_back(&flying), nominal.encode());
}
