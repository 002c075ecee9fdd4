//! A copy of the repository with its mutants woven in, built; those that the compiler refuses are left out and named.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::list::Mutant;
use crate::weave;

/// What each crate with mutants gets.
const ASLEEP: &str = include_str!("asleep.txt");

/// The crates that may have mutants, by the folder of their sources.
const CRATES: [&str; 2] = ["drivers/src/", "src/"];

/// What is woven of the mutants, and what is not.
#[derive(Debug, Default)]
pub struct Built {
    /// The test programs, with the folder each runs in.
    pub programs: Vec<(PathBuf, PathBuf)>,
    /// Mutants that the compiler refuses.
    pub unviable: BTreeSet<usize>,
    /// Mutants that could not be woven, and are cargo-mutants' own to try.
    pub apart: BTreeSet<usize>,
}

/// Copies the repository at `root` below its `target`, weaves the mutants in and builds the tests that `tests` (arguments of
/// cargo) choose.
///
/// # Errors
/// When files cannot be read or written, and when the compiler refuses what is no mutant.
pub fn built(root: &Path, mutants: &[Mutant], tests: &[String]) -> Result<Built, String> {
    let copy = root.join("target/mutants");
    copied(root, &copy)?;
    let (mut built, mut keep) = (Built::default(), BTreeSet::new());
    for stage in [&["check", "--lib"][..], &["test", "--no-run"][..]] {
        loop {
            written(root, &copy, mutants, &mut built, &keep)?;
            let mut arguments: Vec<String> = stage.iter().map(ToString::to_string).collect();
            if stage[0] == "check" {
                arguments.extend(["-pemems".into(), "-pemems-drivers".into()]);
            } else {
                arguments.extend(tests.iter().cloned());
            }
            let (ok, messages, stderr) = cargo(&copy, &arguments)?;
            if ok {
                built.programs = programs(&messages);
                break;
            }
            let before = (built.unviable.len(), built.apart.len(), keep.len());
            for message in &messages {
                blame(&copy, message, &mut built, &mut keep);
            }
            let now = (built.unviable.len(), built.apart.len(), keep.len());
            eprintln!("{}: {} unviable, {} apart", stage[0], now.0, now.1);
            if before == now {
                let rendered = messages
                    .iter()
                    .filter_map(|message| message["message"]["rendered"].as_str());
                return Err(format!("{}{stderr}", rendered.take(5).collect::<String>()));
            }
        }
    }
    Ok(built)
}

fn said<T>(what: &Path, result: std::io::Result<T>) -> Result<T, String> {
    result.map_err(|error| format!("{}: {error}", what.display()))
}

fn copied(root: &Path, copy: &Path) -> Result<(), String> {
    let listed = said(
        root,
        Command::new("git").args(["ls-files", "-z"]).current_dir(root).output(),
    )?;
    for name in String::from_utf8_lossy(&listed.stdout).split_terminator('\0') {
        if let Ok(bytes) = fs::read(root.join(name)) {
            changed(&copy.join(name), &bytes)?;
        }
    }
    Ok(())
}

fn changed(path: &Path, bytes: &[u8]) -> Result<(), String> {
    if fs::read(path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    if let Some(folder) = path.parent() {
        said(folder, fs::create_dir_all(folder))?;
    }
    said(path, fs::write(path, bytes))
}

fn written(
    root: &Path,
    copy: &Path,
    mutants: &[Mutant],
    built: &mut Built,
    keep: &BTreeSet<String>,
) -> Result<(), String> {
    let left: BTreeSet<usize> = built.unviable.union(&built.apart).copied().collect();
    let files: BTreeSet<&str> = mutants.iter().map(|mutant| mutant.file.as_str()).collect();
    for file in files {
        let of_file: Vec<(usize, &Mutant)> = mutants
            .iter()
            .enumerate()
            .filter(|(_, mutant)| mutant.file == file)
            .collect();
        let path = root.join(file);
        let text = said(&path, fs::read_to_string(&path))?;
        let woven = weave::woven(&text, &of_file, &left, keep)?;
        let missing = of_file.iter().map(|(number, _)| *number);
        built
            .apart
            .extend(missing.filter(|number| !woven.mutants.contains(number) && !left.contains(number)));
        changed(&copy.join(file), woven.text.as_bytes())?;
    }
    for folder in CRATES {
        let path = root.join(folder).join("lib.rs");
        let copied = copy.join(folder).join("lib.rs");
        let from = if mutants.iter().any(|mutant| mutant.file == format!("{folder}lib.rs")) {
            &copied
        } else {
            &path
        };
        let text = said(from, fs::read_to_string(from))?;
        let text = if text.ends_with(ASLEEP) { text } else { text + ASLEEP };
        changed(
            &copied,
            text.replacen("#![no_std]", "#![allow(warnings)]\n#![no_std]", 1)
                .as_bytes(),
        )?;
    }
    Ok(())
}

fn cargo(copy: &Path, arguments: &[String]) -> Result<(bool, Vec<Value>, String), String> {
    let mut cargo = Command::new("cargo");
    cargo.args(arguments).args([
        "--ignore-rust-version",
        "--target=host-tuple",
        "--offline",
        "--message-format=json",
    ]);
    // Its own folder: cargo takes a crate of the copy for the repository's (same name, same place in its workspace), and the tests
    // of the repository would be the woven ones from then on.
    cargo.current_dir(copy).env("CARGO_TARGET_DIR", copy.join("target"));
    let output = said(copy, cargo.output())?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let messages = text
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect();
    Ok((
        output.status.success(),
        messages,
        String::from_utf8_lossy(&output.stderr).into_owned(),
    ))
}

/// The mutants that an error of the compiler is about are left out.
fn blame(copy: &Path, message: &Value, built: &mut Built, keep: &mut BTreeSet<String>) {
    let message = &message["message"];
    if message["level"] != "error" {
        return;
    }
    if message["code"]["code"] == "E0015" {
        let text = message["message"].as_str().unwrap_or_default();
        let path = text.split('`').nth(1).unwrap_or_default();
        let name = path.rsplit("::").next().unwrap_or_default();
        keep.insert(name.split('<').next().unwrap_or_default().to_string());
        return;
    }
    for span in message["spans"].as_array().into_iter().flatten() {
        if span["is_primary"] != true {
            continue;
        }
        let file = span["file_name"].as_str().unwrap_or_default();
        let Ok(text) = fs::read_to_string(copy.join(file)) else {
            continue;
        };
        let at = span["byte_start"].as_u64().unwrap_or_default() as usize;
        match weave::blamed(&text, at.min(text.len())) {
            (Some(mutant), _) => drop(built.unviable.insert(mutant)),
            (None, mutants) => built.apart.extend(mutants),
        }
    }
}

fn programs(messages: &[Value]) -> Vec<(PathBuf, PathBuf)> {
    let program = |message: &Value| {
        let program = message["executable"].as_str()?;
        let folder = Path::new(message["manifest_path"].as_str()?).parent()?;
        Some((program.into(), folder.into()))
    };
    messages.iter().filter_map(program).collect()
}
