//! The findings as one page that opens without a network: the screen, what can be seen, what cannot, where the gap is.

use chart::{Block, ChartError, Figure, Map};

use crate::{
    parity::{findings::Findings, flight::Flight, name::Name, nulls::NULLS, smooth::told::Told, text},
    probability::outcome::Outcome,
};

/// The page.
///
/// # Errors
/// When a plot cannot be drawn.
pub fn html(flight: &Flight, findings: &Findings, told: &Told) -> Result<String, ChartError> {
    let nulls = NULLS
        .iter()
        .map(|null| vec![null.what.to_owned(), null.settled_by.to_owned()]);
    let mut blocks = vec![
        Block::Lead(sentence(flight, findings)),
        Block::Terminal(text::screen(flight, findings, told)),
        Block::Heading("What parity shows of each effect".to_owned()),
        Block::Terminal(text::visibility(findings)),
        Block::Heading("What no redundancy can show".to_owned()),
        Block::Table {
            columns: ["not seen", "what would settle it"].map(str::to_owned).to_vec(),
            rows: nulls.collect(),
        },
        Block::Figure(channels(findings)?),
    ];
    blocks.extend(told.figure()?.map(Block::Figure));
    blocks.extend(told.track_figure()?.map(Block::Figure));
    let title = format!("Gap without a reference: {}", flight.opened.text.name);
    Ok(chart::html(&title, &flight.opened.text.about, &blocks))
}

/// What it comes to.
fn sentence(flight: &Flight, findings: &Findings) -> String {
    let (lost, named): (Vec<&Name>, Vec<&Name>) = findings.names.iter().partition(|name| !name.losses.is_empty());
    let because = || {
        let each = named.iter().map(|name| match name.locality.as_str() {
            "" => format!("{} at {}", name.effect, flight.names(&name.channels).join(" ")),
            place => format!("{} at {place}", name.effect),
        });
        each.collect::<Vec<_>>().join(", and ")
    };
    let lost = match lost.is_empty() {
        true => "",
        false => "Packets were lost that nobody counted. ",
    };
    let said = match findings.outcome {
        Outcome::Clean => "The sensors agree with each other".to_owned(),
        Outcome::Recalibrate => "The sensors agree with each other once their calibration is made anew".to_owned(),
        Outcome::Named if named.is_empty() => "The sensors agree with each other".to_owned(),
        Outcome::Named => format!("The sensors disagree because of {}", because()),
        Outcome::PartlyNamed if named.is_empty() => {
            "The sensors disagree because of something that is not known".to_owned()
        }
        Outcome::PartlyNamed => format!(
            "The sensors disagree because of {}, and of something that is not known",
            because()
        ),
        Outcome::Undecided => "The sensors disagree, but no cause of that is likelier than not".to_owned(),
        Outcome::Unknown => {
            "The sensors disagree, or the motion was not followed closely enough; no known effect explains it"
                .to_owned()
        }
    };
    let left_out = match flight.unturned {
        0 => String::new(),
        rows => format!(" Of {rows} packets that were left out nothing is said."),
    };
    format!(
        "{lost}{said}: {:.2} sigma, where 1 is noise and calibration alone. Without a reference, what all sensors share cannot be seen.{left_out}",
        findings.gap[0]
    )
}

/// Gap of each channel, before.
fn channels(findings: &Findings) -> Result<Figure, ChartError> {
    Figure::map(
        "What the other channels do not explain of each: 0 is noise alone, 100 is three sigma or more",
        &Map {
            rows: findings.channels.iter().map(|own| own.name.clone()).collect(),
            columns: vec!["fit windows".to_owned()],
            values: (findings.channels.iter())
                .map(|own| vec![((own.gap - 1.0) / 2.0).clamp(0.0, 1.0)])
                .collect(),
        },
    )
}
