//! Builds the firmware with whatever toolchain the machine has or can get.
//!
//! In: the workspace, cargo, the network if something is missing. Out: the ELF file. Order: the toolchain in use if
//! it has the target, after `rustup target add` if it lacks it, then Debian's packages. Refuses with what to install.

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use crate::image::{Image, ImageError};

const TARGET: &str = "thumbv7em-none-eabihf";
/// Debian's compiler and the sources of `core` that `-Zbuild-std` builds (packages rustc-web, rust-web-src).
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_CARGO: &str = "/usr/bin/cargo";

/// Builds the release image of the reference board, whose wiring the stand has, and reads it. Cargo does nothing if it
/// is up to date, and shows its progress on stderr.
///
/// # Errors
///
/// [`ImageError::Compile`], or [`ImageError::NoCompiler`] with what was tried.
pub fn build() -> Result<Image, ImageError> {
    build_package("emems")
}

/// The same of another package with a binary of its own name; its opt-level is that of the release profile or of
/// `CARGO_PROFILE_RELEASE_OPT_LEVEL`.
///
/// # Errors
///
/// As [`build`].
pub fn build_package(package: &str) -> Result<Image, ImageError> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let root = root.canonicalize().map_err(|_| ImageError::NoSources(root))?;
    let target_dir = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    let mut tried = Vec::new();
    if has_target(&mut tried) {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        return compile(Command::new(cargo), package, &root, &target_dir);
    }
    if debian(&root, &mut tried) {
        let mut cargo = Command::new(DEBIAN_CARGO);
        cargo
            .arg("-Zbuild-std=core")
            .env("RUSTC", DEBIAN_RUSTC)
            // Debian's compiler is a stable one; -Zbuild-std is what makes it serve a target it ships no core for.
            .env("RUSTC_BOOTSTRAP", "1")
            .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", "ld.lld");
        return compile(cargo, package, &root, &target_dir.join("debian"));
    }
    Err(ImageError::NoCompiler(tried))
}

/// Runs `cargo build --release` for the board and reads what it leaves.
fn compile(mut cargo: Command, package: &str, root: &Path, target_dir: &Path) -> Result<Image, ImageError> {
    cargo
        .args(["build", "--release", "--ignore-rust-version", "--package", package])
        .args(["--target", TARGET, "--target-dir"])
        .arg(target_dir)
        // The default of build.rs; unset, so that a plain `cargo build --release` leaves the same image.
        .env_remove("EMEMS_BOARD")
        .current_dir(root)
        .stdin(Stdio::null());
    match cargo.status() {
        Ok(status) if status.success() => Image::read(&target_dir.join(TARGET).join("release").join(package)),
        Ok(_) => Err(ImageError::Compile),
        Err(error) => Err(ImageError::NoCompiler(vec![format!("cargo does not start: {error}")])),
    }
}

/// Whether the compiler in use has `core` for the target, after asking rustup for it.
fn has_target(tried: &mut Vec<String>) -> bool {
    if core_is_installed() {
        return true;
    }
    eprintln!("adding the compiler target {TARGET} ...");
    match Command::new("rustup")
        .args(["target", "add", TARGET])
        .stdin(Stdio::null())
        .status()
    {
        Ok(status) if status.success() && core_is_installed() => return true,
        Ok(status) => tried.push(format!("`rustup target add {TARGET}` ended with {status}")),
        Err(error) => tried.push(format!("rustup does not start: {error}")),
    }
    false
}

fn core_is_installed() -> bool {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc)
        .args(["--print", "target-libdir", "--target", TARGET])
        .output();
    output.is_ok_and(|output| {
        output.status.success() && Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir()
    })
}

/// Whether Debian's compiler, the sources of `core` and a linker are there.
fn debian(root: &Path, tried: &mut Vec<String>) -> bool {
    let sysroot = Command::new(DEBIAN_RUSTC)
        .args(["--print", "sysroot"])
        .current_dir(root)
        .output();
    let sysroot = match sysroot {
        Ok(output) if output.status.success() => String::from_utf8_lossy(&output.stdout).trim().to_owned(),
        _ => {
            tried.push(format!("{DEBIAN_RUSTC} is not there (Debian package rustc-web)"));
            return false;
        }
    };
    let parts = [
        (
            PathBuf::from(sysroot).join("lib/rustlib/src/rust/library/core"),
            "rust-web-src",
        ),
        (PathBuf::from(DEBIAN_CARGO), "cargo-web"),
        (PathBuf::from("/usr/bin/ld.lld"), "lld"),
    ];
    let missing = parts.iter().filter(|(path, _)| !path.exists());
    let missing: Vec<_> = missing
        .map(|(path, package)| format!("{} is not there (Debian package {package})", path.display()))
        .collect();
    let complete = missing.is_empty();
    tried.extend(missing);
    complete
}
