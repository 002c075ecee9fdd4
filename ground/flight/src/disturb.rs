//! What a flight is of: the unit as designed or as described, with what `--with` does to it.
//!
//! In: the command line and the world. Out: a [`Scene`] of [`trials`], whose physics is written apart from the effect library, so
//! that the diagnosis is never checked against its own equations; `--unit` alone is the twin itself ([`crate::taught`]).
//!
//! Refused: what [`Refused`] and [`TaughtError`] list.

use std::sync::Arc;

use trials::{
    draw::Draw,
    followed::Follower,
    scene::Scene,
    strike::{self, Refused, Struck},
};
use twin::{motion::AnyWorld, plant::Views, predict::UnitDescription, truth::TruthSource};

use crate::{
    case::LONGEST_S,
    plan::FlyArguments,
    taught::{self, TaughtError},
};

/// Why a unit cannot be flown as asked.
#[derive(Debug, thiserror::Error)]
pub enum DisturbError {
    /// What `--with` asks for.
    #[error("--with {words}: {refused}")]
    With {
        /// As written.
        words: String,
        /// Why not.
        refused: Refused,
    },
    /// What `--unit` describes.
    #[error(transparent)]
    Taught(#[from] TaughtError),
    /// A recording tells what sensors felt, not how they turned.
    #[error("--{0} needs a motion; a recording of sensors does not say how the unit was turned")]
    NoMotion(&'static str),
}

/// A scene to be flown.
pub struct Prepared {
    /// What the parts see.
    pub scene: Scene,
    /// What was done to it.
    pub struck: Vec<Struck>,
    /// As `--unit` describes it.
    pub unit: Option<UnitDescription>,
    /// What is to be said before it flies.
    pub warnings: Vec<String>,
}

/// Prepares a flight; `None` where there is no motion, so that it can be no case.
///
/// # Errors
/// When it cannot be flown as asked.
pub fn prepare(
    arguments: &FlyArguments,
    world: Option<&AnyWorld>,
    source: &Arc<dyn TruthSource>,
    duration_s: f64,
) -> Result<Option<Prepared>, DisturbError> {
    let Some(world) = world else {
        return match (arguments.unit.is_some(), arguments.with.is_empty()) {
            (true, _) => Err(DisturbError::NoMotion("unit")),
            (false, false) => Err(DisturbError::NoMotion("with")),
            (false, true) => Ok(None),
        };
    };
    let site = world.environment;
    let unit = arguments.unit.as_deref().map(UnitDescription::open).transpose();
    let unit = unit.map_err(TaughtError::from)?;
    let nominal = Views::of(source);
    let views = match &unit {
        Some(unit) => taught::views(&nominal, unit, &world.motion, site, duration_s)?,
        None => nominal,
    };
    let followed = Arc::new(Follower::new(world.motion.clone(), duration_s.min(LONGEST_S) + 1.0));
    let spare = || Scene::of(followed.clone(), duration_s, site, views.clone());
    let mut scene = spare();
    let mut warnings = Vec::new();
    for name in unit.iter().flat_map(taught::not_flown) {
        warnings.push(format!(
            "{name} is not flown: it changes how readings scatter, and parts scatter as they are"
        ));
    }
    let is_warm = (0..=10).map(|tenth| source.at(0.1 * f64::from(tenth) * duration_s).temperature_c);
    let [least_c, most_c] = is_warm.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], c| {
        [least.min(c), most.max(c)]
    });
    let mut struck = Vec::new();
    for (number, wish) in arguments.with.iter().enumerate() {
        let draw = Draw::new(arguments.seed).stream(number as u64);
        let done = strike::strike(&mut scene, wish, &spare, &draw).map_err(|refused| DisturbError::With {
            words: wish.name.to_owned(),
            refused,
        })?;
        if strike::is_warm(wish.name) && most_c - least_c < 1.0 {
            warnings.push(format!(
                "{} needs a temperature that changes, which this motion has not: nothing will show",
                wish.name
            ));
        }
        struck.push(done);
    }
    Ok(Some(Prepared {
        scene,
        struck,
        unit,
        warnings,
    }))
}
