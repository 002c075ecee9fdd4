//! What is open of each sensor by itself and was found alike in all of a kind.
//!
//! In: the names of what is open in each channel, and a fit. Out: for each name and kind the square of the mean over its
//! channels, in units of what chance leaves of it. Each sensor was calibrated alone and each part converts by its own clock, so
//! that all are off by the same is no calibration: where a delay of all gyros was taken for lost packets, the instants of four
//! gyros were 2.6 to 3.9 sigmas early and those of all others late, and their squares, among those of biases, factors and axes,
//! were not seen.

use super::{Fitted, View};

/// What is looked at, as [`crate::open::calibration`] names it. The directions across an axis are each channel's own.
const SHARED: [&str; 4] = ["bias", "scale", "instant", "instant_drift"];

/// What a part has once for all of its channels.
pub const OF_PART: [&str; 2] = ["instant", "instant_drift"];

/// One name in one kind of sensors.
pub struct Shared {
    /// Which of the kinds.
    pub kind: usize,
    /// What is open.
    pub name: &'static str,
    /// Channels that have it, each with its place in what is open of it.
    places: Vec<(usize, usize)>,
}

impl Shared {
    /// All that at least two channels have.
    pub fn all(views: &[View], kinds: usize) -> Vec<Shared> {
        let shared = |(kind, name): (usize, &'static str)| {
            let own = views.iter().enumerate().filter(|(_, view)| view.kind == kind);
            let places = own.filter_map(|(channel, view)| {
                let place = view.open.iter().position(|open| open == name)?;
                Some((channel, place))
            });
            let places: Vec<_> = places.collect();
            (places.len() > 1).then_some(Shared { kind, name, places })
        };
        let each = (0..kinds).flat_map(|kind| SHARED.map(|name| (kind, name)));
        each.filter_map(shared).collect()
    }

    /// The square of the mean, times their number.
    pub fn sum(&self, fitted: &Fitted) -> f64 {
        let all: f64 = self
            .places
            .iter()
            .map(|(channel, place)| fitted.nuisance[*channel][*place])
            .sum();
        all * all / self.places.len() as f64
    }
}
