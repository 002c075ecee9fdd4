//! `ground gap blind`: the protocol on the command line.
//!
//! In: arguments, and the diagnosis as a function from a case's folder to its verdict.json. Out: folders, files, and for
//! `score` the table on standard output.

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use chart::Block;
use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};

use crate::{
    blind::{self, BlindError, VERDICT, lines, part::Part},
    deal::DealError,
    deck::Hand,
    injected::recording::{self, Purpose},
    reliability::Reliability,
    score,
};

/// Runs a blind challenge on the diagnosis, or on any other that reads cases and writes verdicts
#[derive(Args)]
pub struct BlindArguments {
    #[command(subcommand)]
    step: Step,
}

#[derive(Subcommand)]
enum Step {
    /// Deals cases whose cause is withheld, made by flying the unit with something wrong
    Deal {
        /// Where the cases go
        folder: PathBuf,
        /// Where the answers go: out of the analyst's sight
        #[arg(long)]
        answers: PathBuf,
        /// Seed of everything drawn; the same seed deals the same cases
        #[arg(long)]
        seed: u64,
        /// Cases with nothing wrong
        #[arg(long, default_value_t = 20)]
        r0: usize,
        /// Cases with nothing wrong whose description is a little wrong
        #[arg(long, default_value_t = 0)]
        r0m: usize,
        /// Cases with one effect
        #[arg(long, default_value_t = 60)]
        r1: usize,
        /// Cases with a disturbance no library describes
        #[arg(long, default_value_t = 20)]
        r3: usize,
        /// Cases with two effects
        #[arg(long, default_value_t = 20)]
        r4: usize,
        /// Cases with three or four effects
        #[arg(long, default_value_t = 0)]
        r6: usize,
        /// Cases with an effect put into a recording of a real unit: three of five have one with a name, one something novel, and
        /// one is healthy
        #[arg(long, default_value_t = 0)]
        r7: usize,
        /// Cases whose motion is withheld: three of ten have nothing wrong, the others one effect; a fifth of all are rockets
        #[arg(long, default_value_t = 0)]
        r8: usize,
        /// Folder with the recordings for --r7: it has data/broad and practice. Otherwise that of EMEMS_DATA, or the minutes
        /// that come with the source
        #[arg(long)]
        recordings: Option<PathBuf>,
        /// Which recordings: those to tune on may be looked at, those to judge with are for what is frozen
        #[arg(long, value_enum, default_value_t = Purpose::Judge)]
        purpose: Purpose,
        /// Besides, one case with one effect for every effect there is, at a signal to noise ratio of 30 or as large as its
        /// part can be; give --r0 0 --r1 0 --r3 0 --r4 0 for these alone
        #[arg(long)]
        each: bool,
    },
    /// Publishes the hashes of the answers (manifest.json), before anyone looks
    Commit {
        /// Folder of the cases
        folder: PathBuf,
        /// Folder of the answers
        #[arg(long)]
        answers: PathBuf,
    },
    /// Diagnoses every case that has no verdict yet and publishes the hashes of the verdicts (answered.json)
    Answer {
        /// Folder of the cases
        folder: PathBuf,
        /// Only every N-th case from the K-th on, on one of N machines that share the folder; its hashes are answered-K-of-N.json
        #[arg(long, value_name = "K/N", default_value = "1/1")]
        part: Part,
    },
    /// Puts the answers beside the cases, if they are those that were committed to
    Reveal {
        /// Folder of the cases
        folder: PathBuf,
        /// Folder of the answers
        #[arg(long)]
        answers: PathBuf,
    },
    /// Has simpler methods, and an oracle that knows the effects, judge the revealed cases too, for `score` to set beside,
    /// and the diagnosis once more with their effects left out of its library
    Baselines {
        /// Folder of the cases
        folder: PathBuf,
    },
    /// Scores verdicts against revealed answers, if neither was changed since its hash was published; leaves report.html and
    /// judged.jsonl, a case a line. Scores a folder of such lines too, of any number of deals
    Score {
        /// Folder of the cases, or with files of JSON lines
        folder: PathBuf,
        /// Keeps the result for good: NAME.csv, a case a row, and NAME.md in --into; refused where they stand already
        #[arg(long, value_name = "NAME")]
        keep: Option<String>,
        /// Where to keep it
        #[arg(long, default_value = "ground/gap/trials")]
        into: PathBuf,
    },
}

/// Writes verdict.json into the folder of a case.
pub type Diagnose = dyn Fn(&Path) -> Result<(), Box<dyn Error>>;

/// Writes `verdict-NAME.json` of every baseline, and [`VERDICT_WITHHELD`](blind::VERDICT_WITHHELD), into the folder of a case
/// whose effects are these.
pub type Baselines = dyn Fn(&Path, &[String]) -> Result<(), Box<dyn Error>>;

/// Takes a step of the protocol; `diagnose` is asked for cases without a verdict.
///
/// # Errors
/// When a file cannot be read or written, or was changed after its hash was published.
pub fn run(arguments: &BlindArguments, diagnose: &Diagnose, baselines: &Baselines) -> Result<(), BlindError> {
    match &arguments.step {
        Step::Deal {
            folder,
            answers,
            seed,
            r0,
            r0m,
            r1,
            r3,
            r4,
            r6,
            r7,
            r8,
            recordings,
            purpose,
            each,
        } => {
            let hand = Hand {
                r0: *r0,
                r0m: *r0m,
                r1: *r1,
                r3: *r3,
                r4: *r4,
                r6: *r6,
                r7: *r7,
                r8: *r8,
                each: *each,
            };
            let found = match r7 {
                0 => Vec::new(),
                _ => recording::all(&shared(recordings.as_deref()), *purpose).map_err(DealError::from)?,
            };
            blind::deal(folder, answers, hand, found, *seed)
        }
        Step::Commit { folder, answers } => blind::commit(folder, answers),
        Step::Answer { folder, part } => answer(folder, *part, diagnose),
        Step::Reveal { folder, answers } => blind::reveal(folder, answers),
        Step::Baselines { folder } => {
            let revealed = blind::revealed(folder)?;
            let progress = bar(revealed.len());
            for (case, effects) in revealed {
                progress.set_message(case.display().to_string());
                if let Err(error) = baselines(&case, &effects) {
                    progress.suspend(|| eprintln!("{}: {error}", case.display()));
                }
                progress.inc(1);
            }
            progress.finish_and_clear();
            Ok(())
        }
        Step::Score { folder, keep, into } => score(folder, keep.as_deref(), into),
    }
}

/// Where real recordings are: as given, or as the environment says, or what a clone of the source has.
fn shared(given: Option<&Path>) -> PathBuf {
    let named = given
        .map(Path::to_owned)
        .or_else(|| std::env::var_os("EMEMS_DATA").map(PathBuf::from));
    named.unwrap_or_else(|| PathBuf::from("data"))
}

fn bar(length: usize) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{bar:40} {pos}/{len} {msg} {eta}").unwrap_or(ProgressStyle::default_bar());
    ProgressBar::new(length as u64).with_style(style)
}

fn score(folder: &Path, keep: Option<&str>, into: &Path) -> Result<(), BlindError> {
    let (judged, tools) = match blind::is_deal(folder) {
        true => {
            let mut judged = blind::judged(folder)?;
            lines::write(folder, &judged)?;
            judged.extend(blind::withheld(folder, &judged)?);
            let tools = blind::tools(folder, &judged)?;
            (judged, tools)
        }
        false => {
            let judged = lines::read(folder)?;
            let tools = vec![("diagnosis".to_owned(), score::table(&judged))];
            (judged, tools)
        }
    };
    let lines: Vec<String> = judged.iter().map(blind::line).collect();
    let table = score::markdown(&tools);
    println!("{}\n\n{table}", lines.join("\n"));
    if let Some(name) = keep {
        let kept = score::page::keep(into, name, &judged, &tools);
        let kept = kept.map_err(|(path, source)| BlindError::File { path, source })?;
        kept.iter().for_each(|path| println!("{}", path.display()));
    }
    let stated = Reliability::of(&judged);
    let blocks = [
        Block::Figure(stated.figure()?),
        Block::Terminal(table),
        Block::Terminal(lines.join("\n")),
    ];
    let page = chart::html(
        "Trials of the diagnosis",
        "Cases whose cause was withheld, scored.",
        &blocks,
    );
    let path = folder.join("report.html");
    std::fs::write(&path, page).map_err(|source| BlindError::File {
        path: path.clone(),
        source,
    })?;
    println!("{}", path.display());
    Ok(())
}

fn answer(folder: &Path, part: Part, diagnose: &Diagnose) -> Result<(), BlindError> {
    let open: Vec<PathBuf> = part
        .of_list(blind::cases(folder)?)
        .into_iter()
        .filter(|case| !case.join(VERDICT).exists())
        .collect();
    let progress = bar(open.len());
    for case in open {
        progress.set_message(case.display().to_string());
        if let Err(error) = diagnose(&case) {
            // The case stays without a verdict and is scored as that.
            progress.suspend(|| eprintln!("{}: {error}", case.display()));
        }
        progress.inc(1);
    }
    progress.finish_and_clear();
    let (path, answered) = blind::answer(folder, part)?;
    println!("{answered} verdicts, their hashes in {}", path.display());
    Ok(())
}
