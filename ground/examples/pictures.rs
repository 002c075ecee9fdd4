//! The pictures of the documentation that are drawn by code: `pictures FLIGHT OUT` writes, into the folder OUT,
//!
//! - `tetrahedron.svg`: where the unit's sensors point, from [`emems::geometry`];
//! - `data-flow.svg`: from the parts to a verdict;
//! - `console.svg`: the console's screen, fed with what the unit of the folder FLIGHT said (`cargo fly`).
//!
//! `.ci/pictures` runs it, and takes the picture of a verdict's page beside it.

use std::{
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use emems::geometry::{PLATES, accelerometer_place_b, dcm_bp};
use ground::console::{
    model::{Link, Model},
    stream::Stream,
    view::{self, View},
};
use nalgebra::Vector3;
use ratatui::{Terminal, backend::TestBackend, style::Color};

/// Colours of Okabe and Ito, as the charts have them.
fn colour(index: usize) -> String {
    let (red, green, blue) = chart::COLOURS[index % chart::COLOURS.len()];
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn svg(width: f64, height: f64, inner: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" font-family=\"sans-serif\" \
         font-size=\"13\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n<defs><marker id=\"tip\" viewBox=\"0 0 8 8\" \
         refX=\"7\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" orient=\"auto-start-reverse\"><path d=\"M0 0L8 4L0 8z\" \
         fill=\"context-stroke\"/></marker></defs>\n{inner}</svg>\n"
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// \[px\] places on the page of points in b \[m\], seen from above the forward and right axes; b's z points down.
fn seen(point_b: Vector3<f32>) -> (f64, f64) {
    let (turn, tilt) = (0.45_f64, 0.42_f64);
    let [x, y, z] = [point_b.x, point_b.y, point_b.z].map(f64::from);
    let right = x * turn.sin() + y * turn.cos();
    let away = x * turn.cos() - y * turn.sin();
    (
        330.0 + right * 3_000.0,
        200.0 + (z * tilt.cos() - away * tilt.sin()) * 3_000.0,
    )
}

fn arrow(from_b: Vector3<f32>, to_b: Vector3<f32>, stroke: &str, label: &str) -> String {
    let ((x1, y1), (x2, y2)) = (seen(from_b), seen(to_b));
    let beyond = 14.0 / (x2 - x1).hypot(y2 - y1).max(1.0);
    let (x, y) = (x2 + (x2 - x1) * beyond, y2 + (y2 - y1) * beyond + 4.0);
    format!(
        "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{stroke}\" stroke-width=\"1.6\" \
         marker-end=\"url(#tip)\"/>\n<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" fill=\"{stroke}\">{label}</text>\n"
    )
}

/// A plate as a square of 44 mm on its face with the axes of its parts, and the axes of b.
fn tetrahedron() -> String {
    let mut inner = String::new();
    let mut plates: Vec<usize> = (0..PLATES).collect();
    // What lies behind is drawn first: the sides look away from the reader as their normals do.
    plates.sort_by(|one, other| seen_depth(*one).total_cmp(&seen_depth(*other)));
    for plate in plates {
        let dcm = dcm_bp(plate);
        let axis = |k: usize| dcm.column(k).into_owned();
        // The middle of the plate: where its accelerometer is, less that part's place on the plate.
        let middle = accelerometer_place_b(plate) - dcm * Vector3::new(0.016, -0.009, 0.0);
        let corners: Vec<String> = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| seen(middle + axis(0) * (0.022 * x) + axis(1) * (0.022 * y)))
            .iter()
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let stroke = colour(plate);
        let _ = writeln!(
            inner,
            "<polygon points=\"{}\" fill=\"{stroke}\" fill-opacity=\"0.14\" stroke=\"{stroke}\" stroke-width=\"1.4\"/>",
            corners.join(" ")
        );
        for (k, name) in ["x", "y"].iter().enumerate() {
            inner += &arrow(middle, middle + axis(k) * 0.018, &stroke, name);
        }
        inner += &arrow(
            middle,
            middle - axis(2) * 0.026,
            &stroke,
            &format!("gyro {}", plate + 1),
        );
    }
    for (k, name) in ["forward", "right", "down"].iter().enumerate() {
        let origin = Vector3::new(0.0, -0.088, 0.045);
        let mut to = origin;
        to[k] += 0.02;
        inner += &arrow(origin, to, "#444444", name);
    }
    inner += "<text x=\"16\" y=\"24\" font-weight=\"bold\">Where the sensors point</text>\n\
              <text x=\"16\" y=\"42\" fill=\"#444444\">x, y: accelerometer and magnetometer of a plate</text>\n";
    svg(660.0, 420.0, &inner)
}

fn seen_depth(plate: usize) -> f64 {
    let outward = -dcm_bp(plate).column(2);
    f64::from(-outward.x * 0.9 + outward.y * 0.43 - outward.z * 0.4)
}

/// Boxes and arrows: what becomes of a reading.
fn data_flow() -> String {
    let mut inner = String::new();
    let mut place = |x: f64, y: f64, width: f64, title: &str, below: &str, shade: usize| {
        let stroke = colour(shade);
        let _ = write!(
            inner,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"52\" rx=\"6\" fill=\"{stroke}\" fill-opacity=\"0.12\" stroke=\"{stroke}\"/>\n\
             <text x=\"{0}\" y=\"{1}\" text-anchor=\"middle\" font-weight=\"bold\">{title}</text>\n\
             <text x=\"{0}\" y=\"{2}\" text-anchor=\"middle\" font-size=\"11\" fill=\"#444444\">{below}</text>\n",
            x + width / 2.0,
            y + 22.0,
            y + 40.0
        );
    };
    place(16.0, 60.0, 120.0, "16 sensors", "I2C and SPI", 0);
    place(186.0, 60.0, 120.0, "acquire", "time-outs, votes", 0);
    place(356.0, 60.0, 120.0, "packet", "156 bytes, 5 Hz", 0);
    place(526.0, 16.0, 150.0, "telemetry", "to the vehicle", 0);
    place(526.0, 82.0, 150.0, "umbilical", "words and replies", 0);
    place(526.0, 148.0, 150.0, "flight log", "NAND, survives power cuts", 0);
    place(186.0, 148.0, 120.0, "estimate", "TRIAD, Kalman, spin", 0);
    place(356.0, 148.0, 120.0, "derived frame", "attitude, health", 0);
    place(16.0, 280.0, 120.0, "reference", "motion, or none", 1);
    place(186.0, 280.0, 120.0, "twin", "what should be read", 1);
    place(356.0, 280.0, 120.0, "diagnosis", "where, which, size", 1);
    place(526.0, 280.0, 150.0, "verdict", "page, corrected twin", 1);
    let mut join = |points: &str, shade: usize| {
        let _ = writeln!(
            inner,
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\" marker-end=\"url(#tip)\"/>",
            colour(shade)
        );
    };
    join("136,86 184,86", 0);
    join("306,86 354,86", 0);
    join("476,78 500,78 500,42 524,42", 0);
    join("476,86 500,86 500,104 524,104", 0);
    join("476,94 496,94 496,166 524,166", 0);
    join("246,112 246,146", 0);
    join("306,174 354,174", 0);
    join("476,180 524,180", 0);
    join("136,306 184,306", 1);
    join("306,306 354,306", 1);
    join("476,306 524,306", 1);
    join("600,200 600,240 416,240 416,278", 1);
    join("560,332 560,356 246,356 246,334", 1);
    inner += "<text x=\"16\" y=\"28\" font-weight=\"bold\">On the unit</text>\n<text x=\"16\" y=\"258\" font-weight=\"bold\">On the ground</text>\n\
              <text x=\"424\" y=\"256\" font-size=\"11\" fill=\"#444444\">packets</text>\n\
              <text x=\"262\" y=\"372\" font-size=\"11\" fill=\"#444444\">the effect goes into the twin, which flies again</text>\n";
    svg(692.0, 384.0, &inner)
}

/// The umbilical's bytes and the packets of the first half of a flight, at 5 Hz.
fn heard(flight: &Path) -> Result<Model, Box<dyn std::error::Error>> {
    let read = |name: &str| {
        let path = flight.join(name);
        fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))
    };
    let (said, packets_sent) = (read("umbilical.txt")?, read("packets.txt")?);
    let mut model = Model::new("/dev/ttyUSB0", "pad.log");
    model.link = Link::Plugged;
    let (mut stream, mut packets) = (Stream::default(), 0_u32);
    let half = [&said[..], &packets_sent[..packets_sent.len() / 2]].concat();
    for found in stream.read(&half) {
        let is_packet = matches!(found.item, ground::console::stream::Item::Packet(_));
        packets += u32::from(is_packet);
        let at = Duration::from_millis(200) * packets;
        model.found(at, found);
        model.now = at;
    }
    model.recorded_bytes = half.len() as u64;
    Ok(model)
}

fn console(flight: &Path) -> Result<String, Box<dyn std::error::Error>> {
    let (columns, rows) = (100_u16, 30_u16);
    let model = heard(flight)?;
    let mut terminal = Terminal::new(TestBackend::new(columns, rows))?;
    let frame = terminal.draw(|frame| view::draw(frame, &model, &View::default()))?;
    let (wide, high) = (8.0, 16.0);
    let mut inner = String::from("<g font-family=\"monospace\" font-size=\"13\">\n");
    let (width, height) = (f64::from(columns) * wide + 16.0, f64::from(rows) * high + 16.0);
    let _ = writeln!(
        inner,
        "<rect width=\"{width}\" height=\"{height}\" rx=\"6\" fill=\"#1c1c1c\"/>"
    );
    for y in 0..rows {
        for x in 0..columns {
            let cell = &frame.buffer[(x, y)];
            let (left, top) = (8.0 + f64::from(x) * wide, 8.0 + f64::from(y) * high);
            let (mut fore, mut back) = (shade(cell.fg, "#d8d8d8"), shade(cell.bg, "#1c1c1c"));
            if cell.modifier.contains(ratatui::style::Modifier::REVERSED) {
                std::mem::swap(&mut fore, &mut back);
            }
            if back != "#1c1c1c" {
                let _ = writeln!(
                    inner,
                    "<rect x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\" fill=\"{back}\"/>"
                );
            }
            if cell.symbol().trim().is_empty() {
                continue;
            }
            let _ = writeln!(
                inner,
                "<text x=\"{left}\" y=\"{}\" fill=\"{fore}\">{}</text>",
                top + 12.0,
                escaped(cell.symbol())
            );
        }
    }
    inner += "</g>\n";
    Ok(svg(width, height, &inner))
}

fn shade(colour: Color, usual: &'static str) -> &'static str {
    match colour {
        Color::Red | Color::LightRed => "#e06c60",
        Color::Green | Color::LightGreen => "#7cc47f",
        Color::Yellow | Color::LightYellow => "#e5c07b",
        Color::Blue | Color::LightBlue => "#6ca6e8",
        Color::Magenta | Color::LightMagenta => "#cc79a7",
        Color::Cyan | Color::LightCyan => "#56b4e9",
        Color::Gray => "#b0b0b0",
        Color::DarkGray => "#808080",
        Color::White => "#ffffff",
        Color::Black => "#000000",
        _ => usual,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let [flight, out] = std::env::args()
        .skip(1)
        .map(PathBuf::from)
        .collect::<Vec<_>>()
        .try_into()
        .map_err(|_| "pictures FLIGHT OUT: the folder of a flight, and where the pictures go")?;
    fs::create_dir_all(&out)?;
    fs::write(out.join("tetrahedron.svg"), tetrahedron())?;
    fs::write(out.join("data-flow.svg"), data_flow())?;
    fs::write(out.join("console.svg"), console(&flight)?)?;
    Ok(())
}
