//! One page of results in a file that needs nothing else.
//!
//! In: title, a line about it, and [`Block`]s in order. Out: HTML with its style, pictures, data and scripts within; a page
//! without figures has no script. Text is escaped, whatever it is. The page tells the browser (Content-Security-Policy) that it
//! fetches nothing and runs its own two scripts alone, by their hashes, so that no text on it can become one.
//!
//! The scripts are uPlot (axes, cursor, selection; see `assets/README.md`) and `assets/page.js`.

use std::fmt::Write;

use data_encoding::{BASE64, HEXLOWER};
use sha2::{Digest, Sha256};

use crate::{Body, COLOURS, Figure, live, live::Store};

/// A part of a page.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// A heading.
    Heading(String),
    /// What the page says in a sentence or two, in large letters.
    Lead(String),
    /// A paragraph.
    Text(String),
    /// Names and values.
    Rows(Vec<(String, String)>),
    /// A table: column names, then rows of cells.
    Table {
        /// Names of the columns.
        columns: Vec<String>,
        /// Rows of cells.
        rows: Vec<Vec<String>>,
    },
    /// Text as it stands in a terminal.
    Terminal(String),
    /// Files beside the page: what to call them, and their path from it. Any other address is left out.
    Links(Vec<(String, String)>),
    /// A picture.
    Figure(Figure),
}

/// Version of [`UPLOT`].
pub const UPLOT_VERSION: &str = "1.6.32";
/// uPlot, minified, as it is published (MIT).
pub const UPLOT: &str = include_str!("../assets/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../assets/uPlot.min.css");
const SCRIPT: &str = include_str!("../assets/page.js");
const STYLE: &str = include_str!("../assets/page.css");

const UPLOT_LICENCE: &str = include_str!("../assets/uPlot.LICENSE");

/// SHA-256 of [`UPLOT`] in hexadecimal digits.
pub fn uplot_sha256() -> String {
    HEXLOWER.encode(&Sha256::digest(UPLOT))
}

/// [`COLOURS`] on a dark ground: lighter.
const DARK: [(u8, u8, u8); COLOURS.len()] = [
    (74, 163, 223),
    (242, 140, 64),
    (47, 199, 154),
    (229, 160, 200),
    (240, 188, 60),
    (160, 215, 250),
    (160, 160, 160),
];

/// The page.
pub fn html(title: &str, about: &str, blocks: &[Block]) -> String {
    let mut store = Store::default();
    let mut body = String::new();
    for block in blocks {
        // Writing to a string cannot fail.
        let _ = put(&mut body, block, &mut store);
    }
    let (policy, scripts) = match store.is_empty() {
        true => (String::new(), String::new()),
        false => {
            let hash = |script: &str| format!(" 'sha256-{}'", BASE64.encode(&Sha256::digest(script)));
            let policy = format!("; script-src{}{}", hash(UPLOT), hash(SCRIPT));
            let data = store.text();
            let scripts = format!(
                "<script type=\"application/json\" id=\"plots\">{data}</script>\n\
                 <!-- uPlot {UPLOT_VERSION}:\n{UPLOT_LICENCE}-->\n<script>{UPLOT}</script>\n<script>{SCRIPT}</script>\n"
            );
            (policy, scripts)
        }
    };
    let (title, about) = (escape(title), escape(about));
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title}</title>\n<style>{UPLOT_STYLE}\n{STYLE}{}</style>\n<main>\n<h1>{title}</h1>\n<p>{about}</p>\n{body}</main>\n{scripts}",
        colours()
    )
}

/// Colours as the style and the script know them. Paper is light.
fn colours() -> String {
    let each = |colours: &[(u8, u8, u8)]| -> String {
        let named = colours.iter().enumerate();
        named
            .map(|(k, (red, green, blue))| format!("--c{k}:#{red:02x}{green:02x}{blue:02x};"))
            .collect()
    };
    let classes: String = (0..COLOURS.len())
        .map(|k| format!(".c{k}{{--c:var(--c{k})}}"))
        .collect();
    format!(
        ":root{{{}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{}}}}}\n{classes}\n",
        each(&COLOURS),
        each(&DARK)
    )
}

fn put(page: &mut String, block: &Block, store: &mut Store) -> std::fmt::Result {
    match block {
        Block::Heading(text) => writeln!(page, "<h2>{}</h2>", escape(text)),
        Block::Lead(text) => writeln!(page, "<p class=\"lead\">{}</p>", escape(text)),
        Block::Text(text) => writeln!(page, "<p>{}</p>", escape(text)),
        Block::Terminal(text) => writeln!(page, "<pre tabindex=\"0\">{}</pre>", escape(text)),
        Block::Rows(rows) => {
            writeln!(page, "<table class=\"rows\">")?;
            for (name, value) in rows {
                writeln!(page, "<tr><th>{}<td>{}", escape(name), escape(value))?;
            }
            writeln!(page, "</table>")
        }
        Block::Table { columns, rows } => {
            write!(page, "<div class=\"wide\"><table>\n<thead><tr>")?;
            for name in columns {
                write!(page, "<th>{}", escape(name))?;
            }
            writeln!(page, "\n<tbody>")?;
            for row in rows {
                write!(page, "<tr>")?;
                for cell in row {
                    write!(page, "<td>{}", escape(cell))?;
                }
                writeln!(page)?;
            }
            writeln!(page, "</table></div>")
        }
        Block::Links(links) => {
            // An address of another place or a script has a colon or begins with a slash.
            let beside = links.iter().filter(|(_, to)| !to.contains(':') && !to.starts_with('/'));
            let each: Vec<String> = beside
                .map(|(name, to)| format!("<a href=\"{}\">{}</a>", escape(&addressed(to)), escape(name)))
                .collect();
            writeln!(page, "<p class=\"links\">{}</p>", each.join(" "))
        }
        Block::Figure(figure) => figure_on(page, figure, store),
    }
}

fn figure_on(page: &mut String, figure: &Figure, store: &mut Store) -> std::fmt::Result {
    let title = escape(&figure.title);
    writeln!(page, "<section>\n<h2>{title}</h2>")?;
    match &figure.body {
        Body::Map(map) => page.push_str(&map.html()),
        Body::Scene(scene) => {
            let number = scene.live(store);
            writeln!(
                page,
                "<div class=\"scene\" data-scene=\"{number}\">\n{}</div>",
                scene.pictures()
            )?;
        }
        Body::Panels { columns, panels } => {
            writeln!(page, "<div class=\"bar\"><ul>")?;
            for (name, colour) in live::legend(panels) {
                writeln!(
                    page,
                    "<li class=\"c{colour}\"><i></i><span>{}</span></li>",
                    escape(name)
                )?;
            }
            writeln!(page, "</ul></div>\n<div class=\"panels n{columns}\">")?;
            for plot in panels {
                let number = store.panel(plot);
                let picture = plot.svg(*columns == 1, number);
                let heading = match plot.panel.title.as_str() {
                    "" => String::new(),
                    title => format!("<h3>{}</h3>", escape(title)),
                };
                writeln!(
                    page,
                    "<div class=\"panel\" data-panel=\"{number}\">{heading}\n{picture}</div>"
                )?;
            }
            writeln!(page, "</div>")?;
        }
    }
    writeln!(page, "</section>")
}

/// A path as an address: what has a meaning in one is written in percent.
fn addressed(path: &str) -> String {
    path.replace('%', "%25")
        .replace('#', "%23")
        .replace('?', "%3F")
        .replace(' ', "%20")
}

/// Text that cannot be markup.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Layer, Map, Marks, Panel, Scene};

    #[test]
    fn text_cannot_become_markup() {
        let evil = || "</script><script>&\"".to_string();
        let panel = Panel {
            title: evil(),
            x: Axis::linear(evil()),
            layers: vec![
                Layer::new(evil(), 0, Marks::Line(vec![(0.0, 1.0)])),
                Layer::new("", 0, Marks::Instants(vec![(0.5, evil())])),
            ],
            ..Panel::default()
        };
        let map = Map {
            rows: vec![evil()],
            columns: vec![evil()],
            values: vec![vec![0.5]],
        };
        let scene = Scene {
            time: evil(),
            ..Scene::default()
        };
        let blocks = [
            Block::Heading(evil()),
            Block::Lead(evil()),
            Block::Text(evil()),
            Block::Terminal(evil()),
            Block::Rows(vec![(evil(), evil())]),
            Block::Table {
                columns: vec![evil()],
                rows: vec![vec![evil()]],
            },
            Block::Links(vec![(evil(), "a.csv".into())]),
            Block::Figure(Figure::of(evil(), 1, &[panel]).unwrap()),
            Block::Figure(Figure::map(evil(), &map).unwrap()),
            Block::Figure(Figure::scene(evil(), scene).unwrap()),
        ];
        let page = html("a<b", "", &blocks);
        assert!(page.contains("<h1>a&lt;b</h1>"));
        assert!(page.contains("<td>&lt;/script&gt;&lt;script&gt;&amp;&quot;"));
        // Data, uPlot, ours.
        assert_eq!(
            (page.matches("<script").count(), page.matches("</script").count()),
            (3, 3)
        );
    }

    #[test]
    fn links_lead_to_files_beside_the_page_alone() {
        let to = [
            "si.csv",
            "javascript:alert(1)",
            "https://example.org",
            "//x",
            "/etc",
            "a b#c.csv",
        ];
        let links = to.map(|to| ("x".to_string(), to.to_string())).to_vec();
        let page = html("", "", &[Block::Links(links)]);
        assert_eq!(page.matches("<a href").count(), 2);
        assert!(page.contains("href=\"a%20b%23c.csv\""), "{page}");
    }

    #[test]
    fn a_page_asks_for_nothing_and_has_a_script_only_for_figures() {
        assert!(!html("", "", &[Block::Text("x".into())]).contains("<script"));
        let page = html(
            "",
            "",
            &[Block::Figure(Figure::of("", 1, &[Panel::default()]).unwrap())],
        );
        for asks in ["src=", "@import", "url(http", "fetch(", "XMLHttpRequest", "import("] {
            assert!(!page.contains(asks), "{asks}");
        }
        assert!(page.contains("default-src 'none'"));
    }

    /// What stands in `assets/README.md` and goes into the bill of materials.
    #[test]
    fn uplot_is_the_file_that_was_published() {
        let hash = |text: &str| HEXLOWER.encode(&Sha256::digest(text));
        let said = include_str!("../assets/README.md");
        for (name, text) in [
            ("uPlot.iife.min.js", UPLOT),
            ("uPlot.min.css", UPLOT_STYLE),
            ("uPlot.LICENSE", UPLOT_LICENCE),
        ] {
            let row = said.lines().find(|line| line.contains(name)).unwrap_or_default();
            assert!(row.contains(&hash(text)), "{name}: {}", hash(text));
        }
        assert!(UPLOT.starts_with(&format!(
            "/*! https://github.com/leeoniya/uPlot (v{}) */",
            UPLOT_VERSION
        )));
    }
}
