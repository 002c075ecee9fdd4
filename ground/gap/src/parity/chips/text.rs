//! Chips beside the first, in words and for programs.

use std::fmt::Write;

use nalgebra::{Matrix3, Vector3};
use serde_json::json;

use crate::{
    parity::chips::{Beside, joined::Sized},
    thresholds::{LEAST_PART, MATTERS_DEG, SELDOM, sigmas},
};

const AXES: [&str; 3] = ["x", "y", "z"];

/// Numbers of a chip that are looked at: scales and cross axes of its gyros, and of its accelerometers.
const NUMBERS: f64 = 18.0;

/// \[sigmas\] from which on one of these numbers is known to be there (Bonferroni).
fn known_from() -> f64 {
    sigmas(SELDOM / NUMBERS)
}

/// \[deg\] from which on it is told. Nobody needs smaller ones.
fn least_deg() -> f64 {
    LEAST_PART * MATTERS_DEG
}

/// A line and more a chip; nothing of a unit that has no two.
pub fn lines(chips: &[Beside]) -> String {
    let mut out = String::new();
    for own in chips {
        // Writing to a string cannot fail.
        let _ = write!(
            out,
            "CHIPS   {} seen from {}, {} rows of the whole log",
            own.name, own.first, own.rows
        );
        if let Some([place, sigma]) = &own.joined.place_m {
            let millimetres =
                |axis: usize| format!("{} {:.2} +- {:.2}", AXES[axis], 1e3 * place[axis], 1e3 * sigma[axis]);
            let _ = write!(out, "; it lies at {} mm", [0, 1, 2].map(millimetres).join(", "));
        }
        for (what, sized) in [("gyros", &own.joined.rates), ("accelerometers", &own.joined.forces)] {
            if let Some(sized) = sized {
                let _ = write!(out, "; {what}: {}", differs(sized));
            }
        }
        if let Some(sized) = &own.joined.fields {
            let [zero, sigma] = sized.zero;
            let axis = |axis: usize| format!("{:.2} +- {:.2}", zero[axis], sigma[axis]);
            let _ = write!(
                out,
                "; magnetometers: zero ({}) uT, {}",
                [0, 1, 2].map(axis).join(", "),
                differs(sized)
            );
        }
        if let Some(why) = turned_or_crossed(own) {
            let _ = write!(out, "; {why}");
        }
        out += "\n";
    }
    out
}

/// Cross axes and scales that are known to be there.
fn differs(sized: &Sized) -> String {
    let mut told = Vec::new();
    for (row, reads) in AXES.iter().enumerate() {
        for (column, of) in AXES.iter().enumerate() {
            let (size, sigma) = (sized.matrix[(row, column)], sized.sigmas[(row, column)]);
            let is_told = size.abs() > known_from() * sigma && size.abs().to_degrees() > least_deg();
            if is_told && row == column {
                told.push(format!("scale {} {:.3} +- {:.3} %", reads, 1e2 * size, 1e2 * sigma));
            } else if is_told {
                let (size, sigma) = (size.to_degrees(), sigma.to_degrees());
                told.push(format!("{} on {} {size:.3} +- {sigma:.3} deg", reads, of));
            }
        }
    }
    if told.is_empty() {
        "no cross axis nor scale that is known to be there".to_owned()
    } else {
        told.join(", ")
    }
}

/// Whether the largest cross axis of the gyros is a turned chip or their own.
///
/// A turn is antisymmetric, and accelerometers on the same chip show it.
pub fn turned_or_crossed(own: &Beside) -> Option<String> {
    let gyros = own.joined.rates.as_ref()?;
    let known = |at: &(usize, usize)| gyros.matrix[*at].abs() - known_from() * gyros.sigmas[*at];
    let beside = |(row, column): &(usize, usize)| {
        row != column && gyros.matrix[(*row, *column)].abs().to_degrees() > least_deg()
    };
    let all = (0..9).map(|at| (at / 3, at % 3)).filter(beside);
    let (row, column) = all.max_by(|one, other| known(one).total_cmp(&known(other)))?;
    if known(&(row, column)) < 0.0 {
        return None;
    }
    let (size, across) = (gyros.matrix[(row, column)], gyros.matrix[(column, row)]);
    let sigma = gyros.sigmas[(row, column)].hypot(gyros.sigmas[(column, row)]);
    let forces = own.joined.forces.as_ref()?;
    let (shown, shown_sigma) = (forces.matrix[(row, column)], forces.sigmas[(row, column)]);
    let is_shown = (shown - size).abs() < known_from() * shown_sigma.hypot(gyros.sigmas[(row, column)]);
    let is_hidden = shown.abs() < 0.5 * size.abs() && !is_shown;
    let is_turn = (size + across).abs() < known_from() * sigma;
    let is_even = (size - across).abs() < known_from() * sigma;
    let pair = format!(
        "{} on {} and {} on {}",
        AXES[row], AXES[column], AXES[column], AXES[row]
    );
    let shows = format!(
        "its accelerometers show {:.3} +- {:.3} deg",
        shown.to_degrees(),
        shown_sigma.to_degrees()
    );
    Some(match (is_turn && !is_even, is_even && !is_turn, is_shown, is_hidden) {
        (true, _, true, _) => format!("{pair} are opposite, and {shows}: one chip is turned against the other"),
        (_, true, _, true) => format!("{pair} are alike, and {shows}: cross-axis sensitivity of gyros, no turned chip"),
        (_, _, _, true) => format!("{shows} of {} on {}: not a turned chip alone", AXES[row], AXES[column]),
        _ => format!("whether a chip is turned or its gyros have cross axes, {pair} do not tell; {shows}"),
    })
}

/// For `verdict.json`.
pub fn json(chips: &[Beside]) -> Vec<serde_json::Value> {
    let rows = |matrix: &Matrix3<f64>| -> Vec<Vec<f64>> {
        (0..3).map(|row| matrix.row(row).iter().copied().collect()).collect()
    };
    let three = |of: &Vector3<f64>| -> Vec<f64> { of.iter().copied().collect() };
    let sized = |of: &Option<Sized>| {
        of.as_ref().map(|own| {
            json!({
                "zero": three(&own.zero[0]), "zero_sigma": three(&own.zero[1]),
                "matrix": rows(&own.matrix), "matrix_sigma": rows(&own.sigmas),
            })
        })
    };
    let chip = |own: &Beside| {
        let place = own.joined.place_m.as_ref();
        json!({
            "chip": own.name, "seen_from": own.first, "rows": own.rows,
            "place_m": place.map(|own| three(&own[0])), "place_sigma_m": place.map(|own| three(&own[1])),
            "gyros": sized(&own.joined.rates), "accelerometers": sized(&own.joined.forces), "magnetometers": sized(&own.joined.fields),
        })
    };
    chips.iter().map(chip).collect()
}
