//! `ground drill` alone, without the rest of the ground program to compile.

use clap::Parser;

#[derive(Parser)]
struct Command {
    #[command(flatten)]
    arguments: drill::DrillArguments,
}

fn main() -> Result<(), drill::DrillError> {
    drill::run(&Command::parse().arguments, || {
        Err("the image is drilled by the ground program".into())
    })
}
