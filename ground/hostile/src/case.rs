//! A gap case: it is refused with the file named, or made ready with something to fit and something to judge by.
//!
//! The bytes are the case's files one after another, each after a line `==> NAME`; what stands before the first such line
//! is passed over. A case whose `case.toml` names a path outside its folder is not opened here.

use std::fs;

use gap::input::case::Subject;

const FILES: [&str; 4] = ["case.toml", "unit.toml", "measured.txt", "motion.csv"];
const MARK: &[u8] = b"==> ";

/// The target.
pub fn case(bytes: &[u8]) {
    let folder = tempfile::tempdir().expect("temporary folder");
    let mut file: Option<&str> = None;
    let mut content: Vec<u8> = Vec::new();
    let put = |file: Option<&str>, content: &mut Vec<u8>| {
        if let Some(name) = file {
            fs::write(folder.path().join(name), &*content).expect("written");
        }
        content.clear();
    };
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        match line.strip_prefix(MARK) {
            Some(name) => {
                put(file.take(), &mut content);
                file = FILES.into_iter().find(|file| name.trim_ascii() == file.as_bytes());
            }
            None => content.extend_from_slice(line),
        }
    }
    put(file, &mut content);
    let said = fs::read_to_string(folder.path().join(FILES[0])).unwrap_or_default();
    let paths = ["unit", "measured", "motion"].map(|key| said.matches(key).count());
    if said.contains(['/', '\\']) || said.contains("..") || paths.iter().any(|times| *times > 3) {
        return;
    }
    match Subject::open(folder.path()) {
        Ok(subject) => {
            assert!(
                subject.fit.channels.iter().any(|channel| !channel.rows.is_empty()),
                "nothing to fit"
            );
            assert!(
                subject.held.counts().iter().any(|count| *count > 0),
                "nothing to judge by"
            );
        }
        Err(error) => {
            let named = folder
                .path()
                .file_name()
                .is_some_and(|name| error.to_string().contains(&*name.to_string_lossy()));
            assert!(named, "no file is named: {error}");
        }
    }
}
