//! Tells `ground --version` the commit that it was built from.
//!
//! In: git, where there is one. Out: `GROUND_VERSION`, the package's version, with commit and date where git knows them. A
//! source without git, or a machine without it, gives the version alone and no error.

use std::process::Command;

fn git(words: &[&str]) -> Option<String> {
    let output = Command::new("git").args(words).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (output.status.success() && !text.is_empty()).then_some(text)
}

fn main() {
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
