use super::*;

fn means(kind: Excitation, minutes: f64) -> Means {
    let (c, s, h) = (0.9_f64.sqrt(), 0.1_f64.sqrt(), 0.75_f64.sqrt());
    Means {
        kind,
        mount: Mount::EMEMS,
        site: Site {
            gravity_m_s2: 9.7864,
            latitude_rad: -0.405,
            outer_azimuth_rad: None,
        },
        time_s: 60.0 * minutes,
        run_s: 60.0,
        between_s: 30.0,
        rate_rad_s: 200_f64.to_radians(),
        step_deg: 30.0,
        axes_b: [
            [-c, 0.0, -s],
            [c / 2.0, -c * h, -s],
            [c / 2.0, c * h, -s],
            [0.0, 0.0, 1.0],
        ]
        .map(Vector3::from)
        .to_vec(),
        mean_sigma: 2e-4,
    }
}

#[test]
fn a_plan_beats_the_twelve_positions_of_the_thesis_in_the_same_time() {
    let means = means(Excitation::Rate, 36.0);
    let plan = plan(&means, &[Wanted::Scale, Wanted::Axis]).expect("plan");
    assert_eq!(plan.runs.len(), 24);
    // Twelve positions of Table 4.1 at both signs: Omega Omega' = diag(2, 5, 5) x 2 in e, so (z, y, x) in b.
    let thesis = Matrix4::from_diagonal(&nalgebra::Vector4::new(10.0, 10.0, 4.0, 24.0));
    let [scale, axis, _] = variances(&thesis.try_inverse().expect("rank"), &means.axes_b);
    let unit = means.mean_sigma / means.rate_rad_s;
    assert!(plan.scale_sigma < scale.sqrt() * unit && plan.axis_sigma_rad < axis.sqrt() * unit);
    // No 24 runs of unit rate do better than 8 on every axis.
    assert!(
        (plan.scale_sigma / unit - (1.0 / 8.0_f64).sqrt()).abs() < 0.01,
        "{}",
        plan.scale_sigma / unit
    );
}

#[test]
fn gyro_runs_come_in_antagonist_pairs() {
    let plan = plan(&means(Excitation::Rate, 20.0), &[Wanted::Axis]).expect("plan");
    for pair in plan.runs.chunks(2) {
        assert!((pair[0].excitation_b + pair[1].excitation_b).norm() < 1e-12);
    }
}

#[test]
fn predicted_sigmas_are_those_a_simulation_shows() {
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use crate::response::{Observation, Orders, Response};

    let means = means(Excitation::Force, 30.0);
    let plan = plan(&means, &[Wanted::Bias, Wanted::Scale, Wanted::Axis]).expect("plan");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let normal = Normal::new(0.0, means.mean_sigma).expect("sigma");
    let runs = 2000;
    let (mut bias, mut scale) = (0.0, 0.0);
    for _ in 0..runs {
        for axis_b in &means.axes_b {
            let observe = |run: &Run| Observation {
                excitation_b: run.excitation_b,
                temperature_c: 0.0,
                value: axis_b.dot(&run.excitation_b) + normal.sample(&mut random),
            };
            let observations: Vec<_> = plan.runs.iter().map(observe).collect();
            let fit = Response::fit(&observations, Orders::default()).expect("fit");
            bias += fit.bias[0].powi(2) / 4.0;
            scale += (fit.counts_per_unit() - 1.0).powi(2) / 4.0;
        }
    }
    // 8,000 draws know a sigma to 1 %.
    let seen = |sum: f64| (sum / f64::from(runs)).sqrt();
    assert!(
        (seen(bias) / plan.bias_sigma - 1.0).abs() < 0.04,
        "{} {}",
        seen(bias),
        plan.bias_sigma
    );
    assert!(
        (seen(scale) / plan.scale_sigma - 1.0).abs() < 0.04,
        "{} {}",
        seen(scale),
        plan.scale_sigma
    );
}

#[test]
fn too_little_time_is_refused_with_the_least() {
    let error = plan(&means(Excitation::Rate, 4.0), &[Wanted::Scale]).expect_err("short");
    assert_eq!((error.runs, error.least_s), (2, 540.0));
    assert!(plan(&means(Excitation::Rate, 9.0), &[Wanted::Scale]).is_ok());
    assert!(plan(&means(Excitation::Force, 1.0), &[Wanted::Scale]).is_err());
}

#[test]
fn what_no_run_shows_is_said() {
    let plan = plan(&means(Excitation::Rate, 30.0), &[Wanted::Bias]).expect("plan");
    assert!(plan.unobservable.iter().any(|line| line.contains("Earth's rate")));
    let mut north = means(Excitation::Rate, 30.0);
    north.site.outer_azimuth_rad = Some(0.0);
    let plan = super::plan(&north, &[Wanted::Bias]).expect("plan");
    assert!(!plan.unobservable.iter().any(|line| line.contains("Earth's rate")));
}
