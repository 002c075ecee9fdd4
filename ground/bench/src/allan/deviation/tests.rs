use super::{
    super::{
        phase::{Input, Phase},
        series::Series,
    },
    *,
};

/// Rounding of the order of the sums; allantools takes differences in another order.
const RELATIVE: f64 = 1e-11;

fn phase(rate: &[f64], gaps: &[Range<usize>]) -> Phase {
    Phase::new(
        &Series {
            step_s: 1.0,
            values: rate.to_vec(),
            gaps: gaps.to_vec(),
        },
        Input::Rate,
    )
}

/// The 1,000 points of NIST SP 1065, section 12.4: a linear congruential generator.
fn lcg1000() -> Vec<f64> {
    let values = std::iter::successors(Some(1_234_567_890_u64), |n| Some(16_807 * n % 2_147_483_647));
    values.take(1_000).map(|n| n as f64 / 2_147_483_647.0).collect()
}

/// Nine points of NIST SP 1065, section 12.1.
const NBS14: [f64; 9] = [892.0, 809.0, 823.0, 798.0, 671.0, 644.0, 883.0, 903.0, 677.0];

fn check(rate: &[f64], factors: &[usize], deviation: Deviation, expected: &[f64]) {
    let points = sweep(&phase(rate, &[]), factors, |_| ());
    for (point, expected) in points.iter().zip(expected) {
        let value = point.value(deviation).expect("windows");
        let relative = (value / expected - 1.0).abs();
        assert!(
            relative < RELATIVE,
            "{} at factor {}: {value}, not {expected}",
            deviation.name(),
            point.factor
        );
    }
}

// Values of allantools 2024.6; they round to those printed in NIST SP 1065.
#[test]
fn the_nine_point_vector_gives_the_published_deviations() {
    let check = |deviation, expected: [f64; 2]| check(&NBS14, &[1, 2], deviation, &expected);
    check(Deviation::Adev, [91.22944974074983, 115.80821070488338]);
    check(Deviation::Oadev, [91.22944974074983, 85.952869837681]);
    check(Deviation::Mdev, [91.22944974074983, 74.78849343314786]);
    check(Deviation::Tdev, [52.67134736584335, 86.35831363182896]);
    check(Deviation::Hdev, [70.80607318585038, 85.61487166374776]);
}

#[test]
fn the_thousand_point_vector_gives_the_published_deviations() {
    let check = |deviation, expected: [f64; 5]| check(&lcg1000(), &[1, 10, 100, 64, 256], deviation, &expected);
    check(
        Deviation::Adev,
        [
            0.29223187810675916,
            0.09965736063174786,
            0.038978043308026504,
            0.032549905440331296,
            0.010799272262406935,
        ],
    );
    check(
        Deviation::Oadev,
        [
            0.29223187810675916,
            0.09159953420118652,
            0.03241343026056983,
            0.03623721298570471,
            0.010282217639032731,
        ],
    );
    check(
        Deviation::Mdev,
        [
            0.29223187810675916,
            0.06172376382452218,
            0.02170920913694241,
            0.027871051150462362,
            0.004254511495440068,
        ],
    );
    check(
        Deviation::Tdev,
        [
            0.1687201534907273,
            0.3563623165948477,
            1.2533817739107584,
            1.0298469685963056,
            0.6288238994336462,
        ],
    );
    check(
        Deviation::Hdev,
        [
            0.29438832912413204,
            0.09581083173251592,
            0.032376382527609326,
            0.03382370898102113,
            0.010137819152778386,
        ],
    );
}

/// Blocks end within windows, and windows are longer than blocks.
#[test]
fn blocks_add_up_to_what_the_definitions_give() {
    let noisy = lcg1000().into_iter().cycle().take(3 * BLOCK + 1_234).enumerate();
    let rate: Vec<f64> = noisy.map(|(k, y)| y + k as f64 * 1e-5).collect();
    let phase = phase(&rate, &[]);
    let x = &phase.angle;
    for m in [1, 7, 700, BLOCK, 16_777] {
        let second = |k: usize| x[k + 2 * m] - 2.0 * x[k + m] + x[k];
        let third = |k: usize| second(k + m) - second(k);
        let seconds: Vec<f64> = (0..x.len() - 2 * m).map(second).collect();
        let mean = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64;
        let disjoint: Vec<f64> = seconds.iter().copied().step_by(m).collect();
        let moving: Vec<f64> = seconds.windows(m).map(|window| window.iter().sum()).collect();
        let thirds: Vec<f64> = (0..x.len().saturating_sub(3 * m)).map(third).collect();
        let point = sweep(&phase, &[m], |_| ())[0];
        for (name, found, values) in [
            ("disjoint", point.disjoint, &disjoint),
            ("second", point.second, &seconds),
            ("moving", point.moving, &moving),
            ("third", point.third, &thirds),
        ] {
            assert_eq!(found.windows, values.len(), "{name} at {m}");
            let (found, expected) = (found.sum / values.len() as f64, mean(values));
            assert!(
                (found / expected - 1.0).abs() < 1e-9,
                "{name} at {m}: {found}, not {expected}"
            );
        }
    }
}

#[test]
fn a_gap_is_worth_the_windows_that_avoid_it() {
    // One sample is missing and replaced by nonsense: at factor 4 and below (3 m - 1 < 20) every window with it is out.
    let mut rate = lcg1000();
    rate[400] = 1e9;
    let gap = 400..401;
    let gapped = phase(&rate, std::slice::from_ref(&gap));
    let x: Vec<f64> = {
        let clean = phase(&lcg1000(), &[]);
        clean.angle
    };
    for m in [1, 4] {
        let point = sweep(&gapped, &[m], |_| ())[0];
        let free = |k: usize, span: usize| k + span <= 400 || k > 400;
        let squares: Vec<f64> = (0..x.len() - 2 * m)
            .filter(|k| free(*k, 2 * m))
            .map(|k| (x[k + 2 * m] - 2.0 * x[k + m] + x[k]).powi(2))
            .collect();
        let tau2 = (m * m) as f64;
        let expected = (squares.iter().sum::<f64>() / (2.0 * tau2 * squares.len() as f64)).sqrt();
        assert_eq!(point.windows(Deviation::Oadev), squares.len());
        let value = point.value(Deviation::Oadev).expect("windows");
        // Windows on both sides of the gap see the same rates, but for the mean that is taken out.
        assert!((value / expected - 1.0).abs() < 1e-9, "{value}, not {expected}");
    }
}

#[test]
fn a_record_without_gaps_gives_the_same_with_the_mask_on() {
    // A gap at the very end masks only what reaches it; the counts say so.
    let gap = 999..1_000;
    let masked = sweep(&phase(&lcg1000(), std::slice::from_ref(&gap)), &[1, 16], |_| ());
    let complete = sweep(&phase(&lcg1000()[..999], &[]), &[1], |_| ());
    for deviation in Deviation::ALL {
        assert_eq!(masked[0].windows(deviation), complete[0].windows(deviation));
        let (masked, complete) = (masked[0].value(deviation), complete[0].value(deviation));
        assert!((masked.expect("windows") / complete.expect("windows") - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_factor_too_long_for_the_record_has_no_value() {
    let point = sweep(&phase(&NBS14, &[]), &[5], |_| ())[0];
    assert!(
        Deviation::ALL
            .into_iter()
            .all(|deviation| point.value(deviation).is_none())
    );
}

#[test]
fn half_a_percent_of_random_gaps_hardly_moves_the_deviation_of_white_noise() {
    let noise = super::super::simulate::Noise {
        arw: 1.0,
        ..Default::default()
    };
    let rate = noise.rate(100_000, 1.0, 3);
    let gaps: Vec<Range<usize>> = (0..500)
        .map(|k| {
            let start = 200 * k + k * k % 150 + 5;
            start..start + 1
        })
        .collect();
    let points = sweep(&phase(&rate, &gaps), &[16, 128, 1_024], |_| ());
    for point in points {
        let value = point.value(Deviation::Oadev).expect("windows") * point.tau_s.sqrt();
        // Three sigmas of an estimate with as many degrees of freedom, and 0.5 % of bridged variance.
        let tolerance = 3.0 / (100_000.0 / point.tau_s).sqrt() + 0.005;
        assert!((value - 1.0).abs() < tolerance, "{value} at {} s", point.tau_s);
    }
}
