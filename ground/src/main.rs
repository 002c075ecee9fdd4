//! `ground`: the one host program.

use clap::Parser;

/// The ground side of the e-MEMS attitude sensor unit.
#[derive(Parser)]
#[command(name = "ground", version)]
enum Command {
    Console(ground::console::Arguments),
    Decode(ground::decode::Arguments),
}

fn main() -> anyhow::Result<()> {
    match Command::parse() {
        Command::Console(arguments) => Ok(ground::console::console(&arguments)?),
        Command::Decode(arguments) => Ok(ground::decode::decode(&arguments)?),
    }
}
