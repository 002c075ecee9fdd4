//! What a diagnosis says, kept beside its case: asked again, it costs nothing.
//!
//! In: a case and what is left out of the library. Out: every text that `ground gap` prints or writes, by file name
//! ([`Analysis`]), and where it is kept: `CASE/analysis/`, with effects left out `CASE/analysis-without-NAME/`, without the
//! motion `CASE/analysis-parity/`. Beside the texts stands `key`: the SHA-256 of `case.toml`, of every file it names, of what was left out, and of the tool (its version, and the
//! size and date of the program). Any other byte is another key, and the diagnosis is made anew. `answer.toml` is no part of it.
//!
//! A folder that cannot be written is no error: the analysis is not kept.

use std::{
    fs, io,
    path::{Path, PathBuf},
    time::UNIX_EPOCH,
};

use sha2::{Digest, Sha256};

use crate::input::case::{CaseError, Opened};

/// The file with the key.
const KEY: &str = "key";

/// All texts of an analysis, by file name.
pub type Analysis = Vec<(String, String)>;

/// The place of an analysis.
#[derive(Clone, Debug)]
pub struct Kept {
    folder: PathBuf,
    key: String,
}

impl Kept {
    /// Of a case, given its folder or `case.toml`, as it is now.
    ///
    /// # Errors
    /// When a file of it cannot be read.
    pub fn of(case: &Path, withheld: &[String]) -> Result<Self, CaseError> {
        Self::seeing(case, withheld, true)
    }

    /// The same without its motion.
    ///
    /// # Errors
    /// When a file of it cannot be read.
    pub fn blind(case: &Path, withheld: &[String]) -> Result<Self, CaseError> {
        Self::seeing(case, withheld, false)
    }

    fn seeing(case: &Path, withheld: &[String], sees_motion: bool) -> Result<Self, CaseError> {
        let opened = Opened::open(case)?;
        let text = &opened.text;
        let motion = text.motion.as_ref().filter(|_| sees_motion);
        let known = &text.motion_known;
        let [track, simulated] = [&known.track, &known.simulated].map(|own| own.as_ref().filter(|_| motion.is_none()));
        let named = [Some(&text.unit), Some(&text.measured), motion, track, simulated];
        let files = named.into_iter().flatten().map(|relative| opened.path(relative));
        let mut sum = Sha256::new();
        // Lengths first, so that a byte that goes from one to the next is another key.
        let mut add = |bytes: &[u8]| {
            sum.update((bytes.len() as u64).to_le_bytes());
            sum.update(bytes);
        };
        add(tool().as_bytes());
        for name in withheld {
            add(name.as_bytes());
        }
        for file in std::iter::once(opened.file.clone()).chain(files) {
            add(&fs::read(&file).map_err(|source| CaseError::Read { file, source })?);
        }
        let key = sum.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        let blind = if sees_motion { "" } else { "-parity" };
        let name = match withheld {
            [] => format!("analysis{blind}"),
            names => format!("analysis{blind}-without-{}", names.join("-")),
        };
        Ok(Kept {
            folder: opened.path(Path::new(&name)),
            key,
        })
    }

    /// Where it is.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What was kept of this very case, if anything.
    pub fn read(&self) -> Option<Analysis> {
        let key = fs::read_to_string(self.folder.join(KEY)).ok()?;
        if key.trim_end() != self.key {
            return None;
        }
        let mut analysis = Analysis::new();
        for entry in fs::read_dir(&self.folder).ok()? {
            let path = entry.ok()?.path();
            let name = path.file_name()?.to_str()?.to_owned();
            if name != KEY {
                analysis.push((name, fs::read_to_string(&path).ok()?));
            }
        }
        Some(analysis)
    }

    /// Keeps an analysis in place of the one before.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn write(&self, analysis: &Analysis) -> io::Result<()> {
        // Without a key nothing in it counts, whenever this ends.
        match fs::remove_dir_all(&self.folder) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => fs::create_dir_all(&self.folder)?,
        }
        for (name, text) in analysis {
            fs::write(self.folder.join(name), text)?;
        }
        fs::write(self.folder.join(KEY), format!("{}\n", self.key))
    }
}

/// The text of that name.
pub fn text<'a>(analysis: &'a Analysis, name: &str) -> Option<&'a str> {
    let mut named = analysis.iter().filter(|(file, _)| file == name);
    named.next().map(|(_, text)| text.as_str())
}

/// This very program: a build of the same version may say something else.
fn tool() -> String {
    let program = std::env::current_exe().and_then(fs::metadata);
    let built = program.ok().map(|about| {
        let changed = about.modified().ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok());
        (about.len(), changed.map_or(0, |since| since.as_nanos()))
    });
    format!("{} {built:?}", env!("CARGO_PKG_VERSION"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(folder: &Path) {
        let text = "format = \"gap-case/1\"\nname = \"x\"\nkind = \"csv\"\nunit = \"unit.toml\"\nmeasured = \"m.csv\"\n\
                    motion = \"motion.csv\"\n[windows]\nfit = [[0.0, 1.0]]\nhold = [[1.0, 2.0]]\n";
        for (name, text) in [
            ("case.toml", text),
            ("unit.toml", "u"),
            ("m.csv", "m"),
            ("motion.csv", "t"),
        ] {
            fs::write(folder.join(name), text).expect(name);
        }
    }

    fn kept(folder: &Path, withheld: &[String]) -> Kept {
        Kept::of(folder, withheld).expect("a case")
    }

    #[test]
    fn what_was_kept_is_there_until_any_byte_of_the_case_changes() {
        let folder = tempfile::tempdir().expect("a folder");
        let place = folder.path();
        case(place);
        assert_eq!(kept(place, &[]).read(), None);
        let analysis = vec![("where.txt".to_owned(), "g2\n".to_owned())];
        kept(place, &[]).write(&analysis).expect("kept");
        assert_eq!(kept(place, &[]).read(), Some(analysis.clone()));
        fs::write(place.join("answer.toml"), "gyro-scale").expect("answer");
        assert_eq!(
            kept(place, &[]).read(),
            Some(analysis.clone()),
            "an answer is no part of a case"
        );
        for name in ["case.toml", "unit.toml", "m.csv", "motion.csv"] {
            let before = fs::read(place.join(name)).expect(name);
            let mut after = before.clone();
            after.push(b'\n');
            fs::write(place.join(name), after).expect(name);
            assert_eq!(kept(place, &[]).read(), None, "{name}");
            fs::write(place.join(name), before).expect(name);
            assert_eq!(kept(place, &[]).read(), Some(analysis.clone()), "{name}");
        }
    }

    #[test]
    fn another_track_or_simulated_trajectory_is_another_case() {
        let folder = tempfile::tempdir().expect("a folder");
        let place = folder.path();
        case(place);
        let text = fs::read_to_string(place.join("case.toml")).expect("a case");
        let known = "[motion_known]\ntrack = \"track.csv\"\nsimulated = \"s.csv\"\n[motion_known.distrust]\n\
                     rest = { attitude_deg = 1.0 }\n";
        let text = text.replace("motion = \"motion.csv\"\n", "") + known;
        fs::write(place.join("case.toml"), text).expect("a case");
        for name in ["track.csv", "s.csv"] {
            fs::write(place.join(name), name).expect(name);
        }
        let blind = || Kept::blind(place, &[]).expect("a case");
        for name in ["track.csv", "s.csv"] {
            blind().write(&Analysis::new()).expect("kept");
            assert_eq!(blind().read(), Some(Analysis::new()));
            fs::write(place.join(name), "another").expect(name);
            assert_eq!(blind().read(), None, "{name}");
        }
    }

    #[test]
    fn what_was_left_out_is_kept_apart() {
        let folder = tempfile::tempdir().expect("a folder");
        case(folder.path());
        let without = ["latency".to_owned()];
        kept(folder.path(), &[]).write(&Analysis::new()).expect("kept");
        assert_eq!(kept(folder.path(), &without).read(), None);
        assert!(
            kept(folder.path(), &without)
                .folder()
                .ends_with("analysis-without-latency")
        );
    }
}
