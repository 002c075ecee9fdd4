//! What of each effect the logs can show, and what their codes say.
//!
//! In: what a look or two heard. Out: [`Visible`], a row an effect and a kind of place, in each log and in all; and [`Coded`].

use crate::{
    parity::{
        search::Seen,
        visible::{self, Row},
    },
    together::{
        heard::Heard,
        log::Logged,
        sought::{Searched, may_be_named, seen},
    },
};

/// What is visible of an effect in each log and in all.
pub struct Visible {
    /// In all, of the look that shows it best.
    pub together: Row,
    /// In each log alone, at the place where it is seen best there.
    pub each: Vec<f64>,
}

/// What codes say of an effect, and in which logs.
#[derive(Clone, Debug)]
pub struct Coded {
    /// In the library.
    pub effect: &'static str,
    /// Its channels.
    pub channels: Vec<String>,
    /// What was seen.
    pub what: String,
    /// Which logs.
    pub logs: Vec<usize>,
}

/// What is visible, in the order of the library, a row an effect and a kind of place.
pub fn visible(first: &Searched, second: Option<&Searched>, logs: &[Logged]) -> Vec<Visible> {
    let looks = || std::iter::once(first).chain(second);
    let table = |searched: &Searched, heard: &[&Heard]| {
        let seen = seen(&searched.library, heard);
        let mut rows = visible::table(&searched.library.hypotheses, &seen);
        for row in &mut rows {
            let of_row = |one: &&Seen| {
                let own = &searched.library.hypotheses[one.hypothesis];
                (own.effect(), visible::kind(&own.cause.locality)) == (row.effect, row.place)
            };
            let may = |one: &Seen| may_be_named(logs, &searched.library, one.hypothesis, one.snr);
            row.is_visible = seen.iter().filter(of_row).any(may);
        }
        rows
    };
    let best = |heard_of: &dyn Fn(&Searched) -> Vec<Row>| {
        let mut rows: Vec<Row> = Vec::new();
        for own in looks().flat_map(heard_of) {
            match rows
                .iter_mut()
                .find(|row| (row.effect, row.place) == (own.effect, own.place))
            {
                Some(known) => {
                    known.snr = known.snr.max(own.snr);
                    known.is_visible |= own.is_visible;
                }
                None => rows.push(own),
            }
        }
        rows
    };
    let each: Vec<Vec<Row>> = (0..logs.len())
        .map(|log| best(&|searched| table(searched, &[&searched.quiet[log]])))
        .collect();
    let together = best(&|searched| table(searched, &searched.quiet.iter().collect::<Vec<_>>()));
    let of_each = |row: &Row| {
        let own = |rows: &Vec<Row>| {
            let mut same = rows
                .iter()
                .filter(|own| (own.effect, own.place) == (row.effect, row.place));
            same.next().map_or(0.0, |own| own.snr)
        };
        each.iter().map(own).collect()
    };
    together
        .into_iter()
        .map(|row| Visible {
            each: of_each(&row),
            together: row,
        })
        .collect()
}

/// What the codes of the logs say, each effect and its channels once.
pub fn coded(logs: &[Logged]) -> Vec<Coded> {
    let mut all: Vec<Coded> = Vec::new();
    for (at, log) in logs.iter().enumerate() {
        for finding in log.coded() {
            let channels = log.channels(&finding.channels);
            let same = |own: &&mut Coded| own.effect == finding.effect && own.channels == channels;
            match all.iter_mut().find(same) {
                Some(known) => known.logs.push(at),
                None => all.push(Coded {
                    effect: finding.effect,
                    channels,
                    what: finding.what.clone(),
                    logs: vec![at],
                }),
            }
        }
    }
    all
}
