//! Four gyros under watch, cycle by cycle against the pages in f64.

extern crate std;

use super::*;
use crate::{
    draws::{Draws, near},
    faults::tests::reference::{Given, GyrosModel, Sure, V, of, solve},
    geometry::gyro_axis_b,
};

fn axes(draws: &mut Draws) -> [Axis; PLATES] {
    let noise = draws.within(0.002, 0.01);
    let alike = draws.below(2) == 0;
    core::array::from_fn(|plate| {
        let noise = if alike { noise } else { noise * draws.within(0.7, 1.5) };
        Axis::from_sensitivity((gyro_axis_b(plate) + draws.vector(0.02)) * 100.0, 0.0, noise)
    })
}

/// What is wrong with one gyro.
#[derive(Clone, Copy, Debug)]
enum Ill {
    Sound,
    Leaps(f32),
    Creeps(f32),
    Frozen,
    Unread,
    NoNumber,
}

#[derive(Default)]
struct Seen {
    leaps: u32,
    suspects: u32,
    verdicts: [u32; 7],
    returns: u32,
}

fn run(seed: u64, seen: &mut Seen) {
    let mut draws = Draws::of(seed);
    let axes = axes(&mut draws);
    let uncertainty = Uncertainty {
        bias: draws.within(0.005, 0.02),
        scale: draws.within(1e-3, 0.01),
        direction: draws.within(1e-3, 0.01),
    };
    let timing_s = draws.one_of([0.0, 0.001]);
    let mut gyros = Gyros::new(&axes, uncertainty, timing_s);
    let sure = Sure {
        bias: of(uncertainty.bias),
        scale: of(uncertainty.scale),
        direction: of(uncertainty.direction),
        timing_s: of(timing_s),
    };
    let axes_b: [V; 4] = axes.map(|axis| axis.axis_b.cast());
    let mut model = GyrosModel::new(axes_b, axes.map(|axis| of(axis.noise)), sure);
    let biases: [f32; 4] = core::array::from_fn(|_| draws.within(-0.5, 0.5) * uncertainty.bias);
    let moving = draws.one_of([0.0, 0.05, 1.0]);
    let (start_b, swings_b) = (draws.vector(2.0 * moving), draws.vector(moving));
    let (size, slow) = (draws.within(0.02, 2.0), draws.within(1e-4, 2e-3));
    let from = 30 + draws.below(60) as u32;
    let lasts = draws.one_of([1, 2, 40, 120]);
    let kinds = [
        Ill::Sound,
        Ill::Leaps(size),
        Ill::Leaps(-size),
        Ill::Leaps(10.0 * size),
        Ill::Creeps(slow),
        Ill::Frozen,
        Ill::Unread,
        Ill::NoNumber,
    ];
    let ills = [
        (draws.below(4) as usize, draws.one_of(kinds)),
        (draws.below(4) as usize, draws.one_of(kinds)),
    ];
    let blamed_at = draws.below(300) as u32;
    let blamed = draws.below(4) as usize;
    for cycle in 0..400 {
        let phase = cycle as f32 * 0.2;
        let rate_b = start_b + swings_b * ComplexField::sin(phase);
        let (mut present, mut frozen) = (ALL, 0);
        let mut values: [f32; 4] = core::array::from_fn(|k| {
            let noise = axes[k].noise * (draws.within(-1.0, 1.0) + draws.within(-1.0, 1.0) + draws.within(-1.0, 1.0));
            axes[k].axis_b.dot(&rate_b) + biases[k] + noise
        });
        for (number, (plate, ill)) in ills.into_iter().enumerate() {
            let from = from + 90 * number as u32;
            if !(from..from + lasts).contains(&cycle) {
                continue;
            }
            match ill {
                Ill::Sound => {}
                Ill::Leaps(size) => values[plate] += size,
                Ill::Creeps(slow) => values[plate] += slow * (cycle - from) as f32,
                Ill::Frozen => frozen |= 1 << plate,
                Ill::Unread => present &= !(1 << plate),
                Ill::NoNumber => {
                    // It is not read then, and its value is anything.
                    values[plate] = f32::INFINITY;
                    present &= !(1 << plate);
                }
            }
        }
        let dt_s = (draws.below(20) > 0).then_some(0.2);
        let found = gyros.step(&Cycle {
            values: &values,
            present,
            frozen,
            dt_s,
            watched_later: false,
        });
        let given = Given {
            values: values.map(|value| if value.is_finite() { of(value) } else { 0.0 }),
            present,
            frozen,
            dt_s: dt_s.map(of),
            later: false,
        };
        let excluded_before = (0..4).filter(|k| model.watches[*k].excluded()).count();
        let (expected, used) = model.step(&given);
        let what = std::format!("{seed} {cycle} {ills:?}");
        assert_eq!(
            (found.used, gyros.suspect, gyros.leaping),
            (used, model.suspect, model.leaping),
            "{what}"
        );
        assert_eq!(found.known == Known::All, expected.is_some(), "{what}");
        if let Some((rate_b, covariance_b)) = expected {
            assert!(
                (found.vector_b.cast::<f64>() - rate_b).norm() < 1e-3 * rate_b.norm().max(0.01),
                "{what}"
            );
            let off = (found.covariance_b.cast::<f64>() - covariance_b).norm();
            assert!(off < 5e-3 * covariance_b.norm(), "{what}: {off}");
        }
        assert_eq!(gyros.is_doubted(), model.is_doubted(), "{what}");
        let sign = f64::from(gyros.across[0].signum());
        let is = |found: f32, expected: f64, kind: &str| assert!(near(found, expected, 5e-3, 1e-5), "{what}: {kind}");
        is(gyros.parity.offset, sign * model.parity.offset, "parity");
        assert!(
            near(gyros.parity.offset_variance, model.parity.offset_variance, 5e-3, 1e-12),
            "{what}"
        );
        for k in 0..4 {
            let (found, expected) = (&gyros.watches[k], &model.watches[k]);
            assert_eq!(gyros.verdict(k), expected.verdict, "{what}: {k}");
            assert_eq!(gyros.excluded() >> k & 1 == 1, expected.excluded(), "{what}");
            is(found.offset, expected.offset, "offset");
            assert!(
                near(found.offset_variance, expected.offset_variance, 5e-3, 1e-12),
                "{what}"
            );
            seen.verdicts[expected.verdict as usize] += 1;
        }
        let excluded = (0..4).filter(|k| model.watches[*k].excluded()).count();
        seen.returns += u32::from(excluded < excluded_before);
        seen.leaps += u32::from(model.leaping.is_some());
        seen.suspects += u32::from(model.suspect);
        // The vectors have their say once in a while.
        if cycle == blamed_at {
            gyros.blame(blamed, Verdict::Disagreeing);
            model.blame(blamed, Verdict::Disagreeing);
        }
    }
}

#[test]
fn all_that_is_held_of_the_gyros_is_what_the_pages_say() {
    let mut seen = Seen::default();
    for seed in 0..300 {
        run(seed, &mut seen);
    }
    let Seen {
        leaps,
        suspects,
        verdicts,
        returns,
    } = seen;
    let named = [Verdict::Disagreeing, Verdict::Biased, Verdict::Noisy, Verdict::Frozen]
        .map(|verdict| verdicts[verdict as usize]);
    assert!(
        leaps > 50 && suspects > 100 && returns > 20,
        "{leaps} {suspects} {returns}"
    );
    assert!(named.iter().all(|count| *count > 20), "{named:?}");
}

/// What four gyros say of a rate is what it explains and the parity: without each of them the rate is that of the other three,
/// moved back by what the parity is usually off.
#[test]
fn without_each_gyro_the_rate_is_that_of_the_others() {
    for seed in 0..50 {
        let mut draws = Draws::of(seed);
        let axes = axes(&mut draws);
        let uncertainty = Uncertainty {
            bias: 0.01,
            scale: 0.001,
            direction: 0.001,
        };
        let mut gyros = Gyros::new(&axes, uncertainty, 0.0);
        let values: [f32; 4] = core::array::from_fn(|_| draws.within(-1.0, 1.0));
        let axes_b: [V; 4] = axes.map(|axis| axis.axis_b.cast());
        let rate_of = |wanted: u16| {
            solve(&axes_b, &values.map(of), &[1.0; 4], wanted)
                .expect("spans space")
                .0
        };
        let parity = gyros.parity_of(&values);
        for part in [0.0, 0.3] {
            gyros.parity.offset = part * parity;
            let without = gyros.without_each(&values, ALL).expect("all are used");
            for (k, found) in without.iter().enumerate() {
                let moved = (rate_of(ALL & !(1 << k)) - rate_of(ALL)) * f64::from(1.0 - part);
                let off = (found.cast::<f64>() - rate_of(ALL) - moved).norm();
                assert!(off < 1e-4, "{seed} {k}: {off}");
            }
            for used in [0b0111, 0b1110, 0] {
                assert_eq!(gyros.without_each(&values, used), None);
            }
        }
        // A rate that is one shows nothing in it.
        gyros.parity.offset = 0.0;
        let rate_b = draws.vector(3.0);
        assert!(gyros.parity_of(&axes.map(|axis| axis.axis_b.dot(&rate_b))).abs() < 1e-5);
        assert!((gyros.across.iter().map(|part| part * part).sum::<f32>() - 1.0).abs() < 1e-6);
    }
}

/// A gyro that is out is watched for its return, and no other.
#[test]
fn only_the_gyro_that_is_out_is_watched() {
    let uncertainty = Uncertainty {
        bias: 0.01,
        scale: 0.001,
        direction: 0.001,
    };
    for out in 0..PLATES {
        let mut gyros = Gyros::new(&axes(&mut Draws::of(1)), uncertainty, 0.0);
        gyros.blame(out, Verdict::Disagreeing);
        for _ in 0..26 {
            gyros.step(&Cycle {
                values: &[0.5; 4],
                present: ALL,
                frozen: 0,
                dt_s: Some(0.2),
                watched_later: false,
            });
        }
        for (k, watch) in gyros.watches.iter().enumerate() {
            assert_eq!(watch.seen_long(), k == out, "{out} {k}");
        }
    }
}
