//! Whether what an effect on readings explains matters, where the reference is not exact.
//!
//! In: a model and what is left beside reference, field and calibration with it and without one of its effects
//! ([`crate::unknown::slow::Beside`]). Out: [`Importance`].
//!
//! A real unit is off by a little everywhere, and thousands of samples make any of it significant: a gyro's scale that is off by two of its
//! sigmas is fifty nats and a hundredth of the noise. That is for the calibration, and no name. So a name must explain what would
//! matter without it, by the bars of the remainder: a slow course above its bar, or in some channel a growth of the gap above the user's.
//! Parts of one effect that share channels go together ([`Problem::parts`]): without one of them the others take its place.

use twin::effect::Texture;

use crate::{
    input::case::Subject,
    null::{model::Model, problem::Problem},
    search::explanation::Explanation,
    unknown::{
        remainder::{Setting, courses, judged},
        slow::{Beside, Slow},
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

/// What is left beside a reference that is not exact.
pub struct Importance {
    /// By the whole model.
    pub courses: Vec<Course>,
    /// Per effect of the model, the probability that what it explains matters.
    pub matters: Vec<f64>,
    /// \[nats\] that each is worth.
    pub worth: Vec<f64>,
}

impl Importance {
    /// Of an explanation; `None` where the reference is exact, for what is significant there is what is there.
    pub fn of(subject: &Subject, problem: &Problem, explanation: &Explanation) -> Option<Self> {
        let model = &explanation.model;
        if subject.slow.attitude_sigma_rad <= 0.0 || model.components.is_empty() {
            return None;
        }
        let setting = setting(subject, explanation);
        let beside = Beside::of(problem, model, &setting, None)?;
        let matters = |effect: usize| {
            let channels = problem.contribution(&model.components, &problem.parts(&model.components, effect));
            let is_its = |slow: &&Slow| channels.iter().any(|(channel, _)| slow.channels.contains(channel));
            let without = courses(problem, &beside, &setting, Some(effect));
            let slow = without.iter().filter(is_its);
            let slow = slow.map(|slow| judged(problem, slow, &setting, without.len())[1]);
            slow.fold(f64::from(u8::from(grows(problem, model, effect, &setting))), f64::max)
        };
        let left = courses(problem, &beside, &setting, None);
        let course = |slow: &Slow| Course {
            channels: slow.channels.clone(),
            nats: slow.posterior.log_bayes_factor,
            matters: judged(problem, slow, &setting, left.len())[1],
        };
        Some(Self {
            courses: left.iter().map(course).collect(),
            matters: (0..model.components.len()).map(matters).collect(),
            worth: (0..model.components.len()).map(|effect| beside.worth(effect)).collect(),
        })
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

/// Whether the gap of some channel would grow by more than the user's bar without an effect, once the calibration is fitted.
fn grows(problem: &Problem, model: &Model, effect: usize, setting: &Setting) -> bool {
    let bar = (1.0 + setting.bars.gap_sigma).powi(2) - 1.0;
    problem
        .contribution(&model.components, &problem.parts(&model.components, effect))
        .into_iter()
        .any(|(channel, added)| {
            let left = problem.in_sigmas(channel, &problem.frames[channel].left(&added));
            left.norm_squared() > bar * left.len() as f64
        })
}
