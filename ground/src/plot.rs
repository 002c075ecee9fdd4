//! A flight as pictures: every sensor, the packet period and the slot times, as SVG figures.
//!
//! In: [`Envelope`] and [`Summary`]. Out: [`Figure`]s, each an SVG without outside references. Values are nominal SI;
//! plates share an axis, so that one that disagrees is seen. Where a bin holds several packets, its least and most are
//! joined, so a peak is never drawn away.

mod panel;

use plotters::prelude::RGBColor;

use chart::{
    ChartError, Figure,
    canvas::{drawing, hex},
};
use packets::channel::{CHANNELS, Quantity};

use crate::{
    envelope::{Bin, Envelope},
    summary::Summary,
    table::SLOT_NAMES,
};
use panel::{Bar, Panel, Times, Trace};

/// Colours of x, y, z: distinguishable also without red or green (Okabe and Ito, "Color universal design", 2008).
const XYZ: [RGBColor; 3] = [RGBColor(0, 114, 178), RGBColor(213, 94, 0), RGBColor(0, 158, 115)];

/// \[px\] size of a figure of four panels; shown at half of it or less, so that lines are finer than a pixel.
const FOUR_PANELS: (u32, u32) = (2600, 1240);

/// \[px\] size of a figure of one panel.
const ONE_PANEL: (u32, u32) = (2600, 640);

/// All figures of a flight; none for a flight without packets.
///
/// # Errors
/// When the plotting library refuses one.
pub fn figures(envelope: &Envelope, cycle_s: f64, summary: &Summary) -> Result<Vec<Figure>, ChartError> {
    if envelope.bins().is_empty() {
        return Ok(Vec::new());
    }
    let times = Times::of(envelope, cycle_s);
    let mut figures = vec![
        sensors(&times, "Accelerometers", &[Quantity::SpecificForce], &["x", "y", "z"])?,
        sensors(&times, "Magnetometers", &[Quantity::Field], &["x", "y", "z"])?,
        sensors(&times, "Gyros", &[Quantity::Rate], &["rate"])?,
        sensors(
            &times,
            "Temperatures",
            &[Quantity::Temperature, Quantity::GyroTemperature],
            &["plate", "gyro"],
        )?,
    ];
    if summary.period_s.count > 0 {
        figures.push(period(&times, summary)?);
    }
    if summary.derived > 0 {
        figures.push(slots(summary)?);
    }
    Ok(figures)
}

/// Four panels, one a plate.
fn sensors(times: &Times, title: &str, quantities: &[Quantity], names: &[&'static str]) -> Result<Figure, ChartError> {
    let unit = quantities.first().map_or("", |quantity| quantity.unit());
    let channels = |plate| {
        (0..CHANNELS.len()).filter(move |index| {
            CHANNELS
                .get(*index)
                .is_some_and(|channel| channel.plate == plate && quantities.contains(&channel.quantity))
        })
    };
    let panels: Vec<Panel> = (0..4)
        .map(|plate| {
            // Temperatures: the plate's own first, though the packet has the gyro's first.
            let mut indices: Vec<usize> = channels(plate).collect();
            indices.sort_by_key(|index| {
                let quantity = CHANNELS.get(*index).map(|channel| channel.quantity);
                quantities.iter().position(|wanted| Some(*wanted) == quantity)
            });
            let slots = indices
                .iter()
                .filter_map(|index| CHANNELS.get(*index))
                .fold(0, |bits, channel| bits | 1u16 << channel.slot());
            Panel {
                title: format!("plate {}", plate + 1),
                y_title: unit.into(),
                traces: (indices.iter().zip(XYZ))
                    .map(|(index, colour)| Trace {
                        colour,
                        runs: times.runs(|bin| si_range(bin, *index)),
                    })
                    .collect(),
                failed: times.spans(|bin| bin.failed & slots != 0),
                clipped: times.spans(|bin| bin.clipped & slots != 0),
            }
        })
        .collect();
    let lsb = quantities.iter().map(|quantity| quantity.scale().0).fold(0.0, f64::max);
    let mut legend: Vec<_> = XYZ
        .into_iter()
        .zip(names)
        .map(|(colour, name)| (hex(colour), name.to_string()))
        .collect();
    legend.extend(times.legend(
        panels.iter().any(|panel| !panel.failed.is_empty()),
        panels.iter().any(|panel| !panel.clipped.is_empty()),
    ));
    let svg = drawing(title, FOUR_PANELS, |root| {
        let y = panel::shared_y(&panels, times, lsb);
        for (area, panel) in root.split_evenly((2, 2)).iter().zip(&panels) {
            panel.draw(area, times, y.clone())?;
        }
        Ok(())
    })?;
    Ok(Figure {
        title: format!("{title} [{unit}]"),
        legend,
        svg,
    })
}

/// Deviation of the packet period from its mean.
fn period(times: &Times, summary: &Summary) -> Result<Figure, ChartError> {
    /// \[us\] span shown at least: a resolution of the line's instants, not of rounding errors.
    const LEAST_SPAN_US: f64 = 10.0;
    let mean_s = summary.period_s.mean;
    let title = format!("Packet period minus its mean of {:.3} ms [µs]", 1e3 * mean_s);
    let panel = Panel {
        title: String::new(),
        y_title: "µs".into(),
        traces: vec![Trace {
            colour: XYZ[0],
            runs: times.runs(|bin| {
                let range = bin.interval_s?;
                Some((1e6 * (range.least - mean_s), 1e6 * (range.most - mean_s)))
            }),
        }],
        failed: Vec::new(),
        clipped: Vec::new(),
    };
    let mut legend = vec![(hex(XYZ[0]), "period of packets that follow each other".to_string())];
    legend.extend(times.legend(false, false));
    let svg = drawing(&title, ONE_PANEL, |root| {
        let y = panel::shared_y(
            std::slice::from_ref(&panel),
            times,
            LEAST_SPAN_US / panel::LEAST_SPAN_LSB,
        );
        panel.draw(root, times, y)
    })?;
    Ok(Figure { title, legend, svg })
}

/// When each sensor is sampled in its cycle.
fn slots(summary: &Summary) -> Result<Figure, ChartError> {
    let title = "Slot times: when each sensor is sampled after the start of its cycle [ms]".to_string();
    let bars: Vec<Bar> = (SLOT_NAMES.iter().zip(&summary.slot_s))
        .map(|(name, spread)| Bar {
            name,
            range: (spread.count > 0).then_some((1e3 * spread.least, 1e3 * spread.mean, 1e3 * spread.most)),
        })
        .collect();
    let svg = drawing(&title, ONE_PANEL, |root| panel::draw_bars(root, &bars, XYZ[0]))?;
    Ok(Figure {
        title,
        legend: vec![(hex(XYZ[0]), "least to most, dot at the mean".to_string())],
        svg,
    })
}

/// SI values of a channel in a bin, least and most.
fn si_range(bin: &Bin, index: usize) -> Option<(f64, f64)> {
    let (range, channel) = ((*bin.counts.get(index)?)?, CHANNELS.get(index)?);
    Some((channel.quantity.si(range.least), channel.quantity.si(range.most)))
}

#[cfg(test)]
mod tests;
