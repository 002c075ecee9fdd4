//! The folder of a case: what a diagnosis is given.
//!
//! In: a flight of a scene, the instants of its samples, what is told about it. Out: `CASE/{case.toml, unit.toml, measured.txt.gz}` after the case format, and
//! `motion.csv.gz` where somebody saw the motion.

use std::{fmt::Write as _, fs, io::Write, path::Path};

use emems::packet;
use flate2::{Compression, write::GzEncoder};
use twin::environment::Environment;

use super::{DealError, FIT_S, Flown};
use crate::{
    flight::{CYCLE_S, Instants},
    loose::Loose,
    motion::Style,
    scene::{DURATION_S, Scene},
    unit,
};

/// \[s\] between rows of the record: motions of the trials have no tone above 0.5 Hz.
const RECORD_S: f64 = 0.02;

/// \[s\] between the true attitudes that an answer keeps.
const KEPT_S: f64 = 5.0;

/// What of a case its file tells.
#[derive(Clone, Copy)]
pub enum About {
    /// How it moved.
    Seen(Style),
    /// That nobody saw how.
    Withheld(Style),
    /// The same of a rocket.
    Rocket,
}

/// Writes it.
///
/// # Errors
/// When a file cannot be written.
pub fn write(
    folder: &Path,
    name: &str,
    about: About,
    flown: &Flown,
    instants: &Instants,
    loose: Option<&Loose>,
) -> Result<(), DealError> {
    let put = |file: &str, bytes: &[u8]| {
        let path = folder.join(file);
        let written = match file.ends_with(".gz") {
            false => fs::write(&path, bytes),
            true => fs::File::create(&path).and_then(|file| {
                let mut packed = GzEncoder::new(file, Compression::fast());
                packed.write_all(bytes)?;
                packed.finish().map(drop)
            }),
        };
        written.map_err(|source| DealError::Write { path, source })
    };
    fs::create_dir_all(folder).map_err(|source| DealError::Write {
        path: folder.into(),
        source,
    })?;
    let last = (DURATION_S / CYCLE_S) as u16;
    let frames = flown.readings.iter().filter(|reading| reading.counter < last);
    let mut stream = Vec::new();
    for reading in frames {
        stream.extend(packet::encode(reading));
        stream.push(b'\n');
    }
    put("measured.txt.gz", &stream)?;
    if matches!(about, About::Seen(_)) {
        put("motion.csv.gz", motion_csv(&flown.scene, instants).as_bytes())?;
    }
    let declared = loose.map_or([1.0; 2], |loose| [loose.noise, loose.calibration]);
    put("unit.toml", unit::toml(instants, declared).as_bytes())?;
    put(
        "case.toml",
        case_toml(name, about, &flown.scene.claimed, loose).as_bytes(),
    )
}

fn motion_csv(scene: &Scene, instants: &Instants) -> String {
    let mut text = String::from("t_s,qw,qx,qy,qz,px_m,py_m,pz_m,temperature_c\n");
    for row in 0..=((DURATION_S + 1.0) / RECORD_S) as u32 {
        let case_s = RECORD_S * f64::from(row);
        let t_s = instants.zero_s + case_s;
        let (q, place) = (scene.record)(t_s);
        let temperature_c = scene.source.at(t_s).temperature_c;
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{case_s:.2},{:.9},{:.9},{:.9},{:.9},{:.7},{:.7},{:.7},{temperature_c:.4}",
            q.w, q.i, q.j, q.k, place.x, place.y, place.z
        );
    }
    text
}

fn case_toml(name: &str, about: About, claimed: &Environment, loose: Option<&Loose>) -> String {
    let is_seen = matches!(about, About::Seen(_));
    let motion = if is_seen {
        "motion = \"motion.csv.gz\"\n"
    } else {
        "\n[motion_known]\nnone = true\n"
    };
    let about = match about {
        About::Rocket => "A sounding rocket.",
        About::Seen(style) | About::Withheld(style) => told(style),
    };
    let field = claimed.field_n_ut;
    let (field_sigma, reference) = loose.map(Loose::case_toml).unwrap_or_default();
    format!(
        "format = \"gap-case/1\"\nname = \"{name}\"\nkind = \"packets\"\nabout = \"{about}\"\nunit = \"unit.toml\"\n\
         measured = \"measured.txt.gz\"\n{motion}\n[environment]\ngravity_m_s2 = {}\n\
         latitude_deg = {:.6}\nfield_n_ut = [{:.6}, {:.6}, {:.6}]\ntemperature_c = 25.0\n{field_sigma}{reference}\n[windows]\n\
         fit = [[0.0, {FIT_S:.1}]]\nhold = [[{FIT_S:.1}, {DURATION_S:.1}]]\n",
        claimed.gravity,
        claimed.latitude.to_degrees(),
        field.x,
        field.y,
        field.z
    )
}

/// True attitudes in the fit window, on the clock of the packets.
pub fn attitudes(scene: &Scene, instants: &Instants) -> Vec<[f64; 5]> {
    let at = |step: u32| {
        let case_s = KEPT_S * f64::from(step);
        let (q, _) = (scene.record)(instants.zero_s + case_s);
        [case_s, q.w, q.i, q.j, q.k]
    };
    (1..(FIT_S / KEPT_S) as u32).map(at).collect()
}

fn told(style: Style) -> &'static str {
    match style {
        Style::Positions => "Turned slowly from attitude to attitude.",
        Style::Table => "On a three-axis table.",
        Style::Hand => "Carried about by hand.",
    }
}
