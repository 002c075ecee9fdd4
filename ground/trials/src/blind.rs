//! The blind protocol: deal, commit, answer, reveal, score.
//!
//! In: a folder. Out: cases in it, and beside them what proves that nobody looked. `deal` writes cases under neutral
//! names and keeps the answers, each with a salt, where the analyst does not look; `commit` publishes the SHA-256 of
//! salt and answer; `answer` publishes those of the verdicts; `reveal` opens the answers next to the cases; `score` checks all
//! hashes and only then scores. A hash that does not fit is an error that names the case.

mod files;
pub mod lines;
pub mod part;
mod turned;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    path::{Path, PathBuf},
};

use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};

use self::{
    files::{channels, entries, files, hash, make, parse, read, stem, write},
    part::Part,
};
use crate::{
    answer::Answer,
    deal::{self, DealError},
    deck::{Hand, Ring},
    draw::Draw,
    injected::{Injected, recording::Recording},
    score::{self, Judged, Line, Verdict},
};

/// Hashes of the answers.
const MANIFEST: &str = "manifest.json";
/// Hashes of the verdicts, of all or of a part of them.
const ANSWERED: &str = "answered";
/// The revealed answer of a case, in its folder.
const ANSWER: &str = "answer.json";
/// The verdict on a case whose effects were left out of the library, in its folder.
pub const VERDICT_WITHHELD: &str = "withheld.json";
/// The verdict on a case, in its folder.
pub const VERDICT: &str = "verdict.json";

/// What goes wrong with a protocol.
#[derive(Debug, thiserror::Error)]
pub enum BlindError {
    /// A file cannot be read or written.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file is not what it should be.
    #[error("{path}: {source}")]
    Json {
        /// Which.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
    /// A plot cannot be drawn.
    #[error(transparent)]
    Chart(#[from] chart::ChartError),
    /// A case was not dealt.
    #[error(transparent)]
    Deal(#[from] DealError),
    /// A file is not the one whose hash was published.
    #[error("{path}: is not what {manifest} was published for; it was changed after that")]
    Changed {
        /// Which.
        path: PathBuf,
        /// The list of hashes.
        manifest: &'static str,
    },
    /// Answers are asked for before the verdicts were published.
    #[error("{0} does not exist: publish the verdicts with `answer` before the answers are revealed")]
    Unanswered(PathBuf),
    /// Verdicts are published after the answers were revealed.
    #[error("{0} is revealed: verdicts given after that prove nothing")]
    Revealed(PathBuf),
    /// A case was revealed that is not in the manifest, or the other way round.
    #[error("{0} lists other cases than there are answers for: commit before revealing")]
    Other(PathBuf),
}

/// An answer with its salt, as kept.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Kept {
    salt: String,
    answer: Answer,
}

/// Deals a hand into `folder`, answers into `answers`; the order is drawn. Effects are injected into `recordings`.
///
/// # Errors
/// When a file cannot be written.
pub fn deal(
    folder: &Path,
    answers: &Path,
    hand: Hand,
    recordings: Vec<Recording>,
    seed: u64,
) -> Result<(), BlindError> {
    let mut draw = Draw::new(seed);
    let deck = hand.shuffled(&mut draw);
    let mut injected = Injected::new(recordings, &mut draw.stream(7));
    let mut numbers = 0..;
    make(answers)?;
    let progress = ProgressBar::new(deck.len() as u64);
    for (index, card) in deck.into_iter().enumerate() {
        let name = format!("T{:03}", index + 1);
        let own = draw.uniform(0.0, 1e15) as u64;
        let answer = match card.ring {
            Ring::R7 => injected.deal(folder, &name, numbers.next().unwrap_or_default(), own)?,
            _ => deal::deal(folder, &name, card, own)?,
        };
        let salt = (0..4)
            .map(|_| format!("{:08x}", draw.uniform(0.0, 4_294_967_296.0) as u32))
            .collect();
        write(&answers.join(format!("{name}.json")), &Kept { salt, answer })?;
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok(())
}

/// Publishes the hashes of the answers kept in `answers`.
///
/// # Errors
/// When a file cannot be read or written.
pub fn commit(folder: &Path, answers: &Path) -> Result<(), BlindError> {
    let mut hashes = BTreeMap::new();
    for path in files(answers)? {
        hashes.insert(stem(&path), answer_hash(&path)?);
    }
    write(&folder.join(MANIFEST), &hashes)
}

/// Publishes the hashes of the verdicts that stand in the folders of a part's cases; tells the file and how many they are.
///
/// # Errors
/// When an answer is revealed already, or a file cannot be read or written.
pub fn answer(folder: &Path, part: Part) -> Result<(PathBuf, usize), BlindError> {
    let mut hashes = BTreeMap::new();
    for case in part.of_list(cases(folder)?) {
        let revealed = case.join(ANSWER);
        if revealed.exists() {
            return Err(BlindError::Revealed(revealed));
        }
        let verdict = case.join(VERDICT);
        if verdict.exists() {
            hashes.insert(stem(&case), hash(&read(&verdict)?));
        }
    }
    let path = folder.join(part.answered());
    write(&path, &hashes)?;
    Ok((path, hashes.len()))
}

/// The hashes of the verdicts as published, of all parts.
fn answered(folder: &Path) -> Result<BTreeMap<String, String>, BlindError> {
    let names = files(folder)?
        .into_iter()
        .filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
    let all: BTreeSet<String> = names.filter_map(|name| Part::siblings(&name)).flatten().collect();
    let mut hashes = BTreeMap::new();
    for name in &all {
        let path = folder.join(name);
        if !path.exists() {
            return Err(BlindError::Unanswered(path));
        }
        hashes.extend(parse::<BTreeMap<String, String>>(&path)?);
    }
    match all.is_empty() {
        true => Err(BlindError::Unanswered(folder.join(Part::default().answered()))),
        false => Ok(hashes),
    }
}

/// Puts the answers beside the cases, after checking that the verdicts are published and that the answers are those that
/// were committed to.
///
/// # Errors
/// When the verdicts are not published, or an answer is not the one that was committed to.
pub fn reveal(folder: &Path, answers: &Path) -> Result<(), BlindError> {
    answered(folder)?;
    let manifest_path = folder.join(MANIFEST);
    let manifest: BTreeMap<String, String> = parse(&manifest_path)?;
    let kept = files(answers)?;
    if kept.len() != manifest.len() || kept.iter().any(|path| !manifest.contains_key(&stem(path))) {
        return Err(BlindError::Other(manifest_path));
    }
    for path in kept {
        if manifest.get(&stem(&path)) != Some(&answer_hash(&path)?) {
            return Err(BlindError::Changed {
                path,
                manifest: MANIFEST,
            });
        }
        let bytes = read(&path)?;
        let shown = folder.join(stem(&path)).join(ANSWER);
        fs::write(&shown, bytes).map_err(|source| BlindError::File { path: shown, source })?;
    }
    Ok(())
}

/// Revealed cases with their verdicts, all hashes checked.
///
/// # Errors
/// When a verdict or an answer was changed after its hash was published.
pub fn judged(folder: &Path) -> Result<Vec<Judged>, BlindError> {
    let manifest: BTreeMap<String, String> = parse(&folder.join(MANIFEST))?;
    let answered = answered(folder)?;
    let mut judged = Vec::new();
    for (name, published) in manifest {
        let path = folder.join(&name).join(ANSWER);
        if answer_hash(&path)? != published {
            return Err(BlindError::Changed {
                path,
                manifest: MANIFEST,
            });
        }
        let kept: Kept = parse(&path)?;
        let path = folder.join(&name).join(VERDICT);
        let verdict = match answered.get(&name) {
            None => None,
            Some(published) if *published == hash(&read(&path)?) => {
                let mut verdict = parse::<Verdict>(&path)?;
                if let Some(attitude) = &mut verdict.attitude {
                    attitude.error_deg = turned::error_deg(&folder.join(&name), &kept.answer.attitudes);
                }
                Some(verdict)
            }
            Some(_) => {
                return Err(BlindError::Changed {
                    path,
                    manifest: ANSWERED,
                });
            }
        };
        judged.push(Judged {
            answer: kept.answer,
            verdict,
            channels: channels(&folder.join(&name)),
        });
    }
    Ok(judged)
}

/// Revealed cases with the effects that are in them.
///
/// # Errors
/// When a file cannot be read.
pub fn revealed(folder: &Path) -> Result<Vec<(PathBuf, Vec<String>)>, BlindError> {
    let mut revealed = Vec::new();
    for case in cases(folder)? {
        let path = case.join(ANSWER);
        if path.exists() {
            let kept: Kept = parse(&path)?;
            let effects = kept.answer.effects.into_iter().map(|cause| cause.effect).collect();
            revealed.push((case, effects));
        }
    }
    Ok(revealed)
}

/// The cases with effects that were diagnosed without them too, as cases of the ring [`score::WITHHELD`].
///
/// # Errors
/// When a verdict cannot be read.
pub fn withheld(folder: &Path, judged: &[Judged]) -> Result<Vec<Judged>, BlindError> {
    let mut withheld = Vec::new();
    for judged in judged.iter().filter(|judged| judged.answer.ring == "R1") {
        let path = folder.join(&judged.answer.case).join(VERDICT_WITHHELD);
        if path.exists() {
            let mut answer = judged.answer.clone();
            answer.ring = score::WITHHELD.to_owned();
            withheld.push(Judged {
                answer,
                verdict: Some(parse(&path)?),
                channels: judged.channels,
            });
        }
    }
    Ok(withheld)
}

/// The tables of the diagnosis and of every baseline that left a `verdict-NAME.json`, by name.
///
/// # Errors
/// When a verdict cannot be read.
pub fn tools(folder: &Path, judged: &[Judged]) -> Result<Vec<(String, Vec<Line>)>, BlindError> {
    let mut names: Vec<String> = Vec::new();
    for case in cases(folder)? {
        for path in files(&case)? {
            let name = stem(&path).strip_prefix("verdict-").map(str::to_owned);
            names.extend(name.filter(|name| !names.contains(name)));
        }
    }
    names.sort();
    let mut tools = vec![("diagnosis".to_owned(), score::table(judged))];
    for name in names {
        let mut others = judged.to_vec();
        others.retain(|judged| judged.answer.ring != score::WITHHELD);
        for other in &mut others {
            let path = folder.join(&other.answer.case).join(format!("verdict-{name}.json"));
            other.verdict = if path.exists() { Some(parse(&path)?) } else { None };
        }
        if name == "oracle" {
            tools[0].1.push(score::efficiency(judged, &others));
        }
        tools.push((name, score::table(&others)));
    }
    Ok(tools)
}

/// A case in one line: what it was, what was said.
pub fn line(judged: &Judged) -> String {
    let answer = &judged.answer;
    let truth: Vec<&str> = answer.effects.iter().map(|cause| cause.effect.as_str()).collect();
    let said = match &judged.verdict {
        None => "no verdict".to_string(),
        Some(verdict) => {
            let causes: Vec<String> = verdict
                .causes
                .iter()
                .map(|cause| format!("{} {:.2}", cause.effect, cause.probability))
                .collect();
            format!("{} (none of these {:.2})", causes.join(", "), verdict.none_of_these)
        }
    };
    format!(
        "{} {} SNR {:6.1}  {:30} -> {said}",
        answer.case,
        answer.ring,
        answer.snr_marginal,
        truth.join(", ")
    )
}

/// Whether a folder is one that cases were dealt into and committed to.
pub fn is_deal(folder: &Path) -> bool {
    folder.join(MANIFEST).exists()
}

/// Folders of cases, sorted.
///
/// # Errors
/// When the folder cannot be read.
pub fn cases(folder: &Path) -> Result<Vec<PathBuf>, BlindError> {
    Ok(entries(folder)?
        .into_iter()
        .filter(|path| path.join("case.toml").exists())
        .collect())
}

fn answer_hash(path: &Path) -> Result<String, BlindError> {
    let kept: Kept = parse(path)?;
    let answer = serde_json::to_vec(&kept.answer).map_err(|source| BlindError::Json {
        path: path.into(),
        source,
    })?;
    Ok(hash(&[kept.salt.as_bytes(), &answer].concat()))
}

#[cfg(test)]
mod tests;
