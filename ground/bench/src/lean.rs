//! How much the table leans, from the accelerometers on it.
//!
//! In: a multi-position [`Experiment`] with table angles. Out: two small angles, of the outer axis against the horizon and
//! of its zero, with sigmas. A lean is fixed in the laboratory and moves in b with every pose, so it cannot hide in the
//! twelve sensitivities, which are fixed in b: for given angles the channels are linear least squares, and Gauss-Newton
//! goes over what they leave (variable projection: G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10(2), 1973).
//!
//! `None` where the poses cannot show it: fewer than two inner angles, or no redundancy.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::{
    experiment::{Excitation, Experiment},
    least_squares,
    turntable::{Mount, Site},
};

/// \[rad\] difference for derivatives: small against a lean's effect on curvature, large against rounding.
const STEP: f64 = 1e-5;

/// Gauss-Newton steps; the problem is nearly linear.
const STEPS: usize = 4;

/// How the table leans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lean {
    /// Outer axis below the horizon, and outer angle short of its true value \[rad\].
    pub lean_rad: [f64; 2],
    /// Their sigmas \[rad\].
    pub sigma_rad: [f64; 2],
}

/// Estimates the lean.
pub fn lean(experiment: &Experiment, mount: &Mount, site: &Site) -> Option<Lean> {
    if experiment.kind != Excitation::Force || experiment.trials.iter().any(|trial| trial.pose.is_none()) {
        return None;
    }
    let scatter: Vec<f64> = {
        let force_b = forces(experiment, mount, site, [0.0; 2]);
        (0..experiment.channels.len())
            .map(|channel| Some(rest(experiment, channel, &force_b)?.1))
            .collect::<Option<_>>()?
    };
    // Residuals of all channels, each in its own scatter; the scatter stays that of the start.
    let residuals = |lean_rad: [f64; 2]| -> Option<DVector<f64>> {
        let force_b = forces(experiment, mount, site, lean_rad);
        let mut all = Vec::new();
        for (channel, scatter) in scatter.iter().enumerate() {
            let unit = if *scatter > 0.0 { *scatter } else { 1.0 };
            all.extend(
                rest(experiment, channel, &force_b)?
                    .0
                    .iter()
                    .map(|residual| residual / unit),
            );
        }
        Some(DVector::from_vec(all))
    };
    let mut lean_rad = [0.0; 2];
    let mut sigma_rad = [f64::NAN; 2];
    for _ in 0..STEPS {
        let here = residuals(lean_rad)?;
        let mut design = DMatrix::zeros(here.len(), 2);
        for k in 0..2 {
            let at = |step: f64| {
                let mut moved = lean_rad;
                moved[k] += step;
                residuals(moved)
            };
            design.set_column(k, &((at(-STEP)? - at(STEP)?) / (2.0 * STEP)));
        }
        let solution = least_squares::solve(&design, &here).ok()?;
        for k in 0..2 {
            lean_rad[k] += solution.parameters[k];
            sigma_rad[k] = solution.covariance[(k, k)].sqrt();
        }
        // The channels' own parameters were fitted on the same residuals.
        let freedom = here.len().saturating_sub(4 * scatter.len() + 2);
        if freedom == 0 {
            return None;
        }
        let spent = ((here.len() - 2) as f64 / freedom as f64).sqrt();
        sigma_rad = sigma_rad.map(|sigma| sigma * spent);
    }
    Some(Lean { lean_rad, sigma_rad })
}

/// The same campaign on a table that leans so.
pub fn leaning(experiment: &Experiment, mount: &Mount, site: &Site, lean_rad: [f64; 2]) -> Experiment {
    let mut leaning = experiment.clone();
    let force_b = forces(experiment, mount, site, lean_rad);
    for (trial, force_b) in leaning.trials.iter_mut().zip(force_b) {
        trial.excitation_b = force_b;
    }
    leaning
}

fn forces(experiment: &Experiment, mount: &Mount, site: &Site, lean_rad: [f64; 2]) -> Vec<Vector3<f64>> {
    let force_b = |pose| mount.force_b(pose, site, lean_rad);
    let trials = experiment.trials.iter();
    trials
        .map(|trial| trial.pose.map_or(trial.excitation_b, |(pose, _)| force_b(pose)))
        .collect()
}

fn rest(experiment: &Experiment, channel: usize, force_b: &[Vector3<f64>]) -> Option<(Vec<f64>, f64)> {
    let rows: Vec<usize> = (0..force_b.len())
        .filter(|&row| experiment.trials[row].values[channel].is_some())
        .collect();
    let design = DMatrix::from_fn(rows.len(), 4, |row, k| if k < 3 { force_b[rows[row]][k] } else { 1.0 });
    let values = rows.iter().filter_map(|&row| experiment.trials[row].values[channel]);
    let solution = least_squares::solve(&design, &DVector::from_iterator(rows.len(), values)).ok()?;
    Some((solution.residuals.iter().copied().collect(), solution.scatter))
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

    use super::*;
    use crate::{experiment::Trial, least_squares::student_95, turntable::Pose};

    const SITE: Site = Site {
        gravity_m_s2: 9.7864,
        latitude_rad: -0.4051,
        outer_azimuth_rad: None,
    };
    const TRUE_RAD: [f64; 2] = [0.002, -0.0035];

    /// A triad in 48 poses on a leaning table, read as if it stood upright.
    fn campaign(poses: &[(f64, f64)], noise: &mut dyn FnMut() -> f64) -> Experiment {
        let trial = |&(inner_deg, outer_deg): &(f64, f64)| {
            let pose = Pose {
                inner_rad: inner_deg.to_radians(),
                outer_rad: outer_deg.to_radians(),
            };
            let force_b = Mount::EMEMS.force_b(pose, &SITE, TRUE_RAD);
            Trial {
                label: String::new(),
                line: 0,
                claimed_b: None,
                pose: Some((pose, None)),
                excitation_b: Mount::EMEMS.force_b(pose, &SITE, [0.0; 2]),
                temperature_c: f64::NAN,
                values: (0..3).map(|k| Some(34.0 * force_b[k] + 5.0 + noise())).collect(),
                stated: Vec::new(),
            }
        };
        Experiment {
            file: "poses".into(),
            kind: Excitation::Force,
            channels: ["a1x", "a1y", "a1z"].map(String::from).to_vec(),
            trials: poses.iter().map(trial).collect(),
            declared: None,
            remarks: Vec::new(),
        }
    }

    fn grid() -> Vec<(f64, f64)> {
        (0..6)
            .flat_map(|a| (0..8).map(move |b| (60.0 * f64::from(a), 45.0 * f64::from(b))))
            .collect()
    }

    #[test]
    fn a_leaning_table_is_measured_and_its_effect_taken_out() {
        let experiment = campaign(&grid(), &mut || 0.0);
        let found = lean(&experiment, &Mount::EMEMS, &SITE).expect("lean");
        for (found, truth) in found.lean_rad.iter().zip(TRUE_RAD) {
            assert!((found - truth).abs() < 1e-7, "{found} {truth}");
        }
        let upright = leaning(&experiment, &Mount::EMEMS, &SITE, found.lean_rad);
        let force_b: Vec<_> = upright.trials.iter().map(|trial| trial.excitation_b).collect();
        assert!(rest(&upright, 0, &force_b).expect("fit").1 < 1e-4);
    }

    #[test]
    fn its_intervals_cover_95_of_100() {
        let normal = Normal::new(0.0, 0.5).expect("sigma");
        let mut inside = [0; 2];
        let runs = 400;
        for seed in 0..runs {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
            let found = lean(
                &campaign(&grid(), &mut || normal.sample(&mut random)),
                &Mount::EMEMS,
                &SITE,
            )
            .expect("lean");
            for k in 0..2 {
                let half = student_95(3 * 48 - 14) * found.sigma_rad[k];
                inside[k] += usize::from((found.lean_rad[k] - TRUE_RAD[k]).abs() < half);
            }
        }
        // Of 400, three standard deviations of the count are 13.
        assert!(inside.iter().all(|inside| (367..=393).contains(inside)), "{inside:?}");
    }

    #[test]
    fn poses_about_one_inner_angle_do_not_show_it() {
        let poses: Vec<_> = (0..12).map(|k| (0.0, 30.0 * f64::from(k))).collect();
        assert_eq!(lean(&campaign(&poses, &mut || 0.0), &Mount::EMEMS, &SITE), None);
    }
}
