//! Which mutants each test passes, and which of them make it fail.

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// How many times as long as without a mutant a test may take: others use the machine too.
const SLOWER: u32 = 8;
/// And this beside it, for a test that takes next to no time.
const AT_LEAST: Duration = Duration::from_secs(4);
/// The first tests that are tried together take this long; those after them twice as long, and so on.
const FIRST: Duration = Duration::from_millis(100);

/// One test, as it runs without a mutant.
#[derive(Clone, Debug)]
pub struct Test {
    /// The test program, and the folder it runs in.
    pub program: (PathBuf, PathBuf),
    /// Its name within that program.
    pub name: String,
    /// How long it takes; as long as a test may at most, if it takes longer.
    pub takes: Duration,
    /// It takes longer: it is ended then, and has not failed.
    pub cut: bool,
    /// The mutants that it passes.
    pub reached: BTreeSet<usize>,
}

/// What became of a mutant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// This test fails with it.
    Caught(String),
    /// This test does not end with it.
    Timeout(String),
    /// So many tests pass it and none fails.
    Missed(usize),
}

fn command(program: &(PathBuf, PathBuf)) -> Command {
    let mut command = Command::new(&program.0);
    command
        .current_dir(&program.1)
        .env("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1");
    command
        .env("CARGO_MANIFEST_DIR", &program.1)
        .stdin(Stdio::null())
        .stderr(Stdio::null());
    command
}

fn names(program: &(PathBuf, PathBuf), more: &[&str]) -> BTreeSet<String> {
    let said = command(program).args(["--list", "--format=terse"]).args(more).output();
    let text = said
        .map(|said| String::from_utf8_lossy(&said.stdout).into_owned())
        .unwrap_or_default();
    text.lines()
        .filter_map(|line| Some(line.strip_suffix(": test")?.to_string()))
        .collect()
}

/// Every test of the programs, run once alone without a mutant; one that fails so is told and left out. One
/// that takes longer than `longest` is ended then.
pub fn tests(programs: &[(PathBuf, PathBuf)], notes: &Path, longest: Duration, workers: usize) -> Vec<Test> {
    let mut all = Vec::new();
    for program in programs {
        let ignored = names(program, &["--ignored"]);
        all.extend(
            names(program, &[])
                .difference(&ignored)
                .map(|name| (program.clone(), name.clone())),
        );
    }
    each(all.len(), workers, |at| {
        let (program, name) = &all[at];
        let note = notes.join(format!("reached-{at}"));
        let _ = fs::remove_file(&note);
        let began = Instant::now();
        let mut run = command(program);
        run.args(["--exact", name])
            .env("MUTANTS_REACHED", &note)
            .stdout(Stdio::null());
        let passes = ended(run.spawn().ok()?, began, longest);
        let takes = began.elapsed();
        let text = fs::read_to_string(&note).unwrap_or_default();
        let reached = text.lines().filter_map(|line| line.parse().ok()).collect();
        if passes == Some(false) {
            eprintln!("left out, fails without a mutant: {name}");
            return None;
        }
        let cut = passes.is_none();
        if cut {
            eprintln!("ended after {takes:.0?}: {name}");
        }
        Some(Test {
            program: program.clone(),
            name: name.clone(),
            takes,
            cut,
            reached,
        })
    })
    .into_iter()
    .flatten()
    .collect()
}

/// Whether it ended well, or nothing if it was ended because it took too long.
fn ended(mut child: Child, began: Instant, longest: Duration) -> Option<bool> {
    loop {
        match child.try_wait() {
            Ok(None) if began.elapsed() < longest => thread::sleep(Duration::from_millis(2)),
            Ok(Some(status)) => return Some(status.success()),
            _ => {
                let _ = child.kill();
                let _ = child.wait();
                return None;
            }
        }
    }
}

/// `of(0)` to `of(count - 1)` by some workers, the results in order.
pub fn each<T: Send>(count: usize, workers: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    if at >= count {
                        break;
                    }
                    let result = of(at);
                    if let Ok(mut done) = done.lock() {
                        done.push((at, result));
                    }
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_default();
    done.sort_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Tries one mutant against the tests that pass it, the quick ones first.
pub fn tried(mutant: usize, tests: &[Test]) -> Verdict {
    let mut passing: Vec<&Test> = tests.iter().filter(|test| test.reached.contains(&mutant)).collect();
    passing.sort_by_key(|test| test.takes);
    let count = passing.len();
    let (mut from, mut budget) = (0, FIRST);
    while from < count {
        let (mut to, mut takes) = (from, Duration::ZERO);
        while to < count && (to == from || takes + passing[to].takes < budget && !passing[to].cut) {
            takes += passing[to].takes;
            to += 1;
        }
        let mut programs: Vec<&(PathBuf, PathBuf)> = passing[from..to].iter().map(|test| &test.program).collect();
        programs.sort();
        programs.dedup();
        for program in programs {
            let together: Vec<&Test> = passing[from..to]
                .iter()
                .copied()
                .filter(|test| &test.program == program)
                .collect();
            if let Some(verdict) = failed(mutant, program, &together) {
                return verdict;
            }
        }
        (from, budget) = (to, budget * 2);
    }
    Verdict::Missed(count)
}

fn failed(mutant: usize, program: &(PathBuf, PathBuf), tests: &[&Test]) -> Option<Verdict> {
    let takes: Duration = tests.iter().map(|test| test.takes).sum();
    let cut = tests.iter().any(|test| test.cut);
    let mut run = command(program);
    run.args(["--exact", "--test-threads=1"])
        .args(tests.iter().map(|test| &test.name));
    run.env("MUTANT", mutant.to_string()).stdout(Stdio::piped());
    let mut child = run.spawn().ok()?;
    let lines = child.stdout.take()?;
    let child = Arc::new(Mutex::new(child));
    let (late, done) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let watch = {
        let (child, late, done) = (child.clone(), late.clone(), done.clone());
        let until = Instant::now() + if cut { takes } else { takes * SLOWER + AT_LEAST };
        thread::spawn(move || {
            while !done.load(Ordering::Relaxed) {
                if Instant::now() > until {
                    late.store(true, Ordering::Relaxed);
                    killed(&child);
                    return;
                }
                thread::park_timeout(Duration::from_millis(200));
            }
        })
    };
    let (mut last, mut failure) = (tests[0].name.clone(), None);
    for line in BufReader::new(lines).lines().map_while(Result::ok) {
        let Some(rest) = line.strip_prefix("test ") else {
            continue;
        };
        let name = rest.split(" ... ").next().unwrap_or_default();
        if rest.ends_with("FAILED") {
            failure = Some(name.trim_end_matches(" - should panic").to_string());
            killed(&child);
            break;
        }
        last = name.to_string();
    }
    let succeeded = child.lock().ok()?.wait().is_ok_and(|status| status.success());
    done.store(true, Ordering::Relaxed);
    watch.thread().unpark();
    let _ = watch.join();
    match failure {
        Some(name) => Some(Verdict::Caught(name)),
        None if late.load(Ordering::Relaxed) && cut => None,
        None if late.load(Ordering::Relaxed) => Some(Verdict::Timeout(last)),
        // It died without a word: an abort, or a stack that ran over.
        None if !succeeded => Some(Verdict::Caught(last)),
        None => None,
    }
}

fn killed(child: &Mutex<Child>) {
    if let Ok(mut child) = child.lock() {
        let _ = child.kill();
    }
}
