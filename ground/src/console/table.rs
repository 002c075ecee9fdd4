//! The live table: all sixteen sensors in counts and engineering units.
//!
//! In: a [`Model`]. Out: seventeen rows, [`WIDTH`] columns. A gyro's row shows its rate under x and its own
//! temperature under z. A sensor whose error bit is set says FAILED, in red; values that no longer come are dim.

use emems::sample::SENSORS;
use ratatui::{
    layout::{Alignment, Constraint},
    style::{Color, Modifier, Style},
    text::Text,
    widgets::{Row, Table},
};

use super::{
    display::{cells, short_name, unit},
    model::Model,
};
use packets::channel::{CHANNELS, Quantity};

/// Columns it takes.
pub const WIDTH: u16 = 58;

/// Rows it takes.
pub const HEIGHT: u16 = 17;

/// The table as the model has it.
pub fn table(model: &Model) -> Table<'static> {
    let title = Style::new().add_modifier(Modifier::BOLD);
    // A gyro has its rate under x and its temperature under z.
    let header = ["", "x cnt", "y cnt", "z cnt", "x", "y", "z", " unit"].map(right);
    let widths = [6, 6, 6, 6, 8, 8, 8, 7].map(Constraint::Length);
    let rows = (0..SENSORS.len()).map(|slot| row(model, slot));
    let table = Table::new(rows, widths)
        .header(Row::new(header).style(title))
        .column_spacing(0);
    if model.receiving() {
        table
    } else {
        table.style(Style::new().add_modifier(Modifier::DIM))
    }
}

fn row(model: &Model, slot: usize) -> Row<'static> {
    let mut counts_cells = [const { String::new() }; 3];
    let mut value_cells = counts_cells.clone();
    let mut units = Vec::new();
    let newest = model.history.newest().map(|(_, counts)| counts);
    let of_sensor = CHANNELS
        .iter()
        .enumerate()
        .filter(|(_, channel)| channel.slot() == slot);
    for (place, (index, channel)) in of_sensor.enumerate() {
        let place = if channel.quantity == Quantity::GyroTemperature {
            2
        } else {
            place
        };
        let counts = newest.and_then(|newest| newest.get(index).copied().flatten());
        let [in_counts, in_unit] = cells(channel.quantity, counts);
        if let (Some(left), Some(right)) = (counts_cells.get_mut(place), value_cells.get_mut(place)) {
            *left = in_counts;
            *right = in_unit;
        }
        if !units.contains(&unit(channel.quantity)) {
            units.push(unit(channel.quantity));
        }
    }
    let failed = model.reading.is_some_and(|reading| reading.errors.contains(slot));
    let last = if failed { "FAILED".into() } else { units.join(" ") };
    let name = SENSORS
        .get(slot)
        .map(|sensor| format!("{} {}", short_name(sensor.kind), sensor.plate + 1));
    let cells = [Text::from(name.unwrap_or_default())]
        .into_iter()
        .chain(counts_cells.into_iter().chain(value_cells).map(right))
        .chain([Text::from(format!(" {last}"))]);
    let row = Row::new(cells);
    if failed {
        row.style(Style::new().fg(Color::Red))
    } else {
        row
    }
}

fn right(text: impl Into<Text<'static>>) -> Text<'static> {
    text.into().alignment(Alignment::Right)
}
