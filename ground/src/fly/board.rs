//! What flies the unit: its release image on the emulated board, or its code on this computer.
//!
//! The image is the file that was named; else the one that the program was built with (`EMEMS_IMAGE`, see `build.rs`); else it is
//! built from the sources that the program was built from. Both take the same plant, faults and bench. Out: remarks on what befell
//! the unit, as rows of the summary.

use std::path::Path;

use emems::{estimate::Site, unit::Settings};
use emulated::{Image, image::ImageError};
use twin::{
    host,
    part::Nanos,
    plant::Plant,
    run::{Bench, Scheduled},
};

/// Flies a plant, with faults, until an instant or until the bench says stop.
pub type Flight = Box<dyn FnOnce(Plant, &[Scheduled], Nanos, &mut dyn Bench) -> Result<Vec<Remark>, BoardError> + Send>;

/// A row of the summary.
pub type Remark = (&'static str, String);

/// Why a board could not fly.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    /// There is no image.
    #[error("there is no image to fly: {0}; --host flies without one")]
    Image(#[from] ImageError),
    /// The emulator gave up.
    #[error(transparent)]
    Emulated(#[from] emulated::Error),
}

/// The unit's code on this computer, in virtual time, told where it is.
pub fn host(site: Site) -> Flight {
    Box::new(move |plant, faults, end, bench| {
        let settings = Settings {
            site,
            ..Settings::NOMINAL
        };
        let report = host::fly(plant, settings, faults, end, bench);
        let resets = report.resets.iter().map(|(at, cause)| reset(*at, cause));
        Ok(resets.collect())
    })
}

/// The image that the program was built with; empty for none.
const WITHIN: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/image.elf"));

/// The release image: the one in `file`, else the one within, else the sources'.
///
/// # Errors
/// When it cannot be read or built.
pub fn release(file: Option<&Path>) -> Result<Image, ImageError> {
    match file {
        Some(file) => Image::read(file),
        None if !WITHIN.is_empty() => Image::new(Path::new("the image in this program"), WITHIN.to_vec()),
        None => emulated::image::build(),
    }
}

/// The release image on the emulated board.
///
/// # Errors
/// See [`release`].
pub fn image(file: Option<&Path>) -> Result<Flight, BoardError> {
    Ok(on_emulated(release(file)?))
}

fn on_emulated(image: Image) -> Flight {
    Box::new(move |plant, faults, end, bench| {
        let report = emulated::fly(&image, plant, faults, end, bench)?;
        let resets = report.resets.iter().map(|(at, cause)| reset(*at, cause));
        let unanswered = report
            .unanswered
            .iter()
            .map(|access| ("unanswered access", access.clone()));
        Ok(resets.chain(unanswered).collect())
    })
}

fn reset(at: Nanos, cause: &dyn std::fmt::Debug) -> Remark {
    ("reset", format!("{:.3} s, {cause:?}", 1e-9 * at as f64))
}
