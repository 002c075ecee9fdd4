//! Guards of the unit, and the tests that fail without them: `ground drill --guards`.
//!
//! In: `guards.csv`, one guard a line: the expression in the source that guards, what stands there without it, and the test that
//! then fails. Out: for each guard, whether its test passes with it and fails without.
//!
//! The sources are copied, and every guard's expression is replaced by `if guard_removed(N) { WITHOUT } else { EXPRESSION }`, with N
//! from the environment. So all mutants are built at once, and each test is run twice (mutant schemata: Untch, Offutt and Harrold,
//! "Mutation analysis using mutant schemata", ISSTA 1993). The copy alone knows of the environment; what is flown is not touched.
//!
//! Refuses: an expression that is not in its file just once, a copy that cannot be built.

use std::{
    fs, io,
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// A guard and the test that holds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Guard {
    /// What it guards.
    pub guard: String,
    /// The source file, from the root of the repository.
    pub file: String,
    /// The expression that guards: once in that file.
    pub expression: String,
    /// What stands there without it.
    pub without: String,
    /// The test, `file: function`.
    pub test: String,
}

/// Why the guards cannot be tried.
#[derive(Debug, thiserror::Error)]
pub enum GuardError {
    /// Files or programs that are not to be had.
    #[error("{0}: {1}")]
    Io(String, io::Error),
    /// The expression is not in its file, or more than once.
    #[error("{0}: \"{1}\" is there {2} times; guards.csv needs an expression that is there once")]
    NotOnce(String, String, usize),
    /// The copy cannot be built.
    #[error("the copy without guards cannot be built:\n{0}")]
    Build(String),
    /// Some guard has no test that fails without it.
    #[error("{0} of {1} guards are held by no test")]
    Loose(usize, usize),
}

/// The root of the repository, asked of git from wherever this runs.
///
/// # Errors
/// When this is in no repository.
pub fn sources() -> Result<PathBuf, GuardError> {
    let asked = Command::new("git").args(["rev-parse", "--show-toplevel"]).output();
    let root = asked.map_err(|error| GuardError::Io("git".into(), error))?.stdout;
    let root = PathBuf::from(String::from_utf8_lossy(&root).trim());
    if root.join("ground/drill/guards.csv").is_file() {
        Ok(root)
    } else {
        let why = io::Error::new(io::ErrorKind::NotFound, "run it in a clone of the sources");
        Err(GuardError::Io("the sources".into(), why))
    }
}

/// The guards of the table.
pub fn guards() -> Vec<Guard> {
    let mut reader = csv::Reader::from_reader(include_str!("../guards.csv").as_bytes());
    let records = reader.records().map_while(Result::ok);
    records
        .map(|record| {
            let cell = |at: usize| record.get(at).unwrap_or_default().to_string();
            Guard {
                guard: cell(0),
                file: cell(1),
                expression: cell(2),
                without: cell(3),
                test: cell(4),
            }
        })
        .collect()
}

impl Guard {
    /// The source `text` with this guard, the `number`-th, made removable.
    ///
    /// # Errors
    /// When the expression is not there just once.
    pub fn made_removable(&self, number: usize, text: &str) -> Result<String, GuardError> {
        let times = text.matches(&self.expression).count();
        if times != 1 {
            return Err(GuardError::NotOnce(self.file.clone(), self.expression.clone(), times));
        }
        let (with, without) = (&self.expression, &self.without);
        let either = format!("(if crate::guard_removed({number}) {{ {without} }} else {{ {with} }})");
        Ok(text.replacen(with, &either, 1))
    }

    /// What cargo is told so that it has this test: the package, and its kind of test.
    fn target(&self) -> (Vec<String>, String) {
        let (file, name) = self.test.split_once(": ").unwrap_or((&self.test, ""));
        let target = match file.strip_prefix("host-tests/tests/") {
            Some(file) => vec![
                "-pemems-host-tests".into(),
                format!("--test={}", file.trim_end_matches(".rs")),
            ],
            None if file.starts_with("drivers/") => vec!["-pemems-drivers".into(), "--lib".into()],
            None => vec!["-pemems".into(), "--lib".into()],
        };
        (target, format!("{}{name}", module(file)))
    }
}

/// The path of a unit test's module in its crate, with `::` after it; nothing for a test of its own crate.
fn module(file: &str) -> String {
    let Some(path) = file.trim_start_matches("drivers/").strip_prefix("src/") else {
        return String::new();
    };
    let path = path.trim_end_matches(".rs").replace('/', "::");
    if path.contains("::tests") {
        format!("{path}::")
    } else {
        format!("{path}::tests::")
    }
}

/// The crates that have guards.
const LIBRARIES: [&str; 2] = ["src/lib.rs", "drivers/src/lib.rs"];

/// What each of them gets in the copy, so that its guards can be taken away.
const REMOVED: &str = "
extern crate std;
/// Whether the environment takes this guard away.
pub(crate) fn guard_removed(number: u32) -> bool {
    static REMOVED: std::sync::LazyLock<Option<u32>> =
        std::sync::LazyLock::new(|| std::env::var(\"GUARD_REMOVED\").ok()?.parse().ok());
    *REMOVED == Some(number)
}
";

fn copied(root: &Path, copy: &Path) -> io::Result<()> {
    let listed = Command::new("git")
        .args(["ls-files", "-z"])
        .current_dir(root)
        .output()?;
    for name in String::from_utf8_lossy(&listed.stdout).split_terminator('\0') {
        let (from, to) = (root.join(name), copy.join(name));
        let Ok(bytes) = fs::read(&from) else { continue };
        if fs::read(&to).is_ok_and(|there| there == bytes) {
            continue;
        }
        if let Some(folder) = to.parent() {
            fs::create_dir_all(folder)?;
        }
        fs::write(&to, bytes)?;
    }
    Ok(())
}

fn cargo(root: &Path, copy: &Path, arguments: &[String], removed: Option<usize>) -> io::Result<Output> {
    let mut cargo = Command::new("cargo");
    cargo.args([
        "test",
        "--locked",
        "--quiet",
        "--ignore-rust-version",
        "--target=host-tuple",
    ]);
    cargo.args(arguments).current_dir(copy);
    cargo
        .env("CARGO_TARGET_DIR", root.join("target"))
        .env_remove("GUARD_REMOVED");
    if let Some(number) = removed {
        cargo.env("GUARD_REMOVED", number.to_string());
    }
    cargo.output()
}

/// Tries every guard of the repository at `root`, those whose name contains `only` if it is given; prints what
/// became of each, as text or as JSON.
///
/// # Errors
/// See [`GuardError`]; a guard that no test holds is one.
pub fn run(root: &Path, only: &[String], json: bool) -> Result<(), GuardError> {
    let copy: PathBuf = root.join("target/guards");
    let io = |what: &str| {
        let what = what.to_string();
        move |error| GuardError::Io(what, error)
    };
    let guards = guards();
    copied(root, &copy).map_err(io("target/guards"))?;
    for (number, guard) in guards.iter().enumerate() {
        let path = copy.join(&guard.file);
        let text = fs::read_to_string(&path).map_err(io(&guard.file))?;
        fs::write(&path, guard.made_removable(number, &text)?).map_err(io(&guard.file))?;
    }
    for library in LIBRARIES {
        let path = copy.join(library);
        let text = fs::read_to_string(&path).map_err(io(library))?;
        fs::write(&path, text + REMOVED).map_err(io(library))?;
    }
    let (mut loose, mut tried, mut told) = (0, 0, Vec::new());
    for (number, guard) in guards.iter().enumerate() {
        if !only.is_empty() && !only.iter().any(|only| guard.guard.contains(only)) {
            continue;
        }
        tried += 1;
        let (mut arguments, name) = guard.target();
        arguments.extend(["--".into(), "--exact".into(), name]);
        let with = cargo(root, &copy, &arguments, None).map_err(io("cargo"))?;
        let said = String::from_utf8_lossy(&with.stdout).into_owned();
        if !with.status.success() && !said.contains("test result") {
            return Err(GuardError::Build(String::from_utf8_lossy(&with.stderr).into_owned()));
        }
        let without = cargo(root, &copy, &arguments, Some(number)).map_err(io("cargo"))?;
        let passes = with.status.success() && said.contains("1 passed");
        let fails = String::from_utf8_lossy(&without.stdout).contains("1 failed");
        let verdict = match (passes, fails) {
            (true, true) => "held",
            (true, false) => "NOT HELD: the test passes without it",
            (false, _) => "NOT HELD: the test does not pass with it",
        };
        loose += usize::from(!(passes && fails));
        if json {
            told.push(serde_json::json!({
                "guard": guard.guard, "file": guard.file, "test": guard.test, "verdict": verdict,
            }));
        } else {
            println!("{verdict:6} {} ({})", guard.guard, guard.test);
        }
    }
    if json {
        println!("{:#}", serde_json::Value::from(told));
    } else {
        println!("{tried} guards: {} held by a test that fails without it", tried - loose);
    }
    if loose > 0 {
        Err(GuardError::Loose(loose, tried))
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
    }

    #[test]
    fn every_guard_is_in_its_file_once_and_its_test_in_the_source() {
        let guards = guards();
        assert!(guards.len() >= 60, "{} guards", guards.len());
        for guard in &guards {
            let text = fs::read_to_string(root().join(&guard.file)).expect("a source file");
            guard.made_removable(0, &text).expect("one expression");
            assert_ne!(guard.expression, guard.without);
            for expression in [&guard.expression, &guard.without] {
                assert!(is_whole(expression), "{}: {expression} is no expression", guard.guard);
            }
            assert!(
                stands_alone(&text, &guard.expression),
                "{}: {} is part of an expression",
                guard.guard,
                guard.expression
            );
            let (file, name) = guard.test.split_once(": ").expect("file: function");
            let tests = fs::read_to_string(root().join(file)).expect("a file of tests");
            assert!(tests.contains(&format!("fn {name}(")), "{}", guard.test);
        }
    }

    /// Whether it may stand alone, as far as brackets and operators tell: one guard that may not keeps the copy from being built.
    fn is_whole(expression: &str) -> bool {
        let count = |of: char| expression.matches(of).count();
        let is_closed = ["()", "[]", "{}"].iter().all(|pair| {
            let mut pair = pair.chars().map(count);
            pair.next() == pair.next()
        });
        is_closed && !expression.ends_with(['|', '&', '=', '+', '-', '{'])
    }

    /// Whether nothing beside it in the text makes another expression of it: the name of a method is none without what it is called on.
    fn stands_alone(text: &str, expression: &str) -> bool {
        let is_of_a_name = |beside: char| beside.is_alphanumeric() || beside == '_';
        let Some((before, after)) = text.split_once(expression) else {
            return false;
        };
        !before.ends_with(|beside| is_of_a_name(beside) || matches!(beside, '.' | ':'))
            && !after.starts_with(|beside| is_of_a_name(beside) || beside == '(')
    }

    #[test]
    fn half_an_expression_is_none() {
        assert!(is_whole("a || b(c)"));
        assert!(!is_whole("is_repeated ||") && !is_whole("if !answers {") && !is_whole("f(a"));
        assert!(stands_alone("let a = b.filter(c);", "b.filter(c)"));
        assert!(!stands_alone("let a = b.filter(c);", "filter(c)") && !stands_alone("let a = b.f(c);", "b.f"));
        assert!(!stands_alone("let a = ab;", "b") && !stands_alone("let a = bc;", "b"));
    }

    #[test]
    fn a_guard_that_is_not_there_once_is_refused() {
        let guard = Guard {
            expression: "a == b".into(),
            without: "true".into(),
            ..guards()[0].clone()
        };
        assert!(matches!(
            guard.made_removable(3, "a == c"),
            Err(GuardError::NotOnce(_, _, 0))
        ));
        assert!(matches!(
            guard.made_removable(3, "a == b; a == b"),
            Err(GuardError::NotOnce(_, _, 2))
        ));
        let made = guard.made_removable(3, "if a == b {}").expect("once");
        assert_eq!(made, "if (if crate::guard_removed(3) { true } else { a == b }) {}");
    }

    #[test]
    fn a_test_s_name_is_that_of_its_module() {
        assert_eq!(module("src/mode/tests.rs"), "mode::tests::");
        assert_eq!(module("src/flight_log/page.rs"), "flight_log::page::tests::");
        assert_eq!(module("src/kalman/tests/hostile.rs"), "kalman::tests::hostile::");
        assert_eq!(module("drivers/src/adis16265/tests.rs"), "adis16265::tests::");
        assert_eq!(module("host-tests/tests/guards.rs"), "");
    }
}
