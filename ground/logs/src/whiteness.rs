//! Whether a filter's innovations are what it says: white, Gaussian, of the right size (thesis chapter 8, item 4).
//!
//! In: residuals over their standard deviations, one series a quantity. Out: three figures and a verdict each.
//!
//! * size: mean square, 1 for an honest variance; its 95 % band is `1 +- 1.96 sqrt(2/n)`;
//! * white: correlation of neighbours, 0; band `+- 1.96/sqrt(n)`;
//! * Gaussian: part of the residuals within one standard deviation of their own, 68.3 %; band
//!   `+- 1.96 sqrt(0.683 0.317/n)`. It asks for the shape, whatever the size.

/// What a series shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// Residuals in it.
    pub count: usize,
    /// Mean square of the normalised residuals.
    pub size: f64,
    /// Correlation of neighbours.
    pub correlation: f64,
    /// Part within one standard deviation of their own.
    pub within_one_sd: f64,
}

/// Part of a normal distribution within one standard deviation.
const NORMAL_WITHIN: f64 = 0.682_689_5;

impl Check {
    /// Of normalised residuals in the order they came; `None` for fewer than ten or all zero.
    pub fn of(residuals: &[f64]) -> Option<Check> {
        let count = residuals.len() as f64;
        let size = residuals.iter().map(|residual| residual * residual).sum::<f64>() / count;
        if residuals.len() < 10 || size.is_nan() || size <= 0.0 {
            return None;
        }
        let products: f64 = residuals.windows(2).map(|pair| pair[0] * pair[1]).sum();
        let within = residuals
            .iter()
            .filter(|residual| residual.abs() <= size.sqrt())
            .count();
        Some(Check {
            count: residuals.len(),
            size,
            correlation: products / (count - 1.0) / size,
            within_one_sd: within as f64 / count,
        })
    }

    /// Whether the size is in its band.
    pub fn is_of_size(&self) -> bool {
        (self.size - 1.0).abs() < 1.96 * (2.0 / self.count as f64).sqrt()
    }

    /// Whether neighbours are uncorrelated.
    pub fn is_white(&self) -> bool {
        self.correlation.abs() < 1.96 / (self.count as f64).sqrt()
    }

    /// Whether the shape is normal.
    pub fn is_gaussian(&self) -> bool {
        let band = 1.96 * (NORMAL_WITHIN * (1.0 - NORMAL_WITHIN) / self.count as f64).sqrt();
        (self.within_one_sd - NORMAL_WITHIN).abs() < band
    }

    /// In one line.
    pub fn line(&self) -> String {
        let said = |good: bool| if good { "yes" } else { "no" };
        format!(
            "size {:.2} ({}), neighbours {:+.2} ({}), within one sd {:.0} % ({}), {} residuals",
            self.size,
            said(self.is_of_size()),
            self.correlation,
            said(self.is_white()),
            100.0 * self.within_one_sd,
            said(self.is_gaussian()),
            self.count,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of twelve uniform numbers less six: near enough to normal for these bands.
    fn normal(count: usize) -> Vec<f64> {
        let mut state = 7_u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..count)
            .map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0)
            .collect()
    }

    fn verdicts(residuals: &[f64]) -> (bool, bool, bool) {
        let check = Check::of(residuals).expect("enough");
        (check.is_of_size(), check.is_white(), check.is_gaussian())
    }

    #[test]
    fn white_normal_residuals_of_size_one_pass() {
        assert_eq!(verdicts(&normal(2000)), (true, true, true));
    }

    #[test]
    fn each_fault_is_seen_by_its_own_figure() {
        let good = normal(2000);
        let twice: Vec<f64> = good.iter().map(|residual| 2.0 * residual).collect();
        assert_eq!(verdicts(&twice), (false, true, true));
        let smooth: Vec<f64> = good
            .windows(2)
            .map(|pair| (pair[0] + pair[1]) / 2.0_f64.sqrt())
            .collect();
        assert!(!verdicts(&smooth).1);
        let two_valued: Vec<f64> = good.iter().map(|residual| residual.signum()).collect();
        assert!(!verdicts(&two_valued).2);
    }

    #[test]
    fn too_few_or_all_zero_say_nothing() {
        assert_eq!(Check::of(&[1.0; 9]), None);
        assert_eq!(Check::of(&[0.0; 100]), None);
        assert_eq!(Check::of(&[f64::NAN; 100]), None);
    }
}
