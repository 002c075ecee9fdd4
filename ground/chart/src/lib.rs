//! Results as pictures: panels as SVG, and one HTML page that opens without a network.
//!
//! [`Figure`]s are rows and columns of [`Panel`]s; a panel is two axes and what is drawn between them. [`page::html`]
//! puts figures, tables and text into one file. Nothing here knows what the numbers mean.
//!
//! ```
//! use chart::{Block, Figure, Layer, Marks, Panel};
//!
//! let line = Layer::new("rate", 0, Marks::Line(vec![(0.0, 1.0), (1.0, 3.0)]));
//! let figure = Figure::of("A turn", 1, &[Panel { layers: vec![line], ..Panel::default() }])?;
//! let page = chart::html("Flight 1", "recorded today", &[Block::Figure(figure)]);
//! assert!(page.starts_with("<!") && page.contains("A turn"));
//! # Ok::<(), chart::ChartError>(())
//! ```

mod axis;
pub mod canvas;
mod draw;
pub mod page;

pub use axis::{Axis, Scale, tidy};
pub use page::{Block, html};

/// Colours in the order layers take them, distinguishable without red or green (Okabe and Ito, "Color universal
/// design", 2008); the seventh layer has the first colour again.
pub const COLOURS: [(u8, u8, u8); 6] = [
    (0, 114, 178),
    (213, 94, 0),
    (0, 158, 115),
    (204, 121, 167),
    (230, 159, 0),
    (86, 180, 233),
];

/// What a layer draws. A point with a coordinate that is not finite (or not positive on a logarithmic axis) is left
/// out and breaks the line or band it is in.
#[derive(Clone, Debug, PartialEq)]
pub enum Marks {
    /// A line through `(x, y)`.
    Line(Vec<(f64, f64)>),
    /// A dashed line through `(x, y)`.
    Dashes(Vec<(f64, f64)>),
    /// Dots at `(x, y)`.
    Dots(Vec<(f64, f64)>),
    /// A band between two values: `(x, low, high)`.
    Band(Vec<(f64, f64, f64)>),
    /// Error bars: `(x, low, high)`.
    Whiskers(Vec<(f64, f64, f64)>),
    /// Vertical bars from zero, one unit of x wide at most: `(x, y)`.
    Bars(Vec<(f64, f64)>),
    /// Shaded stretches of x: `(from, to)`.
    Spans(Vec<(f64, f64)>),
}

/// One layer of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// What the legend calls it; empty for nothing in the legend.
    pub name: String,
    /// Index into [`COLOURS`], modulo its length.
    pub colour: usize,
    /// What is drawn.
    pub marks: Marks,
}

/// Two axes and what is drawn between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Its title; empty for none.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, the first at the bottom.
    pub layers: Vec<Layer>,
}

/// Shares or scores in rows and columns, as shades with their values written in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// Names of the rows, from the top.
    pub rows: Vec<String>,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// `values[row][column]`, 0 white to 1 dark; what is not finite is left empty.
    pub values: Vec<Vec<f64>>,
}

/// A picture with its title and legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Its title.
    pub title: String,
    /// Colours (`#rrggbb`) and what they mean.
    pub legend: Vec<(String, String)>,
    /// The picture.
    pub svg: String,
}

/// A figure could not be drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("figure \"{figure}\" cannot be drawn: {why}")]
pub struct ChartError {
    /// Its title.
    pub figure: String,
    /// What the plotting library says.
    pub why: String,
}

impl Layer {
    /// A layer with a name, a colour of [`COLOURS`] and marks.
    pub fn new(name: impl Into<String>, colour: usize, marks: Marks) -> Self {
        Layer {
            name: name.into(),
            colour,
            marks,
        }
    }
}

impl Figure {
    /// Panels in rows of `columns`; the legend lists each layer name once, in the colour it first has.
    ///
    /// # Errors
    /// When the plotting library refuses.
    pub fn of(title: impl Into<String>, columns: usize, panels: &[Panel]) -> Result<Self, ChartError> {
        let title = title.into();
        let mut legend: Vec<(String, String)> = Vec::new();
        for layer in panels.iter().flat_map(|panel| &panel.layers) {
            if !layer.name.is_empty() && !legend.iter().any(|(_, name)| *name == layer.name) {
                legend.push((canvas::hex(draw::rgb(layer.colour)), layer.name.clone()));
            }
        }
        let svg = draw::panels(&title, columns, panels)?;
        Ok(Figure { title, legend, svg })
    }

    /// A map of shades.
    ///
    /// # Errors
    /// When the plotting library refuses.
    pub fn map(title: impl Into<String>, map: &Map) -> Result<Self, ChartError> {
        let title = title.into();
        let svg = draw::map(&title, map)?;
        Ok(Figure {
            title,
            legend: Vec::new(),
            svg,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(points: Vec<(f64, f64)>) -> Panel {
        Panel {
            layers: vec![Layer::new("a", 0, Marks::Line(points))],
            ..Panel::default()
        }
    }

    #[test]
    fn numbers_that_are_none_break_a_line_and_nothing_else() {
        let whole = Figure::of("t", 1, &[panel(vec![(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)])]).unwrap();
        let broken = Figure::of(
            "t",
            1,
            &[panel(vec![
                (0.0, 0.0),
                (1.0, 1.0),
                (1.5, f64::NAN),
                (2.0, 2.0),
                (3.0, 3.0),
            ])],
        )
        .unwrap();
        let lines = |figure: &Figure| figure.svg.matches("<polyline").count();
        assert_eq!(lines(&broken), lines(&whole) + 1);
        assert!(!broken.svg.contains("NaN"));
    }

    #[test]
    fn nothing_to_draw_is_an_empty_panel() {
        for points in [vec![], vec![(f64::INFINITY, 1.0)], vec![(0.0, f64::NAN)]] {
            assert!(Figure::of("t", 2, &[panel(points)]).unwrap().svg.starts_with("<svg"));
        }
        assert!(Figure::of("t", 0, &[]).unwrap().svg.starts_with("<svg"));
        assert!(Figure::map("t", &Map::default()).unwrap().svg.starts_with("<svg"));
    }

    #[test]
    fn a_name_is_once_in_the_legend() {
        let figure = Figure::of("t", 2, &[panel(vec![(0.0, 1.0)]), panel(vec![(0.0, 2.0)])]).unwrap();
        assert_eq!(figure.legend, [("#0072b2".to_string(), "a".to_string())]);
    }

    #[test]
    fn a_million_points_make_a_small_picture_that_keeps_the_peak() {
        let mut points: Vec<(f64, f64)> = (0..1_000_000).map(|k| (f64::from(k), 0.0)).collect();
        let flat = Figure::of("t", 1, &[panel(points.clone())]).unwrap();
        points[654_321].1 = 1.0;
        let peak = Figure::of("t", 1, &[panel(points)]).unwrap();
        assert!(peak.svg.len() < 200_000, "{} bytes", peak.svg.len());
        assert_ne!(flat.svg, peak.svg);
    }
}
