//! Results as one HTML page that opens without a network: text, tables, plots that zoom, bodies that turn.
//!
//! [`Figure`]s are [`Panel`]s in columns, a [`Map`] of shades, or a [`Scene`] of bodies that turn in time. A panel is two
//! axes and the [`Layer`]s between them. [`html`] puts figures, tables and text into one file. Nothing here knows what the
//! numbers mean.
//!
//! Each panel is on the page twice: as a picture (SVG), which is there without scripts and in print, and as data of which the
//! script of the page makes a plot with zoom, values under the pointer and a legend that switches. Panels whose x axes have
//! the same label are moved together. A layer of more points than [`thin::LIVE`] has the least and the most of each stretch,
//! so that the weight of a page does not grow with the record and no peak is lost.
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
mod live;
mod map;
pub mod page;
mod picture;
mod scene;
mod thin;

pub use axis::{Axis, Scale, tidy};
pub use map::Map;
pub use page::{Block, html};
pub use scene::{Arrow, Face, Poses, Scene};

/// Colours in the order layers take them, distinguishable without red or green (Okabe and Ito, "Color universal
/// design", 2008), and a grey; the layer after the last has the first colour again.
pub const COLOURS: [(u8, u8, u8); 7] = [
    (0, 114, 178),
    (213, 94, 0),
    (0, 158, 115),
    (204, 121, 167),
    (230, 159, 0),
    (86, 180, 233),
    (110, 110, 110),
];

/// What a layer draws. A point with a coordinate that is not finite (or not positive on a logarithmic axis) is left
/// out and breaks the line or band it is in. Lines, dashes and bands go from left to right.
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
    /// Stretches of x as a strip along the bottom, a level above the strips of the layers before: `(from, to)`.
    Strip(Vec<(f64, f64)>),
    /// Instants, as vertical lines with their names: `(x, name)`.
    Instants(Vec<(f64, String)>),
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

/// A part of a page that is looked at: a title, and what is below it.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    title: String,
    body: Body,
}

#[derive(Clone, Debug, PartialEq)]
enum Body {
    Panels { columns: usize, panels: Vec<live::Plot> },
    Map(Map),
    Scene(Box<Scene>),
}

/// A figure cannot be drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("figure \"{figure}\" cannot be drawn: {why}")]
pub struct ChartError {
    /// Its title.
    pub figure: String,
    /// What is wrong with it.
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
    /// Panels in rows of `columns` (1 to 4); a narrow window has fewer. The legend lists each layer name once, in the colour
    /// it first has.
    ///
    /// # Errors
    /// When a line, dashes or a band go back along x.
    pub fn of(title: impl Into<String>, columns: usize, panels: &[Panel]) -> Result<Self, ChartError> {
        let title = title.into();
        let plots = panels.iter().map(live::Plot::of).collect::<Result<Vec<_>, _>>();
        match plots {
            Ok(mut panels) => {
                live::share(&mut panels);
                Ok(Figure {
                    title,
                    body: Body::Panels {
                        columns: columns.clamp(1, 4),
                        panels,
                    },
                })
            }
            Err(why) => Err(ChartError { figure: title, why }),
        }
    }

    /// A map of shades.
    ///
    /// # Errors
    /// When it has not a row of values for each name.
    pub fn map(title: impl Into<String>, map: &Map) -> Result<Self, ChartError> {
        let title = title.into();
        if map.values.len() != map.rows.len() {
            let why = format!("{} rows of values for {} names", map.values.len(), map.rows.len());
            return Err(ChartError { figure: title, why });
        }
        Ok(Figure {
            title,
            body: Body::Map(map.clone()),
        })
    }

    /// Bodies that turn.
    ///
    /// # Errors
    /// When times of poses go back.
    pub fn scene(title: impl Into<String>, scene: Scene) -> Result<Self, ChartError> {
        let title = title.into();
        match scene.check() {
            Ok(()) => Ok(Figure {
                title,
                body: Body::Scene(Box::new(scene)),
            }),
            Err(why) => Err(ChartError { figure: title, why }),
        }
    }

    /// Its title.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Names in its legend, each once.
    pub fn legend(&self) -> Vec<&str> {
        match &self.body {
            Body::Panels { panels, .. } => live::legend(panels).into_iter().map(|(name, _)| name).collect(),
            Body::Map(_) | Body::Scene(_) => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests;
