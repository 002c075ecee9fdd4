//! Samples that do not belong to the noise.
//!
//! In: a [`Series`] of rates. Out: the series with its outliers turned into gaps, and which they were. A sample is an
//! outlier if it is more than a number of deviations from the median of the block of [`BLOCK`] it stands in, the deviation
//! being 1.4826 times the median absolute one (Riley, NIST SP 1065, section 10.11): blocks, so that a walk does not look
//! like outliers at its ends.
//!
//! Nothing is removed unless asked for, and everything removed is said: the tetrahedron thesis removed 16 of the samples
//! of one gyro and kept enough to make its deviation 617 times its noise.

use super::series::Series;

/// Samples a block has: some seconds of a gyro's noise.
const BLOCK: usize = 1_001;

/// Steps that are more than `deviations` from their surroundings, ascending.
pub fn far(series: &Series, deviations: f64) -> Vec<usize> {
    let mut outliers = Vec::new();
    for stretch in series.stretches().collect::<Vec<_>>() {
        let mut start = stretch.start;
        while start < stretch.end {
            // The last block of a stretch takes the rest along.
            let end = if stretch.end - start < 2 * BLOCK {
                stretch.end
            } else {
                start + BLOCK
            };
            let block = &series.values[start..end];
            let middle = median(block.iter().copied());
            let spread = 1.4826 * median(block.iter().map(|value| (value - middle).abs()));
            let far = |value: &f64| spread > 0.0 && (value - middle).abs() > deviations * spread;
            outliers.extend((start..end).filter(|k| far(&series.values[*k])));
            start = end;
        }
    }
    outliers
}

/// Takes out what is more than `deviations` from its surroundings; returns the steps taken out, ascending.
pub fn remove(series: &mut Series, deviations: f64) -> Vec<usize> {
    let outliers = far(series, deviations);
    for &k in &outliers {
        series.gaps.push(k..k + 1);
    }
    series.gaps.sort_by_key(|gap| gap.start);
    series.gaps.dedup_by(|later, earlier| {
        let touches = later.start == earlier.end;
        if touches {
            earlier.end = later.end;
        }
        touches
    });
    outliers
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    if values.is_empty() {
        0.0
    } else {
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp_with(outliers: &[(usize, f64)]) -> Series {
        let mut values: Vec<f64> = (0..5_000)
            .map(|k| f64::from(k) * 0.01 + f64::from(k * 7 % 11))
            .collect();
        outliers.iter().for_each(|(k, value)| values[*k] = *value);
        Series {
            step_s: 1.0,
            values,
            gaps: std::iter::once(10..12).collect(),
        }
    }

    #[test]
    fn outliers_become_gaps_and_are_named() {
        let mut series = ramp_with(&[(12, 900.0), (13, -900.0), (4_000, 200.0)]);
        assert_eq!(remove(&mut series, 5.0), [12, 13, 4_000]);
        assert_eq!(series.gaps, [10..14, 4_000..4_001]);
    }

    #[test]
    fn a_drift_is_not_an_outlier() {
        assert!(remove(&mut ramp_with(&[]), 5.0).is_empty());
    }

    #[test]
    fn a_record_that_mostly_stands_still_loses_nothing() {
        let mut series = Series {
            step_s: 1.0,
            values: vec![0.0; 100],
            gaps: Vec::new(),
        };
        series.values[50] = 1.0;
        assert!(remove(&mut series, 5.0).is_empty());
    }
}
