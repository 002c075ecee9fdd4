//! The verdict as one page that opens without a network: in plain words, as the screen has it, and then residuals before and
//! after, where, which effect, what confuses.

use chart::{Axis, Block, ChartError, Figure, Layer, Map, Marks, Panel};

use crate::{
    diagnose::Diagnosis,
    input::case::Subject,
    report::{place_shares, plain, terminal},
    unknown::traces::Trace,
};

/// Rows of a map of probabilities.
const SHOWN: usize = 10;

/// Rows of a table of shares.
const SHARES: usize = 8;

/// The page.
///
/// # Errors
/// When a plot cannot be drawn.
pub fn html(subject: &Subject, diagnosis: &Diagnosis, advice: &str) -> Result<String, ChartError> {
    let mut blocks = vec![
        Block::Lead(plain::sentence(subject, diagnosis)),
        Block::Rows(plain::rows(subject, diagnosis, advice)),
        Block::Heading("As the terminal has it".to_owned()),
        Block::Terminal(terminal::screen(subject, diagnosis, advice)),
        Block::Figure(residuals(diagnosis)?),
        Block::Heading("Where".to_owned()),
        Block::Text(
            "Channels and plates: shares of the energy above noise, as the map below shows it. Octaves: of what is above noise and \
             calibration. Regimes: what a quantity of the motion explains of the energy from row to row (LMG). Each column adds \
             up to 100 %."
                .to_owned(),
        ),
        shares(subject, diagnosis),
        Block::Figure(map(diagnosis)?),
        Block::Terminal(terminal::places(subject, diagnosis)),
        Block::Figure(posterior(diagnosis)?),
    ];
    if diagnosis.imitation.effects.len() > 1 {
        blocks.push(Block::Figure(confusability(diagnosis)?));
    }
    blocks.extend([
        Block::Heading("Shrink on held-out data".to_owned()),
        Block::Terminal(terminal::shrink(subject, diagnosis)),
        Block::Heading("Detection limits".to_owned()),
        Block::Terminal(terminal::limits(diagnosis)),
    ]);
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

/// Shares of the excess side by side.
fn shares(subject: &Subject, diagnosis: &Diagnosis) -> Block {
    let place = &diagnosis.place;
    let columns = [
        ("channel", &place_shares::channels(diagnosis)),
        ("plate", &place_shares::groups(subject, diagnosis)),
        ("octave", &place.octaves),
        ("regime", &place.regimes),
    ];
    let longest = columns.iter().map(|(_, parts)| parts.len()).max().unwrap_or(0);
    let cell = |parts: &[(String, f64)], row: usize| match parts.get(row) {
        Some((name, share)) => format!("{:.0} % {name}", 100.0 * share),
        None => String::new(),
    };
    Block::Table {
        columns: columns.iter().map(|(name, _)| (*name).to_owned()).collect(),
        rows: (0..longest.min(SHARES + 1))
            .map(|row| columns.iter().map(|(_, parts)| cell(parts, row)).collect())
            .collect(),
    }
}

/// Excess energy by channel and stretch of time, before.
fn map(diagnosis: &Diagnosis) -> Result<Figure, ChartError> {
    Figure::map(
        "Residual by channel and twentieth of the fit windows, nominal twin: 0 is noise alone, 100 is three sigma or more",
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

/// What is probable: causes, alternatives, none of these.
fn posterior(diagnosis: &Diagnosis) -> Result<Figure, ChartError> {
    let causes = diagnosis.causes.iter().map(|cause| (cause.effect, cause.probability));
    let others = diagnosis.alternatives.iter().copied();
    let mut rows: Vec<(&str, f64)> = causes.chain(others).take(SHOWN).collect();
    rows.push(("none of these", diagnosis.none_of_these));
    Figure::map(
        "Probability of each cause [%]; several may be there at once",
        &Map {
            rows: rows.iter().map(|(name, _)| (*name).to_owned()).collect(),
            columns: vec!["probability".to_owned()],
            values: rows.iter().map(|(_, probability)| vec![*probability]).collect(),
        },
    )
}

/// Which effect can be mistaken for which.
fn confusability(diagnosis: &Diagnosis) -> Result<Figure, ChartError> {
    let imitation = &diagnosis.imitation;
    let names: Vec<String> = imitation.effects.iter().map(|name| (*name).to_owned()).collect();
    let columns = (1..=names.len()).map(|number| number.to_string()).collect();
    let rows = names.iter().enumerate().map(|(at, name)| format!("{} {name}", at + 1));
    Figure::map(
        "Confusability: of the row's energy on this motion, how much the column's effect can imitate [%]",
        &Map {
            rows: rows.collect(),
            columns,
            values: imitation.shares.clone(),
        },
    )
}
