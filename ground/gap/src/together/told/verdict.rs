//! `verdict.json` of several logs: `gap-verdict/2` with `"from": "together"`.
//!
//! In: the logs and [`Found`]. Out: the keys of the format; beside them `logs` with the gap of each, of a cause `by_log` and `agreement`,
//! and `contradicted`, causes about which the logs contradict each other. Who reads verdicts finds causes, alternatives and the outcome where they
//! always are.

use serde_json::{Map, Value, json};

use crate::{
    parity::name::By,
    report::verdict::rounded,
    together::{
        cause::{Cause, Share},
        found::Found,
        joint::Apart,
        log::Logged,
        shown::Visible,
        told,
    },
};

/// The whole file.
pub fn verdict(logs: &[Logged], found: &Found) -> Value {
    let four = |value: f64| rounded(value, 4);
    let root_mean_square = |which: usize| {
        let squares: f64 = found.gaps.iter().map(|gap| gap[which].powi(2)).sum();
        four((squares / found.gaps.len().max(1) as f64).sqrt())
    };
    let log = |(at, log): (usize, &Logged)| {
        json!({
            "case": log.name,
            "folder": log.path.display().to_string(),
            "from": if log.has_reference() { "reference" } else { "parity" },
            "is_followed": found.followed[at],
            "gap": { "before": four(found.gaps[at][0]), "after": four(found.gaps[at][1]) },
        })
    };
    let coded = found.coded.iter().map(|own| {
        json!({
            "effect": own.effect, "channels": own.channels, "or_at": [], "probability": 0.99, "by": "codes",
            "logs": own.logs.iter().map(|at| at + 1).collect::<Vec<_>>(), "parameters": {},
        })
    });
    let visible = |row: &Visible| {
        let each: Vec<f64> = row.each.iter().map(|snr| four(*snr)).collect();
        json!({
            "effect": row.together.effect, "place": row.together.place, "by_log": each,
            "together": four(row.together.snr), "may_be_named": row.together.is_visible,
        })
    };
    let names: Vec<&str> = logs.iter().map(|log| log.name.as_str()).collect();
    let alternatives = found.alternatives.iter();
    json!({
        "case": names.join(" + "),
        "format": "gap-verdict/2",
        "from": "together",
        "logs": logs.iter().enumerate().map(log).collect::<Vec<_>>(),
        "gap": { "before": root_mean_square(0), "after": root_mean_square(1), "floor": 1.0, "units": "sigma" },
        "causes": coded.chain(found.causes.iter().map(cause)).collect::<Vec<_>>(),
        "contradicted": found.contradicted.iter().map(cause).collect::<Vec<_>>(),
        "alternatives": alternatives
            .map(|(effect, probability)| json!({ "effect": effect, "probability": four(*probability) }))
            .collect::<Vec<_>>(),
        "none_of_these": four(found.none_of_these),
        "outcome": found.outcome.word(),
        "visible": found.visible.iter().map(visible).collect::<Vec<_>>(),
        "next_experiment": told::next(found).trim_end(),
    })
}

fn parameters(share: &Share) -> Value {
    let each = share.parameters.iter().map(|sized| {
        let own = json!({ "value": sized.value, "sigma": sized.sigma, "unit": sized.parameter.unit });
        (sized.parameter.name.clone(), own)
    });
    Value::Object(each.collect::<Map<String, Value>>())
}

fn cause(cause: &Cause) -> Value {
    let each = cause.each.iter().map(|share| {
        json!({ "ratio": rounded(share.snr, 4), "nats": rounded(share.gain, 2), "parameters": parameters(share) })
    });
    let apart = |apart: &Apart| {
        json!({
            "chi_square": rounded(apart.chi_square, 3), "degrees_of_freedom": rounded(apart.free, 2),
            "chance": apart.chance, "part": rounded(apart.part, 4),
        })
    };
    json!({
        "effect": cause.effect,
        "channels": cause.channels,
        "or_at": cause.or_at,
        "probability": rounded(cause.probability, 4),
        "by": if cause.by == By::Smoothing { "smoothing" } else { "evidence" },
        "nats": rounded(cause.all.gain, 2),
        "parameters": parameters(&cause.all),
        "by_log": each.collect::<Vec<_>>(),
        "agreement": cause.apart.as_ref().map(apart),
    })
}
