//! A plot of one group of sensors over the last seconds.
//!
//! In: a [`Model`], a group, a plate, a window. Out: a chart whose vertical range fits what is in the window, but is
//! never narrower than [`LEAST_COUNTS`], so that a quiet sensor looks quiet. Where nothing came there is no line.

use std::time::Duration;

use ratatui::{
    Frame,
    layout::Rect,
    style::{Color, Style},
    symbols::Marker,
    text::{Line, Span},
    widgets::{Axis, Block, Borders, Chart, Dataset, GraphType},
};

use super::{
    display::{Group, unit, value},
    model::Model,
};

/// Narrowest vertical range, in counts.
const LEAST_COUNTS: i16 = 16;

/// \[s\] pause over which no line is drawn: more than a cycle at 1 Hz.
const GAP_S: f64 = 1.5;

/// Part of the range left free above and below.
const MARGIN: f64 = 0.05;

const COLORS: [Color; 4] = [Color::Red, Color::Green, Color::Cyan, Color::Yellow];

/// Draws the group into `area`.
pub fn draw(frame: &mut Frame, area: Rect, model: &Model, group: Group, plate: usize, window: Duration) {
    let quantity = group.quantity();
    let curves = group.curves(plate);
    let points: Vec<Vec<(f64, f64)>> = curves
        .iter()
        .map(|(channel, _)| {
            let values = model.history.window(*channel, model.now, window);
            values
                .map(|(time_s, counts)| (time_s, value(quantity, counts)))
                .collect()
        })
        .collect();
    let least = (value(quantity, LEAST_COUNTS) - value(quantity, 0)).abs();
    let range = range(points.iter().flatten().map(|(_, value)| *value), least);

    let mut title = vec![Span::raw(format!(" {} [{}] ", group.title(plate), unit(quantity)))];
    for ((_, label), color) in curves.iter().zip(COLORS) {
        title.push(Span::styled(format!("{label} "), Style::new().fg(color)));
    }
    let datasets = points.iter().zip(COLORS).flat_map(|(points, color)| {
        unbroken(points).map(move |points| {
            Dataset::default()
                .marker(Marker::Braille)
                .graph_type(GraphType::Line)
                .style(Style::new().fg(color))
                .data(points)
        })
    });
    let window_s = window.as_secs_f64();
    let decimals = if range[1] - range[0] < 10.0 { 2 } else { 1 };
    let labels = [range[0], (range[0] + range[1]) / 2.0, range[1]].map(|value| format!("{value:7.decimals$}"));
    let chart = Chart::new(datasets.collect())
        .block(Block::new().borders(Borders::TOP).title(Line::from(title)))
        .legend_position(None)
        .x_axis(
            Axis::default()
                .bounds([-window_s, 0.0])
                .labels([format!("-{window_s:.0} s"), "now".into()]),
        )
        .y_axis(Axis::default().bounds(range).labels(labels));
    frame.render_widget(chart, area);
}

/// The stretches without a gap.
fn unbroken(points: &[(f64, f64)]) -> impl Iterator<Item = &[(f64, f64)]> {
    points.chunk_by(|(before_s, _), (after_s, _)| after_s - before_s < GAP_S)
}

/// Lowest and highest value to show, at least `least` apart.
fn range(values: impl Iterator<Item = f64>, least: f64) -> [f64; 2] {
    let seen = values.fold(None, |seen: Option<[f64; 2]>, value| {
        let [low, high] = seen.unwrap_or([value, value]);
        Some([low.min(value), high.max(value)])
    });
    let [low, high] = seen.unwrap_or([0.0, 0.0]);
    let half = (high - low).max(least) * (0.5 + MARGIN);
    let middle = (low + high) / 2.0;
    [middle - half, middle + half]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_fits_the_values_and_a_quiet_sensor_looks_quiet() {
        assert_eq!(range([2.0, 12.0, 7.0].into_iter(), 1.0), [1.5, 12.5]);
        assert_eq!(range([7.0, 7.0].into_iter(), 10.0), [1.5, 12.5]);
        assert_eq!(range([].into_iter(), 2.0), [-1.1, 1.1]);
    }

    #[test]
    fn no_line_is_drawn_where_nothing_came() {
        let points = [(-5.0, 1.0), (-4.8, 2.0), (-2.0, 3.0), (-1.8, 4.0)];
        let stretches: Vec<_> = unbroken(&points).collect();
        assert_eq!(stretches, [&points[..2], &points[2..]]);
    }
}
