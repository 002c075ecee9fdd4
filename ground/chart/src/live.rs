//! A panel as data for the script of the page, beside its picture.
//!
//! In: a panel. Out: [`Plot`], and of all plots of a page one JSON text. Columns of numbers are whole steps from a least value,
//! 16 bits for y (a 65,534th of the layer's range, finer than a screen) and 32 bits for x, little-endian in base64; equal columns are kept
//! once. Values are in drawing units (decimal logarithms on a logarithmic axis).
//!
//! ```text
//! {"columns": [{"least": 0, "step": 0.1, "bytes": 4, "text": "AAAA..."}],
//!  "panels": [{"title", "x": {"label", "from", "to", "log", "names"}, "y": {..., "fixed", "shared", "span"},
//!              "layers": [{"name", "colour", "kind", "x": column, "low": column, "high": column, "half"}]}]}
//! ```

use std::{collections::HashMap, ops::Range};

use data_encoding::BASE64;
use serde_json::{Value, json};

use crate::{
    Axis, COLOURS, Layer, Marks, Panel, Scale, picture,
    thin::{self, Point},
};

/// A value that is not there.
const NONE: u16 = u16::MAX;

/// A panel ready for a page.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    pub panel: Panel,
    x: Range<f64>,
    y: Range<f64>,
    points: Vec<Vec<Point>>,
    picture: Vec<Vec<Point>>,
}

impl Plot {
    /// Thins and places the layers of a panel.
    pub fn of(panel: &Panel) -> Result<Self, String> {
        let points: Vec<Vec<Point>> = (panel.layers.iter())
            .map(|layer| thin::points(&layer.marks, panel))
            .collect();
        for (layer, points) in panel.layers.iter().zip(&points) {
            if let Some(at) = thin::goes_back(points) {
                return Err(format!("\"{}\" goes back along x at its point {at}", layer.name));
            }
        }
        let (x, y) = ranges(panel, &points);
        let picture = panel.layers.iter().map(|layer| picture::points(layer, panel)).collect();
        let points = points
            .into_iter()
            .map(|points| thin::thinned(points, thin::LIVE))
            .collect();
        // What has been placed is not kept twice.
        let emptied = |layer: &Layer| match &layer.marks {
            Marks::Line(_) => Marks::Line(Vec::new()),
            Marks::Dashes(_) => Marks::Dashes(Vec::new()),
            Marks::Dots(_) => Marks::Dots(Vec::new()),
            Marks::Band(_) => Marks::Band(Vec::new()),
            Marks::Whiskers(_) => Marks::Whiskers(Vec::new()),
            Marks::Bars(_) => Marks::Bars(Vec::new()),
            marks => marks.clone(),
        };
        let layers = panel.layers.iter().map(|layer| Layer {
            marks: emptied(layer),
            ..layer.clone()
        });
        Ok(Plot {
            panel: Panel {
                layers: layers.collect(),
                ..panel.clone()
            },
            x,
            y,
            points,
            picture,
        })
    }

    /// The picture; `number` is its own on the page.
    pub fn svg(&self, is_wide: bool, number: usize) -> String {
        picture::svg(&self.panel, &self.x, &self.y, &self.picture, is_wide, number)
    }
}

/// Makes shared y axes of the same label alike.
pub fn share(plots: &mut [Plot]) {
    let shares = |plot: &Plot, other: &Plot| other.panel.y.is_shared && other.panel.y.label == plot.panel.y.label;
    let ranges: Vec<Range<f64>> = (plots.iter())
        .map(|plot| {
            let alike = plots
                .iter()
                .filter(|other| plot.panel.y.is_shared && shares(plot, other));
            alike.fold(plot.y.clone(), |range, other| {
                range.start.min(other.y.start)..range.end.max(other.y.end)
            })
        })
        .collect();
    for (plot, y) in plots.iter_mut().zip(ranges) {
        plot.y = y;
    }
}

/// Names of layers in the order they come, each once, with their colour.
pub fn legend(plots: &[Plot]) -> Vec<(&str, usize)> {
    let mut legend: Vec<(&str, usize)> = Vec::new();
    for layer in plots.iter().flat_map(|plot| &plot.panel.layers) {
        if !layer.name.is_empty() && !legend.iter().any(|(name, _)| *name == layer.name) {
            legend.push((&layer.name, layer.colour % COLOURS.len()));
        }
    }
    legend
}

/// What is shown on both axes. Shaded stretches mark what is there; they do not widen an axis.
fn ranges(panel: &Panel, points: &[Vec<Point>]) -> (Range<f64>, Range<f64>) {
    let shown = || {
        let layers = panel.layers.iter().zip(points);
        layers.flat_map(|(layer, points)| {
            let half = match layer.marks {
                Marks::Bars(_) => picture::half_bar(points),
                _ => 0.0,
            };
            points
                .iter()
                .filter(|point| point.low.is_finite())
                .map(move |point| (point, half))
        })
    };
    let x = shown().flat_map(|(point, half)| [point.x - half, point.x + half]);
    let strips = panel
        .layers
        .iter()
        .filter(|layer| matches!(&layer.marks, Marks::Strip(spans) if !spans.is_empty()));
    let y = (panel.y).range(shown().flat_map(|(point, _)| [point.low, point.high]), 0.06);
    let room = 0.04 * strips.count() as f64 * (y.end - y.start);
    (panel.x.range(x, 0.02), y.start - room..y.end)
}

/// Columns and panels of a page as they come.
#[derive(Debug, Default)]
pub struct Store {
    columns: Vec<Value>,
    known: HashMap<String, usize>,
    panels: Vec<Value>,
    pub scenes: Vec<Value>,
}

impl Store {
    /// Adds a panel; its number.
    pub fn panel(&mut self, plot: &Plot) -> usize {
        let layers = plot.panel.layers.iter().zip(&plot.points);
        let layers: Vec<Value> = layers
            .map(|(layer, points)| self.layer(layer, points, &plot.panel))
            .collect();
        let axis = |axis: &Axis, range: &Range<f64>| {
            json!({
                "label": axis.label, "from": range.start, "to": range.end, "log": axis.scale == Scale::Logarithmic,
                "names": axis.names, "fixed": axis.limits.is_some(), "shared": axis.is_shared, "span": axis.least_span,
            })
        };
        self.panels.push(json!({
            "title": plot.panel.title, "x": axis(&plot.panel.x, &plot.x), "y": axis(&plot.panel.y, &plot.y), "layers": layers,
        }));
        self.panels.len() - 1
    }

    fn layer(&mut self, layer: &Layer, points: &[Point], panel: &Panel) -> Value {
        let kind = match layer.marks {
            Marks::Line(_) => "line",
            Marks::Dashes(_) => "dashes",
            Marks::Dots(_) => "dots",
            Marks::Band(_) => "band",
            Marks::Whiskers(_) => "whiskers",
            Marks::Bars(_) => "bars",
            Marks::Spans(_) => "spans",
            Marks::Strip(_) => "strip",
            Marks::Instants(_) => "instants",
        };
        let mut value = json!({"name": layer.name, "colour": layer.colour % COLOURS.len(), "kind": kind});
        match &layer.marks {
            Marks::Spans(spans) | Marks::Strip(spans) => {
                let place = |(from, to): &(f64, f64)| [panel.x.place(*from), panel.x.place(*to)];
                value["spans"] = json!(spans.iter().map(place).collect::<Vec<_>>());
            }
            Marks::Instants(instants) => {
                let named = instants.iter().map(|(x, name)| json!([panel.x.place(*x), name]));
                value["instants"] = named.collect();
            }
            _ => {
                value["x"] = self.fine(points.iter().map(|point| point.x)).into();
                value["low"] = self.values(points.iter().map(|point| point.low)).into();
                value["high"] = self.values(points.iter().map(|point| point.high)).into();
                if matches!(layer.marks, Marks::Bars(_)) {
                    value["half"] = picture::half_bar(points).into();
                }
            }
        }
        value
    }

    /// A column of x or t.
    pub fn fine(&mut self, values: impl Iterator<Item = f64> + Clone) -> usize {
        let (least, most) = ends(values.clone());
        let step = ((most - least) / f64::from(u32::MAX)).max(f64::MIN_POSITIVE);
        let bytes = values.flat_map(|value| (((value - least) / step).round() as u32).to_le_bytes());
        let text = BASE64.encode(&bytes.collect::<Vec<_>>());
        self.column(least, step, 4, text)
    }

    /// A column of y, in which what is not finite is kept as nothing.
    pub fn values(&mut self, values: impl Iterator<Item = f64> + Clone) -> usize {
        let (least, most) = ends(values.clone());
        let step = ((most - least) / f64::from(NONE - 1)).max(f64::MIN_POSITIVE);
        let bytes = values.flat_map(|value| {
            let code = match value.is_finite() {
                true => ((value - least) / step).round() as u16,
                false => NONE,
            };
            code.to_le_bytes()
        });
        let text = BASE64.encode(&bytes.collect::<Vec<_>>());
        self.column(least, step, 2, text)
    }

    fn column(&mut self, least: f64, step: f64, bytes: u8, text: String) -> usize {
        // `{:?}` of a double gives it back exactly.
        let key = format!("{least:?} {step:?} {bytes} {text}");
        *self.known.entry(key).or_insert_with(|| {
            self.columns
                .push(json!({"least": least, "step": step, "bytes": bytes, "text": text}));
            self.columns.len() - 1
        })
    }

    /// Nothing that a script would draw.
    pub fn is_empty(&self) -> bool {
        self.panels.is_empty() && self.scenes.is_empty()
    }

    /// The JSON, in which no markup can begin.
    pub fn text(self) -> String {
        let all = json!({"columns": self.columns, "panels": self.panels, "scenes": self.scenes});
        all.to_string().replace('<', "\\u003c")
    }
}

fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (least, most) = (values.filter(|value| value.is_finite()))
        .fold((f64::MAX, f64::MIN), |(least, most), value| {
            (least.min(value), most.max(value))
        });
    if least <= most { (least, most) } else { (0.0, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(column: &Value) -> Vec<f64> {
        let bytes = BASE64.decode(column["text"].as_str().unwrap().as_bytes()).unwrap();
        let [least, step] = ["least", "step"].map(|key| column[key].as_f64().unwrap());
        let width = column["bytes"].as_u64().unwrap() as usize;
        let code = |part: &[u8]| part.iter().rev().fold(0u64, |code, byte| code << 8 | u64::from(*byte));
        let value = |code: u64| {
            if width == 2 && code == u64::from(NONE) {
                f64::NAN
            } else {
                least + step * code as f64
            }
        };
        bytes.chunks(width).map(|part| value(code(part))).collect()
    }

    #[test]
    fn columns_come_back_within_a_step_and_equal_ones_are_kept_once() {
        let mut store = Store::default();
        let values = [-3.0, 12.5, f64::NAN, 900.25];
        let y = store.values(values.into_iter());
        let x = store.fine([0.0, 0.0, 0.2, 86_400.0].into_iter());
        assert_eq!(store.fine([0.0, 0.0, 0.2, 86_400.0].into_iter()), x);
        assert_eq!(store.columns.len(), 2);
        let back = decoded(&store.columns[y]);
        for (back, value) in back.iter().zip(values) {
            assert!((back - value).abs() <= 0.5 * 903.25 / 65_534.0 + 1e-9 || value.is_nan() && back.is_nan());
        }
        let back = decoded(&store.columns[x]);
        assert!(
            (back[2] - 0.2).abs() < 1e-4 && (back[3] - 86_400.0).abs() < 1e-4,
            "{back:?}"
        );
    }

    #[test]
    fn nothing_and_one_value_are_columns_too() {
        let mut store = Store::default();
        let (none, one) = (store.values([].into_iter()), store.values([7.5].into_iter()));
        assert!(decoded(&store.columns[none]).is_empty());
        assert_eq!(decoded(&store.columns[one]), [7.5]);
    }
}
