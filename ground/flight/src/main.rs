//! `cargo fly`: a flight on the host, whose page is there at once; then the image's flight, for which the rest is built.
//!
//! In: the words of `ground fly`. Out: a folder with the host's flight. Unless `--host` was said, `ground fly` is then built and run with the
//! same words: it takes the folder's place when the image sent the same packets. What the host cannot show (the console, a named image)
//! goes to `ground fly` at once.

mod rest;

use std::{error::Error, process::ExitCode};

use clap::Parser;
use flight::{FlyError, Landed, board, exit, fly_until, interrupt::Interrupt, plan::FlyArguments};

#[derive(Parser)]
#[command(name = "fly", bin_name = "cargo fly")]
struct Words {
    #[command(flatten)]
    arguments: FlyArguments,
}

fn main() -> ExitCode {
    exit::without_panic_on_closed_output();
    let Words { arguments } = Words::parse();
    match fly(&arguments) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            let is_bad_input = error.downcast_ref().is_some_and(FlyError::is_bad_input);
            ExitCode::from(if is_bad_input { 2 } else { 1 })
        }
    }
}

fn fly(arguments: &FlyArguments) -> Result<ExitCode, Box<dyn Error>> {
    if arguments.console || arguments.image.is_some() || arguments.in_place_of.is_some() {
        return Ok(rest::fly(None)?);
    }
    let interrupt = Interrupt::listen()?;
    if arguments.host {
        let landed = on_host(arguments, &interrupt, "")?;
        print!("{}", landed.text(arguments, &landed.page()));
        return Ok(ExitCode::SUCCESS);
    }
    // Real time is for whoever watches the board.
    let first = FlyArguments {
        host: true,
        real_time: false,
        ..arguments.clone()
    };
    let landed = on_host(&first, &interrupt, "; the image's flight takes this one's place")?;
    if !landed.whole || interrupt.is_raised() {
        print!("{}", landed.text(arguments, &landed.page()));
        return Ok(ExitCode::SUCCESS);
    }
    // Standard output is for the flight that was asked for.
    eprintln!("{}\non the host; the image's flight follows", landed.page().display());
    Ok(rest::fly(Some(&landed.folder))?)
}

/// Flies on the host; `follows` is said of it in the summary.
fn on_host(arguments: &FlyArguments, interrupt: &Interrupt, follows: &str) -> Result<Landed, FlyError> {
    let board = || {
        let mut board = board::host();
        board.name.push_str(follows);
        Ok(board)
    };
    fly_until(arguments, interrupt, board, |_, take_off| take_off(None))
}
