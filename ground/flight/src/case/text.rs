//! The text of `case.toml`, after the case format.
//!
//! In: what was flown or logged, the place, how well the reference knows, the windows. Out: the file's text. Of a case that is there
//! already two things are read: where its motion was, and how well its reference knows it ([`beside`]).

use std::{
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

use serde::Deserialize;
use twin::environment::Environment;

use super::windows::Parted;

/// File names in a case's folder.
pub const CASE: &str = "case.toml";
/// The unit's description.
pub const UNIT: &str = "unit.toml";
/// What the unit was made to do.
pub const MOTION: &str = "motion.csv";

/// What `case.toml` says.
pub struct Text<'a> {
    /// What the case is called in verdicts.
    pub name: &'a str,
    /// `packets` or `csv`.
    pub kind: &'a str,
    /// What anyone on the bench could see.
    pub about: &'a str,
    /// File of the log.
    pub measured: &'a str,
    /// The place.
    pub environment: &'a Environment,
    /// \[uT\] how well the field is known; 0 for exactly.
    pub field_sigma_ut: f64,
    /// \[rad\] and \[m\] of the reference; zeros for an exact one.
    pub reference: [f64; 2],
    /// What is fitted and what judges.
    pub windows: &'a Parted,
}

impl Text<'_> {
    /// The file.
    pub fn toml(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, text: &mut String) -> std::fmt::Result {
        let quoted = |words: &str| toml::Value::String(words.into()).to_string();
        writeln!(text, "format = \"gap-case/1\"\nname = {}", quoted(self.name))?;
        writeln!(text, "kind = \"{}\"\nabout = {}", self.kind, quoted(self.about))?;
        writeln!(
            text,
            "unit = \"{UNIT}\"\nmeasured = {}\nmotion = \"{MOTION}\"\n",
            quoted(self.measured)
        )?;
        let Environment {
            gravity,
            latitude,
            field_n_ut: field,
            temperature_c,
        } = self.environment;
        writeln!(
            text,
            "[environment]\ngravity_m_s2 = {gravity:?}\nlatitude_deg = {:.6}",
            latitude.to_degrees()
        )?;
        writeln!(text, "field_n_ut = [{:.4}, {:.4}, {:.4}]", field.x, field.y, field.z)?;
        if self.field_sigma_ut > 0.0 {
            writeln!(text, "field_sigma_ut = {:.3}", self.field_sigma_ut)?;
        }
        writeln!(text, "temperature_c = {temperature_c:?}\n")?;
        let [attitude_rad, position_m] = self.reference;
        if attitude_rad > 0.0 {
            writeln!(text, "[reference]\nattitude_sigma_rad = {attitude_rad:?}")?;
            if position_m > 0.0 {
                writeln!(text, "position_sigma_m = {position_m:?}")?;
            }
            writeln!(text)?;
        }
        writeln!(
            text,
            "[windows]\nfit = {}\nhold = {}",
            spans(&self.windows.fit),
            spans(&self.windows.hold)
        )
    }
}

fn spans(spans: &[[f64; 2]]) -> String {
    let pairs: Vec<String> = spans.iter().map(|[from, to]| format!("[{from:?}, {to:?}]")).collect();
    format!("[{}]", pairs.join(", "))
}

/// What the case beside a motion says of it.
#[derive(Debug, Default, Deserialize)]
pub struct CaseBeside {
    /// How well its attitude is known.
    #[serde(default)]
    pub reference: ReferenceBeside,
    /// Where it was.
    #[serde(default)]
    pub environment: PlaceBeside,
}

/// How well a motion is known.
#[derive(Debug, Default, Deserialize)]
pub struct ReferenceBeside {
    /// \[rad\] of its attitude; 0 where that is exact.
    #[serde(default)]
    pub attitude_sigma_rad: f64,
}

/// Where a motion was, as far as that is said.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub struct PlaceBeside {
    /// [m/s2]
    pub gravity_m_s2: Option<f64>,
    /// \[deg\] north positive.
    pub latitude_deg: Option<f64>,
    /// \[uT\] north, east, down.
    pub field_n_ut: Option<[f64; 3]>,
    /// \[degC\]
    pub temperature_c: Option<f64>,
}

/// What the case beside a motion says; nothing where no case beside it has this motion.
pub fn beside(motion: &Path) -> CaseBeside {
    #[derive(Deserialize)]
    struct Case {
        motion: PathBuf,
        #[serde(flatten)]
        beside: CaseBeside,
    }
    let text = fs::read_to_string(motion.with_file_name(CASE)).unwrap_or_default();
    match toml::from_str::<Case>(&text) {
        Ok(case) if case.motion.file_name() == motion.file_name() => case.beside,
        _ => CaseBeside::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_where_and_as_good_as_the_case_beside_it_says() {
        let place = tempfile::tempdir().expect("temporary folder");
        let motion = place.path().join(MOTION);
        let sigma_rad = |motion: &Path| beside(motion).reference.attitude_sigma_rad;
        assert_eq!(sigma_rad(&motion), 0.0, "no case");
        let environment = Environment::alcantara();
        let windows = Parted {
            fit: vec![[0.0, 1.0]],
            hold: vec![[1.0, 2.0]],
        };
        let text = Text {
            name: "test",
            kind: "packets",
            about: "",
            measured: "packets.txt",
            environment: &environment,
            field_sigma_ut: 0.0,
            reference: [2e-4, 1e-4],
            windows: &windows,
        };
        fs::write(place.path().join(CASE), text.toml()).expect("case");
        assert_eq!(sigma_rad(&motion), 2e-4);
        let PlaceBeside {
            gravity_m_s2,
            latitude_deg,
            field_n_ut,
            temperature_c,
        } = beside(&motion).environment;
        assert_eq!(
            (gravity_m_s2, latitude_deg, field_n_ut, temperature_c),
            (Some(9.7804), Some(-2.32), Some([24.23, -9.22, -4.07]), Some(30.0))
        );
        let other = place.path().join("other.csv");
        assert_eq!(sigma_rad(&other), 0.0, "another motion");
        assert!(beside(&other).environment.gravity_m_s2.is_none());
    }
}
