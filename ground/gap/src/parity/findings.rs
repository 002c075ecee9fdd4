//! What parity comes to: which effects are said, where the gap is, what is left.
//!
//! In: a [`Flight`]. Out: [`Findings`]. Everything that is fitted rests on the fit windows; how far a name is believed, on the held-out
//! windows too.
//!
//! The gap is the root mean square of what a packet keeps once motion and calibration are marginalised: over degrees of
//! freedom, so that 1 is noise and calibration alone. Beyond [`PARITY_GAP`], or with a calibration that is off by more than chance,
//! something is there, or the smoothed motion did not come near enough to the true one: both are said in one sentence, for one
//! log cannot tell them apart.
//!
//! Refuses a unit whose sensors are no more than what a motion has: one plate. Then parity is empty.

use nalgebra::DVector;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use twin::{effect::Nature, predict::Kind};

use crate::{
    holdout::strength::Promise,
    input::{case::CaseError, reference::Reference},
    library::hypotheses::Library,
    null::{
        evidence::LARGEST_SIZE,
        problem::{Component, Problem},
    },
    parity::{
        again, beforehand,
        chips::{self, Beside},
        flight::Flight,
        followed::{Beforehand, Followed},
        name::{By, Fitted, Name},
        nulls,
        packet::Motion,
        phases::shown,
        search::{self, First, Free, Offered, residual_of},
        smoothed::{Left, Second, promises, strengths, walked_on},
        space::{Elimination, Projected, Space, gap},
        visible::{self, Row},
        walk,
    },
    probability::outcome::Outcome,
    thresholds::{CHANCE, LISTED, MATTERS_SIGMA, PARITY_FREE, PARITY_GAP, SAID, STRENGTH_SHOWN, UNKNOWN_PRIOR},
};

/// A channel of the gap.
#[derive(Clone, Debug)]
pub struct Place {
    /// Which.
    pub name: String,
    /// \[sigma\] of what the others do not explain.
    pub gap: f64,
    /// Whether it is larger than chance leaves any channel of a healthy log, and large enough to matter.
    pub stands_out: bool,
}

impl Place {
    /// Of the energy that a channel keeps and its degrees of freedom. Of noise the energy has a chi-square law, and the channel is
    /// one of so many that are looked at (Bonferroni).
    fn of(name: String, (energy, free): (f64, f64), channels: usize) -> Self {
        let gap = (energy / free.max(1.0)).max(0.0).sqrt();
        let chance = ChiSquared::new(free).map_or(1.0, |law| law.sf(energy));
        let is_beyond = chance * (channels as f64) < CHANCE;
        Self {
            name,
            gap,
            stands_out: is_beyond && gap > 1.0 + MATTERS_SIGMA,
        }
    }
}

/// Everything that is said.
pub struct Findings {
    /// Packets of the fit windows that were used.
    pub rows: usize,
    /// Degrees of freedom a packet that the motion leaves: gyros, accelerometers, magnetometers, thermometers.
    pub free: [f64; 4],
    /// Channels of a part that the motion is made without.
    pub bending: Vec<usize>,
    /// Share of the rows after which one lost packet would be found; none where they were not looked for.
    pub loss_shown: Option<f64>,
    /// \[sigma\] before anything is named, and after.
    pub gap: [f64; 2],
    /// Each channel, before.
    pub channels: Vec<Place>,
    /// What can be seen.
    pub visible: Vec<Row>,
    /// Each chip of several beside the first.
    pub chips: Vec<Beside>,
    /// Likeliest first.
    pub names: Vec<Name>,
    /// Other effects with their probabilities.
    pub alternatives: Vec<(&'static str, f64)>,
    /// Probability that something is there that is not named.
    pub none_of_these: f64,
    /// What it comes to.
    pub outcome: Outcome,
    /// What is named by the readings, wherever it may be.
    pub free_effects: Vec<Free>,
}

impl Findings {
    /// Of a flight.
    ///
    /// # Errors
    /// When the unit has no redundancy, or its description names an effect there is not.
    pub fn of(flight: &Flight, withheld: &[String], progress: &dyn Fn(&'static str, f64)) -> Result<Self, CaseError> {
        let beforehand = beforehand::look(flight, withheld)?;
        let followed = Followed::of(flight, &flight.log, &beforehand);
        Self::along(flight, withheld, &beforehand, &followed, progress)
    }

    /// Of a flight whose motion is followed, and of which this is known.
    ///
    /// # Errors
    /// When the unit has no redundancy, or its description names an effect there is not.
    pub fn along(
        flight: &Flight,
        withheld: &[String],
        beforehand: &Beforehand,
        followed: &Followed,
        progress: &dyn Fn(&'static str, f64),
    ) -> Result<Self, CaseError> {
        let (twin, fit, reference) = (followed.twin_of_course()?, followed.fit(), Reference::default());
        let problem = Problem::new(&twin, &fit, &reference);
        let motion = Motion::of(&problem, &followed.course);
        let free = free(&problem, &motion);
        if free[..3].iter().sum::<f64>() < PARITY_FREE {
            return Err(empty(flight, free));
        }
        let mut library = Library::new(&problem, withheld, &|share| progress("effects", share));
        walk::offer(&problem, &mut library, withheld);
        let offered = Offered::of(&problem, &library);
        let nulls = nulls::columns(&problem, &library);
        let (space, opened) = Space::among(&problem, &motion, nulls, &offered.columns());
        let residual = projected(&space, &[]);
        progress("visible", 0.0);
        let mut seen = search::look(&space, &library, (&offered, &opened), &residual, &|share| {
            progress("visible", share);
        });
        // The second look needs as much.
        drop((offered, opened));
        let mut visible = visible::table(&library.hypotheses, &seen);
        visible::add_loss(&mut visible, beforehand.loss_shown);
        again::take(&space, &mut library, &residual, &mut seen);
        let chosen = search::choose(&space, &mut library, &residual, &mut seen, First::default(), &|share| {
            progress("search", share);
        });
        let mut rivals = search::rivals(&library, &chosen);
        let by_parity = search::said(&chosen).into_iter();
        let mut causes: Vec<(Name, Fitted)> = by_parity
            .map(|one| Name::of(&problem, &library, one, By::Parity))
            .collect();
        drop(library);
        let mut smoothed: Vec<Left> = Vec::new();
        let named: Vec<Fitted> = causes.iter().map(|(_, fitted)| fitted.clone()).collect();
        if let Some(second) = Second::look(followed, withheld, &named, progress)? {
            visible::add(&mut visible, &second.visible);
            rivals.extend(second.rivals);
            let told = causes.iter_mut().zip(second.told);
            for ((name, fitted), (told, anew)) in told.filter_map(|(own, told)| Some((own, told?))) {
                // That it is this effect, and how surely, parity says.
                let (probability, gain, snr) = (name.probability, name.gain, name.snr);
                (*name, *fitted) = (
                    Name {
                        probability,
                        gain,
                        snr,
                        ..told
                    },
                    anew,
                );
            }
            causes.extend(second.names);
            smoothed = second.left;
        }
        let doubts = weigh(flight, beforehand, &space, &mut causes, progress)?;
        rivals.extend(causes.iter().map(|(name, _)| (name.effect, name.probability)));
        let mut is_believed = true;
        causes.retain(|(name, _)| {
            // What is found beside something that is not there was not found.
            is_believed &= name.probability >= SAID;
            is_believed
        });
        let model: Vec<Component> = causes.iter().map(|(_, (component, _))| component.clone()).collect();
        let free_effects = (causes.iter())
            .flat_map(|(name, (component, _))| Free::at_all(component, &name.elsewhere))
            .collect();
        for (at, (name, _)) in causes.iter_mut().enumerate() {
            name.alone = shown::only_in(&problem, &model, at, &flight.phases);
        }
        let kept = space.kept(&residual);
        let before = gap(&kept);
        let left = Left::of(&space, &projected(&space, &model));
        // About the smoothed motion only where a name rests on it: without one its prior may leave something by itself.
        let is_by_smoothing = causes.iter().any(|(name, _)| name.by == By::Smoothing);
        let about = smoothed
            .get(causes.len().saturating_sub(named.len()))
            .filter(|_| is_by_smoothing);
        let is_unexplained = [Some(&left), about].into_iter().flatten().any(is_unexplained);
        let names: Vec<Name> = (beforehand.found.iter())
            .map(Name::beforehand)
            .chain(causes.into_iter().map(|(name, _)| name))
            .collect();
        rivals.retain(|(name, probability)| *probability >= LISTED && names.iter().all(|own| own.effect != *name));
        rivals.sort_by(|one, other| other.1.total_cmp(&one.1));
        let mut alternatives: Vec<(&'static str, f64)> = Vec::new();
        for rival in rivals {
            if alternatives.iter().all(|(name, _)| *name != rival.0) {
                alternatives.push(rival);
            }
        }
        let none_of_these = if is_unexplained {
            1.0 - UNKNOWN_PRIOR
        } else {
            UNKNOWN_PRIOR.max(doubts.broken)
        };
        Ok(Self {
            rows: problem.twin.starts_s().len(),
            free,
            bending: beforehand.bending.clone(),
            loss_shown: beforehand.loss_shown,
            channels: (twin.unit().channels.iter().zip(&kept))
                .map(|(channel, own)| Place::of(channel.name.clone(), *own, kept.len()))
                .collect(),
            outcome: Outcome::of(names.len(), none_of_these.max(doubts.untold), none_of_these, false),
            gap: [before, left.gap],
            chips: chips::look(&flight.unit, &flight.whole),
            visible,
            names,
            alternatives,
            none_of_these,
            free_effects,
        })
    }
}

/// What is believed less.
#[derive(Default)]
struct Doubts {
    /// Probability that the held-out windows refute one that parity names, and something else was taken for it.
    broken: f64,
    /// How far the first one that is not believed would be, if it is one that nobody refutes and no held-out window shows.
    untold: f64,
}

/// Believes causes as far as the held-out windows, and of those that smoothing alone names parity too, keep what they promise. What a walk came to
/// promises nothing there, but it goes on: they have one of their own, or not.
fn weigh(
    flight: &Flight,
    beforehand: &Beforehand,
    parity: &Space,
    causes: &mut [(Name, Fitted)],
    progress: &dyn Fn(&'static str, f64),
) -> Result<Doubts, CaseError> {
    if causes.is_empty() {
        return Ok(Doubts::default());
    }
    let fitted: Vec<Fitted> = causes.iter().map(|(_, fitted)| fitted.clone()).collect();
    let mut walked = vec![None; fitted.len()];
    let held = match &flight.held {
        Some(log) => {
            let held = Followed::of(flight, log, beforehand);
            let promises = promises(&held, &fitted, &|share| progress("held out", share))?;
            let model: Vec<Component> = fitted.iter().map(|(component, _)| component.clone()).collect();
            for (at, walked) in walked.iter_mut().enumerate() {
                let active = &model[at].active;
                if active.cause.effect.page().nature == Nature::Spread {
                    *walked = walked_on(&held, &model[..at], active)?;
                }
            }
            promises
        }
        None => vec![None; fitted.len()],
    };
    let by_parity = strengths(parity, &DVector::zeros(0), &fitted);
    let (mut kept, mut first_untold) = (1.0, None);
    for ((name, _), ((held, by_parity), walked)) in causes.iter_mut().zip(held.into_iter().zip(by_parity).zip(walked)) {
        let believed = name.probability;
        name.promise = held;
        name.probability *= match walked {
            Some(nats) => walks_on(name.by, nats),
            None => confidence(name.by, held, by_parity),
        };
        if name.by == By::Parity {
            kept *= 1.0 - (believed - name.probability);
        }
        if first_untold.is_none() && name.probability < SAID {
            let is_shown = held.is_some_and(is_shown) || walked.is_some();
            let untold = if is_shown { 0.0 } else { name.probability / SAID };
            first_untold = Some(untold);
        }
    }
    Ok(Doubts {
        broken: 1.0 - kept,
        untold: first_untold.unwrap_or(0.0),
    })
}

/// Whether a promise is known well enough to say anything.
fn is_shown(promise: Promise) -> bool {
    promise.sigma <= STRENGTH_SHOWN
}

/// How far a cause is believed that is as strong as this on the held-out windows and by parity. What parity names, the held-out
/// windows may refute. What smoothing alone names, they must show as well, and parity may refute it too.
pub fn confidence(by: By, held: Option<Promise>, by_parity: Option<Promise>) -> f64 {
    let of = |promise: Option<Promise>| promise.map(|promise| promise.confidence());
    match by {
        By::Codes | By::Axes | By::Turns => 1.0,
        By::Parity => of(held).unwrap_or(1.0),
        By::Smoothing => of(held.filter(|held| is_shown(*held))).unwrap_or(SAID) * of(by_parity).unwrap_or(1.0),
    }
}

/// How far a walk is believed that gains so many nats on the held-out windows: as likely as not where they show nothing. What parity names they may
/// refute; of what smoothing alone names they have to show something.
fn walks_on(by: By, nats: f64) -> f64 {
    let goes_on = 1.0 / (1.0 + (-nats).exp());
    match by {
        By::Smoothing => goes_on,
        By::Codes | By::Axes | By::Turns | By::Parity => (2.0 * goes_on).min(1.0),
    }
}

fn empty(flight: &Flight, free: [f64; 4]) -> CaseError {
    let problem = format!(
        "are as few as the unknowns of a motion: gyros, accelerometers and magnetometers together keep {:.2} degrees of freedom a \
         packet. Parity is empty, nothing can be said without a reference; give a motion, the channels of further plates, or three \
         gyros and three accelerometers of one at 20 Hz or more",
        free[..3].iter().sum::<f64>()
    );
    CaseError::key(&flight.opened.path(&flight.opened.text.unit), "channels", problem)
}

/// Degrees of freedom a packet that the motion leaves to gyros, accelerometers, magnetometers and thermometers.
fn free(problem: &Problem, motion: &Motion) -> [f64; 4] {
    let channels = &problem.twin.unit().channels;
    let packets = problem.twin.starts_s().len().max(1) as f64;
    [Kind::Gyro, Kind::Accelerometer, Kind::Magnetometer, Kind::Thermometer].map(|kind| {
        let own = (0..channels.len()).filter(|channel| channels[*channel].sensor == kind);
        // Of no channel the sum is minus zero.
        own.map(|channel| motion.free(channel)).sum::<f64>().max(0.0) / packets
    })
}

fn projected(space: &Space, model: &[Component]) -> Projected {
    space.project_residual(residual_of(space.problem, model), &DVector::zeros(0))
}

/// Whether something is there that nothing named explains: a gap too large, or a calibration of which one parameter is likelier off by more
/// than described than not. A magnet beside one of forty channels is lost in the gap of the whole, and found in the calibration.
pub fn is_unexplained(left: &Left) -> bool {
    left.gap > PARITY_GAP || off(&left.calibration) > SAID
}

/// Probability that one of these parameters, in their own sigmas, is off as what is not described may be. Of a standard normal they are off by no
/// more than it; one that is not may be [`LARGEST_SIZE`] times as far off, and which one nobody knows. With the prior odds of something
/// unknown ([`UNKNOWN_PRIOR`]) that weighs a healthy unit's farthest parameter, which one log in twenty has beyond `z` with
/// `n erfc(z / sqrt(2)) = 0.05`, as what it is: of two hundred 3.7 sigmas are three hundredths, and five are nine tenths.
fn off(calibration: &[f64]) -> f64 {
    let of_one = |size: &f64| (0.5 * size * size * (1.0 - LARGEST_SIZE.powi(-2))).exp() / LARGEST_SIZE;
    let odds = calibration.iter().map(of_one).sum::<f64>() / calibration.len().max(1) as f64;
    // Beyond what a number holds it is certain.
    1.0 - (1.0 - UNKNOWN_PRIOR) / (1.0 - UNKNOWN_PRIOR + UNKNOWN_PRIOR * odds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_stands_out_beyond_chance_and_where_it_matters() {
        let stands_out = |gap: f64, free: f64| Place::of("a1x".to_owned(), (gap * gap * free, free), 40).stands_out;
        // One in eight hundred: 3.0 standard deviations sqrt(2 n) of the energy.
        assert!(!stands_out(1.15, 100.0) && stands_out(1.25, 100.0));
        assert!(!stands_out(1.06, 700.0) && stands_out(1.10, 700.0));
        // Beyond chance, and too small to matter.
        assert!(!stands_out(1.04, 20_000.0) && stands_out(1.06, 20_000.0));
        assert!(!stands_out(9.0, 0.0));
    }

    #[test]
    fn a_gap_and_a_calibration_beyond_chance_are_each_enough_to_be_unexplained() {
        // Of 400 parameters the odds are even at 0.05 / 0.95 exp(0.48 z^2) / 5 / 400 = 1, z = 4.68, which noise has in one log of 870. Beyond 3.9
        // sigma is one in one log of twenty-six.
        let left = |gap: f64, most: f64| Left {
            gap,
            calibration: [vec![0.5; 399], vec![-most]].concat(),
        };
        assert!(!is_unexplained(&left(1.0, 4.6)));
        assert!(is_unexplained(&left(1.0, 4.8)));
        assert!(is_unexplained(&left(1.0, 1e3)));
        assert!(is_unexplained(&left(1.06, 1.0)));
        assert!(!is_unexplained(&left(1.04, 1.0)));
    }

    #[test]
    fn what_smoothing_alone_names_must_be_shown_by_the_held_out_windows_and_not_refuted_by_parity() {
        let strength = |factor: f64, sigma: f64| Some(Promise { factor, sigma });
        let (kept, broken, not_shown) = (strength(1.05, 0.05), strength(0.1, 0.05), strength(0.1, 9.0));
        let is_said = |by: By, held, by_parity| confidence(by, held, by_parity) >= SAID + 0.01;
        assert!(is_said(By::Smoothing, kept, None) && is_said(By::Smoothing, kept, not_shown));
        assert!(!is_said(By::Smoothing, None, kept) && !is_said(By::Smoothing, not_shown, kept));
        assert!(!is_said(By::Smoothing, broken, kept) && !is_said(By::Smoothing, kept, broken));
        assert!(is_said(By::Parity, None, None) && is_said(By::Parity, not_shown, None));
        assert!(!is_said(By::Parity, broken, None));
    }

    #[test]
    fn a_walk_is_refuted_by_held_out_windows_without_one_and_by_smoothing_needs_theirs() {
        assert_eq!([By::Parity, By::Smoothing].map(|by| walks_on(by, 0.0)), [1.0, 0.5]);
        for by in [By::Parity, By::Smoothing] {
            assert!(walks_on(by, 10.0) > 0.99 && walks_on(by, -10.0) < 0.01);
        }
    }
}
