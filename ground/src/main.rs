//! `ground`: the one host program.

use std::{error::Error, process::ExitCode};

use clap::{CommandFactory, Parser};

/// The ground side of the e-MEMS attitude sensor unit.
#[derive(Parser)]
#[command(name = "ground", version = env!("GROUND_VERSION"), after_help = ground::exit::HELP)]
struct Words {
    /// Print no report: only tables and JSON that were asked for, warnings and errors. Files are written, exit codes hold
    #[arg(long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    Fly(flight::plan::FlyArguments),
    Sources(flight::source::List),
    /// Makes a gap case of a real unit's log, and says what a case lacks
    #[command(subcommand)]
    Case(ground::case::Step),
    Compare(ground::compare::CompareArguments),
    Demo(ground::demo::DemoArguments),
    Effects(ground::effects::EffectsArguments),
    Decode(ground::decode::DecodeArguments),
    Drill(drill::DrillArguments),
    /// Talks to the unit over its umbilical, shows all sensors live, keeps everything it says
    Console(ground::console::ConsoleArguments),
    Acceptance(ground::acceptance::AcceptanceArguments),
    Gap(Gap),
    Size(ground::size::SizeArguments),
    Sbom(ground::sbom::SbomArguments),
    Xtce(ground::xtce::XtceArguments),
    Attitude(attitude::AttitudeArguments),
    Dump(recorder::dump::DumpArguments),
    Recover(recorder::recover::RecoverArguments),
    Allan(bench::allan::AllanArguments),
    Calibrate(bench::calibrate::CalibrateArguments),
    Calibration(bench::calibration::CalibrationArguments),
    Design(bench::design::command::DesignArguments),
    Report(bench::reproduction::ReportArguments),
    Completions(ground::words::Completions),
    Man(ground::words::Man),
}

/// Finds what the twin of a unit lacks
///
/// Compares a unit's log with its nominal twin along a known motion: is there a gap beyond noise and calibration, where,
/// which physical effect makes it, how far it shrinks on held-out data once that effect is in, and what to measure next.
/// `blind` checks it on cases whose cause is withheld.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
struct Gap {
    #[command(flatten)]
    case: Option<gap::GapArguments>,
    #[command(subcommand)]
    challenge: Option<Challenge>,
}

#[derive(clap::Subcommand)]
enum Challenge {
    Blind(trials::command::BlindArguments),
}

fn main() -> ExitCode {
    flight::exit::without_panic_on_closed_output();
    let words = Words::parse();
    if words.quiet && !prints_what_was_asked_for(&words.command) {
        ground::exit::print_nothing();
    }
    ground::exit::code(run(words.command))
}

/// Whether standard output takes a table, a script or JSON, rather than a report for people.
fn prints_what_was_asked_for(command: &Command) -> bool {
    match command {
        // A flight has its own word for it.
        Command::Fly(_) | Command::Sources(_) | Command::Sbom(_) | Command::Xtce(_) | Command::Completions(_) => true,
        Command::Compare(arguments) => arguments.json,
        Command::Demo(arguments) => arguments.json,
        Command::Drill(arguments) => arguments.json,
        Command::Decode(arguments) => arguments.out.is_none() || arguments.json,
        Command::Recover(arguments) => arguments.table.is_none() || arguments.json,
        Command::Size(arguments) => arguments.json,
        Command::Case(step) => step.json(),
        Command::Effects(arguments) => arguments.json,
        Command::Design(arguments) => arguments.prints_the_plan(),
        Command::Calibrate(arguments) => arguments.json(),
        Command::Calibration(arguments) => arguments.json(),
        Command::Allan(arguments) => arguments.json,
        Command::Acceptance(arguments) => arguments.json,
        Command::Attitude(arguments) => arguments.json,
        Command::Gap(arguments) => arguments.case.as_ref().is_some_and(|case| case.json),
        _ => false,
    }
}

fn run(command: Command) -> Result<(), Box<dyn Error>> {
    match command {
        Command::Fly(arguments) => ground::fly::fly(&arguments)?,
        Command::Sources(arguments) => print!("{}", flight::source::list(arguments)),
        Command::Case(step) => ground::case::case(&step)?,
        Command::Compare(arguments) => ground::compare::compare(&arguments)?,
        Command::Demo(arguments) => ground::demo::demo(&arguments)?,
        Command::Effects(arguments) => print!("{}", ground::effects::effects(&arguments)?),
        Command::Decode(arguments) => ground::decode::decode(&arguments)?,
        Command::Drill(arguments) => drill::run(&arguments, ground::drill::on_image)?,
        Command::Acceptance(arguments) => ground::acceptance::acceptance(&arguments)?,
        Command::Console(arguments) => ground::console::console(&arguments)?,
        Command::Gap(arguments) => gap(&arguments)?,
        Command::Size(arguments) => ground::size::size(&arguments)?,
        Command::Sbom(arguments) => ground::sbom::sbom(&arguments)?,
        Command::Xtce(_) => print!("{}", ground::xtce::definition()),
        Command::Attitude(arguments) => attitude::run(&arguments)?,
        Command::Dump(arguments) => recorder::dump::run(&arguments)?,
        Command::Recover(arguments) => recorder::recover::run(&arguments)?,
        Command::Allan(arguments) => bench::allan::run(&arguments)?,
        Command::Calibrate(arguments) => bench::calibrate::run(&arguments)?,
        Command::Calibration(arguments) => bench::calibration::run(&arguments)?,
        Command::Design(arguments) => bench::design::command::run(&arguments)?,
        Command::Report(arguments) => bench::reproduction::run(&arguments)?,
        Command::Completions(arguments) => ground::words::completions(&arguments, Words::command())?,
        Command::Man(arguments) => ground::words::man(&arguments, Words::command())?,
    }
    Ok(())
}

fn gap(arguments: &Gap) -> Result<(), Box<dyn Error>> {
    if let Some(Challenge::Blind(step)) = &arguments.challenge {
        trials::command::run(step, &|case| Ok(gap::write_verdict(case)?), &|case, effects| {
            gap::write_baselines(case, Some(effects))?;
            if !effects.is_empty() {
                gap::write_withheld(case, effects)?;
            }
            Ok(())
        })?;
    }
    if let Some(case) = &arguments.case {
        gap::run(case)?;
    }
    Ok(())
}
