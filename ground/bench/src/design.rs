//! Before table time: which positions and runs determine the wanted parameters best.
//!
//! In: minutes on the table, how long a run lasts and the table takes between two, the channels' axes and noise, and what
//! is wanted. Out: the runs in order, the sigmas to expect, and what stays unobservable whatever is run.
//!
//! All channels see the same excitations, so one information matrix `sum x'x` of `(x, y, z, 1)` rows (unit excitation)
//! serves all. Runs are chosen one after the other, then exchanged while an exchange lowers the mean of the wanted
//! variances (A-optimality, by exchange: V. V. Fedorov, "Theory of Optimal Experiments", 1972). Gyro runs come as
//! antagonist pairs, so that slow drift and the Earth's rate stay out of the scale whatever else happens.
//!
//! Refused: less time than the least that determines the parameters.

pub mod command;

use nalgebra::{Matrix4, Vector3};

use crate::{
    experiment::Excitation,
    turntable::{Mount, Pose, Site, Turning},
};

/// What is wanted; variances of the wanted ones are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Wanted {
    /// Scale.
    Scale,
    /// Sensitive axis.
    Axis,
    /// Bias.
    Bias,
}

/// What the table and the unit can do.
#[derive(Clone, Debug, PartialEq)]
pub struct Means {
    /// Gyros or accelerometers.
    pub kind: Excitation,
    /// How the unit sits on the table.
    pub mount: Mount,
    /// Where the table stands.
    pub site: Site,
    /// Time on the table \[s\].
    pub time_s: f64,
    /// Time a run is measured for \[s\].
    pub run_s: f64,
    /// Time between two runs \[s\].
    pub between_s: f64,
    /// Rate of the runs [rad/s], for gyros.
    pub rate_rad_s: f64,
    /// Steps of the table's angles \[deg\].
    pub step_deg: f64,
    /// Nominal axes in b, one a channel.
    pub axes_b: Vec<Vector3<f64>>,
    /// Noise of a run's mean [rad/s, m/s2], the worst channel's.
    pub mean_sigma: f64,
}

/// A run of the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Angles.
    pub pose: Pose,
    /// Axis that turns, and its rate [rad/s]; `None` for a position.
    pub turning: Option<(Turning, f64)>,
    /// What the unit feels in b.
    pub excitation_b: Vector3<f64>,
}

/// A plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Runs in order.
    pub runs: Vec<Run>,
    /// Sigma to expect of the relative scale, root mean square over channels.
    pub scale_sigma: f64,
    /// Of the axis \[rad\].
    pub axis_sigma_rad: f64,
    /// Of the bias [rad/s, m/s2].
    pub bias_sigma: f64,
    /// What the plan cannot see, in words.
    pub unobservable: Vec<String>,
}

/// There is too little time.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{runs} runs of {run_s} s do not determine scale, axis and bias; {least_s:.0} s of table time are the least")]
pub struct TooShort {
    /// Runs there is time for.
    pub runs: usize,
    /// Time of a run and the pause after it \[s\].
    pub run_s: f64,
    /// Time needed \[s\].
    pub least_s: f64,
}

/// Plans.
///
/// # Errors
/// When there is too little time.
pub fn plan(means: &Means, wanted: &[Wanted]) -> Result<Plan, TooShort> {
    let candidates = candidates(means);
    let each = candidates.first().map_or(1, Vec::len);
    let run_s = means.run_s + means.between_s;
    let runs = (means.time_s / run_s) as usize;
    // Bounded, so that a year of table time does not take a year to plan.
    let choices = (runs / each).min(500);
    let unit = if means.kind == Excitation::Rate {
        means.rate_rad_s
    } else {
        means.site.gravity_m_s2
    };
    let information: Vec<Matrix4<f64>> = candidates
        .iter()
        .map(|group| {
            group
                .iter()
                .map(|run| (run.excitation_b / unit).push(1.0))
                .map(|x| x * x.transpose())
                .sum()
        })
        .collect();
    let cost = |sum: &Matrix4<f64>| cost(sum, &means.axes_b, wanted);
    // Slight information from nowhere makes the first choices comparable.
    let mut sum = Matrix4::identity() * 1e-3;
    let mut chosen: Vec<usize> = Vec::new();
    for _ in 0..choices {
        if let Some(best) = least(&information, |one| cost(&(sum + one))) {
            sum += information[best];
            chosen.push(best);
        }
    }
    for k in (0..chosen.len()).cycle().take(4 * chosen.len().min(100)) {
        let without = sum - information[chosen[k]];
        if let Some(best) = least(&information, |one| cost(&(without + one)))
            && cost(&(without + information[best])) < cost(&sum) * (1.0 - 1e-9)
        {
            sum = without + information[best];
            chosen[k] = best;
        }
    }
    let sum: Matrix4<f64> = chosen.iter().map(|&one| information[one]).sum();
    let determined = sum.symmetric_eigenvalues().min() > 1e-6 * sum.trace();
    let Some(inverse) = sum.try_inverse().filter(|_| determined) else {
        let least_s = run_s * (4_usize.div_ceil(each) * each).max(3 * each) as f64;
        return Err(TooShort { runs, run_s, least_s });
    };
    chosen.sort_unstable();
    let variances = variances(&inverse, &means.axes_b);
    let relative = means.mean_sigma / unit;
    Ok(Plan {
        runs: chosen.iter().flat_map(|&one| candidates[one].iter().copied()).collect(),
        scale_sigma: variances[0].sqrt() * relative,
        axis_sigma_rad: variances[1].sqrt() * relative,
        bias_sigma: variances[2].sqrt() * means.mean_sigma,
        unobservable: unobservable(means),
    })
}

fn least(information: &[Matrix4<f64>], cost: impl Fn(&Matrix4<f64>) -> f64) -> Option<usize> {
    let costs: Vec<f64> = information.iter().map(cost).collect();
    (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]))
}

/// Variances of scale, axis and bias for unit noise and excitation, mean over channels.
fn variances(inverse: &Matrix4<f64>, axes_b: &[Vector3<f64>]) -> [f64; 3] {
    let block = inverse.fixed_view::<3, 3>(0, 0).into_owned();
    let scale = axes_b.iter().map(|axis_b| axis_b.dot(&(block * axis_b))).sum::<f64>() / axes_b.len().max(1) as f64;
    [scale, (block.trace() - scale) / 2.0, inverse[(3, 3)]]
}

fn cost(sum: &Matrix4<f64>, axes_b: &[Vector3<f64>], wanted: &[Wanted]) -> f64 {
    // By Cholesky, which refuses what rounding has made negative.
    let Some(inverse) = sum.cholesky().map(|factor| factor.inverse()) else {
        return f64::INFINITY;
    };
    let [scale, axis, bias] = variances(&inverse, axes_b);
    let variance = |one: &Wanted| match one {
        Wanted::Scale => scale,
        Wanted::Axis => axis,
        Wanted::Bias => bias,
    };
    // All of them a little, so that none is left open.
    wanted.iter().map(variance).sum::<f64>() + 1e-3 * (scale + axis + bias)
}

/// Positions, or antagonist pairs of runs.
fn candidates(means: &Means) -> Vec<Vec<Run>> {
    let steps = (360.0 / means.step_deg.clamp(5.0, 90.0)).round() as usize;
    let angle = |k: usize| (360.0 * k as f64 / steps as f64).to_radians();
    match means.kind {
        Excitation::Force => (0..steps)
            .flat_map(|a| (0..steps).map(move |b| (a, b)))
            .map(|(a, b)| Pose {
                inner_rad: angle(a),
                outer_rad: angle(b),
            })
            .map(|pose| {
                vec![Run {
                    pose,
                    turning: None,
                    excitation_b: means.mount.force_b(pose, &means.site, [0.0; 2]),
                }]
            })
            .collect(),
        Excitation::Rate => {
            let upright = [0, steps / 2].map(|b| {
                (
                    Pose {
                        inner_rad: 0.0,
                        outer_rad: angle(b),
                    },
                    Turning::Inner,
                )
            });
            let around = (0..steps).map(|a| {
                (
                    Pose {
                        inner_rad: angle(a),
                        outer_rad: 0.0,
                    },
                    Turning::Outer,
                )
            });
            let pair = |(pose, turning)| {
                let run = |rate: f64| Run {
                    pose,
                    turning: Some((turning, rate)),
                    excitation_b: means.mount.rate_b(pose, turning, rate, &means.site),
                };
                vec![run(means.rate_rad_s), run(-means.rate_rad_s)]
            };
            upright.into_iter().chain(around).map(pair).collect()
        }
    }
}

fn unobservable(means: &Means) -> Vec<String> {
    let mut list = vec![
        "how the unit is turned on the table: axes come out relative to the table".to_string(),
        "temperature coefficients, unless the plan is repeated at other temperatures".to_string(),
    ];
    match means.kind {
        Excitation::Rate => {
            list.push("non-linearity: all runs are at one rate".into());
            list.push("sensitivity to acceleration: gravity goes round in every run".into());
            if means.site.outer_azimuth_rad.is_none() {
                list.push("bias below the Earth's rate: the azimuth of the outer axis is not known".into());
            }
        }
        Excitation::Force => {
            list.push("scale and non-linearity beyond 1 g".into());
            list.push("sensitivity to rate: nothing turns".into());
        }
    }
    list
}

#[cfg(test)]
mod tests;
