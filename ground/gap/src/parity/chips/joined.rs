//! What one chip reads beside another on the same body.
//!
//! In: rates, forces and fields of two chips at the same instants, and the mean rate of all. Out: [`Joined`]: what of the difference
//! turns with the rate, pulls with the force, and goes with a place.
//!
//! ```text
//! w_1 - w_0 = b + K w                              K: scales on its diagonal, cross axes beside it
//! f_1 - f_0 = a + A f + w' x r + w x (w x r)       r: where chip 1 lies, seen from chip 0
//! m_1 - m_0 = h + M m
//! ```
//!
//! All of it is linear in the unknowns, so rows are averaged over [`MEAN_S`] first: that costs nothing but noise, however fast the body spins.

use nalgebra::{DMatrix, Matrix3, Vector3};
use packets::magnitude::median;

use crate::parity::chips::regression::{Fitted, Point};

/// \[s\] over which rows are averaged.
const MEAN_S: f64 = 0.1;

/// Rows to either side of the slope of a rate: windows of 5, 9 and 21 rows move the arms of a rocket's chips by 0.03 mm.
const SLOPE_ROWS: usize = 4;

/// Steps longer than so many usual ones are gaps, over which no slope is made.
const GAP_STEPS: f64 = 2.5;

/// What a chip reads at the same instants as the others: rates [rad/s], specific forces [m/s2], fields \[uT\].
#[derive(Clone, Debug, Default)]
pub struct Readings {
    /// In b.
    pub rates: Vec<Vector3<f64>>,
    /// Empty where it has none.
    pub forces: Vec<Vector3<f64>>,
    /// Empty where it has none.
    pub fields: Vec<Vector3<f64>>,
}

/// A matrix and the standard deviations of its elements.
#[derive(Clone, Copy, Debug)]
pub struct Sized {
    /// Rows: the axis that reads; columns: what it reads of.
    pub matrix: Matrix3<f64>,
    /// Of each.
    pub sigmas: Matrix3<f64>,
    /// Constant beside it, in the unit of the readings, and its standard deviations.
    pub zero: [Vector3<f64>; 2],
}

/// A chip beside another.
#[derive(Clone, Debug)]
pub struct Joined {
    /// Of the rates.
    pub rates: Option<Sized>,
    /// Of the forces.
    pub forces: Option<Sized>,
    /// Of the fields.
    pub fields: Option<Sized>,
    /// \[m\] where the one lies seen from the other, in b, with standard deviations.
    pub place_m: Option<[Vector3<f64>; 2]>,
}

impl Joined {
    /// Of two chips; `rates` is the mean of all chips.
    pub fn of(t_s: &[f64], rates: &[Vector3<f64>], one: &Readings, other: &Readings) -> Self {
        let spans = spans(t_s);
        let slopes = slopes(t_s, rates);
        let has_forces = !one.forces.is_empty() && !other.forces.is_empty();
        let has_fields = !one.fields.is_empty() && !other.fields.is_empty();
        let by_matrix = |of: &dyn Fn(usize) -> (Vector3<f64>, Vector3<f64>)| {
            let row = |at: usize| {
                let (mean, difference) = of(at);
                (linear(&mean, 12), difference)
            };
            sized(&Fitted::of(&averaged(&spans, &|_| true, &row))?)
        };
        let fields = |at: usize| (mean(&one.fields, &other.fields, at), other.fields[at] - one.fields[at]);
        let carried = |at: usize| {
            let mut all = linear(&mean(&one.forces, &other.forces, at), 15);
            let (w, w_dot) = (rates[at], slopes[at].unwrap_or_default());
            let by_place = w_dot.cross_matrix() + w.cross_matrix() * w.cross_matrix();
            all.view_mut((0, 12), (3, 3)).copy_from(&by_place);
            (all, other.forces[at] - one.forces[at])
        };
        let forces = has_forces
            .then(|| Fitted::of(&averaged(&spans, &|at| slopes[at].is_some(), &carried)))
            .flatten();
        let place = |fitted: &Fitted| {
            let three = |of: &nalgebra::DVector<f64>| of.fixed_rows::<3>(12).into_owned();
            [three(&fitted.theta), three(&fitted.sigmas)]
        };
        Self {
            rates: by_matrix(&|at| (rates[at], other.rates[at] - one.rates[at])),
            place_m: forces.as_ref().map(place),
            forces: forces.as_ref().and_then(sized),
            fields: has_fields.then(|| by_matrix(&fields)).flatten(),
        }
    }
}

fn mean(one: &[Vector3<f64>], other: &[Vector3<f64>], at: usize) -> Vector3<f64> {
    0.5 * (one[at] + other[at])
}

/// Slopes of a constant and of a matrix, its rows one after the other.
fn linear(of: &Vector3<f64>, size: usize) -> DMatrix<f64> {
    let mut slopes = DMatrix::zeros(3, size);
    for row in 0..3 {
        slopes[(row, row)] = 1.0;
        (0..3).for_each(|column| slopes[(row, 3 + 3 * row + column)] = of[column]);
    }
    slopes
}

fn sized(fitted: &Fitted) -> Option<Sized> {
    let matrix = |of: &nalgebra::DVector<f64>| Matrix3::from_fn(|row, column| of[3 + 3 * row + column]);
    let zero = |of: &nalgebra::DVector<f64>| of.fixed_rows::<3>(0).into_owned();
    Some(Sized {
        matrix: matrix(&fitted.theta),
        sigmas: matrix(&fitted.sigmas),
        zero: [zero(&fitted.theta), zero(&fitted.sigmas)],
    })
}

/// Rows of each mean, without gaps within.
fn spans(t_s: &[f64]) -> Vec<(usize, usize)> {
    let longest_s = GAP_STEPS * usual(t_s);
    let mut spans: Vec<(usize, usize)> = Vec::new();
    let mut from = 0;
    for at in 1..=t_s.len() {
        let is_end = at == t_s.len() || t_s[at] - t_s[at - 1] > longest_s || t_s[at] - t_s[from] >= MEAN_S - 1e-9;
        if is_end {
            spans.push((from, at));
            from = at;
        }
    }
    spans
}

fn usual(t_s: &[f64]) -> f64 {
    median(t_s.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(0.0)
}

/// Means over spans of the rows that may be used.
fn averaged(
    spans: &[(usize, usize)],
    may: &dyn Fn(usize) -> bool,
    row: &dyn Fn(usize) -> (DMatrix<f64>, Vector3<f64>),
) -> Vec<Point> {
    let mean = |(from, to): &(usize, usize)| {
        let rows: Vec<(DMatrix<f64>, Vector3<f64>)> = (*from..*to).filter(|at| may(*at)).map(row).collect();
        let count = rows.len() as f64;
        let (slopes, values): (Vec<DMatrix<f64>>, Vec<Vector3<f64>>) = rows.into_iter().unzip();
        let slopes = slopes.into_iter().reduce(|sum, own| sum + own)? / count;
        Some(Point {
            slopes,
            value: values.into_iter().sum::<Vector3<f64>>() / count,
        })
    };
    spans.iter().filter_map(mean).collect()
}

/// [rad/s2] the slope of a straight line through a rate and its neighbours; none where one of them is missing.
fn slopes(t_s: &[f64], rates: &[Vector3<f64>]) -> Vec<Option<Vector3<f64>>> {
    let longest_s = GAP_STEPS * usual(t_s);
    let slope = |at: usize| {
        let from = at.checked_sub(SLOPE_ROWS)?;
        let own = t_s.get(from..=at + SLOPE_ROWS)?;
        if own.windows(2).any(|pair| pair[1] - pair[0] > longest_s) {
            return None;
        }
        let middle_s = own.iter().sum::<f64>() / own.len() as f64;
        let squares: f64 = own.iter().map(|own_s| (own_s - middle_s).powi(2)).sum();
        let sum: Vector3<f64> = (own.iter().zip(&rates[from..]))
            .map(|(own_s, rate)| rate * (own_s - middle_s))
            .sum();
        Some(sum / squares)
    };
    (0..t_s.len()).map(slope).collect()
}
