//! Effects of digits: values that stay, are garbled, or repeat.

use super::{
    scatter::{logged, noisy, views},
    *,
};

#[test]
fn a_stuck_channel_tells_since_when_and_what_it_will_say() {
    let twin = twin(DENSE);
    let (predicted, effect) = (twin.predict(&[]), by_name("stuck-channel").unwrap());
    let channel = twin.unit().channel("m4y").unwrap();
    let t_s: Vec<Vec<f64>> = (0..predicted.len()).map(|channel| twin.instants_s(channel)).collect();
    let mut measured = noisy(&twin, &predicted, 3);
    // None of the onsets tried, and the last quarter is not known.
    const ONSET: usize = 333;
    measured[channel][ONSET..].fill(1.5);
    measured[channel][900..].fill(f64::NAN);
    let seen = views(&twin, &[channel], &t_s, &predicted, &measured);
    let onset_s = effect.settled(&seen).unwrap();
    assert_eq!(onset_s, t_s[channel][ONSET]);
    let expected = effect.expected(onset_s, &seen[0]);
    assert_eq!(expected[ONSET - 1], predicted[channel][ONSET - 1]);
    assert!(expected[ONSET..].iter().all(|value| *value == 1.5));
}

/// One digit in a hundred samples is another: no bit is stuck, and no law that leaves those samples unexplained may gain by
/// them.
#[test]
fn digits_garbled_here_and_there_are_no_stuck_bit() {
    let twin = twin(DENSE);
    let predicted = twin.predict(&[]);
    let channel = Cause {
        effect: by_name("packet-corruption").unwrap(),
        locality: Locality::Channel("a3z".to_owned()),
        variant: 0.0,
    }
    .channels(twin.unit())[0];
    let lsb = twin.unit().channels[channel].lsb;
    let mut measured = logged(&twin, &noisy(&twin, &predicted, 5))[channel].clone();
    for (k, value) in measured.iter_mut().enumerate().step_by(100) {
        *value = f64::from((*value / lsb).round() as i16 ^ (1 << (k / 100 % 4 + 7))) * lsb;
    }
    let t_s = twin.instants_s(channel);
    let view = View {
        channel: &twin.unit().channels[channel],
        t_s: &t_s,
        predicted: &predicted[channel],
        measured: &measured,
        step: 0.0,
    };
    let gain = |name: &str| {
        let effect = by_name(name).unwrap();
        let variants = effect.variants(twin.starts_s()).into_iter();
        let gains = variants.map(|variant| most_likely(effect, variant, &[view]).1);
        gains.fold(f64::NEG_INFINITY, f64::max)
    };
    let garbled = gain("packet-corruption");
    for name in ["bit-fault", "coarse-quantisation", "stuck-channel"] {
        assert!(gain(name) < 0.5 * garbled, "{name}: {} of {garbled}", gain(name));
    }
}

/// How much likelier one sample in fifty that is otherwise makes `packet-corruption` in a channel [ln].
fn damage(name: &str, otherwise: impl Fn(usize, i16) -> i16) -> f64 {
    let twin = twin(DENSE);
    let predicted = twin.predict(&[]);
    let channel = twin.unit().channel(name).unwrap();
    let lsb = twin.unit().channels[channel].lsb;
    let mut measured = logged(&twin, &noisy(&twin, &predicted, 6))[channel].clone();
    for (k, value) in measured.iter_mut().enumerate().step_by(50) {
        *value = f64::from(otherwise(k / 50, (*value / lsb).round() as i16)) * lsb;
    }
    let t_s = twin.instants_s(channel);
    let view = View {
        channel: &twin.unit().channels[channel],
        t_s: &t_s,
        predicted: &predicted[channel],
        measured: &measured,
        step: 0.0,
    };
    most_likely(by_name("packet-corruption").unwrap(), 0.0, &[view]).1
}

#[test]
fn outliers_that_all_stay_near_are_no_damage_and_any_flipped_bit_is() {
    for name in ["a3z", "m2x", "g2"] {
        let flipped = damage(name, |k, code| code ^ (1 << (k % 12)));
        assert!(flipped > 50.0, "{name}: {flipped}");
        // Forty counts of four thousand: many times the noise, a hundredth of the range.
        let near = damage(name, |k, code| code + if k % 2 == 0 { 40 } else { -40 });
        assert!(near < 1.0, "{name}: {near}");
    }
}

#[test]
fn values_that_a_file_rounds_repeat_by_chance_and_are_not_stale() {
    let twin = twin(DENSE);
    let channel = twin.unit().channel("m3x").unwrap();
    let predicted = vec![vec![10.0; twin.starts_s().len()]; twin.unit().channels.len()];
    let mut described = twin.unit().channels[channel].clone();
    described.bits = None;
    // A tenth of sigma: every thirtieth value is that before it.
    let rounded_to = 0.1 * described.sigma();
    let measured: Vec<f64> = (noisy(&twin, &predicted, 5)[channel].iter())
        .map(|value| (value / rounded_to).round() * rounded_to)
        .collect();
    let step = logged_step(&measured);
    assert!((step - rounded_to).abs() < 1e-9, "{step}");
    let t_s = twin.instants_s(channel);
    let gain = |measured: &[f64], step: f64| {
        let view = View {
            channel: &described,
            t_s: &t_s,
            predicted: &predicted[channel],
            measured,
            step,
        };
        most_likely(by_name("stale-sample").unwrap(), 0.0, &[view]).1
    };
    let chance = gain(&measured, step);
    assert!(chance < 3.0, "{chance}");
    assert!(gain(&measured, 0.0) > 30.0, "the step is what tells");
    let stale: Vec<f64> = (0..measured.len())
        .map(|k| measured[k - usize::from(k % 10 == 1)])
        .collect();
    assert!(gain(&stale, step) > 30.0);
}

/// A log of a part that rounds, with a stretch that was computed and not read: its step is that of the part.
#[test]
fn a_stretch_of_finer_numbers_does_not_hide_the_step_of_the_part() {
    let noise = Noise::new(3);
    let (step, sigma) = (0.001, 0.004);
    let values: Vec<f64> = (0..3000)
        .map(|k| {
            let value = sigma * noise.normal(k);
            let digits = if (1000..1600).contains(&k) { 1e-6 } else { step };
            // As a file of six decimals has it.
            ((value / digits).round() * digits * 1e6).round() / 1e6
        })
        .collect();
    assert!((logged_step(&values) - step).abs() < 3e-6, "{}", logged_step(&values));
    // Without a part that rounds there is nothing but the file's own.
    let fine: Vec<f64> = (0..3000)
        .map(|k| (sigma * noise.normal(k) * 1e6).round() / 1e6)
        .collect();
    assert!(logged_step(&fine) < 2e-6, "{}", logged_step(&fine));
}
