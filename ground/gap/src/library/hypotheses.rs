//! Every hypothesis of the effect library on one case, and its columns.
//!
//! In: the [`Problem`]. Out: a [`Hypothesis`] for each effect, place and variant, with the columns of its parameters
//! at zero. Places share columns (one gyro's bias is the same column whether the gyro stands alone or among the four), so
//! a column is made once. Prior odds: half for "nothing", half shared equally by the effects, and an effect's share equally
//! by its places and variants (half to the widest places); so looking in more places costs what it should.

use nalgebra::DVector;
use rayon::prelude::*;
use twin::effect::{Active, Cause, Effect, LIBRARY, Locality, Nature, Page, Parameter, onsets};

use crate::{
    input::windows::Span,
    library::{
        column::{Carrier, Column},
        products::Products,
    },
    null::{
        evidence::Screen,
        interval::{Interval, begins_s},
        problem::{Component, Problem},
    },
};

/// Effects whose columns are made at once, by all cores; then it is told how far it is.
const AT_ONCE: usize = 8;

/// An effect at a place.
#[derive(Clone, Debug)]
pub struct Hypothesis {
    /// Which and where.
    pub cause: Cause,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// Where the columns of its parameters stand.
    pub places: Vec<usize>,
    /// Logarithm of its prior odds against nothing.
    pub log_prior: f64,
    /// When it is on; `None` for always.
    pub span: Option<Interval>,
}

impl Hypothesis {
    /// Name of its effect.
    pub fn effect(&self) -> &'static str {
        self.cause.effect.page().name
    }

    /// The columns of which it is the sum where it is small: none of an effect that is there or not, whose columns are about its
    /// being there.
    pub fn small(&self) -> &[usize] {
        match self.cause.effect.page().nature {
            Nature::Discrete => &[],
            Nature::Smooth | Nature::Spread => &self.places,
        }
    }

    /// It, with these parameters.
    pub fn active(&self, theta: &DVector<f64>) -> Active {
        Active {
            cause: self.cause.clone(),
            theta: theta.iter().copied().collect(),
        }
    }

    /// The values about its own between which others are possible, in order, in a log whose cycles begin at these instants \[s\];
    /// `None` where there are none.
    pub fn values_between(&self, starts_s: &[f64]) -> Option<Vec<f64>> {
        let mut values = match begins_s(&self.cause, starts_s) {
            Some(_) if !self.places.is_empty() => onsets(starts_s).collect(),
            None if self.cause.effect.has_values_between() => self.cause.effect.between(starts_s),
            _ => return None,
        };
        values.sort_by(f64::total_cmp);
        Some(values)
    }

    /// The one stretch of time in which it is on; `None` for always, and for what comes again.
    pub fn once(&self, starts_s: &[f64]) -> Option<Span> {
        let begins_s = begins_s(&self.cause, starts_s);
        match self.span {
            Some(Interval { every_s: Some(_), .. }) => None,
            Some(Interval { stretch, .. }) => Some(Span {
                from: begins_s.map_or(stretch.from, |begins_s| begins_s.max(stretch.from)),
                to: stretch.to,
            }),
            None => begins_s.map(|from| Span {
                from,
                to: f64::INFINITY,
            }),
        }
    }

    /// It, when it is on.
    pub fn component(&self, theta: &DVector<f64>) -> Component {
        Component {
            active: self.active(theta),
            span: self.span,
        }
    }
}

/// All of them.
#[derive(Clone, Debug, Default)]
pub struct Library {
    /// In the order of the effect library.
    pub hypotheses: Vec<Hypothesis>,
    /// Columns, first those of the reference.
    pub products: Products,
    /// Prior sigma of each column's parameter.
    pub prior_sigmas: Vec<f64>,
    /// How many columns are the reference's.
    pub reference: usize,
}

impl Library {
    /// Makes the columns; `withheld` names effects to leave out; `progress` is told how far it is, from 0 to 1.
    pub fn new(problem: &Problem, withheld: &[String], progress: &dyn Fn(f64)) -> Self {
        let unit = problem.twin.unit();
        let mut library = Library {
            hypotheses: Vec::new(),
            products: Products::default(),
            prior_sigmas: problem.reference.iter().map(|column| column.sigma).collect(),
            reference: problem.reference.len(),
        };
        for column in problem.reference_columns() {
            library.products.push(problem, Column::of(column));
        }
        let is_exact = problem.instrument.accuracy.attitude_sigma_rad <= 0.0;
        let is_offered = |page: &Page| {
            let is_possible = page.needs.is_none_or(|needs| needs.is_met(unit));
            is_possible && withheld.iter().all(|withheld| withheld != page.name)
        };
        let offered: Vec<_> = LIBRARY
            .iter()
            .filter(|effect| effect.page().nature != Nature::Spread && is_offered(effect.page()))
            .collect();
        for (done, effects) in offered.chunks(AT_ONCE).enumerate() {
            let made: Vec<Made> = (effects.par_iter())
                .map(|effect| Made::of(problem, **effect, is_exact))
                .collect();
            made.into_iter().for_each(|made| library.take(problem, made));
            progress(((done + 1) * AT_ONCE).min(offered.len()) as f64 / offered.len() as f64);
        }
        library
    }

    fn take(&mut self, problem: &Problem, made: Made) {
        let first = self.products.len();
        let (columns, sigmas): (Vec<Column>, Vec<f64>) = made.columns.into_iter().unzip();
        self.products.extend(problem, columns);
        self.prior_sigmas.extend(sigmas);
        self.hypotheses
            .extend(made.hypotheses.into_iter().map(|mut hypothesis| {
                hypothesis.places.iter_mut().for_each(|place| *place += first);
                hypothesis
            }));
    }

    /// Takes what is open anew: the problem's motion is another.
    pub fn reopen(&mut self, problem: &Problem) {
        for (place, column) in problem.reference_columns().into_iter().enumerate() {
            self.products.renew(problem, place, column);
        }
        self.products.reframe(problem, &problem.frames);
    }

    /// Normal equations of some columns, given the scores of all.
    pub fn screen(&self, places: &[usize], scores: &[f64]) -> Screen {
        self.products.screen(places, scores, &self.prior_sigmas)
    }

    /// Whether a hypothesis is there or not, whatever its parameters.
    pub fn is_discrete(&self, hypothesis: usize) -> bool {
        self.hypotheses[hypothesis].cause.effect.page().nature == Nature::Discrete
    }
}

/// The hypotheses of one effect, and the columns they need, each with the sigma of its parameter. Places count from the first of these.
struct Made {
    hypotheses: Vec<Hypothesis>,
    columns: Vec<(Column, f64)>,
}

impl Made {
    fn of(problem: &Problem, effect: &'static dyn Effect, is_exact: bool) -> Self {
        let mut made = Self {
            hypotheses: Vec::new(),
            columns: Vec::new(),
        };
        let unit = problem.twin.unit();
        let (localities, mut variants) = (effect.localities(unit), effect.variants(problem.twin.starts_s()));
        // Of each healthy recording beside an optical system (BROAD 05, 09, 18, and a twin's flight) such a law explains 10 to 1,300 nats.
        variants.retain(|variant| is_exact || !effect.is_like_a_reference(*variant));
        let widest = localities.iter().filter(|locality| is_wide(locality)).count();
        let mut known: Vec<(Vec<usize>, usize, f64, usize)> = Vec::new();
        for locality in &localities {
            let mut carrier = None;
            for variant in &variants {
                let places = if widest == 0 || widest == localities.len() {
                    localities.len()
                } else if is_wide(locality) {
                    2 * widest
                } else {
                    2 * (localities.len() - widest)
                };
                let log_prior = -((LIBRARY.len() * places * variants.len()).max(1) as f64).ln();
                let cause = Cause {
                    effect,
                    locality: locality.clone(),
                    variant: *variant,
                };
                let parameters = cause.parameters(unit);
                let width = effect.page().parameters.len().max(1);
                let find = |index: usize, known: &[(Vec<usize>, usize, f64, usize)]| {
                    let touched = cause.touched_by(index, unit);
                    let same = |entry: &&(Vec<usize>, usize, f64, usize)| {
                        entry.0 == touched && entry.1 == index % width && entry.2 == *variant
                    };
                    known.iter().find(same).map(|entry| entry.3)
                };
                let all_known = (0..parameters.len()).all(|index| find(index, &known).is_some());
                if !all_known {
                    let carrier = carrier.get_or_insert_with(|| Carrier::of(problem, &cause));
                    for (index, column) in columns(problem, &cause, carrier).into_iter().enumerate() {
                        if find(index, &known).is_none() {
                            let place = made.columns.len();
                            known.push((cause.touched_by(index, unit), index % width, *variant, place));
                            made.columns.push(column);
                        }
                    }
                }
                let places: Vec<usize> = (0..parameters.len()).filter_map(|index| find(index, &known)).collect();
                if !places.is_empty() || effect.page().nature == Nature::Discrete {
                    made.hypotheses.push(Hypothesis {
                        cause,
                        parameters,
                        places,
                        log_prior,
                        span: None,
                    });
                }
            }
        }
        made
    }
}

/// The columns of a cause at zero, a column a parameter.
pub fn columns_of(problem: &Problem, cause: &Cause) -> Vec<Column> {
    let columns = columns(problem, cause, &Carrier::of(problem, cause)).into_iter();
    columns.map(|(column, _)| column).collect()
}

/// The columns of a cause at zero, each with the sigma of its parameter.
fn columns(problem: &Problem, cause: &Cause, carrier: &Option<Carrier>) -> Vec<(Column, f64)> {
    if let Some((carrier, wave)) = carrier.as_ref().zip(cause.effect.wave(cause.variant)) {
        return carrier.columns(wave);
    }
    let zero = Active {
        cause: cause.clone(),
        theta: vec![0.0; cause.parameters(problem.twin.unit()).len()],
    };
    let columns = problem.twin.jacobian(&[zero], 0).into_iter();
    columns
        .map(|column| (Column::of(problem.in_noise(&column, None)), column.sigma))
        .collect()
}

/// Whether a place is all there is: a cause behind a whole kind of sensor is as likely as one in any single place.
fn is_wide(locality: &Locality) -> bool {
    matches!(locality, Locality::Unit | Locality::Common | Locality::All)
}
