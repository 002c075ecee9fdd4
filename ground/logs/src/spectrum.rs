//! Power spectral density of a record, after Welch.
//!
//! In: values on a uniform grid. Out: one-sided densities `(f [Hz], unit^2/Hz)`: the mean over segments of half overlap, each
//! freed of its mean and tapered by a Hann window (Welch, "The use of fast Fourier transform for the estimation of
//! power spectra", 1967). A white rate of angle random walk `N` has the density `2 N^2`, as IEEE 952 draws it one-sided.
//!
//! Records shorter than [`SHORTEST`] have no spectrum.

use std::f64::consts::PI;

use twin::fourier::{self, Complex};

/// Fewest values with a spectrum.
pub const SHORTEST: usize = 64;
/// Longest segment: finer than this no plot shows.
const LONGEST_SEGMENT: usize = 1 << 14;
/// A peak stands this many times above the median of its surroundings; of 8 averaged segments of pure noise one bin in
/// ten million does.
const PEAK: f64 = 8.0;
/// Bins on either side that are its surroundings.
const SURROUNDINGS: usize = 24;

/// Density of contiguous values sampled every `step_s`.
pub fn welch(values: &[f64], step_s: f64) -> Vec<(f64, f64)> {
    if values.len() < SHORTEST {
        return Vec::new();
    }
    // At least eight half-overlapping segments, so that a peak is not noise.
    let length = (values.len() / 4).next_power_of_two().min(LONGEST_SEGMENT) / 2;
    let window: Vec<f64> = (0..length)
        .map(|k| 0.5 - 0.5 * (2.0 * PI * (k as f64 + 0.5) / length as f64).cos())
        .collect();
    let norm = 2.0 * step_s / window.iter().map(|w| w * w).sum::<f64>();
    let fft = fourier::forward(length);
    let mut power = vec![0.0; length / 2];
    let mut segments = 0.0;
    for start in (0..=values.len() - length).step_by(length / 2) {
        let segment = &values[start..start + length];
        let mean = segment.iter().sum::<f64>() / length as f64;
        let mut buffer: Vec<Complex<f64>> = segment
            .iter()
            .zip(&window)
            .map(|(value, w)| Complex::new((value - mean) * w, 0.0))
            .collect();
        fft.process(&mut buffer);
        power
            .iter_mut()
            .zip(&buffer)
            .for_each(|(power, bin)| *power += bin.norm_sqr());
        segments += 1.0;
    }
    let frequency = 1.0 / (length as f64 * step_s);
    let bins = power.into_iter().enumerate().skip(1);
    bins.map(|(k, power)| (k as f64 * frequency, norm * power / segments))
        .collect()
}

/// Frequency of the peak that stands out most of its surroundings, if any does \[Hz\].
pub fn peak(density: &[(f64, f64)]) -> Option<f64> {
    let above = |k: usize| {
        let around = &density[k.saturating_sub(SURROUNDINGS)..density.len().min(k + SURROUNDINGS + 1)];
        let mut powers: Vec<f64> = around.iter().map(|(_, power)| *power).collect();
        let middle = powers.len() / 2;
        let median = *powers.select_nth_unstable_by(middle, f64::total_cmp).1;
        if median > 0.0 { density[k].1 / median } else { 0.0 }
    };
    // The lowest bins climb steeply under any random walk; what the window leaks there is no line.
    let highest = (SURROUNDINGS / 4..density.len())
        .map(|k| (density[k].0, above(k)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    (highest.1 > PEAK).then_some(highest.0)
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;

    fn white(count: usize) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    #[test]
    fn white_noise_has_twice_its_variance_times_the_interval() {
        let density = welch(&white(65_536), 0.05);
        let mean = density.iter().map(|(_, power)| power).sum::<f64>() / density.len() as f64;
        // 65,536 values know their own variance to 0.6 %; three of that.
        assert!((mean / 0.1 - 1.0).abs() < 0.018, "{mean}");
        assert_eq!(peak(&density), None);
    }

    #[test]
    fn a_line_a_third_as_strong_as_the_noise_is_found_at_its_frequency() {
        let values: Vec<f64> = white(16_384)
            .iter()
            .enumerate()
            .map(|(k, noise)| noise + 0.33 * (2.0 * PI * 6.3 * k as f64 * 0.05).sin())
            .collect();
        let found = peak(&welch(&values, 0.05)).expect("line");
        assert!((found - 6.3).abs() < 0.02, "{found}");
    }

    #[test]
    fn a_short_record_has_no_spectrum() {
        assert!(welch(&[1.0; 63], 1.0).is_empty() && peak(&[]).is_none());
    }
}
