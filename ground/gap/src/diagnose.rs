//! From a case to a diagnosis: every step of the gap's method in its order.
//!
//! In: a [`Subject`] and what to leave out of the library. Out: [`Diagnosis`]. The held-out samples are asked at the end, about
//! a model that no longer changes; if its effects do not shrink their gap, they are withdrawn, and where nothing explains a
//! gap, they say whether it is there too.

use nalgebra::DVector;
use twin::effect::{Texture, WANDERS};

use crate::{
    advise::{
        confusion,
        experiment::advice,
        imitation::{Imitation, imitation},
    },
    correct::correction::Correction,
    holdout::{
        cross_validation::Key,
        events::Events,
        floor::floor,
        judge::Finished,
        remainder,
        shrink::{Shrink, ceiling_percent},
        stages::Stage,
    },
    input::case::Subject,
    library::hypotheses::Library,
    null::{
        model::Model,
        noise::{Noise, noise},
        problem::{Component, Frame, Problem},
    },
    probability::{
        cause::{Cause, share_out},
        doubt::Promised,
        importance::setting,
        outcome::{Outcome, is_unexplained},
        posterior::Believed,
        rows::{STALE, VIBRATION, causes_of_rows},
    },
    search::{explanation::Explanation, odds::alone, readings::attribute, scatter::Scatter},
    thresholds::{CHANCE, MOST_EFFECTS, SAID, UNKNOWN_PRIOR},
    unknown::{
        adequacy::{self, Leftover},
        place::{self, Place, passage::Passage},
        recognised::recognised,
        remainder::{Remainder, Setting},
        traces::{Trace, cells, traces},
        views,
    },
};

/// What a case says.
pub struct Diagnosis {
    /// Root mean square residual on the fit windows, in sigma.
    pub gap: f64,
    /// Judgement of "calibration and noise are enough".
    pub gate: Leftover,
    /// Most share first; empty when the twin needs nothing or nothing can be said.
    pub causes: Vec<Cause>,
    /// Other effects with their probabilities, most first.
    pub alternatives: Vec<(&'static str, f64)>,
    /// Sets this motion cannot tell apart.
    pub indistinguishable: Vec<Vec<&'static str>>,
    /// Probability that what is left matters and no cause explains it.
    pub none_of_these: f64,
    /// What is left beneath what is named, and how large it is.
    pub remainder: Remainder,
    /// Noise of each kind of sensor, as declared and as seen beneath what is named.
    pub noise: Vec<Noise>,
    /// [prior sigmas] by how much the calibration is off without effects, most first.
    pub strains: Vec<(String, f64)>,
    /// What it all comes to.
    pub outcome: Outcome,
    /// What the causes leave.
    pub leftover: Leftover,
    /// Where the gap is.
    pub place: Place,
    /// The held-out gap before and after.
    pub shrink: Shrink,
    /// Percent that the true effect would shrink it; `None` without a cause.
    pub ceiling_percent: Option<f64>,
    /// The held-out gap in calibrated vectors and attitude.
    pub stages: Vec<Stage>,
    /// What the unit can correct of the causes.
    pub correction: Option<Correction>,
    /// What cross-validation says of the causes that are effects on readings.
    pub keys: Vec<(&'static str, Key)>,
    /// How strong they are on the held-out windows.
    pub promises: Vec<Promised>,
    /// Per channel, by how much more it scatters than described, for an effect on the scatter.
    pub louder: Vec<f64>,
    /// Effects that were withdrawn because they do not shrink it, or are many in the same channels and leave something.
    pub withdrawn: Vec<&'static str>,
    /// [nats per effect] what each hypothesis gained alone; for the page.
    pub alone: Vec<(String, f64)>,
    /// Which effects imitate which on this motion.
    pub imitation: Imitation,
    /// Smallest size of each effect that this log would show.
    pub limits: Vec<confusion::Limit>,
    /// The effects as the unit's description would list them.
    pub known: Vec<twin::predict::KnownEffect>,
    /// Residuals of the channels that stand out most.
    pub traces: Vec<Trace>,
    /// Per channel, the gap in each of so many stretches of the fit windows.
    pub cells: Vec<(String, Vec<f64>)>,
    /// The pair most worth telling apart, for planning.
    pub rivals: Option<confusion::Pair>,
}

impl Diagnosis {
    /// Whether something outside the library is likelier needed than not, whatever is named.
    pub fn is_unexplained(&self) -> bool {
        is_unexplained(self.none_of_these)
    }

    /// The next experiment, in words.
    pub fn advice(&self, subject: &Subject) -> String {
        let confirm = self.causes.first().map(|cause| cause.confirm_by);
        advice(subject, self.rivals.as_ref(), confirm, self.outcome == Outcome::Unknown)
    }
}

/// Diagnoses a case. `progress` is told what goes on and how far it is, 0 to 1.
pub fn diagnose(subject: &Subject, withheld: &[String], progress: &dyn Fn(&'static str, f64)) -> Diagnosis {
    let mut withheld = withheld.to_vec();
    let is_asked = |effect: &str| withheld.iter().all(|name| name != effect);
    let by_rows: Vec<Cause> = (causes_of_rows(subject).into_iter())
        .filter(|cause| is_asked(cause.effect))
        .collect();
    withheld.extend(subject.repeats.as_ref().map(|_| STALE.to_owned()));
    let withheld = &withheld[..];
    let mut problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
    let gap = root_mean_square(&problem);
    let mut library = Library::new(&problem, withheld, &|share| progress("effects", share));
    let search = |share| progress("search", share);
    let mut found = attribute(&problem, &mut library, &search);
    let quiet = Model::around(&problem, Vec::new());
    let views = views::views(&problem, &quiet.predicted);
    let gate = adequacy::judge(&views, &quiet.joint, &quiet.fitted, &[], None);
    progress("where", 0.0);
    let mut place = place::locate(&problem, &views, &quiet);

    let chosen = found.chosen.iter().map(|chosen| chosen.hypothesis);
    let causes: Vec<_> = chosen
        .map(|hypothesis| library.hypotheses[hypothesis].cause.clone())
        .collect();
    if causes.iter().any(|cause| problem.retell(cause)) {
        library.reopen(&problem);
        found = attribute(&problem, &mut library, &search);
    }
    let mut explanation = Explanation::of(
        &mut problem,
        &mut library,
        &quiet,
        found,
        withheld,
        &subject.slow,
        &search,
    );
    progress("leftover", 0.0);
    let mut left = match explanation.is_empty() {
        true => gate.clone(),
        false => left_by(&problem, &explanation),
    };

    let before = problem.predictions(&[]);
    let as_described = vec![1.0; problem.frames.len()];
    let floor = floor(&problem, &explanation.model);
    // They stay what they are when frames are weighed anew.
    let (sigmas, steady) = (problem.sigmas.clone(), problem.steady.clone());
    let without = Finished {
        start_s: subject.twin.starts_s(),
        sigmas: &sigmas,
        steady: &steady,
        before: &before,
        recalibrated: &quiet.predicted,
        after: &quiet.predicted,
        louder: &as_described,
        floor: &floor,
        events: None,
    };
    let events = Events::of(&problem, &explanation.model);
    let mut shrink = subject.held.judge(Finished {
        after: &explanation.model.predicted,
        louder: &explanation.louder,
        events: events.as_ref(),
        ..without
    });
    // Beside a reference that is not exact each effect on readings answers for itself (`probability/importance.rs`): every real log has
    // small errors of its own, and a name is none the worse for them. What makes readings scatter is whatever is not understood, so it has to
    // be one of few.
    let is_inexact = subject.slow.attitude_sigma_rad > 0.0;
    let is_doubtful = match explanation.is_followed() {
        // A walk that is followed says between the fitted windows where it is.
        true => shrink.beyond_recalibration[0] <= 0.0,
        false => !shrink.supports_the_effect() || explanation.is_patchwork(left.unknown(UNKNOWN_PRIOR) > SAID),
    };
    let mut withdrawn = Vec::new();
    if shrink.refutes_the_effect() || is_doubtful && !is_inexact {
        withdrawn = explanation.withdraw(&library);
    } else if (is_doubtful || is_belied(subject, explanation.scatter.as_ref()))
        && let Some(name) = explanation.withdraw_scatter(&mut problem, &mut library)
    {
        withdrawn.push(name);
    }
    let is_changed = recognise(subject, &problem, &library, &mut explanation, &quiet)
        || !withdrawn.is_empty() && !explanation.is_empty();
    let events = if is_changed {
        Events::of(&problem, &explanation.model)
    } else {
        events
    };
    if is_changed {
        left = left_by(&problem, &explanation);
        shrink = subject.held.judge(Finished {
            after: &explanation.model.predicted,
            louder: &explanation.louder,
            events: events.as_ref(),
            ..without
        });
    }
    let again = |left: &Leftover, components: &[Component]| {
        let found = left.aspects.first().filter(|_| left.is_doubtful())?;
        progress("again", 0.0);
        (subject.held).recurrence(&subject.twin, &subject.reference, components, &found.what)
    };
    // Without effects what is left is all there was.
    let all_there_was = || {
        let again = again(&gate, &[]);
        (Leftover { again, ..gate.clone() }, subject.held.judge(without))
    };
    if explanation.is_empty() {
        (left, shrink) = all_there_was();
    } else if explanation.scatter.is_none() && events.is_none() {
        // What happens at random does so elsewhere there.
        left.again = again(&left, &explanation.model.components);
    }

    progress("confusion", 0.0);
    let (found, model) = (&explanation.found, &explanation.model);
    let mut believed = Believed::of(
        subject,
        &problem,
        &library,
        &explanation,
        &quiet,
        events.as_ref(),
        &left,
        &floor,
    );
    progress("remainder", 0.0);
    let left_beneath = |causes: &[Cause]| {
        let said = said(&explanation, causes);
        remains(subject, &explanation, causes, &said, events.is_some())
    };
    let remainder = believed.held_against(left_beneath);
    // What rows say by themselves is in no model: what a model leaves and how it shrinks the gap is told of the others alone.
    let is_modelled = !believed.causes.is_empty();
    let is_new = |cause: &Cause| believed.causes.iter().all(|other| other.effect != cause.effect);
    let by_rows = by_rows
        .into_iter()
        .filter(|cause| cause.probability >= SAID && is_new(cause));
    let by_rows: Vec<Cause> = by_rows.collect();
    believed.causes.extend(by_rows);
    let mut alternatives = believed.alternatives(&library, &explanation);
    if !is_modelled && !believed.unnamed.is_empty() {
        // What is not likely enough to be said may be there, or something else.
        (left, shrink) = all_there_was();
    }
    let said = said(&explanation, &believed.causes);
    if !is_modelled && is_inexact {
        // Of a log in which nothing matters they are what every real recording has.
        alternatives
            .iter_mut()
            .for_each(|(_, probability)| *probability *= remainder.matters);
    }
    let none_of_these = remainder.matters * believed.none_is_there();
    let Believed {
        mut causes,
        keys,
        promises,
        ..
    } = believed;
    let is_decided = causes.iter().all(|cause| cause.probability >= SAID);
    share_out(&mut causes);

    let mut once = model.components.iter().filter_map(|component| component.span);
    if is_modelled && let Some(on) = once.find(|on| on.every_s.is_none()) {
        // What the calibration takes up of a cause that comes and goes blurs the edges of the gap.
        place.passage = Some(Passage::of(&problem, on.stretch));
    }
    let correction = (is_modelled && is_decided)
        .then(|| Correction::of(&subject.twin, &said))
        .flatten();
    let finished = if is_modelled {
        Finished {
            after: &model.predicted,
            louder: &explanation.louder,
            events: events.as_ref(),
            ..without
        }
    } else {
        without
    };
    let responses = correction.as_ref().map(|correction| correction.responses.as_slice());
    progress("attitude", 0.0);
    let stages = subject.held.stages(&subject.twin, finished, responses);
    let ceiling = is_modelled.then(|| {
        let parameters = causes.iter().map(|cause| cause.parameters.len()).sum();
        ceiling_percent(
            [shrink.before, shrink.floor],
            parameters,
            explanation.signal_to_noise(&quiet),
        )
    });
    let is_recalibrated = shrink.before - shrink.recalibrated > subject.bars.gap_sigma;
    let likely = alternatives
        .iter()
        .filter(|(_, probability)| *probability > CHANCE)
        .map(|(name, _)| *name);
    let told: Vec<&str> = causes.iter().map(|cause| cause.effect).chain(likely).collect();
    let outcome = Outcome::of(causes.len(), remainder.matters, none_of_these, is_recalibrated);
    Diagnosis {
        place,
        ceiling_percent: ceiling,
        stages,
        correction,
        keys,
        promises,
        louder: finished.louder.to_vec(),
        noise: noise(&problem, finished.after, &subject.repeated),
        gap,
        gate,
        alternatives,
        indistinguishable: confusion::sets(&library, found),
        outcome,
        none_of_these,
        remainder,
        strains: strains(&problem, &quiet),
        leftover: left,
        shrink,
        alone: alone(&library, found),
        imitation: imitation(&library, found),
        limits: confusion::limits(&library),
        known: (said.iter())
            // What comes and goes is no property of the unit.
            .filter(|component| is_decided && component.span.is_none())
            .map(|component| component.active.to_known())
            .collect(),
        rivals: confusion::pair(&library, found, &told),
        traces: traces(&problem, model),
        cells: cells(&problem, &views),
        causes,
        withdrawn,
    }
}

/// Whether rows belie a vibration that wanders, on for half of the time: beside a reference that follows what is slower, half of it at least has to
/// be faster. A line speaks for itself, wherever it is folded to.
fn is_belied(subject: &Subject, scatter: Option<&Scatter>) -> bool {
    let is_it = |scatter: &&Scatter| scatter.effect.page().name == VIBRATION && scatter.variant == WANDERS;
    let vibration = scatter.filter(is_it);
    let Some((scatter, fast)) = vibration.zip(subject.fast.as_ref()) else {
        return false;
    };
    let channels = scatter.channels.iter().zip(&scatter.thetas);
    let of_channel = |(channel, theta): (&usize, &Vec<f64>)| {
        let own = &subject.twin.unit().channels[*channel];
        Some([
            0.25 * theta[0].powi(2),
            fast.mean_squares[*channel]? / own.sigma().powi(2),
        ])
    };
    let [said, seen] =
        (channels.filter_map(of_channel)).fold([0.0; 2], |[said, seen], [own, rows]| [said + own, seen + rows]);
    said > 2.0 * seen
}

/// Takes in what is recognised beneath what an explanation leaves, where the reference is not exact; whether anything was.
fn recognise(
    subject: &Subject,
    problem: &Problem,
    library: &Library,
    explanation: &mut Explanation,
    quiet: &Model,
) -> bool {
    if subject.slow.attitude_sigma_rad <= 0.0 {
        return false;
    }
    let before = explanation.found.chosen.len();
    while explanation.found.chosen.len() < MOST_EFFECTS {
        let model = if explanation.found.chosen.is_empty() {
            quiet
        } else {
            &explanation.model
        };
        let Some(chosen) = recognised(
            problem,
            library,
            model,
            &explanation.found.chosen,
            &setting(subject, explanation),
        ) else {
            break;
        };
        explanation.add(problem, library, chosen);
    }
    explanation.found.chosen.len() > before
}

/// The effects on readings that are named, without those that were found and are not likely enough.
fn said(explanation: &Explanation, causes: &[Cause]) -> Vec<Component> {
    let is_said = |component: &&Component| {
        let cause = &component.active.cause;
        let is_it =
            |said: &Cause| said.effect == cause.effect.page().name && said.locality == cause.locality.to_string();
        causes.iter().any(is_it)
    };
    explanation.model.components.iter().filter(is_said).cloned().collect()
}

/// What is left of the log beneath the causes that are named, of which these are on readings; `is_random` where they happen at instants of
/// their own.
fn remains(
    subject: &Subject,
    explanation: &Explanation,
    causes: &[Cause],
    said: &[Component],
    is_random: bool,
) -> Remainder {
    let is_named = |scatter: &&Scatter| causes.iter().any(|cause| cause.effect == scatter.effect.page().name);
    let scatter = explanation.scatter.as_ref().filter(is_named);
    let scattered = scatter.map_or(&[][..], |scatter| &scatter.channels);
    // Of a walk, and of what makes other readings of those beneath it, a mean over time is no remainder.
    let is_hidden = |scatter: &Scatter| scatter.effect.page().texture == Texture::Walk || !scatter.beneath.is_empty();
    let wanders = scatter.is_some_and(is_hidden);
    let as_described = vec![1.0; subject.twin.unit().channels.len()];
    let setting = Setting {
        slow: &subject.slow,
        bars: &subject.bars,
        louder: scatter.map_or(&as_described, |_| &explanation.louder),
        scattered,
        wandering: if wanders { scattered } else { &[] },
    };
    remainder::of_log(subject, said, &setting, !causes.is_empty() && is_random)
}

/// By how many prior sigmas a model moves the calibration, most first.
fn strains(problem: &Problem, model: &Model) -> Vec<(String, f64)> {
    let channels = problem.frames.iter().zip(&model.fitted.nuisance);
    let of_channel = |(frame, found): (&Frame, &DVector<f64>)| {
        let names = frame.nuisance_names.iter().map(|(name, _)| name.clone());
        names
            .zip(found.iter().copied().collect::<Vec<f64>>())
            .collect::<Vec<_>>()
    };
    let mut strains: Vec<(String, f64)> = channels.flat_map(of_channel).collect();
    strains.sort_by(|one, other| other.1.abs().total_cmp(&one.1.abs()));
    strains
}

/// What an explanation leaves.
fn left_by(problem: &Problem, explanation: &Explanation) -> Leftover {
    let model = &explanation.model;
    let disturb = explanation.disturb(problem);
    adequacy::judge(
        &views::views(problem, &explanation.beneath),
        &model.joint,
        &model.fitted,
        &views::suspects(problem, model),
        (disturb.as_ref().zip(explanation.scatter.as_ref())).map(|(of, scatter)| adequacy::Disturb {
            channels: &scatter.channels,
            of,
        }),
    )
}

fn root_mean_square(problem: &Problem) -> f64 {
    let (mut energy, mut samples) = (0.0, 0);
    for (channel, frame) in problem.frames.iter().enumerate() {
        let residual = problem.residual(channel, &[]);
        energy += problem.in_sigmas(channel, &residual).norm_squared();
        samples += frame.series.rows.len();
    }
    (energy / samples.max(1) as f64).sqrt()
}
