//! What a calibration is held against before it may be called good.
//!
//! In: what was found, the nominal unit, and what the table says of its own noise. Out: a line for each thing that is wrong,
//! with the row where there is one. The unit itself takes scales from half to twice nominal and axes within 10 deg
//! ([`emems::calibration`]); parts are far better than that, so that here the limits are tighter.

use nalgebra::{DMatrix, DVector, Vector3};
use packets::magnitude::{self, Kind, Unit, digits};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// Relative: the worst part of the unit is specified at +-10 % (LIS331HH 2.7 to 3.3 mg a digit, HMC5883L gain tolerance), and
/// calibrations of real units are 1 to 4 % off (Marinho 2017, Eq 4.40). Twice the specification is another part or unit.
const SCALE: f64 = 0.2;

/// \[deg\] The thesis' worst axis is 1.3 deg off where it was built in; exchanged ones are 53 deg off at least.
const AXIS_DEG: f64 = 5.0;

/// Scatter beyond this many of the sigmas that the table states: sigmas of runs differ by a factor of two or three (Table 7.4
/// of Siqueira 2014 scatters twice its own), not of ten.
const BEYOND_STATED: f64 = 10.0;

/// Share of full scale by which a row may leave the straight line.
const STRAIGHT: f64 = 0.1;

/// Least share of full scale that a bend must have to matter: the parts' linearity is 0.1 to 1 % (data sheets).
const BEND: f64 = 0.003;

/// Chance of a pattern in residuals that have none: one channel in ten thousand.
const CHANCE: f64 = 1e-4;

/// Fewer degrees of freedom than this say nothing of a pattern.
const FREEDOM: usize = 4;

/// Share of the residuals' energy that a drift must explain: with less, other things are more worth looking at.
const DRIFT_SHARE: f64 = 0.5;

/// Beyond this variance inflation factor, 1 / (1 - r^2), two columns count as one (Marquardt 1970, Technometrics 12, 591).
const INFLATION: f64 = 10.0;

/// A scale against the nominal one [counts per unit]; `declared` are the units that the excitation was read in.
pub fn scale(channel: &str, found: f64, nominal: f64, declared: &[(Kind, Unit)]) -> Option<String> {
    let ratio = found / nominal;
    if (1.0 / (1.0 + SCALE)..=1.0 + SCALE).contains(&ratio) {
        return None;
    }
    let mut line = format!(
        "{channel}: {} counts per unit, {} times the nominal {} (at most {:.0} % off is believed)",
        digits(found),
        digits(ratio),
        digits(nominal),
        100.0 * SCALE
    );
    if (ratio * nominal - 1.0).abs() < SCALE {
        line += "; the outputs look like physical units, not counts: calibrate counts (`ground decode --counts`)";
    } else if let Some((kind, unit)) = magnitude::likely(ratio, declared) {
        line += &format!(
            "; the excitation looks like {name}: say {} {name}",
            kind.option(),
            name = unit.name
        );
    }
    Some(line)
}

/// A sensitive axis against the nominal one.
pub fn axis(channel: &str, found_b: Vector3<f64>, nominal_b: Vector3<f64>) -> Option<String> {
    let off_deg = found_b.angle(&nominal_b).to_degrees();
    (off_deg > AXIS_DEG).then(|| {
        format!(
            "{channel}: its axis is {off_deg:.1} deg from where it is built in (at most {AXIS_DEG} deg is believed)"
        )
    })
}

/// A row of a fit: what to call it, the channel's predicted output without bias \[counts\], and what is left of it \[counts\].
#[derive(Clone, Debug)]
pub struct Row {
    /// As the report names rows.
    pub label: String,
    /// Sensitivity times excitation.
    pub along: f64,
    /// Measured minus predicted.
    pub residual: f64,
    /// Sigma that the table states, if it does.
    pub stated: Option<f64>,
}

/// What the residuals of a channel say, in the order of the table's rows; `parameters` were fitted.
pub fn residuals(channel: &str, rows: &[Row], parameters: usize) -> Vec<String> {
    let mut wrong = Vec::new();
    let freedom = rows.len().saturating_sub(parameters);
    if freedom == 0 {
        return wrong;
    }
    let energy: f64 = rows.iter().map(|row| row.residual.powi(2)).sum();
    let scatter = (energy / freedom as f64).sqrt();
    let full = rows.iter().map(|row| row.along.abs()).fold(0.0, f64::max);
    let Some(worst) = rows.iter().max_by(|a, b| a.residual.abs().total_cmp(&b.residual.abs())) else {
        return wrong;
    };
    let stated: Vec<f64> = rows.iter().filter_map(|row| row.stated).collect();
    let stated_rms = (stated.iter().map(|one| one * one).sum::<f64>() / stated.len() as f64).sqrt();
    if stated.len() == rows.len() && stated_rms > 0.0 && scatter > BEYOND_STATED * stated_rms {
        wrong.push(format!(
            "{channel}: rows scatter by {} counts, {:.0} times the sigma of {} that the table states; worst is {}",
            digits(scatter),
            scatter / stated_rms,
            digits(stated_rms),
            worst.label
        ));
    }
    if worst.residual.abs() > STRAIGHT * full {
        wrong.push(format!(
            "{channel}: {} lies {:.0} % of full scale from the straight line",
            worst.label,
            100.0 * worst.residual.abs() / full
        ));
    }
    // What rounding leaves has no pattern worth a word.
    if scatter <= 1e-9 * full || freedom < FREEDOM + 2 {
        return wrong;
    }
    let count = rows.len() as f64;
    let place = |k: usize| (k as f64 - (count - 1.0) / 2.0) / count;
    let drift = DMatrix::from_fn(rows.len(), 1, |k, _| place(k));
    let values = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.residual));
    let along = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.along / full));
    if let Some((fitted, chance)) = pattern(&drift, &along, &values, freedom)
        && chance < CHANCE
        && fitted.norm_squared() > DRIFT_SHARE * energy
    {
        let a_row = (fitted[rows.len() - 1] - fitted[0]) / (count - 1.0);
        wrong.push(format!(
            "{channel}: it drifts along the rows by {} counts a row, from {} to {}; wait until it is warm, or fit temperature",
            digits(a_row),
            rows[0].label,
            rows[rows.len() - 1].label
        ));
    } else {
        let bend = DMatrix::from_fn(rows.len(), 2, |k, power| (rows[k].along / full).powi(2 + power as i32));
        if let Some((fitted, chance)) = pattern(&bend, &along, &values, freedom)
            && chance < CHANCE
            && fitted.amax() > BEND * full
        {
            let most = fitted.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            let label = most.map_or("", |(k, _)| rows[k].label.as_str());
            wrong.push(format!(
                "{channel}: the residuals bend by {:.1} % of full scale, most at {label}; leave out large excitations, or check \
                 for saturation",
                100.0 * fitted.amax() / full
            ));
        }
    }
    wrong
}

/// Whether the order of the rows is that of their excitation: a drift along them then passes as scale, and no residual shows it.
pub fn in_order(rows: &[Row]) -> bool {
    let centred = |values: Vec<f64>| {
        let values = DVector::from_vec(values);
        values.add_scalar(-values.mean())
    };
    let along = centred(rows.iter().map(|row| row.along).collect());
    let place = centred((0..rows.len()).map(|k| k as f64).collect());
    let square = along.dot(&place).powi(2) / (along.norm_squared() * place.norm_squared()).max(f64::MIN_POSITIVE);
    rows.len() > 2 && square > 1.0 - INFLATION.recip()
}

/// What is said of channels whose rows are [`in_order`], if there are any.
pub fn hidden_drift(channels: &[&str]) -> Option<String> {
    (!channels.is_empty()).then(|| {
        format!(
            "{}: the rows are in the order of the excitation, so a drift along them passes as scale and is not seen; mix the order, \
             or take the rows once more, backwards",
            channels.join(" ")
        )
    })
}

/// Least squares of residuals on some columns: what they explain, and the chance that residuals without a pattern give as
/// much, by the F-test. A constant and the line `along` were fitted already, so what the columns have of these is taken out.
pub fn pattern(
    columns: &DMatrix<f64>,
    along: &DVector<f64>,
    values: &DVector<f64>,
    freedom: usize,
) -> Option<(DVector<f64>, f64)> {
    let line = along.add_scalar(-along.mean());
    let mut centred = columns.clone();
    for mut column in centred.column_iter_mut() {
        let mean = column.mean();
        column.add_scalar_mut(-mean);
        let share = column.dot(&line) / line.norm_squared().max(f64::MIN_POSITIVE);
        column.axpy(-share, &line, 1.0);
    }
    let found = centred.clone().svd(true, true).solve(values, 1e-9).ok()?;
    let fitted = centred * found;
    let left = freedom.checked_sub(columns.ncols()).filter(|left| *left > 0)? as f64;
    let terms = columns.ncols() as f64;
    let rest = (values - &fitted).norm_squared().max(f64::MIN_POSITIVE);
    let ratio = (fitted.norm_squared() / terms) / (rest / left);
    let law = FisherSnedecor::new(terms, left).ok()?;
    Some((fitted, law.sf(ratio)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RAD: [(Kind, Unit); 1] = [(
        Kind::Rate,
        Unit {
            name: "rad/s",
            size: 1.0,
        },
    )];

    #[test]
    fn a_scale_that_is_off_by_a_units_factor_names_the_unit() {
        assert_eq!(scale("g1", 800.0, 782.0, &RAD), None);
        let line = scale("g1", 13.69, 782.0, &RAD).expect("deg/s");
        assert!(line.contains("say --rates deg/s"), "{line}");
        let half = scale("g3", 392.2, 782.0, &RAD).expect("half");
        assert!(
            half.contains("0.5015 times the nominal") && !half.contains("say"),
            "{half}"
        );
        let counts = scale("m1x", 0.999, 10.9, &[]).expect("units");
        assert!(counts.contains("not counts"), "{counts}");
    }

    #[test]
    fn an_axis_is_believed_within_five_degrees() {
        let tilted = |deg: f64| Vector3::new(deg.to_radians().cos(), deg.to_radians().sin(), 0.0);
        assert_eq!(axis("g1", tilted(4.9), Vector3::x()), None);
        assert!(axis("g1", tilted(5.1), Vector3::x()).is_some());
    }

    /// Rows over the whole range, with an alternating noise of one count.
    fn rows(left: impl Fn(usize, f64) -> f64) -> Vec<Row> {
        let row = |k: usize| {
            let along = ((7 * k) % 25) as f64 * 40.0 - 480.0;
            Row {
                label: format!("row {}", k + 1),
                along,
                residual: left(k, along) + if k.is_multiple_of(2) { 1.0 } else { -1.0 },
                stated: Some(0.5),
            }
        };
        (0..25).map(row).collect()
    }

    #[test]
    fn rows_in_the_order_of_their_excitation_hide_a_drift() {
        let mixed = rows(|_, _| 0.0);
        assert!(!in_order(&mixed));
        let mut sorted = mixed.clone();
        sorted.sort_by(|a, b| a.along.total_cmp(&b.along));
        assert!(in_order(&sorted));
        let there_and_back: Vec<Row> = sorted.iter().chain(sorted.iter().rev()).cloned().collect();
        assert!(!in_order(&there_and_back));
        let mut paired = mixed;
        paired.sort_by(|a, b| a.along.abs().total_cmp(&b.along.abs()));
        assert!(!in_order(&paired), "each rate with its antagonist");
        assert!(!in_order(&sorted[..2]) && !in_order(&[]));
        assert_eq!(hidden_drift(&[]), None);
    }

    #[test]
    fn noise_alone_is_good_and_each_pattern_is_named_with_its_rows() {
        assert_eq!(residuals("g1", &rows(|_, _| 0.0), 4), Vec::<String>::new());
        let says = |rows: &[Row], words: &str| {
            let wrong = residuals("g1", rows, 4).join("\n");
            assert!(wrong.contains(words), "{words}: {wrong}");
        };
        says(&rows(|k, _| k as f64 - 12.0), "drifts along the rows by 0.9");
        says(
            &rows(|_, along| (along / 480.0).powi(3) * 20.0 - along / 480.0 * 12.0),
            "residuals bend",
        );
        says(&rows(|k, _| 40.0 * f64::from(k == 6)), "worst is row 7");
        says(&rows(|k, _| 60.0 * f64::from(k == 6)), "row 7 lies 13 % of full scale");
    }
}
