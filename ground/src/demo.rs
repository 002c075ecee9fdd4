//! `ground demo`: the whole loop, from a flight to a verdict and back, on one page.
//!
//! In: a seed, which draws what is wrong with the unit. Out: a folder with three flights and `index.html`. In order:
//!
//! 1. the unit flies with something wrong, and flies again along another motion; what is wrong is drawn, and not told;
//! 2. the diagnosis gets the first flight's folder, names what is wrong and writes the twin with it in;
//! 3. that twin flies the first motion again, as registers on the same board;
//! 4. nominal and corrected twin are held against the second flight, which the diagnosis has not seen;
//! 5. the answer is opened, last of all.
//!
//! The diagnosis reads `packets.txt`, `motion.csv`, `unit.toml` and `case.toml`, never `answer.toml`.

use std::{
    fs, io,
    path::{Path, PathBuf},
    thread,
    time::Instant,
};

use chart::{Axis, Block, Figure, Layer, Marks, Panel};
use clap::Parser;
use flight::{
    case::{
        ANSWER,
        text::{CASE, MOTION},
    },
    interrupt::Interrupt,
    plan,
};
use gap::{
    against::{Against, against},
    command::{CORRECTED, UNIT, VERDICT, asked},
    input::case::Subject,
    kept::text,
};
use logs::folder::{self, FolderError};
use serde::Deserialize;
use trials::draw::Draw;
use twin::predict::UnitDescription;

use crate::fly::{self, board};

/// What may be wrong: a few of the effects that a unit most often has, each large enough to matter for its attitude.
const DECK: [&str; 8] = [
    "gyro-scale=0.02",
    "soft-iron=0.08",
    "hard-iron=3",
    "gyro-bias=0.01",
    "accel-bias=0.4",
    "accel-scale=0.03",
    "gyro-misalignment=0.03",
    "plate-rotation=0.03",
];

/// The first flight, on a rate table, which is diagnosed; and the second, by hand, which judges.
const FIRST: &str = "--motion tumble --duration 150s --reference table";
const SECOND: &str = "--motion hand --duration 120s --flight 1 --reference exact";

/// What the page is, in a line.
const ABOUT: &str = "A unit with something wrong flew, was diagnosed, and its corrected twin flew the same motion.";

/// Names probable from here on.
const SURE: f64 = 0.5;

/// Flies a unit with something wrong, finds it, flies the corrected twin: one page, at most two minutes
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground demo\n  ground demo --seed 5       something else is wrong\n  ground demo --host         without the emulated board"
)]
pub struct DemoArguments {
    /// What is wrong, and with which specimen of the unit
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Fly the unit's code on this computer instead of its image on the emulated board
    #[arg(long)]
    pub host: bool,
    /// Where the demo's folder goes; an existing one is never overwritten
    #[arg(long, value_name = "DIR", default_value = "flights")]
    pub out: PathBuf,
    /// Print what came out as JSON
    #[arg(long)]
    pub json: bool,
}

/// Why the demo did not come to its page.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    /// A flight.
    #[error("a flight of the demo: {0}")]
    Flight(String),
    /// The diagnosis.
    #[error(transparent)]
    Gap(#[from] gap::GapError),
    /// A case or a description.
    #[error(transparent)]
    Case(#[from] gap::input::case::CaseError),
    /// A file.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The verdict is not as it should be.
    #[error("{VERDICT}: {0}")]
    Verdict(#[from] serde_json::Error),
    /// The answer is not as it should be.
    #[error("{ANSWER}: {0}")]
    Answer(#[from] toml::de::Error),
    /// A figure.
    #[error(transparent)]
    Chart(#[from] chart::ChartError),
    /// The demo's folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
}

/// What the demo needs of a verdict.
#[derive(Deserialize)]
struct Verdict {
    gap: Gap,
    causes: Vec<Cause>,
    none_of_these: f64,
}

#[derive(Deserialize)]
struct Gap {
    before: f64,
}

#[derive(Deserialize)]
struct Cause {
    effect: String,
    channels: Vec<String>,
    probability: f64,
}

/// And of an answer.
#[derive(Deserialize)]
struct Answer {
    effect: Vec<Done>,
}

#[derive(Deserialize)]
struct Done {
    name: String,
    channels: Vec<String>,
}

/// What is wrong with the unit of a seed.
fn withheld(seed: u64) -> &'static str {
    DECK[Draw::new(seed)
        .stream(u64::from_le_bytes(*b"withheld"))
        .below(DECK.len())]
}

/// Runs `ground demo`.
///
/// # Errors
/// See [`DemoError`].
pub fn demo(arguments: &DemoArguments) -> Result<(), DemoError> {
    let began = Instant::now();
    let say = |words: &str| eprintln!("{:4.0} s  {words}", began.elapsed().as_secs_f64());
    let mut host = arguments.host;
    if !host {
        say("looking for the firmware image, or building it");
        if let Err(error) = board::release(None) {
            say(&format!("{error}; flying on this computer instead"));
            host = true;
        }
    }
    let place = folder::make(&arguments.out, &format!("demo-{}", arguments.seed))?;
    let with = format!("--with {}", withheld(arguments.seed));
    let flight = |words: &str| flown(words, arguments.seed, host, &place);
    let board = if host { "this computer" } else { "the emulated board" };
    say(&format!(
        "flying the unit twice on {board}; something is wrong with it, which is not told"
    ));
    let (first, second) = thread::scope(|scope| {
        let second = scope.spawn(|| flight(&format!("{SECOND} {with}")));
        let first = flight(&format!("{FIRST} {with}"));
        let second = second
            .join()
            .unwrap_or_else(|_| Err(DemoError::Flight("it broke down".into())));
        (first, second)
    });
    let (first, second) = (first?, second?);
    say(&format!("diagnosing {}", first.display()));
    let (_, analysis) = asked(&first, &[])?;
    let verdict: Verdict = serde_json::from_str(text(&analysis, VERDICT).unwrap_or_default())?;
    let corrected = first.join(CORRECTED).join(UNIT);
    say("flying the twin with what was found in");
    let motion = first.join(MOTION);
    let twin = flight(&format!(
        "--motion-file {} --unit {} --duration 100s --flight 2",
        motion.display(),
        corrected.display()
    ))?;
    say("holding both twins against the second flight, which the diagnosis has not seen");
    let unit = UnitDescription::open(&corrected).map_err(gap::input::case::CaseError::from)?;
    let compared = against(&second, &unit)?;
    let flown_twin = against_nominal(&twin, &unit)?;
    let told: Answer = toml::from_str(&read(&first.join(ANSWER))?)?;
    let sentence = sentence(&verdict, &told, &compared);
    let blocks = [
        vec![Block::Lead(sentence.clone())],
        vec![Block::Heading("What was withheld, and what was found".into())],
        vec![rows(&verdict, &told, &compared, &flown_twin)],
        vec![Block::Heading("The flight".into()), Block::Figure(readings(&first)?)],
        vec![Block::Heading("The verdict".into())],
        vec![Block::Terminal(text(&analysis, "all.txt").unwrap_or_default().into())],
        vec![Block::Heading(
            "Before and after, on a flight that nobody had seen".into(),
        )],
        vec![Block::Figure(errors(&compared)?), table(&compared)],
        vec![
            Block::Heading("The same by hand".into()),
            Block::Terminal(by_hand(&first, &second, &with)),
        ],
    ]
    .concat();
    let page = place.join("index.html");
    put(&page, &chart::html("From a flight to a verdict", ABOUT, &blocks))?;
    say("done");
    if arguments.json {
        println!("{:#}", listed(&verdict, &told, &compared, &page));
    } else {
        println!("{sentence}\n\n{}\n{}", compared.text("flight 2"), page.display());
    }
    Ok(())
}

/// What came out, for programs.
fn listed(verdict: &Verdict, answer: &Answer, compared: &Against, page: &Path) -> serde_json::Value {
    let withheld =
        (answer.effect.iter()).map(|done| serde_json::json!({"effect": done.name, "channels": done.channels}));
    let named = verdict.causes.iter().map(|cause| {
        serde_json::json!({
            "effect": cause.effect, "channels": cause.channels, "probability": cause.probability,
        })
    });
    let second = compared.pairs.iter().map(|pair| {
        serde_json::json!({
            "name": pair.name, "unit": pair.unit, "described": pair.before, "corrected": pair.after,
        })
    });
    serde_json::json!({
        "withheld": serde_json::Value::from_iter(withheld),
        "named": serde_json::Value::from_iter(named),
        "is_right": is_right(verdict, answer),
        "first_flight": {"gap_sigma": verdict.gap.before},
        "second_flight": serde_json::Value::from_iter(second),
        "page": page,
    })
}

/// Flies quietly; the folder.
fn flown(words: &str, seed: u64, host: bool, out: &Path) -> Result<PathBuf, DemoError> {
    #[derive(Parser)]
    struct Words {
        #[command(flatten)]
        arguments: plan::FlyArguments,
    }
    let trouble = |error: &dyn std::fmt::Display| DemoError::Flight(error.to_string());
    let fixed = ["fly", "--quiet", "--out"].into_iter().map(str::to_owned);
    let board = host.then(|| "--host".to_owned());
    let all = fixed
        .chain([out.display().to_string(), format!("--seed={seed}")])
        .chain(board)
        .chain(words.split(' ').map(str::to_owned));
    let words = Words::try_parse_from(all).map_err(|error| trouble(&error))?;
    let landed = fly::flown(&words.arguments, &Interrupt::default()).map_err(|error| trouble(&error))?;
    Ok(landed.folder)
}

/// The gap of the flown twin: for the nominal description, and for its own.
fn against_nominal(twin: &Path, unit: &UnitDescription) -> Result<Against, DemoError> {
    // Its folder describes it with the effects; the nominal one is without.
    let nominal = twin.join("nominal.toml");
    let mut without = UnitDescription::open(&twin.join(UNIT)).map_err(gap::input::case::CaseError::from)?;
    without.effects.clear();
    put(&nominal, &without.text())?;
    let case = read(&twin.join(CASE))?;
    let as_nominal = twin.join("nominal-case.toml");
    put(&as_nominal, &case.replacen(UNIT, "nominal.toml", 1))?;
    Ok(against(&as_nominal, unit)?)
}

fn names(causes: impl Iterator<Item = (String, Vec<String>)>) -> String {
    let each: Vec<String> = causes
        .map(|(name, channels)| format!("{name} at {}", channels.join(" ")))
        .collect();
    if each.is_empty() {
        "nothing".to_owned()
    } else {
        each.join(", ")
    }
}

fn told(answer: &Answer) -> String {
    names(
        answer
            .effect
            .iter()
            .map(|done| (done.name.clone(), done.channels.clone())),
    )
}

fn found(verdict: &Verdict) -> String {
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    for cause in &verdict.causes {
        match found.iter_mut().find(|(name, _)| *name == cause.effect) {
            Some((_, channels)) => {
                let others = cause.channels.iter().filter(|own| !channels.contains(own)).cloned();
                let others: Vec<String> = others.collect();
                channels.extend(others);
            }
            None => found.push((cause.effect.clone(), cause.channels.clone())),
        }
    }
    names(found.into_iter())
}

/// Whether all that was withheld is named, and nothing else.
fn is_right(verdict: &Verdict, answer: &Answer) -> bool {
    let is_found = |done: &Done| {
        let mut causes = verdict.causes.iter();
        causes.any(|cause| cause.effect == done.name && cause.probability > SURE)
    };
    // An effect may be found in parts, what all plates share and what each has of its own.
    let is_there = |cause: &Cause| answer.effect.iter().any(|done| done.name == cause.effect);
    answer.effect.iter().all(is_found) && verdict.causes.iter().all(is_there)
}

/// The outcome in plain words.
fn sentence(verdict: &Verdict, answer: &Answer, compared: &Against) -> String {
    let outcome = match (is_right(verdict, answer), verdict.causes.is_empty()) {
        (true, _) => "The diagnosis named it",
        (false, true) => "The diagnosis named nothing",
        (false, false) => "The diagnosis named something else",
    };
    let gap = compared.pairs.first();
    let (before, after) = gap.map_or((f64::NAN, f64::NAN), |pair| (pair.before, pair.after));
    format!(
        "{outcome}. Withheld: {}. Named: {}. On a second flight, which it had not seen, the gap goes from {before:.2} to \
         {after:.2} sigma, where 1 is perfect.",
        told(answer),
        found(verdict)
    )
}

fn rows(verdict: &Verdict, answer: &Answer, compared: &Against, twin: &Against) -> Block {
    let of = |against: &Against, name: &str| {
        let pair = against.pairs.iter().find(|pair| pair.name == name);
        pair.map_or("-".to_owned(), |pair| {
            format!("{:.3} to {:.3} {}", pair.before, pair.after, pair.unit)
        })
    };
    let probability = verdict
        .causes
        .first()
        .map_or(verdict.none_of_these, |cause| cause.probability);
    let rows = [
        ("withheld", told(answer)),
        ("named", found(verdict)),
        ("probability", format!("{probability:.3}")),
        ("gap of the first flight", format!("{:.3} sigma", verdict.gap.before)),
        ("gap of the second, before and after", of(compared, "gap")),
        ("attitude by TRIAD, before and after", of(compared, "attitude by TRIAD")),
        (
            "attitude by the Kalman filter, before and after",
            of(compared, "attitude by the Kalman filter"),
        ),
        ("the twin flown: nominal description, its own", of(twin, "gap")),
    ];
    Block::Rows(rows.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
}

fn table(compared: &Against) -> Block {
    let row = |pair: &gap::against::Pair| {
        vec![
            format!("{} [{}]", pair.name, pair.unit),
            format!("{:.3}", pair.before),
            format!("{:.3}", pair.after),
        ]
    };
    Block::Table {
        columns: ["", "as described", "corrected"].map(str::to_owned).into(),
        rows: compared.pairs.iter().map(row).collect(),
    }
}

/// What the first plate's sensors and the gyros read.
fn readings(case: &Path) -> Result<Figure, DemoError> {
    let subject = Subject::open(case)?;
    let starts_s = subject.twin.starts_s();
    let line = |name: &str, colour: usize| {
        let index = subject.twin.unit().channel(name).unwrap_or(0);
        let series = &subject.fit.channels[index];
        let mut points = Vec::new();
        let mut last = None;
        for (row, value) in series.rows.iter().zip(&series.values) {
            let row = *row as usize;
            // The held-out windows are holes.
            if last.is_some_and(|last| row > last + 5) {
                points.push((f64::NAN, f64::NAN));
            }
            last = Some(row);
            points.push((starts_s[row], *value));
        }
        Layer::new(name, colour, Marks::Line(points))
    };
    let panel = |title: &str, unit: &str, names: &[&str]| Panel {
        title: title.to_owned(),
        x: Axis::linear("time [s]"),
        y: Axis::linear(unit),
        layers: names
            .iter()
            .enumerate()
            .map(|(colour, name)| line(name, colour))
            .collect(),
    };
    let panels = [
        panel("gyros", "rate [rad/s]", &["g1", "g2", "g3", "g4"]),
        panel("accelerometer 1", "force [m/s2]", &["a1x", "a1y", "a1z"]),
        panel("magnetometer 1", "field [uT]", &["m1x", "m1y", "m1z"]),
    ];
    Ok(Figure::of(
        "What the unit sent, windows that may be fitted",
        3,
        &panels,
    )?)
}

/// Attitude errors against time.
fn errors(compared: &Against) -> Result<Figure, DemoError> {
    let layer =
        |name: &str, colour: usize, at: usize| Layer::new(name, colour, Marks::Dots(compared.errors_deg[at].clone()));
    let panel = Panel {
        title: String::new(),
        x: Axis::linear("time of the second flight [s]"),
        y: Axis::linear("error [deg]"),
        layers: vec![layer("as described", 1, 0), layer("corrected", 0, 1)],
    };
    Ok(Figure::of(
        "Attitude error of the unit's Kalman filter on the second flight",
        1,
        &[panel],
    )?)
}

fn by_hand(first: &Path, second: &Path, with: &str) -> String {
    let (first, second) = (first.display(), second.display());
    format!(
        "ground fly {FIRST} {with}\nground gap {first}\nground fly {SECOND} {with}\nground gap {first} --against {second}\n\
         ground fly --unit {first}/{CORRECTED}/{UNIT} --motion-file {first}/motion.csv\n"
    )
}

fn read(path: &Path) -> Result<String, DemoError> {
    fs::read_to_string(path).map_err(|source| DemoError::File {
        path: path.into(),
        source,
    })
}

fn put(path: &Path, text: &str) -> Result<(), DemoError> {
    fs::write(path, text).map_err(|source| DemoError::File {
        path: path.into(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_draw_different_things_and_all_of_them_can_be_flown() {
        let drawn: Vec<&str> = (0..40).map(withheld).collect();
        for words in DECK {
            assert!(words.parse::<trials::strike::Wish>().is_ok(), "{words}");
            assert!(drawn.contains(&words), "{words}");
        }
    }

    /// What takes more than six seconds of a core.
    mod long {
        use super::*;

        #[test]
        #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
        fn the_whole_loop_ends_with_a_page_and_names_what_was_withheld() {
            let place = tempfile::tempdir().expect("a folder");
            let arguments = DemoArguments {
                seed: 1,
                host: true,
                out: place.path().into(),
                json: false,
            };
            demo(&arguments).expect("a demo");
            let page = read(&place.path().join("demo-1/index.html")).expect("a page");
            assert!(page.contains("The diagnosis named it."), "{page}");
            assert_eq!(page.matches("data-panel=").count(), 4);
            assert!(!page.split("<script").next().unwrap_or_default().contains("NaN"));
        }
    }
}
