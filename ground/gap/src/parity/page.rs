//! The findings as one page that opens without a network: the screen, what can be seen, what cannot, where the gap is.

use chart::{Block, ChartError, Figure, Map};

use crate::parity::{findings::Findings, flight::Flight, nulls::NULLS, text};

/// The page.
///
/// # Errors
/// When a plot cannot be drawn.
pub fn html(flight: &Flight, findings: &Findings) -> Result<String, ChartError> {
    let nulls = NULLS
        .iter()
        .map(|null| vec![null.what.to_owned(), null.settled_by.to_owned()]);
    let blocks = [
        Block::Terminal(text::screen(flight, findings)),
        Block::Heading("What parity shows of each effect".to_owned()),
        Block::Terminal(text::visibility(findings)),
        Block::Heading("What no redundancy can show".to_owned()),
        Block::Table {
            columns: ["not seen", "what would settle it"].map(str::to_owned).to_vec(),
            rows: nulls.collect(),
        },
        Block::Figure(channels(findings)?),
    ];
    let title = format!("Gap without a reference: {}", flight.opened.text.name);
    Ok(chart::html(&title, &flight.opened.text.about, &blocks))
}

/// Gap of each channel, before.
fn channels(findings: &Findings) -> Result<Figure, ChartError> {
    Figure::map(
        "What the other channels do not explain of each: 0 is noise alone, 100 is three sigma or more",
        &Map {
            rows: findings.channels.iter().map(|(name, _)| name.clone()).collect(),
            columns: vec!["fit windows".to_owned()],
            values: (findings.channels.iter())
                .map(|(_, gap)| vec![((gap - 1.0) / 2.0).clamp(0.0, 1.0)])
                .collect(),
        },
    )
}
