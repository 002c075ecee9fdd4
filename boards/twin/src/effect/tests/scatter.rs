//! Effects that are told by likelihood: the discrete ones, and those that change how readings scatter.

use super::*;

/// Readings of the unit: prediction and its noise.
pub(super) fn noisy(twin: &Twin, predicted: &[Vec<f64>], seed: u64) -> Vec<Vec<f64>> {
    let noise = Noise::new(seed);
    let channels = twin.unit().channels.iter().zip(predicted).enumerate();
    let series = channels.map(|(index, (channel, predicted))| {
        let stream = noise.stream(index as u64);
        let samples = predicted.iter().enumerate();
        samples
            .map(|(k, value)| value + channel.noise_sigma * stream.normal(k as u64))
            .collect()
    });
    series.collect()
}

pub(super) fn logged(twin: &Twin, measured: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let channels = twin.unit().channels.iter().zip(measured);
    channels
        .map(|(channel, series)| series.iter().map(|value| channel.logged(*value)).collect())
        .collect()
}

/// Half the energy of the standardised residual: minus the logarithm of the likelihood.
fn misfit(twin: &Twin, cause: &Cause, predicted: &[Vec<f64>], measured: &[Vec<f64>]) -> f64 {
    0.5 * difference(twin, cause, predicted, measured).norm_squared()
}

/// Channels of logs that do not show a step.
pub(super) fn views<'a>(
    twin: &'a Twin,
    channels: &[usize],
    t_s: &'a [Vec<f64>],
    predicted: &'a [Vec<f64>],
    measured: &'a [Vec<f64>],
) -> Vec<View<'a>> {
    let view = |&channel: &usize| View {
        channel: &twin.unit().channels[channel],
        t_s: &t_s[channel],
        predicted: &predicted[channel],
        measured: &measured[channel],
        step: 0.0,
    };
    channels.iter().map(view).collect()
}

#[test]
fn every_discrete_effect_is_told_from_its_other_variants() {
    let twin = twin(SPARSE);
    let nominal = twin.predict(&[]);
    for &effect in LIBRARY.iter().filter(|effect| effect.page().nature == Nature::Discrete) {
        let locality = effect.localities(twin.unit()).into_iter().next().unwrap();
        let cause = |variant| Cause {
            effect,
            locality: locality.clone(),
            variant,
        };
        let predicted = |variant| {
            twin.predict(&[Active {
                cause: cause(variant),
                theta: Vec::new(),
            }])
        };
        let variants = effect.variants(twin.starts_s());
        let all: Vec<Vec<Vec<f64>>> = variants.iter().map(|&variant| predicted(variant)).collect();
        for (i, &variant) in variants.iter().enumerate() {
            let whole = difference(&twin, &cause(variant), &nominal, &all[i]).norm();
            let measured = logged(&twin, &noisy(&twin, &all[i], 3));
            let own = misfit(&twin, &cause(variant), &all[i], &measured);
            // Not excited by this motion: rates stay below 160 deg/s, forces below 6 g.
            if whole < 1e-9 {
                continue;
            }
            assert!(
                misfit(&twin, &cause(variant), &nominal, &measured) > own + 20.0,
                "{:?}",
                cause(variant)
            );
            for (j, other) in all.iter().enumerate().filter(|(j, _)| *j != i) {
                let apart = difference(&twin, &cause(variant), &all[i], other).norm();
                let other = misfit(&twin, &cause(variant), other, &measured);
                assert!(
                    other > own + 20.0 || apart < 1e-9,
                    "{:?} taken for {}",
                    cause(variant),
                    variants[j]
                );
            }
        }
    }
}

/// A spread effect that was put in: parameters, variant to inject with, variant to look for it with, and place.
struct Injected(&'static str, &'static [f64], f64, f64, Locality);

#[test]
fn every_spread_effect_is_found_where_it_is_and_told_from_the_others() {
    let twin = twin(DENSE);
    let predicted = twin.predict(&[]);
    let one = |name: &str| Locality::Channel(name.to_owned());
    let injected = [
        Injected("gyro-bias-walk", &[5e-4], 0.0, 0.0, one("g2")),
        Injected("stale-sample", &[0.1], 0.0, 0.0, one("m3x")),
        Injected("sampling-jitter", &[4e-3], 0.0, 0.0, Locality::Unit),
        Injected("sampling-jitter", &[4e-3], 1.0, 1.0, Locality::Unit),
        Injected("coarse-quantisation", &[], -2.0, -2.0, one("a2y")),
        Injected("coarse-quantisation", &[], 3.0, 3.0, one("a2y")),
        Injected("bit-fault", &[], 7.0, 7.0, one("a1x")),
        Injected("stuck-channel", &[], 120.0, 120.0, one("m4y")),
        Injected("packet-corruption", &[0.1], 0.0, 0.0, one("a3z")),
        Injected("noise-level", &[0.4], 0.0, 0.0, one("g1")),
        Injected("vibration", &[0.5], 1.37, 0.0, one("a4x")),
        Injected("shock", &[0.1], 20.0, 20.0, Locality::Unit),
        Injected("shock", &[0.02], 3.0, 5.0, Locality::Unit),
    ];
    let t_s: Vec<Vec<f64>> = (0..predicted.len()).map(|channel| twin.instants_s(channel)).collect();
    for Injected(name, theta, inject, look, locality) in injected {
        let effect = by_name(name).unwrap();
        let channels = Cause {
            effect,
            locality,
            variant: inject,
        }
        .channels(twin.unit());
        let mut measured = noisy(&twin, &predicted, 5);
        let healthy = logged(&twin, &measured);
        let disturbed = effect.disturb(
            theta,
            inject,
            &views(&twin, &channels, &t_s, &predicted, &measured),
            Noise::new(9),
        );
        for (&channel, disturbed) in channels.iter().zip(disturbed) {
            measured[channel] = disturbed;
        }
        let measured = logged(&twin, &measured);
        let (before, after) = (
            views(&twin, &channels, &t_s, &predicted, &healthy),
            views(&twin, &channels, &t_s, &predicted, &measured),
        );
        let (_, idle) = most_likely(effect, look, &before);
        let (found, gain) = most_likely(effect, look, &after);
        println!("{name}: healthy {idle:.1}, found {found:?} for {theta:?}, gain {gain:.1}");
        assert!(idle < 6.0, "{name} is seen in a healthy log: {idle}");
        assert!(gain > 20.0, "{name} is not seen: {gain}");
        for (found, theta) in found.iter().zip(theta) {
            // 1200 samples: 120 events scatter by 9 %, the terms of a walk by more.
            assert!((found / theta - 1.0).abs() < 0.35, "{name}: {found} for {theta}");
        }
        for &other in LIBRARY
            .iter()
            .filter(|other| other.page().nature == Nature::Spread && other.page().name != name)
        {
            let concerned = |view: &&View| other.page().sensors.contains(&view.channel.sensor);
            let seen: Vec<View> = after.iter().filter(concerned).copied().collect();
            for variant in other.variants(twin.starts_s()) {
                let (_, rival) = most_likely(other, variant, &seen);
                assert!(
                    rival < gain,
                    "{name} ({gain:.1}) taken for {} ({rival:.1})",
                    other.page().name
                );
            }
        }
    }
}

/// A zero that is off is seen beneath an effect on the scatter, and as sharply as the effect says.
#[test]
fn what_is_beneath_an_effect_on_the_scatter_still_tells_a_zero_that_is_off() {
    let twin = twin(DENSE);
    let predicted = twin.predict(&[]);
    let one = |name: &str| Locality::Channel(name.to_owned());
    /// \[sigma\] a zero's error.
    const OFF: f64 = 0.3;
    let injected = [
        ("stale-sample", vec![0.1], 0.0, one("m3x"), 0.8),
        ("sampling-jitter", vec![4e-3], 0.0, Locality::Unit, 0.3),
        ("sampling-jitter", vec![4e-3], 1.0, Locality::Unit, 1.0),
        ("coarse-quantisation", vec![], -3.0, one("a2y"), 0.3),
        ("coarse-quantisation", vec![], 3.0, one("a2y"), 0.3),
        ("bit-fault", vec![], 7.0, one("a1x"), 1.0),
        ("stuck-channel", vec![], 120.0, one("m4y"), 0.49),
        ("packet-corruption", vec![0.1], 0.0, one("a3z"), 0.85),
        ("noise-level", vec![0.4], 0.0, one("g1"), 0.44),
        ("shock", vec![0.1], 20.0, Locality::Unit, 0.85),
    ];
    let t_s: Vec<Vec<f64>> = (0..predicted.len()).map(|channel| twin.instants_s(channel)).collect();
    for (name, theta, variant, locality, least_part) in injected {
        let effect = by_name(name).unwrap();
        let channels = Cause {
            effect,
            locality,
            variant,
        }
        .channels(twin.unit());
        let mut measured = noisy(&twin, &predicted, 7);
        for &channel in &channels {
            let off = OFF * twin.unit().channels[channel].sigma();
            measured[channel].iter_mut().for_each(|value| *value += off);
        }
        let healthy = views(&twin, &channels, &t_s, &predicted, &measured);
        let disturbed = effect.disturb(&theta, variant, &healthy, Noise::new(3));
        for (&channel, disturbed) in channels.iter().zip(disturbed) {
            measured[channel] = disturbed;
        }
        let measured = logged(&twin, &measured);
        let seen = views(&twin, &channels, &t_s, &predicted, &measured);
        let (mut pull, mut worth, mut as_logged, mut samples) = (0.0, 0.0, 0.0, 0.0);
        for (view, rows) in seen.iter().zip(effect.beneath(&theta, variant, &seen)) {
            for (row, (predicted, measured)) in rows.iter().zip(view.predicted.iter().zip(view.measured)) {
                let sigma = view.channel.sigma();
                pull += row.worth * (row.value - predicted) / sigma;
                as_logged += (measured - predicted) / sigma;
                (worth, samples) = (worth + row.worth, samples + 1.0);
            }
        }
        let (found, part) = (pull / worth, worth / samples);
        println!(
            "{name} {variant}: {found:.3}, as logged {:.3}, worth {part:.2}",
            as_logged / samples
        );
        assert!((found - OFF).abs() < 4.0 / worth.sqrt(), "{name}: {found}");
        assert!(part >= least_part, "{name}: {part}");
    }
}

/// A line between two bins of a block is weaker in both; its frequency is found from all channels, and with it its size.
#[test]
fn what_shakes_several_sensors_is_as_strong_as_it_is_wherever_its_frequency_lies() {
    let twin = twin(DENSE);
    let predicted = twin.predict(&[]);
    let t_s: Vec<Vec<f64>> = (0..predicted.len()).map(|channel| twin.instants_s(channel)).collect();
    let effect = by_name("vibration").unwrap();
    let shaken: Vec<usize> = (0..predicted.len())
        .filter(|channel| twin.unit().channels[*channel].sensor == crate::channel::Kind::Accelerometer)
        .collect();
    let quiet = noisy(&twin, &predicted, 5);
    let step_s = twin.starts_s()[1] - twin.starts_s()[0];
    for bins in [100.0, 100.5, 101.3] {
        let frequency_hz = bins / (512.0 * step_s);
        let measured: Vec<Vec<f64>> = (quiet.iter().zip(&t_s).enumerate())
            .map(|(channel, (quiet, t_s))| {
                let size = if shaken.contains(&channel) {
                    0.5 * twin.unit().channels[channel].sigma()
                } else {
                    0.0
                };
                let shaken = quiet.iter().zip(t_s);
                shaken
                    .map(|(value, t_s)| value + size * (core::f64::consts::TAU * frequency_hz * t_s).sin())
                    .collect()
            })
            .collect();
        let views = views(&twin, &shaken, &t_s, &predicted, &measured);
        let settled_hz = effect.settled(&views).unwrap();
        // The grid on which it is sought, and noise.
        assert!(
            (settled_hz - frequency_hz).abs() < 0.15 / (512.0 * step_s),
            "{bins}: {settled_hz} Hz"
        );
        let sizes = views.iter().map(|view| most_likely(effect, settled_hz, &[*view]).0[0]);
        let mean = sizes.sum::<f64>() / views.len() as f64;
        // The level about a line is never taken below that of white noise, which costs a twentieth; half a bin beside it
        // would cost a third.
        assert!((mean / 0.5 - 0.95).abs() < 0.05, "{bins}: {mean}");
    }
}

#[test]
fn what_shakes_at_any_frequency_for_a_while_is_neither_blows_nor_noise() {
    let twin = twin(DENSE);
    let predicted = twin.predict(&[]);
    let channels: Vec<usize> = ["a1x", "a1y", "a1z"]
        .map(|name| twin.unit().channel(name).unwrap())
        .into();
    let mut measured = noisy(&twin, &predicted, 5);
    let rows = twin.starts_s().len();
    for &channel in &channels {
        let size = 12.0 * twin.unit().channels[channel].sigma();
        // A motor that wears: its phase runs away within seconds.
        let shaken = measured[channel].iter_mut().enumerate().skip(rows / 4).take(rows / 2);
        shaken.for_each(|(k, value)| *value += size * (1.9 * k as f64 + 40.0 * (0.01 * k as f64).sin()).sin());
    }
    let measured = logged(&twin, &measured);
    let t_s: Vec<Vec<f64>> = (0..predicted.len()).map(|channel| twin.instants_s(channel)).collect();
    let views = views(&twin, &channels, &t_s, &predicted, &measured);
    let gain = |name: &str| {
        let effect = by_name(name).unwrap();
        let variants = effect.variants(twin.starts_s()).into_iter();
        variants
            .map(|variant| most_likely(effect, variant, &views).1)
            .fold(0.0, f64::max)
    };
    let vibration = gain("vibration");
    assert!(
        gain("shock") < 1.0,
        "half of the time is not now and then: {}",
        gain("shock")
    );
    for other in ["shock", "noise-level", "packet-corruption"] {
        assert!(vibration > gain(other) + 100.0, "{other}: {} {vibration}", gain(other));
    }
}
