//! How far the held-out gap shrinks, in words.

use std::fmt::{Result, Write};

use crate::{diagnose::Diagnosis, holdout::stages::Stage, input::case::Subject, report::gained::gained};

/// How far it shrinks: in total, by stage and by channel.
pub fn shrink(subject: &Subject, diagnosis: &Diagnosis) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut text, subject, diagnosis);
    text
}

fn write(text: &mut String, subject: &Subject, diagnosis: &Diagnosis) -> Result {
    let shrink = &diagnosis.shrink;
    writeln!(
        text,
        "held-out gap  {:.4} sigma, recalibrated {:.4}, with the effect {:.4}, floor {:.4}",
        shrink.before, shrink.recalibrated, shrink.after, shrink.floor
    )?;
    writeln!(
        text,
        "shrink        {}, of the way to the floor",
        gained(
            [shrink.before, shrink.after],
            shrink.percent,
            shrink.interval_percent,
            diagnosis.ceiling_percent
        )
    )?;
    stages(text, &diagnosis.stages)?;
    writeln!(
        text,
        "channel    before recal.  after       rms before        rms after"
    )?;
    for (channel, own) in subject.twin.unit().channels.iter().zip(&shrink.channels) {
        let worse = if own.is_worse() { "  worse" } else { "" };
        writeln!(
            text,
            "{:10} {:6.3} {:6.3} {:6.3}   {:14.6} {:16.6}{worse}",
            channel.name, own.before, own.recalibrated, own.after, own.before_rms, own.after_rms
        )?;
    }
    Ok(())
}

fn stages(text: &mut String, stages: &[Stage]) -> Result {
    if stages.is_empty() {
        return Ok(());
    }
    writeln!(
        text,
        "{:36} {:>9} {:>9} {:>9} {:>9} {:>9}  shrink [%]",
        "stage", "before", "recal.", "after", "set", "floor"
    )?;
    for stage in stages {
        let corrected = stage.corrected.map_or("-".to_owned(), |error| format!("{error:.4}"));
        let percent = stage.percent.map_or("-".to_owned(), |percent| {
            let [low, high] = stage.interval_percent;
            format!("{percent:.1} [{low:.1}, {high:.1}]")
        });
        writeln!(
            text,
            "{:36} {:9.4} {:9.4} {:9.4} {corrected:>9} {:9.4}  {percent}",
            format!("{} [{}]", stage.name, stage.unit),
            stage.before,
            stage.recalibrated,
            stage.after,
            stage.floor
        )?;
    }
    Ok(())
}
