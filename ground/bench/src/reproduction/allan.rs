//! Tables 7.6 to 7.8 and E.1 to E.4 of Siqueira (2014), as far as they can be had again without the records.
//!
//! Times are 16 times too large throughout: 145,312 samples at 20 Hz last 2 h, the tables reach 7 h, because 0.8 s was
//! entered for a sampling interval of 0.05 s.

use super::{Line, Reproduced, ReproductionError, Sources};
use crate::allan::{bounds::bounds, terms::Term};

/// Relative: five digits, once for each side of a ratio.
const FIVE_DIGITS: f64 = 1e-4;
/// Relative: three digits.
const THREE_DIGITS: f64 = 5.1e-3;
/// The confidence of the printed bounds: one standard deviation.
const ONE_SIGMA: f64 = 0.683;
/// Samples of each record, before its outliers were removed.
const SAMPLES: f64 = 145_312.0;

const E_1: &str = "000_tableE_1_SD02.csv";
const E_2: &str = "000_tableE_2_SD04.csv";
const E_4: &str = "000_tableE_4_LME02.csv";

/// The tables.
///
/// # Errors
/// When one cannot be read.
pub fn tables(sources: &Sources<'_>) -> Result<Vec<Reproduced>, ReproductionError> {
    Ok(vec![
        deviations(sources)?,
        slopes(sources)?,
        coefficients(sources)?,
        appendix(sources, "Table E.1 (Siqueira)", E_1, SAMPLES - 1_018.0, white_rate)?,
        appendix(sources, "Table E.2 (Siqueira)", E_2, SAMPLES - 674.0, flicker_angle)?,
        copy(sources)?,
        appendix(sources, "Table E.4 (Siqueira)", E_4, SAMPLES - 16.0, white_rate)?,
    ])
}

/// The averaging factor behind a printed time.
pub fn factor(printed_tau_s: f64) -> f64 {
    (printed_tau_s / 0.8).log2().round().exp2()
}

/// Degrees of freedom of white rate noise, NIST SP 1065, table 5.
pub fn white_rate(count: f64, m: f64) -> f64 {
    (3.0 * (count - 1.0) / (2.0 * m) - 2.0 * (count - 2.0) / count) * 4.0 * m * m / (4.0 * m * m + 5.0)
}

/// Degrees of freedom of flicker angle noise, NIST SP 1065, table 5.
pub fn flicker_angle(count: f64, m: f64) -> f64 {
    (((count - 1.0) / (2.0 * m)).ln() * ((2.0 * m + 1.0) * (count - 1.0) / 4.0).ln())
        .sqrt()
        .exp()
}

/// A ratio to the printed value, which agrees when it is 1.
fn ratios(what: String, pairs: &[(f64, f64)], within: f64) -> Line {
    let ours: Vec<f64> = pairs.iter().map(|(ours, printed)| ours / printed).collect();
    Line::new(what, &vec![1.0; pairs.len()], &ours, within)
}

fn appendix(
    sources: &Sources<'_>,
    table: &'static str,
    file: &str,
    count: f64,
    edf: fn(f64, f64) -> f64,
) -> Result<Reproduced, ReproductionError> {
    let rows = sources.numbers(file, ["tau_printed_s", "adev", "adev_min", "adev_max", "mdev", "tdev"])?;
    let line = |[tau, adev, low, high, mdev, tdev]: &[f64; 6]| {
        let tau_s = 0.8 * factor(*tau);
        let (ours_low, ours_high) = bounds(*adev, edf(count, factor(*tau)), ONE_SIGMA).unwrap_or((f64::NAN, f64::NAN));
        let pairs = [
            (tau_s * mdev / 3_f64.sqrt(), *tdev),
            (ours_low, *low),
            (ours_high, *high),
        ];
        ratios(
            format!("{tau} s: TDEV, ADEV_Min, ADEV_Max, over printed"),
            &pairs,
            FIVE_DIGITS,
        )
    };
    Ok(Reproduced {
        table,
        lines: rows.iter().map(line).collect(),
        why: "The deviations themselves need the record, which is lost. TDEV follows from MDEV, and the bounds from ADEV with \
              the samples left after the outliers and the degrees of freedom of NIST SP 1065: of white rate noise in E.1 \
              and E.4, of flicker angle noise in E.2, where all three say white angle noise.",
    })
}

fn copy(sources: &Sources<'_>) -> Result<Reproduced, ReproductionError> {
    let columns = ["adev", "mdev", "tdev", "hdev"];
    let third = sources.numbers("000_tableE_3_SD03_DUPLICATE_OF_E4.csv", columns)?;
    let fourth = sources.numbers(E_4, columns)?;
    let differing = third.iter().zip(&fourth).filter(|(a, b)| a != b).count();
    Ok(Reproduced {
        table: "Table E.3 (Siqueira)",
        lines: vec![Line::new(
            "rows that are not those of Table E.4",
            &[0.0],
            &[differing as f64],
            0.0,
        )],
        why: "It cannot be had: it is Table E.4 again. What is left of SD-03 is its column of Table 7.6.",
    })
}

fn deviations(sources: &Sources<'_>) -> Result<Reproduced, ReproductionError> {
    let printed = sources.numbers("000_table7_6_adev.csv", ["tau_printed_s", "g1", "g2", "g4"])?;
    let own = |file| sources.numbers(file, ["adev"]);
    let (first, second, fourth) = (own(E_1)?, own(E_2)?, own(E_4)?);
    let line = |(k, [tau, g1, g2, g4]): (usize, &[f64; 4])| {
        let value = |rows: &[[f64; 1]]| rows.get(k).map_or(f64::NAN, |row| row[0]);
        let pairs = [(value(&first), *g1), (value(&second), *g2), (value(&fourth), *g4)];
        ratios(format!("{tau} s: E.1, E.2, E.4 over g1, g2, g4"), &pairs, THREE_DIGITS)
    };
    Ok(Reproduced {
        table: "Table 7.6 (Siqueira)",
        lines: printed.iter().enumerate().map(line).collect(),
        why: "The same deviations as in appendix E, to three digits. From 819.2 s on g2 is of another run than Table E.2. g3 \
              has nothing beside it, as its table is a copy of g4's.",
    })
}

fn slopes(sources: &Sources<'_>) -> Result<Reproduced, ReproductionError> {
    let printed = sources.numbers("000_table7_7_slopes.csv", ["slope"])?;
    let line = |([printed], term): (&[f64; 1], Term)| {
        // Far beyond a second, where flicker's bend at short times is over.
        let slope = 0.5 * (term.variance(2e6) / term.variance(1e6)).log2();
        Line::new(term.name(), &[*printed], &[slope], 1e-9)
    };
    Ok(Reproduced {
        table: "Table 7.7 (Siqueira)",
        lines: printed.iter().zip(Term::POWER_LAWS).map(line).collect(),
        why: "Slopes of the Allan deviation of the terms that are fitted here.",
    })
}

fn coefficients(sources: &Sources<'_>) -> Result<Reproduced, ReproductionError> {
    let rows = sources.numbers("000_table7_6_adev.csv", ["tau_printed_s", "g1", "g2", "g3", "g4"])?;
    let printed = sources.numbers("000_table7_8_noise.csv", ["arw", "bias_instability_0.664B"])?;
    let mut lines = Vec::new();
    for (k, [walk, flat]) in printed.iter().enumerate() {
        // Beyond the periodic disturbance and short of the slower terms: slope near -1/2.
        let logs: Vec<f64> = rows
            .iter()
            .filter(|row| (8.0..=512.0).contains(&factor(row[0])))
            .map(|row| (row[1 + k] * row[0].sqrt()).ln())
            .collect();
        let ours = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
        lines.push(Line::new(
            format!("g{}: angle random walk, times as printed [V sqrt(s)]", k + 1),
            &[*walk],
            &[ours],
            // A line drawn by hand through a slope that is not quite -1/2.
            0.45 * walk,
        ));
        // The flattest stretch between neighbours.
        let step = |pair: &&[[f64; 5]]| (pair[1][1 + k] / pair[0][1 + k]).ln().abs();
        let flattest = rows.windows(2).min_by(|a, b| step(a).total_cmp(&step(b)));
        let ours = flattest.map_or(f64::NAN, |pair| (pair[0][1 + k] * pair[1][1 + k]).sqrt());
        lines.push(Line::new(
            format!("g{}: bias instability, 0.664 B [V]", k + 1),
            &[*flat],
            &[ours],
            0.1 * flat,
        ));
    }
    Ok(Reproduced {
        table: "Table 7.8 (Siqueira)",
        lines,
        why: "Read off by hand there, from the deviations of Table 7.6 here. Because of the times, quantisation is 16 times \
              and angle random walk 4 times too large, rate random walk 4 times too small; bias instability is not \
              affected. g3's 5e-6 V stands nowhere in Table 7.6, and g2's was read where its curve rises again.",
    })
}
