//! Whether what was found on the fit windows is on the held-out ones too.
//!
//! In: the twin, its reference and one aspect of what calibration and noise leave there, found where nothing explains it. Out:
//! the probability of that aspect being as large on the held-out windows by chance. It was chosen among hundreds on the fit
//! windows and is alone on these, so a gap that is hardly seen in either is seen in both.

use twin::predict::Twin;

use super::Held;
use crate::{leftover, model::Model, problem::Problem, reference::Reference, sight, windows::Fit};

impl Held {
    /// Calibration is fitted to the held-out samples anew, and says nothing but this. `None` where the aspect is of the
    /// calibration itself, which is the same in all windows, or where there are no samples.
    pub fn recurrence(&self, twin: &Twin, instrument: &Reference, what: &str) -> Option<f64> {
        if self.channels.iter().all(|series| series.rows.is_empty()) {
            return None;
        }
        let own = Fit {
            channels: self.channels.clone(),
        };
        let problem = Problem::new(twin, &own, instrument);
        let quiet = Model::around(&problem, Vec::new());
        leftover::recurrence(
            &sight::views(&problem, &quiet.predicted),
            &quiet.joint,
            &quiet.fitted,
            what,
        )
    }
}
