//! What was found on some windows, asked for on others.

use super::*;

#[test]
fn what_was_found_elsewhere_is_asked_for_alone() {
    let again = |hum: f64, what: &str| {
        let (views, joint) = scene();
        let mut residuals = noise(7);
        (residuals[1].iter_mut().enumerate()).for_each(|(row, value)| *value += hum * (row as f64 * 0.9).sin());
        recurrence(&views, &joint, &joint.fit(&residuals), &[], what)
    };
    let (there, not_there) = (again(0.6, "g1: a tone"), again(0.0, "g1: a tone"));
    assert!(
        there.is_some_and(|p| p < 0.02) && not_there.is_some_and(|p| p > 0.05),
        "{there:?} {not_there:?}"
    );
    // The calibration is the same in all windows, so that it recurs says nothing.
    assert_eq!(again(0.6, "g1: a calibration beyond its sigmas"), None);
}
