//! One chart: lines over time with gaps, failures and flight events; or bars.
//!
//! In: values by bin. Out: drawing on a part of a figure. Lines break where nothing was read. Along the bottom, a strip
//! shows where a sensor failed, one where packets were missed and one where a sensor stood at the end of its range; micro-gravity is shaded, lift-off is a vertical line.

use std::ops::Range;

use plotters::{
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use chart::{
    canvas::{Area, Drawn, FRAME, GRID, LABEL_PX, TITLE_PX, font, hex},
    tidy,
};

use crate::envelope::{Bin, Envelope};

/// A channel that hardly changes is not blown up beyond this many counts.
pub const LEAST_SPAN_LSB: f64 = 12.0;

const FAILED: RGBColor = RGBColor(170, 0, 100);
const CLIPPED: RGBColor = RGBColor(230, 159, 0);
const MISSED: RGBColor = RGBColor(90, 90, 90);
const LIFT_OFF: RGBColor = RGBColor(60, 60, 60);
const MICRO_G: RGBColor = RGBColor(228, 238, 250);

/// Share of the height that a strip takes.
const STRIP: f64 = 0.035;

/// Narrowest part of the time axis that is still seen.
const LEAST_WIDTH: f64 = 0.0012;

/// The time axis of a flight, and what happened along it.
pub struct Times<'a> {
    envelope: &'a Envelope,
    /// Axis units between the middles of two bins.
    bin: f64,
    /// Axis units a packet takes.
    packet: f64,
    axis: Range<f64>,
    unit: &'static str,
    missed: Vec<(f64, f64)>,
    micro_g: Vec<(f64, f64)>,
    lift_off: Option<f64>,
}

/// Values of one channel as lines.
pub struct Trace {
    /// Colour.
    pub colour: RGBColor,
    /// Unbroken lines.
    pub runs: Vec<Vec<(f64, f64)>>,
}

/// One chart over time.
pub struct Panel {
    /// Title; empty for none.
    pub title: String,
    /// Unit of the values.
    pub y_title: String,
    /// Lines.
    pub traces: Vec<Trace>,
    /// Where a sensor of the panel failed.
    pub failed: Vec<(f64, f64)>,
    /// Where one stood at the end of its range.
    pub clipped: Vec<(f64, f64)>,
}

/// One bar of a bar chart.
pub struct Bar {
    /// Its name.
    pub name: &'static str,
    /// Least, mean and most, if there is any.
    pub range: Option<(f64, f64, f64)>,
}

impl<'a> Times<'a> {
    /// The axis of a flight with at least one bin, in the unit that suits its length.
    pub fn of(envelope: &'a Envelope, cycle_s: f64) -> Self {
        let packets = envelope.bins().len() as f64 * envelope.packets_per_bin() as f64;
        let (unit, unit_s) = match packets * cycle_s {
            length_s if length_s < 900.0 => ("s", 1.0),
            length_s if length_s < 3.0 * 3600.0 => ("min", 60.0),
            _ => ("h", 3600.0),
        };
        let packet = cycle_s / unit_s;
        let bin = packet * envelope.packets_per_bin() as f64;
        let first = envelope.middle(0) * packet - 0.5 * bin;
        let mut times = Times {
            envelope,
            bin,
            packet,
            axis: first..first + envelope.bins().len() as f64 * bin,
            unit,
            missed: Vec::new(),
            micro_g: Vec::new(),
            lift_off: None,
        };
        times.missed = times.spans(|bin| bin.packets == 0 || (envelope.packets_per_bin() > 1 && bin.missed > 0));
        times.micro_g = times.spans(|bin| bin.micro_g);
        times.lift_off = times.spans(|bin| bin.lift_off).first().map(|(from, _)| *from);
        times
    }

    /// Lines through the least and most of each bin, broken where there is none.
    pub fn runs(&self, values: impl Fn(&Bin) -> Option<(f64, f64)>) -> Vec<Vec<(f64, f64)>> {
        let mut runs: Vec<Vec<(f64, f64)>> = Vec::new();
        let mut open = false;
        for (index, bin) in self.envelope.bins().iter().enumerate() {
            let time = self.middle(index);
            let value = values(bin);
            if let Some((least, most)) = value {
                if !open {
                    runs.push(Vec::new());
                }
                if let Some(run) = runs.last_mut() {
                    run.push((time, least));
                    if most > least {
                        run.push((time, most));
                    }
                }
            }
            open = value.is_some();
        }
        // A single point is no line: give it the length of its bin, or of what can be seen.
        let half = 0.5 * self.bin.max(LEAST_WIDTH * (self.axis.end - self.axis.start));
        for run in &mut runs {
            if let [(time, value)] = run[..] {
                *run = vec![(time - half, value), (time + half, value)];
            }
        }
        runs
    }

    /// From when to when bins have some property.
    pub fn spans(&self, has: impl Fn(&Bin) -> bool) -> Vec<(f64, f64)> {
        let mut spans: Vec<(f64, f64)> = Vec::new();
        let mut open = false;
        for (index, bin) in self.envelope.bins().iter().enumerate() {
            let (from, to) = (self.middle(index) - 0.5 * self.bin, self.middle(index) + 0.5 * self.bin);
            let here = has(bin);
            match spans.last_mut() {
                Some(span) if here && open => span.1 = to,
                _ if here => spans.push((from, to)),
                _ => {}
            }
            open = here;
        }
        spans
    }

    /// What of failures, missed packets and events there is to explain.
    pub fn legend(&self, failed: bool, clipped: bool) -> Vec<(String, String)> {
        let entry = |shown: bool, colour, text| shown.then(|| (hex(colour), str::to_string(text)));
        [
            entry(failed, FAILED, "sensor failed"),
            entry(clipped, CLIPPED, "at the end of its range"),
            entry(!self.missed.is_empty(), MISSED, "packet missed"),
            entry(self.lift_off.is_some(), LIFT_OFF, "lift-off (dashed)"),
            entry(!self.micro_g.is_empty(), MICRO_G, "micro-gravity"),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    fn middle(&self, index: usize) -> f64 {
        self.envelope.middle(index) * self.packet
    }
}

/// A value axis that suits all panels, with room for their strips.
pub fn shared_y(panels: &[Panel], times: &Times, lsb: f64) -> Range<f64> {
    let values = || {
        (panels.iter())
            .flat_map(|panel| &panel.traces)
            .flat_map(|trace| trace.runs.iter().flatten().map(|(_, value)| *value))
    };
    let (least, most) = (values().fold(f64::MAX, f64::min), values().fold(f64::MIN, f64::max));
    let (least, most) = if least <= most { (least, most) } else { (0.0, 0.0) };
    let span = (most - least).max(LEAST_SPAN_LSB * lsb);
    let middle = 0.5 * (least + most);
    let strips = if panels.iter().any(|panel| !panel.clipped.is_empty()) {
        3.8
    } else if !times.missed.is_empty() {
        2.6
    } else if panels.iter().any(|panel| !panel.failed.is_empty()) {
        1.4
    } else {
        0.0
    };
    // 5 % of air above and below, and below that the room of the strips.
    middle - (0.55 + strips * STRIP) * span..middle + 0.55 * span
}

impl Panel {
    /// Draws it on its part of a figure.
    pub fn draw(&self, area: &Area, times: &Times, y: Range<f64>) -> Drawn {
        let height = y.end - y.start;
        let mut builder = ChartBuilder::on(area);
        builder
            .margin(16)
            .margin_right(30)
            .x_label_area_size(76)
            .y_label_area_size(130);
        if !self.title.is_empty() {
            builder.caption(&self.title, font(TITLE_PX));
        }
        let mut chart = builder.build_cartesian_2d(times.axis.clone(), y.clone())?;
        let strip = |spans: &[(f64, f64)], level: f64| -> Vec<[(f64, f64); 2]> {
            let half = 0.5 * LEAST_WIDTH * (times.axis.end - times.axis.start);
            let bottom = y.start + level * STRIP * height;
            (spans.iter())
                .map(|(from, to)| {
                    let (middle, half) = (0.5 * (from + to), (0.5 * (to - from)).max(half));
                    [(middle - half, bottom), (middle + half, bottom + STRIP * height)]
                })
                .collect()
        };
        chart.draw_series(
            (times.micro_g.iter()).map(|(from, to)| Rectangle::new([(*from, y.start), (*to, y.end)], MICRO_G.filled())),
        )?;
        chart
            .configure_mesh()
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .axis_style(FRAME)
            .x_labels(8)
            .y_labels(6)
            .x_desc(format!("time [{}]", times.unit))
            .y_desc(&self.y_title)
            .label_style(font(LABEL_PX))
            .y_label_formatter(&|value| tidy(*value, &y))
            .x_label_formatter(&|time| tidy(*time, &times.axis))
            .draw()?;
        if let Some(at) = times.lift_off.filter(|at| *at > times.axis.start) {
            let line = [(at, y.start), (at, y.end)];
            chart.draw_series(DashedLineSeries::new(line, 12, 10, LIFT_OFF.stroke_width(2)))?;
        }
        // The first on top: it is the quieter one where two nearly coincide.
        for trace in self.traces.iter().rev() {
            for run in &trace.runs {
                chart.draw_series(LineSeries::new(run.iter().copied(), trace.colour.stroke_width(3)))?;
            }
        }
        chart.draw_series(
            strip(&self.failed, 0.0)
                .into_iter()
                .map(|corners| Rectangle::new(corners, FAILED.filled())),
        )?;
        chart.draw_series(
            strip(&self.clipped, 2.4)
                .into_iter()
                .map(|corners| Rectangle::new(corners, CLIPPED.filled())),
        )?;
        let missed = strip(&times.missed, 1.2);
        chart.draw_series(
            missed
                .into_iter()
                .map(|corners| Rectangle::new(corners, MISSED.filled())),
        )?;
        Ok(())
    }
}

/// Draws bars from the top down.
pub fn draw_bars(area: &Area, bars: &[Bar], colour: RGBColor) -> Drawn {
    let most = bars
        .iter()
        .filter_map(|bar| bar.range)
        .fold(0.0, |most: f64, (_, _, bar)| most.max(bar));
    let rows = bars.len() as f64;
    let axis = 0.0..if most > 0.0 { 1.04 * most } else { 1.0 };
    let mut chart = ChartBuilder::on(area)
        .margin(16)
        .margin_right(30)
        .x_label_area_size(76)
        .y_label_area_size(130)
        .build_cartesian_2d(axis, rows..0.0)?;
    chart
        .configure_mesh()
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .axis_style(FRAME)
        .disable_y_mesh()
        .y_labels(0)
        .x_labels(10)
        .x_desc("time after the start of the cycle [ms]")
        .label_style(font(LABEL_PX))
        .draw()?;
    let name_style = font(LABEL_PX - 2).pos(Pos::new(HPos::Right, VPos::Center));
    for (row, bar) in bars.iter().enumerate() {
        let y = row as f64 + 0.5;
        let (x_px, y_px) = chart.backend_coord(&(0.0, y));
        area.draw(&Text::new(bar.name, (x_px - 14, y_px), name_style.clone()))?;
        if let Some((least, mean, most)) = bar.range {
            chart.draw_series(LineSeries::new([(least, y), (most, y)], colour.stroke_width(10)))?;
            chart.draw_series([Circle::new((mean, y), 8, colour.filled())])?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_line_is_not_blown_up() {
        let mut envelope = Envelope::default();
        envelope.add(0, &emems::sample::Reading::unread(0), 0, None);
        let panel = Panel {
            title: String::new(),
            y_title: String::new(),
            traces: vec![Trace {
                colour: BLACK,
                runs: vec![vec![(0.0, 5.0), (1.0, 5.0)]],
            }],
            failed: Vec::new(),
            clipped: Vec::new(),
        };
        let y = shared_y(&[panel], &Times::of(&envelope, 0.2), 1.0);
        assert!(
            y.start < 5.0 - 0.5 * LEAST_SPAN_LSB && y.end > 5.0 + 0.5 * LEAST_SPAN_LSB,
            "{y:?}"
        );
    }
}
