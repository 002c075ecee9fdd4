//! Whether what an effect on readings explains counts, where the reference is not exact.
//!
//! In: a model and what is left beside reference, field and calibration with it and without one of its effects
//! ([`crate::unknown::slow::Beside`]). Out: [`Importance`].
//!
//! A real unit is off by a little everywhere, and thousands of samples make any of it significant: the differentiated positions of a camera
//! leave accelerometers lever arms of a thousand nats, and two effects that take each other back are worth twenty. That is no name. So
//! without an effect the gap of some channel or the attitude must grow by more than the user's bar, the others fitted anew, or it must be certain
//! ([`CERTAIN`]) where what the reference errs by is taken out and only what lasts for a fraction of a second is seen.
//! And it must do so better than a course that is free (Kennedy and O'Hagan 2001): a supply that sags slowly is no set pulse that is
//! missing since some instant.
//! Parts of one effect that share channels go together ([`Problem::parts`]): without one of them the others take its place.

use nalgebra::{DMatrix, DVector};
use twin::effect::Texture;

use crate::{
    input::case::Subject,
    null::{
        interval::Interval,
        model::Model,
        problem::{Component, Problem},
    },
    search::{explanation::Explanation, once, periodic},
    thresholds::{CERTAIN, DOUBT_STEP, UNLIKE},
    unknown::{
        binned::Binned,
        fast::within_stretches,
        remainder::{Setting, attitude_deg, courses, judged},
        slow::{Beside, Slow, Where},
    },
};

/// A slow course that is left.
#[derive(Clone, Debug)]
pub struct Course {
    /// Where.
    pub channels: Vec<usize>,
    /// ln of its odds against nothing.
    pub nats: f64,
    /// Probability that it is there and above its bar.
    pub matters: f64,
}

/// What speaks for one effect of the model.
#[derive(Clone, Copy, Debug)]
pub struct Weight {
    /// Whether the gap of some channel or the attitude grows by more than the user's bar without it.
    pub grows: bool,
    /// \[nats\] that it is worth.
    pub worth: f64,
    /// \[nats\] that the best of the other effects in its channels is worth.
    pub beside: f64,
    /// Part of its energy that the other effects do not take back.
    pub kept: f64,
    /// \[nats\] by which it is likelier than the free course in its channels that does best in its place, its parameters and the search for
    /// when it is on paid for.
    pub over_course: f64,
}

impl Weight {
    /// How far it may have a name, 0 to 1: the gap grows without it or it is certain, and no free course says what it says, and more. A law
    /// that is a little off leaves such a course a few parts in a hundred ([`UNLIKE`]), and as much to an effect that is small beside it. What
    /// other effects take back it does not explain.
    pub fn counts(&self) -> f64 {
        let no_course = self.over_course + UNLIKE * self.worth;
        let is_there = match self.grows {
            true => 1.0,
            false => 1.0 / (1.0 + ((CERTAIN + UNLIKE * self.beside.max(0.0) - self.worth) / DOUBT_STEP).exp()),
        };
        is_there * self.kept / (1.0 + (-no_course).exp())
    }
}

/// What is left beside a reference that is not exact.
pub struct Importance {
    /// By the whole model.
    pub courses: Vec<Course>,
    /// Per channel, energy above its bar that is no course, in squares of noise ([`within_stretches`]).
    pub fast: Vec<f64>,
    /// Of each effect of the model.
    pub effects: Vec<Weight>,
    /// Whether a walk that the model follows is more than the user's bar. It is a free course itself, so nothing else speaks for it.
    pub is_walk_seen: bool,
}

impl Importance {
    /// Of an explanation, of which a perfect one would leave `floor`; `None` where the reference is exact, for what is significant there is
    /// what is there.
    pub fn of(subject: &Subject, problem: &Problem, explanation: &Explanation, floor: &[Vec<f64>]) -> Option<Self> {
        let model = &explanation.model;
        if subject.slow.attitude_sigma_rad <= 0.0 || model.components.is_empty() && !explanation.is_followed() {
            return None;
        }
        let setting = setting(subject, explanation);
        let beside = Beside::of(problem, model, &setting, None)?;
        let left = courses(problem, &beside, &setting, None);
        let channels_of = |effect: usize| -> Vec<usize> {
            let added = problem.contribution(&model.components, &problem.parts(&model.components, effect));
            added.into_iter().map(|(channel, _)| channel).collect()
        };
        let channels: Vec<Vec<usize>> = (0..model.components.len()).map(channels_of).collect();
        let worths: Vec<f64> = (0..channels.len()).map(|effect| beside.worth(effect)).collect();
        let weight = |effect: usize| {
            let is_there = |places: &[usize]| places.iter().any(|channel| channels[effect].contains(channel));
            let is_its = |slow: &&Slow| is_there(&slow.channels);
            let without = courses(problem, &beside, &setting, Some(effect));
            let nats = |slow: &Slow| (slow.place, slow.posterior.log_bayes_factor);
            let beside_it: Vec<(Where, f64)> = left.iter().map(nats).collect();
            let in_its_place: Vec<(Where, f64)> = without.iter().filter(is_its).map(nats).collect();
            let parts = problem.parts(&model.components, effect);
            let others = (0..worths.len()).filter(|other| !parts.contains(other) && is_there(&channels[*other]));
            let worth = worths[effect];
            Weight {
                grows: grows(problem, model, effect, &setting),
                kept: kept(problem, model, effect),
                worth,
                beside: others.map(|other| worths[other]).fold(0.0, f64::max),
                over_course: worth
                    - beside.price(effect)
                    - looked_for(problem, &model.components[effect])
                    - of_course(&in_its_place, &beside_it, without.len()),
            }
        };
        let course = |slow: &Slow| Course {
            channels: slow.channels.clone(),
            nats: slow.posterior.log_bayes_factor,
            matters: judged(problem, slow, &setting, left.len())[1],
        };
        Some(Self {
            courses: left.iter().map(course).collect(),
            fast: within_stretches(problem, model, floor, &setting),
            effects: (0..model.components.len()).map(weight).collect(),
            is_walk_seen: is_seen(problem, &setting, explanation.walk(problem)),
        })
    }
}

/// \[nats\] by which the best of several free courses does better in the place of an effect than beside it: one that is there either way says
/// nothing of the effect. All `several` share even odds with nothing.
fn of_course(in_its_place: &[(Where, f64)], beside_it: &[(Where, f64)], several: usize) -> f64 {
    let above_nothing = |nats: f64| (nats - (several.max(1) as f64).ln()).max(0.0);
    let better = in_its_place.iter().map(|(place, nats)| {
        let same = beside_it.iter().find(|(other, _)| other == place);
        above_nothing(*nats) - same.map_or(0.0, |(_, beside)| above_nothing(*beside))
    });
    better.fold(0.0, f64::max)
}

/// \[nats\] the price of having looked for the time in which an effect is on.
fn looked_for(problem: &Problem, component: &Component) -> f64 {
    match component.span {
        None => 0.0,
        Some(Interval { every_s: None, .. }) => once::price(),
        Some(Interval { every_s: Some(_), .. }) => {
            let (rows, starts_s) = (problem.fitted_rows(), problem.twin.starts_s());
            let ends = rows.first().zip(rows.last());
            periodic::price(ends.map_or(0.0, |(first, last)| starts_s[*last] - starts_s[*first]))
        }
    }
}

/// What an explanation's effect on the scatter leaves to be judged.
pub fn setting<'a>(subject: &'a Subject, explanation: &'a Explanation) -> Setting<'a> {
    let scatter = explanation.scatter.as_ref();
    let scattered = scatter.map_or(&[][..], |scatter| &scatter.channels);
    let wanders = scatter.is_some_and(|scatter| scatter.effect.page().texture == Texture::Walk);
    Setting {
        slow: &subject.slow,
        bars: &subject.bars,
        louder: &explanation.louder,
        scattered,
        wandering: if wanders { scattered } else { &[] },
    }
}

/// Part of an effect's energy, the calibration fitted, that is there with all of the model's: of a zero that is off by what a sensitivity to
/// gravity takes back nearly nothing is.
fn kept(problem: &Problem, model: &Model, effect: usize) -> f64 {
    let components = &model.components;
    let own = problem.contribution(components, &problem.parts(components, effect));
    let every: Vec<usize> = (0..components.len()).collect();
    let mut of_all = problem.contribution(components, &every);
    of_all.retain(|(channel, _)| own.iter().any(|(at, _)| at == channel));
    let energy = |of: &[(usize, DVector<f64>)]| -> f64 {
        let left = of.iter().map(|(channel, values)| problem.frames[*channel].left(values));
        left.map(|left| left.norm_squared()).sum()
    };
    (energy(&of_all) / energy(&own).max(f64::MIN_POSITIVE)).min(1.0)
}

/// Whether the gap of some channel would grow by more than the user's bar without an effect, or the attitude be off by more than that, once the
/// calibration and the other effects are fitted: two that take each other back are nothing.
fn grows(problem: &Problem, model: &Model, effect: usize, setting: &Setting) -> bool {
    let components = &model.components;
    let parts = problem.parts(components, effect);
    let open_of = |other: usize| {
        let parameters = components[other].active.cause.parameters(problem.twin.unit());
        let slopes = problem.slopes(components, other);
        slopes.into_iter().zip(parameters).flat_map(|(slope, parameter)| {
            let of_sigma = move |(channel, column): (usize, DVector<f64>)| (channel, column * parameter.prior_sigma);
            slope.into_iter().map(of_sigma)
        })
    };
    let others = (0..components.len()).filter(|at| !parts.contains(at));
    let open: Vec<(usize, DVector<f64>)> = others.flat_map(open_of).collect();
    let left = |(channel, added): (usize, DVector<f64>)| {
        let mut frame = problem.frames[channel].clone();
        let of_channel = open.iter().filter(|(own, _)| *own == channel);
        let columns: Vec<DVector<f64>> = of_channel.map(|(_, column)| column.clone()).collect();
        if !columns.is_empty() {
            frame.widen(&DMatrix::from_columns(&columns));
        }
        (channel, frame.left(&added))
    };
    is_seen(
        problem,
        setting,
        problem.contribution(components, &parts).into_iter().map(left),
    )
}

/// Whether what is added to some channels, in units of noise at the fitted samples, is more than the user's bar: of the gap of one of them, or of
/// the attitude.
fn is_seen(problem: &Problem, setting: &Setting, added: impl IntoIterator<Item = (usize, DVector<f64>)>) -> bool {
    let bar = (1.0 + setting.bars.gap_sigma).powi(2) - 1.0;
    let mut slow: Vec<(usize, f64)> = Vec::new();
    let mut grows = false;
    for (channel, added) in added {
        let physical = added.component_mul(&problem.frames[channel].weights);
        let energy = Binned::along(problem, channel, 1.0).energy(physical.as_slice());
        slow.push((channel, (energy / added.len() as f64).sqrt()));
        grows |= problem.in_sigmas(channel, &added).norm_squared() > bar * added.len() as f64;
    }
    grows || attitude_deg(problem, &slow) > setting.bars.attitude_deg
}

#[cfg(test)]
mod tests {
    use twin::predict::Kind;

    use super::*;

    fn weight(grows: bool, worth: f64, over_course: f64) -> Weight {
        Weight {
            grows,
            kept: 1.0,
            worth,
            beside: 0.0,
            over_course,
        }
    }

    /// A supply that sinks beside a room in which something turns slowly: the factor is there in the place of a soft iron alone, the rotation
    /// beside it too.
    #[test]
    fn a_course_that_is_there_either_way_says_nothing_of_an_effect() {
        let (factor, turned) = (Where::Factor(Kind::Magnetometer), Where::Rotation);
        let without = [(factor, 28.7), (turned, 11.1)];
        assert!((of_course(&without, &[(turned, 11.2)], 1) - 28.7).abs() < 1e-12);
        assert!((of_course(&without, &[(turned, 11.2), (factor, 20.0)], 1) - 8.7).abs() < 1e-12);
        assert!((of_course(&without, &[], 20) - (28.7 - 20f64.ln())).abs() < 1e-12);
        assert_eq!(of_course(&[(turned, 2.0)], &[], 20), 0.0);
    }

    /// A zero of 0.57 deg/s beside a sensitivity to gravity that took it back, on a healthy recording.
    #[test]
    fn what_another_effect_takes_back_has_no_name() {
        let weight = Weight {
            kept: 0.05,
            ..weight(true, 33.8, 23.6)
        };
        assert!(weight.counts() < 0.1);
    }

    /// Beside a soft iron of 1,267 nats, on a recording that is healthy otherwise, eddy currents had 44 and were not there.
    #[test]
    fn a_few_parts_in_a_hundred_of_another_effect_that_do_not_matter_have_no_name() {
        let eddy = Weight {
            beside: 1267.0,
            ..weight(false, 43.9, 13.0)
        };
        assert!(eddy.counts() < 0.01, "{}", eddy.counts());
        assert!(Weight { grows: true, ..eddy }.counts() > 0.9);
    }

    /// What is certain beside the reference's errors is there, however small; a stand-in for what every recording leaves is worth little there.
    #[test]
    fn what_does_not_matter_has_a_name_if_it_is_certain() {
        assert!(weight(false, 112.6, 122.1).counts() > 0.99);
        assert!(weight(false, -21.5, -25.6).counts() < 0.01);
        assert!(weight(false, 22.5, 12.6).counts() < 0.1);
    }

    /// A supply that sags was a missing set pulse at 270 nats, of which a free course said 18 more.
    #[test]
    fn a_free_course_that_says_more_takes_the_name_and_one_that_says_a_few_parts_in_a_hundred_does_not() {
        assert!(weight(true, 270.0, -18.0).counts() < 0.05);
        assert!(weight(true, 143_670.0, -3.5).counts() > 0.99);
        assert!(weight(true, 1.2, -5.0).counts() < 0.01);
    }
}
