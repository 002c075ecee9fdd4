//! Bytes of a case's files, gzip or not, and TOML errors as file and key.

use std::path::Path;

use twin::keys::meant;

use super::CaseError;

/// \[bytes\] of one unpacked file: forty hours of 36 channels at 5 Hz are 113 MB.
const LARGEST: u64 = 512 << 20;

/// The bytes of a file, unpacked where it is a gzip file.
///
/// # Errors
/// When it cannot be read, is longer than half a gibibyte, or is a gzip bomb ([`packed`]).
pub fn read_bytes(file: &Path) -> Result<Vec<u8>, CaseError> {
    packed::read(file, LARGEST).map_err(|source| CaseError::Read {
        file: file.to_path_buf(),
        source,
    })
}

/// A TOML error as file, line and what is wrong.
pub fn toml_problem(file: &Path, error: &toml::de::Error) -> CaseError {
    let place = error.to_string().lines().next().unwrap_or("TOML").to_owned();
    CaseError::key(file, place, meant(error.message()))
}
