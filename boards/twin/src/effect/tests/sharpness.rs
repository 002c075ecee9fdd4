//! How well the parameter of an effect on the scatter is known.

use super::{
    scatter::{logged, noisy, views},
    *,
};

/// Logs of each effect.
const LOGS: u64 = 100;

/// 150 events of 1200 samples scatter by 8 %, the 20 terms of a walk that stand out by 16 %; a share of the samples would say 2 %.
#[test]
fn an_interval_of_90_percent_holds_the_truth_nine_times_of_ten() {
    let twin = twin(DENSE);
    let predicted = twin.predict(&[]);
    let t_s: Vec<Vec<f64>> = (0..predicted.len()).map(|channel| twin.instants_s(channel)).collect();
    for (name, theta, channel) in [
        ("gyro-bias-walk", 5e-4, "g2"),
        ("noise-level", 0.4, "g1"),
        ("packet-corruption", 0.1, "a3z"),
        ("stale-sample", 0.1, "m3x"),
    ] {
        let effect = by_name(name).unwrap();
        let channels = [twin.unit().channel(channel).unwrap()];
        let holds = |seed: &u64| {
            let mut measured = noisy(&twin, &predicted, *seed);
            let disturbed = effect.disturb(
                &[theta],
                0.0,
                &views(&twin, &channels, &t_s, &predicted, &measured),
                Noise::new(9).stream(*seed),
            );
            measured[channels[0]] = disturbed[0].clone();
            let measured = logged(&twin, &measured);
            let seen = views(&twin, &channels, &t_s, &predicted, &measured);
            let (found, _) = most_likely(effect, 0.0, &seen);
            (found[0] - theta).abs() < 1.645 * sigma_of(effect, 0.0, &seen, found[0])
        };
        let held = (0..LOGS).filter(holds).count();
        println!("{name}: {held} of {LOGS}");
        // Three sigmas of a count of 100 at nine of ten.
        assert!((81..=99).contains(&held), "{name}: {held} of {LOGS}");
    }
}
