//! What the analysis of a record says, as text and as a page.
//!
//! In: [`Analysis`]. Out: the table in the columns of appendix E of the tetrahedron thesis (Tau, ADEV, ADEV_Min, ADEV_Max,
//! MDEV, TDEV, HDEV; its ADEV is the overlapping one), the coefficients of IEEE 952 with intervals or bounds from above,
//! a [`verdict`], plots. Coefficients are given in a gyro's customary units where the unit is known.

use chart::{Axis, Block, ChartError, Figure, Layer, Marks, Panel};

use super::{analysis::Analysis, deviation::Deviation, fit::Finding, terms::Term};
use crate::report::five_digits;

/// Names of the columns of appendix E.
pub const COLUMNS: [&str; 7] = ["Tau", "ADEV", "ADEV_Min", "ADEV_Max", "MDEV", "TDEV", "HDEV"];

/// The table of appendix E, five significant digits as there.
pub fn table(analysis: &Analysis) -> Vec<Vec<String>> {
    let cell = |value: Option<f64>| value.map_or_else(|| "-".into(), five_digits);
    let row = |row: &super::analysis::Row| {
        let of = |deviation: Deviation| row.deviations[deviation as usize];
        let adev = of(Deviation::Oadev);
        let bounds = adev.and_then(|adev| adev.bounds);
        let value = |deviation| of(deviation).map(|bounded| bounded.value);
        let values = [
            value(Deviation::Oadev),
            bounds.map(|bounds| bounds.0),
            bounds.map(|bounds| bounds.1),
            value(Deviation::Mdev),
            value(Deviation::Tdev),
            value(Deviation::Hdev),
        ];
        std::iter::once(five_digits(row.tau_s))
            .chain(values.map(cell))
            .collect()
    };
    analysis.rows.iter().map(row).collect()
}

/// A coefficient's factor to customary units and their name, for rates in `unit`.
pub fn customary(term: Term, unit: &str) -> (f64, String) {
    let per_deg_s = match unit {
        "deg/s" | "°/s" => 1.0,
        "rad/s" => 180.0 / std::f64::consts::PI,
        "deg/h" | "°/h" => 1.0 / 3_600.0,
        _ => {
            let time = match term {
                Term::Quantisation => " s",
                Term::AngleWalk => " sqrt(s)",
                Term::RateWalk => "/sqrt(s)",
                Term::Ramp => "/s",
                _ => "",
            };
            return (1.0, format!("{unit}{time}"));
        }
    };
    let (factor, name) = match term {
        Term::Quantisation => (3_600.0, "arcsec"),
        Term::AngleWalk => (60.0, "deg/sqrt(h)"),
        Term::BiasInstability | Term::Markov { .. } | Term::Sinusoid { .. } => (3_600.0, "deg/h"),
        Term::RateWalk => (216_000.0, "deg/h/sqrt(h)"),
        Term::Ramp => (3_600.0 * 3_600.0, "deg/h/h"),
    };
    (factor * per_deg_s, name.into())
}

/// A line for each term.
pub fn coefficients(analysis: &Analysis, unit: &str) -> Vec<(String, String)> {
    let findings = analysis.fit.iter().flat_map(|fit| &fit.findings);
    findings
        .map(|(term, finding)| {
            let (factor, unit) = customary(*term, unit);
            let of = |value: f64| five_digits(value * factor);
            let name = match term {
                Term::Markov { time_s } => format!("{}, {} s", term.name(), five_digits(*time_s)),
                Term::Sinusoid { frequency_hz } => format!("{}, {} Hz", term.name(), five_digits(*frequency_hz)),
                _ => term.name().into(),
            };
            let value = match *finding {
                Finding::Seen { value, low, high } => format!("{} ({} to {}) {unit}", of(value), of(low), of(high)),
                Finding::NotSeen { below } => format!("not seen; below {} {unit}", of(below)),
            };
            (name, value)
        })
        .collect()
}

/// Is it good, what is wrong, what to do next.
pub fn verdict(analysis: &Analysis) -> Vec<String> {
    let mut said = Vec::new();
    let steps = analysis.used + analysis.gaps.1 + analysis.outliers.len();
    if analysis.outliers.len() * 100 > steps {
        said.push("wrong: more than one sample in a hundred is an outlier; that is a disturbance, not outliers".into());
    }
    if analysis.gaps.1 * 10 > steps {
        said.push("wrong: more than a tenth of the record is missing; long averaging times rest on few windows".into());
    }
    if analysis.suspects > 0 {
        said.push(format!(
            "wrong: too far from their surroundings to be noise (8 robust deviations): {} samples; next: look at them, or remove \
             them from rates with --outliers 8",
            analysis.suspects
        ));
    }
    if let Some(motion) = &analysis.motion {
        let at = |k: usize| {
            format!(
                "{} at {} s",
                five_digits(motion.levels[k]),
                five_digits(motion.rows[k] as f64 * analysis.step_s)
            )
        };
        said.push(format!(
            "wrong: the record moves: {} (sample {}), {} (sample {}), {} times the scatter of a sample; next: record at rest, or \
             take out the motion",
            at(0),
            motion.rows[0] + 1,
            at(1),
            motion.rows[1] + 1,
            five_digits(motion.sigmas)
        ));
    }
    let Some(fit) = &analysis.fit else {
        said.push("wrong: too short to fit any coefficient; next: record at least 64 samples".into());
        return said;
    };
    let of = |wanted: Term| {
        fit.findings
            .iter()
            .find(|(term, _)| *term == wanted)
            .map_or(0.0, |(_, f)| f.value())
    };
    if let Some((Term::Sinusoid { frequency_hz }, _)) = fit
        .findings
        .iter()
        .find(|(term, finding)| matches!(term, Term::Sinusoid { .. }) && finding.value() > 0.0)
    {
        let frequency = five_digits(*frequency_hz);
        said.push(format!(
            "wrong: a periodic disturbance at {frequency} Hz; next: look for a fan, pump or power line"
        ));
    }
    if of(Term::Ramp) > 0.0 {
        said.push("wrong: the rate ramps; next: wait until the temperature is steady, or fit temperature".into());
    }
    let longest_s = steps as f64 * analysis.step_s;
    if of(Term::RateWalk) == 0.0 && of(Term::BiasInstability) == 0.0 {
        let floor = "neither bias instability nor rate random walk is seen";
        said.push(format!(
            "next: {floor} in {} h; record ten times as long to see or bound them",
            five_digits(longest_s / 3_600.0)
        ));
    }
    if !said.iter().any(|line| line.starts_with("wrong")) {
        said.insert(0, "good: noise only".into());
    }
    said
}

/// Plots and tables of a record.
///
/// # Errors
/// When a plot cannot be drawn.
pub fn blocks(analysis: &Analysis, unit: &str) -> Result<Vec<Block>, ChartError> {
    let about = vec![
        ("samples used".into(), analysis.used.to_string()),
        (
            "sampling interval".into(),
            format!("{} s", five_digits(analysis.step_s)),
        ),
        (
            "gaps".into(),
            format!("{} of {} samples in all", analysis.gaps.0, analysis.gaps.1),
        ),
        ("outliers removed".into(), analysis.outliers.len().to_string()),
        ("mean".into(), format!("{} {unit}", five_digits(analysis.moments.0))),
        (
            "standard deviation".into(),
            format!("{} {unit}", five_digits(analysis.moments.1)),
        ),
    ];
    Ok(vec![
        Block::Heading(analysis.name.clone()),
        Block::Terminal(verdict(analysis).join("\n")),
        Block::Rows(about),
        Block::Rows(coefficients(analysis, unit)),
        Block::Figure(Figure::of(
            format!("Deviations and spectrum of {}", analysis.name),
            2,
            &[deviations(analysis, unit), density(analysis, unit)],
        )?),
        Block::Table {
            columns: COLUMNS.map(Into::into).to_vec(),
            rows: table(analysis),
        },
    ])
}

fn deviations(analysis: &Analysis, unit: &str) -> Panel {
    let of = |deviation: Deviation| {
        let points = analysis
            .rows
            .iter()
            .filter_map(move |row| Some((row, row.deviations[deviation as usize]?)));
        points.collect::<Vec<_>>()
    };
    let line = |deviation| {
        of(deviation)
            .iter()
            .map(|(row, bounded)| (row.tau_s, bounded.value))
            .collect()
    };
    let bars = of(Deviation::Oadev);
    let bars = bars
        .iter()
        .filter_map(|(row, bounded)| bounded.bounds.map(|(low, high)| (row.tau_s, low, high)));
    let mut layers = vec![
        Layer::new("Allan, overlapping", 0, Marks::Dots(line(Deviation::Oadev))),
        Layer::new("", 0, Marks::Whiskers(bars.collect())),
        Layer::new("modified", 1, Marks::Line(line(Deviation::Mdev))),
        Layer::new("Hadamard", 2, Marks::Line(line(Deviation::Hdev))),
    ];
    let shown = analysis.rows.iter().flat_map(|row| {
        [Deviation::Oadev, Deviation::Mdev, Deviation::Hdev].map(|deviation| row.deviations[deviation as usize])
    });
    let shown = shown.flatten().flat_map(|one| {
        let (low, high) = one.bounds.unwrap_or((one.value, one.value));
        [one.value, low, high]
    });
    if let Some(fit) = &analysis.fit {
        let curve = analysis
            .rows
            .iter()
            .map(|row| (row.tau_s, fit.deviation(row.tau_s)))
            .collect();
        layers.push(Layer::new("fit", 3, Marks::Dashes(curve)));
    }
    Panel {
        title: "deviation".into(),
        x: Axis::logarithmic("averaging time [s]"),
        y: decades(format!("deviation [{unit}]"), shown),
        layers,
    }
}

fn density(analysis: &Analysis, unit: &str) -> Panel {
    Panel {
        title: "power spectral density".into(),
        x: Axis::logarithmic("frequency [Hz]"),
        y: decades(
            format!("density [({unit})²/Hz]"),
            analysis.density.iter().map(|point| point.1),
        ),
        layers: vec![Layer::new("Welch", 0, Marks::Line(analysis.density.clone()))],
    }
}

/// A logarithmic axis over whole decades, so that at least two of them are named.
fn decades(label: String, values: impl Iterator<Item = f64>) -> Axis {
    let (least, most) = values
        .filter(|value| value.is_finite() && *value > 0.0)
        .map(f64::log10)
        .fold((f64::MAX, f64::MIN), |(least, most), value| {
            (least.min(value), most.max(value))
        });
    let axis = Axis::logarithmic(label);
    if least > most {
        return axis;
    }
    axis.between(10_f64.powf(least.floor()), 10_f64.powf(most.floor() + 1.0))
}

#[cfg(test)]
#[path = "report/tests.rs"]
mod tests;
