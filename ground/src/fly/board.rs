//! What flies the unit: its release image on the emulated board.
//!
//! The image is the file that was named; else the one that the program was built with (`EMEMS_IMAGE`, see `build.rs`); else it is
//! built from the sources that the program was built from. Out: remarks on what befell the unit, as rows of the summary.

use std::path::Path;

use emulated::{Image, image::ImageError};
use flight::board::{Board, Trouble, reset};

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
        None => emulated::toolchain::build(),
    }
}

/// The release image on the emulated board.
///
/// # Errors
/// See [`release`].
pub fn image(file: Option<&Path>) -> Result<Board, Trouble> {
    let image = release(file).map_err(BoardError::from)?;
    let what = file.map_or("release image".into(), |file| file.display().to_string());
    Ok(Board {
        name: format!("emulated STM32F4, {what}"),
        fly: Box::new(move |plant, faults, end, bench| {
            let report = emulated::fly(&image, plant, faults, end, bench).map_err(BoardError::from)?;
            let resets = report.resets.iter().map(|(at, cause)| reset(*at, cause));
            let unanswered = report
                .unanswered
                .iter()
                .map(|access| ("unanswered access", access.clone()));
            Ok(resets.chain(unanswered).collect())
        }),
    })
}
