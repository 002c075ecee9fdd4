//! `verdict.json`, as the gap case's format has it.

use std::collections::BTreeMap;

use serde::Serialize;
use twin::predict::Kind;

use crate::{
    diagnose::Diagnosis, input::case::Subject, probability::outcome::Outcome, report::terminal,
    thresholds::MOST_OF_A_GAP,
};

/// The whole file.
#[derive(Debug, Serialize)]
pub struct Verdict {
    case: String,
    format: &'static str,
    gap: Gap,
    #[serde(rename = "where")]
    places: Vec<Place>,
    causes: Vec<Cause>,
    alternatives: Vec<Alternative>,
    indistinguishable: Vec<Vec<&'static str>>,
    none_of_these: f64,
    outcome: &'static str,
    remainder: Remainder,
    noise: Vec<Noise>,
    next_experiment: String,
    shrink: Shrink,
}

/// Of the sensors of a kind: what is declared of a logged sample, and what the log has beneath what is named.
#[derive(Debug, Serialize)]
struct Noise {
    sensor: Kind,
    /// `quieter` or `louder`, `coloured`, `repeated`; none where it is as declared.
    is: Vec<&'static str>,
    declared: f64,
    seen: f64,
    by_reference: f64,
    unit: &'static str,
    /// Least and most of seen over declared among the channels.
    ratio: [f64; 2],
    /// Of neighbouring samples; null where the reference errs more than the sensors scatter.
    correlation: Option<f64>,
    repeated: f64,
}

/// What is left beneath what is named.
#[derive(Debug, Serialize)]
struct Remainder {
    present: f64,
    log_bayes_factor: f64,
    what: String,
    channels: Vec<String>,
    size: Sized,
    sigma: Sized,
    attitude_deg: Option<Sized>,
    matters: f64,
}

#[derive(Debug, Serialize)]
struct Sized {
    /// If it is there.
    value: f64,
    /// From 5 %, whether it is there or not, to 95 % if it is.
    interval_90: [f64; 2],
    unit: &'static str,
}

#[derive(Debug, Serialize)]
struct Gap {
    before: f64,
    floor: f64,
    units: &'static str,
}

#[derive(Debug, Serialize)]
struct Place {
    channels: Vec<String>,
    share: f64,
    when: String,
}

#[derive(Debug, Serialize)]
struct Cause {
    effect: &'static str,
    channels: Vec<String>,
    probability: f64,
    parameters: BTreeMap<String, Parameter>,
}

/// A parameter of a cause, in `unit`.
#[derive(Debug, Serialize)]
pub(crate) struct Parameter {
    pub(crate) value: f64,
    pub(crate) sigma: f64,
    pub(crate) unit: &'static str,
}

/// Another effect that may be the cause.
#[derive(Debug, Serialize)]
pub(crate) struct Alternative {
    pub(crate) effect: &'static str,
    pub(crate) probability: f64,
}

#[derive(Debug, Serialize)]
struct Shrink {
    hold_before: f64,
    hold_recalibrated: f64,
    hold_after: f64,
    percent: f64,
    interval_percent: [f64; 2],
}

/// Rounds to so many decimals: what is beyond is noise, and a verdict is read.
pub(crate) fn rounded(value: f64, decimals: i32) -> f64 {
    let factor = 10f64.powi(decimals);
    (value * factor).round() / factor
}

impl Verdict {
    /// Of a diagnosis.
    pub fn new(subject: &Subject, diagnosis: &Diagnosis, next_experiment: String) -> Self {
        let mut places: Vec<Place> = diagnosis
            .causes
            .iter()
            .map(|cause| Place {
                channels: subject.names(cause.channels.iter().copied()),
                share: rounded(cause.share, 3),
                when: cause.when.clone(),
            })
            .collect();
        if diagnosis.outcome == Outcome::Unknown {
            places.extend(unexplained(diagnosis));
        }
        Verdict {
            case: subject.opened.text.name.clone(),
            format: "gap-verdict/2",
            gap: Gap {
                before: rounded(diagnosis.gap, 4),
                floor: rounded(diagnosis.shrink.floor, 4),
                units: "sigma",
            },
            places,
            causes: gross_causes(subject)
                .chain(diagnosis.causes.iter().map(|cause| of_cause(subject, cause)))
                .collect(),
            alternatives: diagnosis
                .alternatives
                .iter()
                .map(|(effect, probability)| Alternative {
                    effect,
                    probability: rounded(*probability, 4),
                })
                .collect(),
            indistinguishable: diagnosis.indistinguishable.clone(),
            none_of_these: rounded(diagnosis.none_of_these, 4),
            outcome: diagnosis.outcome.word(),
            remainder: remainder(subject, &diagnosis.remainder),
            noise: diagnosis.noise.iter().map(noise).collect(),
            next_experiment,
            shrink: Shrink {
                hold_before: rounded(diagnosis.shrink.before, 4),
                hold_recalibrated: rounded(diagnosis.shrink.recalibrated, 4),
                hold_after: rounded(diagnosis.shrink.after, 4),
                percent: rounded(diagnosis.shrink.percent, 2),
                interval_percent: diagnosis.shrink.interval_percent.map(|value| rounded(value, 2)),
            },
        }
    }
}

fn remainder(subject: &Subject, found: &crate::unknown::remainder::Remainder) -> Remainder {
    // Of a mixture of nothing and of what is there, the 5 % quantile is nothing unless that is there with 95 %.
    let is_there = found.present > 0.95;
    let sized = |[low, value, high]: [f64; 3], unit| Sized {
        value,
        interval_90: [if is_there { low } else { 0.0 }, high],
        unit,
    };
    Remainder {
        present: rounded(found.present, 4),
        log_bayes_factor: rounded(found.log_bayes_factor, 2),
        what: found.what.clone(),
        channels: subject.names(found.channels.iter().copied()),
        size: sized(found.size, found.unit),
        sigma: sized(found.sigma.map(|value| rounded(value, 4)), "sigma"),
        attitude_deg: (found.attitude_deg).map(|degrees| sized(degrees.map(|value| rounded(value, 4)), "deg")),
        matters: rounded(found.matters, 4),
    }
}

fn noise(found: &crate::null::noise::Noise) -> Noise {
    Noise {
        sensor: found.kind,
        is: found.words(),
        declared: found.declared,
        seen: found.seen,
        by_reference: found.by_reference,
        unit: found.kind.unit(),
        ratio: found.range.map(|ratio| rounded(ratio, 3)),
        correlation: (!found.is_at_most()).then(|| rounded(found.colour, 3)),
        repeated: rounded(found.repeated, 4),
    }
}

/// What was put right in a table. Contradictions of others that are as well supported share the probability.
fn gross_causes(subject: &Subject) -> impl Iterator<Item = Cause> {
    let gross = &subject.gross;
    let everything = 0..subject.twin.unit().channels.len();
    let commands = gross.contradicted.iter().map(|one| {
        let kept = move |axis: usize| one.reading.map_or(0.0, |reading| f64::from(reading.sign[axis]));
        let parameter = move |(axis, name): (usize, &str)| {
            let value = kept(axis);
            (
                format!("row {} {name}", one.seq),
                Parameter {
                    value,
                    sigma: 0.0,
                    unit: "1",
                },
            )
        };
        ["x", "y", "z"].into_iter().enumerate().map(parameter)
    });
    let parameters: BTreeMap<String, Parameter> = commands.flatten().collect();
    let commands = (!parameters.is_empty()).then(|| Cause {
        effect: "reference-sign",
        channels: subject.names(everything),
        probability: rounded(1.0 / (1.0 + gross.otherwise.len() as f64), 4),
        parameters,
    });
    commands.into_iter()
}

fn of_cause(subject: &Subject, cause: &crate::probability::cause::Cause) -> Cause {
    let parameters = cause.parameters.iter().map(|sized| {
        let parameter = Parameter {
            value: sized.value,
            sigma: sized.sigma,
            unit: sized.parameter.unit,
        };
        (sized.parameter.name.clone(), parameter)
    });
    Cause {
        effect: cause.effect,
        channels: subject.names(cause.channels.iter().copied()),
        probability: rounded(cause.probability, 4),
        parameters: parameters.collect(),
    }
}

/// Where an unexplained residual shows: the channels that hold most of the excess, and their share of it.
fn unexplained(diagnosis: &Diagnosis) -> Option<Place> {
    let (mut channels, mut share) = (Vec::new(), 0.0);
    for (name, part) in &diagnosis.place.channels {
        if share >= MOST_OF_A_GAP || *part <= 0.0 {
            break;
        }
        channels.push(name.clone());
        share += part;
    }
    let passage = diagnosis.place.passage.as_ref().map(terminal::when);
    let aspect = diagnosis.leftover.aspects.first().map(|aspect| aspect.what.clone());
    let when = [aspect, passage].into_iter().flatten().collect::<Vec<_>>().join("; ");
    (!channels.is_empty()).then(|| Place {
        channels,
        share: rounded(share, 3),
        when,
    })
}
