//! The second step: `ground fly`, built and run with the words of this program.
//!
//! In: the folder of the first flight, if there is one. Out: the exit code of `ground fly`. Cargo's progress is on standard error. On
//! Unix it takes this process, so that Ctrl-C and requests to terminate reach the flight. Refuses where the sources are gone, or cargo
//! does not start.

use std::{
    env, io,
    path::{Path, PathBuf},
    process::{Command, ExitCode},
};

/// Why the image does not fly.
#[derive(Debug, thiserror::Error)]
pub enum NoRest {
    /// The sources that this program was built from are no longer where they were.
    #[error("the sources of `ground` are no longer in {}; --host flies without them", .0.display())]
    Sources(PathBuf),
    /// Cargo.
    #[error("cargo does not start: {0}; --host flies without it")]
    Cargo(io::Error),
}

/// Builds `ground` and flies the image.
///
/// # Errors
/// See [`NoRest`].
pub fn fly(first: Option<&Path>) -> Result<ExitCode, NoRest> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let manifest = root.join("Cargo.toml");
    if !manifest.exists() {
        return Err(NoRest::Sources(root));
    }
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo
        .args([
            "run",
            "--ignore-rust-version",
            "--target",
            "host-tuple",
            "--package",
            "emems-ground",
        ])
        .arg("--manifest-path")
        .arg(manifest)
        .args(["--", "fly"])
        .args(env::args_os().skip(1));
    if let Some(first) = first {
        cargo.arg("--in-place-of").arg(first);
    }
    run(cargo).map_err(NoRest::Cargo)
}

#[cfg(unix)]
fn run(mut cargo: Command) -> io::Result<ExitCode> {
    use std::os::unix::process::CommandExt;

    // It returns only where there is no such program.
    Err(cargo.exec())
}

#[cfg(not(unix))]
fn run(mut cargo: Command) -> io::Result<ExitCode> {
    let code = cargo.status()?.code().and_then(|code| u8::try_from(code).ok());
    Ok(ExitCode::from(code.unwrap_or(1)))
}
