//! The command: which rows, with which seeds, on which board; the table; whether all is accepted.

use std::path::PathBuf;

use twin::fault::{Struck, WORDS};

use crate::{
    catalogue::{CATALOGUE, Drill, Fly, Row},
    endurance,
    flight::{Board, OnImage, fly, planned},
    guards::{self, GuardError},
    table::{Line, write},
};

/// Flies the catalogue of faults: what struck, what the unit did, and whether that is accepted
///
/// Without rows, all 86. Flights are of the unit's code in virtual time; --image flies the release image on the emulated board
/// where it can make the fault. Rows without a drill name the tests that cover them (cargo host-test runs those).
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  ground drill                       the catalogue, in minutes
  ground drill F8 --seed 123         one row again, as it failed
  ground drill U1 S3 --image         on the release image
  ground drill --long                more runs of each, with seeds
  ground drill day --seed 7          24 h with faults at random; an hour of the image with --image
  ground drill --faults              the names of faults
  ground drill --guards              each guard's test, without the guard
  ground drill --write ground/drill/catalogue.csv")]
pub struct DrillArguments {
    /// Rows of the catalogue, such as F8 [default: all]
    pub rows: Vec<String>,
    /// What is drawn follows from this number
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Ten seeds of each flight, the campaigns at full length, and a day (--image: an hour) with faults at random: hours
    #[arg(long)]
    pub long: bool,
    /// Fly the release image on the emulated board, where it can make the fault
    #[arg(long)]
    pub image: bool,
    /// Keep the table as CSV
    #[arg(long, value_name = "FILE")]
    pub write: Option<PathBuf>,
    /// List the names of faults and end
    #[arg(long)]
    pub faults: bool,
    /// Take each of the unit's guards away in a copy of the sources, and see its test fail: builds the copy, minutes. Rows are then
    /// parts of guards' names [default: all]
    #[arg(long)]
    pub guards: bool,
    /// Print the table as JSON, when all is flown
    #[arg(long)]
    pub json: bool,
}

/// Why a drill was not made, or found something.
#[derive(Debug, thiserror::Error)]
pub enum DrillError {
    /// No such row.
    #[error(
        "the catalogue has no row {0}; its rows are F1 to F21, S1 to S23, N1 to N12, C1 to C15, U1 to U15; day is a long flight"
    )]
    NoRow(String),
    /// A guard is held by no test, or cannot be tried.
    #[error(transparent)]
    Guard(#[from] GuardError),
    /// The unit did what is not accepted.
    #[error("{0} of what was drilled is not accepted; each line says why, and how to fly it again")]
    NotAccepted(usize),
    /// There is no image.
    #[error("there is no image to drill: {0}")]
    Image(String),
    /// The table cannot be kept.
    #[error("{path}: {why}")]
    Table {
        /// Where.
        path: String,
        /// As the system puts it.
        why: std::io::Error,
    },
}

/// What is no row of the catalogue, but is flown like one: a long flight with faults at random.
const DAY: &str = "day";
/// \[s\] of it on the host; of the image, at five to ten times real time.
const DAY_S: u64 = 86_400;
const IMAGE_DAY_S: u64 = 3_600;

/// Seeds of each flight with `--long`.
const LONG_SEEDS: u64 = 10;

/// Runs `ground drill`; `image` builds what flies the release image, if it is asked for.
///
/// # Errors
/// See [`DrillError`]. What is not accepted is in the table too, which is kept all the same.
pub fn run(
    arguments: &DrillArguments,
    image: impl FnOnce() -> Result<Box<OnImage<'static>>, String>,
) -> Result<(), DrillError> {
    if arguments.faults && arguments.json {
        let each = WORDS
            .iter()
            .map(|word| serde_json::json!({"name": word.name, "places": word.places, "meaning": word.meaning}));
        println!("{:#}", serde_json::Value::from_iter(each));
        return Ok(());
    }
    if arguments.faults {
        for word in &WORDS {
            println!("{:16} {} {}", word.name, word.places, word.meaning);
        }
        return Ok(());
    }
    if arguments.guards {
        return Ok(guards::run(&guards::sources()?, &arguments.rows, arguments.json)?);
    }
    let (rows, a_day) = chosen(&arguments.rows)?;
    let image = if arguments.image {
        Some(image().map_err(DrillError::Image)?)
    } else {
        None
    };
    let board = image.as_deref().map_or(Board::Host, Board::Image);
    let mut lines = Vec::new();
    for row in rows {
        let line = drilled(row, &board, arguments.seed, arguments.long);
        if !arguments.json {
            line.print();
        }
        lines.push(line);
    }
    let count = |begin: &str| lines.iter().filter(|line| line.verdict.starts_with(begin)).count();
    let refused = count("not accepted");
    if !lines.is_empty() && !arguments.json {
        println!(
            "{} rows: {} accepted ({} by a drill, {} by the tests they name), {refused} not accepted",
            lines.len(),
            lines.len() - refused,
            count("accepted"),
            count("by test"),
        );
    }
    let (mut not_accepted, mut day) = (refused, None);
    if a_day || arguments.long && arguments.rows.is_empty() {
        let seconds = if arguments.image { IMAGE_DAY_S } else { DAY_S };
        let told = endurance::fly(&board, arguments.seed, seconds);
        not_accepted += usize::from(told.did.is_err());
        let (Ok(did) | Err(did)) = &told.did;
        let verdict = if told.did.is_ok() { "accepted" } else { "not accepted" };
        let hours = seconds / 3600;
        if arguments.json {
            day = Some(serde_json::json!({
                "hours": hours, "struck": told.struck, "what the unit did": did, "verdict": verdict,
            }));
        } else {
            println!(
                "{hours} h with faults at random  [{verdict}]\n     struck {}; {did}",
                told.struck
            );
        }
    }
    if arguments.json {
        let rows = serde_json::Value::from_iter(lines.iter().map(Line::json));
        println!(
            "{:#}",
            serde_json::json!({"rows": rows, "day": day, "not accepted": not_accepted})
        );
    }
    if let Some(path) = &arguments.write {
        write(path, &lines).map_err(|why| DrillError::Table {
            path: path.display().to_string(),
            why,
        })?;
    }
    ended(not_accepted)
}

/// How the command ends after so much that is not accepted.
fn ended(refused: usize) -> Result<(), DrillError> {
    match refused {
        0 => Ok(()),
        refused => Err(DrillError::NotAccepted(refused)),
    }
}

/// The rows of these names, all if none is named, and whether the day is among them.
fn chosen(names: &[String]) -> Result<(Vec<&'static Row>, bool), DrillError> {
    let all = || CATALOGUE.iter().flat_map(|rows| rows.iter());
    if names.is_empty() {
        return Ok((all().collect(), false));
    }
    let (days, rows): (Vec<_>, Vec<_>) = names.iter().partition(|name| name.eq_ignore_ascii_case(DAY));
    let row = |name: &String| {
        all()
            .find(|row| row.id.eq_ignore_ascii_case(name))
            .ok_or_else(|| DrillError::NoRow(name.clone()))
    };
    let rows: Result<_, _> = rows.into_iter().map(row).collect();
    Ok((rows?, !days.is_empty()))
}

/// One row, drilled.
pub fn drilled(row: &'static Row, board: &Board<'_>, seed: u64, long: bool) -> Line {
    let mut line = Line {
        row: row.id.into(),
        fault: row.fault.into(),
        injected: String::new(),
        struck: String::new(),
        did: row.tests.join(", "),
        verdict: "by test".into(),
    };
    let (struck, did) = match row.drill {
        Drill::None => {
            line.injected = "by its tests".into();
            (None, Ok(line.did.clone()))
        }
        Drill::Flights(flights) => {
            let seeds = if long { LONG_SEEDS } else { 1 };
            let flyable: Vec<&Fly> = flights.iter().filter(|drill| is_flyable(drill, board)).collect();
            if flyable.is_empty() {
                line.injected = "by its tests; this board cannot make it".into();
                (None, Ok(line.did.clone()))
            } else {
                let plans = flyable.iter().flat_map(|drill| drill.plans);
                line.injected = shortened(&plans.copied().collect::<Vec<_>>());
                let (struck, did) = flown(row, &flyable, board, seed..seed + seeds);
                (Some(struck), did)
            }
        }
        Drill::Campaign(injected, run) => {
            line.injected = injected.into();
            let told = run(seed, long);
            (Some(told.struck), told.did)
        }
    };
    line.struck = struck.map_or(String::new(), |struck| struck.to_string());
    let accepted = if struck.is_some() { "accepted" } else { "by test" };
    (line.did, line.verdict) = match did {
        Ok(did) => (did, accepted.into()),
        Err(why) => (why.clone(), format!("not accepted: {why}")),
    };
    line
}

/// Several plans in one cell: the first two say what they are like.
fn shortened(plans: &[&str]) -> String {
    match plans {
        [first, second, _, ..] => format!("{first} | {second} | ... ({} plans)", plans.len()),
        _ => plans.join(" | "),
    }
}

fn is_flyable(drill: &Fly, board: &Board<'_>) -> bool {
    let words = drill.plans.iter().flat_map(|plan| planned(plan));
    words
        .map(|planned| planned.word)
        .all(|word| word.places.contains(board.letter()))
}

/// All flights of a row: how often its faults struck, and what the unit did in the last, or the first that is not accepted.
fn flown(row: &Row, flights: &[&Fly], board: &Board<'_>, seeds: std::ops::Range<u64>) -> (u64, Result<String, String>) {
    let (mut total, mut said) = (0, String::new());
    for seed in seeds {
        for drill in flights {
            for plan in drill.plans {
                let again = |why: String| format!("{why} ({plan}; ground drill {} --seed {seed})", row.id);
                let flown = match fly(board, drill, plan, seed) {
                    Ok(flown) => flown,
                    Err(why) => return (total, Err(again(why))),
                };
                let struck = struck(plan, &flown.report.struck);
                total += struck.iter().sum::<u64>();
                if struck.contains(&0) {
                    return (total, Err(again("a fault never struck".into())));
                }
                match (drill.judge)(&flown) {
                    Ok(did) => said = did,
                    Err(why) => return (total, Err(again(why))),
                }
            }
        }
    }
    (total, Ok(said))
}

/// How often each fault of a plan did something. A restart is seen by what it does only, and counts as once.
fn struck(plan: &str, struck: &Struck) -> Vec<u64> {
    let words = planned(plan).into_iter().map(|planned| planned.word.name);
    let times = |name: &str| match name {
        "restart" => 1,
        name => struck.get(name).copied().unwrap_or(0),
    };
    let mut names: Vec<_> = words.collect();
    names.dedup();
    names.into_iter().map(times).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[&str]) -> Result<(Vec<&'static str>, bool), DrillError> {
        let names: Vec<String> = names.iter().map(ToString::to_string).collect();
        chosen(&names).map(|(rows, a_day)| (rows.iter().map(|row| row.id).collect(), a_day))
    }

    #[test]
    fn a_day_is_flown_alone_or_beside_rows_and_a_row_that_is_not_there_is_named() {
        let all = named(&[]).expect("all rows");
        assert!(all.0.len() == 86 && !all.1);
        assert_eq!(named(&["day"]).expect("a day"), (vec![], true));
        assert_eq!(named(&["f8", "DAY"]).expect("both"), (vec!["F8"], true));
        let error = named(&["day", "X1"]).expect_err("no row").to_string();
        assert!(error.contains("X1") && error.contains("day"), "{error}");
    }

    #[test]
    fn what_is_not_accepted_ends_in_an_error() {
        assert!(ended(0).is_ok());
        assert!(matches!(ended(2), Err(DrillError::NotAccepted(2))));
    }
}
