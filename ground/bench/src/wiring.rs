//! Which channel is which: exchanged plugs, inverted outputs, a frame read another way.
//!
//! In: the axes a calibration found and the nominal ones, unit vectors in b, one a channel. Out: every assignment of
//! channels to nominal axes, with a polarity for each and a reading of the frame for all, that fits as well as the best;
//! fit is `sqrt(sum |found - nominal|^2)`. What all the simplest of them share is certain, the rest is a matter of
//! convention: a tetrahedron looks the same in a mirror with two plugs exchanged.
//!
//! All orders are tried up to [`ALL_ORDERS`] channels; beyond, exchanges of two channels are, one after the other.

use nalgebra::Vector3;

use crate::consensus::Reading;

/// Most channels of which all orders are tried (with 48 frames each).
const ALL_ORDERS: usize = 5;

/// Fits within this factor of the best one are as good: mirror images of the nominal geometry differ by its rounding.
const AS_GOOD: f64 = 1.0 + 1e-6;

/// An honest wiring is kept unless another fits better by this factor: axes are crooked, plugs are not slightly exchanged.
const CLEARLY: f64 = 3.0;

/// One way in which the channels may be connected.
#[derive(Clone, Debug, PartialEq)]
pub struct Wiring {
    /// Nominal axis each channel has.
    pub axis: Vec<usize>,
    /// Channels whose output is inverted.
    pub inverted: Vec<bool>,
    /// How the frame of the excitation must be read.
    pub frame: Reading,
    /// `sqrt(sum |found - nominal|^2)`.
    pub misfit: f64,
}

impl Wiring {
    /// Whether everything is as it should be.
    pub fn honest(&self) -> bool {
        self.frame.changes() == 0 && self.changes() == 0
    }

    /// Channels moved and outputs inverted.
    pub fn changes(&self) -> usize {
        let moved = self.axis.iter().enumerate().filter(|&(k, &axis)| k != axis).count();
        moved + self.inverted.iter().filter(|&&inverted| inverted).count()
    }

    /// In words, with the channels' names.
    pub fn words(&self, channels: &[String]) -> String {
        let name = |k: usize| channels.get(k).map_or("?", String::as_str);
        let mut words = Vec::new();
        for (k, &inverted) in self.inverted.iter().enumerate() {
            if inverted {
                words.push(format!("{} inverted", name(k)));
            }
        }
        for (k, &axis) in self.axis.iter().enumerate() {
            if k != axis {
                words.push(format!("{} on the axis of {}", name(k), name(axis)));
            }
        }
        if self.frame.changes() > 0 {
            words.push(format!("excitation (x, y, z) read as {}", self.frame.words()));
        }
        if words.is_empty() {
            "as drawn".into()
        } else {
            words.join(", ")
        }
    }
}

/// All wirings that fit as well as the best, the simplest first; fewer turned frames before fewer inversions before
/// fewer exchanges. The honest one alone if none is clearly better.
pub fn wirings(found_b: &[Vector3<f64>], nominal_b: &[Vector3<f64>]) -> Vec<Wiring> {
    if found_b.len() != nominal_b.len() || found_b.is_empty() {
        return Vec::new();
    }
    let frames = Reading::all();
    let mut list: Vec<Wiring> = frames
        .into_iter()
        .flat_map(|frame| of_frame(found_b, nominal_b, frame))
        .collect();
    let best = list.iter().map(|wiring| wiring.misfit).fold(f64::INFINITY, f64::min);
    if let Some(honest) = list.iter().find(|wiring| wiring.honest())
        && honest.misfit <= CLEARLY * best + f64::EPSILON
    {
        return vec![honest.clone()];
    }
    list.retain(|wiring| wiring.misfit <= best * AS_GOOD + f64::EPSILON);
    list.sort_by_key(|wiring| {
        let inverted = wiring.inverted.iter().filter(|&&inverted| inverted).count();
        (wiring.frame.changes(), inverted, wiring.changes())
    });
    list
}

/// Channels that every one of the wirings with the fewest inversions has inverted.
pub fn surely_inverted(wirings: &[Wiring]) -> Vec<usize> {
    let count = |wiring: &Wiring| wiring.inverted.iter().filter(|&&inverted| inverted).count();
    let least = wirings.iter().map(count).min().unwrap_or(0);
    let simplest: Vec<&Wiring> = wirings.iter().filter(|wiring| count(wiring) == least).collect();
    let channels = wirings.first().map_or(0, |wiring| wiring.inverted.len());
    (0..channels)
        .filter(|&k| simplest.iter().all(|wiring| wiring.inverted.get(k) == Some(&true)))
        .collect()
}

fn of_frame(found_b: &[Vector3<f64>], nominal_b: &[Vector3<f64>], frame: Reading) -> Vec<Wiring> {
    let turned: Vec<Vector3<f64>> = nominal_b.iter().map(|axis_b| frame.of(axis_b)).collect();
    let judge = |axis: &[usize]| {
        let inverted: Vec<bool> = axis
            .iter()
            .zip(found_b)
            .map(|(&k, found)| found.dot(&turned[k]) < 0.0)
            .collect();
        let error = |k: usize| {
            let sign = if inverted[k] { -1.0 } else { 1.0 };
            (found_b[k] - turned[axis[k]] * sign).norm_squared()
        };
        let misfit = (0..axis.len()).map(error).sum::<f64>().sqrt();
        Wiring {
            axis: axis.to_vec(),
            inverted,
            frame,
            misfit,
        }
    };
    let straight: Vec<usize> = (0..found_b.len()).collect();
    if found_b.len() <= ALL_ORDERS {
        return orders(&straight).iter().map(|order| judge(order)).collect();
    }
    let mut best = judge(&straight);
    let mut list = vec![best.clone()];
    loop {
        let exchanges = (0..straight.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let tried = exchanges.map(|(a, b)| {
            let mut axis = best.axis.clone();
            axis.swap(a, b);
            judge(&axis)
        });
        match tried.min_by(|a, b| a.misfit.total_cmp(&b.misfit)) {
            Some(better) if better.misfit < best.misfit - f64::EPSILON => best = better,
            _ => break,
        }
    }
    list.push(best);
    list.dedup();
    list
}

fn orders(items: &[usize]) -> Vec<Vec<usize>> {
    if items.len() < 2 {
        return vec![items.to_vec()];
    }
    let with_first = |k: usize| {
        let mut rest = items.to_vec();
        let first = rest.remove(k);
        orders(&rest).into_iter().map(move |mut order| {
            order.insert(0, first);
            order
        })
    };
    (0..items.len()).flat_map(with_first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron without mirror symmetry, so that there is one answer.
    fn axes() -> Vec<Vector3<f64>> {
        let list = [[0.9, 0.1, 0.4], [-0.2, 0.95, 0.2], [0.3, -0.5, 0.8], [-0.6, -0.6, -0.5]];
        list.iter().map(|axis| Vector3::from(*axis).normalize()).collect()
    }

    #[test]
    fn crooked_axes_alone_are_no_wiring_error() {
        let crooked: Vec<_> = axes()
            .iter()
            .map(|axis| (axis + Vector3::new(0.02, -0.01, 0.0)).normalize())
            .collect();
        let found = wirings(&crooked, &axes());
        assert_eq!(found.len(), 1);
        assert!(found[0].honest());
    }

    #[test]
    fn exchanged_and_inverted_channels_are_named() {
        let mut wired = axes();
        wired.swap(1, 2);
        wired[3] = -wired[3];
        let found = wirings(&wired, &axes());
        let names = ["g1", "g2", "g3", "g4"].map(String::from);
        assert_eq!(
            found[0].words(&names),
            "g4 inverted, g2 on the axis of g3, g3 on the axis of g2"
        );
        assert_eq!(surely_inverted(&found), [3]);
    }

    #[test]
    fn exchanges_among_many_channels_are_found_too() {
        let many: Vec<_> = (0..12)
            .map(|k| Vector3::new(f64::from(k).sin(), f64::from(3 * k).cos(), f64::from(k * k % 7) - 3.0).normalize())
            .collect();
        let mut wired = many.clone();
        wired.swap(4, 9);
        wired[2] = -wired[2];
        let found = wirings(&wired, &many);
        assert_eq!((found[0].axis[4], found[0].axis[9], found[0].inverted[2]), (9, 4, true));
        assert_eq!(found[0].changes(), 3);
    }
}
