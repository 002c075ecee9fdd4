//! Everything the unit said, kept before anyone looks at it, and beside it what was said to the unit.
//!
//! In: bytes and notes with the line's time. Out: two files. `FILE` holds the received bytes and nothing else, so that
//! any reader of packets reads it; `FILE.commands.txt` holds one line a word sent, unplugging or plugging: time, offset
//! in `FILE`, what happened. Both are appended to, never truncated: a console started again goes on in the same files.

use std::{
    fs::{File, OpenOptions},
    io::{self, Write},
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

/// An open recording.
pub struct Recording {
    path: PathBuf,
    received: File,
    commands: File,
    offset: u64,
}

/// A file of the recording could not be opened.
#[derive(Debug, thiserror::Error)]
#[error("cannot record to {}: {why}; give another file with --record", path.display())]
pub struct OpenError {
    /// The file.
    pub path: PathBuf,
    /// What the system says.
    pub why: io::Error,
}

impl Recording {
    /// Opens or goes on with the recording in `path`; `line` is noted as its source.
    ///
    /// # Errors
    /// When either file cannot be opened for appending or written to.
    pub fn open(path: &Path, line: &str, clock: SystemTime) -> Result<Self, OpenError> {
        let append = |path: &Path| OpenOptions::new().append(true).create(true).open(path);
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |why| OpenError { path, why }
        };
        let received = append(path).map_err(failed(path))?;
        let offset = received.metadata().map_err(failed(path))?.len();
        let commands_path = commands_path(path);
        let mut commands = append(&commands_path).map_err(failed(&commands_path))?;
        let time = humantime::format_rfc3339_millis(clock);
        writeln!(
            commands,
            "# {time} {line}: times in seconds from here, offset in bytes of the recording"
        )
        .map_err(failed(&commands_path))?;
        Ok(Recording {
            path: path.to_owned(),
            received,
            commands,
            offset,
        })
    }

    /// Where the bytes go.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes in the file.
    pub fn len_bytes(&self) -> u64 {
        self.offset
    }

    /// Keeps received bytes; on return the system has them.
    ///
    /// # Errors
    /// When some were not kept; later ones may be.
    pub fn keep(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.received.write_all(bytes)?;
        self.received.flush()?;
        self.offset += bytes.len() as u64;
        Ok(())
    }

    /// Keeps a note of what was done to the line.
    ///
    /// # Errors
    /// When it was not kept.
    pub fn note(&mut self, at: Duration, what: &str) -> io::Result<()> {
        writeln!(self.commands, "{:12.6} {:10} {what}", at.as_secs_f64(), self.offset)?;
        self.commands.flush()
    }
}

/// `FILE.commands.txt`.
pub fn commands_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".commands.txt");
    name.into()
}

/// A name nobody else has: the instant the console was started.
pub fn default_path(clock: SystemTime) -> PathBuf {
    let time = humantime::format_rfc3339_seconds(clock).to_string();
    format!("umbilical-{}.log", time.replace([':', '-'], "")).into()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_second_session_goes_on_where_the_first_ended() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pad.log");
        let mut first = Recording::open(&path, "/dev/ttyUSB0", SystemTime::UNIX_EPOCH).unwrap();
        first.keep(b"@00").unwrap();
        first.note(Duration::from_millis(1500), "sent G_ST").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"@00", "kept at once, not at the end");
        drop(first);
        let mut second = Recording::open(&path, "/dev/ttyUSB0", SystemTime::UNIX_EPOCH).unwrap();
        assert_eq!(second.len_bytes(), 3);
        second.keep(b"01").unwrap();
        second.note(Duration::ZERO, "unplugged").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"@0001");
        let title =
            "# 1970-01-01T00:00:00.000Z /dev/ttyUSB0: times in seconds from here, offset in bytes of the recording\n";
        assert_eq!(
            fs::read_to_string(commands_path(&path)).unwrap(),
            format!("{title}    1.500000          3 sent G_ST\n{title}    0.000000          5 unplugged\n")
        );
    }

    #[test]
    fn a_file_that_cannot_be_written_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing/pad.log");
        let error = Recording::open(&path, "x", SystemTime::UNIX_EPOCH)
            .err()
            .unwrap()
            .to_string();
        assert!(
            error.starts_with(&format!("cannot record to {}: ", path.display())),
            "{error}"
        );
    }

    #[test]
    fn the_default_name_is_the_instant() {
        assert_eq!(
            default_path(SystemTime::UNIX_EPOCH),
            Path::new("umbilical-19700101T000000Z.log")
        );
    }
}
