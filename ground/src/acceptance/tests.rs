//! The acceptance test tried on this computer: a good unit, and one fault at a time, each of which must be named and nobody else.

use super::{
    judge::{Finding, Outcome, Place, judge},
    page,
    rig::{Board, Wrong, run},
    set,
};

const PLACE: Place = Place {
    gravity: 9.80665,
    field_ut: None,
};

fn tried(words: &str, seed: u64) -> Outcome {
    let wrong: Vec<Wrong> = words
        .split_whitespace()
        .map(|word| word.parse().expect("a defect"))
        .collect();
    let run = run(Board::Host, &wrong, seed, &mut |_, _| {}).expect("it runs");
    judge(&run.evidence, PLACE)
}

fn bad(outcome: &Outcome) -> Vec<&Finding> {
    outcome.findings.iter().filter(|finding| !finding.good).collect()
}

#[test]
fn good_units_are_good_and_every_line_is_measured() {
    for seed in [1, 2, 3] {
        let outcome = tried("", seed);
        assert_eq!(bad(&outcome), Vec::<&Finding>::new(), "seed {seed}");
        // Sixteen self-tests, noise of twelve, wiring and two numbers of twelve, and so on.
        assert!(outcome.findings.len() > 100, "{}", outcome.findings.len());
        let set = set::first(&outcome, "EM-1");
        assert_eq!(set.channels.len(), 28);
        let text = set.text().expect("a set");
        assert_eq!(bench::set::Set::parse(&text).expect("it is read"), set);
    }
}

/// What is wrong; what the named line's part is, and what it or its check says; parts that may fail with it.
const FAULTS: &[(&str, &str, &str, &[&str])] = &[
    (
        "exchanged-plates:1,2",
        "multiplexer channel 0",
        "plates 1 and 2 are exchanged",
        &["multiplexer channel 1", "accelerometer", "magnetometer"],
    ),
    (
        "exchanged-plates:3,4",
        "multiplexer channel 3",
        "plates 4 and 3 are exchanged",
        &["multiplexer channel 2", "accelerometer", "magnetometer"],
    ),
    (
        "crossed-selects:1,2",
        "gyro 1",
        "gyros 1 and 2 are exchanged",
        &["gyro 2", "gyros"],
    ),
    (
        "crossed-selects:2,4",
        "gyro 4",
        "chip selects PC3 and PC1 are crossed",
        &["gyro 2", "gyros"],
    ),
    (
        "silent:a2@0s",
        "accelerometer 2",
        "nothing at 0x18",
        &["accelerometers", "buses"],
    ),
    (
        "silent:m3@0s",
        "magnetometer 3",
        "not soldered, dead, or a clone",
        &["magnetometers", "buses"],
    ),
    ("clone:m2", "magnetometer 2", "QMC5883L", &["magnetometers", "buses"]),
    (
        "other:m4",
        "magnetometer 4",
        "another part answers at 0x1E",
        &["magnetometers", "buses"],
    ),
    (
        "other:a1",
        "accelerometer 1",
        "another part answers at 0x18",
        &["accelerometers", "buses"],
    ),
    ("silent:g3@0s", "gyro 3", "chip select PC2", &["gyros", "buses"]),
    ("silent:t4@0s", "thermometer 4", "nothing at 0x48", &["buses"]),
    (
        "mux-silent@0s",
        "accelerometer 1",
        "no I2C part of any plate answers",
        &[
            "accelerometer",
            "magnetometer",
            "thermometer",
            "multiplexer",
            "buses",
            "sensor bus",
            // Its cycles end late, each with twelve parts that are asked in vain.
            "packets",
        ],
    ),
    (
        "silent:a2@0s silent:m2@0s silent:t2@0s",
        "magnetometer 2",
        "its channel SC1 and SD1",
        &[
            "accelerometer",
            "magnetometer",
            "thermometer 2",
            "multiplexer channel 1",
            "buses",
        ],
    ),
    ("inverted:a1x", "accelerometer 1", "x inverted", &["accelerometers"]),
    ("inverted:m3z", "magnetometer 3", "z inverted", &["magnetometers"]),
    ("turned:m2", "magnetometer 2", "x is y, y is -x", &["magnetometers"]),
    ("turned:a4", "accelerometer 4", "soldered turned", &["accelerometers"]),
    ("inverted:g2", "gyro 2", "inverted", &["gyros"]),
    ("slow-bus=80", "sensor bus", "pull-ups of SCL and SDA too weak", &[]),
    ("scale:a3=3", "accelerometer 3", "LIS331DLH", &["accelerometers"]),
    ("bias:a2=3", "accelerometer 2", "offset", &["accelerometers"]),
    ("bias:m1=40", "magnetometer 1", "a magnet", &["magnetometers"]),
    ("bias:g4=15", "gyro 4", "bias at rest", &[]),
    ("noise:a4=0.4", "accelerometer 4", "noise at rest", &[]),
    (
        "frozen:m2@0.9s",
        "magnetometer 2",
        "always the same value",
        &["magnetometers"],
    ),
    ("nand-absent@0s", "recorder", "answers", &[]),
    ("nand-dead@0s", "recorder", "answers", &[]),
    ("lift-off:low@0s", "lift-off line", "PC6 to the connector", &[]),
    ("no-brown-out", "option bytes", "BOR_LEV = 00", &[]),
    ("no-read-out", "option bytes", "RDP = 0xBB", &[]),
    ("supply@1s..1.02s", "supply", "the regulator", &[]),
];

/// Whether a part is one of these, or all of a kind ("accelerometers") where one of it may fail.
fn is_among(part: &str, parts: &[&str]) -> bool {
    let is = |known: &&str| match part.strip_prefix(*known) {
        Some(rest) => rest.is_empty() || rest == "s" || rest.starts_with(' '),
        None => false,
    };
    parts.iter().any(is)
}

#[test]
fn every_fault_is_named_and_nobody_else_is_blamed() {
    let mut wrong = Vec::new();
    for (words, part, says, others) in FAULTS {
        let outcome = tried(words, 1);
        let bad = bad(&outcome);
        if !bad
            .iter()
            .any(|finding| finding.part == *part && finding.text().contains(says))
        {
            let lines: Vec<String> = bad.iter().map(|finding| finding.text()).collect();
            wrong.push(format!("{words}: no line of {part} says \"{says}\" in {lines:#?}"));
        }
        let blamed = bad
            .iter()
            .filter(|finding| finding.part != *part && !is_among(&finding.part, others));
        wrong.extend(blamed.map(|finding| format!("{words}: blamed is {}", finding.text())));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_line_that_floats_high_is_named_and_the_unit_is_not_disturbed() {
    let outcome = tried("lift-off:high@0s", 1);
    let bad = bad(&outcome);
    let named = bad
        .iter()
        .any(|finding| finding.text().contains("lift-off line asserted"));
    assert!(named && bad.len() < 4, "{bad:#?}");
}

#[test]
fn what_is_not_as_drawn_is_not_in_the_first_set() {
    let set = set::first(&tried("crossed-selects:1,2 inverted:a3y", 1), "EM-1");
    let names: Vec<&str> = set.channels.iter().map(|channel| channel.name.as_str()).collect();
    for left_out in ["g1", "g2", "a3x", "a3y", "a3z"] {
        assert!(!names.contains(&left_out), "{left_out}");
    }
    assert_eq!(names.len(), 28 - 5);
}

#[test]
fn the_page_holds_every_line_and_what_to_check() {
    let run = run(
        Board::Host,
        &["inverted:g2".parse().expect("a defect")],
        1,
        &mut |_, _| {},
    )
    .expect("it runs");
    let outcome = judge(&run.evidence, PLACE);
    let page = page::html(&outcome, &run.evidence, "EM-1", "the twin").expect("a page");
    assert!(page.contains("What to check on the board") && page.contains("soldered on the other side"));
    // A picture a panel; the script of the live plots may name what is no number, a picture may not.
    let pictures: Vec<&str> = page
        .split("<svg")
        .skip(1)
        .filter_map(|rest| rest.split("</svg>").next())
        .collect();
    assert_eq!(pictures.len(), 5);
    assert!(pictures.iter().all(|picture| !picture.contains("NaN")));
    assert_eq!(page::json(&outcome)["good"], false);
}
