//! What one log says of every effect, its own unknowns marginalised and those of the unit open.
//!
//! In: a problem, its motion by an [`Elimination`], the library's columns, what is open in this log alone. Out: [`Heard`]: the sums `G`, `b`, `k`,
//! `K` and `O` of [`crate::together`]. With `<u, v>` the product past the motion, `o` the log's own columns and `c` the unit's, each
//! for a prior sigma:
//!
//! ```text
//! W = I + <o, o> = L L',   [u, v] = <u, v> - (L^-1 <o, u>)'(L^-1 <o, v>)
//! G = [e, e],  b = [e, r],  O = [e, c],  K = [c, c],  k = [c, r]
//! ```
//!
//! The unit's are scale and axes of every channel, its zero, and the parameters of effects that are in the model already. The log's own are
//! what else the calibration leaves open (a zero's walk, instants, and a zero that may be another after each start) and the nulls.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector};
use twin::effect::{Nature, onsets};

use crate::{
    library::{
        column::Entries,
        hypotheses::{Hypothesis, Library},
    },
    null::problem::{Component, Problem},
    parity::{
        search::{Offered, residual_of},
        smoothed::Left,
        space::{Elimination, Opened, Space},
    },
};

/// How a log is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// By parity where there is no reference.
    First,
    /// About the smoothed motion where there is none, if it settled.
    Second,
}

/// What is looked for beside what.
pub struct Looked<'a> {
    /// Which look.
    pub look: Look,
    /// Effects that are in.
    pub model: &'a [Component],
    /// Whether their parameters are free about what they are.
    pub are_free: bool,
    /// Effects that are left out of the library.
    pub withheld: &'a [String],
}

/// Calibration that is one in all logs: the beginning of a column's name.
const LASTING: [&str; 3] = ["scale_", "axis_1_", "axis_2_"];

/// Calibration that is one in all logs and may be another after each start besides.
const ZERO: &str = "bias_";

/// What is said of the parameters of a hypothesis.
#[derive(Clone, Debug)]
pub struct Own {
    /// `G`.
    pub information: DMatrix<f64>,
    /// `b`.
    pub score: DVector<f64>,
    /// `O'`, a column a parameter.
    pub open: DMatrix<f64>,
}

/// What a log says.
#[derive(Clone, Debug)]
pub struct Heard {
    /// By [`key`]; those that begin at an instant of this log are not among them.
    pub own: BTreeMap<String, Own>,
    /// Names of the unit's unknowns.
    pub shared: Vec<String>,
    /// `K`.
    pub inner: DMatrix<f64>,
    /// `k`.
    pub pull: DVector<f64>,
    /// What the model leaves of it.
    pub left: Left,
}

/// The same in all logs of a unit.
pub fn key(hypothesis: &Hypothesis) -> String {
    let cause = &hypothesis.cause;
    format!("{} {} {}", hypothesis.effect(), cause.locality, cause.variant)
}

/// Whether it begins at an instant of a log: such a one is no property of a unit.
pub fn is_event(hypothesis: &Hypothesis, starts_s: &[f64]) -> bool {
    let cause = &hypothesis.cause;
    cause.effect.variants(starts_s).len() > 1 && onsets(starts_s).any(|onset| onset == cause.variant)
}

impl Heard {
    /// Of a log whose prior rows of the motion are off by `prior`.
    pub fn of(
        (problem, motion, prior): (&Problem, &dyn Elimination, &DVector<f64>),
        library: &Library,
        offered: &Offered,
        open: Vec<Entries>,
        looked: &Looked,
    ) -> Self {
        let (zeros, mut names) = zeros(problem);
        let mut beside = open;
        let own_beside = beside.len();
        beside.extend(zeros);
        if looked.are_free {
            for (at, component) in looked.model.iter().enumerate() {
                let cause = &component.active.cause;
                if cause.effect.page().nature == Nature::Discrete {
                    continue;
                }
                let parameters = cause.parameters(problem.twin.unit());
                for (slope, parameter) in problem.slopes(looked.model, at).into_iter().zip(parameters) {
                    let sized = slope
                        .into_iter()
                        .map(|(channel, values)| (channel, values * parameter.prior_sigma));
                    beside.push(sized.collect());
                    names.push(format!(
                        "{} {} {}",
                        cause.effect.page().name,
                        cause.locality,
                        parameter.name
                    ));
                }
            }
        }
        let columns = offered.columns();
        let (mut space, inner, opened) = Space::motion_only(problem, motion, beside, &columns);
        let residual = space.project_residual(residual_of(problem, looked.model), prior);
        let rest = space.rest(&residual);
        let pull = space.plain(&rest);
        let products = space.within(&columns, &Opened::nothing(columns.len()), offered.sets(), &|_| ());
        let parts = Parts::of(problem, own_beside, names, inner.nrows());
        let own_inner = pick(&inner, &parts.own, &parts.own);
        let factor = Cholesky::new(own_inner);
        let solved = |mut right: DMatrix<f64>| {
            match &factor {
                Some(factor) => {
                    factor.l_dirty().solve_lower_triangular_mut(&mut right);
                }
                None => right.fill(0.0),
            }
            right
        };
        let by_shared = solved(pick(&inner, &parts.own, &parts.shared));
        let rows = |matrix: &DMatrix<f64>, rows: &[usize]| matrix.select_rows(rows);
        let by_columns = solved(rows(&opened, &parts.own));
        let column = DMatrix::from_columns(std::slice::from_ref(&pull));
        let by_rest = solved(rows(&column, &parts.own)).column(0).into_owned();
        let size = parts.shared.len();
        let shared_inner = pick(&inner, &parts.shared, &parts.shared) - DMatrix::identity(size, size);
        let shared_open = rows(&opened, &parts.shared) - by_shared.tr_mul(&by_columns);
        let starts_s = problem.twin.starts_s();
        let mut own = BTreeMap::new();
        for (hypothesis, (set, product)) in library.hypotheses.iter().zip(offered.sets().iter().zip(products)) {
            if is_event(hypothesis, starts_s) {
                continue;
            }
            let taken = by_columns.select_columns(set);
            let along = set.iter().map(|place| columns[*place].dot_entries(&rest));
            let said = Own {
                information: product - taken.tr_mul(&taken),
                score: DVector::from_iterator(set.len(), along) - taken.tr_mul(&by_rest),
                open: shared_open.select_columns(set),
            };
            own.insert(key(hypothesis), said);
        }
        let pull = DVector::from_iterator(size, parts.shared.iter().map(|place| pull[*place]));
        let heard_pull = pull - by_shared.tr_mul(&by_rest);
        space.close(inner);
        let residual = space.project_residual(residual_of(problem, looked.model), prior);
        Self {
            own,
            shared: parts.names,
            inner: shared_inner - by_shared.tr_mul(&by_shared),
            pull: heard_pull,
            left: Left::of(&space, &residual),
        }
    }
}

/// Zeros once more, as they are one in all logs, with their names.
fn zeros(problem: &Problem) -> (Vec<Entries>, Vec<String>) {
    let mut found = (Vec::new(), Vec::new());
    for (channel, frame) in problem.frames.iter().enumerate() {
        for ((name, _), column) in frame.nuisance_names.iter().zip(frame.nuisance.column_iter()) {
            if name.starts_with(ZERO) {
                found.0.push(vec![(channel, column.into_owned())]);
                found.1.push(name.clone());
            }
        }
    }
    found
}

/// Which of a space's columns of calibration and nulls are the log's own, and which the unit's.
struct Parts {
    own: Vec<usize>,
    shared: Vec<usize>,
    names: Vec<String>,
}

impl Parts {
    /// Of a problem beside whose calibration so many own columns stand, then the unit's of these names, `size` in all.
    fn of(problem: &Problem, own_beside: usize, beside: Vec<String>, size: usize) -> Self {
        let calibration = problem.frames.iter().flat_map(|frame| &frame.nuisance_names);
        let mut parts = Self {
            own: Vec::new(),
            shared: Vec::new(),
            names: Vec::new(),
        };
        let mut next = 0;
        for (name, _) in calibration {
            if LASTING.iter().any(|own| name.starts_with(own)) {
                parts.shared.push(next);
                parts.names.push(name.clone());
            } else {
                parts.own.push(next);
            }
            next += 1;
        }
        parts.own.extend(next..next + own_beside);
        parts.shared.extend(next + own_beside..size);
        parts.names.extend(beside);
        parts
    }
}

fn pick(matrix: &DMatrix<f64>, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
    matrix.select_rows(rows).select_columns(columns)
}
