//! A flight as figures: every sensor, attitude, spectra, the packet period and the slot times, with events as marks.
//!
//! In: a [`Record`], and in simulation the true attitude. Out: [`Block`]s of a page. Values are nominal SI; plates share an axis, so
//! that one that disagrees is seen. Where a bin holds several packets, its least and most are joined, so a peak is never drawn away.

pub mod attitude;
pub mod times;

use chart::{Axis, Block, ChartError, Figure, Layer, Marks, Panel};
use nalgebra::{UnitQuaternion, Vector3};
use packets::channel::{CHANNELS, Quantity};

use crate::{
    envelope::Bin, events::Events, record::Record, recording::Row, spectra::Spectra, summary::Summary,
    table::SLOT_NAMES,
};
use times::Times;

/// A channel that hardly changes is not blown up beyond this many counts.
const LEAST_SPAN_LSB: f64 = 12.0;

/// Events in the table, and as marks along an axis.
const LISTED: usize = 60;
const MARKED: usize = 25;

// Colours beyond those of x, y, z.
const PINK: usize = 3;
const ORANGE: usize = 4;
const LIGHT_BLUE: usize = 5;
const GREY: usize = 6;

/// What the sensors' figures show: title, quantities, names of their lines.
pub const SENSORS: [(&str, &[Quantity], &[&str]); 4] = [
    ("Accelerometers", &[Quantity::SpecificForce], &["x", "y", "z"]),
    ("Magnetometers", &[Quantity::Field], &["x", "y", "z"]),
    ("Gyros", &[Quantity::Rate], &["rate"]),
    (
        "Temperatures",
        // The quieter one is drawn last, on top.
        &[Quantity::GyroTemperature, Quantity::Temperature],
        &["gyro", "plate"],
    ),
];

/// The true attitude `q_nb` at a time of the log \[s\].
pub type Truth<'a> = &'a dyn Fn(f64) -> UnitQuaternion<f64>;

/// All that a page shows of a flight; nothing for one without packets.
///
/// # Errors
/// When a figure cannot be drawn.
pub fn blocks(record: &Record, cycle_s: f64, truth: Option<Truth>) -> Result<Vec<Block>, ChartError> {
    if record.envelope.bins().is_empty() {
        return Ok(Vec::new());
    }
    let times = Times::of(&record.envelope, cycle_s, 0.0);
    let marks = marks(&record.events, &times);
    let mut blocks = events(&record.events, &times);
    for (title, quantities, names) in SENSORS {
        let panels: Vec<Panel> = (0..4)
            .map(|plate| sensors(&times, plate, quantities, names, &marks))
            .collect();
        blocks.push(Block::Figure(Figure::of(title, 2, &panels)?));
    }
    blocks.extend(attitude(record, &times, truth)?);
    blocks.extend(spectra(&record.spectra, cycle_s)?.map(Block::Figure));
    if record.summary.period_s.count > 0 {
        blocks.push(Block::Figure(period(&times, &record.summary, &marks)?));
    }
    if record.summary.derived > 0 {
        blocks.push(Block::Figure(slots(&record.summary)?));
    }
    Ok(blocks)
}

/// Events as a table.
fn events(events: &Events, times: &Times) -> Vec<Block> {
    let (all, left_out) = events.all();
    if all.is_empty() {
        return Vec::new();
    }
    let time = |number: u64| format!("{:.1}", number as f64 * times.cycle_s);
    let rows = all.iter().take(LISTED).map(|event| {
        let until = if event.until > event.number {
            time(event.until)
        } else {
            String::new()
        };
        vec![time(event.number), until, event.what.clone()]
    });
    let table = Block::Table {
        columns: ["from [s]", "to [s]", "what"].map(str::to_string).to_vec(),
        rows: rows.collect(),
    };
    let mut blocks = vec![Block::Heading("Events".into()), table];
    let more = all.len().saturating_sub(LISTED) + left_out;
    if more > 0 {
        blocks.push(Block::Text(format!(
            "and {more} more; log.txt has what was missed or broken"
        )));
    }
    blocks
}

/// The first events as marks along an axis: what tells phases apart first.
pub fn marks(events: &Events, times: &Times) -> Vec<(f64, String)> {
    let (mut all, _) = events.all();
    // Those that are no sensor's are few, and seen first.
    all.sort_by_key(|event| {
        (
            event.what.ends_with("clipped") || event.what.ends_with("silent"),
            event.number,
        )
    });
    let mut marks: Vec<(f64, String)> = (all.into_iter().take(MARKED))
        .map(|event| (times.at(event.number as f64), event.what))
        .collect();
    marks.sort_by(|one, other| one.0.total_cmp(&other.0));
    marks
}

/// A plate's sensors of some quantities.
pub fn sensors(times: &Times, plate: usize, quantities: &[Quantity], names: &[&str], marks: &[(f64, String)]) -> Panel {
    let unit = quantities.first().map_or("", |quantity| quantity.unit());
    let mut indices: Vec<usize> = (0..CHANNELS.len())
        .filter(|index| CHANNELS[*index].plate == plate && quantities.contains(&CHANNELS[*index].quantity))
        .collect();
    indices.sort_by_key(|index| {
        quantities
            .iter()
            .position(|wanted| *wanted == CHANNELS[*index].quantity)
    });
    let slots = indices
        .iter()
        .fold(0, |bits, index| bits | 1u16 << CHANNELS[*index].slot());
    let lsb = quantities.iter().map(|quantity| quantity.scale().0).fold(0.0, f64::max);
    let lines = (indices.iter().zip(names).enumerate())
        .map(|(colour, (index, name))| Layer::new(*name, colour, Marks::Line(times.line(|bin| si_range(bin, *index)))));
    let strip = |name: &str, colour, spans| Layer::new(name, colour, Marks::Strip(spans));
    let mut layers = vec![Layer::new(
        "micro-gravity",
        LIGHT_BLUE,
        Marks::Spans(times.micro_g.clone()),
    )];
    layers.extend(lines);
    layers.extend([
        strip("sensor failed", PINK, times.spans(|bin| bin.failed & slots != 0)),
        strip("packet missed", GREY, times.missed.clone()),
        strip(
            "at the end of its range",
            ORANGE,
            times.spans(|bin| bin.clipped & slots != 0),
        ),
        Layer::new("events", GREY, Marks::Instants(marks.to_vec())),
    ]);
    layers.retain(is_anything);
    Panel {
        title: format!("plate {}", plate + 1),
        x: times.axis(),
        y: Axis::linear(format!("[{unit}]"))
            .shared()
            .at_least(LEAST_SPAN_LSB * lsb),
        layers,
    }
}

/// A line without points has its place in the legend all the same; a mark of what never happened has none.
fn is_anything(layer: &Layer) -> bool {
    match &layer.marks {
        Marks::Spans(spans) | Marks::Strip(spans) => !spans.is_empty(),
        Marks::Instants(instants) => !instants.is_empty(),
        _ => true,
    }
}

/// Attitude, and in simulation its error.
fn attitude(record: &Record, times: &Times, truth: Option<Truth>) -> Result<Vec<Block>, ChartError> {
    let Some(follow) = &record.attitude else {
        return Ok(Vec::new());
    };
    let flight = follow.flight(times.cycle_s);
    if flight.estimates.is_empty() {
        return Ok(vec![
            Block::Heading("Attitude".into()),
            Block::Text(
                "none was found: it takes a second of three gyros, specific force near one g and a field not along it"
                    .into(),
            ),
        ]);
    }
    let at = |t_s: f64, truth: Truth| Row {
        t_s,
        rate_b: Vector3::zeros(),
        acc_b: None,
        mag_b: None,
        reference_nb: Some(truth(t_s)),
        scored: true,
    };
    let rows: Option<Vec<Row>> = truth.map(|truth| {
        let instants = flight
            .estimates
            .iter()
            .flat_map(|estimate| estimate.triad_nb.map(|(t_s, _)| t_s).into_iter().chain([estimate.t_s]));
        let mut instants: Vec<f64> = instants.collect();
        instants.sort_by(f64::total_cmp);
        instants.into_iter().map(|t_s| at(t_s, truth)).collect()
    });
    let figures = attitude::attitude(&flight, rows.as_deref(), &times.clock)?;
    let about = match truth {
        Some(_) => format!("{} The reference is the motion that was flown.", follow.about()),
        None => follow.about(),
    };
    let mut blocks: Vec<Block> = figures.map(Block::Figure).collect();
    blocks.push(Block::Text(about));
    Ok(blocks)
}

/// Amplitude densities.
fn spectra(spectra: &Spectra, cycle_s: f64) -> Result<Option<Figure>, ChartError> {
    let panel = |title: &str, quantity: Quantity| {
        let lines = spectra.lines(quantity);
        let layers = lines.into_iter().enumerate().map(|(colour, (name, density))| {
            let shown = density
                .into_iter()
                .map(|(frequency, power)| (frequency / cycle_s, (power * cycle_s).sqrt()));
            Layer::new(name, colour, Marks::Line(shown.collect()))
        });
        Panel {
            title: title.into(),
            x: Axis::logarithmic("frequency [Hz]"),
            y: Axis::logarithmic(format!("density [{}/√Hz]", quantity.unit())),
            layers: layers.collect(),
        }
    };
    let panels = [
        panel("gyros", Quantity::Rate),
        panel("accelerometers, mean of the plates", Quantity::SpecificForce),
        panel("magnetometers, mean of the plates", Quantity::Field),
    ];
    if panels.iter().all(|panel| panel.layers.is_empty()) {
        return Ok(None);
    }
    Figure::of("Spectra", 3, &panels).map(Some)
}

/// Deviation of the packet period from its mean.
fn period(times: &Times, summary: &Summary, marks: &[(f64, String)]) -> Result<Figure, ChartError> {
    /// \[us\] span shown at least: a resolution of the line's instants, not of rounding errors.
    const LEAST_SPAN_US: f64 = 10.0;
    let mean_s = summary.period_s.mean;
    let line = times.line(|bin| {
        let range = bin.interval_s?;
        Some((1e6 * (range.least - mean_s), 1e6 * (range.most - mean_s)))
    });
    let mut layers = vec![
        Layer::new("period of packets that follow each other", 0, Marks::Line(line)),
        Layer::new("packet missed", GREY, Marks::Strip(times.missed.clone())),
        Layer::new("events", GREY, Marks::Instants(marks.to_vec())),
    ];
    layers.retain(is_anything);
    let panel = Panel {
        title: String::new(),
        x: times.axis(),
        y: Axis::linear("[µs]").at_least(LEAST_SPAN_US),
        layers,
    };
    Figure::of(
        format!("Packet period minus its mean of {:.3} ms", 1e3 * mean_s),
        1,
        &[panel],
    )
}

/// When each sensor is sampled in its cycle.
fn slots(summary: &Summary) -> Result<Figure, ChartError> {
    let slots = summary.slot_s.iter().enumerate().filter(|(_, spread)| spread.count > 0);
    let (mut ranges, mut means) = (Vec::new(), Vec::new());
    for (slot, spread) in slots {
        let at = (slot + 1) as f64;
        ranges.push((at, 1e3 * spread.least, 1e3 * spread.most));
        means.push((at, 1e3 * spread.mean));
    }
    let panel = Panel {
        title: String::new(),
        x: Axis::named("sensor", SLOT_NAMES.map(str::to_string)),
        y: Axis::linear("after the start of the cycle [ms]"),
        layers: vec![
            Layer::new("least to most", 0, Marks::Whiskers(ranges)),
            Layer::new("mean", 1, Marks::Dots(means)),
        ],
    };
    Figure::of("Slot times: when each sensor is sampled in its cycle", 1, &[panel])
}

/// SI values of a channel in a bin, least and most.
fn si_range(bin: &Bin, index: usize) -> Option<(f64, f64)> {
    let (range, channel) = ((*bin.counts.get(index)?)?, CHANNELS.get(index)?);
    Some((channel.quantity.si(range.least), channel.quantity.si(range.most)))
}

#[cfg(test)]
mod tests;
