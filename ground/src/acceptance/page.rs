//! The findings for people and programs: lines for the terminal, one page, JSON.

use std::fmt::Write;

use chart::{Axis, Block, ChartError, Figure, Layer, Marks, Panel};
use nalgebra::Vector3;
use packets::channel::GYRO_LSB;

use super::{
    evidence::{Evidence, forces_b},
    judge::{Finding, Outcome, arrivals},
};

/// Lines for the terminal: every finding, what to check below those that fail, and the verdict.
pub fn text(outcome: &Outcome) -> String {
    let name = |finding: &Finding| format!("{}, {}", finding.part, finding.what);
    let width = outcome
        .findings
        .iter()
        .map(|finding| name(finding).chars().count())
        .max()
        .unwrap_or(0);
    let mut text = String::new();
    for finding in &outcome.findings {
        let mark = if finding.good { "ok " } else { "NOT" };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{mark} {:width$}  {}  ({})",
            name(finding),
            finding.measured,
            finding.limit
        );
        if !finding.good {
            let _ = writeln!(text, "      check: {}", finding.check);
        }
    }
    let _ = writeln!(text, "{}", verdict(outcome));
    text
}

/// The answer in one line.
pub fn verdict(outcome: &Outcome) -> String {
    let bad: Vec<&Finding> = outcome.findings.iter().filter(|finding| !finding.good).collect();
    let all = outcome.findings.len();
    match bad.first() {
        None => format!("good: {all} lines"),
        Some(first) => format!(
            "not good: {} of {all} lines; begin with {}: {}",
            bad.len(),
            first.part,
            first.check
        ),
    }
}

/// For programs.
pub fn json(outcome: &Outcome) -> serde_json::Value {
    let line = |finding: &Finding| {
        serde_json::json!({
            "part": finding.part,
            "what": finding.what,
            "measured": finding.measured,
            "limit": finding.limit,
            "good": finding.good,
            "check": if finding.good { "" } else { finding.check.as_str() },
        })
    };
    serde_json::json!({
        "good": outcome.is_good(),
        "verdict": verdict(outcome),
        "lines": outcome.findings.iter().map(line).collect::<Vec<_>>(),
    })
}

/// The page.
///
/// # Errors
/// When the plotting library refuses.
pub fn html(outcome: &Outcome, evidence: &Evidence, unit: &str, about: &str) -> Result<String, ChartError> {
    let cells = |finding: &Finding| {
        vec![
            if finding.good { "ok" } else { "NOT" }.to_owned(),
            finding.part.clone(),
            finding.what.to_owned(),
            finding.measured.clone(),
            finding.limit.clone(),
        ]
    };
    let bad = outcome.findings.iter().filter(|finding| !finding.good);
    let to_check: Vec<(String, String)> = bad
        .map(|finding| {
            (
                format!("{}, {}", finding.part, finding.what),
                format!("{}. Check: {}", finding.measured, finding.check),
            )
        })
        .collect();
    let mut blocks = vec![Block::Rows(vec![("verdict".into(), verdict(outcome))])];
    if !to_check.is_empty() {
        blocks.push(Block::Heading("What to check on the board".into()));
        blocks.push(Block::Rows(to_check));
    }
    blocks.push(Block::Heading("Every line".into()));
    blocks.push(Block::Table {
        columns: ["", "part", "what", "measured", "limit"].map(String::from).to_vec(),
        rows: outcome.findings.iter().map(cells).collect(),
    });
    if !evidence.packets.is_empty() {
        blocks.push(Block::Figure(picture(evidence)?));
    }
    Ok(chart::html(&format!("Acceptance of {unit}"), about, &blocks))
}

/// What the sensors felt, and when the packets came.
fn picture(evidence: &Evidence) -> Result<Figure, ChartError> {
    let axis = |axis: usize| {
        let layer = |plate: usize| {
            let points = evidence.packets.iter().filter_map(|packet| {
                let forces = forces_b(&packet.reading);
                // Plates that are not read are not in the list: then nobody knows whose the others are.
                let force: Option<&Vector3<f64>> = forces.get(plate).filter(|_| forces.len() == 4);
                Some((packet.at_s, force?[axis]))
            });
            Layer::new(format!("plate {}", plate + 1), plate, Marks::Line(points.collect()))
        };
        Panel {
            title: format!("specific force along {}", ["x", "y", "z"][axis]),
            x: Axis::linear("s"),
            y: Axis::linear("m/s²"),
            layers: (0..4).map(layer).collect(),
        }
    };
    let gyros = |plate: usize| {
        let read = evidence
            .packets
            .iter()
            .filter(|packet| packet.reading.gyro[plate] != emems::sample::NOT_READ);
        let points = read.map(|packet| {
            (
                packet.at_s,
                f64::from(packet.reading.gyro[plate]) * GYRO_LSB.to_degrees(),
            )
        });
        Layer::new(format!("plate {}", plate + 1), plate, Marks::Line(points.collect()))
    };
    let rates = Panel {
        title: "gyros, each about its own axis".into(),
        x: Axis::linear("s"),
        y: Axis::linear("deg/s"),
        layers: (0..4).map(gyros).collect(),
    };
    let off = arrivals(evidence).map(|(_, off)| off).unwrap_or_default();
    let late = Panel {
        title: "arrival of the packets, off an even period".into(),
        x: Axis::linear("packet"),
        y: Axis::linear("ms"),
        layers: vec![Layer::new(
            "",
            0,
            Marks::Dots(off.into_iter().map(|(n, off_s)| (n, 1e3 * off_s)).collect()),
        )],
    };
    Figure::of("What was felt", 2, &[axis(0), axis(1), axis(2), rates, late])
}
