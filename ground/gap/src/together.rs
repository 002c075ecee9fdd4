//! Several logs of one unit: what they say together of what may be wrong with it.
//!
//! In: cases of one unit, with a reference or without. Out: the texts of one analysis: per effect what each log says and what all say
//! together, and where two logs contradict each other. What the unit has is in every log of it; where it was, what it was made to do, and how its
//! zeros wandered is each log's own. The steps, a file each:
//!
//! | step | file | gives |
//! |---|---|---|
//! | 1 | [`mod@unit`] | that the logs are of one unit as it is described |
//! | 2 | [`log`] | each log, its motion followed once |
//! | 3 | [`heard`] | what one log says of every effect, its own unknowns marginalised |
//! | 4 | [`joint`] | what some of them say together, and whether they agree |
//! | 5 | [`sought`], [`cause`] | which effects the evidence of all prefers, and what each log says of them |
//! | 6 | [`found`], [`shown`] | how far they are believed; what the logs can show at all |
//! | 7 | [`told`] | how it is told |
//!
//! A log says of the parameters `theta` of an effect, its motion, its zeros' walk and the nulls marginalised, and with the calibration `c` open:
//!
//! ```text
//! ln p(log | theta, c) = theta'b - theta'G theta / 2 + c'k - c'K c / 2 - theta'O c
//! ```
//!
//! Given `theta` and `c` the logs know nothing of each other, so `G`, `b`, `k`, `K` and `O` of several logs add up, and the prior of `theta`
//! and `c` counts once. With `c` marginalised after the sum, evidence, size and covariance are those of
//! [`crate::null::evidence`]. This is exact for effects that are small, as the first look at one log is. An effect that no log shows
//! alone is seen together, in size as well as in direction: each log may know another combination of its parameters.
//!
//! Scales and axes are one in all logs. A zero is one too, and may be another after each start, each within its sigma. Summed as if each log
//! had a calibration of its own, an error of the calibration would pass for an effect that every log shows.
//!
//! Effects are sought twice, as in one log ([`crate::parity`]). The first look takes parity of the logs without a reference and all of those with
//! one. The second takes the smoothed motions where they settled, and what it alone names must be shown by the held-out windows of the logs
//! without a reference, and not be refuted by the first.
//!
//! What all sensors share and no redundancy shows may be named where one log has a reference: the others leave it free.
//!
//! Refuses logs of different units, naming file and field, tables, and what any case is refused for.
//!
//! Of each log alone: effects on how sensors scatter, and those that begin at an instant of a log. Held-out windows of a log with a
//! reference, and slow errors of that reference, are looked at by the diagnosis of that log alone.

pub mod cause;
pub mod found;
pub mod heard;
pub mod joint;
pub mod log;
pub mod shown;
pub mod sought;
pub mod told;
pub mod unit;

use std::path::PathBuf;

use crate::{
    parity::ParityError,
    together::{found::Found, log::Logged},
};

/// Diagnoses several logs of one unit; every text of it, by file name. Motions are not looked at where `is_blind`.
///
/// # Errors
/// When a case cannot be judged, and when the logs are of different units.
pub fn analysed(
    cases: &[PathBuf],
    is_blind: bool,
    withheld: &[String],
    progress: &dyn Fn(&'static str, f64),
) -> Result<Vec<(String, String)>, ParityError> {
    unit::check(cases)?;
    let logs = Logged::all(cases, is_blind, withheld)?;
    let found = Found::of(&logs, withheld, progress)?;
    let verdict = serde_json::to_string_pretty(&told::verdict(&logs, &found))?;
    let texts = [
        ("verdict.json", format!("{verdict}\n")),
        ("all.txt", told::screen(&logs, &found)),
        ("index.html", told::html(&logs, &found)?),
        ("where.txt", told::gaps(&logs, &found)),
        ("why.txt", told::why(&logs, &found)),
        ("next.txt", told::next(&found)),
        ("limits.txt", told::limits(&logs, &found)),
        ("shrink.txt", told::NO_SHRINK.to_owned()),
    ];
    Ok(texts.map(|(name, text)| (name.to_owned(), text)).into())
}
