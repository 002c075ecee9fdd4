//! Readings in rows of one step, moved in time and filtered.
//!
//! In: a vector a row. Out: as many rows. A reading between two rows is the sum of its neighbours under a sinc in a Hann window of
//! [`TAPS`] rows to either side (Shannon 1949; Laakso et al., Splitting the unit delay, 1996), which keeps noise white that was. A lag
//! is that of a first order, exact for what is straight from row to row. Ends are continued by their last value.

use nalgebra::Vector3;

/// Rows to either side of the interpolation's kernel.
const TAPS: isize = 16;

/// Weights of the rows from `1 - TAPS` to `TAPS` around a place, which is `part` of a row behind row 0.
fn kernel(part: f64) -> [f64; 2 * TAPS as usize] {
    let mut weights = std::array::from_fn(|at| {
        let away = (at as isize + 1 - TAPS) as f64 - part;
        let sinc = match away.abs() < 1e-12 {
            true => 1.0,
            false => (std::f64::consts::PI * away).sin() / (std::f64::consts::PI * away),
        };
        sinc * 0.5 * (1.0 + (std::f64::consts::PI * away / TAPS as f64).cos())
    });
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum);
    weights
}

/// What stood `rows(i)` rows before row `i`.
pub fn late(values: &[Vector3<f64>], rows: impl Fn(usize) -> f64) -> Vec<Vector3<f64>> {
    let last = values.len() as isize - 1;
    let mut known: Option<(f64, [f64; 2 * TAPS as usize])> = None;
    (0..values.len())
        .map(|row| {
            let place = row as f64 - rows(row);
            let (whole, part) = (place.floor() as isize, place - place.floor());
            let weights = match known {
                Some((same, weights)) if same == part => weights,
                _ => kernel(part),
            };
            known = Some((part, weights));
            let at = |offset: usize| values[(whole + offset as isize + 1 - TAPS).clamp(0, last) as usize];
            weights
                .iter()
                .enumerate()
                .map(|(offset, weight)| at(offset) * *weight)
                .sum()
        })
        .collect()
}

/// Through a lag of the first order of so many rows, settled when it begins.
pub fn lagged(values: &[Vector3<f64>], rows: f64) -> Vec<Vector3<f64>> {
    let Some(first) = values.first() else {
        return Vec::new();
    };
    let decay = (-1.0 / rows).exp();
    let later = 1.0 - rows * (1.0 - decay);
    let (mut state, mut before) = (*first, *first);
    values
        .iter()
        .map(|now| {
            state = state * decay + before * (1.0 - decay - later) + now * later;
            before = *now;
            state
        })
        .collect()
}

/// The mean of the rows up to `half` away, those at the ends by half.
pub fn mean(values: &[Vector3<f64>], half: usize) -> Vec<Vector3<f64>> {
    let (half, last) = (half as isize, values.len() as isize - 1);
    if half == 0 {
        return values.to_vec();
    }
    let at = |row: isize| values[row.clamp(0, last) as usize];
    (0..=last)
        .map(|row| {
            let inner: Vector3<f64> = (1 - half..half).map(|offset| at(row + offset)).sum();
            (inner + 0.5 * (at(row - half) + at(row + half))) / (2 * half) as f64
        })
        .collect()
}

/// How fast it changes, per row, over the rows up to `half` away: the slope of a line through them.
pub fn slope(values: &[Vector3<f64>], half: usize) -> Vec<Vector3<f64>> {
    let (half, last) = (half.max(1) as isize, values.len() as isize - 1);
    let squares: f64 = (1..=half).map(|offset| 2.0 * (offset * offset) as f64).sum();
    let at = |row: isize| values[row.clamp(0, last) as usize];
    (0..=last)
        .map(|row| {
            let sum: Vector3<f64> = (1..=half)
                .map(|offset| (at(row + offset) - at(row - offset)) * offset as f64)
                .sum();
            sum / squares
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a sine of `rows` a period.
    fn sine(count: usize, rows: f64) -> Vec<Vector3<f64>> {
        (0..count)
            .map(|row| Vector3::x() * (std::f64::consts::TAU * row as f64 / rows).sin())
            .collect()
    }

    #[test]
    fn a_delay_of_a_part_of_a_row_is_that_of_a_sine() {
        let values = sine(400, 12.0);
        let moved = late(&values, |_| 2.3);
        for (row, moved) in moved.iter().enumerate().take(360).skip(40) {
            let exact = (std::f64::consts::TAU * (row as f64 - 2.3) / 12.0).sin();
            assert!((moved.x - exact).abs() < 2e-3, "{row}: {} {exact}", moved.x);
        }
        let same = late(&values, |_| 0.0);
        assert!(
            same.iter()
                .zip(&values)
                .all(|(one, other)| (one - other).norm() < 1e-12)
        );
    }

    #[test]
    fn a_lag_and_a_slope_of_a_sine_are_those_of_the_books() {
        let (rows, tau) = (200.0, 9.0);
        let (values, w) = (sine(2000, rows), std::f64::consts::TAU / rows);
        let (lagging, slopes) = (lagged(&values, tau), slope(&values, 3));
        for row in 500..1500 {
            let phase = w * row as f64;
            let exact = (phase - (w * tau).atan()).sin() / (1.0 + (w * tau).powi(2)).sqrt();
            assert!((lagging[row].x - exact).abs() < 1e-4, "{row}");
            assert!((slopes[row].x - w * phase.cos()).abs() < 0.01 * w, "{row}");
        }
    }
}
