//! The second look: effects sought about the smoothed motion.
//!
//! In: a [`Followed`] log, what parity names. Out: [`Second`]: what else the evidence asks for once the whole course of the motion is
//! eliminated at once, by [`crate::parity::smooth::smoothing`] instead of packet by packet. A motion that is one course ties packets
//! to each other, and the known field ties them to n; so effects that every packet alone takes for another motion are seen: what
//! depends on a rate, a force or a temperature and is the same in all sensors of a kind.
//!
//! Library, columns, evidence and doubts are those of the first look ([`crate::parity::search`]). The exact nulls
//! ([`crate::parity::nulls`]) are columns of no price before anything is sought: a prior of smoothness is not changed by a delay, but its
//! linearisation is, and gives a common delay a ratio of 17 on a healthy log.
//!
//! What parity names stays in the model, its parameters free. A motion that did not settle is none to look about.
//!
//! The prior of the motion is a guess, and evidence does not know how good it is. So what this look alone names is believed only as
//! far as two others keep what it promises ([`strengths`]): the held-out windows, smoothed with a motion of their own, must show
//! it; and parity, where it shows it, must find it as strong, for parity needs no prior of smoothness. Where they do not, either
//! that prior or something outside the library is to blame, which one log does not tell: nothing is said but that it may be.

use nalgebra::{DMatrix, DVector};
use twin::effect::{Active, LIBRARY, Nature};

use crate::{
    holdout::strength::Promise,
    input::{case::CaseError, reference::Reference},
    library::{column::Entries, hypotheses::Library},
    null::problem::{Component, Problem},
    parity::{
        again,
        followed::Followed,
        name::{By, Fitted, Name},
        nulls::{self, NULLS},
        packet::Motion,
        search::{self, Chosen, First, Offered, residual_of},
        smooth::Smoothed,
        space::{self, Projected, Space, dot, screen},
        visible::{self, Row},
        walk,
    },
};

/// What the second look says.
pub struct Second {
    /// What can be seen.
    pub visible: Vec<Row>,
    /// Of each effect that parity names the same with another value, where the course as a whole has it there.
    pub told: Vec<Option<(Name, Fitted)>>,
    /// What it names beside what parity does, likeliest first, its parameters fitted.
    pub names: Vec<(Name, Fitted)>,
    /// Other effects with their probabilities.
    pub rivals: Vec<(&'static str, f64)>,
    /// What is left with what parity names in the model, and with one after the other of its own names too.
    pub left: Vec<Left>,
}

/// What a model leaves.
#[derive(Clone, Debug)]
pub struct Left {
    /// \[sigma\] over degrees of freedom.
    pub gap: f64,
    /// By how many of its own sigmas each parameter of the calibration is off.
    pub calibration: Vec<f64>,
}

impl Left {
    /// Of a residual.
    pub fn of(space: &Space, residual: &Projected) -> Self {
        Self {
            gap: space::gap(&space.kept(residual)),
            calibration: space.calibration(residual),
        }
    }
}

impl Second {
    /// Of a log in which parity names these; none where the motion did not settle.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn look(
        followed: &Followed,
        withheld: &[String],
        named: &[Fitted],
        progress: &dyn Fn(&'static str, f64),
    ) -> Result<Option<Self>, CaseError> {
        let smoothed = followed.smoothed(&|share| progress("motion", share))?;
        if !smoothed.is_settled() {
            return Ok(None);
        }
        let (twin, fit, reference) = (followed.twin(smoothed)?, followed.fit(), Reference::default());
        let problem = Problem::new(&twin, &fit, &reference);
        let motion = followed.motion(smoothed, &problem);
        let mut library = Library::new(&problem, withheld, &|share| progress("smoothed", 0.3 * share));
        // Nothing with a shape is named in the place of a walk.
        walk::offer(&problem, &mut library, withheld);
        let offered = Offered::of(&problem, &library);
        let nulls = nulls::columns(&problem, &library);
        let (space, opened) = Space::among(&problem, motion, nulls, &offered.columns());
        followed.remember(space.calibrated());
        let prior = motion.prior();
        let project = |model: &[Component]| space.project_residual(residual_of(&problem, model), &prior);
        let mut model: Vec<Component> = named.iter().map(|(component, _)| component.clone()).collect();
        let residual = project(&model);
        let part = |from: f64, share: f64| progress("smoothed", from + (1.0 - from) * share);
        let mut seen = search::look(&space, &library, (&offered, &opened), &residual, &|share| {
            part(0.4, 0.7 * share)
        });
        drop((offered, opened));
        let visible = visible::table(&library.hypotheses, &seen);
        let told = search::told_anew(&space, &mut library, &model, &seen, &project);
        let told: Vec<Option<(Name, Fitted)>> = (told.iter())
            .map(|own| Some(Name::of(&problem, &library, own.as_ref()?, By::Parity)))
            .collect();
        for (own, told) in model.iter_mut().zip(&told) {
            if let Some((_, (component, _))) = told {
                *own = component.clone();
            }
        }
        let residual = project(&model);
        search::rescore(&mut seen, &library, &space.rest(&residual));
        let first = First::of(&space, &model);
        again::take(&space, &mut library, &residual, &mut seen);
        let chosen = search::choose(&space, &mut library, &residual, &mut seen, first, &|share| {
            part(0.8, share);
        });
        let said: Vec<&Chosen> = search::said(&chosen);
        let mut left = vec![Left::of(&space, &residual)];
        for one in &said {
            model.push(library.hypotheses[one.hypothesis].component(&one.theta));
            left.push(Left::of(&space, &project(&model)));
        }
        Ok(Some(Self {
            visible,
            told,
            rivals: search::rivals(&library, &chosen),
            names: said
                .iter()
                .map(|one| Name::of(&problem, &library, one, By::Smoothing))
                .collect(),
            left,
        }))
    }
}

/// By what factor each cause is stronger in a space than it was fitted; none of one that makes nothing there. `prior` is what prior
/// rows of the motion are off by.
///
/// With `d` what a cause adds, it and those before it in the model, `r` what these leave, and `s` the derivatives of `d` by its parameters, whose
/// covariance is `C`, the factor is `1 + <d, r> / <d, d>` and its variance `(<d, d> + <s, d>' C <s, d>) / <d, d>^2`, as in
/// [`crate::holdout::strength`], the motion marginalised.
pub fn strengths(space: &Space, prior: &DVector<f64>, causes: &[Fitted]) -> Vec<Option<Promise>> {
    let all = measured(space, prior, causes).into_iter().zip(causes);
    all.map(|(strength, (_, covariance))| strength.promise(covariance))
        .collect()
}

/// The sums that a factor is made of: those of several logs add up.
#[derive(Clone, Debug)]
pub struct Strength {
    /// `<d, d>`.
    pub energy: f64,
    /// `<d, r>`.
    pub along: f64,
    /// `<s, d>`; none of a cause without parameters.
    pub by_parameter: DVector<f64>,
}

impl Strength {
    /// The factor, of parameters with this covariance; none where the cause makes nothing.
    pub fn promise(&self, covariance: &DMatrix<f64>) -> Option<Promise> {
        let fitted = match self.by_parameter.len() {
            0 => 0.0,
            _ => self.by_parameter.dot(&(covariance * &self.by_parameter)).max(0.0),
        };
        (self.energy > 0.0).then(|| Promise {
            factor: 1.0 + self.along / self.energy,
            sigma: (self.energy + fitted).sqrt() / self.energy,
        })
    }

    /// That of two logs.
    pub fn with(mut self, other: &Self) -> Self {
        self.energy += other.energy;
        self.along += other.along;
        self.by_parameter += &other.by_parameter;
        self
    }
}

/// The sums of [`strengths`].
fn measured(space: &Space, prior: &DVector<f64>, causes: &[Fitted]) -> Vec<Strength> {
    let all: Vec<Component> = causes.iter().map(|(component, _)| component.clone()).collect();
    let strength = |(at, (component, _)): (usize, &Fitted)| {
        // What was found beside it may not be there.
        let model = &all[..=at];
        let rest = space.rest(&space.project_residual(residual_of(space.problem, model), prior));
        let added = space.problem.contribution(model, &[at]);
        let own_rest = space.rest(&space.project(added.clone()));
        let energy = dot(&added, &own_rest);
        let is_sized = component.active.cause.effect.page().nature != Nature::Discrete;
        let slopes = if is_sized {
            space.problem.slopes(model, at)
        } else {
            Vec::new()
        };
        let by_parameter = slopes.iter().map(|slope| dot(slope, &own_rest));
        Strength {
            energy,
            along: dot(&added, &rest),
            by_parameter: DVector::from_iterator(slopes.len(), by_parameter),
        }
    };
    causes.iter().enumerate().map(strength).collect()
}

/// The same on the held-out windows, smoothed with a motion of their own; by parity alone where that did not settle.
///
/// # Errors
/// When the unit's description names an effect there is not.
pub fn promises(held: &Followed, causes: &[Fitted], progress: &dyn Fn(f64)) -> Result<Vec<Option<Promise>>, CaseError> {
    let all = held_out(held, causes, progress)?.into_iter().zip(causes);
    Ok(all
        .map(|(strength, (_, covariance))| strength.promise(covariance))
        .collect())
}

/// The sums of [`promises`].
///
/// # Errors
/// When the unit's description names an effect there is not.
pub fn held_out(held: &Followed, causes: &[Fitted], progress: &dyn Fn(f64)) -> Result<Vec<Strength>, CaseError> {
    let smoothed = held.smoothed(progress)?;
    if !smoothed.is_settled() {
        let (twin, fit, reference) = (held.twin_of_course()?, held.fit(), Reference::default());
        let problem = Problem::new(&twin, &fit, &reference);
        let motion = Motion::of(&problem, &held.course);
        let space = Space::new(&problem, &motion, exact_nulls(&problem));
        return Ok(measured(&space, &DVector::zeros(0), causes));
    }
    about_smoothed(held, smoothed, |space, prior| measured(space, prior, causes))
}

/// \[nats\] that a walk as strong as it was fitted gains on the held-out windows with these effects in the model, its course there its own; none where
/// the motion did not settle.
///
/// # Errors
/// When the unit's description names an effect there is not.
pub fn walked_on(held: &Followed, model: &[Component], walk: &Active) -> Result<Option<f64>, CaseError> {
    let smoothed = held.smoothed(&|_| ())?;
    if !smoothed.is_settled() {
        return Ok(None);
    }
    about_smoothed(held, smoothed, |space, prior| {
        let left = space.rest(&space.project_residual(residual_of(space.problem, model), prior));
        let columns = walk::as_strong_as(space.problem, walk);
        let (columns, sigmas): (Vec<Entries>, Vec<f64>) = columns.into_iter().unzip();
        let rests = space.rests(&columns);
        let [columns, rests] = [&columns, &rests].map(|all| all.iter().collect::<Vec<_>>());
        screen(&columns, &rests, sigmas, &left).log_evidence()
    })
}

/// What is said in a space about the smoothed motion of a log, and of what its prior rows are off by.
fn about_smoothed<T>(
    held: &Followed,
    smoothed: &Smoothed,
    say: impl FnOnce(&Space, &DVector<f64>) -> T,
) -> Result<T, CaseError> {
    let (twin, fit, reference) = (held.twin(smoothed)?, held.fit(), Reference::default());
    let problem = Problem::new(&twin, &fit, &reference);
    let motion = held.motion(smoothed, &problem);
    let space = Space::new(&problem, motion, exact_nulls(&problem));
    Ok(say(&space, &motion.prior()))
}

/// Columns of the exact nulls of a problem.
fn exact_nulls(problem: &Problem) -> Vec<Entries> {
    let is_null = |name: &str| NULLS.iter().any(|null| null.effects.contains(&name));
    let others = LIBRARY.iter().map(|effect| effect.page().name);
    let others: Vec<String> = others.filter(|name| !is_null(name)).map(str::to_owned).collect();
    nulls::columns(problem, &Library::new(problem, &others, &|_| ()))
}
