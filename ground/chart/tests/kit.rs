//! The page kit in a real browser: plots zoom, pan, show values, switch, follow keys and fingers, dark mode and paper.
//!
//! Ignored by name, since a machine need not have a browser; `.ci/pages` installs one and runs them.

mod browser;

use std::{fs, path::PathBuf};

use browser::Browser;
use chart::{Arrow, Axis, Block, Face, Figure, Layer, Map, Marks, Panel, Poses, Scene, html};
use tempfile::TempDir;

/// A page with every kind of mark, a map, a body.
fn page() -> (TempDir, PathBuf) {
    let wave = |k: i32, shift: f64| (f64::from(k) * 0.1, (0.05 * f64::from(k) + shift).sin());
    let line = |shift: f64| (0..1000).map(|k| wave(k, shift)).collect::<Vec<_>>();
    let panel = |title: &str, layers: Vec<Layer>| Panel {
        title: title.into(),
        x: Axis::linear("time [s]"),
        y: Axis::linear("value [1]"),
        layers,
    };
    let first = panel(
        "lines and marks",
        vec![
            Layer::new("shade", 5, Marks::Spans(vec![(20.0, 40.0)])),
            Layer::new(
                "band",
                5,
                Marks::Band(line(0.0).into_iter().map(|(x, y)| (x, y - 0.2, y + 0.2)).collect()),
            ),
            Layer::new("one", 0, Marks::Line(line(0.0))),
            Layer::new("other", 1, Marks::Dashes(line(1.0))),
            Layer::new("strip", 3, Marks::Strip(vec![(10.0, 15.0), (50.0, 50.0)])),
            Layer::new(
                "events",
                6,
                Marks::Instants(vec![(5.0, "lift-off".into()), (60.0, "burn-out".into())]),
            ),
        ],
    );
    let second = panel("dots", vec![Layer::new("dots", 2, Marks::Dots(line(2.0)))]);
    let bars = Panel {
        x: Axis::named("thing", ["a", "b", "c"].map(str::to_string)),
        y: Axis::linear("size [1]"),
        layers: vec![
            Layer::new("bars", 0, Marks::Bars(vec![(1.0, 3.0), (2.0, -1.0), (3.0, 2.0)])),
            Layer::new("whiskers", 1, Marks::Whiskers(vec![(1.0, 2.5, 3.5), (2.0, -1.5, -0.5)])),
        ],
        ..panel("bars", Vec::new())
    };
    let decades = Panel {
        x: Axis::logarithmic("frequency [Hz]"),
        y: Axis::logarithmic("density [1/Hz]"),
        layers: vec![Layer::new(
            "power",
            0,
            Marks::Line(
                (1..500)
                    .map(|k| (f64::from(k) * 0.01, 1.0 / f64::from(k * k)))
                    .collect(),
            ),
        )],
        ..panel("decades", Vec::new())
    };
    let map = Map {
        rows: vec!["a1x".into(), "g1".into()],
        columns: (1..=20).map(|k| k.to_string()).collect(),
        values: vec![(0..20).map(|k| f64::from(k) / 19.0).collect(), vec![f64::NAN; 20]],
    };
    let turns = (0..200).map(|k| {
        (
            f64::from(k) * 0.5,
            [(0.02 * f64::from(k)).cos(), 0.0, 0.0, (0.02 * f64::from(k)).sin()],
        )
    });
    let scene = Scene {
        time: "time [s]".into(),
        faces: vec![Face {
            corners: vec![[0.6, 0.0, 0.0], [-0.3, 0.3, 0.0], [-0.3, -0.3, 0.0]],
            colour: 0,
        }],
        body: vec![Arrow {
            tip: [1.0, 0.0, 0.0],
            name: "x".into(),
            colour: 0,
        }],
        world: vec![Arrow {
            tip: [1.2, 0.0, 0.0],
            name: "north".into(),
            colour: 6,
        }],
        poses: vec![Poses {
            name: "filter".into(),
            colour: 0,
            at: turns.collect(),
        }],
    };
    let blocks = [
        Block::Lead("Everything that a page may have stands on this one.".into()),
        Block::Rows(vec![("name".into(), "value ".repeat(30))]),
        Block::Terminal("a terminal's line that is rather wide ".repeat(4)),
        Block::Figure(Figure::of("Lines", 2, &[first, second]).expect("drawn")),
        Block::Figure(Figure::of("Others", 3, &[bars, decades]).expect("drawn")),
        Block::Figure(Figure::map("A map", &map).expect("drawn")),
        Block::Figure(Figure::scene("A body", scene).expect("drawn")),
    ];
    let place = tempfile::tempdir().expect("a folder");
    let file = place.path().join("page.html");
    fs::write(&file, html("The kit", "a page of its test", &blocks)).expect("written");
    (place, file)
}

/// What the first and the second panel show of x.
fn shown(browser: &mut Browser, panel: usize) -> [f64; 2] {
    let said = browser.eval(&format!(
        "(() => {{ const {{from, to}} = document.querySelector('[data-panel=\"{panel}\"]').dataset; return [+from, +to]; }})()"
    ));
    serde_json::from_value(said).expect("two numbers")
}

const FIRST: &str = "[data-panel=\"0\"] .u-over";

#[test]
#[ignore = "needs a browser: .ci/pages installs one and runs this"]
fn plots_zoom_pan_and_tell_values_and_those_of_one_axis_move_together() {
    let (_place, file) = page();
    let mut browser = Browser::start();
    browser.window(1280, false);
    browser.open(&file);
    browser.look_at_all();
    let points = browser.eval("[...document.querySelectorAll('[data-panel]')].map((one) => +one.dataset.points)");
    let points: Vec<f64> = serde_json::from_value(points).expect("numbers");
    assert!(
        points.len() == 4 && points.iter().all(|points| *points > 2.0),
        "{points:?}"
    );
    assert_eq!(
        browser.eval("getComputedStyle(document.querySelector('[data-panel] svg')).display"),
        "none"
    );
    let whole = shown(&mut browser, 0);
    browser.drag(FIRST, 0.3, 0.6);
    let zoomed = shown(&mut browser, 0);
    assert!(
        zoomed[0] > 25.0 && zoomed[1] < 65.0 && zoomed[1] - zoomed[0] > 25.0,
        "{zoomed:?}"
    );
    assert_eq!(
        shown(&mut browser, 1),
        zoomed,
        "the second panel has the same time axis"
    );
    let frequency = shown(&mut browser, 3);
    assert!(frequency[0] < 0.0, "decades are another axis: {frequency:?}");
    // Keys: later, nearer, all.
    browser.eval("document.querySelector('[data-panel=\"0\"] .plot').focus()");
    browser.key("ArrowRight");
    let later = shown(&mut browser, 0);
    assert!(
        later[0] > zoomed[0] && ((later[1] - later[0]) / (zoomed[1] - zoomed[0]) - 1.0).abs() < 1e-6,
        "{later:?}"
    );
    browser.key("+");
    let nearer = shown(&mut browser, 0);
    assert!(
        ((nearer[1] - nearer[0]) / (later[1] - later[0]) - 0.5).abs() < 1e-6,
        "{nearer:?}"
    );
    browser.key("Home");
    assert_eq!(shown(&mut browser, 0), whole);
    // The value under the pointer: at a third of the axis, of both lines, and in the other panel too.
    browser.point(FIRST, 1.0 / 3.0);
    let said = browser.eval("[...document.querySelectorAll('.under')].map((one) => one.textContent).join('|')");
    let said = said.as_str().expect("text");
    for part in ["time 32.", "shade", "band ", "one ", "other ", "dots "] {
        assert!(said.contains(part), "{part} in {said}");
    }
    // The true value of the first line there.
    let time: f64 = said
        .split(' ')
        .nth(1)
        .and_then(|word| {
            word.split(|c: char| !c.is_ascii_digit() && c != '.')
                .next()?
                .parse()
                .ok()
        })
        .expect("a time");
    let one: f64 = said
        .split("one ")
        .nth(1)
        .and_then(|rest| {
            rest.split(|c: char| !c.is_ascii_digit() && c != '.' && c != '-')
                .next()?
                .parse()
                .ok()
        })
        .expect("a value");
    assert!((one - (0.5 * time).sin()).abs() < 0.01, "{one} at {time}: {said}");
    assert_eq!(browser.complaints(), [] as [String; 0]);
    assert_eq!(browser.requests(), [] as [String; 0]);
}

#[test]
#[ignore = "needs a browser: .ci/pages installs one and runs this"]
fn legends_switch_bodies_turn_and_the_dark_is_dark() {
    let (_place, file) = page();
    let mut browser = Browser::start();
    browser.window(1100, true);
    browser.open(&file);
    browser.look_at_all();
    assert_eq!(
        browser.eval("getComputedStyle(document.body).backgroundColor"),
        "rgb(21, 24, 27)"
    );
    let count = |browser: &mut Browser| {
        browser
            .eval("+document.querySelector('[data-panel=\"0\"]').dataset.points")
            .as_f64()
    };
    let before = count(&mut browser);
    browser.eval("[...document.querySelectorAll('.bar button')].find((one) => one.textContent === 'one').click()");
    browser.frame();
    assert!(count(&mut browser) < before, "a line is gone");
    assert_eq!(
        browser.eval("document.querySelectorAll('.bar [aria-pressed=\"false\"]').length"),
        1
    );
    browser.eval("(() => { const slider = document.querySelector('.time input'); slider.value = 50; slider.dispatchEvent(new Event('input')); })()");
    browser.frame();
    assert_eq!(
        browser.eval("+document.querySelector('[data-scene]').dataset.time"),
        50.0
    );
    let said = browser.eval("document.querySelector('[data-panel=\"1\"] .under').textContent");
    assert!(
        said.as_str().is_some_and(|said| said.starts_with("time 50.")),
        "the plots' pointers follow: {said}"
    );
    assert_eq!(browser.complaints(), [] as [String; 0]);
}

#[test]
#[ignore = "needs a browser: .ci/pages installs one and runs this"]
fn a_phone_has_no_wider_page_and_fingers_zoom() {
    let (_place, file) = page();
    let mut browser = Browser::start();
    browser.window(400, false);
    browser.open(&file);
    browser.look_at_all();
    assert_eq!(browser.eval("document.documentElement.scrollWidth"), 400.0);
    let whole = shown(&mut browser, 0);
    browser.pinch(FIRST, [0.45, 0.55], [0.2, 0.8]);
    let zoomed = shown(&mut browser, 0);
    let part = (zoomed[1] - zoomed[0]) / (whole[1] - whole[0]);
    assert!(
        (part - 1.0 / 6.0).abs() < 0.02,
        "ten hundredths of the width fill sixty: {part}"
    );
    assert_eq!(shown(&mut browser, 1), zoomed);
    assert_eq!(browser.complaints(), [] as [String; 0]);
}

#[test]
#[ignore = "needs a browser: .ci/pages installs one and runs this"]
fn without_scripts_and_on_paper_there_are_pictures() {
    let (place, file) = page();
    let mut browser = Browser::start();
    browser.window(1280, false);
    browser.call(
        "Emulation.setScriptExecutionDisabled",
        serde_json::json!({"value": true}),
    );
    browser.open(&file);
    let seen = "[...document.querySelectorAll('[data-panel] svg, [data-scene] svg')].filter((one) => one.getBoundingClientRect().height > 100).length";
    assert_eq!(browser.eval(seen), 9.0, "four panels, five instants of the body");
    browser.call(
        "Emulation.setScriptExecutionDisabled",
        serde_json::json!({"value": false}),
    );
    browser.open(&file);
    browser.look_at_all();
    assert_eq!(browser.eval(seen), 0.0, "plots stand over them");
    browser.call("Emulation.setEmulatedMedia", serde_json::json!({"media": "print"}));
    assert_eq!(browser.eval(seen), 9.0);
    let pdf = place.path().join("page.pdf");
    browser.print(&pdf);
    assert!(fs::read(&pdf).expect("a PDF").starts_with(b"%PDF"));
}
