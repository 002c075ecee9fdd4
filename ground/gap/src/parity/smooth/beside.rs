//! The motion beside what is named.
//!
//! In: a motion that has settled, and effects that were named about it. Out: one that has settled with them in the model, their parameters free.
//!
//! What is wrong in gyros, in forces or in the field bends the motion before it is known, and nothing in its covariance says so: of a gyro whose
//! zero walks by 0.3 deg/s the attitude was off by 3.3 of its sigmas. So the effects' columns stand beside those of the calibration, each for the
//! sigma of its parameter, in the steps as in the covariance; where the log does not tell a place from others, at all of them.

use crate::{
    input::{case::CaseError, reference::Reference},
    null::problem::{Component, Problem},
    parity::{
        search::{Free, opened, residual_of},
        smooth::{About, LONGEST_RAD, SETTLED_RAD, Smoothed, fit, motion_part},
        space::Space,
    },
};

/// Steps at most: what is named is small beside the motion that it was found about, and the first takes most of it out.
const MOST_STEPS: usize = 8;

impl Smoothed {
    /// With these effects in the model. It has not settled if they turn it for ever.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn beside(&self, about: &About, named: &[Free]) -> Result<Self, CaseError> {
        let mut bent = self.clone();
        let model: Vec<Component> = named.iter().map(|own| own.component.clone()).collect();
        let (fit, reference) = (fit(about.log), Reference::default());
        let pieces = about.start.holes.pieces(&about.log.start_s);
        let mut near = None;
        for _ in 0..MOST_STEPS {
            let twin = bent.twin(about.log, about.unit, about.environment)?;
            let problem = Problem::new(&twin, &fit, &reference);
            let motion = bent.smoothing(&problem, about.course, about.start);
            let mut space = Space::open_still(&problem, &motion, opened(&problem, named));
            let residual = residual_of(&problem, &model);
            let part = motion_part(&mut space, residual, &motion.prior(), &mut near, None);
            let correction = motion.correction(&part);
            let turn = bent.trajectory.turn(&bent.knots, &correction, &pieces);
            bent.turns.push(turn);
            bent.trajectory
                .correct(&bent.knots, &correction, (LONGEST_RAD / turn).min(1.0));
            if turn < SETTLED_RAD {
                break;
            }
        }
        Ok(bent)
    }
}
