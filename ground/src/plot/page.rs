//! The one page of a flight: summary and figures, in a file that needs nothing else.
//!
//! In: title, rows, figures. Out: HTML with its style and pictures within; no script, no reference to anything outside.
//! Text is escaped, whatever it is.

use std::fmt::Write;

use super::Figure;

/// What stands above the figures.
pub struct Heading<'a> {
    /// Title of the page.
    pub title: &'a str,
    /// What was flown, in one line.
    pub about: &'a str,
    /// Names and values.
    pub rows: &'a [(&'static str, String)],
}

const STYLE: &str = "
body { font: 16px/1.45 system-ui, sans-serif; color: #1a1a1a; background: #fff; max-width: 1320px; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.7rem; margin: 0 } h2 { font-size: 1.2rem; margin: 2.2rem 0 .2rem }
p { margin: .3rem 0 1rem; color: #333 }
table { border-collapse: collapse } th { text-align: left; font-weight: 600; padding: .25rem 2rem .25rem 0; vertical-align: top }
td { font-variant-numeric: tabular-nums; padding: .25rem 0 } tr + tr { border-top: 1px solid #ddd }
ul { list-style: none; margin: 0 0 .3rem; padding: 0; display: flex; flex-wrap: wrap; gap: .2rem 1.4rem }
i { display: inline-block; width: 1.3rem; height: .7rem; margin-right: .45rem; border: 1px solid #0002 }
svg { width: 100%; height: auto; display: block }
@media print { h2 { break-after: avoid } section { break-inside: avoid } }
";

/// The page.
pub fn html(heading: &Heading, figures: &[Figure]) -> String {
    let mut page = String::new();
    let title = escape(heading.title);
    let mut put = |text: std::fmt::Arguments<'_>| {
        // Writing to a string cannot fail.
        let _ = page.write_fmt(text);
    };
    put(format_args!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>{STYLE}</style>\n\
         <h1>{title}</h1>\n<p>{}</p>\n<table>\n",
        escape(heading.about)
    ));
    for (name, value) in heading.rows {
        put(format_args!("<tr><th>{}<td>{}\n", escape(name), escape(value)));
    }
    put(format_args!("</table>\n"));
    for figure in figures {
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
        let rows = [("source", "<script>&\"".to_string())];
        let page = html(
            &Heading {
                title: "a<b",
                about: "",
                rows: &rows,
            },
            &[],
        );
        assert!(page.contains("<h1>a&lt;b</h1>"));
        assert!(page.contains("<td>&lt;script&gt;&amp;&quot;"));
        assert!(!page.contains("<script"));
    }
}
