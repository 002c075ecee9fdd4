//! Tries the mutants of cargo-mutants by one build: `docs/mutants.md` says how it is run and what came out.
//!
//! In: globs of source files, and after `--` what cargo is told so that it builds the tests. Out: a line for each mutant in
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
use std::time::Duration;
use std::{env, fs, process};

use tried::Verdict;

/// As many as the tests and their watchers may use.
const WORKERS: usize = 2;

/// What may become of a mutant. `apart` is cargo-mutants' own to try, since it cannot be woven.
const KINDS: [&str; 5] = ["caught", "timeout", "missed", "unviable", "apart"];

/// Of a line of an earlier run: mutant, verdict, and by what.
fn told(line: &str) -> Option<(&str, (&str, &str))> {
    let mut cells = line.split('\t');
    Some((cells.next()?, (cells.next()?, cells.next()?)))
}

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        process::exit(2);
    }
}

fn run() -> Result<(), String> {
    let mut arguments = env::args().skip(1);
    let (mut files, mut longest, mut again) = (Vec::new(), None, false);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--" => break,
            "--longest" => longest = arguments.next().and_then(|text| text.parse::<f64>().ok()),
            "--again" => again = true,
            _ => files.push(argument),
        }
    }
    let tests: Vec<String> = arguments.collect();
    if files.is_empty() || tests.is_empty() {
        return Err("usage: mutants [--longest SECONDS] [--again] GLOB... -- ARGUMENTS OF cargo test".into());
    }
    let root: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let root = root.canonicalize().map_err(|error| error.to_string())?;
    let mutants = list::mutants(&root, &files)?;
    eprintln!("{} mutants", mutants.len());
    let path = root.join("target/mutants.tsv");
    let before = if again { fs::read_to_string(&path).unwrap_or_default() } else { String::new() };
    let known: HashMap<&str, (&str, &str)> = before.lines().filter_map(told).collect();
    let built = built::built(&root, &mutants, &tests)?;
    let notes = root.join("target/mutants");
    let longest = longest.map_or(Duration::MAX, Duration::from_secs_f64);
    let tests = tried::tests(&built.programs, &notes, longest, WORKERS);
    let all: Duration = tests.iter().map(|test| test.takes).sum();
    eprintln!("{} tests, {all:.1?} one after another", tests.len());
    let done = AtomicUsize::new(0);
    let verdicts = tried::each(mutants.len(), WORKERS, |number| {
        let known = known.get(mutants[number].name.as_str()).filter(|(verdict, _)| *verdict != "missed");
        let verdict = if let Some((verdict, by)) = known {
            (KINDS.iter().find(|kind| kind == &verdict).unwrap_or(&"missed"), (*by).to_string())
        } else if built.unviable.contains(&number) {
            (&"unviable", String::new())
        } else if built.apart.contains(&number) {
            (&"apart", String::new())
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
        verdict
    });
    let (mut csv, mut modules) = (String::new(), BTreeMap::new());
    for (mutant, (verdict, by)) in mutants.iter().zip(&verdicts) {
        let _ = writeln!(csv, "{}\t{verdict}\t{by}", mutant.name);
        *modules.entry(&mutant.file).or_insert_with(BTreeMap::new).entry(*verdict).or_insert(0) += 1;
    }
    fs::write(&path, csv).map_err(|error| format!("{}: {error}", path.display()))?;
    println!("{:40} {}", "file", KINDS.map(|kind| format!("{kind:>9}")).concat());
    for (file, counts) in modules {
        let cells = KINDS.map(|kind| format!("{:>9}", counts.get(&kind).unwrap_or(&0)));
        println!("{file:40} {}", cells.concat());
    }
    Ok(())
}
