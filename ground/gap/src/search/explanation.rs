//! What explains a log best: effects on readings, and at most one on how they scatter.
//!
//! In: the [`Problem`], its [`Library`], and what a first search chose. Out: an [`Explanation`], for which nothing held out
//! was asked.
//!
//! An effect on the scatter is judged on what the others leave. With the noise as found, everything else is searched anew;
//! a misfit that looks like noise is taken for noise in that search, and for a misfit again when what is left is judged. Where the reference
//! is not exact the noise has a colour ([`crate::search::in_colour`]). Beside
//! a gyro's walk everything else is searched with the walk open, until both stay what they are ([`crate::search::walked`]).

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};
use twin::{effect::Texture, part::signal::Noise};

use crate::{
    input::case::SlowErrors,
    library::hypotheses::Library,
    null::{
        misfit::{self, weighed},
        model::{Courses, Model},
        problem::{Component, Problem},
    },
    search::{
        gauss_newton::refine,
        in_colour::{attribute_in_colour, reframe},
        odds::probability_of_any,
        readings::{Attribution, Chosen, attribute, total_gain},
        scatter::{Scatter, scatters},
        walked::{Contest, walked, walked_in_colour},
    },
    thresholds::{COUNTED_PART, MOST_CAUSES, REMAINDER, SAID, WALK_FEWEST, effect_margin},
};

/// The effects that a log speaks for.
pub struct Explanation {
    /// Effects on readings, of which those are chosen that are likelier than not.
    pub found: Attribution,
    /// Those that were chosen too, and are not likelier than not.
    pub refused: Vec<Chosen>,
    /// The effect on the scatter.
    pub scatter: Option<Scatter>,
    /// The chosen effects on readings with everything else fitted.
    pub model: Model,
    /// What it predicts without the effect on the scatter.
    pub beneath: Vec<Vec<f64>>,
    /// How much more a sample scatters with the effect on the scatter, in the unit's channel order.
    pub louder: Vec<f64>,
    /// How many different effects, refused ones included, are in the channels of one of them, at most.
    company: usize,
    /// Whether those that were refused explain more than those that were kept.
    is_refused: bool,
    /// What a walk that is the effect on the scatter does, where the reference is not exact: the model follows it.
    followed: Courses,
    /// A walk and effects that it would take the place of, where the reference is not exact.
    contest: Option<Contest>,
}

impl Explanation {
    /// Explains a log whose reference and field err like this. `found` is what a first search chose, `quiet` the model without effects. The problem is left with the
    /// noise of the effect on the scatter if that is louder noise, and as described if it is not.
    pub fn of(
        problem: &mut Problem,
        library: &mut Library,
        quiet: &Model,
        mut found: Attribution,
        withheld: &[String],
        errors: &SlowErrors,
        progress: &dyn Fn(f64),
    ) -> Self {
        let first = Model::around(problem, found.model(library));
        let mut scatter = best_scatter(problem, &first, withheld);
        // Of effects that hold each other up each is worth more than its share: together no more than they take off.
        let together = 0.5 * (quiet.left() - first.left()).max(0.0);
        let explained = total_gain(&found.chosen).min(together) + scatter.as_ref().map_or(0.0, |scatter| scatter.gain);
        let alone = best_scatter(problem, quiet, withheld)
            .filter(|alone| !found.chosen.is_empty() && alone.gain > explained && is_whole(problem, alone));
        let is_inexact = errors.attitude_sigma_rad > 0.0;
        // Beside errors of the reference a walk is judged in their colour.
        let beside = (!is_inexact)
            .then(|| walked(problem, library, &first, withheld, progress))
            .flatten();
        let beside = beside.filter(|walked| walked.gain() > explained + effect_margin());
        let alone = alone.filter(|alone| !(is_inexact && is_walk(alone)));
        let is_alone = alone.is_some();
        let mut wanders = alone.as_ref().is_some_and(is_walk);
        if is_alone {
            found.chosen.clear();
            scatter = alone;
        }
        let mut first = if is_alone { quiet.clone() } else { first };
        if let Some(beside) = beside {
            // This was found with the walk open. It is not sought again with louder white noise in the walk's place.
            (found, *library, wanders) = (beside.found, beside.library, true);
            first = Model::around(problem, found.model(library));
            scatter = Some(beside.walk.scatter());
        }
        let first = &first;
        let mut louder = scatter.as_ref().map_or_else(
            || vec![1.0; problem.frames.len()],
            |scatter| louder(problem, first, scatter),
        );
        let described = problem.frames.clone();
        let both = factors(&first.fitted.rest, &louder, scatter.as_ref());
        let beneath = scatter.as_ref().map(|scatter| scatter.uncovered(problem));
        let (mut followed, mut contest) = (Courses::new(), None);
        if is_inexact || scatter.is_some() || both.iter().any(|factor| *factor != 1.0) {
            let frames = beneath.unwrap_or_else(|| described.clone());
            reframe(problem, library, weighed(frames, &both));
            if is_inexact {
                found = attribute_in_colour(problem, library, errors, found, progress);
                let beside = walked_in_colour(problem, library, errors, &found, scatter.as_ref(), withheld, progress);
                if let Some((walked, odds)) = beside {
                    if odds.odds > 0.0 {
                        (scatter, followed) = (Some(walked.walk.scatter()), walked.walk.courses(problem));
                        (found, *library, wanders) = (walked.found, walked.library, true);
                        louder.fill(1.0);
                    }
                    contest = Some(odds);
                }
            } else if !wanders {
                found = attribute(problem, library, progress);
            }
        }
        let company = company(problem, library, &found.chosen, scatter.as_ref());
        let (kept, refused): (Vec<Chosen>, Vec<Chosen>) = std::mem::take(&mut found.chosen)
            .into_iter()
            .partition(|chosen| probability_of_any(library, chosen) >= SAID);
        let is_refused = total_gain(&refused) > total_gain(&kept);
        found.chosen = kept;
        let loud = weighed(described.clone(), &louder);
        reframe(problem, library, described);
        let fitted = |problem: &Problem, components: Vec<Component>| match is_inexact {
            true => Model::beside(problem, components, &followed),
            false => Model::around(problem, components),
        };
        let first = fitted(problem, found.model(library));
        if scatter.is_some() && !wanders {
            // What a large effect's law leaves looks like scatter, and would be held to what that claims.
            scatter = best_scatter(problem, &first, withheld)
                .filter(|scatter| scatter.gain > REMAINDER * total_gain(&found.chosen));
        }
        let own = scatter.as_ref().map(|scatter| scatter.recalibrated(problem, &first));
        // What is left is judged with the noise as described, or a misfit would excuse itself.
        reframe(problem, library, loud);
        let mut model = fitted(problem, found.model(library));
        let mut beneath = model.predicted.clone();
        for (channel, predicted) in own.into_iter().flatten() {
            beneath[channel] = predicted;
        }
        if let Some(scatter) = &scatter {
            for channel in &scatter.channels {
                model.predicted[*channel] = scatter.expected(problem, *channel, &beneath[*channel]);
            }
        }
        Self {
            found,
            refused,
            scatter,
            model,
            beneath,
            louder,
            company,
            is_refused,
            followed,
            contest,
        }
    }

    /// Whether it names nothing.
    pub fn is_empty(&self) -> bool {
        self.found.chosen.is_empty() && self.scatter.is_none()
    }

    /// Whether it is more likely a patchwork for an effect that the library does not have: whatever stands in for that
    /// together is in the same channels, and leaves something. A bias of the gyros, iron at the magnetometers and a lever arm are not, nor
    /// are four effects that leave nothing.
    pub fn is_patchwork(&self, leaves_something: bool) -> bool {
        self.is_refused || self.company > MOST_CAUSES && leaves_something
    }

    /// Whether its effect on the scatter is a walk that the model follows.
    pub fn is_followed(&self) -> bool {
        !self.followed.is_empty()
    }

    /// What the model follows of a walk, in units of noise at the fitted samples.
    pub fn walk(&self, problem: &Problem) -> Vec<(usize, DVector<f64>)> {
        let of = |(channel, courses): &(usize, DMatrix<f64>)| {
            let (frame, found) = (&problem.frames[*channel], &self.model.fitted.nuisance[*channel]);
            let course = courses * found.rows(found.len() - courses.ncols(), courses.ncols());
            let fitted = frame.series.rows.iter().map(|row| course[*row as usize]);
            (
                *channel,
                frame.white(DVector::from_iterator(frame.series.rows.len(), fitted)),
            )
        };
        self.followed.iter().map(of).collect()
    }

    /// Part of the probability that effects on readings, in their order, have beside a walk, and what that has.
    pub fn share_with_walk(&self) -> (Vec<f64>, f64) {
        let share = |chosen: &Chosen| (self.contest.as_ref()).map_or(1.0, |contest| contest.share(chosen.hypothesis));
        let walk = self.contest.as_ref().map_or(1.0, Contest::walk);
        (self.found.chosen.iter().map(share).collect(), walk)
    }

    /// What its effect on the scatter makes of noise, given as residuals in units of noise. Louder white noise is in those
    /// units already, and a walk that is followed in no residual.
    pub fn disturb<'a>(&'a self, problem: &'a Problem) -> Option<impl Fn(&mut [DVector<f64>], u64) + 'a> {
        let scatter = self.scatter.as_ref().filter(|_| !self.is_followed())?;
        (scatter.effect.page().texture != Texture::Louder).then_some(
            move |residuals: &mut [DVector<f64>], seed: u64| {
                (residuals.iter_mut().zip(&self.louder)).for_each(|(residual, louder)| *residual /= *louder);
                scatter.disturb(problem, &self.beneath, residuals, Noise::new(seed));
            },
        )
    }

    /// Energy that it takes off what calibration and noise leave, in squares of noise.
    pub fn energy(&self, quiet: &Model) -> f64 {
        // In channels that scatter more than described an effect on readings explained what it gained over that scatter.
        let by_readings = |scatter: &Scatter| {
            self.energy_without(quiet, &scatter.channels)
                .max(2.0 * total_gain(&self.found.chosen))
        };
        match &self.scatter {
            // Louder noise takes in whatever is there, and a walk whatever is slow: that it does is no sign of its law.
            Some(scatter) if [Texture::Louder, Texture::Walk].contains(&scatter.effect.page().texture) => {
                by_readings(scatter)
            }
            Some(scatter) => by_readings(scatter) + 2.0 * scatter.gain,
            None => self.energy_without(quiet, &[]),
        }
    }

    /// Square root of the energy that the model takes off the fit windows.
    pub fn signal_to_noise(&self, quiet: &Model) -> f64 {
        (quiet.left() - self.model.left()).max(0.0).sqrt()
    }

    /// Takes one more effect on readings in, where the reference is not exact, fitted beside the others, which stay what they are.
    pub fn add(&mut self, problem: &Problem, library: &Library, chosen: Chosen) {
        self.found.chosen.push(chosen);
        let set: Vec<usize> = self.found.chosen.iter().map(|chosen| chosen.hypothesis).collect();
        let start: Vec<DVector<f64>> = self.found.chosen.iter().map(|chosen| chosen.theta.clone()).collect();
        let refined = refine(problem, library, &set, &start);
        if let (Some(added), Some(theta)) = (self.found.chosen.last_mut(), refined.thetas.into_iter().next_back()) {
            added.theta = theta;
        }
        self.model = Model::beside(problem, self.found.model(library), &self.followed);
        self.beneath.clone_from(&self.model.predicted);
        match &self.scatter {
            Some(scatter) => {
                for channel in &scatter.channels {
                    self.model.predicted[*channel] = scatter.expected(problem, *channel, &self.beneath[*channel]);
                }
            }
            None => self.louder.fill(1.0),
        }
    }

    /// Takes every effect back; returns their names.
    pub fn withdraw(&mut self, library: &Library) -> Vec<&'static str> {
        let readings = self.found.chosen.iter();
        let mut names: Vec<&'static str> = readings
            .map(|chosen| library.hypotheses[chosen.hypothesis].effect())
            .collect();
        names.extend(self.scatter.take().map(|scatter| scatter.effect.page().name));
        self.followed.clear();
        self.refused.append(&mut self.found.chosen);
        names
    }

    /// Takes the effect on the scatter back where the reference is not exact, with the noise as described; returns its name.
    pub fn withdraw_scatter(&mut self, problem: &mut Problem, library: &mut Library) -> Option<&'static str> {
        let name = self.scatter.take()?.effect.page().name;
        let quieter: Vec<f64> = self.louder.iter().map(|louder| louder.recip()).collect();
        let described = weighed(problem.frames.clone(), &quieter);
        reframe(problem, library, described);
        self.louder.fill(1.0);
        self.followed.clear();
        self.model = Model::beside(problem, self.found.model(library), &self.followed);
        self.beneath.clone_from(&self.model.predicted);
        Some(name)
    }

    fn energy_without(&self, quiet: &Model, scattered: &[usize]) -> f64 {
        let energy = |model: &Model| -> f64 {
            let channels = model.energies().into_iter().zip(&model.fitted.nuisance).enumerate();
            channels
                .filter(|(channel, _)| !scattered.contains(channel))
                .map(|(_, (energy, open))| energy + open.norm_squared())
                .sum()
        };
        (energy(quiet) - energy(&self.model)).max(0.0)
    }
}

/// How many different effects are in the channels of one of them, at most, the effect on the scatter included. An effect counts once, wherever and
/// however often it was found, and if it brings more than a fiftieth of all: less may be what the laws of the others leave.
fn company(problem: &Problem, library: &Library, chosen: &[Chosen], scatter: Option<&Scatter>) -> usize {
    let least = COUNTED_PART * total_gain(chosen);
    let component = |one: &Chosen| library.hypotheses[one.hypothesis].component(&one.theta);
    let model: Vec<Component> = chosen.iter().map(component).collect();
    let mut places: BTreeMap<&str, BTreeSet<usize>> = BTreeMap::new();
    for (at, one) in chosen.iter().enumerate().filter(|(_, one)| one.gain >= least) {
        let added = problem.contribution(&model, &[at]);
        let total: f64 = added.iter().map(|(_, values)| values.norm_squared()).sum();
        let own = added
            .iter()
            .filter(|(_, values)| values.norm_squared() >= COUNTED_PART * total);
        let place = places.entry(library.hypotheses[one.hypothesis].effect()).or_default();
        place.extend(own.map(|(channel, _)| *channel));
    }
    if let Some(scatter) = scatter {
        places
            .entry(scatter.effect.page().name)
            .or_default()
            .extend(&scatter.channels);
    }
    let meets = |own: &BTreeSet<usize>| places.values().filter(|other| !other.is_disjoint(own)).count();
    places.values().map(meets).max().unwrap_or(0)
}

/// Factors of the noise for a search: of a misfit, or of the effect on the scatter. What that says of samples takes the place of
/// how much louder their channel is.
fn factors(rest: &[DVector<f64>], louder: &[f64], scatter: Option<&Scatter>) -> Vec<f64> {
    let tells = |channel: usize| scatter.is_some_and(|scatter| scatter.tells_of(channel));
    let channels = misfit::factors(rest).into_iter().zip(louder).enumerate();
    channels
        .map(|(channel, (misfit, louder))| match *louder == 1.0 {
            true => misfit,
            false if tells(channel) => 1.0,
            false => *louder,
        })
        .collect()
}

fn best_scatter(problem: &Problem, model: &Model, withheld: &[String]) -> Option<Scatter> {
    let all = scatters(problem, model, withheld);
    all.into_iter().next().filter(|scatter| scatter.gain > effect_margin())
}

/// Whether an effect on the scatter, if it alone explains a log best, takes the place of what was found on readings: one that
/// says what is beneath it does, for that is searched; and a walk, for what wanders at random looks like a little of
/// everything.
fn is_whole(problem: &Problem, scatter: &Scatter) -> bool {
    let steps = |channel: &usize| problem.frames[*channel].series.rows.len();
    !scatter.beneath.is_empty()
        || is_walk(scatter) && scatter.channels.iter().map(steps).all(|steps| steps >= WALK_FEWEST)
}

fn is_walk(scatter: &Scatter) -> bool {
    scatter.effect.page().texture == Texture::Walk
}

/// How much more each channel scatters than the twin has it; 1 where the effect is not.
fn louder(problem: &Problem, model: &Model, scatter: &Scatter) -> Vec<f64> {
    let factor = |channel: usize| {
        let samples = problem.frames[channel].series.rows.len().max(1) as f64;
        let is_in = scatter.channels.contains(&channel);
        if is_in {
            let rest = problem.in_sigmas(channel, &model.fitted.rest[channel]);
            (rest.norm_squared() / samples).sqrt().clamp(0.1, 1000.0)
        } else {
            1.0
        }
    };
    (0..problem.frames.len()).map(factor).collect()
}
