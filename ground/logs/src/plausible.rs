//! Whether the numbers of a nine-axis recording can be in their units, before anything is estimated from them.
//!
//! In: rows as they were read, and the units that were said. Out: rows in SI, or the [`Doubt`] about them. Five questions:
//! is there enough of it; is the step between rows one that a log of rates has; is specific force near one g; is the field the
//! Earth's; and do the rates turn the field as it is seen to turn? The last is the sharpest. A vector that is fixed outside
//! changes in b by `dv = -w x v dt`. So the regression of `dv` on `-w x v dt` has a slope of one, whatever the sensors'
//! errors; of 1/57.3 with rates in deg/s, of 1/1000 with times in ms ([`magnitude::likely`]).

use crate::units::Units;
use nalgebra::Vector3;
use packets::magnitude::{self, Doubt, Kind, digits};

use crate::recording::Row;

/// \[s\] what the filter needs of rest or motion before it has an attitude.
const LEAST_S: f64 = 1.0;

/// Rows in it.
const LEAST_ROWS: usize = 5;

/// \[s\] shortest time between two looks at a vector: noise of a sample over a shorter one hides what the rates do.
const LOOK_S: f64 = 0.02;

/// Sigmas by which a slope must differ from one before it is believed.
const SIGMAS: f64 = 8.0;

/// Why a recording is not used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Implausible {
    /// Too little of it.
    #[error("{rows} rows over {span_s:.3} s; at least {LEAST_ROWS} over {LEAST_S} s are needed (are the times in s?)")]
    Short {
        /// Rows.
        rows: usize,
        /// From first to last.
        span_s: f64,
    },
    /// Of a wrong size.
    #[error(transparent)]
    Size(#[from] Doubt),
    /// Rates that turn nothing.
    #[error(
        "the field turns {ratio} times as far as the rates say: {name} look like {unit}; say {option} {unit} if they are, \
         {option} {base} if not"
    )]
    Turning {
        /// Seen over said.
        ratio: String,
        /// What looks like another unit.
        name: &'static str,
        /// That unit.
        unit: &'static str,
        /// Option by which it is said.
        option: &'static str,
        /// Unit that was assumed.
        base: &'static str,
    },
}

/// The rows in SI.
///
/// # Errors
/// When they can hardly be in the units they are said to be in.
pub fn in_si(mut rows: Vec<Row>, units: &Units) -> Result<Vec<Row>, Implausible> {
    let size = |kind| units.size(kind);
    for row in &mut rows {
        row.t_s *= size(Kind::Time);
        row.rate_b *= size(Kind::Rate);
        row.acc_b = row.acc_b.map(|acc_b| acc_b * size(Kind::Force));
        row.mag_b = row.mag_b.map(|mag_b| mag_b * size(Kind::Field));
    }
    let steps = rows.windows(2).map(|pair| pair[1].t_s - pair[0].t_s);
    let norms = |of: fn(&Row) -> Option<Vector3<f64>>| magnitude::median(rows.iter().filter_map(of).map(|v| v.norm()));
    let fastest = rows.iter().map(|row| row.rate_b.amax()).fold(0.0, f64::max);
    for (what, kind, observed) in [
        (
            "the step between rows, the median,",
            Kind::Time,
            magnitude::median(steps),
        ),
        ("specific force, the median,", Kind::Force, norms(|row| row.acc_b)),
        ("the field, the median,", Kind::Field, norms(|row| row.mag_b)),
        ("the largest rate", Kind::Rate, Some(fastest)),
    ] {
        if let Some(observed) = observed {
            units.judge(what, kind, observed, kind.possible())?;
        }
    }
    let span_s = rows.last().map_or(0.0, |last| last.t_s) - rows.first().map_or(0.0, |first| first.t_s);
    if rows.len() < LEAST_ROWS || span_s < LEAST_S {
        let rows = rows.len();
        return Err(Implausible::Short { rows, span_s });
    }
    turning(&rows, units)?;
    Ok(rows)
}

fn turning(rows: &[Row], units: &Units) -> Result<(), Implausible> {
    let assumed: Vec<_> = [Kind::Rate, Kind::Time]
        .into_iter()
        .filter(|kind| units.told(*kind).is_none())
        .map(|kind| (kind, kind.base()))
        .collect();
    let Some((slope, sigma)) = slope(rows) else {
        return Ok(());
    };
    match magnitude::likely(slope, &assumed) {
        Some((kind, unit)) if (1.0 - slope).abs() > SIGMAS * sigma => Err(Implausible::Turning {
            ratio: digits(slope),
            name: if kind == Kind::Time { "the times" } else { "the rates" },
            unit: unit.name,
            option: kind.option(),
            base: kind.base().name,
        }),
        _ => Ok(()),
    }
}

/// Slope of the field's change over what the rates say of it, and its sigma; `None` where nothing turns.
fn slope(rows: &[Row]) -> Option<(f64, f64)> {
    let mut before: Option<(f64, Vector3<f64>)> = None;
    let mut turned_b = Vector3::zeros();
    let (mut xx, mut xy, mut yy, mut count) = (0.0, 0.0, 0.0, 0.0);
    for pair in rows.windows(2) {
        turned_b += (pair[0].rate_b + pair[1].rate_b) / 2.0 * (pair[1].t_s - pair[0].t_s);
        let Some(now) = pair[1].mag_b else { continue };
        let Some((since_s, last)) = before else {
            (before, turned_b) = (Some((pair[1].t_s, now)), Vector3::zeros());
            continue;
        };
        if pair[1].t_s - since_s < LOOK_S {
            continue;
        }
        let (said, seen) = (-turned_b.cross(&((now + last) / 2.0)), now - last);
        xx += said.norm_squared();
        xy += said.dot(&seen);
        yy += seen.norm_squared();
        count += 3.0;
        (before, turned_b) = (Some((pair[1].t_s, now)), Vector3::zeros());
    }
    if xx <= 0.0 || count < 30.0 {
        return None;
    }
    let slope = xy / xx;
    Some((slope, ((yy - slope * xy).max(0.0) / count / xx).sqrt()))
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    /// Ten seconds at 50 Hz, tumbling about a slow and a fast axis.
    fn rows() -> Vec<Row> {
        let mut q_nb = UnitQuaternion::identity();
        let rate_b = |t_s: f64| Vector3::new(0.4 * (0.7 * t_s).cos(), 0.3, 0.5 * (1.3 * t_s).sin());
        let row = |k: u32| {
            let t_s = 0.02 * f64::from(k);
            let row = Row {
                t_s,
                rate_b: rate_b(t_s),
                acc_b: Some(q_nb.inverse() * Vector3::new(0.0, 0.0, -9.81)),
                mag_b: Some(q_nb.inverse() * Vector3::new(20.0, 3.0, 40.0)),
                reference_nb: None,
                scored: true,
            };
            q_nb *= UnitQuaternion::new(rate_b(t_s + 0.01) * 0.02);
            row
        };
        (0..500).map(row).collect()
    }

    fn scaled(time: f64, rate: f64, force: f64, field: f64) -> Vec<Row> {
        let scale = |row: Row| Row {
            t_s: row.t_s * time,
            rate_b: row.rate_b * rate,
            acc_b: row.acc_b.map(|v| v * force),
            mag_b: row.mag_b.map(|v| v * field),
            ..row
        };
        rows().into_iter().map(scale).collect()
    }

    fn refused(rows: Vec<Row>, words: &str) {
        let error = in_si(rows, &Units::default()).expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
    }

    #[test]
    fn a_recording_in_si_is_taken_and_one_in_another_unit_named() {
        assert_eq!(in_si(rows(), &Units::default()).map(|rows| rows.len()), Ok(500));
        refused(scaled(1.0, 57.295_78, 1.0, 1.0), "--rates deg/s");
        refused(scaled(1e3, 1.0, 1.0, 1.0), "--times ms");
        refused(scaled(1.0, 1.0, 1.0 / 9.806_65, 1.0), "--forces g");
        refused(scaled(1.0, 1.0, 1.0, 0.01), "--fields gauss");
        refused(rows()[..2].to_vec(), "2 rows over 0.020 s");
    }

    #[test]
    fn times_in_ms_with_a_step_that_could_be_seconds_are_told_by_what_turns() {
        // Fifty times as fast, so at 2.5 kHz: a step of 0.4 could be in seconds, and only what turns can tell.
        refused(scaled(1e3 / 50.0, 50.0, 1.0, 1.0), "--times ms");
    }

    #[test]
    fn what_was_said_is_believed_and_put_into_si() {
        let units = Units {
            rates: Kind::Rate.unit("deg/s").ok(),
            ..Units::default()
        };
        let found = in_si(scaled(1.0, 57.295_779_5, 1.0, 1.0), &units).expect("deg/s");
        assert!((found[7].rate_b - rows()[7].rate_b).norm() < 1e-9);
    }
}
