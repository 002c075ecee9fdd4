//! The two steps of `cargo fly`: what the first leaves, and with which words the second is run.
//!
//! The second is not built here: a script stands for cargo, notes its words and ends with a code of its own.
#![cfg(unix)]

use std::{
    fs,
    os::unix::fs::PermissionsExt as _,
    path::Path,
    process::{Command, Output},
};

/// How the second step ends.
const CODE: i32 = 7;

/// Runs `fly` with a script for cargo; what it said, and the words for `ground fly`, if it came to that.
fn fly(place: &Path, words: &[&str]) -> (Output, Option<String>) {
    let (cargo, noted) = (place.join("cargo"), place.join("words"));
    fs::write(&cargo, format!("#!/bin/sh\necho \"$*\" > words\nexit {CODE}\n")).expect("script");
    fs::set_permissions(&cargo, fs::Permissions::from_mode(0o755)).expect("executable");
    let output = Command::new(env!("CARGO_BIN_EXE_fly"))
        .args(words)
        .current_dir(place)
        .env("CARGO", cargo)
        .output()
        .expect("fly");
    let words = fs::read_to_string(noted).ok();
    let words = words.map(|words| words.split_once(" -- ").expect("words of ground").1.trim().to_owned());
    (output, words)
}

#[test]
fn the_host_flies_first_and_the_image_after_it_with_the_same_words() {
    let place = tempfile::tempdir().expect("temporary folder");
    let (output, words) = fly(place.path(), &["--motion", "still", "--duration", "5s", "--seed", "7"]);
    assert_eq!(
        words.as_deref(),
        Some("fly --motion still --duration 5s --seed 7 --in-place-of flights/still-7")
    );
    assert_eq!(output.status.code(), Some(CODE), "the second step's code");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        said.ends_with("flights/still-7/index.html\non the host; the image's flight follows\n"),
        "{said}"
    );
    assert!(output.stdout.is_empty(), "the summary is the second step's to print");
    let page = fs::read_to_string(place.path().join("flights/still-7/index.html")).expect("page");
    assert!(page.contains("host, virtual time; the image"), "which board flew");
}

#[test]
fn a_flight_on_the_host_ends_there_and_a_bad_one_too() {
    let place = tempfile::tempdir().expect("temporary folder");
    let (output, words) = fly(place.path(), &["--host", "--motion", "still", "--duration", "5s"]);
    assert_eq!((output.status.code(), words), (Some(0), None));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.ends_with("flights/still-1/index.html\n"), "{said}");
    let (output, words) = fly(place.path(), &["--recording", "no-such-file.csv"]);
    assert_eq!((output.status.code(), words), (Some(2), None));
}

#[test]
fn what_the_host_cannot_show_goes_to_the_image_at_once() {
    for words in [&["--console"][..], &["--image", "x.elf", "--json"]] {
        let place = tempfile::tempdir().expect("temporary folder");
        let (output, passed) = fly(place.path(), words);
        assert_eq!(passed, Some(format!("fly {}", words.join(" "))));
        assert_eq!(output.status.code(), Some(CODE));
        assert!(!place.path().join("flights").exists());
    }
}
