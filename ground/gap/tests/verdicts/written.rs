//! A `csv` case as files.

use std::fs;

use tempfile::TempDir;

/// The folder of a case of this name, `settings` being what its case.toml says from the environment on.
pub fn written(name: &str, settings: &str, unit: &str, motion: &str, measured: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let case = format!(
        "format = \"gap-case/1\"\nname = \"{name}\"\nkind = \"csv\"\nunit = \"unit.toml\"\n\
         measured = \"measured.csv\"\nmotion = \"motion.csv\"\n{settings}"
    );
    for (name, text) in [
        ("case.toml", case.as_str()),
        ("unit.toml", unit),
        ("motion.csv", motion),
        ("measured.csv", measured),
    ] {
        fs::write(folder.path().join(name), text).expect("a file");
    }
    folder
}
