//! Tries the mutants of cargo-mutants by one build: `docs/mutants.md` says how it is run and what came out.
//!
//! In: how the names of source files begin, and after `--` what cargo is told so that it builds the tests. Out: a line for each mutant in
//! `target/mutants.tsv`, and a table of the modules.
//!
//! 1. [`list`]: cargo-mutants names the mutants.
//! 2. [`weave`]: all of them go into a copy of the sources, asleep.
//! 3. [`built`]: the copy is built; what the compiler refuses is left out, and is unviable.
//! 4. [`tried`]: each test runs once and tells which mutants it passes; then each mutant is woken for the tests that pass it, until
//!    one fails. A mutant that no test passes is missed without being run.

mod built;
mod list;
mod tried;
mod weave;

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use std::{env, fs, process};

use tried::Verdict;

/// As many as the tests and their watchers may use.
const WORKERS: usize = 2;

const USAGE: &str =
    "usage: mutants [--longest SECONDS [--ended]] [--minutes MINUTES] [--again] FILE... -- ARGUMENTS OF cargo test";

/// What may become of a mutant. `apart` is cargo-mutants' own to try, since it cannot be woven.
const KINDS: [&str; 6] = ["caught", "timeout", "missed", "untried", "unviable", "apart"];

/// A place in an order that has nothing to do with what the mutants are (FNV-1a): a run that is ended by its time is a sample.
fn shuffled(name: &str) -> u64 {
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
    let hash = name.bytes().fold(0xCBF2_9CE4_8422_2325, step);
    (hash ^ hash >> 31).wrapping_mul(0x94D0_49BB_1331_11EB)
}

/// Of a line of an earlier run: mutant, verdict, and by what.
fn told(line: &str) -> Option<(&str, (&str, &str))> {
    let mut cells = line.split('\t');
    Some((cells.next()?, (cells.next()?, cells.next()?)))
}

fn number(option: &str, text: Option<String>) -> Result<f64, String> {
    let number = text.as_ref().and_then(|text| text.parse().ok());
    let number = number.filter(|number: &f64| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| {
        format!(
            "{option} takes a number above 0, not {:?}\n{USAGE}",
            text.unwrap_or_default()
        )
    })
}

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        process::exit(2);
    }
}

fn run() -> Result<(), String> {
    let mut arguments = env::args().skip(1);
    let (mut files, mut longest, mut minutes, mut again, mut ended) = (Vec::new(), None, None, false, false);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--" => break,
            "--longest" => longest = Some(number(&argument, arguments.next())?),
            "--minutes" => minutes = Some(number(&argument, arguments.next())?),
            "--again" => again = true,
            "--ended" => ended = true,
            _ if argument.starts_with('-') => return Err(format!("there is no option {argument}\n{USAGE}")),
            _ => files.push(argument),
        }
    }
    let tests: Vec<String> = arguments.collect();
    if files.is_empty() || tests.is_empty() {
        return Err(USAGE.into());
    }
    let root: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let root = root.canonicalize().map_err(|error| error.to_string())?;
    let mutants = list::mutants(&root, &files)?;
    eprintln!("{} mutants", mutants.len());
    let path = root.join("target/mutants.tsv");
    let before = if again {
        fs::read_to_string(&path).unwrap_or_default()
    } else {
        String::new()
    };
    let known: HashMap<&str, (&str, &str)> = before.lines().filter_map(told).collect();
    let built = built::built(&root, &mutants, &tests)?;
    let notes = root.join("target/mutants");
    let longest = longest.map_or(Duration::MAX, Duration::from_secs_f64);
    let mut tests = tried::tests(&built.programs, &notes, longest, WORKERS);
    tests.retain(|test| ended || !test.cut);
    let all: Duration = tests.iter().map(|test| test.takes).sum();
    eprintln!("{} tests, {all:.1?} one after another", tests.len());
    let mut order: Vec<usize> = (0..mutants.len()).collect();
    order.sort_by_key(|number| shuffled(&mutants[*number].name));
    let until = minutes.map(|minutes| Instant::now() + Duration::from_secs_f64(60.0 * minutes));
    let done = AtomicUsize::new(0);
    let verdicts = tried::each(mutants.len(), WORKERS, |at| {
        let number = order[at];
        let known = known
            .get(mutants[number].name.as_str())
            .filter(|(verdict, _)| !["missed", "untried"].contains(verdict));
        let verdict = if let Some((verdict, by)) = known {
            (
                KINDS.iter().find(|kind| kind == &verdict).unwrap_or(&"missed"),
                (*by).to_string(),
            )
        } else if built.unviable.contains(&number) {
            (&"unviable", String::new())
        } else if built.apart.contains(&number) {
            (&"apart", String::new())
        } else if until.is_some_and(|until| Instant::now() > until) {
            (&"untried", String::new())
        } else {
            match tried::tried(number, &tests) {
                Verdict::Caught(test) => (&"caught", test),
                Verdict::Timeout(test) => (&"timeout", test),
                Verdict::Missed(passing) => (&"missed", format!("{passing} tests pass it")),
            }
        };
        let count = done.fetch_add(1, Ordering::Relaxed) + 1;
        if *verdict.0 == "missed" {
            eprintln!("{count}: missed: {} ({})", mutants[number].name, verdict.1);
        }
        (number, verdict)
    });
    let verdicts: BTreeMap<usize, _> = verdicts.into_iter().collect();
    let (mut csv, mut modules) = (String::new(), BTreeMap::new());
    for (mutant, (verdict, by)) in mutants.iter().zip(verdicts.values()) {
        let _ = writeln!(csv, "{}\t{verdict}\t{by}", mutant.name);
        *modules
            .entry(&mutant.file)
            .or_insert_with(BTreeMap::new)
            .entry(*verdict)
            .or_insert(0) += 1;
    }
    fs::write(&path, csv).map_err(|error| format!("{}: {error}", path.display()))?;
    println!("{:40} {}", "file", KINDS.map(|kind| format!("{kind:>9}")).concat());
    for (file, counts) in modules {
        let cells = KINDS.map(|kind| format!("{:>9}", counts.get(&kind).unwrap_or(&0)));
        println!("{file:40} {}", cells.concat());
    }
    Ok(())
}
