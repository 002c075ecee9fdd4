//! The house: no room of the diagnosis needs a later one, and only the room that judges opens the held-out samples.
//!
//! In: the source files. A path `crate::room::..` in a file of a room is an arrow to that room; what the tests of a file need
//! is an arrow too, what its comments say is none.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The thresholds, the ten rooms in the order of the steps, around the last the conductor, the way without a reference, several logs, what is
/// kept and held against another case, and the shell.
const ORDER: [&str; 17] = [
    "thresholds",
    "input",
    "null",
    "library",
    "search",
    "unknown",
    "holdout",
    "probability",
    "correct",
    "advise",
    "diagnose",
    "report",
    "parity",
    "together",
    "kept",
    "against",
    "command",
];

/// Files with their paths below `src`.
fn sources() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let (mut folders, mut found) = (vec![root.clone()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("can be listed") {
            let path = entry.expect("can be listed").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let text = fs::read_to_string(&path).expect("is text");
                found.push((path.strip_prefix(&root).expect("is below src").to_path_buf(), text));
            }
        }
    }
    found
}

/// The room of a file.
fn room(file: &Path) -> String {
    let first = file.iter().next().and_then(|part| part.to_str()).expect("is text");
    first.trim_end_matches(".rs").to_owned()
}

/// Code without comments.
fn code(text: &str) -> String {
    let code = text.lines().map(|line| line.split("//").next().unwrap_or_default());
    code.collect::<Vec<_>>().join("\n")
}

/// The rooms that code needs: what stands behind `crate::`, one or a list.
fn needed(code: &str) -> Vec<String> {
    let mut rooms = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        if !rest.starts_with('{') {
            rooms.push(word(rest));
            continue;
        }
        let mut depth = 0;
        let mut starts = true;
        for (at, sign) in rest.char_indices() {
            match sign {
                '{' => (depth, starts) = (depth + 1, depth == 0),
                '}' => depth -= 1,
                ',' => starts = depth == 1,
                _ if starts && !sign.is_whitespace() => {
                    rooms.push(word(&rest[at..]));
                    starts = false;
                }
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
    }
    rooms
}

fn word(text: &str) -> String {
    let is_in = |sign: &char| sign.is_alphanumeric() || *sign == '_';
    text.chars().take_while(is_in).collect()
}

fn place(room: &str) -> Option<usize> {
    ORDER.iter().position(|own| *own == room)
}

#[test]
fn no_room_needs_a_later_one() {
    let mut arrows = 0;
    for (file, text) in sources() {
        let room = room(&file);
        if room == "lib" {
            continue;
        }
        let own = place(&room).unwrap_or_else(|| panic!("{} is in no room", file.display()));
        for other in needed(&code(&text)) {
            let other_place = place(&other).unwrap_or_else(|| panic!("{}: {other} is no room", file.display()));
            assert!(other_place <= own, "{} needs {other}, a later room", file.display());
            arrows += 1;
        }
    }
    assert!(arrows > 100, "{arrows} arrows only: the paths are not found");
}

#[test]
fn only_the_room_that_judges_opens_the_held_out_samples() {
    let opens = |(file, text): &(PathBuf, String)| (code(text).contains(".samples()")).then(|| room(file));
    let rooms: Vec<String> = sources().iter().filter_map(opens).collect();
    assert!(!rooms.is_empty());
    assert!(rooms.iter().all(|room| room == "holdout"), "{rooms:?}");
}

#[test]
fn a_list_of_paths_is_read_to_its_end() {
    let code =
        "use crate::{\n    input::{case::Subject, log},\n    null::problem::Problem,\n};\ncrate::search::odds::alone(";
    assert_eq!(needed(code), ["input", "null", "search"]);
}
