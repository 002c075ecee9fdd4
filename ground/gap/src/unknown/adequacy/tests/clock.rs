//! A part's own clock, in a log and in those simulated.

use super::*;

#[test]
fn a_part_that_converts_by_its_own_clock_scatters_with_what_it_measures() {
    let (mut views, joint) = scene();
    for (channel, view) in views.iter_mut().enumerate() {
        view.clock = (channel == 0).then(|| Clock {
            period_s: 0.01,
            instants_s: (0..SAMPLES).map(|row| row as f64 * 0.2).collect(),
            slopes: (0..SAMPLES).map(|row| 300.0 * (row as f64 * 0.05).cos()).collect(),
        });
    }
    let logs: Vec<Fitted> = (1..=10)
        .map(|seed| {
            let mut residuals = noise(seed);
            (residuals[0].iter_mut().enumerate()).for_each(|(row, value)| {
                let age_s = ((row as f64 * 0.317).fract() - 0.5) * 0.01;
                *value += 300.0 * (row as f64 * 0.05).cos() * age_s;
            });
            joint.fit(&residuals)
        })
        .collect();
    let rare = |views: &[View], p: f64| {
        (logs.iter())
            .filter(|fitted| judge(views, &joint, fitted, &[], None).p < p)
            .count()
    };
    // Three of ten below 0.05 by chance is one in ninety.
    assert!(rare(&views, 0.05) < 3);
    views[0].clock = None;
    assert_eq!(rare(&views, 0.02), logs.len());
}
