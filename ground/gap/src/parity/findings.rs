//! What parity comes to: which effects are said, where the gap is, what is left.
//!
//! In: a [`Flight`]. Out: [`Findings`]. Everything that is said rests on the fit windows.
//!
//! The gap is the root mean square of what a packet keeps once motion and calibration are marginalised: over degrees of
//! freedom, so that 1 is noise and calibration alone. Beyond [`PARITY_GAP`], or with a calibration that is off by more than chance,
//! something is there, or the smoothed motion did not come near enough to the true one: both are said in one sentence, for one
//! log cannot tell them apart.
//!
//! Refuses a unit whose sensors are no more than what a motion has: one plate. Then parity is empty.

use nalgebra::DVector;
use statrs::{
    distribution::{ChiSquared, ContinuousCDF},
    function::erf::erfc,
};
use twin::{
    effect::{Parameter, by_name},
    predict::{Kind, Twin},
};

use crate::{
    input::{case::CaseError, reference::Reference, windows::Fit},
    library::{
        hypotheses::{Hypothesis, Library},
        products::Entries,
    },
    null::problem::{Component, Problem},
    parity::{
        codes::{self, Finding},
        course::Course,
        flight::Flight,
        nulls,
        packet::Motion,
        search::{self, Chosen},
        space::{Elimination, Projected, Space},
        visible::{self, Row},
    },
    probability::{cause::Sized, outcome::Outcome},
    thresholds::{CHANCE, LISTED, MATTERS_SIGMA, PARITY_FREE, PARITY_GAP, SAID, UNKNOWN_PRIOR},
};

/// Probability of a name that codes alone give: chance is ruled out, the library's other effects on codes are not.
const BY_CODES: f64 = 0.99;

/// An effect that is said.
#[derive(Clone, Debug)]
pub struct Name {
    /// In the library.
    pub effect: &'static str,
    /// Where, in words.
    pub locality: String,
    /// Other places that the log does not tell from this one.
    pub or_at: Vec<String>,
    /// Channels it touches.
    pub channels: Vec<usize>,
    /// Against all others and nothing.
    pub probability: f64,
    /// \[nats\]; none of what codes say.
    pub gain: Option<f64>,
    /// Ratio by parity, at plausible size and at the size found; none of what codes say.
    pub snr: Option<[f64; 2]>,
    /// Its parameters.
    pub parameters: Vec<Sized>,
    /// What was seen, or which of what it may be.
    pub which: Option<String>,
    /// What it is.
    pub physics: &'static str,
    /// How to be sure.
    pub confirm_by: &'static str,
}

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
    /// \[sigma\] before anything is named, and after.
    pub gap: [f64; 2],
    /// Each channel, before.
    pub channels: Vec<Place>,
    /// What can be seen.
    pub visible: Vec<Row>,
    /// Likeliest first.
    pub names: Vec<Name>,
    /// Other effects with their probabilities.
    pub alternatives: Vec<(&'static str, f64)>,
    /// Probability that something is there that is not named.
    pub none_of_these: f64,
    /// What it comes to.
    pub outcome: Outcome,
}

impl Findings {
    /// Of a flight.
    ///
    /// # Errors
    /// When the unit has no redundancy, or its description names an effect there is not.
    pub fn of(flight: &Flight, withheld: &[String], progress: &dyn Fn(&'static str, f64)) -> Result<Self, CaseError> {
        let coded: Vec<Finding> = (codes::look(&flight.log, &flight.unit).into_iter())
            .filter(|finding| withheld.iter().all(|name| name != finding.effect))
            .collect();
        let (mut log, mut unit) = (flight.log.clone(), flight.unit.clone());
        codes::taken_out(&mut log, &mut unit, &coded);
        progress("motion", 0.0);
        let (course, _) = Course::of(&log, &unit, &flight.environment);
        let starts_s = log.start_s.clone();
        let twin = Twin::new(unit, flight.environment, course.scene.clone(), starts_s)?;
        let fit = Fit { channels: log.channels };
        let reference = Reference::default();
        let problem = Problem::new(&twin, &fit, &reference);
        let motion = Motion::of(&problem, &course);
        let free = free(&problem, &motion);
        if free[..3].iter().sum::<f64>() < PARITY_FREE {
            return Err(empty(flight, free));
        }
        let library = Library::new(&problem, withheld, &|share| progress("effects", share));
        let space = Space::new(&problem, &motion, nulls::columns(&library));
        let residual = projected(&space, residual_of(&problem, &[]));
        progress("visible", 0.0);
        let seen = search::look(&space, &library, &residual, &|share| progress("visible", share));
        let visible = visible::table(&library.hypotheses, &seen);
        let chosen = search::choose(&space, &library, &residual, &seen, &|share| progress("search", share));
        let kept = space.kept(&residual);
        let said: Vec<&Chosen> = chosen.iter().take_while(|one| one.probability >= SAID).collect();
        let left = projected(&space, residual_of(&problem, &components(&library, &said)));
        let gap = [total(&kept), total(&space.kept(&left))];
        let packets = problem.twin.starts_s().len();
        let mut names: Vec<Name> = coded.iter().map(by_codes).collect();
        names.extend(said.iter().map(|one| by_search(&problem, &library, one)));
        let mut alternatives: Vec<(&'static str, f64)> = Vec::new();
        let unsaid = chosen.iter().find(|one| one.probability < SAID);
        for one in &said {
            alternatives.extend(one.rivals.iter().copied());
        }
        if let Some(one) = unsaid {
            alternatives.push((library.hypotheses[one.hypothesis].effect(), one.probability));
            alternatives.extend(one.rivals.iter().copied());
        }
        alternatives
            .retain(|(name, probability)| *probability >= LISTED && names.iter().all(|own| own.effect != *name));
        alternatives.sort_by(|one, other| other.1.total_cmp(&one.1));
        alternatives.dedup_by_key(|(name, _)| *name);
        let none_of_these = if is_unexplained(gap[1], &space.calibration(&left)) {
            1.0 - UNKNOWN_PRIOR
        } else {
            UNKNOWN_PRIOR
        };
        Ok(Self {
            rows: packets,
            free,
            channels: (twin.unit().channels.iter().zip(&kept))
                .map(|(channel, own)| Place::of(channel.name.clone(), *own, kept.len()))
                .collect(),
            outcome: Outcome::of(names.len(), none_of_these, none_of_these, false),
            gap,
            visible,
            names,
            alternatives,
            none_of_these,
        })
    }
}

fn empty(flight: &Flight, free: [f64; 4]) -> CaseError {
    let problem = format!(
        "are as few as the unknowns of a motion: gyros, accelerometers and magnetometers together keep {:.2} degrees of freedom a \
         packet. Parity is empty, nothing can be said without a reference; give a motion, or the channels of further plates",
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
        own.map(|channel| motion.free(channel)).sum::<f64>() / packets
    })
}

fn residual_of(problem: &Problem, model: &[Component]) -> Entries {
    problem.residuals(model).into_iter().enumerate().collect()
}

fn projected(space: &Space, column: Entries) -> Projected {
    space.project_residual(column, &DVector::zeros(0))
}

fn components(library: &Library, said: &[&Chosen]) -> Vec<Component> {
    said.iter()
        .map(|one| library.hypotheses[one.hypothesis].component(&one.theta))
        .collect()
}

/// Root mean square over degrees of freedom.
fn total(kept: &[(f64, f64)]) -> f64 {
    let (energy, free) = kept
        .iter()
        .fold((0.0, 0.0), |(energy, free), own| (energy + own.0, free + own.1));
    (energy / free.max(1.0)).max(0.0).sqrt()
}

/// Whether something is there that nothing named explains: a gap too large, or a calibration that is off by more of its own sigmas
/// than chance gives one log in twenty over all its parameters. A magnet beside one of forty channels is lost in the gap of
/// the whole, and found in the calibration.
fn is_unexplained(gap: f64, calibration: &[f64]) -> bool {
    let most = calibration.iter().fold(0.0, |most: f64, size| most.max(size.abs()));
    // Of a standard normal: what is fitted is off by no more than what it is fitted to.
    gap > PARITY_GAP || erfc(most / 2f64.sqrt()) * (calibration.len() as f64) < CHANCE
}

/// Their places, each once.
fn places<'a>(hypotheses: impl Iterator<Item = &'a Hypothesis>) -> Vec<String> {
    let mut places: Vec<String> = hypotheses
        .map(|hypothesis| hypothesis.cause.locality.to_string())
        .collect();
    places.sort_unstable();
    places.dedup();
    places
}

fn by_codes(finding: &Finding) -> Name {
    let page = by_name(finding.effect).map(|effect| effect.page());
    Name {
        effect: finding.effect,
        locality: String::new(),
        or_at: Vec::new(),
        channels: finding.channels.clone(),
        probability: BY_CODES,
        gain: None,
        snr: None,
        parameters: Vec::new(),
        which: Some(finding.what.clone()),
        physics: page.map_or("", |page| page.physics),
        confirm_by: page.map_or("", |page| page.confirm_by),
    }
}

fn by_search(problem: &Problem, library: &Library, chosen: &Chosen) -> Name {
    let hypothesis = &library.hypotheses[chosen.hypothesis];
    let page = hypothesis.cause.effect.page();
    let sized = |(index, parameter): (usize, &Parameter)| Sized {
        parameter: parameter.clone(),
        value: chosen.theta[index],
        sigma: chosen.covariance[(index, index)].max(0.0).sqrt(),
    };
    Name {
        effect: hypothesis.effect(),
        locality: hypothesis.cause.locality.to_string(),
        or_at: places(chosen.elsewhere.iter().map(|at| &library.hypotheses[*at])),
        channels: hypothesis.cause.channels(problem.twin.unit()),
        probability: chosen.probability,
        gain: Some(chosen.gain),
        snr: Some([chosen.snr, chosen.found_snr]),
        parameters: hypothesis.parameters.iter().enumerate().map(sized).collect(),
        which: hypothesis.cause.effect.told(hypothesis.cause.variant),
        physics: page.physics,
        confirm_by: page.confirm_by,
    }
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
        // Of 400 parameters one is beyond 3.8 sigma in one log of twenty: 400 * erfc(3.8 / sqrt(2)) = 0.058, at 3.9 0.038.
        let calibration = |most: f64| [vec![0.5; 399], vec![-most]].concat();
        assert!(!is_unexplained(1.0, &calibration(3.8)));
        assert!(is_unexplained(1.0, &calibration(3.9)));
        assert!(is_unexplained(1.06, &calibration(1.0)));
        assert!(!is_unexplained(1.04, &calibration(1.0)));
    }
}
