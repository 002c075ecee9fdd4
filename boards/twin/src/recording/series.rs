//! Samples of a vector over time, and the straight lines between them.
//!
//! In: samples in order of time, two at least (`Table` sees to both). Out: the value at any time; before the first
//! sample it is the first, after the last the last.

use nalgebra::SVector;

/// Samples of a vector of N components.
#[derive(Clone, Debug)]
pub struct Series<const N: usize> {
    t_s: Vec<f64>,
    values: Vec<SVector<f64, N>>,
}

impl<const N: usize> Series<N> {
    /// Of these samples; `None` unless there are two or more, each later than the one before.
    pub fn new(t_s: Vec<f64>, values: Vec<SVector<f64, N>>) -> Option<Self> {
        let in_order = t_s.windows(2).all(|pair| pair[0] < pair[1]);
        (t_s.len() >= 2 && t_s.len() == values.len() && in_order).then_some(Self { t_s, values })
    }

    /// \[s\] the instants.
    pub fn t_s(&self) -> &[f64] {
        &self.t_s
    }

    /// The values at them.
    pub fn values(&self) -> &[SVector<f64, N>] {
        &self.values
    }

    /// \[s\] first and last instant.
    pub fn span_s(&self) -> (f64, f64) {
        (self.t_s[0], self.t_s[self.t_s.len() - 1])
    }

    /// The values turned, scaled or otherwise replaced one by one.
    pub fn map(mut self, mut each: impl FnMut(SVector<f64, N>) -> SVector<f64, N>) -> Self {
        for value in &mut self.values {
            *value = each(*value);
        }
        self
    }

    /// With its times in another unit, `factor` of this one.
    pub fn with_times_scaled(mut self, factor: f64) -> Self {
        for t_s in &mut self.t_s {
            *t_s *= factor;
        }
        self
    }

    /// The same, unless `each` refuses a value.
    pub fn try_map<E>(
        mut self,
        mut each: impl FnMut(SVector<f64, N>) -> Result<SVector<f64, N>, E>,
    ) -> Result<Self, E> {
        for value in &mut self.values {
            *value = each(*value)?;
        }
        Ok(self)
    }

    /// Index of the sample before `t_s`, and how far [0, 1] it is from there to the next.
    pub fn interval(&self, t_s: f64) -> (usize, f64) {
        let (first, last) = self.span_s();
        let intervals = self.t_s.len() - 1;
        // Recordings are uniform but for gaps: the proportional guess is nearly always right, a search is not needed.
        let guess = ((t_s - first) / (last - first) * intervals as f64) as usize;
        let within = |i: usize| i < intervals && self.t_s[i] <= t_s && t_s < self.t_s[i + 1];
        let i = if within(guess) {
            guess
        } else {
            self.t_s
                .partition_point(|&sample_s| sample_s <= t_s)
                .clamp(1, intervals)
                - 1
        };
        let (from, to) = (self.t_s[i], self.t_s[i + 1]);
        (i, ((t_s - from) / (to - from)).clamp(0.0, 1.0))
    }

    /// On the straight line between the samples around `t_s`.
    pub fn linear(&self, t_s: f64) -> SVector<f64, N> {
        let (i, part) = self.interval(t_s);
        self.values[i] * (1.0 - part) + self.values[i + 1] * part
    }

    /// Its derivative at each sample: central differences, one-sided at both ends.
    pub fn slopes(&self) -> Self {
        let last = self.t_s.len() - 1;
        let slope = |i: usize| {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
            (self.values[after] - self.values[before]) / (self.t_s[after] - self.t_s[before])
        };
        Self {
            t_s: self.t_s.clone(),
            values: (0..=last).map(slope).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector1;

    use super::*;

    fn series(samples: &[(f64, f64)]) -> Series<1> {
        let (t_s, values) = samples.iter().map(|&(t, v)| (t, Vector1::new(v))).unzip();
        Series::new(t_s, values).unwrap()
    }

    #[test]
    fn it_gives_back_each_sample_and_holds_the_first_and_the_last() {
        let uneven = series(&[(1.0, 5.0), (1.5, 7.0), (4.0, 2.0), (4.1, 3.0), (9.0, 1.0)]);
        for (t, value) in [
            (1.0, 5.0),
            (1.5, 7.0),
            (4.0, 2.0),
            (4.1, 3.0),
            (9.0, 1.0),
            (-3.0, 5.0),
            (99.0, 1.0),
        ] {
            assert_eq!(uneven.linear(t).x, value, "at {t}");
        }
        assert_eq!(uneven.linear(2.75).x, 4.5);
    }

    #[test]
    fn not_a_time_is_no_reason_to_panic() {
        assert!(series(&[(0.0, 5.0), (1.0, 7.0)]).linear(f64::NAN).x.is_nan());
    }

    #[test]
    fn slopes_are_central_within_and_one_sided_at_the_ends() {
        let slopes = series(&[(0.0, 0.0), (1.0, 1.0), (2.0, 4.0), (3.0, 9.0)]).slopes();
        let at = |t: f64| slopes.linear(t).x;
        assert_eq!([at(0.0), at(1.0), at(2.0), at(3.0)], [1.0, 2.0, 4.0, 5.0]);
    }

    #[test]
    fn fewer_than_two_samples_or_time_out_of_order_are_no_series() {
        let one = vec![Vector1::new(0.0)];
        assert!(Series::new(vec![0.0], one.clone()).is_none());
        assert!(Series::new(vec![1.0, 1.0], vec![one[0], one[0]]).is_none());
    }
}
