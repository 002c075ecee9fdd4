//! Which effects, how likely, and what else it may be, in words.

use std::fmt::Write;

use crate::{
    diagnose::Diagnosis, input::case::Subject, probability::outcome::Outcome, report::unit::behind, thresholds::SAID,
};

/// Parameters of a cause that are printed; the rest is in the files.
const PRINTED: usize = 4;

/// Parameters of the calibration that are printed where it is to be fitted anew, and the prior sigmas from which they are.
const STRAINS: (usize, f64) = (4, 1.0);

/// Whether nothing is said to be there: no cause, nothing unknown, nothing undecided.
pub fn is_clean(diagnosis: &Diagnosis) -> bool {
    matches!(diagnosis.outcome, Outcome::Clean | Outcome::Recalibrate)
}

/// Writes what is said of causes.
pub fn write(text: &mut String, subject: &Subject, diagnosis: &Diagnosis) -> std::fmt::Result {
    let said = match diagnosis.outcome {
        Outcome::Named | Outcome::PartlyNamed => None,
        Outcome::Unknown => Some("NONE OF THESE: nothing in the library explains what is there"),
        Outcome::Undecided => Some("UNDECIDED: there is a gap, but no cause of it is likelier than not"),
        Outcome::Recalibrate => Some("NO EFFECT beyond calibration and noise once the calibration is fitted anew"),
        Outcome::Clean => Some("NO EFFECT beyond calibration and noise"),
    };
    if let Some(said) = said {
        writeln!(text, "CAUSE   {said}")?;
    }
    if diagnosis.outcome == Outcome::Recalibrate {
        let strains = diagnosis.strains.iter().take(STRAINS.0);
        let off: Vec<String> = strains
            .filter(|(_, off)| off.abs() > STRAINS.1)
            .map(|(name, off)| format!("{name} {off:+.1}"))
            .collect();
        if !off.is_empty() {
            writeln!(text, "        off by so many of its sigmas: {}", off.join(", "))?;
        }
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
                "        {} = {:.4e} +- {:.1e}{}",
                sized.parameter.name,
                sized.value,
                1.96 * sized.sigma,
                behind(sized.parameter.unit)
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
            "        withdrawn (no shrink on held-out data, or many at once that leave something): {}",
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
    remainder(text, subject, diagnosis)?;
    writeln!(
        text,
        "NONE    something that matters is left and no cause explains it, with probability {:.3}",
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

/// What is left, how large, and whether that matters.
fn remainder(text: &mut String, subject: &Subject, diagnosis: &Diagnosis) -> std::fmt::Result {
    let left = &diagnosis.remainder;
    if left.present <= SAID {
        return writeln!(
            text,
            "REST    nothing is left that stands out (the nearest is there with probability {:.2})",
            left.present
        );
    }
    writeln!(
        text,
        "REST    {}, {} [{}, {}] {} ({:.2} sigma{}); there with probability {:.3} (ln Bayes factor {:.0})",
        left.what,
        short(left.size[1]),
        short(left.size[0]),
        short(left.size[2]),
        left.unit,
        left.sigma[1],
        left.attitude_deg.map_or(String::new(), |[low, middle, high]| {
            format!(", {middle:.2} [{low:.2}, {high:.2}] deg of attitude")
        }),
        left.present,
        left.log_bayes_factor
    )?;
    writeln!(
        text,
        "        matters with probability {:.3}: more than {} deg, or {} sigma of the gap, and than the reference may be off by",
        left.matters, subject.bars.attitude_deg, subject.bars.gap_sigma
    )
}

/// Three digits.
fn short(value: f64) -> String {
    let digits = 2 - value.abs().max(f64::MIN_POSITIVE).log10().floor() as i32;
    format!("{value:.*}", digits.clamp(0, 9) as usize)
}
