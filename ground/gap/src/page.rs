//! The verdict as one page that opens without a network: residuals before and after, where, which effect, what confuses.

use chart::{Axis, Block, ChartError, Figure, Layer, Map, Marks, Panel};

use crate::{
    case::Subject,
    diagnose::{Diagnosis, Trace},
    terminal,
};

/// Effects shown in the plot of evidence.
const SHOWN: usize = 16;

/// The page.
///
/// # Errors
/// When a plot cannot be drawn.
pub fn html(subject: &Subject, diagnosis: &Diagnosis, advice: &str) -> Result<String, ChartError> {
    let blocks = vec![
        Block::Terminal(terminal::screen(subject, diagnosis, advice)),
        Block::Figure(residuals(diagnosis)?),
        Block::Figure(map(diagnosis)?),
        Block::Figure(evidence(diagnosis)?),
        Block::Terminal(terminal::shrink(subject, diagnosis)),
        Block::Terminal(terminal::limits(diagnosis)),
    ];
    Ok(chart::html(
        &format!("Gap: {}", subject.opened.text.name),
        &subject.opened.text.about,
        &blocks,
    ))
}

/// Residuals of the channels that stand out most, before and after.
fn residuals(diagnosis: &Diagnosis) -> Result<Figure, ChartError> {
    let panel = |trace: &Trace| Panel {
        title: trace.name.clone(),
        x: Axis::linear("time [s]"),
        y: Axis::linear("residual [sigma]"),
        layers: vec![
            Layer::new("before", 1, Marks::Dots(trace.before.clone())),
            Layer::new("after", 0, Marks::Dots(trace.after.clone())),
        ],
    };
    let panels: Vec<Panel> = diagnosis.traces.iter().map(panel).collect();
    Figure::of("Residuals on the fit windows", 2, &panels)
}

/// Excess energy by channel and stretch of time, before and after.
fn map(diagnosis: &Diagnosis) -> Result<Figure, ChartError> {
    Figure::map(
        "Root mean square residual by channel and time, before: 0 for noise alone, 1 for three sigma and more",
        &Map {
            rows: diagnosis.cells.iter().map(|(name, _)| name.clone()).collect(),
            columns: (1..=diagnosis.cells.first().map_or(0, |(_, cells)| cells.len()))
                .map(|stretch| stretch.to_string())
                .collect(),
            values: diagnosis
                .cells
                .iter()
                .map(|(_, cells)| cells.iter().map(|gap| ((gap - 1.0) / 2.0).clamp(0.0, 1.0)).collect())
                .collect(),
        },
    )
}

fn evidence(diagnosis: &Diagnosis) -> Result<Figure, ChartError> {
    let bars: Vec<(f64, f64)> = diagnosis
        .alone
        .iter()
        .take(SHOWN)
        .enumerate()
        .map(|(place, (_, gain))| (place as f64 + 1.0, *gain))
        .collect();
    let names: Vec<String> = diagnosis
        .alone
        .iter()
        .take(SHOWN)
        .enumerate()
        .map(|(place, (name, _))| format!("{} {name}", place + 1))
        .collect();
    let panel = Panel {
        title: names.join(", "),
        x: Axis::linear("effect"),
        y: Axis::linear("evidence alone [nats]"),
        layers: vec![Layer::new("log evidence over nothing", 0, Marks::Bars(bars))],
    };
    Figure::of("Evidence of each effect alone, prior odds paid", 1, &[panel])
}
