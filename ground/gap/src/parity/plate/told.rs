//! The texts of one plate, by file name: verdict, screen, page, attitude.

use chart::{Axis, Block, ChartError, Figure, Layer, Marks, Panel};
use serde_json::json;
use twin::effect::LIBRARY;

use crate::{
    parity::{
        flight::Flight,
        nulls::NULLS,
        phases,
        plate::{CAN_BE_NAMED, Findings, attitude::attitude, filter::At, text},
    },
    report::verdict::rounded,
};

/// Probability of a name, and that something which matters is left where that is said. Knocks and lines have no likelihood, so this is
/// Laplace's rule of succession, (right + 1) / (all + 2), for the nine names that fourteen recordings were given, all of them right
/// (docs/gap/without-reference.md).
const SAID: f64 = 10.0 / 11.0;

/// The same that something is left where nothing is said: three of the fourteen had more than was named.
const UNSAID: f64 = 4.0 / 16.0;

/// \[uT\] that are drawn: a thousandth of a magnetometer's step.
const LEAST_UT: f64 = 1e-4;

/// The verdict as it is written: `gap-verdict/2` with `"from": "one-plate"`.
pub fn verdict(flight: &Flight, findings: &Findings) -> serde_json::Value {
    let outcome = findings.outcome(flight);
    let cause = |name: super::Name| {
        json!({
            "effect": name.effect, "channels": name.channels, "or_at": [], "probability": rounded(SAID, 4),
            "by": "one-plate", "parameters": {}, "seen": name.seen,
        })
    };
    let is_off = findings.is_unexplained() || !findings.is_about_a_place();
    let untold = findings.untold();
    let share = 1.0 / untold.len().max(1) as f64;
    let alternative = |effect: &&str| json!({ "effect": effect, "probability": share });
    let [before, after] = findings.gap.map(|gap| rounded(gap, 4));
    let [plate, room] = findings.weighed.gains.map(|gain| rounded(gain, 1));
    let never: Vec<&str> = (LIBRARY.iter().map(|own| own.page().name))
        .filter(|name| !CAN_BE_NAMED.contains(name))
        .collect();
    json!({
        "case": flight.opened.text.name,
        "format": "gap-verdict/2",
        "from": "one-plate",
        "gap": { "before": before, "after": after, "floor": 1.0, "units": "sigma" },
        "phases": phases::rounded(&flight.phases),
        "phases_from": phases::told_by(flight.are_phases_told),
        "causes": findings.names(flight).into_iter().map(cause).collect::<Vec<_>>(),
        "alternatives": untold.iter().map(alternative).collect::<Vec<_>>(),
        "none_of_these": rounded(if is_off { SAID } else { UNSAID }, 4),
        "outcome": outcome.word(),
        "field_nats": { "fixed_to_plate": plate, "stays_in_room": room },
        "visible": [],
        "not_visible": NULLS.iter().map(|own| json!({ "what": own.what, "settled_by": own.settled_by })).collect::<Vec<_>>(),
        "never_named": never,
        "next_experiment": text::next(flight, findings),
    })
}

/// The page.
///
/// # Errors
/// When a plot cannot be drawn.
pub fn html(flight: &Flight, findings: &Findings) -> Result<String, ChartError> {
    let nulls = NULLS
        .iter()
        .map(|null| vec![null.what.to_owned(), null.settled_by.to_owned()]);
    let mut blocks = vec![
        Block::Lead(text::lead(flight, findings)),
        Block::Terminal(text::screen(flight, findings)),
        Block::Heading("What one plate cannot show".to_owned()),
        Block::Table {
            columns: ["not seen", "what would settle it"].map(str::to_owned).to_vec(),
            rows: nulls.collect(),
        },
    ];
    if findings.sensors.has_field() && findings.is_about_a_place() {
        blocks.push(Block::Figure(added(&findings.field)?));
    }
    blocks.extend(attitude(findings).figure()?.map(Block::Figure));
    let title = format!("Gap without a reference: {}", flight.opened.text.name);
    Ok(chart::html(&title, &flight.opened.text.about, &blocks))
}

/// What is added to the field, in the frame of each.
fn added(nodes: &[At]) -> Result<Figure, ChartError> {
    let lines = |of: &dyn Fn(&At) -> nalgebra::Vector3<f64>| -> Vec<Layer> {
        let names = ["x", "y", "z"];
        let line = |axis: usize| Marks::Line(nodes.iter().map(|at| (at.t_s, of(at)[axis])).collect());
        (0..3).map(|axis| Layer::new(names[axis], axis, line(axis))).collect()
    };
    let panel = |y: &str, layers: Vec<Layer>| Panel {
        x: Axis::linear("time [s]"),
        y: Axis::linear(y),
        layers,
        ..Panel::default()
    };
    // The best model may have nothing in one of the frames, and then exactly: an axis without a scale.
    let seen = |of: &dyn Fn(&At) -> nalgebra::Vector3<f64>| nodes.iter().any(|at| of(at).amax() > LEAST_UT);
    let mut panels = vec![panel("fixed to the plate, in b [uT]", lines(&At::iron))];
    if seen(&At::beside) {
        panels.push(panel("stays in the room, in n [uT]", lines(&At::beside)));
    }
    Figure::of("What is added to the field, along the best model", 1, &panels)
}
