//! The whole diagnosis of five short cases against the verdicts in `golden/`: whether a change of code changed what is said.
//!
//! In: `golden/NAME/case.toml`. Compared: verdict.json with the advice, and beside it what the verdict leaves out. Words must be
//! the same and numbers within [`SAME`]. `GOLDEN=write` writes the files anew instead; `golden/README.md` says what the cases
//! are.

use std::path::{Path, PathBuf};

use gap::{
    diagnose::{Diagnosis, diagnose},
    input::case::Subject,
    report::verdict::Verdict,
};
use serde_json::{Value, json};

/// Relative difference of numbers that are the same: sums in another order differ by rounding, another approximation of a
/// tail probability by some 1e-7.
const SAME: f64 = 1e-3;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

/// The verdict, and what it leaves out of the diagnosis.
fn said(subject: &Subject, diagnosis: &Diagnosis) -> Value {
    let aspects = diagnosis.leftover.aspects.iter().take(5);
    let stages = diagnosis.stages.iter();
    json!({
        "verdict": Verdict::new(subject, diagnosis, diagnosis.advice(subject)),
        "gate": [diagnosis.gate.p, diagnosis.gate.log_tail],
        "leftover": [diagnosis.leftover.p, diagnosis.leftover.log_tail],
        "aspects": aspects.map(|aspect| json!([aspect.what, aspect.size])).collect::<Vec<_>>(),
        "again": diagnosis.leftover.again,
        "withdrawn": diagnosis.withdrawn,
        "alone": diagnosis.alone.iter().take(10).collect::<Vec<_>>(),
        "stages": stages.map(|stage| json!([stage.name, stage.before, stage.after])).collect::<Vec<_>>(),
        "channels": diagnosis.place.channels.iter().take(6).collect::<Vec<_>>(),
        "cells": diagnosis.place.cells.len(),
        "limits": diagnosis.limits.iter().map(|limit| json!([limit.effect, limit.size])).collect::<Vec<_>>(),
    })
}

/// What differs, with the path to it.
fn differences(path: &str, one: &Value, other: &Value, found: &mut Vec<String>) {
    match (one, other) {
        (Value::Object(own), Value::Object(others)) if own.keys().eq(others.keys()) => {
            for (key, value) in own {
                differences(&format!("{path}/{key}"), value, &others[key], found);
            }
        }
        (Value::Array(own), Value::Array(others)) if own.len() == others.len() => {
            for (at, (value, other)) in own.iter().zip(others).enumerate() {
                differences(&format!("{path}/{at}"), value, other, found);
            }
        }
        (Value::Number(own), Value::Number(others)) => {
            let [own, others] = [own, others].map(|number| number.as_f64().unwrap_or(f64::NAN));
            let is_same = (own - others).abs() <= SAME * own.abs().max(others.abs());
            if !is_same {
                found.push(format!("{path}: {own} is now {others}"));
            }
        }
        _ if one == other => {}
        _ => found.push(format!("{path}: {one} is now {other}")),
    }
}

fn check(name: &str) {
    let folder = folder(name);
    let subject = Subject::open(&folder).expect("opens");
    let now = said(&subject, &diagnose(&subject, &[], &|_, _| {}));
    let file = folder.join("verdict.json");
    if std::env::var("GOLDEN").is_ok_and(|what| what == "write") {
        let text = serde_json::to_string_pretty(&now).expect("is finite");
        std::fs::write(&file, text + "\n").expect("can be written");
        return;
    }
    let text = std::fs::read_to_string(&file).expect("is there; GOLDEN=write makes it");
    let golden: Value = serde_json::from_str(&text).expect("is JSON");
    let mut found = Vec::new();
    differences(name, &golden, &now, &mut found);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn a_healthy_unit_is_judged_as_before() {
    check("healthy");
}

#[test]
fn low_bits_cut_off_are_judged_as_before() {
    check("quantised");
}

#[test]
fn samples_sent_twice_are_judged_as_before() {
    check("stale");
}

#[test]
fn misaligned_axes_are_judged_as_before() {
    check("misaligned");
}

#[test]
fn what_the_library_does_not_have_is_judged_as_before() {
    check("novel");
}

#[test]
fn a_number_that_differs_is_found_and_its_rounding_is_not() {
    let differing = |other: Value| {
        let mut found = Vec::new();
        differences("", &json!({ "a": [1.0, "b"] }), &other, &mut found);
        found.len()
    };
    assert_eq!(differing(json!({ "a": [1.000_000_1, "b"] })), 0);
    assert_eq!(differing(json!({ "a": [1.01, "b"] })), 1);
    assert_eq!(differing(json!({ "a": [1.0, "c"] })), 1);
    assert_eq!(differing(json!({ "b": [1.0, "b"] })), 1);
    assert_eq!(differing(json!({ "a": [1.0] })), 1);
}
