//! Whether channels that are said to scatter each by itself go one way together.
//!
//! In: what a fit leaves of some channels. Out: how little of their slow courses is not one common course, for any sizes and
//! signs that it has in them. Walks of several gyros are alike by chance, but not to a hundredth; a supply that they share is.

use nalgebra::{DMatrix, DVector};

use super::view::place;

/// Stretches whose means are a course: of seconds.
const STRETCHES: usize = 60;

/// Part that is always taken for not common, so that channels without a course say nothing.
const LEAST: f64 = 1e-6;

/// Minus the logarithm of the part of the courses' energy, each of unit energy about its mean, that is not along the one course
/// which has most; zero of fewer than two channels. A channel is the places of its samples in the fitted time, 0 to 1, and them.
pub fn alike<'a>(channels: impl Iterator<Item = (&'a [f64], &'a [f64])>) -> f64 {
    let courses: Vec<DVector<f64>> = channels.map(|(phases, values)| course(phases, values)).collect();
    if courses.len() < 2 {
        return 0.0;
    }
    let products = DMatrix::from_fn(courses.len(), courses.len(), |row, column| {
        courses[row].dot(&courses[column])
    });
    let all = products.trace();
    let most = products.symmetric_eigenvalues().max();
    -((all - most) / all.max(LEAST)).max(LEAST).ln()
}

fn course(phases: &[f64], values: &[f64]) -> DVector<f64> {
    let (mut sums, mut counts) = (DVector::zeros(STRETCHES), DVector::from_element(STRETCHES, 0.0));
    for (phase, value) in phases.iter().zip(values) {
        let stretch = place(*phase, STRETCHES);
        sums[stretch] += value;
        counts[stretch] += 1.0;
    }
    let means = sums.component_div(&counts.map(|count: f64| count.max(1.0)));
    // A channel without a course, or without samples, goes no way.
    let about_zero = means.add_scalar(-means.mean());
    about_zero
        .try_normalize(0.0)
        .unwrap_or_else(|| DVector::zeros(STRETCHES))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: usize = 600;

    #[test]
    fn one_course_of_any_sign_is_alike_and_several_are_not() {
        let phases: Vec<f64> = (0..SAMPLES).map(|row| row as f64 / SAMPLES as f64).collect();
        let ramp = |sign: f64, noise: f64| -> Vec<f64> {
            let value = |(row, phase): (usize, &f64)| sign * phase + noise * (row as f64 * 2.4).sin();
            phases.iter().enumerate().map(value).collect()
        };
        let wave: Vec<f64> = phases.iter().map(|phase| (9.0 * phase).sin()).collect();
        let of = |all: &[Vec<f64>]| alike(all.iter().map(|values| (phases.as_slice(), values.as_slice())));
        let common = of(&[ramp(1.0, 0.01), ramp(-3.0, 0.02), ramp(0.5, 0.0)]);
        let own = of(&[ramp(1.0, 0.01), wave]);
        assert!(common > 6.0 && own < 1.5, "{common} {own}");
        assert_eq!(of(&[ramp(1.0, 0.0)]), 0.0);
        assert!(of(&[vec![0.0; SAMPLES], vec![0.0; SAMPLES]]).is_finite());
    }
}
