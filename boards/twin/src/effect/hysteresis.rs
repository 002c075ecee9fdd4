//! Hysteresis: the sensor remembers from which side it came, or keeps what a shock left.
//!
//! Friction is a play operator: a state that follows the input, clipped to one half-width on either side. A shock leaves a step.

use super::{Effect, Page, Site, Symbol, onsets};
use crate::channel::{Chain, Kind};

/// [m/s2]
const HALF_WIDTHS: [f64; 3] = [0.3, 1.5, 6.0];

/// `accel-hysteresis`.
pub struct Hysteresis;

const PAGE: Page = Page {
    name: "accel-hysteresis",
    physics: "The proof mass sticks: the reading depends on the side it was approached from, or a shock has left an offset.",
    equation: "y = u + h p(u), p in [-1, 1] the play of half-width d; or a step h from an instant",
    source: "Shock offsets of 1 to 20 mg",
    excited_by: "tilting up and down, or a shock",
    siblings: &[
        "accel-bias",
        "accel-vibration-rectification",
        "coarse-quantisation",
        "accel-scale",
    ],
    confirm_by: "Approach one attitude from both sides.",
    sensors: &[Kind::Accelerometer],
    parameters: &[Symbol::signed("h", "m/s^2", 0.05)],
    ..Page::SMOOTH
};

impl Effect for Hysteresis {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let height = theta[0];
        chain.then(move |t_s, readings| {
            if variant >= 0.0 {
                for (reading, _) in readings.iter_mut().zip(t_s).filter(|(_, t_s)| **t_s >= variant) {
                    *reading += height;
                }
                return;
            }
            let (mut play, mut before) = (0.0_f64, readings.first().copied().unwrap_or(0.0));
            for reading in readings {
                play = (play - (*reading - before) / variant).clamp(-1.0, 1.0);
                before = *reading;
                *reading += height * play;
            }
        });
    }

    /// A play follows the sign of the rate of change, as the error of an instant does.
    fn is_like_a_reference(&self, variant: f64) -> bool {
        variant < 0.0
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(match variant {
            onset_s if onset_s >= 0.0 => format!("a step at {onset_s:.0} s"),
            width => format!("a play of {:.2} m/s2 to either side", -width),
        })
    }

    /// Half-widths [m/s2] of the play, negated, then onsets \[s\] of a step.
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        HALF_WIDTHS
            .into_iter()
            .map(|width| -width)
            .chain(onsets(starts_s))
            .collect()
    }
}
