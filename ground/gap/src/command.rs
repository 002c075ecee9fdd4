//! `ground gap`: what the twin of a unit lacks, from a case.
//!
//! A thin shell: it reads the case, shows how far the work is, keeps what is said ([`crate::kept`]), prints it, and writes the
//! twin with the effect in beside the case.

use std::{
    io,
    path::{Path, PathBuf},
    time::Duration,
};

use indicatif::{ProgressBar, ProgressStyle};
use twin::predict::UnitDescription;

use crate::{
    against::against,
    diagnose::{Diagnosis, diagnose},
    input::case::{CaseError, Opened, Subject},
    kept::{self, Analysis, Kept},
    library::hypotheses::Library,
    null::problem::Problem,
    parity::{self, ParityError},
    report::{page, terminal, verdict::Verdict},
    search::baseline,
    together,
};

/// Finds what the twin of a unit lacks
///
/// Compares a unit's log with its nominal twin along a known motion: is there a gap beyond noise and calibration, where,
/// which physical effect makes it, how far it shrinks on held-out data once that effect is in, and what to measure next.
/// A case without a motion is judged by the redundancy of its sensors alone, and is told what that cannot see.
/// Several cases are logs of one unit, and are diagnosed together: what the unit has is in all of them.
/// The twin with the effect in and, where the unit can correct the cause, the calibration set go into CASE/corrected; what was
/// said is kept in CASE/analysis until a byte of the case changes.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground gap flights/tumble-1\n  ground gap limits flights/tumble-1\n  ground gap flights/tumble-1 --against flights/rotation-1-1\n  ground gap flights/tumble-1 --out verdicts/flight-7\n  ground gap bench-3 flights/rocket-1 flights/rocket-2"
)]
pub struct GapArguments {
    /// What to say: all of it, or only where, why, shrink, next or limits
    #[arg(value_name = "WHAT", num_args = 1.., required = true, help = "[where|why|shrink|next|limits] CASE...: a folder with case.toml; several are logs of one unit, diagnosed together")]
    pub words: Vec<String>,
    /// Write verdict.json, index.html, unit.toml and, where the unit can correct the cause, calibration.toml in DIR too
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Hold the corrected twin against another case of the same unit: the gap before and after, on data that neither has seen
    #[arg(long, value_name = "CASE")]
    pub against: Option<PathBuf>,
    /// Leave an effect out of the library; may be given several times
    #[arg(long, value_name = "EFFECT")]
    pub withhold: Vec<String>,
    /// Do not look at the case's motion: what the unit's own redundancy says alone. A case without a motion needs no such word
    #[arg(long, conflicts_with = "against")]
    pub blind_motion: bool,
    /// Print verdict.json instead of the screen
    #[arg(long)]
    pub json: bool,
}

/// Where the corrected twin goes, in the folder of its case.
pub const CORRECTED: &str = "corrected";
/// Where what several logs say together goes, in the folder of the first.
pub const TOGETHER: &str = "analysis-together";
/// The verdict for programs.
pub const VERDICT: &str = "verdict.json";
/// The verdict as a page.
pub const PAGE: &str = "index.html";
/// The twin with the effect in.
pub const UNIT: &str = "unit.toml";
/// The calibration set.
pub const SET: &str = "calibration.toml";

/// Why there is no verdict.
#[derive(Debug, thiserror::Error)]
pub enum GapError {
    /// The case cannot be judged.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A word before the case is none of those known.
    #[error("\"{0}\" is none of: where, why, shrink, next, limits, and no case of that name is there")]
    Word(String),
    /// An effect to leave out is not in the library.
    #[error("--withhold {0}: no effect of that name is in the library")]
    Effect(String),
    /// A log without a reference cannot be held against another.
    #[error("--against needs a case with a motion: without one nothing is corrected that could be compared")]
    Against,
    /// Several logs cannot be held against another.
    #[error(
        "--against takes one case with a motion; of several logs, what they contradict each other about is said without it"
    )]
    AgainstSeveral,
    /// A file cannot be written.
    #[error("{file}: cannot be written: {source}")]
    Write {
        /// Which.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The calibration set cannot be written as text.
    #[error(transparent)]
    Set(#[from] bench::set::SetError),
    /// A plot cannot be drawn.
    #[error(transparent)]
    Chart(#[from] chart::ChartError),
    /// The verdict is not finite somewhere.
    #[error("the verdict cannot be written: {0}")]
    Json(#[from] serde_json::Error),
}

impl From<ParityError> for GapError {
    fn from(error: ParityError) -> Self {
        match error {
            ParityError::Case(error) => error.into(),
            ParityError::Json(error) => error.into(),
            ParityError::Chart(error) => error.into(),
        }
    }
}

/// Runs `ground gap`.
///
/// # Errors
/// When the case cannot be judged or a file not written.
pub fn run(arguments: &GapArguments) -> Result<(), GapError> {
    let (word, cases) = parted(&arguments.words)?;
    if let Some(stranger) = arguments
        .withhold
        .iter()
        .find(|name| twin::effect::by_name(name).is_none())
    {
        return Err(GapError::Effect(stranger.clone()));
    }
    let case = match cases.as_slice() {
        [case] => case.as_path(),
        _ => return run_together(arguments, word, &cases),
    };
    let is_blind = arguments.blind_motion || Opened::open(case)?.is_without_motion();
    if is_blind && arguments.against.is_some() {
        return Err(GapError::Against);
    }
    let (kept, analysis) = match is_blind {
        true => asked_blind(case, &arguments.withhold)?,
        false => asked(case, &arguments.withhold)?,
    };
    let name = if arguments.json {
        VERDICT.to_owned()
    } else {
        format!("{word}.txt")
    };
    print!("{}", kept::text(&analysis, &name).unwrap_or_default());
    if word == "all" && arguments.withhold.is_empty() && !arguments.json {
        if !is_blind {
            println!("{}", beside(&kept, CORRECTED).join(UNIT).display());
        }
        println!("{}", kept.folder().join(PAGE).display());
    }
    if let Some(other) = &arguments.against {
        let unit = kept::text(&analysis, UNIT).unwrap_or_default();
        let unit = UnitDescription::read(unit, UNIT).map_err(CaseError::from)?;
        let compared = against(other, &unit)?;
        print!("{}", compared.text(&other.display().to_string()));
    }
    if let Some(folder) = &arguments.out {
        make(folder)?;
        for name in [VERDICT, PAGE] {
            put(folder, name, kept::text(&analysis, name).unwrap_or_default())?;
        }
        if !is_blind {
            write_twin(folder, &analysis)?;
        }
        println!("{}", folder.join(PAGE).display());
    }
    Ok(())
}

/// What to say: the words before the cases, and in full.
const WORDS: [&str; 6] = ["all", "where", "why", "shrink", "next", "limits"];

/// What to say, and of which cases.
fn parted(words: &[String]) -> Result<(&str, Vec<PathBuf>), GapError> {
    let (word, cases) = match words {
        [word, cases @ ..] if !cases.is_empty() && WORDS.contains(&word.as_str()) => (word.as_str(), cases),
        // Of two words the first was always what to say: a case that is not there is rather a word that is none.
        [word, _, ..] if !Path::new(word).exists() => return Err(GapError::Word(word.clone())),
        cases => ("all", cases),
    };
    Ok((word, cases.iter().map(PathBuf::from).collect()))
}

/// Several logs of one unit: says what they say together, and leaves verdict and page beside the first.
fn run_together(arguments: &GapArguments, word: &str, cases: &[PathBuf]) -> Result<(), GapError> {
    if arguments.against.is_some() {
        return Err(GapError::AgainstSeveral);
    }
    let bar = bar();
    let analysis = together::analysed(cases, arguments.blind_motion, &arguments.withhold, &|what, share| {
        bar.set_message(what);
        bar.set_position((100.0 * share) as u64);
    });
    bar.finish_and_clear();
    let analysis = analysis?;
    let name = if arguments.json {
        VERDICT.to_owned()
    } else {
        format!("{word}.txt")
    };
    print!("{}", kept::text(&analysis, &name).unwrap_or_default());
    let beside = |first: &PathBuf| {
        let folder = if first.is_file() {
            first.parent().unwrap_or(first)
        } else {
            first
        };
        folder.join(TOGETHER)
    };
    let folder = arguments
        .out
        .clone()
        .or_else(|| cases.first().map(beside))
        .unwrap_or_default();
    make(&folder)?;
    for name in [VERDICT, PAGE] {
        put(&folder, name, kept::text(&analysis, name).unwrap_or_default())?;
    }
    if word == "all" && !arguments.json {
        println!("{}", folder.join(PAGE).display());
    }
    Ok(())
}

/// Every text of a case: as it was kept, or by a diagnosis, which is kept then. The twin with what was found in stands in the
/// case's folder after that.
///
/// # Errors
/// When the case cannot be judged.
pub fn asked(case: &Path, withheld: &[String]) -> Result<(Kept, Analysis), GapError> {
    let kept = Kept::of(case, withheld)?;
    let (analysis, written) = match kept.read() {
        Some(analysis) => (analysis, Ok(())),
        None => {
            let analysis = analysed(case, withheld)?;
            let written = kept.write(&analysis).map_err(|source| GapError::Write {
                file: kept.folder().into(),
                source,
            });
            (analysis, written)
        }
    };
    let written = match withheld {
        [] => written.and_then(|()| write_twin(&beside(&kept, CORRECTED), &analysis)),
        _ => written,
    };
    if let Err(error) = written {
        // What was found is worth saying all the same.
        eprintln!("warning: {error}");
    }
    Ok((kept, analysis))
}

/// Every text of a case whose motion is not looked at, by parity alone. No corrected twin is written: what one log says without
/// a reference is a reason to test, none to change a unit.
///
/// # Errors
/// When the case cannot be judged, and when its unit has no redundancy.
pub fn asked_blind(case: &Path, withheld: &[String]) -> Result<(Kept, Analysis), GapError> {
    let kept = Kept::blind(case, withheld)?;
    if let Some(analysis) = kept.read() {
        return Ok((kept, analysis));
    }
    let bar = bar();
    let analysis = parity::analysed(case, withheld, &|what, share| {
        bar.set_message(what);
        bar.set_position((100.0 * share) as u64);
    });
    bar.finish_and_clear();
    let analysis = analysis?;
    if let Err(error) = kept.write(&analysis) {
        // What was found is worth saying all the same.
        eprintln!("warning: {}: cannot be written: {error}", kept.folder().display());
    }
    Ok((kept, analysis))
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(100).with_style(
        ProgressStyle::with_template("{spinner} {msg:10} {bar:40} {elapsed}")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// Diagnoses a case on a terminal; every text of it.
///
/// # Errors
/// When the case cannot be judged.
pub fn analysed(case: &Path, withheld: &[String]) -> Result<Analysis, GapError> {
    let subject = Subject::open(case)?;
    let bar = bar();
    let diagnosis = diagnose(&subject, withheld, &|what, share| {
        bar.set_message(what);
        bar.set_position((100.0 * share) as u64);
    });
    bar.set_message("next");
    let advice = diagnosis.advice(&subject);
    bar.finish_and_clear();
    let verdict = serde_json::to_string_pretty(&Verdict::new(&subject, &diagnosis, advice.clone()))?;
    let mut texts = vec![
        (VERDICT, format!("{verdict}\n")),
        ("all.txt", terminal::screen(&subject, &diagnosis, &advice)),
        ("where.txt", terminal::places(&subject, &diagnosis)),
        ("why.txt", terminal::why(&subject, &diagnosis)),
        ("shrink.txt", terminal::shrink(&subject, &diagnosis)),
        ("next.txt", format!("{advice}\n")),
        ("limits.txt", terminal::limits(&diagnosis)),
        (PAGE, page::html(&subject, &diagnosis, &advice)?),
        (UNIT, taught(&subject, &diagnosis).text()),
    ];
    if let Some(correction) = &diagnosis.correction {
        texts.push((SET, correction.set(&subject.twin)?));
    }
    Ok(texts.into_iter().map(|(name, text)| (name.to_owned(), text)).collect())
}

/// A folder of this name beside the analysis.
fn beside(kept: &Kept, name: &str) -> PathBuf {
    kept.folder().with_file_name(name)
}

/// Writes the twin with the effect in, and the calibration set where there is one.
fn write_twin(folder: &Path, analysis: &Analysis) -> Result<(), GapError> {
    make(folder)?;
    put(folder, UNIT, kept::text(analysis, UNIT).unwrap_or_default())?;
    match kept::text(analysis, SET) {
        Some(set) => put(folder, SET, set),
        // One of an earlier analysis would be taken for this one's.
        None => match std::fs::remove_file(folder.join(SET)) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => Err(GapError::Write {
                file: folder.join(SET),
                source,
            }),
            _ => Ok(()),
        },
    }
}

fn make(folder: &Path) -> Result<(), GapError> {
    std::fs::create_dir_all(folder).map_err(|source| GapError::Write {
        file: folder.to_path_buf(),
        source,
    })
}

/// Judges a case as [`run`] does and leaves verdict.json in its folder, silently: the analyst's part in a challenge. Of one without a motion,
/// attitude.csv too, where it settled.
///
/// # Errors
/// When the case cannot be judged or the file not written.
pub fn write_verdict(case: &Path) -> Result<(), GapError> {
    if Opened::open(case)?.is_without_motion() {
        let analysis = parity::analysed(case, &[], &|_, _| ())?;
        if let Some(attitude) = kept::text(&analysis, parity::ATTITUDE) {
            put(case, parity::ATTITUDE, attitude)?;
        }
        return put(case, VERDICT, kept::text(&analysis, VERDICT).unwrap_or_default());
    }
    let subject = Subject::open(case)?;
    let diagnosis = diagnose(&subject, &[], &|_, _| ());
    let advice = diagnosis.advice(&subject);
    let verdict = serde_json::to_string_pretty(&Verdict::new(&subject, &diagnosis, advice))?;
    put(case, "verdict.json", &verdict)
}

/// The unit as it is now believed to be: with its effects, and the noise that effects on the scatter give it.
pub fn taught(subject: &Subject, diagnosis: &Diagnosis) -> UnitDescription {
    let mut unit = subject.twin.unit().clone();
    // What stands in the model and is not said may stand in for something else.
    let is_said = |name: &str| diagnosis.causes.iter().any(|cause| cause.effect == name);
    let known = diagnosis.known.iter().filter(|known| is_said(&known.effect));
    unit.effects.extend(known.cloned());
    for (channel, louder) in unit.channels.iter_mut().zip(&diagnosis.louder) {
        let grown = channel.sigma().powi(2) * (louder * louder - 1.0);
        channel.noise_sigma = (channel.noise_sigma.powi(2) + grown).max(0.0).sqrt();
    }
    unit
}

/// Leaves what is said of a case without its effects and their siblings in the library in its folder, withheld.json.
///
/// # Errors
/// When the case cannot be judged or the file not written.
pub fn write_withheld(case: &Path, effects: &[String]) -> Result<(), GapError> {
    let subject = Subject::open(case)?;
    let left_out: Vec<String> = (effects.iter())
        .flat_map(|name| twin::effect::kin(name))
        .map(str::to_owned)
        .collect();
    let diagnosis = diagnose(&subject, &left_out, &|_, _| ());
    let verdict = Verdict::new(&subject, &diagnosis, String::new());
    put(case, "withheld.json", &serde_json::to_string_pretty(&verdict)?)
}

/// Leaves what the baselines say of a case in its folder, `verdict-NAME.json` each; that of the oracle where the effects are
/// known.
///
/// # Errors
/// When the case cannot be judged or a file not written.
pub fn write_baselines(case: &Path, effects: Option<&[String]>) -> Result<(), GapError> {
    let subject = Subject::open(case)?;
    let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let library = Library::new(&problem, &[], &|_| ());
    for (name, named) in [
        ("largest-residual", baseline::largest_residual(&problem, &library)),
        ("lasso", baseline::lasso(&problem, &library)),
        ("best-subset", baseline::best_subset(&problem, &library)),
    ] {
        let cause = |named: &baseline::Named| {
            serde_json::json!({
                "effect": named.effect,
                "channels": subject.names(named.channels.iter().copied()),
                "probability": named.share,
            })
        };
        let verdict = serde_json::json!({ "causes": named.iter().map(cause).collect::<Vec<_>>() });
        put(
            case,
            &format!("verdict-{name}.json"),
            &serde_json::to_string_pretty(&verdict)?,
        )?;
    }
    if let Some(effects) = effects {
        let diagnosis = diagnose(&subject, &baseline::oracle_withholds(effects), &|_, _| ());
        let verdict = Verdict::new(&subject, &diagnosis, String::new());
        put(case, "verdict-oracle.json", &serde_json::to_string_pretty(&verdict)?)?;
    }
    Ok(())
}

fn put(folder: &Path, name: &str, text: &str) -> Result<(), GapError> {
    let file = folder.join(name);
    std::fs::write(&file, text).map_err(|source| GapError::Write { file, source })
}
