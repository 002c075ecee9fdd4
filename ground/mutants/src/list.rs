//! The mutants, as `cargo mutants --list --json` names them.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// A line and a column, both from one, the column in characters.
pub type Place = (usize, usize);

/// One mutant.
#[derive(Clone, Debug)]
pub struct Mutant {
    /// Its name: file, line, column and what is changed.
    pub name: String,
    /// The source file, from the root of the repository.
    pub file: String,
    /// What kind of change: `BinaryOperator`, `FnValue` and so on.
    pub genre: String,
    /// Where what is changed begins.
    pub at: Place,
    /// What stands there instead.
    pub replacement: String,
}

/// The mutants that `.cargo/mutants.toml` of the repository at `root` chooses, of files that begin as one of `files`.
///
/// # Errors
/// When cargo-mutants is not there, or says what is no list.
pub fn mutants(root: &Path, files: &[String]) -> Result<Vec<Mutant>, String> {
    let mut cargo = Command::new("cargo");
    cargo
        .args(["mutants", "--list", "--json", "--workspace"])
        .current_dir(root);
    let said = cargo.output().map_err(|error| format!("cargo mutants: {error}"))?;
    if !said.status.success() {
        return Err(format!("cargo mutants: {}", String::from_utf8_lossy(&said.stderr)));
    }
    let mut mutants = parsed(&said.stdout)?;
    mutants.retain(|mutant| files.iter().any(|file| mutant.file.starts_with(file)));
    Ok(mutants)
}

fn parsed(json: &[u8]) -> Result<Vec<Mutant>, String> {
    let list: Vec<Value> = serde_json::from_slice(json).map_err(|error| format!("cargo mutants: {error}"))?;
    let text = |of: &Value| of.as_str().unwrap_or_default().to_string();
    let number = |of: &Value| of.as_u64().unwrap_or_default() as usize;
    let mutant = |one: &Value| Mutant {
        name: text(&one["name"]),
        file: text(&one["file"]),
        genre: text(&one["genre"]),
        at: (
            number(&one["span"]["start"]["line"]),
            number(&one["span"]["start"]["column"]),
        ),
        replacement: text(&one["replacement"]),
    };
    Ok(list.iter().map(mutant).collect())
}
