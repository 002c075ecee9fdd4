//! Panels and maps on an SVG, by plotters.
//!
//! In: panels in values. Out: SVG text. A layer of more points than can be seen is drawn as least and most of each of
//! [`COLUMNS`] stretches, so a picture's size does not grow with the record and no peak is lost.

use std::ops::Range;

use plotters::{
    coord::types::RangedCoordf64,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use crate::{
    COLOURS, ChartError, Layer, Map, Marks, Panel,
    axis::Scale,
    canvas::{Area, Drawn, FRAME, GRID, LABEL_PX, TITLE_PX, drawing, font},
};

/// \[px\] size of a panel; a picture is shown at half of it or less, so that lines are finer than a pixel.
const PANEL: (u32, u32) = (1300, 620);

/// \[px\] size of a panel that has the width for itself.
const WIDE: (u32, u32) = (2600, 760);

/// Stretches of x of which least and most are drawn.
const COLUMNS: usize = 1300;

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws panels in rows of `columns`.
pub fn panels(title: &str, columns: usize, panels: &[Panel]) -> Result<String, ChartError> {
    let columns = columns.clamp(1, 4);
    let rows = panels.len().div_ceil(columns).max(1);
    let (width, height) = if columns == 1 { WIDE } else { PANEL };
    drawing(title, (width * columns as u32, height * rows as u32), |root| {
        let areas = root.split_evenly((rows, columns));
        areas.iter().zip(panels).try_for_each(|(area, panel)| draw(area, panel))
    })
}

/// Draws a map of shades with its values in percent.
pub fn map(title: &str, map: &Map) -> Result<String, ChartError> {
    const CELL: (i32, i32) = (76, 28);
    const PX: u32 = 15;
    // A letter is about half as wide as it is high.
    let longest = |names: &[String]| names.iter().map(|name| name.chars().count()).max().unwrap_or(0) as i32;
    let names = (8 * longest(&map.rows) + 20, 8 * longest(&map.columns) + 16);
    let size = (
        (names.0 + CELL.0 * map.columns.len() as i32 + 20) as u32,
        (names.1 + CELL.1 * map.rows.len() as i32 + 20) as u32,
    );
    drawing(title, size, |root| {
        let text =
            |text: &str, at: (i32, i32), style: TextStyle<'_>| root.draw(&Text::new(text.to_string(), at, style));
        for (column, name) in map.columns.iter().enumerate() {
            let style = font(PX)
                .transform(FontTransform::Rotate270)
                .pos(Pos::new(HPos::Left, VPos::Center));
            text(
                name,
                (names.0 + CELL.0 * column as i32 + CELL.0 / 2, names.1 - 8),
                style,
            )?;
        }
        for (row, name) in map.rows.iter().enumerate() {
            let top = names.1 + CELL.1 * row as i32;
            let right = font(PX).pos(Pos::new(HPos::Right, VPos::Center));
            text(name, (names.0 - 8, top + CELL.1 / 2), right)?;
            for (column, value) in map.values.get(row).into_iter().flatten().enumerate() {
                let left = names.0 + CELL.0 * column as i32;
                if !value.is_finite() {
                    continue;
                }
                let share = value.clamp(0.0, 1.0);
                let shade = |full: u8| (255.0 - share * f64::from(255 - full)) as u8;
                let (red, green, blue) = COLOURS[0];
                let fill = RGBColor(shade(red), shade(green), shade(blue));
                root.draw(&Rectangle::new(
                    [(left, top), (left + CELL.0 - 2, top + CELL.1 - 2)],
                    fill.filled(),
                ))?;
                let ink = if share > 0.6 { &WHITE } else { &BLACK };
                let style = font(PX - 1).color(ink).pos(Pos::new(HPos::Center, VPos::Center));
                text(
                    &format!("{:.0}", 100.0 * value),
                    (left + CELL.0 / 2, top + CELL.1 / 2),
                    style,
                )?;
            }
        }
        Ok(())
    })
}

/// A colour of [`COLOURS`].
pub fn rgb(colour: usize) -> RGBColor {
    let (red, green, blue) = COLOURS[colour % COLOURS.len()];
    RGBColor(red, green, blue)
}

fn draw(area: &Area, panel: &Panel) -> Drawn {
    let placed: Vec<(&Layer, Vec<Vec<Placed>>)> =
        panel.layers.iter().map(|layer| (layer, runs(layer, panel))).collect();
    let all = || placed.iter().flat_map(|(_, runs)| runs.iter().flatten());
    // Shaded stretches mark what is there; they do not widen an axis.
    let marked = all().filter(|point| point.low.is_finite());
    let x = panel.x.range(
        marked.flat_map(|point| [point.x - point.half, point.x + point.half]),
        0.02,
    );
    let y = panel.y.range(all().flat_map(|point| [point.low, point.high]), 0.06);
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(16)
        .margin_right(30)
        .x_label_area_size(76)
        .y_label_area_size(150);
    if !panel.title.is_empty() {
        builder.caption(&panel.title, font(TITLE_PX));
    }
    let mut chart = builder.build_cartesian_2d(x.clone(), y.clone())?;
    let ticks = |range: &Range<f64>, scale: Scale, usual: usize| match scale {
        Scale::Linear => usual,
        Scale::Logarithmic => ((range.end - range.start).ceil() as usize + 1).clamp(3, 12),
    };
    chart
        .configure_mesh()
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .axis_style(FRAME)
        .x_labels(ticks(&x, panel.x.scale, 8))
        .y_labels(ticks(&y, panel.y.scale, 6))
        .x_desc(&panel.x.label)
        .y_desc(&panel.y.label)
        .label_style(font(LABEL_PX))
        .x_label_formatter(&|place| panel.x.tick(*place, &x))
        .y_label_formatter(&|place| panel.y.tick(*place, &y))
        .draw()?;
    placed
        .iter()
        .try_for_each(|(layer, runs)| layer_on(&mut chart, layer, runs, &x, &y))
}

fn layer_on(chart: &mut Chart, layer: &Layer, runs: &[Vec<Placed>], x: &Range<f64>, y: &Range<f64>) -> Drawn {
    let colour = rgb(layer.colour);
    let shown = |from: f64, to: f64| (from.clamp(x.start, x.end), to.clamp(x.start, x.end));
    for run in runs {
        let line = || run.iter().map(|point| (point.x, point.low));
        match &layer.marks {
            Marks::Line(_) => {
                chart.draw_series(LineSeries::new(line(), colour.stroke_width(3)))?;
            }
            Marks::Dashes(_) => {
                chart.draw_series(DashedLineSeries::new(line(), 14, 10, colour.stroke_width(3)))?;
            }
            Marks::Dots(_) => {
                chart.draw_series(line().map(|at| Circle::new(at, 4, colour.filled())))?;
            }
            Marks::Band(_) => {
                let back = run.iter().rev().map(|point| (point.x, point.high));
                chart.draw_series([Polygon::new(
                    line().chain(back).collect::<Vec<_>>(),
                    colour.mix(0.22).filled(),
                )])?;
            }
            Marks::Whiskers(_) => {
                chart.draw_series(run.iter().map(|point| {
                    PathElement::new([(point.x, point.low), (point.x, point.high)], colour.stroke_width(3))
                }))?;
            }
            Marks::Bars(_) => {
                chart.draw_series(run.iter().map(|bar| {
                    Rectangle::new(
                        [(bar.x - bar.half, bar.low), (bar.x + bar.half, bar.high)],
                        colour.filled(),
                    )
                }))?;
            }
            Marks::Spans(_) => {
                chart.draw_series(run.chunks_exact(2).map(|ends| {
                    let (from, to) = shown(ends[0].x, ends[1].x);
                    Rectangle::new([(from, y.start), (to, y.end)], colour.mix(0.14).filled())
                }))?;
            }
        }
    }
    Ok(())
}

/// A point in drawing units; `low` and `high` are the same except for bands, whiskers and bars (one of them zero), NaN
/// for the end of a span. `half` is half of a bar's width.
#[derive(Clone, Copy)]
struct Placed {
    x: f64,
    low: f64,
    high: f64,
    half: f64,
}

/// Unbroken runs of a layer's points, thinned to what can be seen.
fn runs(layer: &Layer, panel: &Panel) -> Vec<Vec<Placed>> {
    let place = |(x, low, high): (f64, f64, f64)| Placed {
        x: panel.x.place(x),
        low: panel.y.place(low),
        high: panel.y.place(high),
        half: 0.0,
    };
    let points: Vec<Placed> = match &layer.marks {
        Marks::Line(points) | Marks::Dashes(points) | Marks::Dots(points) => {
            points.iter().map(|(x, y)| place((*x, *y, *y))).collect()
        }
        Marks::Bars(points) => {
            let steps = points.windows(2).map(|pair| pair[1].0 - pair[0].0);
            let half = 0.45 * steps.filter(|step| *step > 0.0).fold(1.0, f64::min);
            (points.iter().map(|(x, y)| place((*x, y.min(0.0), y.max(0.0)))))
                .map(|bar| Placed { half, ..bar })
                .collect()
        }
        Marks::Band(points) | Marks::Whiskers(points) => points.iter().copied().map(place).collect(),
        Marks::Spans(spans) => {
            let ends = spans.iter().flat_map(|(from, to)| [*from, *to]);
            return vec![ends.map(|x| place((x, f64::NAN, f64::NAN))).collect()];
        }
    };
    let drawable = |point: &Placed| point.x.is_finite() && point.low.is_finite() && point.high.is_finite();
    let parts = points.split(|point| !drawable(point)).filter(|part| !part.is_empty());
    let most = 4 * COLUMNS;
    let total = points.len();
    match layer.marks {
        Marks::Bars(_) => parts.map(<[Placed]>::to_vec).collect(),
        _ if total <= most => parts.map(<[Placed]>::to_vec).collect(),
        _ => parts
            .map(|part| thinned(part, (part.len() * COLUMNS).div_ceil(total).max(1)))
            .collect(),
    }
}

/// Least and most of `low` and `high` in each of `stretches` parts of a run.
fn thinned(run: &[Placed], stretches: usize) -> Vec<Placed> {
    let length = run.len().div_ceil(stretches).max(1);
    run.chunks(length)
        .flat_map(|part| {
            let by = |value: fn(&Placed) -> f64| move |a: &&Placed, b: &&Placed| value(a).total_cmp(&value(b));
            let least = part.iter().min_by(by(|point| point.low)).copied();
            let most = part.iter().max_by(by(|point| point.high)).copied();
            let ends = [part.first().copied(), least, most, part.last().copied()];
            let mut kept: Vec<Placed> = ends.into_iter().flatten().collect();
            kept.sort_by(|a, b| a.x.total_cmp(&b.x));
            kept
        })
        .collect()
}
