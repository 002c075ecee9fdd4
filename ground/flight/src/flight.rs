//! One flight, from the command line to its folder.
//!
//! In: [`FlyArguments`], and what makes the board that flies (the emulated one or the host's): everything here is the same for both. Out:
//! a folder with all that was seen, and the summary ([`Landed`]).

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use logs::{
    digest::Digest,
    folder::{self, Folder, FolderError},
    plot::Truth,
};
use packets::stream::sequence::CYCLE_S;
use trials::flight::{self, Instants};
use twin::plant::{Plant, Quality};

use crate::{
    board::{Board, Remark, Trouble},
    case::{self, CaseError, Flown},
    disturb::{DisturbError, Prepared, prepare},
    interrupt::Interrupt,
    plan::{self, FlyArguments, PlanError},
    progress::Progress,
    source::{self, Source, SourceError},
    transit::Through,
    watch::{Seen, Umbilical, Watch},
    words,
};

/// Why a flight was not made, or not to its end.
#[derive(Debug, thiserror::Error)]
pub enum FlyError {
    /// Nothing to fly.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// What was asked for makes no flight.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// What is to be flown, or how it is to be disturbed.
    #[error(transparent)]
    Disturb(#[from] DisturbError),
    /// The case in the folder.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The board, or whoever sits at its umbilical.
    #[error(transparent)]
    Board(Trouble),
    /// The folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The operating system's interrupt.
    #[error("Ctrl-C cannot be listened to: {0}")]
    Interrupt(#[from] ctrlc::Error),
}

impl FlyError {
    /// Whether it is the input or the command line that is at fault, not the world. Of a board only the board's package knows.
    pub fn is_bad_input(&self) -> bool {
        matches!(self, FlyError::Source(_) | FlyError::Plan(_) | FlyError::Disturb(_))
    }
}

/// A flight that is over.
pub struct Landed {
    /// Its folder.
    pub folder: PathBuf,
    /// Its summary.
    pub rows: Vec<Remark>,
    /// Whether it was flown to its end.
    pub whole: bool,
}

impl Landed {
    /// Its page.
    pub fn page(&self) -> PathBuf {
        self.folder.join("index.html")
    }

    /// What a flight says of itself, with the line's end: the summary, unless nothing but the page is asked for, and where `page` is.
    pub fn text(&self, arguments: &FlyArguments, page: &Path) -> String {
        let rows = self.rows.iter();
        if arguments.json {
            let rows: serde_json::Map<_, _> = rows
                .map(|(name, value)| (name.to_string(), value.clone().into()))
                .collect();
            return format!("{}\n", serde_json::json!({ "summary": rows, "page": page }));
        }
        let summary = match arguments.quiet {
            true => String::new(),
            false => folder::text_of(&self.rows),
        };
        format!("{summary}{}\n", page.display())
    }
}

/// A flight that is ready to take off, watched by nobody or by whoever sits at the umbilical.
pub type TakeOff = Box<dyn FnOnce(Option<Box<dyn Umbilical>>) -> Result<(Seen, Vec<Remark>), FlyError> + Send>;

/// Flies until the end or an interrupt.
///
/// `board` makes what flies. `beside` lets the flight take off, whose folder it is told: alone, or with somebody at
/// the umbilical.
///
/// # Errors
/// See [`FlyError`].
pub fn fly_until(
    arguments: &FlyArguments,
    interrupt: &Interrupt,
    board: impl FnOnce() -> Result<Board, Trouble>,
    beside: impl FnOnce(&Path, TakeOff) -> Result<(Seen, Vec<Remark>), FlyError>,
) -> Result<Landed, FlyError> {
    let source = source::open(arguments)?;
    let duration = match arguments.duration {
        // Whoever talks to the unit says when it is enough.
        None if arguments.console => plan::UNTIL_TOLD,
        asked => plan::duration_of(asked, source.truth.duration_s()),
    };
    let faults = plan::faults(&arguments.silent, duration)?;
    let end = plan::nanos(duration)?;
    if let Some(first) = arguments.in_place_of.as_deref().filter(|first| !first.is_dir()) {
        return Err(PlanError::NoFirst(first.display().to_string()).into());
    }
    // An image that cannot be read or built must not leave an empty folder.
    let Board { name: board, fly } = board().map_err(FlyError::Board)?;
    // Without an end the scene is that of the motion, or of an hour.
    let scene_s = match duration {
        plan::UNTIL_TOLD => source.truth.duration_s().unwrap_or(3_600.0),
        asked => asked.as_secs_f64(),
    };
    let mut prepared = prepare(arguments, source.world.as_ref(), &source.truth, scene_s)?;
    for warning in prepared.iter().flat_map(|prepared| &prepared.warnings) {
        eprintln!("warning: {warning}");
    }
    let folder = match &arguments.in_place_of {
        Some(first) => Folder::create(first, IMAGE, CYCLE_S)?,
        None => Folder::create(&arguments.out, &format!("{}-{}", source.name, arguments.seed), CYCLE_S)?,
    };
    let is_paced = arguments.real_time || arguments.console;
    let progress = Progress::start(
        duration,
        is_paced,
        arguments.console || arguments.quiet || arguments.json,
    );
    let quality = Quality {
        flight: arguments.flight.into(),
        ..Quality::NOMINAL
    };
    let plant = match &prepared {
        Some(prepared) => Plant::seeing(&prepared.scene.views, source.truth.clone(), arguments.seed, quality),
        None => Plant::with(source.truth.clone(), arguments.seed, quality),
    };
    let transit = prepared
        .as_mut()
        .map(|prepared| std::mem::take(&mut prepared.scene.transit));
    let words::Briefing { words, rows: told } = words::before(arguments, &source);
    let (path, digest, interrupt) = (
        folder.path().to_owned(),
        Digest::at(&words::site(&source.site)),
        interrupt.clone(),
    );
    let take_off: TakeOff = Box::new(move |console| {
        let mut watch = Watch::new(folder, digest, progress, console, words, interrupt);
        let mut through = Through::new(&mut watch, transit.unwrap_or_default());
        let remarks = fly(plant, &faults, end, &mut through).map_err(FlyError::Board)?;
        through.finish();
        Ok((watch.finish()?, remarks))
    });
    let (seen, remarks) = beside(&path, take_off)?;
    let instants = prepared.as_ref().and_then(|_| flight::instants(arguments.seed));
    let (case, trouble) = written(arguments, &source, prepared.as_ref(), instants.as_ref(), &seen);
    // The log's time is zero at the start of the cycle of packet 0.
    let flown = prepared.as_ref().zip(instants);
    let motion = flown.map(|(prepared, instants)| (prepared.scene.motion.clone(), instants.zero_s + instants.lead_s));
    let truth = motion.map(|(motion, zero_s)| move |t_s: f64| motion.at(t_s + zero_s).attitude.q_nb);
    let truth = truth.as_ref().map(|truth| truth as Truth);
    let landed = report(
        arguments,
        &board,
        &source,
        duration,
        seen,
        [told, remarks, vec![case]].concat(),
        truth,
    )?;
    trouble.map_or(Ok(landed), |trouble| Err(trouble.into()))
}

/// Within the folder of the first flight, until its bytes are compared.
const IMAGE: &str = "image";

/// Makes the folder a case; a row of the summary, and what went wrong with it that is not the flight's nature.
fn written(
    arguments: &FlyArguments,
    source: &Source,
    prepared: Option<&Prepared>,
    instants: Option<&Instants>,
    seen: &Seen,
) -> (Remark, Option<CaseError>) {
    let Some(prepared) = prepared else {
        return (
            (
                "gap case",
                "none: a recording of sensors does not say how the unit was turned".into(),
            ),
            None,
        );
    };
    let path = seen.folder.path();
    let named = arguments.in_place_of.as_deref().unwrap_or(path).file_name();
    let flown = Flown {
        name: &named.unwrap_or_default().to_string_lossy(),
        scene: &prepared.scene,
        struck: &prepared.struck,
        unit: prepared.unit.as_ref(),
        about: &source.about,
        seed: arguments.seed,
        flight: arguments.flight.into(),
        flown_s: seen.flown.as_secs_f64(),
        instrument: arguments.reference,
        instants,
    };
    match flown.write(path) {
        Ok(()) if prepared.struck.is_empty() => (("gap case", "this folder".into()), None),
        Ok(()) => (
            (
                "gap case",
                format!("this folder; what was done to the unit is in {}", case::ANSWER),
            ),
            None,
        ),
        Err(why @ (CaseError::TooShort(_) | CaseError::Unseen(_) | CaseError::NoInstants(_))) => {
            (("gap case", format!("none: {why}")), None)
        }
        Err(trouble) => (("gap case", "none: it could not be written".into()), Some(trouble)),
    }
}

/// Writes the page and the summary.
fn report(
    arguments: &FlyArguments,
    board: &str,
    source: &Source,
    planned: Duration,
    seen: Seen,
    remarks: Vec<Remark>,
    truth: Option<Truth>,
) -> Result<Landed, FlyError> {
    let mut rows = flight_rows(board, source, arguments.seed, seen.flown, seen.took);
    let whole = seen.flown >= planned || planned == plan::UNTIL_TOLD;
    if !whole {
        rows.push((
            "ended",
            format!("when asked to, before the {} s planned", planned.as_secs_f64()),
        ));
    }
    rows.extend(remarks);
    rows.extend(seen.record.summary.rows());
    let title = format!("{} flight, unit {}", source.name, arguments.seed);
    let folder = seen.folder.finish(&title, &source.about, &rows, &seen.record, truth)?;
    Ok(Landed { folder, rows, whole })
}

fn flight_rows(
    board: &str,
    source: &Source,
    seed: u64,
    flown: Duration,
    took: Duration,
) -> Vec<(&'static str, String)> {
    let (flown_s, took_s) = (flown.as_secs_f64(), took.as_secs_f64());
    vec![
        ("flown", format!("{}, seed {seed}", source.name)),
        ("board", board.into()),
        (
            "virtual time",
            format!(
                "{flown_s:.1} s in {took_s:.1} s, {:.0} times real time",
                flown_s / took_s.max(1e-3)
            ),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use std::fs;

    use clap::Parser;

    use super::*;

    use crate::board::host;

    #[derive(Parser)]
    struct Words {
        #[command(flatten)]
        arguments: FlyArguments,
    }

    fn on_host(arguments: &FlyArguments, interrupt: &Interrupt) -> Result<Landed, FlyError> {
        fly_until(arguments, interrupt, || Ok(host()), |_, take_off| take_off(None))
    }

    fn words(words: &[&str]) -> Result<FlyArguments, clap::Error> {
        Words::try_parse_from([&["fly"], words].concat()).map(|words| words.arguments)
    }

    #[test]
    fn the_same_words_give_the_same_packets_in_a_folder_of_their_own() {
        let place = tempfile::tempdir().expect("temporary folder");
        let out = place.path().to_string_lossy();
        let arguments = words(&[
            "--host",
            "--motion",
            "tumble",
            "--duration",
            "5s",
            "--seed",
            "7",
            "--silent",
            "a2@2s",
            "--out",
            &out,
        ]);
        let arguments = arguments.expect("arguments");
        on_host(&arguments, &Interrupt::default()).expect("first flight");
        on_host(&arguments, &Interrupt::default()).expect("second flight");
        let packets = |name: &str| fs::read(place.path().join(name).join("packets.txt")).expect(name);
        assert_eq!(packets("tumble-7"), packets("tumble-7-2"));
        let counts = fs::read_to_string(place.path().join("tumble-7/counts.csv")).expect("counts");
        let last = counts.lines().last().unwrap_or_default();
        assert!(
            last.contains(",0002,0,0,") && last.contains(",,,"),
            "accelerometer 2 is silent: {last}"
        );
        let summary = fs::read_to_string(place.path().join("tumble-7/summary.txt")).expect("summary");
        assert!(summary.contains("accelerometer 2: "), "{summary}");
    }

    #[test]
    fn an_interrupted_flight_keeps_what_was_flown_with_its_page_and_summary() {
        let place = tempfile::tempdir().expect("temporary folder");
        let out = place.path().to_string_lossy();
        let arguments = words(&["--host", "--motion", "still", "--duration", "1000h", "--out", &out]);
        let interrupt = Interrupt::default();
        assert!(!interrupt.raise() && interrupt.raise(), "the second ends the program");
        on_host(&arguments.expect("arguments"), &interrupt).expect("flight");
        let read = |name: &str| fs::read_to_string(place.path().join("still-1").join(name)).expect(name);
        assert!(
            read("summary.txt").contains("before the 3600000 s planned"),
            "{}",
            read("summary.txt")
        );
        assert!(read("index.html").contains("before the 3600000 s planned"));
    }

    #[test]
    fn a_place_goes_with_a_motion_file_only() {
        assert!(
            words(&[
                "--motion-file",
                "x.csv",
                "--latitude-deg",
                "-2.37",
                "--field-n-ut",
                "-1,2,3"
            ])
            .is_ok()
        );
        assert!(words(&["--motion", "still", "--latitude-deg", "-2.37"]).is_err());
        assert!(words(&["--motion-file", "x.csv", "--latitude-deg", "237"]).is_err());
    }

    #[test]
    fn two_sources_at_once_are_refused() {
        assert!(words(&["--motion", "still", "--recording", "x.csv"]).is_err());
        assert!(words(&["--recording", "x.csv", "--motion-file", "y.csv"]).is_err());
    }

    #[test]
    fn a_flight_that_cannot_start_leaves_no_folder() {
        let place = tempfile::tempdir().expect("temporary folder");
        let out = place.path().to_string_lossy();
        let arguments = words(&["--host", "--recording", "no-such-file.csv", "--out", &out]).expect("arguments");
        let error = on_host(&arguments, &Interrupt::default())
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default();
        assert!(error.contains("no-such-file.csv"), "{error}");
        let first = place.path().join("rocket-1").display().to_string();
        let error = on_host(
            &words(&["--in-place-of", &first]).expect("arguments"),
            &Interrupt::default(),
        )
        .err();
        assert!(matches!(error, Some(FlyError::Plan(PlanError::NoFirst(_)))));
        assert_eq!(fs::read_dir(place.path()).expect("folder").count(), 0);
    }
}
