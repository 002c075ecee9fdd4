//! A flight's plots: angles with three standard deviations, the error against a reference, the body as it turned, innovations with
//! their gates, biases.
//!
//! In: a [`Flight`], a reference if there is one, the [`Clock`] of the page. Out: figures, and one page of HTML that opens without a network.

use chart::{Arrow, Axis, Block, ChartError, Face, Figure, Layer, Marks, Panel, Poses, Scene, html};
use emems::{
    geometry::{PLATES, dcm_bp},
    kalman::Quantity,
};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    flight::{EstimatedStep, Flight, euler_deg},
    recording::{Row, attitude_at},
};

/// How times stand on a page.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// Label of time axes; panels with the same label are moved together.
    pub label: String,
    /// \[s\] of its unit.
    pub unit_s: f64,
    /// \[s\] where it is zero.
    pub zero_s: f64,
}

impl Clock {
    /// Seconds for a quarter of an hour, minutes for three hours, else hours.
    pub fn of(length_s: f64) -> Self {
        let (unit, unit_s) = match length_s {
            length_s if length_s < 900.0 => ("s", 1.0),
            length_s if length_s < 3.0 * 3600.0 => ("min", 60.0),
            _ => ("h", 3600.0),
        };
        Clock {
            label: format!("time [{unit}]"),
            unit_s,
            zero_s: 0.0,
        }
    }

    /// A time on the page.
    pub fn at(&self, t_s: f64) -> f64 {
        (t_s - self.zero_s) / self.unit_s
    }

    /// Its axis.
    pub fn axis(&self) -> Axis {
        Axis::linear(self.label.clone())
    }
}

/// The page.
pub fn page(flight: &Flight, reference: Option<&[Row]>, rows: Vec<(String, String)>) -> Result<String, ChartError> {
    let about = "The unit's filter on a log: attitude with three standard deviations and TRIAD beside it, innovations within their gates, biases.";
    let ends = [flight.estimates.first(), flight.estimates.last()].map(|end| end.map_or(0.0, |end| end.t_s));
    let clock = Clock::of(ends[1] - ends[0]);
    let mut blocks = vec![Block::Rows(rows)];
    blocks.extend(attitude(flight, reference, &clock)?.map(Block::Figure));
    blocks.extend([innovations(flight, &clock)?, biases(flight, &clock)?].map(Block::Figure));
    Ok(html("Attitude", about, &blocks))
}

/// Angles, where there is a reference errors against it, and the body as it turned.
pub fn attitude(
    flight: &Flight,
    reference: Option<&[Row]>,
    clock: &Clock,
) -> Result<impl Iterator<Item = Figure> + use<>, ChartError> {
    let angles = Figure::of("Attitude", 3, &angles(flight, reference, clock))?;
    let errors =
        reference.map(|reference| Figure::of("Error against the reference", 2, &errors(flight, reference, clock)));
    let turning = Figure::scene("How the body was turned", turning(flight, reference, clock))?;
    Ok([Some(angles), errors.transpose()?, Some(turning)].into_iter().flatten())
}

fn panel(title: &str, label: &str, clock: &Clock, layers: Vec<Layer>) -> Panel {
    Panel {
        title: title.into(),
        x: clock.axis(),
        y: Axis::linear(label),
        layers,
    }
}

/// The reference at the estimates' instants.
fn met<'a>(flight: &'a Flight, reference: &'a [Row]) -> impl Iterator<Item = (&'a EstimatedStep, UnitQuaternion<f64>)> {
    // As `Flight::compare` has it: within a step on both sides.
    let step_s = match flight.estimates.as_slice() {
        [first, .., last] => (last.t_s - first.t_s) / (flight.estimates.len() - 1) as f64,
        _ => 0.0,
    };
    let each = flight.estimates.iter();
    each.filter_map(move |estimate| Some((estimate, attitude_at(reference, estimate.t_s, 1.5 * step_s)?)))
}

/// Errors of the filter about the axes of b, and the whole angle of filter and TRIAD.
pub fn errors(flight: &Flight, reference: &[Row], clock: &Clock) -> Vec<Panel> {
    let about = ["x", "y", "z"].into_iter().enumerate().map(|(axis, name)| {
        let error = met(flight, reference).map(|(estimate, reference_nb)| {
            let error_b = (reference_nb.inverse() * estimate.q_nb).scaled_axis();
            (clock.at(estimate.t_s), error_b[axis].to_degrees())
        });
        let band = met(flight, reference).map(|(estimate, _)| {
            // The covariance is about the axes of n.
            let nb = estimate.q_nb.to_rotation_matrix();
            let variance = (nb.transpose() * estimate.covariance_n * nb.matrix())[(axis, axis)];
            let three = 3.0 * variance.max(0.0).sqrt().to_degrees();
            (clock.at(estimate.t_s), -three, three)
        });
        let layers = vec![
            Layer::new("3 standard deviations", 5, Marks::Band(band.collect())),
            Layer::new("filter minus reference", 1, Marks::Line(error.collect())),
        ];
        panel(&format!("about {name} of b"), "error [deg]", clock, layers)
    });
    let whole = met(flight, reference).map(|(estimate, reference_nb)| {
        (
            clock.at(estimate.t_s),
            reference_nb.angle_to(&estimate.q_nb).to_degrees(),
        )
    });
    let triad = flight.estimates.iter().filter_map(|estimate| estimate.triad_nb);
    let triad = triad.filter_map(|(t_s, triad_nb)| {
        let reference_nb = attitude_at(reference, t_s, 1.0)?;
        Some((clock.at(t_s), reference_nb.angle_to(&triad_nb).to_degrees()))
    });
    let layers = vec![
        Layer::new("TRIAD, whole angle", 4, Marks::Dots(triad.collect())),
        Layer::new("filter, whole angle", 0, Marks::Line(whole.collect())),
    ];
    let whole = Panel {
        y: Axis::logarithmic("error [deg]"),
        ..panel("whole angle", "", clock, layers)
    };
    about.chain([whole]).collect()
}

/// Roll, pitch, yaw, and below them how wide three standard deviations are.
pub fn angles(flight: &Flight, reference: Option<&[Row]>, clock: &Clock) -> Vec<Panel> {
    let angles = ["roll", "pitch", "yaw"].into_iter().enumerate().map(|(axis, name)| {
        let of = |estimate: &EstimatedStep| (clock.at(estimate.t_s), estimate.euler_deg()[axis]);
        let band = flight.estimates.iter().map(|estimate| {
            let (time, angle) = of(estimate);
            let three = 3.0 * estimate.euler_sd_deg()[axis];
            (time, angle - three, angle + three)
        });
        let triad = flight.estimates.iter().filter_map(|estimate| {
            let (t_s, triad_nb) = estimate.triad_nb?;
            Some((clock.at(t_s), euler_deg(&triad_nb)[axis]))
        });
        let seen = reference.into_iter().flat_map(|rows| met(flight, rows));
        let seen =
            broken(seen.map(|(estimate, reference_nb)| (clock.at(estimate.t_s), euler_deg(&reference_nb)[axis])));
        let mut layers = vec![
            Layer::new("3 standard deviations", 5, Marks::Band(unwrapped_band(band))),
            Layer::new("TRIAD", 4, Marks::Dots(triad.collect())),
            Layer::new("filter", 0, Marks::Line(broken(flight.estimates.iter().map(of)))),
        ];
        if !seen.is_empty() {
            layers.push(Layer::new("reference", 2, Marks::Dashes(seen)));
        }
        panel(name, "angle [deg]", clock, layers)
    });
    let widths = ["roll", "pitch", "yaw"].into_iter().enumerate().map(|(axis, name)| {
        let line =
            (flight.estimates.iter()).map(|estimate| (clock.at(estimate.t_s), 3.0 * estimate.euler_sd_deg()[axis]));
        let layers = vec![Layer::new("3 standard deviations", 5, Marks::Line(line.collect()))];
        panel(
            &format!("3 standard deviations of {name}"),
            "angle [deg]",
            clock,
            layers,
        )
    });
    angles.chain(widths).collect()
}

/// The unit as it was turned, by the filter and, where there is one, by the reference: a plate is a face.
pub fn turning(flight: &Flight, reference: Option<&[Row]>, clock: &Clock) -> Scene {
    let pose = |q_nb: &UnitQuaternion<f64>| [q_nb.w, q_nb.i, q_nb.j, q_nb.k];
    let filter = flight
        .estimates
        .iter()
        .map(|estimate| (clock.at(estimate.t_s), pose(&estimate.q_nb)));
    let poses = |name: &str, colour, at: Vec<(f64, [f64; 4])>| Poses {
        name: name.into(),
        colour,
        at,
    };
    let mut histories = vec![poses("filter", 0, filter.collect())];
    if let Some(rows) = reference {
        let seen = met(flight, rows).map(|(estimate, q_nb)| (clock.at(estimate.t_s), pose(&q_nb)));
        histories.push(poses("reference", 2, seen.collect()));
    }
    let arrow = |tip: [f64; 3], name: &str, colour| Arrow {
        tip,
        name: name.into(),
        colour,
    };
    Scene {
        time: clock.label.clone(),
        faces: faces(),
        body: vec![
            arrow([1.0, 0.0, 0.0], "x", 0),
            arrow([0.0, 1.0, 0.0], "y", 1),
            arrow([0.0, 0.0, 1.0], "z", 2),
        ],
        world: vec![
            arrow([1.2, 0.0, 0.0], "north", 6),
            arrow([0.0, 1.2, 0.0], "east", 6),
            arrow([0.0, 0.0, 1.2], "down", 6),
        ],
        poses: histories,
    }
}

/// The tetrahedron of the plates: each corner is where three of their planes meet, `n_i . x = 1` for the normals that look outward.
fn faces() -> Vec<Face> {
    let outward: [Vector3<f64>; PLATES] =
        std::array::from_fn(|plate| -dcm_bp(plate).column(2).into_owned().cast::<f64>());
    let corner = |without: usize| {
        let planes: Vec<Vector3<f64>> = (0..PLATES)
            .filter(|plate| *plate != without)
            .map(|plate| outward[plate])
            .collect();
        let rows = nalgebra::Matrix3::from_rows(&[planes[0].transpose(), planes[1].transpose(), planes[2].transpose()]);
        rows.try_inverse()
            .map_or(Vector3::zeros(), |inverse| inverse * Vector3::repeat(SIZE))
    };
    (0..PLATES)
        .map(|plate| Face {
            corners: (0..PLATES)
                .filter(|other| *other != plate)
                .map(|other| corner(other).into())
                .collect(),
            colour: plate,
        })
        .collect()
}

/// Distance of a face from the middle, where an axis is one long.
const SIZE: f64 = 0.22;

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

fn innovations(flight: &Flight, clock: &Clock) -> Result<Figure, ChartError> {
    use Quantity::*;
    let panels = [
        (Bias, "gyro bias at rest", "residual [deg/s]", 1.0_f64.to_degrees()),
        (Velocity, "velocity", "residual [m/s]", 1.0),
        (FieldEast, "field east", "residual [1]", 1.0),
        (FieldMeridian, "field in the meridian", "residual [1]", 1.0),
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
                .map(|(t_s, record)| (clock.at(t_s), scale * f64::from(record.residual)))
                .collect()
        };
        // Several scalars of a quantity fall in one instant; the gate drawn is the widest of them.
        let mut gates: Vec<(f64, f64, f64)> = Vec::new();
        for (t_s, record) in all() {
            // A test ratio of one is the gate.
            let gate = scale * (f64::from(record.residual).powi(2) / f64::from(record.test_ratio)).sqrt();
            match gates.last_mut().filter(|last| last.0 == clock.at(t_s)) {
                Some(last) => (last.1, last.2) = (last.1.min(-gate), last.2.max(gate)),
                None => gates.push((clock.at(t_s), -gate, gate)),
            }
        }
        let layers = vec![
            Layer::new("gate", 5, Marks::Band(gates)),
            Layer::new("accepted", 0, Marks::Dots(of(true))),
            Layer::new("rejected", 1, Marks::Dots(of(false))),
        ];
        panel(title, unit, clock, layers)
    });
    Figure::of("Innovations and their gates", 2, &panels)
}

fn biases(flight: &Flight, clock: &Clock) -> Result<Figure, ChartError> {
    let layers = ["x", "y", "z"].into_iter().enumerate().map(|(axis, name)| {
        let line = (flight.estimates.iter())
            .map(|estimate| (clock.at(estimate.t_s), estimate.bias_b[axis].to_degrees()))
            .collect();
        Layer::new(name, axis, Marks::Line(line))
    });
    Figure::of(
        "Gyro bias",
        1,
        &[panel("in b", "bias [deg/s]", clock, layers.collect())],
    )
}
