//! What the tests of a dry-tuned gyro say, as text and as parts of a page.
//!
//! In: the results of the tests. Out: a [`Section`] each: figures with their intervals, a line of verdict, residuals.

use chart::{Axis, Block, ChartError, Figure, Layer, Marks, Panel};

use super::{
    rotor::Tuning,
    scale::{Scale, Spread, Steadiness},
    sensitivity::{NAMES, Sensitivity},
    stability::{Interval, Stability},
};
use crate::{checks, report::five_digits};

/// A residual this many times the root mean square of all is likelier a wrong position or a slip than noise.
const SUSPICIOUS: f64 = 3.0;

/// One test's part of the report.
#[derive(Clone, Debug)]
pub struct Section {
    title: String,
    rows: Vec<(String, String)>,
    verdict: Vec<String>,
    figure: Option<Figure>,
}

impl Section {
    /// For the terminal.
    pub fn text(&self) -> String {
        let rows = self.rows.iter().map(|(name, value)| format!("  {name:24} {value}\n"));
        let said = self.verdict.iter().map(|line| format!("  {line}\n"));
        format!("{}\n{}", self.title, rows.chain(said).collect::<String>())
    }

    /// For programs, under the names that the text has.
    pub fn json(&self) -> serde_json::Value {
        let figures = self
            .rows
            .iter()
            .map(|(name, value)| (name.clone(), value.as_str().into()));
        serde_json::json!({
            "test": self.title,
            "good": !self.is_wrong(),
            "figures": figures.collect::<serde_json::Map<_, _>>(),
            "verdict": self.verdict,
        })
    }

    /// Whether something is wrong.
    pub fn is_wrong(&self) -> bool {
        self.verdict.iter().any(|line| line.starts_with("wrong:"))
    }

    /// For the page.
    pub fn into_blocks(self) -> Vec<Block> {
        let mut blocks = vec![
            Block::Heading(self.title),
            Block::Terminal(self.verdict.join("\n")),
            Block::Rows(self.rows),
        ];
        blocks.extend(self.figure.map(Block::Figure));
        blocks
    }
}

fn row(name: &str, value: String) -> (String, String) {
    (name.into(), value)
}

/// The multi-position test; `unidentifiable` are the combinations no test at these positions determines.
///
/// # Errors
/// When the residuals cannot be drawn.
pub fn sensitivity(found: &Sensitivity, unidentifiable: &[String]) -> Result<Section, ChartError> {
    let named = NAMES.iter().zip(&found.coefficients);
    let mut rows: Vec<(String, String)> = named
        .map(|(name, c)| {
            row(
                name,
                format!("{} ± {}", five_digits(c.value), five_digits(c.half_width)),
            )
        })
        .collect();
    let rms = (found.residuals.iter().map(|left| left * left).sum::<f64>() / found.residuals.len() as f64).sqrt();
    rows.push(row("residual, rms", format!("{} deg/h", five_digits(rms))));
    rows.push(row("condition", five_digits(found.condition)));
    rows.extend(unidentifiable.iter().map(|named| row("cannot be told", named.clone())));
    let wrong = found
        .residuals
        .iter()
        .enumerate()
        .filter(|(_, left)| left.abs() > SUSPICIOUS * rms);
    let mut verdict: Vec<String> = wrong
        .map(|(k, _)| format!("wrong: position {} does not fit the others; next: repeat it", k + 1))
        .collect();
    if verdict.is_empty() {
        verdict.push("good: every position fits".into());
    }
    let points = found
        .residuals
        .iter()
        .enumerate()
        .map(|(k, left)| (k as f64 + 1.0, *left))
        .collect();
    let figure = residuals("What the positions leave over", "position", "residual [deg/h]", points)?;
    Ok(Section {
        title: "Multi-position test".into(),
        rows,
        verdict,
        figure: Some(figure),
    })
}

/// The scale factor test.
///
/// # Errors
/// When the residuals cannot be drawn.
pub fn scale(found: &Scale, points: &[(f64, f64)]) -> Result<Section, ChartError> {
    let rows = vec![
        row(
            "scale factor",
            format!(
                "{} ± {} output per rate",
                five_digits(found.factor),
                five_digits(found.factor_95)
            ),
        ),
        row(
            "output at rest",
            format!("{} ± {}", five_digits(found.bias), five_digits(found.bias_95)),
        ),
        row(
            "nonlinearity",
            format!("{} % of full scale", five_digits(100.0 * found.nonlinearity)),
        ),
    ];
    let left = points
        .iter()
        .zip(&found.residuals)
        .map(|((rate, _), left)| (*rate, *left))
        .collect();
    let figure = residuals("What a straight line leaves over", "rate", "residual [output]", left)?;
    let rows_of = rows_of(found, points);
    let wrong = checks::residuals("the output", &rows_of, 2);
    let mut verdict: Vec<String> = match (wrong.is_empty(), points.len() < FEW) {
        (false, _) => wrong.into_iter().map(|line| format!("wrong: {line}")).collect(),
        (true, false) => vec!["good: the residuals show no bend".into()],
        (true, true) => vec![format!(
            "good, as far as {} rates can tell; next: give at least {FEW} to see a bend",
            points.len()
        )],
    };
    let ordered: &[&str] = if checks::in_order(&rows_of) {
        &["the output"]
    } else {
        &[]
    };
    verdict.extend(checks::hidden_drift(ordered).map(|line| format!("warning: {line}")));
    Ok(Section {
        title: "Scale factor".into(),
        rows,
        verdict,
        figure: Some(figure),
    })
}

/// Rates from which on a square and a cube of the rate are seen beside the line.
const FEW: usize = 8;

/// The rows of the test in the order of the file, as the residuals of any calibration.
fn rows_of(found: &Scale, points: &[(f64, f64)]) -> Vec<checks::Row> {
    let row = |(k, ((rate, _), residual)): (usize, (&(f64, f64), &f64))| checks::Row {
        label: format!("row {} (rate {})", k + 1, five_digits(*rate)),
        along: found.factor * rate,
        residual: *residual,
        stated: None,
    };
    points.iter().zip(&found.residuals).enumerate().map(row).collect()
}

/// The scale stability test.
pub fn steadiness(found: &Steadiness) -> Section {
    let ppm = |share: f64| format!("{} ppm", five_digits(1e6 * share));
    let rows = vec![
        row("scale factor, mean", five_digits(found.mean)),
        row("standard deviation", ppm(found.relative_sigma)),
        row("largest minus smallest", ppm(found.relative_spread)),
        row("trend", format!("{} an hour", ppm(found.trend_per_h))),
    ];
    plain(
        "Scale stability",
        rows,
        "next: compare with the stability of the table's own rate",
    )
}

/// Turn-on repeatability.
pub fn turn_on(found: &Spread) -> Section {
    let rows = vec![
        row("mean", five_digits(found.mean)),
        row("standard deviation", five_digits(found.sigma)),
        row(
            "repeatability",
            format!("{} (largest minus smallest)", five_digits(found.range)),
        ),
    ];
    plain(
        "Turn-on repeatability",
        rows,
        "next: largest minus smallest grows with the number of turn-ons; say it with it",
    )
}

/// Decay time constant \[s\].
pub fn decay(time_s: f64) -> Section {
    plain(
        "Decay",
        vec![row("time constant", format!("{} s", five_digits(time_s)))],
        "good: the oscillation decays",
    )
}

/// Tuning speed and figure of merit.
pub fn tuning(found: &Tuning) -> Section {
    let rows = vec![
        row("tuning speed", format!("{} Hz", five_digits(found.speed_hz))),
        row("figure of merit", five_digits(found.merit)),
        row("residual, rms", format!("{} Hz", five_digits(found.residual_hz))),
    ];
    plain("Tuning", rows, "good: one straight line through all speeds")
}

/// Drift stability.
pub fn stability(found: &Stability) -> Section {
    let of = |interval: Interval| {
        format!(
            "{} ({} to {})",
            five_digits(interval.value),
            five_digits(interval.low),
            five_digits(interval.high)
        )
    };
    let walk = if found.is_walk_seen {
        of(found.walk_step)
    } else {
        format!("not seen; below {}", five_digits(found.walk_step.high))
    };
    let rows = vec![
        row("white, a sample", of(found.white)),
        row("walk, a step", walk),
        row("ramp, a second", of(found.ramp)),
        row(
            "angle random walk N",
            format!("{} rate sqrt(s)", five_digits(found.angle_walk())),
        ),
        row(
            "rate random walk K",
            format!("{} rate/sqrt(s)", five_digits(found.rate_walk())),
        ),
        row(
            "s_r, held over a sample",
            format!("{} rate/s", five_digits(found.held_walk())),
        ),
    ];
    let has_ramp = found.ramp.low * found.ramp.high > 0.0;
    let verdict = match (has_ramp, found.is_walk_seen) {
        (true, _) => "wrong: the drift ramps, which is the room's doing, not the gyro's; next: steady the temperature",
        (false, true) => "good: white noise and a walk, no ramp",
        (false, false) => "next: no walk is seen; record longer",
    };
    plain("Drift stability", rows, verdict)
}

fn plain(title: &str, rows: Vec<(String, String)>, verdict: &str) -> Section {
    Section {
        title: title.into(),
        rows,
        verdict: vec![verdict.into()],
        figure: None,
    }
}

fn residuals(title: &str, x: &str, y: &str, points: Vec<(f64, f64)>) -> Result<Figure, ChartError> {
    let panel = Panel {
        title: String::new(),
        x: Axis::linear(x),
        y: Axis::linear(y),
        layers: vec![Layer::new("residual", 0, Marks::Dots(points))],
    };
    Figure::of(title, 1, &[panel])
}

#[cfg(test)]
mod tests {
    use super::{super::scale, *};

    #[test]
    fn a_bent_output_is_called_wrong_and_a_straight_one_good() {
        let rates: Vec<f64> = (-5..=5).map(f64::from).collect();
        let section = |bend: f64| {
            let points: Vec<(f64, f64)> = rates
                .iter()
                .enumerate()
                .map(|(k, w)| (*w, w + bend * w * w + 1e-3 * f64::from(k as u32 % 2)))
                .collect();
            scale(&scale::scale(&points, None).expect("scale"), &points).expect("drawn")
        };
        assert!(section(0.1).text().contains("the residuals bend by"));
        assert!(section(0.0).text().contains("good:"));
    }

    #[test]
    fn an_output_far_from_any_line_is_wrong_however_few_its_rows() {
        let points = [(-2.0, -1.0), (-1.0, -0.5), (0.0, 0.0), (1.0, 0.5), (2.0, 3.0)];
        let found = scale::scale(&points, None).expect("scale");
        let section = scale(&found, &points).expect("drawn");
        assert!(
            section.is_wrong() && section.text().contains("row 5 (rate 2) lies"),
            "{}",
            section.text()
        );
    }

    #[test]
    fn a_page_part_has_its_heading_and_verdict() {
        let blocks = decay(48.94).into_blocks();
        assert!(matches!(&blocks[0], Block::Heading(title) if title == "Decay"));
    }
}
