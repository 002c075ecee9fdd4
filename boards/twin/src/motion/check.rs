//! What every motion must satisfy: its rates are the derivatives of its attitude.

use nalgebra::Vector3;

use super::Motion;

/// \[s\] half the step of the difference quotients.
const H: f64 = 1e-4;
/// Truncation of the quotients, relative to the largest rate (for `w`) and acceleration (for `w'`) of the motion: both
/// change on scales of 0.1 s or more, so (H / 0.1)^2 / 6 with a margin for pieces that meet within one step.
const RELATIVE: f64 = 2e-5;

/// Compares rate and angular acceleration with central differences at 997 instants between `from_s` and `to_s`.
pub fn derivatives(motion: &dyn Motion, from_s: f64, to_s: f64) {
    let instants = || (0..997).map(|i| from_s + (to_s - from_s) * (f64::from(i) + 0.37) / 997.0);
    let most = |of: &dyn Fn(f64) -> Vector3<f64>| instants().map(|t| of(t).norm()).fold(1e-3, f64::max);
    let most_rate = most(&|t| motion.at(t).attitude.rate_nb_b);
    let most_acc = most(&|t| motion.at(t).attitude.rate_dot_nb_b);
    for t in instants() {
        let (before, now, after) = (
            motion.at(t - H).attitude,
            motion.at(t).attitude,
            motion.at(t + H).attitude,
        );
        let turned = before.q_nb.inverse() * after.q_nb;
        let rate_error = (turned.scaled_axis() / (2.0 * H) - now.rate_nb_b).norm();
        assert!(
            rate_error < RELATIVE * (most_rate + most_acc * 0.1),
            "rate at {t}: off by {rate_error}"
        );
        let acc_error = ((after.rate_nb_b - before.rate_nb_b) / (2.0 * H) - now.rate_dot_nb_b).norm();
        assert!(
            acc_error < 50.0 * RELATIVE * most_acc,
            "angular acceleration at {t}: off by {acc_error}"
        );
    }
}
