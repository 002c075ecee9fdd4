//! The documentation against the code: pages that are drawn from it are as the code has them, and every link leads somewhere.
//!
//! In: every Markdown file of the repository. `DOCS=write` writes the drawn pages anew. Links to other hosts are not followed:
//! a test needs no network.

use std::{
    collections::BTreeSet,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

use gap::thresholds::{self, Provenance};
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use twin::effect::LIBRARY;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("..")
        .canonicalize()
        .expect("is there")
}

/// Folders that hold nothing written for a reader of the documentation.
const LEFT_OUT: [&str; 3] = ["target", "flights", "node_modules"];

fn markdown(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("can be read").flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        if path.is_dir() && !name.starts_with('.') && !LEFT_OUT.contains(&name.as_ref()) {
            markdown(&path, found);
        } else if name.ends_with(".md") {
            found.push(path);
        }
    }
}

/// What stands in a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('<', "&lt;").replace('\n', " ")
}

fn effects() -> String {
    let mut page = String::from(
        "# Effects\n\n\
         What a unit may have and its description may lack. The diagnosis tries every one of them. This page is drawn from the\n\
         library; `cargo ground effects NAME` prints one entry, and says whether `cargo fly --with NAME` can fly it.\n",
    );
    for effect in LIBRARY {
        let effect = effect.page();
        let sensors: Vec<String> = effect
            .sensors
            .iter()
            .map(|kind| format!("{kind:?}").to_lowercase())
            .collect();
        let sizes: Vec<String> = (effect.parameters.iter())
            .map(|symbol| {
                let sign = if symbol.signed { "± " } else { "" };
                let unit = if symbol.unit == "1" { "" } else { symbol.unit };
                format!("{} {sign}{} {unit}", symbol.name, symbol.prior_sigma)
                    .trim_end()
                    .to_owned()
            })
            .collect();
        let _ = write!(
            page,
            "\n## {}\n\n{}\n\n| | |\n|---|---|\n",
            effect.name,
            cell(effect.physics)
        );
        let mut row = |name: &str, words: &str| {
            if !words.is_empty() {
                let _ = writeln!(page, "| {name} | {} |", cell(words));
            }
        };
        row("equation", effect.equation);
        row("sensors", &sensors.join(", "));
        row("usual size", &sizes.join(", "));
        row("source", effect.source);
        row("shows in", effect.excited_by);
        row("mistaken for", &effect.siblings.join(", "));
        row("confirm", effect.confirm_by);
    }
    page
}

fn all_thresholds() -> String {
    let of = |wanted: fn(&Provenance) -> bool| thresholds::ALL.iter().filter(|one| wanted(&one.provenance)).count();
    let mut page = format!(
        "# Thresholds of the diagnosis\n\n\
         Every number that decides what `ground gap` says: {} of them, {} derived, {} by convention, {} fitted on cases and {}\n\
         assumed. This page is drawn from `ground/gap/src/thresholds.rs`.\n",
        thresholds::ALL.len(),
        of(|from| matches!(from, Provenance::Derived(_))),
        of(|from| matches!(from, Provenance::Convention(_))),
        of(|from| matches!(from, Provenance::Fitted(_))),
        of(|from| matches!(from, Provenance::Assumed(_))),
    );
    for one in thresholds::ALL {
        let (from, why) = match one.provenance {
            Provenance::Derived(why) => ("derived", why),
            Provenance::Convention(why) => ("convention", why),
            Provenance::Fitted(why) => ("fitted", why),
            Provenance::Assumed(why) => ("assumed", why),
        };
        let unit = if one.unit == "1" { "" } else { one.unit };
        let _ = write!(
            page,
            "\n## {}\n\n{}\n\n| | |\n|---|---|\n| value | {} |\n| a larger one | {} |\n| a smaller one | {} |\n| {from} | {} |\n",
            one.name,
            cell(one.what.trim()),
            format!("{} {unit}", one.value).trim_end(),
            cell(one.larger),
            cell(one.smaller),
            cell(why)
        );
    }
    page
}

#[test]
fn drawn_pages_are_as_the_code_has_them() {
    for (file, drawn) in [
        ("docs/gap/effects.md", effects()),
        ("docs/gap/thresholds.md", all_thresholds()),
    ] {
        let path = root().join(file);
        if std::env::var("DOCS").is_ok_and(|what| what == "write") {
            fs::write(&path, &drawn).expect("can be written");
        }
        let kept = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            kept == drawn,
            "{file} is not as the code has it: DOCS=write cargo host-test --test docs"
        );
    }
}

/// Anchors as GitHub and mdBook make them of headings: letters, digits, `-` and `_`, in small letters, blanks as `-`.
fn anchor(heading: &str) -> String {
    (heading.to_lowercase().chars())
        .filter_map(|letter| match letter {
            ' ' => Some('-'),
            letter if letter.is_alphanumeric() || letter == '-' || letter == '_' => Some(letter),
            _ => None,
        })
        .collect()
}

/// Anchors of a page, and where its links lead.
fn read(text: &str) -> (BTreeSet<String>, Vec<String>) {
    let (mut anchors, mut links, mut heading) = (BTreeSet::new(), Vec::new(), None);
    for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::End(TagEnd::Heading(_)) => anchors.extend(heading.take().map(|words| anchor(&words))),
            Event::Text(words) | Event::Code(words) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&words);
                }
            }
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => links.push(dest_url.to_string()),
            _ => {}
        }
    }
    (anchors, links)
}

#[test]
fn every_link_leads_somewhere() {
    let root = root();
    let (mut pages, mut astray, mut followed) = (Vec::new(), Vec::new(), 0);
    markdown(&root, &mut pages);
    for page in &pages {
        let text = fs::read_to_string(page).expect("is text");
        for link in read(&text).1 {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            followed += 1;
            let (file, part) = link
                .split_once('#')
                .map_or((&*link, None), |(file, part)| (file, Some(part)));
            let target = match file {
                "" => page.clone(),
                file => page.parent().expect("has a folder").join(file),
            };
            let there = match part {
                _ if !target.exists() => false,
                Some(part) if target.extension().is_some_and(|kind| kind == "md") => {
                    let text = fs::read_to_string(&target).expect("is text");
                    read(&text).0.contains(part)
                }
                _ => true,
            };
            if !there {
                astray.push(format!(
                    "{}: {link}",
                    page.strip_prefix(&root).unwrap_or(page).display()
                ));
            }
        }
    }
    assert!(
        followed > 50,
        "{followed} links in {} pages: some were not read",
        pages.len()
    );
    assert!(astray.is_empty(), "{}", astray.join("\n"));
}

#[test]
fn the_book_leads_to_no_file_outside_of_it() {
    let docs = root().join("docs").canonicalize().expect("is there");
    let mut pages = Vec::new();
    markdown(&docs, &mut pages);
    for page in &pages {
        let folder = page.parent().expect("has a folder");
        for link in read(&fs::read_to_string(page).expect("is text")).1 {
            let file = link.split('#').next().unwrap_or_default();
            // What is not there is another test's.
            let Ok(target) = folder.join(file).canonicalize() else {
                continue;
            };
            assert!(
                target.starts_with(&docs),
                "{}: {link} is in no built book; name it without a link",
                page.display()
            );
        }
    }
}

#[test]
fn every_page_of_the_book_is_in_its_summary() {
    let docs = root().join("docs");
    let summary = fs::read_to_string(docs.join("SUMMARY.md")).expect("is there");
    let named: BTreeSet<PathBuf> = read(&summary).1.iter().map(|link| docs.join(link)).collect();
    let mut pages = Vec::new();
    markdown(&docs, &mut pages);
    for page in pages {
        assert!(
            named.contains(&page) || page.ends_with("SUMMARY.md"),
            "{} is not in docs/SUMMARY.md",
            page.display()
        );
    }
}

#[test]
fn the_citation_names_the_version_that_is_built() {
    let citation = fs::read_to_string(root().join("CITATION.cff")).expect("is there");
    let version = citation.lines().find_map(|line| line.strip_prefix("version: "));
    assert_eq!(version, Some(env!("CARGO_PKG_VERSION")), "CITATION.cff");
}
