//! One page of results in a file that needs nothing else.
//!
//! In: title, a line about it, and [`Block`]s in order. Out: HTML with its style and pictures within; no script, no
//! reference to anything outside. Text is escaped, whatever it is.

use std::fmt::Write;

use crate::Figure;

/// A part of a page.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// A heading.
    Heading(String),
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
    /// A picture.
    Figure(Figure),
}

const STYLE: &str = "
body { font: 16px/1.45 system-ui, sans-serif; color: #1a1a1a; background: #fff; max-width: 1320px; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.7rem; margin: 0 } h2 { font-size: 1.2rem; margin: 2.2rem 0 .2rem }
p { margin: .3rem 0 1rem; color: #333; max-width: 60rem }
table { border-collapse: collapse; margin: .4rem 0 1rem } th { text-align: left; font-weight: 600; padding: .25rem 2rem .25rem 0; vertical-align: top }
td { font-variant-numeric: tabular-nums; padding: .25rem 1.2rem .25rem 0 } tr + tr, tbody tr { border-top: 1px solid #ddd }
pre { background: #f6f6f6; padding: .8rem 1rem; overflow-x: auto }
ul { list-style: none; margin: 0 0 .3rem; padding: 0; display: flex; flex-wrap: wrap; gap: .2rem 1.4rem }
i { display: inline-block; width: 1.3rem; height: .7rem; margin-right: .45rem; border: 1px solid #0002 }
svg { max-width: 100%; height: auto; display: block }
@media print { h2 { break-after: avoid } section { break-inside: avoid } }
";

/// The page.
pub fn html(title: &str, about: &str, blocks: &[Block]) -> String {
    let mut page = String::new();
    let mut put = |text: std::fmt::Arguments<'_>| {
        // Writing to a string cannot fail.
        let _ = page.write_fmt(text);
    };
    let title = escape(title);
    put(format_args!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>{STYLE}</style>\n\
         <h1>{title}</h1>\n<p>{}</p>\n",
        escape(about)
    ));
    for block in blocks {
        match block {
            Block::Heading(text) => put(format_args!("<h2>{}</h2>\n", escape(text))),
            Block::Text(text) => put(format_args!("<p>{}</p>\n", escape(text))),
            Block::Terminal(text) => put(format_args!("<pre>{}</pre>\n", escape(text))),
            Block::Rows(rows) => {
                put(format_args!("<table>\n"));
                for (name, value) in rows {
                    put(format_args!("<tr><th>{}<td>{}\n", escape(name), escape(value)));
                }
                put(format_args!("</table>\n"));
            }
            Block::Table { columns, rows } => {
                put(format_args!("<table>\n<thead><tr>"));
                for name in columns {
                    put(format_args!("<th>{}", escape(name)));
                }
                put(format_args!("\n<tbody>\n"));
                for row in rows {
                    put(format_args!("<tr>"));
                    for cell in row {
                        put(format_args!("<td>{}", escape(cell)));
                    }
                    put(format_args!("\n"));
                }
                put(format_args!("</table>\n"));
            }
            Block::Figure(figure) => {
                put(format_args!("<section>\n<h2>{}</h2>\n<ul>\n", escape(&figure.title)));
                for (colour, meaning) in &figure.legend {
                    put(format_args!(
                        "<li><i style=\"background:{}\"></i>{}\n",
                        escape(colour),
                        escape(meaning)
                    ));
                }
                put(format_args!("</ul>\n{}\n</section>\n", figure.svg));
            }
        }
    }
    page
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup() {
        let evil = || "<script>&\"".to_string();
        let blocks = [
            Block::Heading(evil()),
            Block::Text(evil()),
            Block::Terminal(evil()),
            Block::Rows(vec![(evil(), evil())]),
            Block::Table {
                columns: vec![evil()],
                rows: vec![vec![evil()]],
            },
            Block::Figure(Figure {
                title: evil(),
                legend: vec![(evil(), evil())],
                svg: String::new(),
            }),
        ];
        let page = html("a<b", "", &blocks);
        assert!(page.contains("<h1>a&lt;b</h1>"));
        assert!(page.contains("<td>&lt;script&gt;&amp;&quot;"));
        assert!(!page.contains("<script"));
    }
}
