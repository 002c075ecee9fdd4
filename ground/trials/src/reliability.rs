//! Are stated probabilities observed? The reliability diagram.
//!
//! In: judged cases. Out: [`Reliability`]: all names stated, in bins of equal mass, with the share that was right and its
//! 95 % interval, and the diagram (Murphy and Winkler 1977): on the diagonal a statement is worth what it says.

use chart::{Axis, ChartError, Figure, Layer, Marks, Panel};

use crate::{interval::clopper_pearson, score::Judged};

/// Bins at most; each holds at least [`LEAST_IN_A_BIN`] statements.
const BINS: usize = 10;
const LEAST_IN_A_BIN: usize = 5;

/// Statements of about the same probability.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bin {
    /// Mean of the stated probabilities.
    pub stated: f64,
    /// Share that was right.
    pub right: f64,
    /// Its 95 % interval.
    pub interval: (f64, f64),
    /// Statements.
    pub count: usize,
}

/// The bins, from the least sure.
#[derive(Clone, Debug, PartialEq)]
pub struct Reliability {
    /// In rising order of probability.
    pub bins: Vec<Bin>,
}

impl Reliability {
    /// Of every cause named on every case with a verdict.
    pub fn of(judged: &[Judged]) -> Self {
        let mut stated: Vec<(f64, bool)> = Vec::new();
        for case in judged {
            let causes = case.verdict.iter().flat_map(|verdict| &verdict.causes);
            stated.extend(causes.map(|cause| {
                let is_right = case.answer.effects.iter().any(|truth| truth.effect == cause.effect);
                (cause.probability, is_right)
            }));
        }
        stated.sort_by(|one, other| one.0.total_cmp(&other.0));
        let size = stated.len().div_ceil(BINS).max(LEAST_IN_A_BIN);
        let bin = |part: &[(f64, bool)]| {
            let hits = part.iter().filter(|(_, is_right)| *is_right).count();
            Bin {
                stated: part.iter().map(|(stated, _)| stated).sum::<f64>() / part.len() as f64,
                right: hits as f64 / part.len() as f64,
                interval: clopper_pearson(hits, part.len()),
                count: part.len(),
            }
        };
        Reliability {
            bins: stated.chunks(size).map(bin).collect(),
        }
    }

    /// The diagram.
    ///
    /// # Errors
    /// When it cannot be drawn.
    pub fn figure(&self) -> Result<Figure, ChartError> {
        let points = self.bins.iter().map(|bin| (bin.stated, bin.right)).collect();
        let whiskers = self.bins.iter().map(|bin| (bin.stated, bin.interval.0, bin.interval.1));
        let panel = Panel {
            title: String::new(),
            x: Axis::linear("stated probability"),
            y: Axis::linear("share that was right"),
            layers: vec![
                Layer::new("what it should be", 2, Marks::Dashes(vec![(0.0, 0.0), (1.0, 1.0)])),
                Layer::new("95 % interval", 0, Marks::Whiskers(whiskers.collect())),
                Layer::new("names given", 1, Marks::Dots(points)),
            ],
        };
        Figure::of("Reliability of stated probabilities", 1, &[panel])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        answer::{Answer, Cause},
        score::{Named, Verdict},
    };

    fn case(probability: f64, is_right: bool) -> Judged {
        let named = Named {
            effect: "gyro-bias".to_owned(),
            probability,
            ..Named::default()
        };
        let truth = if is_right { "gyro-bias" } else { "gyro-lag" };
        Judged {
            answer: Answer {
                case: "T".to_owned(),
                attitudes: Vec::new(),
                ring: "R1".to_owned(),
                seed: 0,
                effects: vec![Cause {
                    snr_withheld: None,
                    effect: truth.to_owned(),
                    in_library: true,
                    channels: Vec::new(),
                    strength: 1.0,
                    snr_marginal: None,
                    sizes: Vec::new(),
                    attitude_deg: None,
                    gap_growth: None,
                }],
                snr_marginal: 20.0,
                source: None,
            },
            verdict: Some(Verdict {
                causes: vec![named],
                ..Verdict::default()
            }),
            channels: None,
        }
    }

    #[test]
    fn what_is_said_and_what_is_right_stand_side_by_side() {
        let mut judged: Vec<Judged> = (0..10).map(|k| case(0.9, k < 9)).collect();
        judged.extend((0..10).map(|k| case(0.6, k < 6)));
        let found = Reliability::of(&judged);
        assert_eq!(found.bins.iter().map(|bin| bin.count).sum::<usize>(), 20);
        let right: f64 = found.bins.iter().map(|bin| bin.right * bin.count as f64).sum();
        assert_eq!(right, 15.0);
        assert!(found.bins.first().is_some_and(|bin| bin.stated == 0.6));
        assert!(found.figure().expect("drawn").legend().contains(&"what it should be"));
    }

    #[test]
    fn nothing_said_is_an_empty_diagram() {
        assert!(Reliability::of(&[]).bins.is_empty());
        assert!(Reliability::of(&[]).figure().is_ok());
    }
}
