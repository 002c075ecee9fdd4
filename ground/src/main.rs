//! `ground`: the one host program.

use clap::Parser;

/// The ground side of the e-MEMS attitude sensor unit.
#[derive(Parser)]
#[command(name = "ground", version)]
enum Command {
    Fly(ground::fly::plan::Arguments),
    /// List the motions that can be flown
    Sources,
    Decode(ground::decode::Arguments),
    /// Talk to the unit over its umbilical, see all sensors, keep everything it says
    Console(ground::console::Arguments),
}

fn main() -> anyhow::Result<()> {
    match Command::parse() {
        Command::Fly(arguments) => Ok(ground::fly::fly(&arguments)?),
        Command::Sources => {
            print!("{}", ground::fly::source::list());
            Ok(())
        }
        Command::Decode(arguments) => Ok(ground::decode::decode(&arguments)?),
        Command::Console(arguments) => Ok(ground::console::console(&arguments)?),
    }
}
