//! Where the gap is, in words.

use std::fmt::{Result, Write};

use super::wrap::wrapped;
use crate::{
    diagnose::Diagnosis,
    input::case::Subject,
    report::place_shares,
    thresholds::CHANCE,
    unknown::place::{
        passage::{Instant, Passage},
        regimes::UNEXPLAINED,
    },
};

/// Parts of a share that are printed.
const PRINTED: usize = 6;

/// Cells that are printed; the rest is counted.
const CELLS: usize = 8;

/// Share below which a part is not printed.
const LEAST: f64 = 0.01;

/// Where the gap is: shares, cells, when, and at which stage of the pipeline.
pub fn places(subject: &Subject, diagnosis: &Diagnosis) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut text, subject, diagnosis);
    wrapped(&text)
}

/// One line of the screen; nothing where there is no gap to be anywhere.
pub(super) fn line(text: &mut String, diagnosis: &Diagnosis) -> Result {
    if diagnosis.gate.p > CHANCE && diagnosis.causes.is_empty() {
        return Ok(());
    }
    let place = &diagnosis.place;
    let first = |parts: &[(String, f64)], count: usize| -> String {
        let shown = parts.iter().take(count).filter(|(_, share)| *share >= LEAST);
        let words: Vec<String> = shown
            .map(|(name, share)| format!("{name} {:.0} %", 100.0 * share))
            .collect();
        words.join(", ")
    };
    let mut octaves = place.octaves.clone();
    octaves.sort_by(|one, other| other.1.total_cmp(&one.1));
    let explaining: Vec<(String, f64)> = place
        .regimes
        .iter()
        .filter(|(name, _)| name != UNEXPLAINED)
        .cloned()
        .collect();
    let follows = Some(first(&explaining, 2)).filter(|words| !words.is_empty());
    let parts = [
        Some(first(&place_shares::channels(diagnosis), 4)),
        Some(first(&octaves, 1)),
        follows.map(|words| format!("follows {words}")),
        place.passage.as_ref().map(when),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().filter(|part| !part.is_empty()).collect();
    writeln!(text, "WHERE   {}", parts.join("; "))
}

/// When it is there, in words.
pub fn when(passage: &Passage) -> String {
    let at = |instant: &Instant| {
        let [low, high] = instant.interval_s;
        format!("{:.0} s [{low:.0}, {high:.0}]", instant.t_s)
    };
    match (&passage.onset, &passage.end) {
        (Some(onset), Some(end)) => format!("from {} to {}", at(onset), at(end)),
        (Some(onset), None) => format!("from {} on", at(onset)),
        (None, Some(end)) => format!("until {}", at(end)),
        (None, None) => "throughout".to_owned(),
    }
}

fn write(text: &mut String, subject: &Subject, diagnosis: &Diagnosis) -> Result {
    let place = &diagnosis.place;
    if diagnosis.gate.p > CHANCE && diagnosis.causes.is_empty() {
        writeln!(
            text,
            "no gap beyond calibration and noise (p {:.2}): shares are of little",
            diagnosis.gate.p
        )?;
    }
    for (what, parts) in [
        ("channels", &place_shares::channels(diagnosis)),
        ("plates", &place_shares::groups(subject, diagnosis)),
        ("octaves", &place.octaves),
        ("regimes", &place.regimes),
    ] {
        let shown = parts.iter().filter(|(_, share)| *share >= LEAST).take(PRINTED);
        let words: Vec<String> = shown
            .map(|(name, share)| format!("{:.0} % {name}", 100.0 * share))
            .collect();
        writeln!(text, "{what:9} {}", words.join(", "))?;
    }
    let passage = place.passage.as_ref().map_or("throughout".to_owned(), when);
    writeln!(text, "when      {passage}")?;
    writeln!(
        text,
        "cells     {} stand out at a false discovery rate of 5 %",
        place.cells.len()
    )?;
    for cell in place.cells.iter().take(CELLS) {
        writeln!(
            text,
            "          {:5} {:.0} to {:.0} s, {} ({:.1} sigma)",
            cell.channel, cell.from_s, cell.to_s, cell.regime, cell.size
        )?;
    }
    writeln!(
        text,
        "stage     raw: {:.3} sigma, floor {:.3}",
        diagnosis.shrink.before, diagnosis.shrink.floor
    )?;
    for stage in &diagnosis.stages {
        let kind = if stage.unit == "deg" { "" } else { "calibrated " };
        writeln!(
            text,
            "          {kind}{}: {:.4} {}, floor {:.4}",
            stage.name, stage.before, stage.unit, stage.floor
        )?;
    }
    for cause in &diagnosis.causes {
        let names = subject.names(cause.channels.iter().copied()).join(" ");
        writeln!(
            text,
            "{:9} {:.0} % of what is explained, at {names}; {}",
            cause.effect,
            100.0 * cause.share,
            cause.when
        )?;
    }
    for aspect in diagnosis.leftover.aspects.iter().take(PRINTED) {
        writeln!(text, "left      {} ({:.1} sigma)", aspect.what, aspect.size)?;
    }
    Ok(())
}
