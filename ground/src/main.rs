//! `ground`: the one host program.

use clap::Parser;

/// The ground side of the e-MEMS unit.
#[derive(Parser)]
#[command(name = "ground")]
enum Command {
    /// Talk to the unit over its umbilical, see all sensors, keep everything it says
    Console(ground::console::Arguments),
}

fn main() -> anyhow::Result<()> {
    match Command::parse() {
        Command::Console(arguments) => Ok(ground::console::console(&arguments)?),
    }
}
