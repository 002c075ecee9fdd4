//! The pages that people get, in a real browser: no script error, nothing fetched, every plot has data, a zoom works, and the page is
//! no wider than its window at 1,280, 1,100 and 400 px.
//!
//! Ignored by name, since a machine need not have a browser; `.ci/pages` installs one and runs them. With `PAGES=FOLDER` the pages are kept
//! there as pictures, light and dark, and as they are printed.

#[path = "../chart/tests/browser/mod.rs"]
mod browser;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use browser::Browser;

fn ground(folder: &Path, words: &str) {
    let output = Command::new(env!("CARGO_BIN_EXE_ground"))
        .args(words.split(' '))
        .current_dir(folder)
        .output()
        .expect("ground");
    assert!(
        output.status.success(),
        "{words}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// What holds of every page.
fn look(browser: &mut Browser, name: &str, page: &Path) {
    for width in [1280, 1100, 400] {
        browser.window(width, false);
        browser.open(page);
        browser.look_at_all();
        let wide = browser.eval("document.documentElement.scrollWidth").as_f64();
        assert_eq!(wide, Some(f64::from(width)), "{name} is wider than its window");
        let empty = browser.eval(
            "[...document.querySelectorAll('[data-panel]')].filter((one) => !(one.dataset.points > 0)).map((one) => one.textContent.slice(0, 60))",
        );
        assert_eq!(empty, serde_json::json!([]), "{name} has plots without data");
        assert_eq!(browser.complaints(), [] as [String; 0], "{name}");
        assert_eq!(browser.requests(), [] as [String; 0], "{name} asks for something");
        keep(browser, name, width);
    }
    browser.window(1280, false);
    browser.open(page);
    browser.look_at_all();
    let span = |browser: &mut Browser| {
        let said = browser
            .eval("(() => { const {from, to} = document.querySelector('[data-panel]').dataset; return to - from; })()");
        said.as_f64().expect("a number")
    };
    let before = span(browser);
    browser.drag("[data-panel] .u-over", 0.25, 0.5);
    let part = span(browser) / before;
    assert!(
        (part - 0.25).abs() < 0.02,
        "{name}: a quarter was dragged, {part} is shown"
    );
}

/// Pictures for people, where they are asked for.
fn keep(browser: &mut Browser, name: &str, width: u32) {
    let Some(folder) = std::env::var_os("PAGES").map(PathBuf::from) else {
        return;
    };
    browser.picture(&folder.join(format!("{name}-{width}.png")));
    if width == 1280 {
        browser.print(&folder.join(format!("{name}.pdf")));
        browser.window(width, true);
        browser.frame();
        browser.picture(&folder.join(format!("{name}-dark.png")));
    }
}

#[test]
#[ignore = "needs a browser: .ci/pages installs one and runs this"]
fn a_flight_its_attitude_and_two_flights_side_by_side() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path();
    ground(
        folder,
        "fly --host --quiet --motion rocket --duration 100s --derived --silent a2@20s..30s --out flights",
    );
    ground(
        folder,
        "fly --host --quiet --motion rocket --duration 80s --flight 1 --seed 2 --out flights",
    );
    ground(
        folder,
        "attitude flights/rocket-1/packets.txt --reference flights/rocket-1/motion.csv --page attitude.html",
    );
    ground(folder, "compare flights/rocket-1 flights/rocket-2 --page compare.html");
    let flight = fs::read_to_string(folder.join("flights/rocket-1/index.html")).expect("a page");
    for part in [
        "lift-off",
        "burn-out",
        "a2 silent",
        "mode FLIGHT",
        "Error against the reference",
        "href=\"si.csv\"",
        "Spectra",
    ] {
        assert!(flight.contains(part), "{part}");
    }
    let mut browser = Browser::start();
    for (name, page) in [
        ("flight", "flights/rocket-1/index.html"),
        ("attitude", "attitude.html"),
        ("compare", "compare.html"),
    ] {
        look(&mut browser, name, &folder.join(page));
    }
}

#[test]
#[ignore = "needs a browser: .ci/pages installs one and runs this"]
fn a_verdict() {
    let place = tempfile::tempdir().expect("a folder");
    ground(
        place.path(),
        "fly --host --quiet --motion tumble --duration 100s --reference table --with hard-iron=3 --out .",
    );
    ground(place.path(), "gap tumble-1 --out verdict");
    let page = place.path().join("verdict/index.html");
    let text = fs::read_to_string(&page).expect("a page");
    let lead = text
        .split("<p class=\"lead\">")
        .nth(1)
        .and_then(|rest| rest.split("</p>").next())
        .expect("a sentence");
    assert!(lead.contains("because of hard-iron"), "{lead}");
    let mut browser = Browser::start();
    look(&mut browser, "verdict", &page);
}

#[test]
#[ignore = "needs a browser: .ci/pages installs one and runs this"]
fn the_page_of_a_day_is_small() {
    let place = tempfile::tempdir().expect("a folder");
    // A day at 5 Hz of a unit at rest: gravity, a field, no rate.
    let file = fs::File::create(place.path().join("day.txt")).expect("a file");
    let mut file = std::io::BufWriter::new(file);
    for k in 0..432_000_u32 {
        let noise = (k.wrapping_mul(2_654_435_761) >> 28) as i16;
        let reading = emems::sample::Reading {
            errors: emems::sample::Errors(0),
            acc_p: [[noise, -noise, 300], [noise, 0, 300], [noise, 0, 300], [-noise, 0, 300]],
            mag_p: [[200 + noise, 10, 100]; 4],
            gyro: [noise, noise - 3, 2, -noise],
            gyro_temperature: [0; 4],
            temperature: [400; 4],
            ..emems::sample::Reading::unread(k as u16)
        };
        std::io::Write::write_all(&mut file, &emems::packet::encode(&reading)).expect("written");
    }
    drop(file);
    ground(place.path(), "decode day.txt --out .");
    let page = place.path().join("day/index.html");
    let bytes = fs::metadata(&page).expect("a page").len();
    assert!(bytes < 3_000_000, "{bytes} bytes");
    let mut browser = Browser::start();
    browser.window(1280, false);
    browser.open(&page);
    // It is painted some time after it is loaded.
    let paint = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? null";
    let tries = (0..600).find_map(|_| {
        std::thread::sleep(std::time::Duration::from_millis(50));
        browser.eval(paint).as_f64()
    });
    let painted_ms = tries.expect("it is painted within half a minute");
    println!("a day: {bytes} bytes, first paint after {painted_ms:.0} ms");
    look(&mut browser, "day", &page);
}
