//! Bytes of a case's files, gzip or not, and TOML errors as file and key.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

use flate2::read::MultiGzDecoder;
use twin::keys::meant;

use super::CaseError;

/// [bytes] of one unpacked file: forty hours of 36 channels at 5 Hz are 113 MB; a gzip bomb is stopped here.
const LARGEST: u64 = 512 << 20;

/// The bytes of a file, unpacked where it ends in `.gz`.
///
/// # Errors
/// When it cannot be read or is longer than half a gibibyte.
pub fn read_bytes(file: &Path) -> Result<Vec<u8>, CaseError> {
    let wrap = |source| CaseError::Read {
        file: file.to_path_buf(),
        source,
    };
    let opened = File::open(file).map_err(wrap)?;
    let reader: Box<dyn Read> = if file.extension().is_some_and(|extension| extension == "gz") {
        Box::new(MultiGzDecoder::new(opened))
    } else {
        Box::new(opened)
    };
    let mut bytes = Vec::new();
    reader.take(LARGEST + 1).read_to_end(&mut bytes).map_err(wrap)?;
    if bytes.len() as u64 > LARGEST {
        return Err(wrap(io::Error::other(
            "is longer than 512 MiB; cut the log into several cases",
        )));
    }
    Ok(bytes)
}

/// A TOML error as file, line and what is wrong.
pub fn toml_problem(file: &Path, error: &toml::de::Error) -> CaseError {
    let place = error.to_string().lines().next().unwrap_or("TOML").to_owned();
    CaseError::key(file, place, meant(error.message()))
}
