//! What the unit is made to feel: a motion by name, or a file.
//!
//! In: what the command line names. Out: the truth of a flight and what to call it. Refuses a name that no motion has, and
//! what the readers of files refuse, with file and line.

use std::{borrow::Cow, path::Path, sync::Arc};

use emems::site::Site;
use logs::{
    plausible::{self, Implausible},
    recording::Row,
    units::Units,
};
use packets::magnitude::Kind;
use trials::{
    draw::Draw,
    motion::{Style, Wander},
};
use twin::{
    environment::{Environment, World},
    motion::{self, AnyWorld, LIST, Recorded},
    recording::{self, FileError, Recording},
    truth::{Truth, TruthSource},
};

use crate::{
    case::text,
    plan::FlyArguments,
    site::{self, SiteArguments},
};

/// Flown when nothing is named.
const DEFAULT_MOTION: &str = "rocket";

/// The motion of the trials that turns and moves about: the one that brings out most of what a unit may have.
const HAND: (&str, &str) = (
    "hand",
    "carried about by hand: turns about all axes, ways of decimetres, rests between",
);

/// \[s\] it lasts, and the draw it is of.
const HAND_S: f64 = 600.0;
const HAND_DRAW: u64 = 1;

/// A source of truth.
pub struct Source {
    /// What its folder is called.
    pub name: String,
    /// What it is, in one line.
    pub about: String,
    /// The truth.
    pub truth: Arc<dyn TruthSource>,
    /// Where a launch crew tells the unit that it is; one without a known field is not told, but compiled in.
    pub site: Site,
    /// Why the unit is not told where a recorded motion was, and what to do about it.
    pub untold: Option<String>,
    /// Motion and place apart; a recording of sensors has none.
    pub world: Option<AnyWorld>,
}

impl Source {
    fn of(name: String, about: String, world: AnyWorld, site: Site) -> Self {
        Source {
            name,
            about,
            truth: Arc::new(world.clone()),
            world: Some(world),
            site,
            untold: None,
        }
    }
}

/// Of a recorded motion that was in the laboratory, or where nobody says.
const IN_LABORATORY: &str =
    "the laboratory's, which is compiled in; --latitude-deg, --gravity-m-s2 and --field-n-ut tell the unit of another";

/// Why there is nothing to fly.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// No motion has this name.
    #[error("no motion is called {0}; there are {names}", names = names())]
    NoSuchMotion(String),
    /// Its numbers can hardly be in their units.
    #[error("{file}: {why}")]
    Implausible {
        /// Which.
        file: String,
        /// What is wrong, and what to do.
        why: Box<Implausible>,
    },
    /// A file cannot be flown.
    #[error(transparent)]
    File(#[from] FileError),
}

/// What the command line names.
///
/// # Errors
/// When there is no such thing.
pub fn open(arguments: &FlyArguments) -> Result<Source, SourceError> {
    match (&arguments.recording, &arguments.motion_file) {
        (Some(path), _) => Ok(Source {
            name: stem(path),
            about: format!("recording of a real unit, {}", file_name(path)),
            truth: Arc::new(recording(path, &arguments.units)?),
            site: Site::LABORATORY,
            untold: None,
            world: None,
        }),
        (_, Some(path)) => Ok(of_file(path, &arguments.site)?),
        _ => by_name(arguments.motion.as_deref().unwrap_or(DEFAULT_MOTION)),
    }
}

/// The motion of a file, at the place that was named, or that the case beside it says. One whose case says that it is the record of an
/// instrument that errs is smoothed as the diagnosis smooths it: differentiated as it is, a camera's noise would shake the unit.
fn of_file(path: &Path, asked: &SiteArguments) -> Result<Source, FileError> {
    let record = Recorded::open(path)?;
    let beside = text::beside(path);
    let motion = match beside.reference.attitude_sigma_rad > 0.0 {
        true => record.used(),
        false => record,
    };
    let environment = asked.environment(&beside.environment);
    let (site, untold) = match site::told(&environment) {
        Ok(Site::LABORATORY) => (Site::LABORATORY, Some(IN_LABORATORY.into())),
        Ok(site) => (site, None),
        Err(fault) => (
            Site::LABORATORY,
            Some(format!(
                "not told, since {fault}; the unit estimates at the laboratory's, which is compiled in"
            )),
        ),
    };
    let about = format!("recorded motion, {}, at {}", file_name(path), site::about(&environment));
    let world = World {
        motion: Arc::new(motion) as Arc<dyn motion::Motion>,
        environment,
    };
    Ok(Source {
        untold,
        ..Source::of(stem(path), about, world, site)
    })
}

/// A recording whose numbers can be in their units, or are in those that were said.
fn recording(path: &Path, units: &Units) -> Result<Recording, SourceError> {
    let recording = Recording::open(path)?;
    let row = |(t_s, truth): (f64, Truth)| Row {
        t_s,
        rate_b: truth.rate_b,
        acc_b: Some(truth.force_b),
        mag_b: Some(truth.field_b_ut),
        reference_nb: None,
        scored: true,
    };
    plausible::in_si(recording.samples().map(row).collect(), units).map_err(|why| SourceError::Implausible {
        file: file_name(path).into(),
        why: Box::new(why),
    })?;
    Ok(recording.in_units(recording::Units {
        time: units.size(Kind::Time),
        rate: units.size(Kind::Rate),
        force: units.size(Kind::Force),
        field: units.size(Kind::Field),
    }))
}

/// Lists the motions that can be flown
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct List {
    /// Print them as JSON; a motion without end has no duration_s
    #[arg(long)]
    pub json: bool,
}

/// `ground sources`: the motions, a line each, or as JSON.
pub fn list(arguments: List) -> String {
    let named = LIST.iter().map(|named| {
        let lasts_s = motion::by_name(named.name).and_then(|truth| truth.duration_s());
        (named.name, lasts_s, named.about)
    });
    let all = named.chain([(HAND.0, Some(HAND_S), HAND.1)]);
    if arguments.json {
        let each =
            all.map(|(name, lasts_s, about)| serde_json::json!({"name": name, "duration_s": lasts_s, "about": about}));
        return format!("{:#}\n", serde_json::Value::from_iter(each));
    }
    let line = |(name, lasts_s, about): (&str, Option<f64>, &str)| {
        let lasts = lasts_s.map_or("no end".into(), |lasts_s| format!("{lasts_s:.0} s"));
        format!("{name:12}{lasts:>8}  {about}\n")
    };
    all.map(line).collect()
}

fn by_name(name: &str) -> Result<Source, SourceError> {
    if name == HAND.0 {
        let wander = Wander::draw(Style::Hand, false, HAND_S, &mut Draw::new(HAND_DRAW));
        let world = World {
            motion: Arc::new(wander) as Arc<dyn motion::Motion>,
            environment: Environment::laboratory(),
        };
        return Ok(Source::of(name.into(), HAND.1.into(), world, Site::LABORATORY));
    }
    let named = LIST.iter().find(|named| named.name == name);
    match (named, motion::world_by_name(name), motion::by_name(name)) {
        (Some(named), Some(world), Some(truth)) => Ok(Source {
            // What shakes the unit is no motion of its centre.
            truth: truth.into(),
            ..Source::of(name.into(), named.about.into(), world, named.site)
        }),
        _ => Err(SourceError::NoSuchMotion(name.into())),
    }
}

/// A file's name without its folder, which is nobody's business on a page that may be passed on.
fn file_name(path: &Path) -> Cow<'_, str> {
    path.file_name().unwrap_or_default().to_string_lossy()
}

/// A file's name up to its first dot.
fn stem(path: &Path) -> String {
    let name = file_name(path);
    name.split('.').find(|part| !part.is_empty()).unwrap_or("file").into()
}

fn names() -> String {
    [&LIST.map(|named| named.name)[..], &[HAND.0]].concat().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_a_motion_there_is() {
        assert_eq!(
            by_name(DEFAULT_MOTION).map(|source| source.name).ok().as_deref(),
            Some("rocket")
        );
    }

    #[test]
    fn an_unknown_motion_is_refused_with_the_known_ones() {
        let refusal = by_name("roket")
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default();
        assert!(
            refusal.starts_with("no motion is called roket; there are still, "),
            "{refusal}"
        );
    }

    #[test]
    fn a_recording_in_another_unit_is_refused_until_its_unit_is_said() {
        let place = tempfile::tempdir().expect("temporary folder");
        let path = place.path().join("log.csv");
        let rows: String = (0..40)
            .map(|k| format!("{},0,0,0,0,0,1.0,20,0,-40\n", 0.1 * f64::from(k)))
            .collect();
        std::fs::write(
            &path,
            format!("t_s,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z,mag_x,mag_y,mag_z\n{rows}"),
        )
        .expect("written");
        let refusal = recording(&path, &Units::default()).expect_err("g").to_string();
        assert!(
            refusal.contains("log.csv: specific force") && refusal.contains("--forces g"),
            "{refusal}"
        );
        let units = Units {
            forces: Kind::Force.unit("g").ok(),
            ..Units::default()
        };
        let force_b = recording(&path, &units).expect("g").at(1.0).force_b;
        assert!((force_b.z + 9.80665).abs() < 1e-9, "{force_b}");
    }

    #[test]
    fn a_folder_is_called_after_the_file() {
        assert_eq!(stem(Path::new("/data/07_fast.B.csv.gz")), "07_fast");
        assert_eq!(stem(Path::new(".hidden")), "hidden");
    }

    #[test]
    fn every_motion_is_listed() {
        let text = list(List { json: false });
        assert_eq!(text.lines().count(), LIST.len() + 1);
        assert!(text.contains("no end"));
        let listed: serde_json::Value = serde_json::from_str(&list(List { json: true })).expect("JSON");
        assert_eq!(listed.as_array().map(Vec::len), Some(LIST.len() + 1));
        assert!(listed[0]["about"].is_string(), "{listed}");
    }
}
