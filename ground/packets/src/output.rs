//! A file that is written whole or not at all.
//!
//! In: a path and what to write. Out: the file, replaced at once when everything is written and not before: it is written
//! under a temporary name beside it and renamed. So an error, a full disk or a killed program leaves what was there.
//! What is no regular file (a pipe, /dev/null) is written as it is.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

/// Writes a file by `write`.
///
/// # Errors
/// When it cannot be written; then what was there is there still.
pub fn replace(path: &Path, write: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>) -> io::Result<()> {
    if fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        let mut out = BufWriter::new(File::create(path)?);
        write(&mut out)?;
        return out.flush();
    }
    // A link is followed: what it names is replaced.
    let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let beside = beside(&path);
    let written = File::create(&beside).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
        fs::rename(&beside, &path)
    });
    if written.is_err() {
        // Already failing: that the rest of it stays is the lesser evil.
        let _ = fs::remove_file(&beside);
    }
    written
}

/// Writes a file of these bytes, as [`replace`].
///
/// # Errors
/// When it cannot be written; then what was there is there still.
pub fn replace_with(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    replace(path, |out| out.write_all(bytes.as_ref()))
}

/// A name beside it that nobody else uses.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_or_left_as_it_was() {
        let place = tempfile::tempdir().expect("temporary folder");
        let path = place.path().join("flight.csv");
        replace_with(&path, "have").expect("written");
        let failed = replace(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("no more"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).expect("there"), b"have");
        replace_with(&path, "new").expect("written");
        assert_eq!(fs::read(&path).expect("there"), b"new");
        assert_eq!(
            fs::read_dir(place.path()).expect("folder").count(),
            1,
            "nothing is left beside it"
        );
    }

    #[test]
    fn a_folder_that_is_not_there_is_an_error_of_the_path() {
        let place = tempfile::tempdir().expect("temporary folder");
        assert!(replace_with(&place.path().join("none/flight.csv"), "x").is_err());
    }
}
