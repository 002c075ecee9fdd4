//! How much of one effect another can imitate on this motion: the matrix of the page.
//!
//! In: the library and what was chosen. Out: an [`Imitation`]: for the chosen effects and those that gained most alone,
//! the share of the energy of the row's effect, at its most likely size alone, that the column's effect can put in its
//! place, calibration marginalised. One is not to be told apart on this motion, whatever the noise
//! ([`crate::advise::confusion`] has the nats).

use nalgebra::DVector;

use crate::{library::hypotheses::Library, search::readings::Attribution};

/// Effects compared: more do not stand beside each other on a page.
const MOST: usize = 10;

/// Which effect imitates which.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imitation {
    /// Names.
    pub effects: Vec<&'static str>,
    /// `shares[row][column]` of the row's energy that the column can imitate.
    pub shares: Vec<Vec<f64>>,
}

/// The matrix.
pub fn imitation(library: &Library, found: &Attribution) -> Imitation {
    let mut order: Vec<usize> = (0..library.hypotheses.len()).collect();
    let gain = |index: &usize| found.alone.get(*index).copied().filter(|gain| gain.is_finite());
    order.retain(|index| gain(index).is_some());
    order.sort_by(|one, other| gain(other).unwrap_or(0.0).total_cmp(&gain(one).unwrap_or(0.0)));
    let mut compared: Vec<usize> = Vec::new();
    let chosen = found.chosen.iter().map(|chosen| chosen.hypothesis);
    for index in chosen.chain(order) {
        let name = library.hypotheses[index].effect();
        let is_new = compared.iter().all(|known| library.hypotheses[*known].effect() != name);
        if is_new && !library.hypotheses[index].small().is_empty() && compared.len() < MOST {
            compared.push(index);
        }
    }
    let share = |row: usize, column: usize| -> f64 {
        if row == column {
            return 1.0;
        }
        let (own, other) = (library.hypotheses[row].small(), library.hypotheses[column].small());
        let places: Vec<usize> = own.iter().chain(other).copied().collect();
        let screen = library.screen(&places, &found.scores);
        let (first, second): (Vec<usize>, Vec<usize>) = ((0..own.len()).collect(), (own.len()..places.len()).collect());
        let theta = screen.estimate(&first).map(|estimate| estimate.parameters);
        let sized = theta.filter(|theta: &DVector<f64>| theta.norm() > 0.0);
        let imitated = sized.and_then(|theta| screen.imitation(&first, &theta, &second));
        imitated.map_or(0.0, |(share, _)| share)
    };
    Imitation {
        effects: compared
            .iter()
            .map(|index| library.hypotheses[*index].effect())
            .collect(),
        shares: compared
            .iter()
            .map(|row| compared.iter().map(|column| share(*row, *column)).collect())
            .collect(),
    }
}
