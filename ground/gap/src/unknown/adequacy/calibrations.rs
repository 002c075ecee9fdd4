//! What is open of each channel by itself and was found along one line in several.
//!
//! In: what is open in each channel, and a fit. Out: for each set of channels that have something in common the square of
//! what they were found to share, in units of what chance leaves of it. Each channel was calibrated alone and each part
//! converts by its own clock, so that what is shared is no calibration: the same delay or factor in a kind of sensors, one
//! vector on all zeros of a kind, one turn of the axes of a part, of a plate, of a kind or of all sensors. A magnet on the
//! body that moves twelve zeros by 2.8 sigmas each is ten sigmas of one vector, and among the squares of biases, factors and
//! axes was not seen.

use nalgebra::{Matrix3, Vector3};

use super::{
    common::inverse_root,
    label::{OF_CALIBRATION, name_of},
    view::{AXES, Open, View, ZERO},
};
use crate::null::joint::Fitted;

/// What a part has once for all of its channels.
pub const OF_PART: [&str; 2] = ["instant", "instant_drift"];

/// What may be off alike in all of a kind.
const ALIKE: [&str; 4] = [ZERO, "scale", "instant", "instant_drift"];

/// Channels that share something.
pub struct Shared {
    /// Which, and what.
    pub what: String,
    /// Each with its place in what is open of it, and what the shared vector makes of it.
    places: Vec<(usize, usize, Vector3<f64>)>,
    /// Inverse root of their normal matrix.
    root: Matrix3<f64>,
}

impl Shared {
    /// All that at least two directions of calibrations have.
    pub fn all(views: &[View], kinds: usize) -> Vec<Shared> {
        let by_b = |open: &Open| open.by_b;
        let mut all = Vec::new();
        let mut add =
            |what: String, is_own: &dyn Fn(&View) -> bool, names: &[&str], by: &dyn Fn(&Open) -> Vector3<f64>| {
                all.extend(Shared::of(views, what, is_own, names, by));
            };
        for kind in 0..kinds {
            let (own, called) = (|view: &View| view.kind == kind, name_of(kind));
            for name in ALIKE {
                add(format!("{called}, {name} of all alike"), &own, &[name], &|_| {
                    Vector3::x()
                });
            }
            add(format!("{called}, zeros along one vector"), &own, &[ZERO], &by_b);
            add(format!("{called}, turned alike"), &own, &AXES, &by_b);
        }
        for (index, View { name, part, group, .. }) in views.iter().enumerate() {
            if *part == index {
                let own = |view: &View| view.part == index;
                add(format!("{name}'s part, zeros"), &own, &[ZERO], &by_b);
                add(format!("{name}'s part, turned"), &own, &AXES, &by_b);
            }
            if *group == index {
                let own = |view: &View| view.group == index;
                add(format!("what is mounted with {name}, turned alike"), &own, &AXES, &by_b);
            }
        }
        add("all sensors, turned alike".into(), &|_| true, &AXES, &by_b);
        all
    }

    /// What is open by these names in the channels that are its own.
    fn of(
        views: &[View],
        what: String,
        is_own: &dyn Fn(&View) -> bool,
        names: &[&str],
        by: &dyn Fn(&Open) -> Vector3<f64>,
    ) -> Option<Shared> {
        let own = views.iter().enumerate().filter(|(_, view)| is_own(view));
        let places = own.flat_map(|(channel, view)| {
            let open = view.open.iter().enumerate();
            let named = open.filter(|(_, open)| names.contains(&open.name.as_str()));
            named
                .map(|(place, open)| (channel, place, by(open)))
                .collect::<Vec<_>>()
        });
        let places: Vec<_> = places.collect();
        let normal: Matrix3<f64> = places.iter().map(|(_, _, by)| by * by.transpose()).sum();
        (places.len() > 1).then(|| Shared {
            what: format!("{what}: {OF_CALIBRATION}"),
            root: inverse_root(normal),
            places,
        })
    }

    /// The channels, one as often as it has a place.
    pub fn channels(&self) -> impl Iterator<Item = usize> {
        self.places.iter().map(|(channel, _, _)| *channel)
    }

    /// The square of what they share.
    pub fn sum(&self, fitted: &Fitted) -> f64 {
        let found = |(channel, place, by): &(usize, usize, Vector3<f64>)| by * fitted.nuisance[*channel][*place];
        let score: Vector3<f64> = self.places.iter().map(found).sum();
        (self.root * score).norm_squared()
    }
}
