//! The protocol's files: JSON in folders, and their hashes. Every error names its path.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde::{Serialize, de::DeserializeOwned};
use sha2::{Digest, Sha256};

use super::BlindError;

pub(super) fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

pub(super) fn stem(path: &Path) -> String {
    path.file_stem()
        .map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}

pub(super) fn entries(folder: &Path) -> Result<Vec<PathBuf>, BlindError> {
    let failed = |source| BlindError::File {
        path: folder.into(),
        source,
    };
    let mut paths = fs::read_dir(folder)
        .map_err(failed)?
        .map(|entry| entry.map(|entry| entry.path()).map_err(failed))
        .collect::<Result<Vec<_>, _>>()?;
    paths.sort();
    Ok(paths)
}

pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>, BlindError> {
    Ok(entries(folder)?
        .into_iter()
        .filter(|path| path.extension().is_some_and(|end| end == "json"))
        .collect())
}

pub(super) fn make(folder: &Path) -> Result<(), BlindError> {
    fs::create_dir_all(folder).map_err(|source| BlindError::File {
        path: folder.into(),
        source,
    })
}

pub(super) fn read(path: &Path) -> Result<Vec<u8>, BlindError> {
    fs::read(path).map_err(|source| BlindError::File {
        path: path.into(),
        source,
    })
}

pub(super) fn parse<T: DeserializeOwned>(path: &Path) -> Result<T, BlindError> {
    serde_json::from_slice(&read(path)?).map_err(|source| BlindError::Json {
        path: path.into(),
        source,
    })
}

pub(super) fn write(path: &Path, value: &impl Serialize) -> Result<(), BlindError> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(|source| BlindError::Json {
        path: path.into(),
        source,
    })?;
    bytes.push(b'\n');
    fs::write(path, bytes).map_err(|source| BlindError::File {
        path: path.into(),
        source,
    })
}

/// Channels of a case's unit that have an axis.
pub(super) fn channels(case: &Path) -> Option<usize> {
    let text = fs::read_to_string(case.join("unit.toml")).ok()?;
    Some(
        text.lines()
            .filter(|line| line.trim_start().starts_with("axis_b"))
            .count(),
    )
}
