//! The verdict in plain words: a sentence, then what, where, how sure, how much better, what to do.
//!
//! In: a finished [`Diagnosis`]. Out: text for the head of a page. It says nothing that the screen does not; probabilities and
//! sizes are those of `verdict.json`.

use crate::{
    diagnose::Diagnosis,
    input::case::Subject,
    probability::{cause::Cause, outcome::Outcome},
    report::{gained::gained, unit::behind},
    thresholds::SAID,
};

/// Parameters of a cause that are said.
const SAID_OF: usize = 3;

/// Other effects that are said.
const OTHERS: usize = 3;

/// The outcome in a sentence or two.
pub fn sentence(subject: &Subject, diagnosis: &Diagnosis) -> String {
    let gap = format!(
        "The log differs from what its description predicts by {:.2} sigma, where 1 is perfect",
        diagnosis.gap
    );
    let named = || {
        let each: Vec<String> = diagnosis
            .causes
            .iter()
            .map(|cause| match cause.probability < SAID {
                true => format!("perhaps {} at {}", cause.effect, cause.locality),
                false => format!("{} at {}", cause.effect, cause.locality),
            })
            .collect();
        match each.split_last() {
            Some((last, others)) if !others.is_empty() => format!("{} and {last}", others.join(", ")),
            _ => each.concat(),
        }
    };
    let them = if diagnosis.causes.len() > 1 { "them" } else { "it" };
    let shrink = &diagnosis.shrink;
    let differ = format!(
        "data that were not used differ by {:.2} instead of {:.2} sigma.",
        shrink.after, shrink.before
    );
    // What rows alone show has no ceiling, for nothing of a model could come nearer to it.
    let is_by_rows = diagnosis.ceiling_percent.is_none();
    let because = |beside: &str| match is_by_rows {
        false => format!(
            "{gap}, because of {}{beside}. With {them} in the twin, {differ}",
            named()
        ),
        true => format!(
            "The rows of the log show {}{beside}. {gap}. With the calibration made anew, {differ}",
            named()
        ),
    };
    let put_right = match subject.gross.contradicted.is_empty() && subject.gross.wiring.is_empty() {
        true => "",
        false => "The table or the wiring is not as it was said; that was put right first. ",
    };
    let outcome = match diagnosis.outcome {
        Outcome::Clean => format!("Nothing is wrong that this log can show. {gap}: noise and calibration explain it."),
        Outcome::Recalibrate => format!("The calibration has to be made anew, and nothing else is wrong. {gap}."),
        Outcome::Named => because(""),
        Outcome::PartlyNamed if is_by_rows => because(", and something that is not known is there too"),
        Outcome::PartlyNamed => because(", and of something that is not known"),
        Outcome::Undecided => format!("{gap}, but no cause of that is likelier than not."),
        Outcome::Unknown => format!("{gap}, and no effect that is known explains it."),
    };
    format!("{put_right}{outcome}")
}

/// What, where, how sure, how much better, what to do.
pub fn rows(subject: &Subject, diagnosis: &Diagnosis, advice: &str) -> Vec<(String, String)> {
    let mut rows: Vec<(&str, String)> = Vec::new();
    for cause in &diagnosis.causes {
        rows.push(("what", what(cause)));
        rows.push((
            "where and when",
            format!(
                "{}; {}",
                subject.names(cause.channels.iter().copied()).join(" "),
                cause.when
            ),
        ));
        rows.push((
            "how sure",
            format!("probability {:.3}{}", cause.probability, doubt(cause)),
        ));
    }
    let others = diagnosis
        .alternatives
        .iter()
        .take(OTHERS)
        .filter(|(_, probability)| *probability > 0.0005);
    let others: Vec<String> = others
        .map(|(name, probability)| format!("{name} {probability:.3}"))
        .collect();
    let none = format!(
        "something that matters is unexplained: probability {:.3}",
        diagnosis.none_of_these
    );
    rows.push(match others.is_empty() {
        true => ("what else", none),
        false => ("what else", format!("{}; {none}", others.join(", "))),
    });
    let noise: Vec<String> = (diagnosis.noise.iter())
        .filter(|own| !own.words().is_empty())
        .map(|own| {
            format!(
                "{}: {} ({}{:.2} times what is declared)",
                own.kind.plural(),
                own.words().join(", "),
                if own.is_at_most() { "at most " } else { "" },
                own.seen / own.declared
            )
        })
        .collect();
    if !noise.is_empty() {
        rows.push(("noise", noise.join("; ")));
    }
    let shrink = &diagnosis.shrink;
    if !matches!(diagnosis.outcome, Outcome::Clean) {
        let words = gained(
            [shrink.before, shrink.after],
            shrink.percent,
            shrink.interval_percent,
            diagnosis.ceiling_percent,
        );
        rows.push((
            "how much better",
            format!(
                "held-out gap {:.3} to {:.3} sigma: {words}",
                shrink.before, shrink.after
            ),
        ));
        for stage in diagnosis.stages.iter().filter(|stage| stage.unit == "deg") {
            rows.push((
                "",
                format!("{}: {:.3} to {:.3} deg", stage.name, stage.before, stage.after),
            ));
        }
    }
    if let Some(cause) = diagnosis.causes.first() {
        rows.push(("how to be sure", cause.confirm_by.to_owned()));
    }
    rows.push(("what to do", advice.to_owned()));
    rows.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

fn what(cause: &Cause) -> String {
    let sizes = cause.parameters.iter().take(SAID_OF).map(|sized| {
        let (value, error) = (sized.value, 1.96 * sized.sigma);
        format!(
            "{} {value:.3e} ± {error:.0e}{}",
            sized.parameter.name,
            behind(sized.parameter.unit)
        )
    });
    let sizes: Vec<String> = sizes.collect();
    let more = match cause.parameters.len().saturating_sub(SAID_OF) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let sizes = match sizes.is_empty() {
        true => String::new(),
        false => format!(" ({}{more})", sizes.join(", ")),
    };
    format!("{} at {}: {}{sizes}", cause.effect, cause.locality, cause.physics)
}

fn doubt(cause: &Cause) -> &'static str {
    match cause.is_suspicious {
        true => "; more than five times its usual size, so it may stand for something else",
        false => "",
    }
}
