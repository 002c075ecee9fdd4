//! A motion that has settled is held to what else is known of it, and settles again; what does not fit is left out, and said.
//!
//! In: [`Known`]. Attitudes at instants are held against the motion without them, each by itself. A simulated trajectory is held against the log alone before anything else is in, a track against a motion that was
//! smoothed with it: its fixes say nothing of an attitude one by one.

use nalgebra::Matrix3;
use twin::predict::{Channel, Kind};

use crate::{
    input::{case::CaseError, reference::Reference},
    null::problem::Problem,
    parity::{
        known::{
            Known,
            instants::{Instants, Kept},
            simulated::{Belief, Simulated},
            ties::{Ties, Use},
            track::{self, Fixes},
        },
        smooth::{About, Smoothed, covariances, fit},
        space::Space,
    },
};

impl Smoothed {
    /// Takes in what is known. Where packets were left out ([`crate::parity::turning`]) nobody knows how the velocity changed, and a track and a simulated
    /// trajectory run through it: neither is used.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn hold(&mut self, known: &Known, about: &About, progress: &dyn Fn(f64)) -> Result<(), CaseError> {
        let is_whole = about.start.holes.pieces(&about.log.start_s).len() == 1;
        if let Some(simulated) = known.simulated.as_ref().filter(|_| is_whole) {
            self.believe(simulated, about, progress)?;
        }
        if !known.attitudes.all.is_empty() {
            self.point(&known.attitudes.within(&self.knots), about, progress)?;
        }
        if let Some(track) = known.track.as_ref().filter(|_| is_whole) {
            self.follow(track, about, progress)?;
        }
        Ok(())
    }

    fn believe(&mut self, simulated: &Simulated, about: &About, progress: &dyn Fn(f64)) -> Result<(), CaseError> {
        let known = self.known_at(about, &simulated.middles_s(&self.knots))?;
        let own = about
            .unit
            .channels
            .iter()
            .filter(|own| own.sensor == Kind::Accelerometer);
        let noise = own.map(Channel::sigma).fold(0.0, f64::max);
        let mut belief = simulated.judged(&self.trajectory, &self.knots, &known, noise);
        if matches!(belief, Belief::Used { .. }) {
            let alone = self.clone();
            self.ties.simulated = Some(simulated.clone());
            if !self.settles_again(about, progress)? {
                (*self, belief) = (alone, Belief::Unsettled);
            }
        }
        self.belief = Some(belief);
        Ok(())
    }

    fn point(&mut self, told: &Instants, about: &About, progress: &dyn Fn(f64)) -> Result<(), CaseError> {
        let instants_s: Vec<f64> = told.all.iter().map(|own| own.t_s).collect();
        let known = self.known_at(about, &instants_s)?;
        let mut kept = told.judged(&self.trajectory, &known);
        let used = told.all.iter().zip(&kept).filter(|(_, kept)| kept.is_used);
        let used: Vec<_> = used.map(|(own, _)| *own).collect();
        if !used.is_empty() {
            let alone = self.clone();
            self.ties.attitudes = Instants { all: used };
            if !self.settles_again(about, progress)? {
                *self = alone;
                kept.iter_mut().for_each(|own: &mut Kept| own.is_used = false);
            }
        }
        self.attitudes = Some(kept);
        Ok(())
    }

    /// Covariances of a turn in b at instants \[s\], as the motion is known so far.
    fn known_at(&self, about: &About, instants_s: &[f64]) -> Result<Vec<Matrix3<f64>>, CaseError> {
        let (fit, reference) = (fit(about.log), Reference::default());
        let twin = self.twin(about.log, about.unit, about.environment)?;
        let problem = Problem::new(&twin, &fit, &reference);
        let falling = self.in_free_fall(&problem, about.course, about.start);
        let motion = falling.unwrap_or_else(|| self.smoothing(&problem, about.course, about.start));
        let mut space = Space::open_still(&problem, &motion, Vec::new());
        let parts = space.marginalise();
        Ok(covariances(&space, &motion, parts, instants_s))
    }

    fn follow(&mut self, track: &Fixes, about: &About, progress: &dyn Fn(f64)) -> Result<(), CaseError> {
        self.track = Some(Use::Elsewhere);
        let Some(offset_s) = track::begin(track, &self.trajectory) else {
            return Ok(());
        };
        let alone = self.clone();
        self.ties = Ties {
            fixes: track.within(self.trajectory.span_s(), offset_s).fixes,
            offset_s,
            ..self.ties.clone()
        };
        let is_settled = self.settles_again(about, progress)?;
        let (found, beside) = match self.ties.aligned(&self.trajectory) {
            Some(aligned) if is_settled => (Use::of(&aligned), aligned.beside(&self.ties.fixes)),
            _ => (Use::Unsettled, Vec::new()),
        };
        match found {
            Use::Used(fit) => self.ties.offset_s = fit.offset_s,
            _ => *self = alone,
        }
        (self.track, self.beside_track) = (Some(found), beside);
        Ok(())
    }

    fn settles_again(&mut self, about: &About, progress: &dyn Fn(f64)) -> Result<bool, CaseError> {
        self.gain = f64::INFINITY;
        self.settle(about, progress)?;
        Ok(self.is_settled())
    }
}
