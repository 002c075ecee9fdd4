//! Tells `ground --version` the commit that it was built from, and puts a firmware image into the program.
//!
//! In: git, where there is one, and the file that `EMEMS_IMAGE` names, if it does. Out: `GROUND_VERSION`, the package's version,
//! with commit and date where git knows them, and `image.elf` for `src/fly/board.rs`, empty without an image. A source without
//! git, or a machine without it, gives the version alone and no error. Refuses an image that cannot be read.

use std::{env, fs, path::Path, process::Command};

fn git(words: &[&str]) -> Option<String> {
    let output = Command::new("git").args(words).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (output.status.success() && !text.is_empty()).then_some(text)
}

/// Puts the image where `src/fly/board.rs` takes it from; none for no image.
fn image() {
    println!("cargo::rerun-if-env-changed=EMEMS_IMAGE");
    let bytes = env::var_os("EMEMS_IMAGE").map_or_else(Vec::new, |file| {
        let file = Path::new(&file);
        println!("cargo::rerun-if-changed={}", file.display());
        assert!(
            file.is_absolute(),
            "EMEMS_IMAGE={}: name it from the root, as $PWD/target/...",
            file.display()
        );
        fs::read(file).unwrap_or_else(|error| panic!("EMEMS_IMAGE={}: {error}", file.display()))
    });
    let folder = env::var_os("OUT_DIR").expect("set by cargo");
    fs::write(Path::new(&folder).join("image.elf"), bytes).expect("OUT_DIR can be written");
}

fn main() {
    image();
    println!("cargo::rerun-if-changed=build.rs");
    // Written by every commit, checkout and rebase, wherever the work tree has it.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo::rerun-if-changed={log}");
    }
    let version = env!("CARGO_PKG_VERSION");
    let commit = git(&["log", "-1", "--format=%h, %cs"]);
    let text = commit.map_or(version.to_owned(), |commit| format!("{version} ({commit})"));
    println!("cargo::rustc-env=GROUND_VERSION={text}");
}
