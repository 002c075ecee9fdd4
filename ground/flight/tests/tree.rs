//! What a first `cargo fly` builds: little, and nothing that is built again for `ground` or for the tests.
//!
//! `cargo tree` is asked, which reads Cargo.lock and builds nothing.

use std::{collections::BTreeSet, env, process::Command};

/// What the first page does without: each of them is a large part of the host program's build.
const HEAVY: [&str; 13] = [
    "cranelift-codegen",
    "defmt-decoder",
    "emems-attitude",
    "emems-bench",
    "emems-drill",
    "emems-emulated",
    "emems-gap",
    "emems-ground",
    "emems-recorder",
    "parquet",
    "ratatui",
    "rigless",
    "serialport",
];

/// `name v1.2.3` and the features of each package that is built.
fn built(words: &[&str]) -> BTreeSet<(String, String)> {
    let output = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args([
            "tree",
            "--offline",
            "--locked",
            "--target",
            "host-tuple",
            "--prefix",
            "none",
        ])
        .args(["--format", "{p}|{f}"])
        .args(words)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo tree");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("text");
    let line = |line: &str| {
        let (package, features) = line.split_once('|')?;
        let named: Vec<&str> = package.split(' ').take(2).collect();
        // A package that was shown before has a star.
        Some((named.join(" "), features.trim_end_matches(" (*)").to_owned()))
    };
    text.lines().filter_map(line).collect()
}

#[test]
fn the_first_page_needs_no_heavy_package() {
    let built = built(&["--package", "emems-flight", "--edges", "normal,build"]);
    let names: BTreeSet<&str> = built
        .iter()
        .filter_map(|(package, _)| package.split(' ').next())
        .collect();
    assert!(
        names.contains("emems-twin") && names.contains("emems-logs"),
        "{names:?}"
    );
    let heavy: Vec<_> = HEAVY.iter().filter(|heavy| names.contains(*heavy)).collect();
    assert!(
        heavy.is_empty(),
        "{heavy:?}: `cargo tree --package emems-flight --invert NAME` says who asks for it"
    );
}

#[test]
fn nothing_is_built_twice_for_ground_or_for_the_tests() {
    let flight = built(&["--package", "emems-flight", "--edges", "normal,build"]);
    let ground = built(&["--package", "emems-ground", "--edges", "normal,build"]);
    let tests = built(&["--workspace", "--edges", "all"]);
    for (less, more, whose) in [(&flight, &ground, "flight"), (&ground, &tests, "ground")] {
        let other: Vec<_> = less.difference(more).collect();
        assert!(
            other.is_empty(),
            "{other:?} have fewer features here than in the larger build: turn them on in `{whose}`'s Cargo.toml, under \"Not called\""
        );
    }
}
