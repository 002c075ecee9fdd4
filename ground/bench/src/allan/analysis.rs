//! Everything there is to say about the noise of one record.
//!
//! In: a [`Series`]. Out: [`Analysis`]: outliers taken out, deviations with bounds at octave averaging times, spectrum,
//! coefficients. A line in the spectrum becomes a sinusoid of the fit, and a Markov noise is tried at correlation times
//! over the whole plot; either is kept only if it is seen and takes [`WORTH`] off the misfit, for a shape chosen
//! freely always takes some.

use super::{
    bounds::{bounds, edf},
    deviation::{Deviation, Point, octaves, sweep},
    fit::{Finding, Fit, fit},
    motion::{Motion, motion},
    noise::PowerLaw,
    outliers,
    phase::{Input, Phase},
    series::Series,
    terms::Term,
};
use logs::spectrum;

/// What a further shape must take off the misfit, in squared standard deviations: one that is chosen out of a dozen and
/// has a size takes off 9 in a hundredth of records without it.
const WORTH: f64 = 10.0;

/// Robust deviations beyond which a sample is no noise: of normal noise one in 10^15 is.
const SUSPECT: f64 = 8.0;

/// How to analyse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// What the values are.
    pub input: Input,
    /// Confidence of all bounds, between 0 and 1.
    pub confidence: f64,
    /// Remove samples farther than this many deviations from their surroundings.
    pub outliers: Option<f64>,
}

/// A deviation with its bounds; the bounds are missing where the power law is unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounded {
    /// Estimate.
    pub value: f64,
    /// Low and high bound.
    pub bounds: Option<(f64, f64)>,
}

/// One averaging time.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Averaging time \[s\].
    pub tau_s: f64,
    /// Power law there, as far as it can be told.
    pub law: Option<PowerLaw>,
    /// In the order of [`Deviation::ALL`]; none where no window fits.
    pub deviations: [Option<Bounded>; 5],
}

/// The noise of a record.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// Its column.
    pub name: String,
    /// Sampling interval \[s\].
    pub step_s: f64,
    /// Samples used.
    pub used: usize,
    /// Gaps before outliers were removed, and the steps in them.
    pub gaps: (usize, usize),
    /// Steps of the outliers removed.
    pub outliers: Vec<usize>,
    /// Samples (of angles, their steps) that are farther from their surroundings than noise goes, and were kept.
    pub suspects: usize,
    /// Where the record (of angles, their rate) moves instead of standing still.
    pub motion: Option<Motion>,
    /// Mean and standard deviation of what is left.
    pub moments: (f64, f64),
    /// Deviations.
    pub rows: Vec<Row>,
    /// Coefficients; none if the record is too short for any.
    pub fit: Option<Fit>,
    /// One-sided power spectral density of the longest stretch without a gap [Hz, unit^2/Hz]; of angles, of their rate.
    pub density: Vec<(f64, f64)>,
}

/// Analyses one record; `progress` gets shares of the work that add up to one.
pub fn analyse(name: &str, mut series: Series, options: &Options, progress: impl Fn(f64) + Sync) -> Analysis {
    let gaps = (series.gaps.len(), series.values.len() - series.measured());
    let outliers = match (options.outliers, options.input) {
        (Some(deviations), Input::Rate) => outliers::remove(&mut series, deviations),
        _ => Vec::new(),
    };
    let suspects = match options.input {
        Input::Rate => outliers::far(&series, SUSPECT).len(),
        Input::Angle => outliers::far(&steps(&series), SUSPECT).len(),
    };
    let motion = match options.input {
        Input::Rate => motion(&series),
        Input::Angle => motion(&steps(&series)),
    };
    let phase = Phase::new(&series, options.input);
    let points = sweep(&phase, &octaves(&phase), progress);
    let density = density(&series, options.input);
    Analysis {
        name: name.into(),
        step_s: series.step_s,
        used: series.measured(),
        gaps,
        outliers,
        suspects,
        motion,
        moments: moments(&series),
        rows: rows(&phase, &points, options.confidence),
        fit: best_fit(&points, &density, series.step_s, options.confidence),
        density,
    }
}

/// The steps of an angle, with the gaps it has.
fn steps(series: &Series) -> Series {
    // A step into a gap or out of it is none.
    let gaps = series.gaps.iter().map(|gap| gap.start - 1..gap.end);
    Series {
        step_s: series.step_s,
        values: series.values.windows(2).map(|pair| pair[1] - pair[0]).collect(),
        gaps: gaps.collect(),
    }
}

fn moments(series: &Series) -> (f64, f64) {
    let values = || series.stretches().flat_map(|stretch| &series.values[stretch]);
    let count = series.measured() as f64;
    let mean = values().sum::<f64>() / count;
    (
        mean,
        (values().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt(),
    )
}

fn rows(phase: &Phase, points: &[Point], confidence: f64) -> Vec<Row> {
    let (mut allan_law, mut hadamard_law) = (None, None);
    points
        .iter()
        .map(|point| {
            // Where too few points are left to tell, the noise is taken to go on as it was.
            allan_law = PowerLaw::identify(&phase.angle, point.factor, 2).or(allan_law);
            hadamard_law = PowerLaw::identify(&phase.angle, point.factor, 3).or(hadamard_law);
            let deviations = Deviation::ALL.map(|deviation| {
                let value = point.value(deviation)?;
                let law = if deviation == Deviation::Hdev {
                    hadamard_law
                } else {
                    allan_law
                };
                let edf = law.and_then(|law| edf(law, deviation, point.factor, point.windows(deviation)));
                Some(Bounded {
                    value,
                    bounds: edf.and_then(|edf| bounds(value, edf, confidence)),
                })
            });
            Row {
                tau_s: point.tau_s,
                law: allan_law,
                deviations,
            }
        })
        .collect()
}

fn density(series: &Series, input: Input) -> Vec<(f64, f64)> {
    let Some(longest) = series.stretches().max_by_key(|stretch| stretch.len()) else {
        return Vec::new();
    };
    let values = &series.values[longest];
    match input {
        Input::Rate => spectrum::welch(values, series.step_s),
        Input::Angle => {
            let rate: Vec<f64> = values
                .windows(2)
                .map(|pair| (pair[1] - pair[0]) / series.step_s)
                .collect();
            spectrum::welch(&rate, series.step_s)
        }
    }
}

/// The fit of the five power laws, and of a line and a Markov noise if they are worth it.
fn best_fit(points: &[Point], density: &[(f64, f64)], step_s: f64, confidence: f64) -> Option<Fit> {
    let mut terms = Term::POWER_LAWS.to_vec();
    let mut best = fit(points, step_s, &terms, confidence)?;
    let lines = spectrum::peak(density).map(|frequency_hz| Term::Sinusoid { frequency_hz });
    // An averaging time in every octave, but for the first and the last two, where a Markov noise has no hump to show.
    let inner = points.iter().skip(1).take(points.len().saturating_sub(4));
    let markovs = inner.map(|point| Term::Markov {
        time_s: point.tau_s / 1.9,
    });
    for candidates in [lines.into_iter().collect::<Vec<_>>(), markovs.collect()] {
        let tried = candidates.into_iter().filter_map(|term| {
            let mut with = terms.clone();
            with.push(term);
            let found = fit(points, step_s, &with, confidence)?;
            let is_seen = matches!(found.findings.last(), Some((_, Finding::Seen { .. })));
            (is_seen && found.misfit + WORTH < best.misfit).then_some((term, found))
        });
        if let Some((term, found)) = tried.min_by(|a, b| a.1.misfit.total_cmp(&b.1.misfit)) {
            terms.push(term);
            best = found;
        }
    }
    Some(best)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::{super::simulate::Noise, *};

    const OPTIONS: Options = Options {
        input: Input::Rate,
        confidence: 0.95,
        outliers: Some(6.0),
    };

    fn analysis(values: Vec<f64>) -> Analysis {
        analyse(
            "g1",
            Series {
                step_s: 0.05,
                values,
                gaps: Vec::new(),
            },
            &OPTIONS,
            |_| (),
        )
    }

    fn found(analysis: &Analysis, is_wanted: fn(&Term) -> bool) -> Option<(Term, Finding)> {
        let fit = analysis.fit.as_ref().expect("a fit");
        fit.findings
            .iter()
            .find(|(term, finding)| is_wanted(term) && finding.value() > 0.0)
            .copied()
    }

    #[test]
    fn a_periodic_disturbance_is_named_with_its_frequency_and_amplitude() {
        let noise = Noise {
            arw: 0.01,
            ..Noise::default()
        }
        .rate(40_000, 0.05, 21);
        let rate = noise
            .iter()
            .enumerate()
            .map(|(k, n)| n + 0.02 * (2.0 * PI * 0.7 * k as f64 * 0.05).sin())
            .collect();
        let analysis = analysis(rate);
        let (Term::Sinusoid { frequency_hz }, Finding::Seen { value, .. }) =
            found(&analysis, |term| matches!(term, Term::Sinusoid { .. })).expect("a line")
        else {
            panic!("not a line")
        };
        assert!(
            (frequency_hz - 0.7).abs() < 0.02 && (value / 0.02 - 1.0).abs() < 0.15,
            "{frequency_hz} {value}"
        );
    }

    #[test]
    fn pure_angle_random_walk_is_nothing_else() {
        let analysis = analysis(
            Noise {
                arw: 0.01,
                ..Noise::default()
            }
            .rate(40_000, 0.05, 22),
        );
        let fit = analysis.fit.as_ref().expect("a fit");
        let seen: Vec<&str> = fit
            .findings
            .iter()
            .filter(|(_, finding)| finding.value() > 0.0)
            .map(|(term, _)| term.name())
            .collect();
        assert_eq!(seen, ["angle random walk N"]);
        assert!(analysis.outliers.is_empty());
        assert!(
            analysis
                .rows
                .iter()
                .take(8)
                .all(|row| row.law == Some(PowerLaw::WhiteRate))
        );
    }

    #[test]
    fn a_line_too_weak_for_the_plot_is_still_told_from_noise() {
        let noise = Noise {
            arw: 0.01,
            ..Noise::default()
        };
        let noise = noise.rate(60_000, 0.05, 24);
        let line = |k: usize| 0.01 * (2.0 * PI * 1.3 * k as f64 * 0.05).sin();
        let analysis = analysis(noise.iter().enumerate().map(|(k, n)| n + line(k)).collect());
        let (_, finding) = found(&analysis, |term| matches!(term, Term::Sinusoid { .. })).expect("a line");
        assert!((finding.value() / 0.01 - 1.0).abs() < 0.25, "{finding:?}");
    }

    #[test]
    fn outliers_that_were_not_asked_to_be_removed_are_counted() {
        let mut rate = Noise {
            arw: 0.01,
            ..Noise::default()
        }
        .rate(20_000, 0.05, 23);
        rate[7_000] = 5.0;
        let angle: Vec<f64> = rate
            .iter()
            .scan(0.0, |angle, rate| {
                *angle += rate * 0.05;
                Some(*angle)
            })
            .collect();
        for (input, values) in [(Input::Rate, rate), (Input::Angle, angle)] {
            let series = Series {
                step_s: 0.05,
                values,
                gaps: std::iter::once(100..104).collect(),
            };
            let kept = Options {
                input,
                outliers: None,
                ..OPTIONS
            };
            assert_eq!(analyse("g1", series, &kept, |_| ()).suspects, 1, "{input:?}");
        }
    }

    #[test]
    fn outliers_are_removed_and_said() {
        let mut rate = Noise {
            arw: 0.01,
            ..Noise::default()
        }
        .rate(20_000, 0.05, 23);
        rate[7_000] = 5.0;
        let analysis = analysis(rate);
        assert_eq!((analysis.outliers.as_slice(), analysis.used), (&[7_000][..], 19_999));
    }
}
