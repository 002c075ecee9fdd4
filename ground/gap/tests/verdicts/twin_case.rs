//! Cases whose log is of a motion of the twin.

use std::{fmt::Write, fs};

use tempfile::TempDir;
use twin::{
    effect::{Active, Cause, Locality, by_name},
    environment::Environment,
    kinematics::Motion,
    predict::{Channel, Scene, Twin, UnitDescription, emems, thesis_slot_s},
};

/// \[s\] from row to row.
const ROW_S: f64 = 0.2;

/// An effect with these parameters.
pub fn active(effect: &str, locality: Locality, theta: &[f64]) -> Active {
    Active {
        cause: Cause {
            effect: by_name(effect).expect("an effect"),
            locality,
            variant: 0.0,
        },
        theta: theta.to_vec(),
    }
}

/// A log of a unit along a motion.
pub struct Log<'a> {
    /// The unit as its file describes it.
    pub described: UnitDescription,
    /// As it is.
    pub real: UnitDescription,
    /// What else it has.
    pub active: &'a [Active],
    /// What a channel of the unit reads beyond that at an instant \[s\] of the motion, in its physical unit: what no effect of the library is.
    pub beyond: &'a dyn Fn(&Channel, f64) -> f64,
    /// \[s\] of the motion where the log counts from.
    pub zero_s: f64,
    /// What moves it.
    pub motion: &'a dyn Motion,
    /// Where.
    pub environment: Environment,
    /// \[s\] from one instant of the motion to another.
    pub span_s: (f64, f64),
}

impl<'a> Log<'a> {
    /// Of the nominal unit from one instant \[s\] of the motion to another, counted as the motion is.
    pub fn nominal(motion: &'a dyn Motion, environment: Environment, span_s: (f64, f64)) -> Self {
        Self {
            described: emems(thesis_slot_s),
            real: emems(thesis_slot_s),
            active: &[],
            beyond: &|_, _| 0.0,
            zero_s: 0.0,
            motion,
            environment,
            span_s,
        }
    }

    /// As a case, each reading with its noise times a number of `normal`; case.toml has the lines `first` before the environment and `last` after
    /// it.
    pub fn folder(&self, name: &str, mut normal: impl FnMut() -> f64, first: &str, last: &str) -> TempDir {
        let (environment, (from_s, to_s)) = (self.environment, self.span_s);
        let scene = Scene::new(self.motion, &environment, from_s - 2.0, to_s + 2.0, 0.01);
        let rows = ((to_s - from_s) / ROW_S) as usize;
        let starts_s: Vec<f64> = (0..rows).map(|row| from_s + ROW_S * row as f64).collect();
        let mut real = self.real.clone();
        // A part stops what it measures with its noise; the log does that below.
        (real.channels.iter_mut()).for_each(|channel| channel.range = [f64::NEG_INFINITY, f64::INFINITY]);
        let twin = Twin::new(real, environment, scene, starts_s.clone()).expect("a twin");
        let readings = twin.predict(self.active);
        let channels = &self.described.channels;
        let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
        let mut measured = format!("t_s,{}\n", names.join(","));
        for (row, start_s) in starts_s.iter().enumerate() {
            let cells = channels.iter().zip(&readings);
            let cells = cells.map(|(channel, own)| {
                let beyond = (self.beyond)(channel, start_s + channel.slot_s);
                format!(
                    "{:.9}",
                    channel.logged(own[row] + beyond + channel.noise_sigma * normal())
                )
            });
            let _ = writeln!(
                measured,
                "{:.1},{}",
                start_s - self.zero_s,
                cells.collect::<Vec<_>>().join(",")
            );
        }
        let field = environment.field_n_ut;
        let case = format!(
            "format = \"gap-case/1\"\nname = \"{name}\"\nkind = \"csv\"\nunit = \"unit.toml\"\nmeasured = \"measured.csv\"\n\
             {first}[environment]\ngravity_m_s2 = {}\nlatitude_deg = {}\nfield_n_ut = [{}, {}, {}]\n{last}",
            environment.gravity,
            environment.latitude.to_degrees(),
            field.x,
            field.y,
            field.z
        );
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in [
            ("case.toml", case),
            ("unit.toml", self.described.text()),
            ("measured.csv", measured),
        ] {
            fs::write(folder.path().join(name), text).expect("a file");
        }
        folder
    }
}

/// The text of motion.csv: attitude and place every 10 ms, over so long from an instant of the motion on \[s\].
pub fn recorded(motion: &dyn Motion, from_s: f64, seconds: f64) -> String {
    let mut text = String::from("t_s,qw,qx,qy,qz,px_m,py_m,pz_m\n");
    for row in 0..=(seconds / 0.01) as u32 {
        let t_s = 0.01 * f64::from(row);
        let (q, p) = (motion.at(from_s + t_s).attitude.q_nb, motion.position_n(from_s + t_s));
        let _ = writeln!(
            text,
            "{t_s:.2},{:.9},{:.9},{:.9},{:.9},{:.7},{:.7},{:.7}",
            q.w, q.i, q.j, q.k, p.x, p.y, p.z
        );
    }
    text
}
