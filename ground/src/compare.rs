//! `ground compare`: two flights side by side on one page.
//!
//! In: two folders of flights, or two files of packets. Out: one page: figures of both, and for every sensor and for the attitude the one
//! beside the other on equal axes that move together. Time is zero at lift-off where both have one, else at packet 0. Beside a
//! folder's packets its `motion.csv`, if there is one, gives the attitude's error. Refused: what holds no packet.

use std::{
    io::{self, Read},
    path::{Path, PathBuf},
};

use attitude::reference;
use chart::{Block, ChartError, Figure, Panel};
use logs::{
    digest::Digest,
    plot::{self, times::Times},
    record::Record,
    recording::{RecordingError, Row},
};
use packets::{input, output};

use crate::decode::cycle::{Contradicted, Cycle};

/// The packets of a flight's folder, and how it was turned.
const PACKETS: &str = "packets.txt";
const MOTION: &str = "motion.csv";

/// Characters of the first flight's column on a terminal.
const COLUMN: usize = 42;

/// Compares two flights: figures, every sensor and attitude side by side on one page
///
/// A and B are folders of `ground fly` or `ground decode`, or files of packets, gzip or not. Both are drawn on equal axes
/// that move together; time is zero at lift-off where both have one.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ground compare flights/rocket-1 flights/rocket-2\n  ground compare before.txt.gz after.txt.gz --page both.html"
)]
pub struct CompareArguments {
    /// The one
    pub a: PathBuf,
    /// The other
    pub b: PathBuf,
    /// Where the page goes
    #[arg(long, value_name = "FILE", default_value = "compare.html")]
    pub page: PathBuf,
    /// Print the figures as JSON
    #[arg(long)]
    pub json: bool,
}

/// Why two flights cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A file cannot be read or written.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// There is no packet in it.
    #[error("{0}: not one packet in it; give a folder of `ground fly` or `ground decode`, or a file of packets")]
    NoPackets(PathBuf),
    /// Its derived frames contradict each other.
    #[error("{path}: {source}")]
    Cycle {
        /// Which file.
        path: PathBuf,
        /// How.
        source: Contradicted,
    },
    /// Its motion is none.
    #[error(transparent)]
    Motion(#[from] RecordingError),
    /// A figure cannot be drawn.
    #[error(transparent)]
    Chart(#[from] ChartError),
}

/// A flight that was read.
struct Flown {
    name: String,
    record: Record,
    cycle_s: f64,
    motion: Option<Vec<Row>>,
}

/// Runs `ground compare`.
///
/// # Errors
/// See [`CompareError`].
pub fn compare(arguments: &CompareArguments) -> Result<(), CompareError> {
    let mut flown = [read(&arguments.a)?, read(&arguments.b)?];
    if flown[0].name == flown[1].name {
        for (flown, mark) in flown.iter_mut().zip(["A: ", "B: "]) {
            flown.name.insert_str(0, mark);
        }
    }
    let page = page(&flown)?;
    output::replace_with(&arguments.page, page).map_err(|source| CompareError::File {
        path: arguments.page.clone(),
        source,
    })?;
    if arguments.json {
        println!("{:#}", listed(&rows(&flown), &arguments.page));
        return Ok(());
    }
    for [name, a, b] in rows(&flown) {
        match a.chars().count() < COLUMN {
            true => println!("{name:28}{a:COLUMN$}{b}"),
            false => println!("{name:28}{a}\n{:28}{b}", ""),
        }
    }
    println!("{}", arguments.page.display());
    Ok(())
}

fn read(path: &Path) -> Result<Flown, CompareError> {
    let is_folder = path.is_dir();
    let file = if is_folder { path.join(PACKETS) } else { path.to_owned() };
    let failed = |source| CompareError::File {
        path: file.clone(),
        source,
    };
    let mut bytes = input::open(&file).map_err(failed)?;
    let mut digest = Digest::default();
    let mut cycle = Cycle::new(None);
    let mut piece = [0; 65_536];
    loop {
        let count = bytes.read(&mut piece).map_err(failed)?;
        if count == 0 {
            break;
        }
        let entries = digest.push(None, &piece[..count]);
        cycle.take(entries).map_err(|source| CompareError::Cycle {
            path: file.clone(),
            source,
        })?;
    }
    cycle.rest();
    if !cycle.any() {
        return Err(CompareError::NoPackets(file));
    }
    let motion = Some(path.join(MOTION)).filter(|motion| is_folder && motion.exists());
    let named = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    Ok(Flown {
        name: named.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        record: digest.finish().1,
        cycle_s: cycle.s(),
        motion: motion.map(|motion| reference::read(&motion, 0.0)).transpose()?,
    })
}

/// Figures of both, by name; a dash where one has none.
fn rows([a, b]: &[Flown; 2]) -> Vec<[String; 3]> {
    let [ours, theirs] = [a, b].map(|flown| flown.record.summary.rows());
    let mut names: Vec<&str> = ours.iter().map(|(name, _)| *name).collect();
    names.extend(
        theirs
            .iter()
            .map(|(name, _)| *name)
            .filter(|name| !ours.iter().any(|(known, _)| known == name)),
    );
    let value = |rows: &[(&str, String)], name: &str| {
        let row = rows.iter().find(|(known, _)| *known == name);
        row.map_or("-".to_owned(), |(_, value)| value.clone())
    };
    let head = ["".to_owned(), a.name.clone(), b.name.clone()];
    let each = names
        .into_iter()
        .map(|name| [name.to_owned(), value(&ours, name), value(&theirs, name)]);
    [head].into_iter().chain(each).collect()
}

/// The figures for programs, as the text has them, and where the page is.
fn listed(rows: &[[String; 3]], page: &Path) -> serde_json::Value {
    let (head, figures) = rows.split_first().map_or((["", "", ""], rows), |(head, rows)| {
        (head.each_ref().map(String::as_str), rows)
    });
    let figures = figures
        .iter()
        .map(|[name, a, b]| serde_json::json!({"name": name, "a": a, "b": b}));
    serde_json::json!({
        "a": head[1],
        "b": head[2],
        "figures": serde_json::Value::from_iter(figures),
        "page": page,
    })
}

fn page(flown: &[Flown; 2]) -> Result<String, ChartError> {
    let lift_offs = [0, 1].map(|k| flown[k].record.events.lift_off());
    let is_launch = lift_offs.iter().all(Option::is_some);
    let mut times: Vec<Times> = (flown.iter().zip(lift_offs))
        .map(|(flown, lift_off)| {
            let zero_s = lift_off
                .filter(|_| is_launch)
                .map_or(0.0, |number| number as f64 * flown.cycle_s);
            Times::of(&flown.record.envelope, flown.cycle_s, zero_s)
        })
        .collect();
    // One clock for both, the longer one's, and axes of both flights' length.
    let unit_s = times.iter().map(|times| times.clock.unit_s).fold(0.0, f64::max);
    let label = times
        .iter()
        .find(|times| times.clock.unit_s == unit_s)
        .map(|times| times.clock.label.clone());
    let label = label
        .unwrap_or_default()
        .replace("time", if is_launch { "time since lift-off" } else { "time" });
    for times in &mut times {
        let clock = plot::attitude::Clock {
            label: label.clone(),
            unit_s,
            ..times.clock.clone()
        };
        times.on(clock);
    }
    let ends = times.iter().map(Times::ends);
    let (least, most) = ends.fold((f64::MAX, f64::MIN), |(least, most), (from, to)| {
        (least.min(from), most.max(to))
    });
    let beside = |panel: Panel, name: &str| Panel {
        title: if panel.title.is_empty() {
            name.to_owned()
        } else {
            format!("{}, {name}", panel.title)
        },
        x: panel.x.between(least, most),
        ..panel
    };
    let marks: Vec<_> = (flown.iter().zip(&times))
        .map(|(flown, times)| plot::marks(&flown.record.events, times))
        .collect();
    let mut blocks = vec![table(flown)];
    for (title, quantities, names) in plot::SENSORS {
        let panels: Vec<Panel> = (0..8)
            .map(|at| (at / 2, at % 2))
            .map(|(plate, k)| {
                beside(
                    plot::sensors(&times[k], plate, quantities, names, &marks[k]),
                    &flown[k].name,
                )
            })
            .collect();
        blocks.push(Block::Figure(Figure::of(title, 2, &panels)?));
    }
    let turned: Vec<_> = (flown.iter())
        .map(|flown| {
            flown
                .record
                .attitude
                .as_ref()
                .map(|follow| follow.flight(flown.cycle_s))
                .unwrap_or_default()
        })
        .collect();
    let both = |panels: [Vec<Panel>; 2]| -> Vec<Panel> {
        let [ours, theirs] = panels;
        let pairs = ours.into_iter().zip(theirs);
        pairs
            .flat_map(|(a, b)| [beside(a, &flown[0].name), beside(b, &flown[1].name)])
            .collect()
    };
    if turned.iter().all(|flight| !flight.estimates.is_empty()) {
        let angles = [0, 1].map(|k| plot::attitude::angles(&turned[k], flown[k].motion.as_deref(), &times[k].clock));
        blocks.push(Block::Figure(Figure::of("Attitude", 2, &both(angles))?));
        if let [Some(one), Some(other)] = [0, 1].map(|k| flown[k].motion.as_deref()) {
            let errors = [one, other]
                .into_iter()
                .enumerate()
                .map(|(k, rows)| plot::attitude::errors(&turned[k], rows, &times[k].clock));
            let errors: Vec<Vec<Panel>> = errors.collect();
            let [one, other]: [Vec<Panel>; 2] = errors.try_into().unwrap_or_default();
            blocks.push(Block::Figure(Figure::of(
                "Attitude error against motion.csv",
                2,
                &both([one, other]),
            )?));
        }
    }
    let about = if is_launch {
        "Two flights side by side; time is zero at lift-off."
    } else {
        "Two flights side by side; time is zero at packet 0."
    };
    Ok(chart::html(
        &format!("{} and {}", flown[0].name, flown[1].name),
        about,
        &blocks,
    ))
}

fn table(flown: &[Flown; 2]) -> Block {
    let mut rows = rows(flown).into_iter().map(Vec::from);
    let columns = rows.next().unwrap_or_default();
    Block::Table {
        columns,
        rows: rows.collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use emems::{
        packet::encode,
        sample::{Errors, Reading},
    };

    use super::*;

    fn stream(count: u16, lift_off: u16) -> Vec<u8> {
        let packet = |counter: u16| {
            encode(&Reading {
                errors: Errors(0),
                gyro: [counter as i16; 4],
                lift_off: counter >= lift_off,
                ..Reading::unread(counter)
            })
        };
        (0..count).flat_map(packet).collect()
    }

    #[test]
    fn two_flights_stand_side_by_side_with_time_from_lift_off() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = place.path().join("one");
        fs::create_dir(&folder).expect("a folder");
        fs::write(folder.join(PACKETS), stream(100, 30)).expect("written");
        fs::write(place.path().join("two.txt"), stream(80, 50)).expect("written");
        let flown = [
            read(&folder).expect("one"),
            read(&place.path().join("two.txt")).expect("two"),
        ];
        let table = rows(&flown);
        assert_eq!(table[1], ["packets", "100", "80"].map(str::to_owned));
        let listed = listed(&table, Path::new("both.html"));
        assert_eq!(
            listed["figures"][0],
            serde_json::json!({"name": "packets", "a": "100", "b": "80"})
        );
        assert_eq!(
            (&listed["b"], &listed["page"]),
            (&"two.txt".into(), &"both.html".into())
        );
        let page = page(&flown).expect("a page");
        assert!(page.contains("plate 1, one") && page.contains("plate 1, two.txt"));
        assert!(page.contains("time since lift-off [s]"));
        // One from -6.1 s to 14 s, the other from -10.1 s to 6 s: both axes have all of it.
        let from = page.matches("\"from\":-10.1").count();
        assert_eq!(from, page.matches("data-panel=").count(), "equal axes");
    }

    #[test]
    fn what_holds_no_packet_is_refused_by_name() {
        let place = tempfile::tempdir().expect("a folder");
        let file = place.path().join("page.html");
        fs::write(&file, "<html>").expect("written");
        let error = read(&file).err().expect("no packets").to_string();
        assert!(error.contains("page.html: not one packet"), "{error}");
        assert!(read(place.path()).is_err(), "a folder without packets.txt");
    }
}
