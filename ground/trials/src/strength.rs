//! How strong a disturbance must be to have the marginal signal to noise ratio that is wanted.
//!
//! In: the ratio wanted, and what measures it at a strength. Out: the strength, and the ratio that it has. What a clock or a range
//! hides at one size it does not at another, so each is measured.

/// Steps of the search for a strength, the largest factor of one, and the logarithm of one that is none.
const STEPS: usize = 6;
const FURTHEST: f64 = 10.0;
const CLOSE: f64 = 0.02;

/// Powers of the strength with which a ratio may go.
const POWERS: [f64; 2] = [0.5, 3.0];

/// The strength that has the ratio that is wanted, and the ratio that it has: less than what is wanted if that takes more than
/// the largest. The ratio goes with a `power` of the strength, of which each measurement tells more.
pub fn sized(wanted: f64, mut power: f64, largest: f64, at: impl Fn(f64) -> f64) -> (f64, f64) {
    let (mut strength, mut reached) = (1.0, at(1.0));
    let mut best = (strength, reached);
    for _ in 0..STEPS {
        let factor = (wanted / reached.max(f64::MIN_POSITIVE)).powf(1.0 / power);
        let next = (strength * factor.clamp(1.0 / FURTHEST, FURTHEST)).min(largest);
        let step = (next / strength).ln();
        if step.abs() < CLOSE {
            break;
        }
        let found = at(next);
        let told = (found / reached).ln() / step;
        if told.is_finite() {
            power = told.clamp(POWERS[0], POWERS[1]);
        }
        (strength, reached) = (next, found);
        if (reached / wanted).ln().abs() <= (best.1 / wanted).ln().abs() {
            best = (strength, reached);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_motion_does_not_bring_out_has_a_small_ratio() {
        assert_eq!(sized(12.0, 1.0, 5.0, |strength| 40.0 * strength).0, 0.3);
        // A leak of a rate about an axis that never turns.
        assert_eq!(sized(10.0, 1.0, 20.0, |_| 0.0), (20.0, 0.0));
        // A variance goes with the square.
        assert_eq!(sized(40.0, 2.0, 5.0, |strength| 0.1 * strength * strength), (5.0, 2.5));
        // A delay is hidden by the clock of its part as long as it is small.
        let (strength, reached) = sized(20.0, 1.0, 5.0, |strength| strength.max(8.0 * strength * strength));
        assert!(
            (reached / 20.0).ln().abs() < 0.1 && strength < 2.0,
            "{strength} {reached}"
        );
    }
}
