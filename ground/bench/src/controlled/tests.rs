use rand_distr::{Distribution, Normal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use super::*;
use crate::{
    experiment::Trial,
    least_squares::student_95,
    turntable::{Mount, Pose, Site, Turning},
};

/// Measured axes [per counts] of the e-MEMS' gyros, rounded: K n in b [counts per rad/s].
const GYROS: [[f64; 3]; 4] = [
    [-741.0, -2.0, -249.0],
    [378.0, -636.0, -252.0],
    [362.0, 647.0, -253.0],
    [-2.0, -3.0, 783.0],
];
const BIAS: [f64; 4] = [-12.6, -20.3, -11.3, -4.4];

const SITE: Site = Site {
    gravity_m_s2: 9.7864,
    latitude_rad: -0.4051,
    outer_azimuth_rad: Some(0.3),
};

fn trial(excitation_b: Vector3<f64>, noise: &mut dyn FnMut() -> f64) -> Trial {
    let value = |k: usize| Some(Vector3::from(GYROS[k]).dot(&excitation_b) + BIAS[k] + noise());
    Trial {
        label: String::new(),
        line: 0,
        claimed_b: None,
        pose: None,
        excitation_b,
        temperature_c: f64::NAN,
        values: (0..4).map(value).collect(),
        stated: Vec::new(),
    }
}

/// The twelve runs of Table 4.1 at both signs, Earth rate included.
fn campaign(noise: &mut dyn FnMut() -> f64) -> Experiment {
    let inner = [(0.0, 0.0), (0.0, 180.0)];
    let outer = [0.0, 180.0, 90.0, 270.0, 30.0, 210.0, 150.0, 330.0];
    let poses = inner.map(|(a, b)| (a, b, Turning::Inner)).into_iter();
    let poses = poses.chain(outer.map(|a| (a, 0.0, Turning::Outer)));
    let mut trials = Vec::new();
    for (a, b, turning) in poses {
        let pose = Pose {
            inner_rad: f64::to_radians(a),
            outer_rad: f64::to_radians(b),
        };
        for sign in [1.0, -1.0] {
            trials.push(trial(
                Mount::EMEMS.rate_b(pose, turning, sign * 200_f64.to_radians(), &SITE),
                noise,
            ));
        }
    }
    Experiment {
        file: "campaign".into(),
        kind: Excitation::Rate,
        channels: ["g1", "g2", "g3", "g4"].map(String::from).to_vec(),
        trials,
        declared: None,
        remarks: Vec::new(),
    }
}

#[test]
fn one_fit_gives_what_subtracting_antagonists_gives() {
    // Rounding of twenty values near 3000 counts.
    const ROUNDING: f64 = 1e-9;
    let mut k = 0.0_f64;
    let mut ripple = || {
        k += 1.0;
        3.0 * (k * k).sin()
    };
    let mut experiment = campaign(&mut ripple);
    // Without the Earth's rate, so that antagonists are exactly opposite, as both sources have it.
    for trial in &mut experiment.trials {
        trial.excitation_b = trial.excitation_b.normalize() * 3.5;
    }
    let found = calibrate(&experiment, &Options::default()).expect("fit");
    let pairs: Vec<_> = experiment.trials.chunks(2).collect();
    for (k, channel) in found.channels.iter().enumerate() {
        let (mut normal, mut right) = (nalgebra::Matrix3::zeros(), Vector3::zeros());
        for pair in &pairs {
            let difference_b = pair[0].excitation_b - pair[1].excitation_b;
            normal += difference_b * difference_b.transpose();
            right += difference_b * (pair[0].values[k].expect("value") - pair[1].values[k].expect("value"));
        }
        let sensitivity_b = normal.try_inverse().expect("rank") * right;
        assert!((channel.response.sensitivity_b - sensitivity_b).norm() < ROUNDING);
        let mean = experiment
            .trials
            .iter()
            .filter_map(|trial| trial.values[k])
            .sum::<f64>()
            / 20.0;
        assert!(
            (channel.response.bias[0] - mean).abs() < ROUNDING,
            "{} {mean}",
            channel.response.bias[0]
        );
    }
    assert_eq!(found.pairs.len(), 10);
}

#[test]
fn intervals_of_rate_table_calibrations_cover_95_of_100() {
    let normal = Normal::new(0.0, 2.68).expect("sigma");
    let mut inside = [[0; 4]; 4];
    for seed in 0..1000 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let experiment = campaign(&mut || normal.sample(&mut random));
        let rows: Vec<_> = experiment.trials.iter().map(|trial| Some(trial.excitation_b)).collect();
        for k in 0..4 {
            let found = fit(&experiment, &rows, &[], Orders::default(), k)
                .expect("fit")
                .response;
            let truths = GYROS[k].iter().copied().chain([BIAS[k]]);
            let values = found.sensitivity_b.iter().copied().chain([found.bias[0]]);
            for (p, (value, truth)) in values.zip(truths).enumerate() {
                let half = student_95(found.freedom) * found.covariance[(p, p)].sqrt();
                inside[k][p] += usize::from((value - truth).abs() < half);
            }
        }
    }
    for share in inside.iter().flatten().map(|&inside| inside as f64 / 1000.0) {
        assert!((0.93..=0.97).contains(&share), "{inside:?}");
    }
}

#[test]
fn intervals_of_multi_position_calibrations_cover_95_of_100() {
    // An accelerometer of 34 counts per m/s2 in the thirteen outer angles of Table 4.6 at six inner ones.
    let truth = (Vector3::new(-11.0, 1.5, 32.0), 7.5);
    let poses = (0..78).map(|k| Pose {
        inner_rad: f64::to_radians(60.0 * f64::from(k / 13)),
        outer_rad: f64::to_radians(30.0 * f64::from(k % 13)),
    });
    let force_b: Vec<Vector3<f64>> = poses.map(|pose| Mount::EMEMS.force_b(pose, &SITE, [0.0; 2])).collect();
    let rows: Vec<_> = force_b.iter().copied().map(Some).collect();
    let normal = Normal::new(0.0, 1.53).expect("sigma");
    let mut inside = [0; 4];
    for seed in 0..1000 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut position = |force_b: &Vector3<f64>| Trial {
            values: vec![Some(truth.0.dot(force_b) + truth.1 + normal.sample(&mut random))],
            ..trial(*force_b, &mut || 0.0)
        };
        let experiment = Experiment {
            file: "positions".into(),
            kind: Excitation::Force,
            channels: vec!["a1x".into()],
            trials: force_b.iter().map(&mut position).collect(),
            declared: None,
            remarks: Vec::new(),
        };
        let found = fit(&experiment, &rows, &[], Orders::default(), 0)
            .expect("fit")
            .response;
        let values = found.sensitivity_b.iter().copied().chain([found.bias[0]]);
        for (p, (value, truth)) in values.zip(truth.0.iter().copied().chain([truth.1])).enumerate() {
            let half = student_95(found.freedom) * found.covariance[(p, p)].sqrt();
            inside[p] += usize::from((value - truth).abs() < half);
        }
    }
    println!("held {inside:?} of 1000");
    for inside in inside {
        assert!((930..=970).contains(&inside), "{inside}");
    }
}

#[test]
fn an_earth_rate_that_is_left_out_stands_in_the_bias_unless_the_runs_cancel_it() {
    let off = |runs: std::ops::Range<usize>| {
        let mut experiment = campaign(&mut || 0.0);
        for (row, trial) in experiment.trials.iter_mut().enumerate() {
            // The axis without the Earth's part of the rate; it is the same at both signs.
            let sign = if row % 2 == 0 { 1.0 } else { -1.0 };
            let earth = (trial.excitation_b.norm() - 200_f64.to_radians()) * sign;
            trial.excitation_b = trial.excitation_b.normalize() * (trial.excitation_b.norm() - sign * earth);
        }
        experiment.trials.drain(runs);
        calibrate(&experiment, &Options::default()).expect("fit").channels[3]
            .response
            .bias[0]
            - BIAS[3]
    };
    assert!(off(0..0).abs() < 1e-9, "Table 4.1 has every axis both ways up");
    let upright_only = off(2..4);
    assert!(upright_only.abs() > 1e-4 && upright_only.abs() < 0.1, "{upright_only}");
    let known = calibrate(&campaign(&mut || 0.0), &Options::default()).expect("fit");
    assert!((known.channels[3].response.bias[0] - BIAS[3]).abs() < 1e-9);
}

#[test]
fn contradicted_rows_are_left_out_corrected_or_kept() {
    let mut experiment = campaign(&mut || 0.0);
    experiment.trials[5].excitation_b *= -1.0;
    let with = |contradicted| {
        calibrate(
            &experiment,
            &Options {
                contradicted,
                ..Options::default()
            },
        )
        .expect("fit")
    };
    let (left_out, corrected, kept) = (
        with(Contradicted::LeaveOut),
        with(Contradicted::Correct),
        with(Contradicted::Keep),
    );
    assert_eq!(left_out.consensus.contradictions[0].row, 5);
    assert_eq!(
        (left_out.channels[0].rows.len(), corrected.channels[0].rows.len()),
        (19, 20)
    );
    assert!(
        left_out
            .channels
            .iter()
            .chain(&corrected.channels)
            .all(|channel| channel.response.scatter < 1e-9)
    );
    assert!(kept.channels[1].response.scatter > 10.0);
}

#[test]
fn a_missing_cell_costs_a_row_of_its_channel_only() {
    let mut experiment = campaign(&mut || 0.0);
    experiment.trials[3].values[2] = None;
    let found = calibrate(&experiment, &Options::default()).expect("fit");
    assert_eq!(
        found
            .channels
            .iter()
            .map(|channel| channel.rows.len())
            .collect::<Vec<_>>(),
        [20, 20, 19, 20]
    );
}

#[test]
fn an_axis_that_was_never_turned_is_named_with_file_and_column() {
    let mut experiment = campaign(&mut || 0.0);
    experiment.trials.drain(..4);
    let error = calibrate(&experiment, &Options::default())
        .expect_err("no z")
        .to_string();
    assert_eq!(
        error,
        "campaign, column g1: not determined: excitation along z is missing (16 usable rows)"
    );
}
