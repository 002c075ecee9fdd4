//! What one plate says without its reference, and how near its attitude comes to it: `cargo run --example plate -- FOLDER...`.
//!
//! In: folders of cases of one plate that have a motion. It is not opened but to hold the attitude against. Out: a line each.

use std::{path::Path, time::Instant};

use gap::{
    input::case::Subject,
    parity::{
        flight::Flight,
        plate::{Findings, sensors::Sensors},
    },
};
use nalgebra::UnitQuaternion;

fn main() {
    for folder in std::env::args().skip(1) {
        match of(Path::new(&folder)) {
            Ok(line) => println!("{folder}: {line}"),
            Err(error) => println!("{folder}: {error}"),
        }
    }
}

fn of(folder: &Path) -> Result<String, Box<dyn std::error::Error>> {
    let began = Instant::now();
    let flight = Flight::open(folder)?;
    let sensors = Sensors::of(&flight.unit).ok_or("is not of one plate")?;
    let findings = Findings::of(&flight, sensors, &[], &|_, _| ())?;
    let took_s = began.elapsed().as_secs_f64();
    let names = findings.names(&flight).into_iter().map(|name| name.effect);
    let names: Vec<&str> = names.collect();
    let [plate, room] = findings.weighed.gains;
    let said = format!("{names:?} plate {plate:+.0} room {room:+.0} nats; {took_s:.2} s");
    let Some(nodes) = &findings.attitude else {
        return Ok(format!("{said}; no attitude"));
    };
    let subject = Subject::open(folder)?;
    let slot_s = flight.unit.channels[0].slot_s;
    let (starts_s, feels) = (subject.twin.starts_s(), subject.twin.feels(0));
    let (mut square, mut tilt, mut nees, mut stated, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for at in nodes {
        let row = starts_s.partition_point(|start_s| start_s + slot_s < at.t_s);
        let Some(feel) = feels.get(row) else { continue };
        let since_s = at.t_s - starts_s[row] - slot_s;
        // Where optics lost sight there is no row.
        if since_s.abs() > 0.05 {
            continue;
        }
        let truth = feel.q_nb * UnitQuaternion::from_scaled_axis(feel.rate_b * since_s);
        let in_n = (at.q_nb * truth.inverse()).scaled_axis();
        let sigmas = at.sigmas_b();
        square += in_n.norm_squared();
        tilt += in_n.xy().norm_squared();
        stated += sigmas.norm_squared();
        nees += (at.q_nb.inverse() * in_n).component_div(&sigmas).norm_squared() / 3.0;
        count += 1.0;
    }
    let root = |sum: f64| (sum / count).sqrt().to_degrees();
    Ok(format!(
        "{said}; error {:.2} deg, tilt {:.2} deg, said {:.2} deg, NEES {:.2}",
        root(square),
        root(tilt),
        root(stated),
        nees / count
    ))
}
