//! What `ground drill --image` flies: the release image on the emulated board.

use drill::OnImage;
use emulated::{Options, flight::fly_keeping};
use twin::host::HostReport;

use crate::fly::board;

/// Takes the image, or builds it; flies it as often as asked.
///
/// # Errors
/// When there is none.
pub fn on_image() -> Result<Box<OnImage<'static>>, String> {
    let image = board::release(None).map_err(|error| error.to_string())?;
    Ok(Box::new(move |plant, strokes, end, bench| {
        let (report, plant) =
            fly_keeping(&Options::default(), &image, plant, strokes, end, bench).map_err(|error| error.to_string())?;
        let told = HostReport {
            flown: report.flown,
            resets: report.resets,
            struck: report.struck,
        };
        Ok((told, plant.lock().nand.cells.clone()))
    }))
}
