//! A case without a reference whose log is of a motion of the twin.

use std::{fmt::Write, fs};

use tempfile::TempDir;
use twin::{
    environment::Environment,
    motion::Motion,
    predict::{Scene, Twin, emems, thesis_slot_s},
};

/// \[s\] from row to row.
const ROW_S: f64 = 0.2;

/// The nominal unit along a motion from one instant \[s\] to another, each reading with its noise times a number of `normal`;
/// `settings` is what case.toml says after the environment.
pub fn of(
    name: &str,
    motion: &dyn Motion,
    environment: Environment,
    (from_s, to_s): (f64, f64),
    mut normal: impl FnMut() -> f64,
    settings: &str,
) -> TempDir {
    let unit = emems(thesis_slot_s);
    let scene = Scene::new(motion, &environment, from_s - 2.0, to_s + 2.0, 0.01);
    let rows = ((to_s - from_s) / ROW_S) as usize;
    let starts_s: Vec<f64> = (0..rows).map(|row| from_s + ROW_S * row as f64).collect();
    let twin = Twin::new(unit.clone(), environment, scene, starts_s.clone()).expect("a twin");
    let readings = twin.predict(&[]);
    let names: Vec<&str> = unit.channels.iter().map(|channel| channel.name.as_str()).collect();
    let mut measured = format!("t_s,{}\n", names.join(","));
    for (row, start_s) in starts_s.iter().enumerate() {
        let channels = unit.channels.iter().zip(&readings);
        let cells =
            channels.map(|(channel, own)| format!("{:.9}", channel.logged(own[row] + channel.noise_sigma * normal())));
        let _ = writeln!(measured, "{start_s:.1},{}", cells.collect::<Vec<_>>().join(","));
    }
    let field = environment.field_n_ut;
    let case = format!(
        "format = \"gap-case/1\"\nname = \"{name}\"\nkind = \"csv\"\nunit = \"unit.toml\"\nmeasured = \"measured.csv\"\n\
         [environment]\ngravity_m_s2 = {}\nlatitude_deg = {}\nfield_n_ut = [{}, {}, {}]\n{settings}",
        environment.gravity,
        environment.latitude.to_degrees(),
        field.x,
        field.y,
        field.z
    );
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [
        ("case.toml", case),
        ("unit.toml", unit.text()),
        ("measured.csv", measured),
    ] {
        fs::write(folder.path().join(name), text).expect("a file");
    }
    folder
}
