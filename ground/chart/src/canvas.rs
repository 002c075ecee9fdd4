//! The sheet that figures are drawn on: an SVG by plotters, with one look for all of them.

use plotters::{coord::Shift, prelude::*};

use crate::ChartError;

/// Lines of the grid.
pub const GRID: RGBColor = RGBColor(222, 222, 222);
/// Axes.
pub const FRAME: RGBColor = RGBColor(120, 120, 120);
/// \[px\] height of a panel's title.
pub const TITLE_PX: u32 = 34;
/// \[px\] height of labels and ticks.
pub const LABEL_PX: u32 = 30;

/// What a drawing on an SVG may fail with.
pub type Drawn = Result<(), Box<dyn std::error::Error>>;

/// Where panels are drawn.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The SVG of a drawing of some size \[px\].
///
/// # Errors
/// When the plotting library refuses.
pub fn drawing(title: &str, size: (u32, u32), draw_on: impl FnOnce(&Area) -> Drawn) -> Result<String, ChartError> {
    let mut svg = String::new();
    let drawn = {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)
            .map_err(Into::into)
            .and_then(|()| draw_on(&root))
            .and_then(|()| root.present().map_err(Into::into))
    };
    match drawn {
        Ok(()) => Ok(svg),
        Err(why) => Err(ChartError {
            figure: title.into(),
            why: why.to_string(),
        }),
    }
}

/// Black text of some height.
pub fn font(px: u32) -> TextStyle<'static> {
    ("sans-serif", px).into_font().color(&BLACK)
}

/// `#rrggbb`.
pub fn hex(RGBColor(red, green, blue): RGBColor) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}
