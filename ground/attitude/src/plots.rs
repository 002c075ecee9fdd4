//! A flight's plots: angles with three standard deviations, the error against a reference, innovations with their gates,
//! biases.
//!
//! In: a [`Flight`], a reference if there is one, what was printed. Out: one page of HTML that opens without a network.

use chart::{Axis, Block, ChartError, Figure, Layer, Marks, Panel, html};
use emems::kalman::Quantity;

use crate::{
    flight::{Flight, euler_deg},
    recording::{Row, attitude_at},
};

/// Most points in a line: more cannot be seen, and an hour at 285 Hz has a million.
const MOST_POINTS: usize = 4_000;

/// The page.
pub fn page(flight: &Flight, reference: Option<&[Row]>, rows: Vec<(String, String)>) -> Result<String, ChartError> {
    let about = "The unit's filter on a log: attitude with three standard deviations and TRIAD beside it, innovations within their gates, biases.";
    let mut blocks = vec![Block::Rows(rows), Block::Figure(angles(flight, reference)?)];
    if let Some(reference) = reference {
        blocks.push(Block::Figure(errors(flight, reference)?));
    }
    blocks.extend([innovations(flight)?, biases(flight)?].map(Block::Figure));
    Ok(html("Attitude", about, &blocks))
}

fn panel(title: &str, label: &str, layers: Vec<Layer>) -> Panel {
    Panel {
        title: title.into(),
        x: Axis::linear("s"),
        y: Axis::linear(label),
        layers,
    }
}

fn thinned(flight: &Flight) -> impl Iterator<Item = &crate::flight::Estimate> {
    flight
        .estimates
        .iter()
        .step_by(flight.estimates.len() / MOST_POINTS + 1)
}

/// The reference at the instants that are drawn.
fn met<'a>(
    flight: &'a Flight,
    reference: &'a [Row],
) -> impl Iterator<Item = (&'a crate::flight::Estimate, nalgebra::UnitQuaternion<f64>)> {
    // As `Flight::compare` has it: within a step on both sides.
    let step_s = match flight.estimates.as_slice() {
        [first, .., last] => (last.t_s - first.t_s) / (flight.estimates.len() - 1) as f64,
        _ => 0.0,
    };
    thinned(flight).filter_map(move |estimate| Some((estimate, attitude_at(reference, estimate.t_s, 1.5 * step_s)?)))
}

fn errors(flight: &Flight, reference: &[Row]) -> Result<Figure, ChartError> {
    let panels = ["x", "y", "z"].into_iter().enumerate().map(|(axis, name)| {
        let error = met(flight, reference).map(|(estimate, reference_nb)| {
            let error_b = (reference_nb.inverse() * estimate.q_nb).scaled_axis();
            (estimate.t_s, error_b[axis].to_degrees())
        });
        let band = met(flight, reference).map(|(estimate, _)| {
            // The covariance is about the axes of n.
            let nb = estimate.q_nb.to_rotation_matrix();
            let variance = (nb.transpose() * estimate.covariance_n * nb.matrix())[(axis, axis)];
            let three = 3.0 * variance.max(0.0).sqrt().to_degrees();
            (estimate.t_s, -three, three)
        });
        let layers = vec![
            Layer::new("3 standard deviations", 5, Marks::Band(band.collect())),
            Layer::new("filter minus reference", 1, Marks::Line(error.collect())),
        ];
        panel(&format!("error about {name} of b"), "deg", layers)
    });
    Figure::of("Error against the reference", 3, &panels.collect::<Vec<_>>())
}

fn angles(flight: &Flight, reference: Option<&[Row]>) -> Result<Figure, ChartError> {
    let angles = ["roll", "pitch", "yaw"].into_iter().enumerate().map(|(axis, name)| {
        let of = |estimate: &crate::flight::Estimate| (estimate.t_s, estimate.euler_deg()[axis]);
        let band = thinned(flight).map(|estimate| {
            let (t_s, angle) = of(estimate);
            let three = 3.0 * estimate.euler_sd_deg()[axis];
            (t_s, angle - three, angle + three)
        });
        let triad = thinned(flight).filter_map(|estimate| {
            let (t_s, triad_nb) = estimate.triad_nb?;
            Some((t_s, euler_deg(&triad_nb)[axis]))
        });
        let seen = reference.into_iter().flat_map(|rows| met(flight, rows));
        let seen = broken(seen.map(|(estimate, reference_nb)| (estimate.t_s, euler_deg(&reference_nb)[axis])));
        let mut layers = vec![
            Layer::new("3 standard deviations", 5, Marks::Band(unwrapped_band(band))),
            Layer::new("TRIAD", 4, Marks::Dots(triad.collect())),
            Layer::new("filter", 0, Marks::Line(broken(thinned(flight).map(of)))),
        ];
        if !seen.is_empty() {
            layers.push(Layer::new("reference", 2, Marks::Dashes(seen)));
        }
        panel(name, "deg", layers)
    });
    let widths = ["roll", "pitch", "yaw"].into_iter().enumerate().map(|(axis, name)| {
        let line = thinned(flight).map(|estimate| (estimate.t_s, 3.0 * estimate.euler_sd_deg()[axis]));
        let layers = vec![Layer::new("3 standard deviations", 5, Marks::Line(line.collect()))];
        panel(&format!("3 sd of {name}"), "deg", layers)
    });
    Figure::of("Attitude", 3, &angles.chain(widths).collect::<Vec<_>>())
}

/// \[deg\] a jump between two points that is the angle's end and not a turn.
const WRAP_DEG: f64 = 180.0;

/// A line that breaks where an angle goes from one end of its range to the other.
fn broken(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> = Vec::new();
    for (t_s, angle) in points {
        if let Some((before_s, before)) = line.last().copied()
            && (angle - before).abs() > WRAP_DEG
        {
            line.push(((t_s + before_s) / 2.0, f64::NAN));
        }
        line.push((t_s, angle));
    }
    line
}

fn unwrapped_band(points: impl Iterator<Item = (f64, f64, f64)>) -> Vec<(f64, f64, f64)> {
    let mut band: Vec<(f64, f64, f64)> = Vec::new();
    for (t_s, low, high) in points {
        if let Some((before_s, before, _)) = band.last().copied()
            && (low - before).abs() > WRAP_DEG
        {
            band.push(((t_s + before_s) / 2.0, f64::NAN, f64::NAN));
        }
        band.push((t_s, low, high));
    }
    band
}

fn innovations(flight: &Flight) -> Result<Figure, ChartError> {
    use Quantity::*;
    let panels = [
        (Bias, "gyro bias at rest", "deg/s", 1.0_f64.to_degrees()),
        (Velocity, "velocity", "m/s", 1.0),
        (FieldEast, "field east", "1", 1.0),
        (FieldMeridian, "field in the meridian", "1", 1.0),
    ]
    .map(|(quantity, title, unit, scale)| {
        let all = || {
            let each = flight.estimates.iter();
            let records =
                each.flat_map(|estimate| estimate.innovations.iter().map(move |record| (estimate.t_s, record)));
            records.filter(move |(_, record)| record.quantity == quantity)
        };
        let of = |accepted: bool| {
            let chosen = all().filter(|(_, record)| record.accepted == accepted);
            chosen
                .map(|(t_s, record)| (t_s, scale * f64::from(record.residual)))
                .collect()
        };
        // Several scalars of a quantity fall in one instant; the gate drawn is the widest of them.
        let mut gates: Vec<(f64, f64, f64)> = Vec::new();
        for (t_s, record) in all() {
            // A test ratio of one is the gate.
            let gate = scale * (f64::from(record.residual).powi(2) / f64::from(record.test_ratio)).sqrt();
            match gates.last_mut().filter(|last| last.0 == t_s) {
                Some(last) => (last.1, last.2) = (last.1.min(-gate), last.2.max(gate)),
                None => gates.push((t_s, -gate, gate)),
            }
        }
        let layers = vec![
            Layer::new("gate", 5, Marks::Band(gates)),
            Layer::new("accepted", 0, Marks::Dots(of(true))),
            Layer::new("rejected", 1, Marks::Dots(of(false))),
        ];
        panel(title, unit, layers)
    });
    Figure::of("Innovations and their gates", 2, &panels)
}

fn biases(flight: &Flight) -> Result<Figure, ChartError> {
    let layers = ["x", "y", "z"].into_iter().enumerate().map(|(axis, name)| {
        let line = thinned(flight)
            .map(|estimate| (estimate.t_s, estimate.bias_b[axis].to_degrees()))
            .collect();
        Layer::new(name, axis, Marks::Line(line))
    });
    Figure::of("Gyro bias", 1, &[panel("in b", "deg/s", layers.collect())])
}
