//! Columns of the library made anew: of a hypothesis that is on at another time, or with another variant.
//!
//! In: the library and the set that the hypothesis is the last member of. Out: the library with its columns.

use nalgebra::DVector;

use crate::{library::hypotheses::Library, null::problem::Problem, search::gauss_newton::model_of};

/// Takes the stretch of time from a hypothesis again.
pub(super) fn always(problem: &Problem, library: &mut Library, hypothesis: usize) {
    library.hypotheses[hypothesis].span = None;
    let zero = DVector::zeros(library.hypotheses[hypothesis].parameters.len());
    renew(problem, library, &[hypothesis], &[zero]);
}

/// Makes the columns of the last member of a set anew.
pub(super) fn renew(problem: &Problem, library: &mut Library, set: &[usize], thetas: &[DVector<f64>]) {
    let model = model_of(library, set, thetas);
    let renewed = problem.slopes(&model, set.len() - 1);
    let places = library.hypotheses[set[set.len() - 1]].places.clone();
    for (place, column) in places.into_iter().zip(renewed) {
        library.products.renew(problem, place, column);
    }
}
