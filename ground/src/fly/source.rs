//! What the unit is made to feel: a motion by name, or a file.
//!
//! In: what the command line names. Out: the truth of a flight and what to call it. Refuses a name that no motion has, and
//! what the readers of files refuse, with file and line.

use std::{borrow::Cow, path::Path, sync::Arc};

use emems::estimate::Site;
use twin::{
    environment::World,
    motion::{self, LIST, Recorded},
    recording::{FileError, Recording},
    truth::TruthSource,
};

use super::plan::Arguments;

/// Flown when nothing is named.
const DEFAULT_MOTION: &str = "rocket";

/// A source of truth.
pub struct Source {
    /// What its folder is called.
    pub name: String,
    /// What it is, in one line.
    pub about: String,
    /// The truth.
    pub truth: Arc<dyn TruthSource>,
    /// What the unit is told of the place.
    pub site: Site,
}

/// Why there is nothing to fly.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// No motion has this name.
    #[error("no motion is called {0}; there are {names}", names = names())]
    NoSuchMotion(String),
    /// A file cannot be flown.
    #[error(transparent)]
    File(#[from] FileError),
}

/// What the command line names.
///
/// # Errors
/// When there is no such thing.
pub fn open(arguments: &Arguments) -> Result<Source, SourceError> {
    match (&arguments.recording, &arguments.motion_file) {
        (Some(path), _) => Ok(Source {
            name: stem(path),
            about: format!("recording of a real unit, {}", file_name(path)),
            truth: Arc::new(Recording::open(path)?),
            site: Site::LABORATORY,
        }),
        (_, Some(path)) => Ok(Source {
            name: stem(path),
            about: format!("recorded motion, {}, at {}", file_name(path), arguments.site.about()),
            truth: Arc::new(World {
                motion: Recorded::open(path)?,
                environment: arguments.site.environment(),
            }),
            site: Site::LABORATORY,
        }),
        _ => by_name(arguments.motion.as_deref().unwrap_or(DEFAULT_MOTION)),
    }
}

/// `ground sources`: the motions, a line each.
pub fn list() -> String {
    let line = |named: &motion::Named| {
        let lasts = motion::by_name(named.name).and_then(|truth| truth.duration_s());
        let lasts = lasts.map_or("no end".into(), |lasts_s| format!("{lasts_s:.0} s"));
        format!("{:12}{lasts:>8}  {}\n", named.name, named.about)
    };
    LIST.iter().map(line).collect()
}

fn by_name(name: &str) -> Result<Source, SourceError> {
    let named = LIST.iter().find(|named| named.name == name);
    match (named, motion::by_name(name)) {
        (Some(named), Some(truth)) => Ok(Source {
            name: name.into(),
            about: named.about.into(),
            truth: truth.into(),
            site: named.site,
        }),
        _ => Err(SourceError::NoSuchMotion(name.into())),
    }
}

/// A file's name without its folder, which is nobody's business on a page that may be passed on.
fn file_name(path: &Path) -> Cow<'_, str> {
    path.file_name().unwrap_or_default().to_string_lossy()
}

/// A file's name up to its first dot.
fn stem(path: &Path) -> String {
    let name = file_name(path);
    name.split('.').find(|part| !part.is_empty()).unwrap_or("file").into()
}

fn names() -> String {
    LIST.map(|named| named.name).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_a_motion_there_is() {
        assert_eq!(
            by_name(DEFAULT_MOTION).map(|source| source.name).ok().as_deref(),
            Some("rocket")
        );
    }

    #[test]
    fn an_unknown_motion_is_refused_with_the_known_ones() {
        let refusal = by_name("roket")
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default();
        assert!(
            refusal.starts_with("no motion is called roket; there are still, "),
            "{refusal}"
        );
    }

    #[test]
    fn a_folder_is_called_after_the_file() {
        assert_eq!(stem(Path::new("/data/07_fast.B.csv.gz")), "07_fast");
        assert_eq!(stem(Path::new(".hidden")), "hidden");
    }

    #[test]
    fn every_motion_is_listed() {
        assert_eq!(list().lines().count(), LIST.len());
        assert!(list().contains("no end"));
    }
}
