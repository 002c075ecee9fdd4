//! Whether what was found on the fit windows is on the held-out ones too.
//!
//! In: the twin, its reference, the effects that a model names and one aspect of what these, calibration and noise leave there.
//! Out: the probability of that aspect being as large on the held-out windows by chance. It was chosen among hundreds on the
//! fit windows and is alone on these, so a gap that is hardly seen in either is seen in both.

use twin::predict::Twin;

use crate::{
    input::{hold::Held, reference::Reference, windows::Fit},
    null::{
        model::Model,
        problem::{Component, Problem},
    },
    unknown::{adequacy, views},
};

impl Held {
    /// Calibration and the sizes of the effects are fitted to the held-out samples anew, and say nothing but this. `None` where
    /// the aspect is of the calibration itself, which is the same in all windows, or where there are no samples.
    pub fn recurrence(&self, twin: &Twin, instrument: &Reference, components: &[Component], what: &str) -> Option<f64> {
        if self.samples().iter().all(|series| series.rows.is_empty()) {
            return None;
        }
        let own = Fit {
            channels: self.samples().to_vec(),
        };
        let mut problem = Problem::new(twin, &own, instrument);
        for component in components {
            problem.retell(&component.active.cause);
        }
        let model = Model::around(&problem, components.to_vec());
        adequacy::recurrence(
            &views::views(&problem, &model.predicted),
            &model.joint,
            &model.fitted,
            &views::suspects(&problem, &model),
            what,
        )
    }
}
