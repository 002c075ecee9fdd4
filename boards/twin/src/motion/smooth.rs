//! The smoothing spline through noisy samples of a vector.
//!
//! In: a [`Series`] and a corner frequency. Out: the series with each sample moved to where the spline passes that minimises
//! `sum (y_i - g(t_i))^2 + lambda integral g''^2` (Reinsch 1967; Green and Silverman 1994, section 2.3). On even samples of
//! step h it is a low-pass without phase, of gain `1/(1 + lambda h w^4)`, so `lambda = 1/(h w_c^4)` puts the half at w_c.
//! What it takes off is smoothed once more and given back (Tukey's twicing), for a gain of `1 - (x/(1 + x))^2`,
//! x = (w/w_c)^4: a quarter of the way to the corner a rate is then 1.5e-5 short and not 0.4 %, which would be a scale error.
//! A truth instrument resolves microns and microradians, which its rate turns into accelerations of metres per second
//! squared; a hand or a table has none of that above some ten hertz.
//!
//! The second derivatives c solve `(R + lambda Q'Q) c = Q'y`, five diagonals wide, and the samples move by `-lambda Q c`.

use core::f64::consts::TAU;

use nalgebra::SVector;

use crate::recording::Series;

/// The samples, smoothed so that at `corner_hz` three quarters are left; `step_s` is the usual step between them.
pub fn smoothed<const N: usize>(samples: &Series<N>, corner_hz: f64, step_s: f64) -> Vec<SVector<f64, N>> {
    let t = samples.t_s();
    let mut smooth = once(t, samples.values(), corner_hz, step_s);
    let taken: Vec<SVector<f64, N>> = samples.values().iter().zip(&smooth).map(|(y, g)| y - g).collect();
    let back = once(t, &taken, corner_hz, step_s);
    smooth.iter_mut().zip(back).for_each(|(g, back)| *g += back);
    smooth
}

fn once<const N: usize>(t: &[f64], y: &[SVector<f64, N>], corner_hz: f64, step_s: f64) -> Vec<SVector<f64, N>> {
    let inner = t.len().saturating_sub(2);
    let lambda = 1.0 / (step_s * (TAU * corner_hz).powi(4));
    let h = |i: usize| t[i + 1] - t[i];
    // Column k of Q, for the samples k, k + 1, k + 2.
    let q = |k: usize| [1.0 / h(k), -1.0 / h(k) - 1.0 / h(k + 1), 1.0 / h(k + 1)];
    // LDL' of the five diagonals, and the right side carried along.
    let (mut diagonal, mut first, mut second) = (vec![0.0; inner], vec![0.0; inner], vec![0.0; inner]);
    let mut bends: Vec<SVector<f64, N>> = Vec::with_capacity(inner);
    for k in 0..inner {
        let own = q(k);
        let mut pivot = (h(k) + h(k + 1)) / 3.0 + lambda * (own[0] * own[0] + own[1] * own[1] + own[2] * own[2]);
        let mut bend = y[k] * own[0] + y[k + 1] * own[1] + y[k + 2] * own[2];
        let next = (k + 1 < inner).then(|| q(k + 1));
        let mut beside = next.map_or(0.0, |next| {
            h(k + 1) / 6.0 + lambda * (own[1] * next[0] + own[2] * next[1])
        });
        if k >= 1 {
            pivot -= first[k - 1] * first[k - 1] * diagonal[k - 1];
            beside -= first[k - 1] * second[k - 1] * diagonal[k - 1];
            bend -= bends[k - 1] * first[k - 1];
        }
        if k >= 2 {
            pivot -= second[k - 2] * second[k - 2] * diagonal[k - 2];
            bend -= bends[k - 2] * second[k - 2];
        }
        diagonal[k] = pivot;
        first[k] = beside / pivot;
        second[k] = if k + 2 < inner {
            lambda * own[2] * q(k + 2)[0] / pivot
        } else {
            0.0
        };
        bends.push(bend);
    }
    for k in (0..inner).rev() {
        let mut bend = bends[k] / diagonal[k];
        if k + 1 < inner {
            bend -= bends[k + 1] * first[k];
        }
        if k + 2 < inner {
            bend -= bends[k + 2] * second[k];
        }
        bends[k] = bend;
    }
    let mut moved = y.to_vec();
    for (k, bend) in bends.iter().enumerate() {
        for (i, weight) in q(k).into_iter().enumerate() {
            moved[k + i] -= bend * (lambda * weight);
        }
    }
    moved
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector1;

    use super::*;

    fn sine(hz: f64, step_s: f64) -> Series<1> {
        let t_s: Vec<f64> = (0..2000).map(|k| f64::from(k) * step_s).collect();
        let values = t_s.iter().map(|t| Vector1::new((TAU * hz * t).sin())).collect();
        Series::new(t_s, values).unwrap()
    }

    #[test]
    fn a_sine_keeps_its_phase_and_the_gain_of_its_frequency() {
        // The sampled second derivative differs from w^2 by (w h)^2/12: 0.2 % at 20 Hz and 1 ms.
        const SAMPLED: f64 = 2e-3;
        for hz in [1.0, 5.0, 10.0, 20.0] {
            let series = sine(hz, 0.001);
            let taken = 1.0 - 1.0 / (1.0 + (hz / 10.0_f64).powi(4));
            let gain = 1.0 - taken * taken;
            let smooth = smoothed(&series, 10.0, 0.001);
            for (smooth, value) in smooth.iter().zip(series.values()).skip(700).take(600) {
                let expected = gain * value.x;
                assert!(
                    (smooth.x - expected).abs() < SAMPLED,
                    "{hz} Hz: {} {expected}",
                    smooth.x
                );
            }
        }
    }

    #[test]
    fn a_straight_line_stays_where_it_is_whatever_the_gaps() {
        let t_s = vec![0.0, 0.1, 0.2, 1.7, 1.8, 1.9, 4.0];
        let line: Vec<Vector1<f64>> = t_s.iter().map(|t| Vector1::new(3.0 - 2.0 * t)).collect();
        let smooth = smoothed(&Series::new(t_s, line.clone()).unwrap(), 0.2, 0.1);
        assert!(smooth.iter().zip(&line).all(|(a, b)| (a - b).norm() < 1e-9));
    }

    #[test]
    fn two_samples_are_left_alone() {
        let two = Series::new(vec![0.0, 1.0], vec![Vector1::new(1.0), Vector1::new(5.0)]).unwrap();
        assert_eq!(smoothed(&two, 1.0, 1.0), two.values());
    }
}
