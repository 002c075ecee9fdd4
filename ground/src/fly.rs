//! `ground fly`: the unit in the air, watched, on the emulated board or on the host.
//!
//! In: [`FlyArguments`]. Out: what [`flight`] leaves, and the summary on standard output. Here is what `cargo fly` builds after its first
//! page: the image's board, the console at its umbilical, and the comparison with the first flight, whose place it takes.

mod beside;
pub mod board;
mod replace;

use std::error::Error;

use flight::{FlyError, Landed, fly_until, interrupt::Interrupt, plan::FlyArguments};

/// Runs `ground fly`.
///
/// # Errors
/// See [`FlyError`]; and when the image did not send what the host did.
pub fn fly(arguments: &FlyArguments) -> Result<(), Box<dyn Error>> {
    let landed = flown(arguments, &Interrupt::listen()?)?;
    let page = match &arguments.in_place_of {
        Some(first) if landed.whole => replace::replace(first, &landed.folder)?,
        _ => landed.page(),
    };
    print!("{}", landed.text(arguments, &page));
    Ok(())
}

/// Flies until the end or an interrupt.
///
/// # Errors
/// See [`FlyError`].
pub fn flown(arguments: &FlyArguments, interrupt: &Interrupt) -> Result<Landed, FlyError> {
    let image = arguments.image.as_deref();
    let board = || match arguments.host {
        true => Ok(flight::board::host()),
        false => board::image(image),
    };
    fly_until(arguments, interrupt, board, |folder, take_off| {
        match arguments.console {
            true => beside::console(arguments, folder, take_off),
            false => take_off(None),
        }
    })
}
