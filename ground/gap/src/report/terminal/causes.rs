//! Which effects, how likely, and what else it may be, in words.

use std::fmt::Write;

use crate::{diagnose::Diagnosis, input::case::Subject, probability::outcome::Outcome, thresholds::SAID};

/// Parameters of a cause that are printed; the rest is in the files.
const PRINTED: usize = 4;

/// Whether nothing is said to be there: no cause, nothing unknown, nothing undecided.
pub fn is_clean(diagnosis: &Diagnosis) -> bool {
    matches!(diagnosis.outcome, Outcome::Clean)
}

/// Writes what is said of causes.
pub fn write(text: &mut String, subject: &Subject, diagnosis: &Diagnosis) -> std::fmt::Result {
    let said = match diagnosis.outcome {
        Outcome::Named => None,
        Outcome::Unknown => Some("NONE OF THESE: nothing in the library explains what is there"),
        Outcome::Undecided => Some("UNDECIDED: there is a gap, but no cause of it is likelier than not"),
        Outcome::Clean => Some("NO EFFECT beyond calibration and noise"),
    };
    if let Some(said) = said {
        writeln!(text, "CAUSE   {said}")?;
    }
    for cause in &diagnosis.causes {
        writeln!(
            text,
            "CAUSE   {}{} at {}, probability {:.3}, {:.0} % of what is explained",
            if cause.probability < SAID { "perhaps " } else { "" },
            cause.effect,
            cause.locality,
            cause.probability,
            100.0 * cause.share
        )?;
        writeln!(text, "        {}", cause.physics)?;
        if cause.probability < SAID {
            writeln!(
                text,
                "        it or one of those below is there, probability {:.3}",
                cause.any()
            )?;
        }
        for sized in cause.parameters.iter().take(PRINTED) {
            writeln!(
                text,
                "        {} = {:.4e} +- {:.1e} {}",
                sized.parameter.name,
                sized.value,
                1.96 * sized.sigma,
                sized.parameter.unit
            )?;
        }
        if cause.parameters.len() > PRINTED {
            writeln!(text, "        and {} more parameters", cause.parameters.len() - PRINTED)?;
        }
        if cause.is_suspicious {
            writeln!(
                text,
                "        more than five times its usual size: it may stand for something else"
            )?;
        }
        writeln!(
            text,
            "        where {}; when {}",
            subject.names(cause.channels.iter().copied()).join(" "),
            cause.when
        )?;
        if let Some(which) = &cause.which {
            writeln!(text, "        which: {which}")?;
        }
        writeln!(text, "        confirm: {}", cause.confirm_by)?;
    }
    if !diagnosis.withdrawn.is_empty() {
        writeln!(
            text,
            "        withdrawn (no shrink on held-out data, or too many at once): {}",
            diagnosis.withdrawn.join(", ")
        )?;
    }
    let others: Vec<String> = diagnosis
        .alternatives
        .iter()
        .take(3)
        .map(|(name, probability)| format!("{name} {probability:.3}"))
        .collect();
    if !others.is_empty() && !is_clean(diagnosis) {
        writeln!(text, "OR      {}", others.join(", "))?;
    }
    for set in &diagnosis.indistinguishable {
        writeln!(text, "        this motion cannot tell apart: {}", set.join(", "))?;
    }
    writeln!(
        text,
        "NONE    something outside the library is needed with probability {:.3}",
        diagnosis.none_of_these
    )?;
    for aspect in diagnosis
        .leftover
        .aspects
        .iter()
        .take(3)
        .filter(|_| diagnosis.is_unexplained())
    {
        writeln!(text, "        left: {} ({:.1} sigma)", aspect.what, aspect.size)?;
    }
    if let Some(p) = diagnosis.leftover.again.filter(|_| diagnosis.is_unexplained()) {
        writeln!(
            text,
            "        the first of them is as large on the held-out windows as it is by chance with probability {p:.3}"
        )?;
    }
    Ok(())
}
