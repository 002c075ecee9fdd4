//! Energy by octave of frequency, with nothing lost between them.
//!
//! In: a series in the order of its rows. Out: the energy of each octave, from half the sampling rate downwards, and of all
//! that is below the last. The octaves are those of the orthonormal Haar wavelet (Percival and Walden, "Wavelet methods for
//! time series analysis", 2000, chapter 4), whose energies add up to that of the series exactly; they overlap in frequency
//! like a filter of two taps, so a tone also shows in the neighbours of its octave.
//!
//! A hole in the series is passed over: its neighbours are taken as consecutive.

use core::fmt;

/// Octaves at most: 2.5 Hz to 0.01 Hz for packets.
const DEEPEST: usize = 8;

/// Energies of the octaves, highest frequency first, then of what is below them; fewer for a short series.
pub fn energies(series: &[f64]) -> Vec<f64> {
    let mut energies = Vec::new();
    let mut smooth = series.to_vec();
    let mut lone = 0.0;
    while energies.len() < DEEPEST && smooth.len() >= 4 {
        let pairs = smooth.chunks_exact(2);
        // The last of an odd number goes with the slowest.
        lone += pairs.remainder().iter().map(|value| value * value).sum::<f64>();
        energies.push(pairs.clone().map(|pair| (pair[0] - pair[1]).powi(2) / 2.0).sum());
        smooth = pairs.map(|pair| (pair[0] + pair[1]) / 2f64.sqrt()).collect();
    }
    energies.push(lone + smooth.iter().map(|value| value * value).sum::<f64>());
    energies
}

/// A name for one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Octave {
    from_hz: f64,
    to_hz: f64,
}

impl Octave {
    /// Number `octave` of `count` for a series sampled every `step_s`.
    pub fn new(octave: usize, count: usize, step_s: f64) -> Self {
        let to_hz = 0.5 / step_s / f64::powi(2.0, octave as i32);
        Octave {
            from_hz: if octave + 1 == count { 0.0 } else { to_hz / 2.0 },
            to_hz,
        }
    }
}

impl fmt::Display for Octave {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.from_hz > 0.0 {
            write!(f, "{:.3} to {:.3} Hz", self.from_hz, self.to_hz)
        } else {
            write!(f, "below {:.3} Hz", self.to_hz)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_octaves_hold_the_whole_energy() {
        let series: Vec<f64> = (0..1501)
            .map(|k| (f64::from(k) * 0.7).sin() + 0.1 * f64::from(k % 7))
            .collect();
        let whole: f64 = series.iter().map(|value| value * value).sum();
        // Rounding of some thousand sums.
        assert!((energies(&series).iter().sum::<f64>() - whole).abs() < 1e-9 * whole);
    }

    #[test]
    fn a_fast_change_is_in_the_first_octave_and_a_constant_below_the_last() {
        let fast: Vec<f64> = (0..1024).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert_eq!(energies(&fast)[0], 1024.0);
        let slow = energies(&vec![1.0; 1024]);
        assert!((slow[DEEPEST] - 1024.0).abs() < 1e-9);
    }

    #[test]
    fn octaves_are_named_by_their_frequencies() {
        assert_eq!(Octave::new(0, 9, 0.2).to_string(), "1.250 to 2.500 Hz");
        assert_eq!(Octave::new(8, 9, 0.2).to_string(), "below 0.010 Hz");
    }

    #[test]
    fn a_short_series_is_all_below() {
        assert_eq!(energies(&[1.0, 2.0]), [5.0]);
    }
}
