//! A log of several, its motion followed once.
//!
//! In: a case. Out: [`Logged`]: one with a reference as it is, one without with its course, and its smoothed motion where that
//! settles. With what is in the model already ([`Looked`]) it gives what it says of everything ([`Heard`]).

use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector};

use crate::{
    input::case::{CaseError, Opened, Subject},
    library::{
        column::Entries,
        hypotheses::{Hypothesis, Library},
    },
    null::problem::Problem,
    parity::{
        beforehand,
        codes::Finding,
        flight::Flight,
        followed::{Beforehand, Followed},
        name::Fitted,
        nulls,
        packet::Motion,
        search::Offered,
        smoothed::{Strength, held_out},
        space::Elimination,
    },
    together::heard::{Heard, Look, Looked},
};

/// A log.
pub struct Logged {
    /// Its folder as it was given.
    pub path: PathBuf,
    /// What it is called.
    pub name: String,
    known: Known,
}

enum Known {
    Reference(Box<Subject>),
    Nothing(Box<Followed>, Box<Flight>, Beforehand),
}

/// A motion that a reference knows: nothing of it is eliminated.
struct Told {
    free: Vec<f64>,
}

impl Elimination for Told {
    fn parts(&self, columns: &[&Entries]) -> DMatrix<f64> {
        DMatrix::zeros(0, columns.len())
    }

    fn take(&self, _: &DMatrix<f64>, _: &mut [DMatrix<f64>]) {}

    fn free(&self, channel: usize) -> f64 {
        self.free[channel]
    }
}

impl Logged {
    /// All of them; their motions are not opened where `is_blind`.
    ///
    /// # Errors
    /// When one cannot be judged.
    pub fn all(cases: &[PathBuf], is_blind: bool, withheld: &[String]) -> Result<Vec<Self>, CaseError> {
        cases.iter().map(|case| Self::open(case, is_blind, withheld)).collect()
    }

    fn open(case: &Path, is_blind: bool, withheld: &[String]) -> Result<Self, CaseError> {
        let opened = Opened::open(case)?;
        let name = opened.text.name.clone();
        let known = if is_blind || opened.is_without_motion() {
            let flight = Flight::open(case)?;
            let beforehand = beforehand::look(&flight, withheld)?;
            let followed = Followed::of(&flight, &flight.log, &beforehand);
            Known::Nothing(Box::new(followed), Box::new(flight), beforehand)
        } else {
            Known::Reference(Box::new(Subject::open(case)?))
        };
        Ok(Self {
            path: case.to_owned(),
            name,
            known,
        })
    }

    /// Whether a reference saw its motion.
    pub fn has_reference(&self) -> bool {
        matches!(self.known, Known::Reference(_))
    }

    /// What its codes say; nothing of one with a reference, whose own diagnosis says that.
    pub fn coded(&self) -> &[Finding] {
        match &self.known {
            Known::Reference(_) => &[],
            Known::Nothing(_, _, beforehand) => &beforehand.found,
        }
    }

    /// Names of channels.
    pub fn channels(&self, channels: &[usize]) -> Vec<String> {
        match &self.known {
            Known::Reference(subject) => subject.names(channels.iter().copied()),
            Known::Nothing(_, flight, _) => flight.names(channels),
        }
    }

    /// Names of the channels that a hypothesis touches.
    pub fn touched(&self, hypothesis: &Hypothesis) -> Vec<String> {
        let unit = match &self.known {
            Known::Reference(subject) => subject.twin.unit(),
            Known::Nothing(_, flight, _) => &flight.unit,
        };
        self.channels(&hypothesis.cause.channels(unit))
    }

    /// Whether its motion is known or could be smoothed.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn is_followed(&self, progress: &dyn Fn(f64)) -> Result<bool, CaseError> {
        match &self.known {
            Known::Reference(_) => Ok(true),
            Known::Nothing(followed, _, _) => Ok(followed.smoothed(progress)?.is_settled()),
        }
    }

    /// What it says. `with` is given the library too, from which only the first log's is kept.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn heard(&self, looked: &Looked, progress: &dyn Fn(f64)) -> Result<(Heard, Library), CaseError> {
        let nothing = DVector::zeros(0);
        match &self.known {
            Known::Reference(subject) => {
                let problem = Problem::new(&subject.twin, &subject.fit, &subject.reference);
                let free = problem.frames.iter().map(|frame| frame.weights.len() as f64).collect();
                let library = Library::new(&problem, looked.withheld, progress);
                let open = (problem.reference_columns().into_iter().zip(&problem.reference)).map(|(column, own)| {
                    column
                        .into_iter()
                        .map(|(at, values)| (at, values * own.sigma))
                        .collect()
                });
                let open = open.collect();
                heard(&problem, &Told { free }, library, open, &nothing, looked)
            }
            Known::Nothing(followed, _, _) => {
                let (fit, reference) = (followed.fit(), crate::input::reference::Reference::default());
                let smoothed = match looked.look {
                    Look::First => None,
                    Look::Second => Some(followed.smoothed(progress)?).filter(|own| own.is_settled()),
                };
                if let Some(smoothed) = smoothed {
                    let twin = followed.twin(smoothed)?;
                    let problem = Problem::new(&twin, &fit, &reference);
                    let motion = followed.motion(smoothed, &problem);
                    let library = Library::new(&problem, looked.withheld, progress);
                    let open = nulls::columns(&problem, &library);
                    heard(&problem, motion, library, open, &motion.prior(), looked)
                } else {
                    let twin = followed.twin_of_course()?;
                    let problem = Problem::new(&twin, &fit, &reference);
                    let motion = Motion::of(&problem, &followed.course);
                    let library = Library::new(&problem, looked.withheld, progress);
                    let open = nulls::columns(&problem, &library);
                    heard(&problem, &motion, library, open, &nothing, looked)
                }
            }
        }
    }

    /// How strong causes are on its held-out windows; none of a log with a reference, and of one without such windows.
    ///
    /// # Errors
    /// When the unit's description names an effect there is not.
    pub fn held_out(&self, causes: &[Fitted], progress: &dyn Fn(f64)) -> Result<Option<Vec<Strength>>, CaseError> {
        let Known::Nothing(_, flight, beforehand) = &self.known else {
            return Ok(None);
        };
        let Some(log) = &flight.held else { return Ok(None) };
        let held = Followed::of(flight, log, beforehand);
        held_out(&held, causes, progress).map(Some)
    }
}

fn heard(
    problem: &Problem,
    motion: &dyn Elimination,
    library: Library,
    open: Vec<Entries>,
    prior: &DVector<f64>,
    looked: &Looked,
) -> Result<(Heard, Library), CaseError> {
    let offered = Offered::of(problem, &library);
    let heard = Heard::of((problem, motion, prior), &library, &offered, open, looked);
    let light = Library {
        hypotheses: library.hypotheses,
        products: crate::library::products::Products::default(),
        prior_sigmas: library.prior_sigmas,
        reference: library.reference,
    };
    Ok((heard, light))
}
