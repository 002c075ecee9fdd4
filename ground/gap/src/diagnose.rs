//! From a case to a diagnosis: every step of the gap's method in its order.
//!
//! In: a [`Subject`] and what to leave out of the library. Out: [`Diagnosis`]. The held-out samples are asked once, at the end,
//! about a model that no longer changes; if its effects do not shrink their gap, they are withdrawn.

use crate::{
    attribute::{Chosen, attribute},
    case::Subject,
    cause::{Cause, alone, alternatives, cause_of_scatter, causes_of, probability_of_any, share_out},
    confusion, contribution,
    correction::Correction,
    crossval::{self, Key},
    held::{Finished, Shrink, ceiling_percent, stages::Stage},
    imitation::{Imitation, imitation},
    leftover::{self, Leftover},
    library::Library,
    model::Model,
    place::{self, Place},
    problem::Problem,
    scatter::{Scatter, scatters},
    sight, temper,
    trace::{Trace, cells, traces},
};

/// [nats] an effect on the scatter must gain.
const SCATTER_MARGIN: f64 = 3.0;

/// Probability from which an effect is named.
const SAID: f64 = 0.5;

/// Causes that are believed at once. More of them together are a patchwork for one effect the library does not have.
const MOST_CAUSES: usize = 3;

/// Prior probability that a unit has something the library does not.
const UNKNOWN_PRIOR: f64 = 0.05;

/// The effect on the scatter that changes nothing but its size.
const LOUDER: &str = "noise-level";

/// The effect on the scatter that is slow, and that effects of time and temperature imitate piece by piece.
const WANDERING: &str = "gyro-bias-walk";

/// Steps from which a walk is told from anything else: the rows of a table are fewer, and no walk.
const STEPS: usize = 100;

/// [nats] at which a name is as likely wrong as right, and the step that multiplies the odds by e: what no effect of the
/// library describes looks a little like one of them. The wrong names of the dealt cases (TRIALS.md) had 8 to 26 nats; an
/// effect of marginal signal-to-noise ratio 8 has 32 before its prior odds.
const DOUBTED: f64 = 20.0;
const DOUBT_STEP: f64 = 4.0;

/// Energy that is left over that explained at which a name is as likely wrong as right. An effect that differs a little
/// from its law leaves less than a part in a hundred; another effect's law, which happens to be like it, leaves more.
const UNLIKE: f64 = 0.02;

/// Gain over that of the strongest effect at which a second one is as likely what the first one's law leaves over.
const REMAINDER: f64 = 0.005;

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
    /// Probability that something outside the library is needed.
    pub none_of_these: f64,
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
    /// Per channel, by how much more it scatters than described, for an effect on the scatter.
    pub louder: Vec<f64>,
    /// Effects that were withdrawn because they do not shrink it.
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
    /// Per channel, the gap in each of [`STRETCHES`] stretches of the fit windows.
    pub cells: Vec<(String, Vec<f64>)>,
    /// The pair most worth telling apart, for planning.
    pub rivals: Option<confusion::Pair>,
}

/// Diagnoses a case. `progress` is told what goes on and how far it is, 0 to 1.
pub fn diagnose(subject: &Subject, withheld: &[String], progress: &dyn Fn(&'static str, f64)) -> Diagnosis {
    let mut problem = Problem::new(&subject.twin, &subject.fit, &subject.accuracy);
    let gap = root_mean_square(&problem);
    let mut library = Library::new(&problem, withheld, &|share| progress("effects", share));
    let mut found = attribute(&problem, &mut library, &|share| progress("search", share));
    let quiet = Model::around(&problem, &library, Vec::new());
    let views = sight::views(&problem);
    let gate = leftover::judge(&views, &quiet.joint, &quiet.fitted, &[]);
    progress("where", 0.0);
    let place = place::locate(&problem, &quiet);
    let mut first = Model::around(&problem, &library, found.model(&library));
    let mut scatter = best_scatter(&problem, &first, withheld);
    // What wanders at random looks like a little of everything: if that alone says more than all that was chosen, it is that.
    let gains = |chosen: &[Chosen]| chosen.iter().map(|chosen| chosen.gain).sum::<f64>();
    let at_random = best_scatter(&problem, &quiet, withheld).filter(|one| {
        let steps = |channel: &usize| problem.frames[*channel].series.rows.len();
        !found.chosen.is_empty()
            && one.channels.iter().map(steps).all(|steps| steps >= STEPS)
            && one.effect.page().name == WANDERING
            && one.gain > gains(&found.chosen) + scatter.as_ref().map_or(0.0, |scatter| scatter.gain)
    });
    let is_random = at_random.is_some();
    if is_random {
        found.chosen.clear();
        scatter = at_random;
        first = Model::around(&problem, &library, Vec::new());
    }
    let mut sigmas_after = problem.sigmas.clone();
    let loud = scatter.as_ref().map_or_else(
        || vec![1.0; problem.frames.len()],
        |scatter| factors(&problem, &first, scatter),
    );
    sigmas_after
        .iter_mut()
        .zip(&loud)
        .for_each(|(sigma, factor)| *sigma *= factor);
    let mut tempered = temper::factors(&first.fitted.rest);
    tempered
        .iter_mut()
        .zip(&loud)
        .filter(|(_, loud)| **loud != 1.0)
        .for_each(|(tempered, _)| *tempered = 1.0);
    let both: Vec<f64> = loud
        .iter()
        .zip(&tempered)
        .map(|(loud, tempered)| loud * tempered)
        .collect();
    if both.iter().any(|factor| *factor != 1.0) {
        // The noise as found, then everything else anew with it.
        reweigh(&mut problem, &mut library, &both);
        if !is_random {
            found = attribute(&problem, &mut library, &|share| progress("search", share));
        }
    }
    let sought = distinct(&library, &found.chosen);
    let (kept, mut refused): (Vec<Chosen>, Vec<Chosen>) = std::mem::take(&mut found.chosen)
        .into_iter()
        .partition(|chosen| probability_of_any(&library, chosen) >= SAID);
    let is_refused = gains(&refused) > gains(&kept);
    found.chosen = kept;
    // What is left is judged with the noise as described, or a misfit would excuse itself.
    let back: Vec<f64> = tempered.iter().map(|factor| 1.0 / factor).collect();
    reweigh(&mut problem, &mut library, &back);
    let model = Model::around(&problem, &library, found.model(&library));
    if scatter.is_some() && !is_random {
        scatter = best_scatter(&problem, &model, withheld);
    }
    progress("leftover", 0.0);
    // Louder white noise is in the weights by now, so that its channels are judged like any other.
    let scattered: Vec<usize> = scatter
        .iter()
        .filter(|scatter| scatter.effect.page().name != LOUDER)
        .flat_map(|scatter| scatter.channels.clone())
        .collect();
    let mut left = if found.chosen.is_empty() && scatter.is_none() {
        gate.clone()
    } else {
        leftover::judge(&sight::views(&problem), &model.joint, &model.fitted, &scattered)
    };
    let before: Vec<Vec<f64>> = (0..problem.frames.len())
        .map(|channel| problem.predict(channel, &[]))
        .collect();
    let finished = |after, sigmas_after| Finished {
        start_s: subject.twin.starts_s(),
        sigmas: &problem.sigmas,
        before: &before,
        recalibrated: &quiet.predicted,
        after,
        sigmas_after,
    };
    let mut shrink = subject.held.judge(finished(&model.predicted, &sigmas_after));
    let mut withdrawn = Vec::new();
    let is_smaller = shrink.supports_the_effect();
    let has_effect = !found.chosen.is_empty() || scatter.is_some();
    let is_patchwork = sought + usize::from(scatter.is_some()) > MOST_CAUSES;
    if has_effect && (!is_smaller || is_patchwork || is_refused) {
        withdrawn.extend(
            found
                .chosen
                .iter()
                .map(|chosen| library.hypotheses[chosen.hypothesis].effect()),
        );
        withdrawn.extend(scatter.iter().map(|scatter| scatter.effect.page().name));
        refused.append(&mut found.chosen);
        scatter = None;
    }
    if found.chosen.is_empty() && scatter.is_none() {
        // Without the effects what is left is all there was.
        left = gate.clone();
        shrink = subject.held.judge(finished(&quiet.predicted, &problem.sigmas));
    }
    progress("confusion", 0.0);
    let unknown = left.unknown(UNKNOWN_PRIOR);
    // Louder noise takes in whatever is there: that it does is no sign of its law.
    let louder = scatter.iter().filter(|scatter| scatter.effect.page().name == LOUDER);
    let by_scatter: f64 = scatter.iter().map(|scatter| 2.0 * scatter.gain).sum();
    let explained = match louder.flat_map(|scatter| scatter.channels.clone()).collect::<Vec<_>>() {
        louder if louder.is_empty() => explained_energy(&quiet, &model, &scattered) + by_scatter,
        louder => explained_energy(&quiet, &model, &louder),
    };
    let mut causes = causes_of(&problem, &library, &found);
    contribution::settle(&problem, &library, &found, &mut causes);
    let keys = second_keys(&problem, &library, &model, &mut causes);
    causes.extend(scatter.as_ref().map(|scatter| cause_of_scatter(subject, scatter)));
    let unlike = left.energy() / (left.energy() + UNLIKE * explained).max(f64::MIN_POSITIVE);
    let trust = 1.0 - unknown * unlike;
    let is_no_chance = |gain: f64| 1.0 / (1.0 + ((DOUBTED - gain) / DOUBT_STEP).exp());
    let strongest = causes.iter().map(|cause| cause.gain).fold(0.0, f64::max);
    let is_no_remainder = |gain: f64| {
        if gain < strongest {
            gain / (gain + REMAINDER * strongest)
        } else {
            1.0
        }
    };
    for cause in &mut causes {
        cause.probability *= trust * is_no_chance(cause.gain) * is_no_remainder(cause.gain);
    }
    // One of a set that cannot be told apart is there, but none of them is likelier than not: no name.
    let (mut causes, unnamed): (Vec<Cause>, Vec<Cause>) =
        causes.into_iter().partition(|cause| cause.probability >= SAID);
    share_out(&mut causes);
    let mut alternatives = alternatives(&library, &found, &refused);
    let trust_in_others = if found.chosen.is_empty() { 1.0 - unknown } else { trust };
    alternatives
        .iter_mut()
        .for_each(|(_, probability)| *probability *= trust_in_others);
    alternatives.extend(unnamed.iter().map(|cause| (cause.effect, cause.probability)));
    alternatives.sort_by(|one, other| other.1.total_cmp(&one.1));
    alternatives.dedup_by_key(|(name, _)| *name);
    let is_named = !causes.is_empty();
    let correction = is_named
        .then(|| Correction::of(&subject.twin, &model.components))
        .flatten();
    let (after, sigmas_after) = if is_named {
        (&model.predicted, &sigmas_after)
    } else {
        (&quiet.predicted, &problem.sigmas)
    };
    let responses = correction.as_ref().map(|correction| correction.responses.as_slice());
    progress("attitude", 0.0);
    let stages = subject
        .held
        .stages(&subject.twin, finished(after, sigmas_after), responses);
    let ceiling = is_named.then(|| {
        let parameters = causes.iter().map(|cause| cause.parameters.len()).sum();
        let snr = (contribution::left(&quiet) - contribution::left(&model))
            .max(0.0)
            .sqrt();
        ceiling_percent(shrink.before, parameters, snr)
    });
    Diagnosis {
        place,
        ceiling_percent: ceiling,
        stages,
        correction,
        keys,
        louder: sigmas_after
            .iter()
            .zip(&problem.sigmas)
            .map(|(after, before)| after / before)
            .collect(),
        gap,
        gate,
        alternatives,
        indistinguishable: confusion::sets(&library, &found),
        none_of_these: unknown,
        leftover: left,
        shrink,
        alone: alone(&library, &found),
        imitation: imitation(&library, &found),
        limits: confusion::limits(&library),
        known: model
            .components
            .iter()
            // What comes and goes is no property of the unit.
            .filter(|component| is_named && component.span.is_none())
            .map(|component| component.active.to_known())
            .collect(),
        rivals: confusion::pair(&library, &found),
        traces: traces(&problem, &model),
        cells: cells(&problem, &views),
        causes,
        withdrawn,
    }
}

fn root_mean_square(problem: &Problem) -> f64 {
    let (mut energy, mut samples) = (0.0, 0);
    for (channel, frame) in problem.frames.iter().enumerate() {
        let scale = frame.weight_sigma / problem.sigmas[channel];
        energy += problem.residual(channel, &[]).norm_squared() * scale * scale;
        samples += frame.series.rows.len();
    }
    (energy / samples.max(1) as f64).sqrt()
}

/// What cross-validation says of the model's effects; the causes, which are those in their order, are believed no more.
fn second_keys(problem: &Problem, library: &Library, model: &Model, causes: &mut [Cause]) -> Vec<(&'static str, Key)> {
    if causes.len() != model.components.len() {
        // They were withdrawn.
        return Vec::new();
    }
    let keys = crossval::keys(problem, library, model).into_iter();
    let said = keys.zip(causes).filter_map(|(key, cause)| {
        let key = key?;
        cause.probability = cause.probability.min(key.confidence());
        Some((cause.effect, key))
    });
    said.collect()
}

/// How many effects are chosen: packets lost at three instants are one.
fn distinct(library: &Library, chosen: &[Chosen]) -> usize {
    let names: std::collections::BTreeSet<&str> = chosen
        .iter()
        .map(|chosen| library.hypotheses[chosen.hypothesis].effect())
        .collect();
    names.len()
}

/// Takes the noise of each channel for so many times what it was.
fn reweigh(problem: &mut Problem, library: &mut Library, factors: &[f64]) {
    if factors.iter().all(|factor| *factor == 1.0) {
        return;
    }
    problem.reweigh(factors);
    let inverse: Vec<f64> = factors.iter().map(|factor| 1.0 / factor).collect();
    library.products.reweigh(problem, &inverse);
}

fn best_scatter(problem: &Problem, model: &Model, withheld: &[String]) -> Option<Scatter> {
    let all = scatters(problem, &model.predicted, withheld);
    all.into_iter().next().filter(|scatter| scatter.gain > SCATTER_MARGIN)
}

/// How much more each channel scatters than the twin has it; 1 where the effect is not.
fn factors(problem: &Problem, model: &Model, scatter: &Scatter) -> Vec<f64> {
    let energies = model.energies();
    let factor = |channel: usize| {
        let samples = problem.frames[channel].series.rows.len().max(1) as f64;
        let is_in = scatter.channels.contains(&channel);
        if is_in {
            (energies[channel] / samples).sqrt().clamp(0.1, 1000.0)
        } else {
            1.0
        }
    };
    (0..problem.frames.len()).map(factor).collect()
}

/// Energy that a model takes off what calibration and noise leave, in squares of noise; of channels not in `scattered`.
fn explained_energy(quiet: &Model, model: &Model, scattered: &[usize]) -> f64 {
    let energy = |model: &Model| -> f64 {
        let channels = model.energies().into_iter().zip(&model.fitted.nuisance).enumerate();
        channels
            .filter(|(channel, _)| !scattered.contains(channel))
            .map(|(_, (energy, open))| energy + open.norm_squared())
            .sum()
    };
    (energy(quiet) - energy(model)).max(0.0)
}
