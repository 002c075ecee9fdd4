//! A unit that was told its launch site flies, and is started once more to be read out: every command that needs the site takes it from the
//! flight log.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use attitude::told;
use emems::{
    derived, packet,
    site::{Site, Told},
};
use host_tests::{Flight, MS, S, world};
use twin::{plant::Plant, run::Fault};

const SITE: &[u8] = b"G_SI2634FF18F7DDFC84020A400F00G_CK";
const RAIL: &[u8] = b"G_RA1B5821340503G_CK";
const SITE_SAID: &str = "gravity 9.780 m/s2 latitude -2.32 declination -20.83 dip -8.92 sd 0.2 deg field 26.24 iron 0.15 uT per g 0.00 deg/s";
const RAIL_SAID: &str = "azimuth 70.00 elevation 85.00 sigma 0.5 0.3 deg";

/// A unit with the laboratory's site compiled in, on the pad at Alcantara.
fn on_pad() -> Flight {
    let flight = Flight {
        plant: Plant::new(world("rocket"), 7),
        ..Flight::ideal(world("rocket"))
    };
    flight.say(MS, b"G_DL")
}

/// Flies it, and starts it again four seconds before the end: the chip's image, and what it sent before that.
fn files(place: &Path, flight: Flight) -> [PathBuf; 2] {
    let flight = flight.say(12 * S, b"G_MVG_MV").say(13 * S, b"G_MGG_MG");
    let flown = flight.fault(16 * S, Fault::PowerCut(0)).fly(20 * S);
    let image = flown.nand.as_ref().expect("a chip").image();
    let frames = flown.derived.as_slice();
    let restart = frames.windows(2).position(|pair| pair[1].start_us < pair[0].start_us);
    let (before, _) = frames.split_at(restart.expect("a start") + 1);
    assert!(before.len() > 70 && before.len() + 10 < frames.len());
    let mut sent = Vec::new();
    for frame in before {
        let of_frame = |(_, reading): &&(_, emems::sample::Reading)| reading.counter == frame.counter;
        let (_, reading) = flown.packets.iter().find(of_frame).expect("its packet");
        sent.extend(packet::encode(reading));
        sent.extend(derived::encode(frame));
    }
    [("nand.bin", image), ("packets.txt", sent)].map(|(name, bytes)| {
        let path = place.join(name);
        fs::write(&path, bytes).expect("written");
        path
    })
}

fn ground(words: &[&str], files: &[&Path]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ground"));
    command.args(words).args(files).output().expect("the program runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn recover_says_what_is_kept_and_attitude_replays_the_flight_and_not_the_start_after_it() {
    let place = tempfile::tempdir().expect("temporary folder");
    let [image, packets] = files(place.path(), on_pad().say(2 * S, SITE).say(5 * S, RAIL));
    let said = text(&ground(&["recover"], &[&image]).stderr);
    for line in [
        format!("\nkept       launch rail: {RAIL_SAID}\n"),
        format!("\n           launch site: {SITE_SAID}\n"),
    ] {
        assert!(said.contains(&line), "{said}");
    }
    let table = place.path().join("flight.csv");
    let json = ground(&["recover", "--json", "--table"], &[&table, &image]).stdout;
    let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
    assert_eq!(
        (
            &json["kept"]["site"]["latitude_deg"],
            &json["kept"]["rail"]["azimuth_sigma_deg"]
        ),
        (&(-2.32).into(), &0.5.into())
    );
    let said = text(&ground(&["attitude"], &[&packets, Path::new("--flight-log"), &image]).stdout);
    for line in [
        format!("launch site                 {SITE_SAID}, taken at "),
        format!("launch rail                 {RAIL_SAID}, taken at "),
        "launch sites                1 taken\n".into(),
        "cycles bit for bit, 0 not\n".into(),
    ] {
        assert!(said.contains(&line), "{line}: {said}");
    }
    assert!(!said.contains("not taken"), "{said}");
    let without = text(&ground(&["attitude"], &[&packets]).stdout);
    assert!(!without.contains("cycles bit for bit, 0 not"), "{without}");
}

/// Heading is by the declination of the site, 1.3 deg more than the laboratory's.
#[test]
fn a_decoded_page_is_at_the_site_of_the_flight_log() {
    let place = tempfile::tempdir().expect("temporary folder");
    let [image, _] = files(place.path(), on_pad().say(2 * S, SITE));
    let [elsewhere, _] = files(&make(place.path(), "elsewhere"), on_pad());
    let log = told::open(&image).expect("a log");
    let recorded = place.path().join("recorded.txt");
    let packets: Vec<u8> = log.packets_of(false).flat_map(|(_, entry)| entry.packet).collect();
    fs::write(&recorded, packets).expect("written");
    let decoded = |name: &str, file: &Path, flight_log: &[&Path]| {
        let out = place.path().join(name);
        let output = ground(&["decode"], &[&[file, Path::new("--out"), &out], flight_log].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let said = text(&output.stdout);
        let page = fs::read_to_string(said.lines().last().expect("a page")).expect("a page");
        let yaw = page
            .split("<h3>yaw</h3>")
            .nth(1)
            .and_then(|rest| rest.split("</svg>").next());
        (said.contains(SITE_SAID), yaw.expect("a plot").to_owned())
    };
    let [of_image, with, without] = [
        decoded("image", &image, &[]),
        decoded("with", &recorded, &[Path::new("--flight-log"), &image]),
        decoded("without", &recorded, &[]),
    ];
    assert_eq!((of_image.0, with.0, without.0), (true, true, false));
    assert!(of_image.1 == with.1 && with.1 != without.1);
    assert!(!decoded("none", &elsewhere, &[]).0);
    let refused = ground(
        &["decode"],
        &[
            &recorded,
            Path::new("--out"),
            place.path(),
            Path::new("--flight-log"),
            &recorded,
        ],
    );
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        text(&refused.stderr).contains("no record of a flight log"),
        "{}",
        text(&refused.stderr)
    );
}

#[test]
fn a_case_is_not_made_with_the_flight_log_of_a_unit_that_was_told_no_site() {
    let place = tempfile::tempdir().expect("temporary folder");
    let [image, packets] = files(place.path(), on_pad());
    let out = place.path().join("case");
    let files: [&Path; 7] = [
        &packets,
        Path::new("--reference"),
        &packets,
        Path::new("--out"),
        &out,
        Path::new("--flight-log"),
        &image,
    ];
    let refused = ground(&["case", "new", "--log"], &files);
    let said = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{said}");
    assert!(
        said.contains("nand.bin: the unit was told no launch site (G_SI)") && said.contains("--gravity-m-s2"),
        "{said}"
    );
    assert!(!out.exists());
}

fn make(place: &Path, name: &str) -> PathBuf {
    let folder = place.join(name);
    fs::create_dir(&folder).expect("made");
    folder
}

/// Where the record of it is lost, the superblock has the site; one that came too late for a flight is told apart.
#[test]
fn the_site_is_the_last_that_was_taken_or_else_the_one_kept() {
    let place = tempfile::tempdir().expect("temporary folder");
    let told = Told::of(&Site::ALCANTARA);
    let [image, _] = files(place.path(), on_pad().say(2 * S, SITE));
    let mut log = told::open(&image).expect("a log");
    assert_eq!((told::site(&log), told::untaken(&log)), (told, None));
    log.changes.clear();
    assert_eq!(told::site(&log), told);
    log.superblock = recorder::kept::InSuperblock::Lost;
    assert_eq!(told::site(&log), None);
    // The flight begins before the next cycle.
    let late = on_pad().say(5 * S, &[SITE, b"G_MVG_MV"].concat()).fly(9 * S);
    let log = recorder::log::read(&late.nand.expect("a chip").image()).expect("a log");
    assert_eq!((told::site(&log), told::untaken(&log)), (None, told));
}
