//! A log whose motion is followed: without what its codes tell, along its course, and along the smoothed motion.
//!
//! In: rows of a [`Flight`], those of the fit windows or the held-out ones, which have a motion each. Out: [`Followed`].

use std::cell::OnceCell;

use nalgebra::{DMatrix, DVector};
use twin::{
    environment::Environment,
    predict::{Twin, UnitDescription},
};

use crate::{
    input::{case::CaseError, log::Log, reference::Reference, windows::Fit},
    null::problem::Problem,
    parity::{
        codes::Finding,
        course::{Course, Start},
        flight::Flight,
        known::Known,
        lost::{Loss, put_back_spans},
        packet::Motion,
        search::{Free, residual_of},
        smooth::{self, About, Smoothed, smoothing::Smoothing},
        space::Space,
        taken_out::taken_out,
        turning::Holes,
    },
};

/// What a motion is made with.
#[derive(Clone, Debug, Default)]
pub struct Beforehand {
    /// Effects that need no motion to be named. They are taken out.
    pub found: Vec<Finding>,
    /// Channels of a part that would bend the motion. They are judged about the motion of the others.
    pub bending: Vec<usize>,
    /// Share of the rows after which one lost packet would be found; none where they were not looked for.
    pub loss_shown: Option<f64>,
}

impl Beforehand {
    /// Of these findings alone.
    pub fn found(found: &[Finding]) -> Self {
        Self {
            found: found.to_vec(),
            ..Self::default()
        }
    }

    /// Packets that nobody counted.
    pub fn losses(&self) -> Vec<Loss> {
        self.found.iter().flat_map(|finding| finding.losses.clone()).collect()
    }
}

/// A log and what its unit did meanwhile.
pub struct Followed {
    /// What is left of the log.
    pub log: Log,
    /// The same without a part that would bend the motion.
    steady: Log,
    /// The unit, its noise with what codes lose.
    pub unit: UnitDescription,
    /// About which parity is linear.
    pub course: Course,
    smoothed: OnceCell<Smoothed>,
    motion: OnceCell<Smoothing>,
    calibrated: OnceCell<DMatrix<f64>>,
    environment: Environment,
    known: Known,
    rests: Vec<(f64, f64)>,
    start: Start,
}

impl Followed {
    /// Rows of a flight, of which this is known.
    pub fn of(flight: &Flight, log: &Log, beforehand: &Beforehand) -> Self {
        let (mut log, mut unit) = (log.clone(), flight.unit.clone());
        taken_out(&mut log, &mut unit, &beforehand.found);
        let steady = log.without(&beforehand.bending);
        let environment = flight.environment;
        let (course, mut start) = Course::of(&steady, &unit, &environment);
        start.holes.clone_from(&flight.holes);
        let losses = beforehand.losses();
        put_back_spans(start.holes.spans_s_mut(), &losses);
        Self {
            course,
            smoothed: OnceCell::new(),
            motion: OnceCell::new(),
            calibrated: OnceCell::new(),
            rests: flight.rests(&steady, &unit, &losses),
            log,
            steady,
            unit,
            environment,
            known: flight.known.clone(),
            start,
        }
    }

    /// The motion smoothed over the whole log, made when first asked for. It may not have settled.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn smoothed(&self, progress: &dyn Fn(f64)) -> Result<&Smoothed, CaseError> {
        if let Some(known) = self.smoothed.get() {
            return Ok(known);
        }
        let about = self.about();
        let mut smoothed = Smoothed::of(&about, self.rests.clone(), progress)?;
        if smoothed.is_settled() {
            smoothed.hold(&self.known, &about, progress)?;
        }
        Ok(self.smoothed.get_or_init(|| smoothed))
    }

    fn about(&self) -> About<'_> {
        About {
            log: &self.steady,
            unit: &self.unit,
            environment: &self.environment,
            course: &self.course,
            start: &self.start,
        }
    }

    /// A motion that has settled, with these effects in the model.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn beside(&self, smoothed: &Smoothed, named: &[Free]) -> Result<Smoothed, CaseError> {
        smoothed.beside(&self.about(), named)
    }

    /// Another smoothed motion of it, to be eliminated from a problem of [`Followed::twin`].
    pub fn another(&self, smoothed: &Smoothed, problem: &Problem) -> Smoothing {
        smoothed.smoothing(problem, &self.course, &self.start)
    }

    /// The twin along the course.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn twin_of_course(&self) -> Result<Twin, CaseError> {
        let (scene, starts_s) = (self.course.scene.clone(), self.log.start_s.clone());
        Ok(Twin::new(self.unit.clone(), self.environment, scene, starts_s)?)
    }

    /// What packets keep of each channel once motion and calibration are eliminated: its energy and its degrees of freedom.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn kept_by_packets(&self) -> Result<Vec<(f64, f64)>, CaseError> {
        let (twin, fit, reference) = (self.twin_of_course()?, self.fit(), Reference::default());
        let problem = Problem::new(&twin, &fit, &reference);
        let motion = Motion::of(&problem, &self.course);
        let space = Space::new(&problem, &motion, Vec::new());
        let residual = space.project_residual(residual_of(&problem, &[]), &DVector::zeros(0));
        Ok(space.kept(&residual))
    }

    /// The twin along a smoothed motion of it.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn twin(&self, smoothed: &Smoothed) -> Result<Twin, CaseError> {
        smoothed.twin(&self.log, &self.unit, &self.environment)
    }

    /// Where nobody knows how fast it turned.
    pub fn holes(&self) -> &Holes {
        &self.start.holes
    }

    /// All of the log.
    pub fn fit(&self) -> Fit {
        smooth::fit(&self.log)
    }

    /// Its smoothed motion, to be eliminated from a problem of [`Followed::twin`], made when first asked for.
    pub fn motion(&self, smoothed: &Smoothed, problem: &Problem) -> &Smoothing {
        self.motion
            .get_or_init(|| smoothed.smoothing(problem, &self.course, &self.start))
    }

    /// The same for covariances in free fall; none where the log has none.
    pub fn in_free_fall(&self, smoothed: &Smoothed, problem: &Problem) -> Option<Smoothing> {
        smoothed.in_free_fall(problem, &self.course, &self.start)
    }

    /// Keeps [`Space::calibrated`] of a space about its smoothed motion.
    pub fn remember(&self, calibrated: &DMatrix<f64>) {
        self.calibrated.get_or_init(|| calibrated.clone());
    }

    /// A space about its smoothed motion, without nulls; its calibration may be open still.
    pub fn space<'a>(&self, problem: &'a Problem<'a>, motion: &'a Smoothing) -> Space<'a> {
        match self.calibrated.get() {
            Some(known) => Space::known(problem, motion, known.clone()),
            None => Space::open_still(problem, motion, Vec::new()),
        }
    }
}
