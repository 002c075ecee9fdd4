//! `ground attitude` without the rest of the ground program, which takes minutes to build: the same arguments.

use clap::Parser;

#[derive(Parser)]
struct Command {
    #[command(flatten)]
    arguments: attitude::AttitudeArguments,
}

fn main() -> Result<(), attitude::AttitudeError> {
    attitude::run(&Command::parse().arguments)
}
