//! A flight's plots: angles with three standard deviations, innovations with their gates, biases.

use chart::{Axis, Block, ChartError, Figure, Layer, Marks, Panel, html};
use emems::kalman::Quantity;

use crate::flight::Flight;

/// Most points in a line: more cannot be seen, and an hour at 285 Hz has a million.
const MOST_POINTS: usize = 4_000;

/// The page.
pub fn page(flight: &Flight) -> Result<String, ChartError> {
    let about =
        "The unit's filter on a log: attitude with three standard deviations, innovations over their own, biases.";
    let blocks = [angles(flight)?, innovations(flight)?, biases(flight)?].map(Block::Figure);
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

fn angles(flight: &Flight) -> Result<Figure, ChartError> {
    let panels = ["roll", "pitch", "yaw"].into_iter().enumerate().map(|(axis, name)| {
        let line = thinned(flight)
            .map(|estimate| (estimate.t_s, estimate.euler_deg()[axis]))
            .collect();
        panel(name, "deg", vec![Layer::new("filter", 0, Marks::Line(line))])
    });
    // Standard deviations are about axes of n; Euler angles turn about others.
    let bands = ["north", "east", "down"].into_iter().enumerate().map(|(axis, name)| {
        let band = thinned(flight).map(|estimate| {
            let three = 3.0 * estimate.sd_n[axis].to_degrees();
            (estimate.t_s, -three, three)
        });
        let title = format!("3 sd about {name}");
        panel(
            &title,
            "deg",
            vec![Layer::new("3 standard deviations", 5, Marks::Band(band.collect()))],
        )
    });
    Figure::of("Attitude", 3, &panels.chain(bands).collect::<Vec<_>>())
}

fn innovations(flight: &Flight) -> Result<Figure, ChartError> {
    use Quantity::*;
    let panels = [Bias, Velocity, FieldEast, FieldMeridian].map(|quantity| {
        let of = |accepted: bool| {
            let all = flight
                .estimates
                .iter()
                .flat_map(|estimate| estimate.innovations.iter().map(move |record| (estimate.t_s, record)));
            all.filter(|(_, record)| record.quantity == quantity && record.accepted == accepted)
                .map(|(t_s, record)| (t_s, f64::from(record.residual) / f64::from(record.variance).sqrt()))
                .collect()
        };
        let layers = vec![
            Layer::new("accepted", 0, Marks::Dots(of(true))),
            Layer::new("rejected", 1, Marks::Dots(of(false))),
        ];
        panel(&format!("{quantity:?}"), "standard deviations", layers)
    });
    Figure::of("Innovations", 2, &panels)
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
