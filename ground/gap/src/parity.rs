//! A log without a reference motion: what the unit's own redundancy says.
//!
//! In: a case without `motion`, or one whose motion is not to be looked at. Out: the texts of an analysis, of which each says what it
//! rests on. The steps, a file each:
//!
//! | step | file | gives |
//! |---|---|---|
//! | 1 | [`flight`] (by [`phases`], [`turning`]) | the fit windows of the log, and the unit in its environment; what it did when |
//! | 2 | [`beforehand`] (by [`codes`], [`garbled`], [`wired`], [`lost`], [`bending`]) | samples sent twice, lost, stuck and reversed bits; plates and axes that are exchanged; packets that nobody counted; a part that would bend the motion |
//! | 3 | [`course`] (by [`spline`]) | a smoothed motion from the packets, about which everything is linear |
//! | 4 | [`packet`] | per packet the unknowns of the motion, eliminated by QR |
//! | 5 | [`space`] | inner products with motion and calibration marginalised |
//! | 6 | [`visible`], [`nulls`] | of each effect, what this log can show at all, before anything is sought |
//! | 7 | [`search`] (by [`walk`], [`again`]) | which effects the evidence prefers among those that can be seen |
//! | 8 | [`crate::parity::smooth`], [`followed`], [`known`] | the motion along the whole log, with what else is known of it |
//! | 9 | [`smoothed`] | which others it prefers about that motion, and what the held-out windows say |
//! | 10 | [`findings`], [`name`] | which of them are said, and where the gap is |
//! | 11 | [`text`], [`verdict`], [`page`] | how it is told |
//!
//! Per packet the channels are `y = h + A x + C beta + E theta + noise`. `x` is the deviation from the smoothed motion: rate,
//! specific force, field and temperature, which are free, and the derivatives of rate and force, which are known about as well
//! as the packets before and after tell them. Within the packet `m' = -w x m` and `f' = -w x f + jerk`. With `[A; P] = Q R`, `P`
//! being the prior rows, the motion is marginalised by `<u, v> = u'v - (Q'[u; 0])'(Q'[v; 0])`; residual, calibration and effects
//! go through the same operator, so an effect that is another motion has no column left. No attitude is needed for
//! this: the attitude of the smoothed motion only says where the columns of effects that feel north or gravity point.
//!
//! Of several chips on one body, [`chips`] says where each lies and how its axes differ, beside all this.
//!
//! One plate has no redundancy: [`plate`] says what its whole log shows all the same.
//!
//! Columns are those of [`crate::library`], made about the smoothed motion. The held-out windows have a motion of their own, and say
//! whether what is named is as strong there.

pub mod again;
pub mod beforehand;
pub mod bending;
pub mod chips;
pub mod codes;
pub mod course;
pub mod findings;
pub mod flight;
pub mod followed;
pub mod garbled;
pub mod known;
pub mod lost;
pub mod name;
pub mod nulls;
pub mod packet;
pub mod page;
pub mod phases;
pub mod plate;
pub mod search;
pub mod smooth;
pub mod smoothed;
pub mod space;
pub mod spline;
mod taken_out;
pub mod text;
pub mod turning;
pub mod verdict;
pub mod visible;
pub mod walk;
pub mod wired;

use std::path::Path;

use crate::{
    input::case::CaseError,
    parity::{
        findings::Findings, flight::Flight, followed::Followed, plate::sensors::Sensors, smooth::told::Told,
        verdict::Verdict,
    },
};

/// File of the verdict, of the screen and of the page among the texts.
const FILES: [&str; 3] = ["verdict.json", "all.txt", "index.html"];

/// File of the smoothed attitude.
pub const ATTITUDE: &str = "attitude.csv";

const NO_SHRINK: &str = "without a reference the gap of the held-out windows is not judged; they are asked how strong there what is named is\n";

/// Why nothing is said.
#[derive(Debug, thiserror::Error)]
pub enum ParityError {
    /// The case cannot be judged, or its unit has no redundancy.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The verdict is not finite somewhere.
    #[error("the verdict cannot be written: {0}")]
    Json(#[from] serde_json::Error),
    /// A plot cannot be drawn.
    #[error(transparent)]
    Chart(#[from] chart::ChartError),
}

/// Diagnoses a log by parity; every text of it, by file name. `progress` is told what goes on and how far it is, 0 to 1.
///
/// # Errors
/// When the case cannot be judged, and when its unit has no redundancy.
pub fn analysed(
    case: &Path,
    withheld: &[String],
    progress: &dyn Fn(&'static str, f64),
) -> Result<Vec<(String, String)>, ParityError> {
    let flight = Flight::open(case)?;
    if let Some(sensors) = Sensors::of(&flight.unit) {
        return of_plate(&flight, sensors, withheld, progress);
    }
    let beforehand = beforehand::look(&flight, withheld)?;
    let followed = Followed::of(&flight, &flight.log, &beforehand);
    let findings = Findings::along(&flight, withheld, &beforehand, &followed, progress)?;
    let told = Told::explained(&followed, &findings, &|share| progress("attitude", share))?;
    let verdict = serde_json::to_string_pretty(&Verdict::new(&flight, &findings, &told))?;
    let screen = text::screen(&flight, &findings, &told);
    let texts = [format!("{verdict}\n"), screen, page::html(&flight, &findings, &told)?];
    let mut texts: Vec<(String, String)> = FILES.iter().map(|name| (*name).to_owned()).zip(texts).collect();
    let sections = [
        ("where.txt", text::places(&findings)),
        ("why.txt", text::why(&flight, &findings)),
        ("next.txt", text::next(&findings)),
        ("limits.txt", text::visibility(&findings)),
        ("shrink.txt", NO_SHRINK.to_owned()),
    ];
    texts.extend(sections.map(|(name, text)| (name.to_owned(), text)));
    texts.extend(told.csv().map(|text| (ATTITUDE.to_owned(), text)));
    Ok(texts)
}

/// The same of one plate.
fn of_plate(
    flight: &Flight,
    sensors: Sensors,
    withheld: &[String],
    progress: &dyn Fn(&'static str, f64),
) -> Result<Vec<(String, String)>, ParityError> {
    let findings = plate::Findings::of(flight, sensors, withheld, progress)?;
    let verdict = serde_json::to_string_pretty(&plate::told::verdict(flight, &findings))?;
    let texts = [
        ("verdict.json", format!("{verdict}\n")),
        ("all.txt", plate::text::screen(flight, &findings)),
        ("index.html", plate::told::html(flight, &findings)?),
        ("where.txt", plate::text::places(&findings)),
        ("why.txt", plate::text::why(flight, &findings)),
        ("next.txt", plate::text::next(flight, &findings) + "\n"),
        ("limits.txt", nulls::told()),
        ("shrink.txt", NO_SHRINK.to_owned()),
    ];
    let mut texts: Vec<(String, String)> = texts.into_iter().map(|(name, text)| (name.to_owned(), text)).collect();
    let attitude = plate::attitude::attitude(&findings).csv();
    texts.extend(attitude.map(|text| (ATTITUDE.to_owned(), text)));
    Ok(texts)
}
