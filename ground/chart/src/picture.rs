//! A panel as a picture: SVG that takes its colours from the page, so that it follows dark mode and paper.
//!
//! In: a panel with its range on both axes and its points. Out: SVG text. It shows what the live plot shows before anyone
//! touches it. A layer has at most [`thin::PICTURE`] stretches.

use std::{fmt::Write, ops::Range};

use crate::{
    COLOURS, Layer, Marks, Panel,
    page::escape,
    thin::{self, Point},
};

/// \[px\] size of a panel beside others, and of one that has the width for itself.
const SIZES: [(f64, f64); 2] = [(640.0, 300.0), (1080.0, 300.0)];

/// \[px\] margins: left, right, top, bottom.
const MARGINS: [f64; 4] = [74.0, 14.0, 10.0, 46.0];

/// \[px\] height of a strip, and from one to the next.
pub const STRIP_PX: [f64; 2] = [6.0, 8.0];

/// \[px\] narrowest stretch that is still seen.
const LEAST_PX: f64 = 1.5;

/// Where places are on the picture.
struct Frame<'a> {
    panel: &'a Panel,
    x: &'a Range<f64>,
    y: &'a Range<f64>,
    size: (f64, f64),
}

impl Frame<'_> {
    fn at_x(&self, place: f64) -> f64 {
        let [left, right, ..] = MARGINS;
        left + (place - self.x.start) / (self.x.end - self.x.start) * (self.size.0 - left - right)
    }

    fn at_y(&self, place: f64) -> f64 {
        let [_, _, top, bottom] = MARGINS;
        self.size.1 - bottom - (place - self.y.start) / (self.y.end - self.y.start) * (self.size.1 - top - bottom)
    }

    fn bottom(&self) -> f64 {
        self.size.1 - MARGINS[3]
    }

    fn right(&self) -> f64 {
        self.size.0 - MARGINS[1]
    }
}

/// The picture of a panel; `points` are those of each layer, in drawing units.
pub fn svg(panel: &Panel, x: &Range<f64>, y: &Range<f64>, points: &[Vec<Point>], is_wide: bool, clip: usize) -> String {
    let size = SIZES[usize::from(is_wide)];
    let frame = Frame { panel, x, y, size };
    let mut text = format!(
        "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\"{}>\n",
        size.0,
        size.1,
        escape(&panel.title),
        if is_wide { " class=\"long\"" } else { "" },
    );
    axes(&mut text, &frame);
    let [left, right, top, bottom] = MARGINS;
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "<clipPath id=\"k{clip}\"><rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\"/></clipPath><g clip-path=\"url(#k{clip})\">",
        size.0 - left - right,
        size.1 - top - bottom
    );
    let mut strips = 0;
    for (layer, points) in panel.layers.iter().zip(points) {
        let _ = writeln!(
            text,
            "<g class=\"c{}\">{}</g>",
            layer.colour % COLOURS.len(),
            marks(&frame, layer, points, strips)
        );
        strips += usize::from(matches!(layer.marks, Marks::Strip(_)));
    }
    text + "</g></svg>\n"
}

fn axes(text: &mut String, frame: &Frame) {
    let (mut grid, mut labels) = (String::new(), String::new());
    let [left, _, top, _] = MARGINS;
    let (right, bottom) = (frame.right(), frame.bottom());
    let count = if frame.size.0 > 800.0 { 12 } else { 7 };
    for place in frame.panel.x.ticks(frame.x, count) {
        let at = frame.at_x(place);
        let _ = write!(grid, "M{at:.1} {top}V{bottom}");
        let tick = escape(&frame.panel.x.tick(place, frame.x));
        let _ = write!(
            labels,
            "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{tick}</text>",
            bottom + 17.0
        );
    }
    for place in frame.panel.y.ticks(frame.y, 5) {
        let at = frame.at_y(place);
        let _ = write!(grid, "M{left} {at:.1}H{right}");
        let tick = escape(&frame.panel.y.tick(place, frame.y));
        let _ = write!(
            labels,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{tick}</text>",
            left - 7.0,
            at + 5.0
        );
    }
    let middle = [0.5 * (left + right), 0.5 * (top + bottom)];
    let _ = writeln!(
        text,
        "<path class=\"grid\" d=\"{grid}\"/><path class=\"frame\" d=\"M{left} {top}V{bottom}H{right}\"/>{labels}\
         <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
         <text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        middle[0],
        frame.size.1 - 8.0,
        escape(&frame.panel.x.label),
        middle[1],
        escape(&frame.panel.y.label),
    );
}

fn marks(frame: &Frame, layer: &Layer, points: &[Point], strips: usize) -> String {
    let at = |x: f64, y: f64| format!("{:.1} {:.1}", frame.at_x(x), frame.at_y(y));
    let runs = || {
        points
            .split(|point| !(point.low.is_finite() && point.high.is_finite()))
            .filter(|run| !run.is_empty())
    };
    let path = |class: &str, d: String| match d.is_empty() {
        true => String::new(),
        false => format!("<path class=\"{class}\" d=\"{d}\"/>"),
    };
    let line = |run: &[Point]| {
        let mut d = String::from("M");
        // A single point is no line: it is drawn as a dot.
        for point in run.iter().chain(run.first().filter(|_| run.len() == 1)) {
            d += &at(point.x, point.low);
            d.push(' ');
        }
        d.trim_end().to_string()
    };
    match &layer.marks {
        Marks::Line(_) => path("line", runs().map(line).collect()),
        Marks::Dashes(_) => path("line dashed", runs().map(line).collect()),
        Marks::Dots(_) => path(
            "dots",
            runs()
                .flatten()
                .map(|point| format!("M{}h0", at(point.x, point.low)))
                .collect(),
        ),
        Marks::Band(_) => {
            let around = |run: &[Point]| {
                let there = run.iter().map(|point| at(point.x, point.low));
                let back = run.iter().rev().map(|point| at(point.x, point.high));
                format!("M{}Z", there.chain(back).collect::<Vec<_>>().join(" "))
            };
            path("band", runs().map(around).collect())
        }
        Marks::Whiskers(_) => path(
            "line",
            runs()
                .flatten()
                .map(|point| format!("M{}V{:.1}", at(point.x, point.low), frame.at_y(point.high)))
                .collect(),
        ),
        Marks::Bars(_) => {
            let half = half_bar(points);
            let bar = |point: &Point| {
                let (from, to) = (frame.at_x(point.x - half), frame.at_x(point.x + half));
                format!(
                    "M{from:.1} {:.1}V{:.1}H{to:.1}V{:.1}Z",
                    frame.at_y(point.low),
                    frame.at_y(point.high),
                    frame.at_y(point.low)
                )
            };
            path("full", runs().flatten().map(bar).collect())
        }
        Marks::Spans(spans) => path("span", stretches(frame, spans, MARGINS[2], frame.bottom())),
        Marks::Strip(spans) => {
            let [height, step] = STRIP_PX;
            let foot = frame.bottom() - 1.0 - step * strips as f64;
            path("full", stretches(frame, spans, foot - height, foot))
        }
        Marks::Instants(instants) => {
            let inside = instants
                .iter()
                .map(|(x, _)| frame.panel.x.place(*x))
                .filter(|at| frame.x.contains(at));
            path(
                "line dashed",
                inside
                    .map(|place| format!("M{:.1} {}V{}", frame.at_x(place), MARGINS[2], frame.bottom()))
                    .collect(),
            )
        }
    }
}

fn stretches(frame: &Frame, spans: &[(f64, f64)], top: f64, foot: f64) -> String {
    let each = spans.iter().filter_map(|(from, to)| {
        let [from, to] = [from, to].map(|x| frame.panel.x.place(*x).clamp(frame.x.start, frame.x.end));
        // Not the contrary comparison: what is no number is left out.
        (from <= to).then(|| {
            let (from, to) = (frame.at_x(from), frame.at_x(to));
            format!(
                "M{from:.1} {top:.1}h{:.1}V{foot:.1}h-{0:.1}Z",
                (to - from).max(LEAST_PX)
            )
        })
    });
    each.collect()
}

/// Half of the width of bars: they do not touch.
pub fn half_bar(points: &[Point]) -> f64 {
    let steps = points.windows(2).map(|pair| pair[1].x - pair[0].x);
    0.45 * steps.filter(|step| *step > 0.0).fold(1.0, f64::min)
}

/// Points of a layer for the picture.
pub fn points(layer: &Layer, panel: &Panel) -> Vec<Point> {
    thin::thinned(thin::points(&layer.marks, panel), thin::PICTURE)
}
