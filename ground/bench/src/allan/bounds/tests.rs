use super::*;

/// The published algorithm interpolates in tables where lags are summed here; the two were seen to differ by this much
/// at most.
const TABLES: f64 = 0.02;

/// Factors and windows of records of 1,001 and 100,001 angles.
const CASES: [(usize, usize); 5] = [(1, 1_001), (10, 1_001), (100, 1_001), (4, 100_001), (4_096, 100_001)];

fn check(deviation: Deviation, expected: [[f64; 5]; 5]) {
    let laws = [
        PowerLaw::WhiteAngle,
        PowerLaw::FlickerAngle,
        PowerLaw::WhiteRate,
        PowerLaw::FlickerRate,
        PowerLaw::RateWalk,
    ];
    for (law, row) in laws.into_iter().zip(expected) {
        for ((m, angles), expected) in CASES.into_iter().zip(row) {
            let windows = match deviation {
                Deviation::Adev => (angles - 1) / m - 1,
                Deviation::Oadev => angles - 2 * m,
                Deviation::Hdev => angles - 3 * m,
                Deviation::Mdev | Deviation::Tdev => angles - 3 * m + 1,
            };
            let edf = edf(law, deviation, m, windows).expect("converges");
            assert!(
                (edf / expected - 1.0).abs() < TABLES,
                "{law:?} {deviation:?} at {m}: {edf}, not {expected}"
            );
        }
    }
}

// Greenhall and Riley's algorithm as allantools 2024.6 has it.
#[test]
fn degrees_of_freedom_are_those_of_greenhall_and_riley() {
    check(
        Deviation::Oadev,
        [
            [514.036, 507.173, 440.207, 51426.029, 48324.848],
            [635.466, 247.307, 53.874, 39080.811, 384.409],
            [782.03, 135.071, 12.815, 30762.316, 34.389],
            [895.247, 114.669, 9.948, 28383.879, 26.835],
            [762.29, 91.038, 7.754, 22837.097, 21.094],
        ],
    );
    check(
        Deviation::Adev,
        [
            [514.036, 51.18, 4.909, 12856.893, 12.099],
            [635.466, 54.4, 5.081, 13965.379, 12.374],
            [782.03, 66.988, 6.231, 17185.81, 15.559],
            [895.247, 87.778, 8.092, 22249.491, 20.466],
            [762.29, 87.958, 8.1, 22005.608, 20.544],
        ],
    );
    check(
        Deviation::Mdev,
        [
            [514.036, 123.94, 9.936, 29385.55, 28.385],
            [635.466, 98.116, 7.721, 24944.697, 22.117],
            [782.03, 94.634, 7.417, 24183.625, 21.315],
            [895.247, 93.273, 7.223, 23864.167, 20.932],
            [762.29, 74.957, 5.727, 19196.175, 16.769],
        ],
    );
    check(
        Deviation::Hdev,
        [
            [432.316, 423.176, 334.443, 43286.406, 39158.404],
            [508.613, 207.948, 41.833, 32867.401, 321.449],
            [608.549, 113.699, 9.923, 25888.563, 28.385],
            [716.148, 97.029, 7.712, 24157.627, 22.118],
            [798.277, 94.324, 7.407, 23902.714, 21.315],
        ],
    );
}

#[test]
fn one_window_is_one_degree_of_freedom() {
    for m in [1, 1_000, 4_000_000] {
        assert_eq!(edf(PowerLaw::WhiteRate, Deviation::Oadev, m, 1), Some(1.0));
    }
}

#[test]
fn a_variance_that_does_not_converge_has_no_bounds() {
    assert_eq!(edf(PowerLaw::RateRun, Deviation::Oadev, 4, 100), None);
    assert!(edf(PowerLaw::RateRun, Deviation::Hdev, 4, 100).is_some());
    assert_eq!(edf(PowerLaw::WhiteRate, Deviation::Oadev, 4, 0), None);
}

#[test]
fn bounds_are_those_of_the_chi_squared_distribution() {
    // Quantiles from scipy 1.17: 0.025 and 0.975.
    for (edf, low, high) in [
        (10.0, 3.24697278, 20.48317735),
        (1.5, 0.01311302, 6.27580797),
        (96_875.0, 96_014.177_69, 97_739.609_91),
    ] {
        let (from, to) = bounds(2.0, edf, 0.95).expect("bounds");
        let expected = (2.0 * (edf / high).sqrt(), 2.0 * (edf / low).sqrt());
        assert!(
            (from / expected.0 - 1.0).abs() < 1e-6 && (to / expected.1 - 1.0).abs() < 1e-6,
            "{from} {to}"
        );
    }
}
