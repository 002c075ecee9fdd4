//! `verdict.json` of a log without a reference: `gap-verdict/2` with `"from": "parity"`.
//!
//! In: [`Findings`]. Out: the keys of the format that parity can fill. There is no `shrink`, for the held-out windows are
//! asked no more than how strong there a name is; `visible` and `not_visible` say what a silence means.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::{
    parity::{
        chips,
        findings::Findings,
        flight::Flight,
        lost::Loss,
        name::{By, Name},
        nulls::NULLS,
        phases::{self, Phase, Stretch},
        smooth::told::Told,
        text,
    },
    report::verdict::{self as report, Alternative, Parameter},
};

/// The whole file.
#[derive(Debug, Serialize)]
pub struct Verdict {
    case: String,
    format: &'static str,
    from: &'static str,
    gap: Gap,
    phases: Vec<Stretch>,
    phases_from: &'static str,
    /// Packets of the fit windows whose rate nobody knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    left_out: Option<usize>,
    /// Channels of a part that the motion is made without.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    motion_without: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    chips: Vec<serde_json::Value>,
    #[serde(skip_serializing_if = "serde_json::Map::is_empty")]
    motion_known: serde_json::Map<String, serde_json::Value>,
    attitude: Attitude,
    causes: Vec<Cause>,
    alternatives: Vec<Alternative>,
    none_of_these: f64,
    outcome: &'static str,
    visible: Vec<Visible>,
    /// Share of the packets after which a lost one would be found.
    #[serde(skip_serializing_if = "Option::is_none")]
    lost_packet_shows: Option<f64>,
    not_visible: Vec<NotVisible>,
    never_named: Vec<&'static str>,
    next_experiment: String,
}

/// Of the smoothed motion.
#[derive(Debug, Serialize)]
struct Attitude {
    is_settled: bool,
    /// Root mean square over the fit windows, all axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma_deg: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Gap {
    before: f64,
    after: f64,
    floor: f64,
    units: &'static str,
}

#[derive(Debug, Serialize)]
struct Cause {
    effect: &'static str,
    channels: Vec<String>,
    or_at: Vec<String>,
    probability: f64,
    by: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    only_in: Option<Phase>,
    parameters: BTreeMap<String, Parameter>,
    /// Packets that nobody counted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    losses: Vec<Loss>,
}

/// Ratios of an effect of usual size.
#[derive(Debug, Serialize)]
struct Visible {
    effect: &'static str,
    place: &'static str,
    with_reference: f64,
    by_parity: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    by_smoothing: Option<f64>,
    may_be_named: bool,
}

#[derive(Debug, Serialize)]
struct NotVisible {
    what: &'static str,
    settled_by: &'static str,
}

/// Four decimals.
fn rounded(value: f64) -> f64 {
    report::rounded(value, 4)
}

impl Verdict {
    /// Of findings, and what is told of the motion.
    pub fn new(flight: &Flight, findings: &Findings, told: &Told) -> Self {
        let cause = |name: &Name| Cause {
            effect: name.effect,
            channels: flight.names(&name.channels),
            or_at: name.or_at.clone(),
            probability: rounded(name.probability),
            by: match name.by {
                By::Codes => "codes",
                By::Axes => "axes",
                By::Turns => "turns",
                By::Parity => "evidence",
                By::Smoothing => "smoothing",
            },
            only_in: name.alone.map(|alone| alone.phase),
            parameters: (name.parameters.iter())
                .map(|sized| {
                    let parameter = Parameter {
                        value: sized.value,
                        sigma: sized.sigma,
                        unit: sized.parameter.unit,
                    };
                    (sized.parameter.name.clone(), parameter)
                })
                .collect(),
            losses: name.losses.clone(),
        };
        let visible = findings.visible.iter().map(|row| Visible {
            effect: row.effect,
            place: row.place,
            with_reference: rounded(row.with_reference),
            by_parity: rounded(row.snr),
            by_smoothing: row.smoothed.map(rounded),
            may_be_named: row.is_visible,
        });
        let alternative = |(effect, probability): &(&'static str, f64)| Alternative {
            effect,
            probability: rounded(*probability),
        };
        Self {
            case: flight.opened.text.name.clone(),
            format: "gap-verdict/2",
            from: "parity",
            gap: Gap {
                before: rounded(findings.gap[0]),
                after: rounded(findings.gap[1]),
                floor: 1.0,
                units: "sigma",
            },
            phases: phases::rounded(&flight.phases),
            phases_from: phases::told_by(flight.are_phases_told),
            left_out: Some(flight.unturned).filter(|rows| *rows > 0),
            motion_without: flight.names(&findings.bending),
            chips: chips::text::json(&findings.chips),
            motion_known: told.known_json(&flight.known),
            attitude: Attitude {
                is_settled: !told.attitudes.is_empty(),
                sigma_deg: told.sigma_deg().map(rounded),
            },
            causes: findings.names.iter().map(cause).collect(),
            alternatives: findings.alternatives.iter().map(alternative).collect(),
            none_of_these: rounded(findings.none_of_these),
            outcome: findings.outcome.word(),
            visible: visible.collect(),
            not_visible: (NULLS.iter())
                .map(|null| NotVisible {
                    what: null.what,
                    settled_by: null.settled_by,
                })
                .collect(),
            lost_packet_shows: findings.loss_shown.map(rounded),
            never_named: text::effects(&findings.visible).1,
            next_experiment: text::next(findings).trim_end().to_owned(),
        }
    }
}
