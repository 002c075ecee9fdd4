//! What flies the unit. Here: its code on this computer.
//!
//! A board takes the plant, the faults and the bench of a flight. Out: remarks on what befell the unit, as rows of the summary. The
//! board that needs an emulator is in `ground`.

use std::error::Error;

use emems::unit::Settings;
use twin::{
    host,
    part::Nanos,
    plant::Plant,
    run::{Bench, Scheduled},
};

/// A row of the summary.
pub type Remark = (&'static str, String);

/// Why a board, or whoever sits at its umbilical, gave up.
pub type Trouble = Box<dyn Error + Send + Sync>;

/// Flies a plant, with faults, until an instant or until the bench says stop.
pub type Fly = Box<dyn FnOnce(Plant, &[Scheduled], Nanos, &mut dyn Bench) -> Result<Vec<Remark>, Trouble> + Send>;

/// What a unit is flown by.
pub struct Board {
    /// As the summary calls it.
    pub name: String,
    /// Its flight.
    pub fly: Fly,
}

/// The unit's code on this computer, in virtual time.
pub fn host() -> Board {
    Board {
        name: "host, virtual time".into(),
        fly: Box::new(|plant, faults, end, bench| {
            let report = host::fly(plant, Settings::NOMINAL, faults, end, bench);
            let resets = report.resets.iter().map(|(at, cause)| reset(*at, cause));
            Ok(resets.collect())
        }),
    }
}

/// A reset, as a row.
pub fn reset(at: Nanos, cause: &dyn std::fmt::Debug) -> Remark {
    ("reset", format!("{:.3} s, {cause:?}", 1e-9 * at as f64))
}
