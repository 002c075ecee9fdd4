//! What fault detection does over hours, and what it costs: false alarms, delays, who is named.

use std::sync::Arc;

use emems::{
    calibration::{Channel, Channels, Ranges, Set},
    faults::Verdict,
    unit::Settings,
};
use host_tests::{
    counts::{Ill, PERIOD_S, Unit},
    watched::{Flown, Tally, all_named, calibrated, fall_ill, false_alarms, ills, sigma, whole_sensor},
    world,
};
use twin::truth::TruthSource;

/// Motions and the hours flown of each. Most at rest: in motion the thresholds are wider and alarms rarer.
const CLEAN: [(&str, f64); 6] = [
    ("still", 16.0),
    ("tumble", 2.0),
    ("rotation-1", 2.0),
    ("rotation-2", 2.0),
    ("rate-table", 2.0),
    ("rocket", 2.0),
];

#[test]
fn healthy_units_raise_at_most_one_alarm_in_ten_hours() {
    let (mut alarms, mut hours) = (0, 0.0);
    for (n, (name, flown_h)) in CLEAN.into_iter().enumerate() {
        let source: Arc<dyn TruthSource> = world(name);
        let length_s = source.duration_s().unwrap_or(3600.0);
        let cycles = (length_s / PERIOD_S) as u64;
        let runs = (flown_h * 3600.0 / length_s).ceil() as u64;
        let unit = |seed| Unit::new(source.clone(), 1000 * n as u64 + seed, 1.0);
        let found = (0..runs).map(|seed| false_alarms(unit(seed), cycles, calibrated()));
        let (accused, undecided) = found.fold((0, 0), |sum, run| (sum.0 + run.0, sum.1 + run.1));
        println!("{name}: {runs} runs of {length_s} s: {accused} accused, {undecided} not isolable");
        alarms += accused + undecided;
        hours += flown_h;
    }
    assert!(f64::from(alarms) <= hours / 10.0, "{alarms} in {hours} h");
}

#[test]
fn nominal_parameters_on_a_badly_built_unit_raise_no_alarm() {
    // Biases of the thesis' unit, ten times what a calibration leaves: MT does not know better and must not accuse.
    let nominal = Set::nominal(Ranges::of(&Settings::NOMINAL));
    for (name, seed) in [("tumble", 1), ("rate-table", 2), ("rotation-2", 3)] {
        let found = false_alarms(Unit::new(world(name), seed, 10.0), 1200, nominal);
        assert_eq!(found, (0, 0), "{name}");
    }
}

/// \[s\] at rest before a fault: what is learned by then is learned.
const LEARNS_S: f64 = 200.0;
/// \[s\] a second, and the cycle in which it ends.
const ONE_SECOND: f64 = 1.1;
const FIVE_SECONDS: f64 = 5.1;

/// Steps of `sigmas` on every triad axis in turn.
fn steps(sigmas: f64, watched_s: f64, rounds: u64) -> Tally {
    let mut tally = Tally::default();
    for round in 0..rounds {
        for n in 0..24_u8 {
            let unit = Unit::new(world("still"), 7000 + 24 * round + u64::from(n), 1.0);
            let sign = if round % 2 == 0 { 1.0 } else { -1.0 };
            let ill = Ill::Bias(Channel(n), sign * sigmas * sigma(n));
            tally.add(&fall_ill(unit, LEARNS_S, watched_s, &[ill]), Channels(1 << n));
        }
    }
    println!("step of {sigmas} sigma, {watched_s} s: {tally:?}");
    tally
}

/// \[rad\] a fault of one axis may turn force or field by, until it is out and when it goes.
const JUMP: f64 = 1.0 / 57.3;

#[test]
fn s15_a_step_of_one_axis_is_isolated_in_a_second_or_in_five() {
    let fast = steps(3.8, ONE_SECOND, 10);
    assert!(
        fast.is(0.99, fast.detected) && fast.is(0.99, fast.named) && fast.wrong == 0,
        "{fast:?}"
    );
    // 1.7 sigma with a chance of 0.99 would take a lower limit and give some four false alarms in ten hours; with one at
    // most it is 0.95. The best test there is, a mean of the five seconds sliding over known white noise, has 0.991 where
    // its limit of 5.0 sigma alone gives 1.1 alarms in ten hours of 24 axes: with nothing left for the test in a second,
    // for ramps, noise and the gyros.
    let slow = steps(1.7, FIVE_SECONDS, 10);
    assert!(
        slow.is(0.94, slow.detected) && slow.is(0.94, slow.named) && slow.wrong == 0,
        "{slow:?}"
    );
    let sure = steps(2.0, FIVE_SECONDS, 10);
    assert!(sure.is(0.99, sure.named) && sure.wrong == 0, "{sure:?}");
    for tally in [
        fast,
        slow,
        sure,
        steps(30.0, FIVE_SECONDS, 2),
        steps(300.0, FIVE_SECONDS, 2),
    ] {
        assert!(tally.jump < JUMP, "{tally:?}");
    }
}

/// Density of the standard normal distribution, and an integral by the rule of the mid-points.
fn density(x: f64) -> f64 {
    (-x * x / 2.0).exp() / (2.0 * std::f64::consts::PI).sqrt()
}

fn integral(from: f64, to: f64, of: impl Fn(f64) -> f64) -> f64 {
    let steps = ((to - from) / 2e-3).ceil();
    let step = (to - from) / steps;
    (0..steps as u64)
        .map(|n| of(from + (n as f64 + 0.5) * step) * step)
        .sum()
}

/// S15: why a step of 1.7 sigma is isolated in five seconds with 0.94 and not with 0.99. Of all tests that look at five seconds, the
/// mean over them finds a step that begins with them most often at a given rate of false alarms (Guepie, Fillatre and Nikiforov,
/// "Detecting a suddenly arriving dynamic profile of finite duration", IEEE Trans. Inf. Theory 63, 2017). Its limit for 0.99 is
/// passed by chance more than once in ten hours of 24 axes, by known white noise and with no other test beside it.
#[test]
fn s15_a_chance_of_99_percent_at_1_7_sigma_takes_more_false_alarms_than_are_allowed() {
    let samples = 5.0 / PERIOD_S;
    // Three unknowns and twelve axes alike: an axis shows 9/12 of its variance in what it disagrees by.
    let seen = 1.7 * samples.sqrt() * (9.0_f64 / 12.0).sqrt();
    // One percent of a standard normal variable is below -2.326.
    let limit = seen - 2.326;
    assert!((integral(-8.0, limit - seen, density) - 0.01).abs() < 1e-4);
    // Of a mean that slides by one sample: the chance to be below the limit and then above it.
    let kept = 1.0 - 1.0 / samples;
    let left = (1.0 - kept * kept).sqrt();
    let below = |x: f64| integral(-8.0, x, density);
    let passes = integral(limit, limit + 3.0, |next| {
        density(next) * below((limit - kept * next) / left)
    });
    let ten_hours = 36_000.0 / PERIOD_S;
    let alarms = 2.0 * 24.0 * ten_hours * passes;
    println!("a limit of {limit:.3} sigma: {alarms:.2} false alarms in ten hours");
    assert!(alarms > 1.0 && alarms < 1.5, "{alarms}");
}

#[test]
fn s15_ramps_and_scale_steps_of_one_axis_are_isolated() {
    let mut tally = Tally::default();
    for n in 0..24_u8 {
        let unit = Unit::new(world("still"), 500 + u64::from(n), 1.0);
        // A sigma in five seconds; a second's worth would be learned as drift, twelve seconds' is not.
        let ramp = Ill::Ramp(Channel(n), 0.2 * sigma(n));
        tally.add(&fall_ill(unit, LEARNS_S, 30.0, &[ramp]), Channels(1 << n));
        let unit = Unit::new(world("tumble"), 900 + u64::from(n), 1.0);
        let scale = Ill::Scale(Channel(n), 0.5);
        tally.add(&fall_ill(unit, LEARNS_S, 30.0, &[scale]), Channels(1 << n));
    }
    println!("ramps and scales: {tally:?}");
    assert!(tally.named == tally.tried && tally.wrong == 0, "{tally:?}");
}

#[test]
fn s16_a_step_of_one_gyro_is_detected_in_a_second_or_in_five() {
    for (sigmas, watched_s, part) in [(6.5, ONE_SECOND, 0.99), (2.9, FIVE_SECONDS, 0.98)] {
        let mut tally = Tally::default();
        for seed in 0..200 {
            let gyro = 24 + (seed % 4) as u8;
            let unit = Unit::new(world("still"), 3000 + seed, 1.0);
            let ill = Ill::Bias(Channel(gyro), sigmas * sigma(gyro));
            tally.add(&fall_ill(unit, LEARNS_S, watched_s, &[ill]), Channels(1 << gyro));
        }
        println!("gyro step of {sigmas} sigma: {tally:?}");
        assert!(
            tally.is(part, tally.detected) && 100 * tally.wrong <= tally.tried,
            "{tally:?}"
        );
    }
}

#[test]
fn s16_a_gyro_is_isolated_by_the_vectors_at_rest_and_in_motion() {
    // 0.3 deg/s is half of what the parity detects with certainty in five seconds: it is isolated once detected. In a tumble,
    // sampling instants and single samples at 5 Hz blur the vectors.
    for (name, deg_s, watched_s, part) in [
        ("still", 0.3, 25.0, 0.8),
        ("still", 0.8, 15.0, 0.97),
        ("tumble", 2.0, 25.0, 0.98),
    ] {
        let mut tally = Tally::default();
        for seed in 0..100 {
            let gyro = 24 + (seed % 4) as u8;
            let unit = Unit::new(world(name), 4000 + seed, 1.0);
            let ill = Ill::Bias(Channel(gyro), f64::to_radians(deg_s));
            tally.add(&fall_ill(unit, LEARNS_S, watched_s, &[ill]), Channels(1 << gyro));
        }
        println!("gyro of {deg_s} deg/s isolated, {name}: {tally:?}");
        assert!(tally.is(part, tally.named) && tally.wrong <= 1, "{name} {tally:?}");
    }
}

/// S16: the parity detects, the vectors isolate. What they take from the alarm on is 10 s at most, for a fault of 0.3 deg/s, 1.5 times the
/// noise of a gyro.
#[test]
fn s16_a_gyro_is_isolated_within_ten_seconds_of_its_detection() {
    let (mut detected, mut in_time, mut wrong) = (0, 0, 0);
    for seed in 0..100 {
        let gyro = 24 + (seed % 4) as u8;
        let unit = Unit::new(world("still"), 9000 + seed, 1.0);
        let outcome = fall_ill(unit, LEARNS_S, 40.0, &[Ill::Bias(Channel(gyro), f64::to_radians(0.3))]);
        if let Some(alarm_s) = outcome.delay_s.filter(|alarm_s| *alarm_s < 30.0) {
            detected += 1;
            in_time += u32::from(outcome.named_s.is_some_and(|named_s| named_s - alarm_s <= 10.0));
            wrong += u32::from(outcome.accused.0 & !(1 << gyro) != 0);
        }
    }
    println!("{detected} of 100 detected, {in_time} of them isolated within 10 s, {wrong} wrong");
    assert!(
        detected >= 97 && in_time * 100 >= detected * 95 && wrong <= 1,
        "{detected} {in_time} {wrong}"
    );
}

#[test]
fn s14_reversed_axes_and_swapped_ones_are_out_in_five_seconds_of_motion() {
    let one = |n: u64| (n % 24) as u8;
    let reversed = |n| (vec![Ill::Scale(Channel(one(n)), -1.0)], Channels(1 << one(n)));
    all_named("reversed", ills("tumble", FIVE_SECONDS, reversed, 48), f64::INFINITY);
    let swapped = |n| {
        let next = one(n) / 3 * 3 + (one(n) + 1) % 3;
        (vec![Ill::Exchanged(Channel(one(n)), Channel(next))], whole_sensor(next))
    };
    all_named("swapped", ills("tumble", FIVE_SECONDS, swapped, 48), f64::INFINITY);
}

#[test]
fn how_an_axis_is_wrong_is_said_after_a_while_of_motion() {
    let cases: [(Ill, u8, Verdict); 5] = [
        (Ill::Bias(Channel(4), 1.0), 4, Verdict::Biased),
        (Ill::Noise(Channel(13), 20.0), 13, Verdict::Noisy),
        (Ill::Scale(Channel(7), -1.0), 7, Verdict::Reversed),
        (Ill::Exchanged(Channel(15), Channel(16)), 16, Verdict::Exchanged),
        (Ill::Frozen(Channel(9)), 10, Verdict::Frozen),
    ];
    for (ill, channel, verdict) in cases {
        let mut flown = Flown::new(Unit::new(world("tumble"), 77, 1.0).ill(60.0, 1e9, ill));
        while flown.unit.now_s() < 80.0 {
            flown.step();
        }
        assert_eq!(flown.monitor.verdict(Channel(channel)), verdict, "{ill:?}");
    }
}

#[test]
fn s17_tenfold_noise_is_out_within_ten_seconds() {
    let noisy = |n: u64| (vec![Ill::Noise(Channel((n % 24) as u8), 10.0)], Channels(1 << (n % 24)));
    all_named("tenfold noise", ills("still", 10.0, noisy, 48), 10.0);
}

#[test]
fn s18_of_two_faults_on_different_plates_both_are_named() {
    let pair = |n: u64| ((n % 4) as u8, ((n % 4 + 1 + n / 4 % 3) % 4) as u8);
    let (mut tried, mut wrong) = (0, 0);
    for first in [0, 12_u8] {
        let two_axes = |n: u64| {
            let (a, b) = pair(n);
            let (a, b) = (first + 3 * a + (n / 12 % 3) as u8, first + 3 * b + (n / 36 % 3) as u8);
            let (on_a, on_b) = (8.0 * sigma(a), -8.0 * sigma(b));
            let both = vec![Ill::Bias(Channel(a), on_a), Ill::Bias(Channel(b), on_b)];
            (both, Channels(1 << a | 1 << b))
        };
        let two_sensors = |n: u64| {
            let (a, b) = pair(n);
            let (a, b) = (first + 3 * a, first + 3 * b);
            let both = vec![Ill::Garbage(Channel(a)), Ill::Garbage(Channel(b))];
            (both, Channels(whole_sensor(a).0 | whole_sensor(b).0))
        };
        for tally in [ills("still", 15.0, two_axes, 108), ills("still", 15.0, two_sensors, 48)] {
            println!("two faults: {tally:?}");
            assert!(tally.is(0.98, tally.named), "{tally:?}");
            (tried, wrong) = (tried + tally.tried, wrong + tally.wrong);
        }
    }
    assert!(100 * wrong <= tried, "{wrong} of {tried} named a healthy plate");
}

#[test]
fn s22_a_sensor_that_sends_random_words_is_out_in_three_samples() {
    for name in ["still", "tumble"] {
        let garbage = |n: u64| {
            (
                vec![Ill::Garbage(Channel((n % 24) as u8))],
                whole_sensor((n % 24) as u8),
            )
        };
        all_named(
            &format!("garbage, {name}"),
            ills(name, 10.0, garbage, 48),
            2.0 * PERIOD_S + 0.01,
        );
    }
}

#[test]
fn a_gyro_that_sends_random_words_is_detected() {
    // A driver knows such words by their identity (S8); here they come through.
    for name in ["still", "tumble"] {
        let garbage = |n: u64| {
            (
                vec![Ill::Garbage(Channel(24 + (n % 4) as u8))],
                Channels(1 << (24 + n % 4)),
            )
        };
        let tally = ills(name, 10.0, garbage, 48);
        println!("garbage of a gyro, {name}: {tally:?}");
        assert!(tally.is(0.9, tally.detected) && tally.wrong == 0, "{tally:?}");
    }
}

#[test]
fn s9_a_frozen_sensor_is_out_in_two_seconds() {
    for name in ["still", "tumble"] {
        let frozen = |n: u64| (vec![Ill::Frozen(Channel((n % 28) as u8))], whole_sensor((n % 28) as u8));
        all_named(&format!("frozen, {name}"), ills(name, FIVE_SECONDS, frozen, 56), 2.2);
    }
}

#[test]
fn a_sensor_that_heals_is_used_again() {
    for ill in [
        Ill::Bias(Channel(5), 1.0),
        Ill::Frozen(Channel(14)),
        Ill::Garbage(Channel(0)),
        Ill::Bias(Channel(26), 0.2),
    ] {
        let mut flown = Flown::new(Unit::new(world("still"), 5, 1.0).ill(60.0, 80.0, ill));
        let mut while_ill = Channels::default();
        for _ in 0..(100.0 / PERIOD_S) as u32 {
            flown.step();
            if flown.unit.now_s() < 79.0 {
                while_ill = flown.accused();
            }
        }
        assert_ne!(while_ill, Channels::default(), "{ill:?}");
        assert_eq!(flown.accused(), Channels::default(), "{ill:?}");
    }
}

#[test]
fn whatever_comes_in_what_goes_out_is_finite() {
    for seed in 0..20 {
        let noise = twin::part::signal::Noise::new(seed);
        let mut flown = Flown::new(Unit::new(world("tumble"), seed, 1.0));
        for cycle in 0..500_u64 {
            let mut reading = flown.unit.reading();
            for (n, counts) in reading
                .acc_p
                .as_flattened_mut()
                .iter_mut()
                .chain(&mut reading.gyro)
                .enumerate()
            {
                if noise.stream(n as u64).uniform(cycle) < 0.3 {
                    *counts = noise.stream(50 + n as u64).word(cycle) as i16;
                }
            }
            flown.temperatures.note(&reading);
            let measured = flown.set.apply(&reading, &flown.temperatures);
            let dt_s = [0.2, 0.0, -1.0, 3600.0, f32::NAN, f32::INFINITY, 1e-6][cycle as usize % 7];
            let mut measured = measured;
            measured.mag[cycle as usize % 12] = [f32::NAN, f32::INFINITY, 1e30, -1e30][cycle as usize % 4];
            let vectors = flown.monitor.step(&flown.set, &reading, &measured, dt_s);
            for solution in [vectors.force_b, vectors.field_b_ut, vectors.rate_b] {
                assert!(
                    solution
                        .vector_b
                        .iter()
                        .chain(&solution.covariance_b)
                        .all(|x| x.is_finite()),
                    "{seed} {cycle}"
                );
            }
        }
        for _ in 0..400 {
            flown.step();
        }
        let healed = flown.step();
        assert!(
            healed.force_b.vector_b.norm() > 9.0 && healed.field_b_ut.vector_b.norm() > 20.0,
            "{seed}"
        );
    }
}
