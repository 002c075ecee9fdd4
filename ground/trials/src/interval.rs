//! The interval of a proportion: Clopper and Pearson (Biometrika 26, 1934), which never covers less than it says.

use statrs::distribution::{Beta, ContinuousCDF};

/// 95 % interval of a proportion of which `hits` of `trials` were seen; all of [0, 1] for no trial.
pub fn clopper_pearson(hits: usize, trials: usize) -> (f64, f64) {
    const TAIL: f64 = 0.025;
    let (k, n) = (hits.min(trials) as f64, trials as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).ok().map(|beta| beta.inverse_cdf(p));
    let least = quantile(k, n - k + 1.0, TAIL).unwrap_or(0.0);
    let most = quantile(k + 1.0, n - k, 1.0 - TAIL).unwrap_or(1.0);
    (least, most)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the printed tables.
    const PRINTED: f64 = 5e-4;

    #[test]
    fn it_is_the_tables() {
        // Clopper and Pearson 1934; also R: binom.test(8, 10), binom.test(0, 60), binom.test(60, 60).
        for (hits, trials, least, most) in [
            (8, 10, 0.4439, 0.9748),
            (0, 60, 0.0, 0.0596),
            (60, 60, 0.9404, 1.0),
            (0, 0, 0.0, 1.0),
        ] {
            let found = clopper_pearson(hits, trials);
            assert!(
                (found.0 - least).abs() < PRINTED && (found.1 - most).abs() < PRINTED,
                "{hits}/{trials}: {found:?}"
            );
        }
    }
}
