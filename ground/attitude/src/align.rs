//! How far a reference's clock is off the log's.
//!
//! In: a log's estimates and the rows of a reference. Out: the seconds by which the reference should come later, with a sigma,
//! and the errors as told and as found. Of the offset `d` it minimises the mean square of the attitude error about its own
//! mean (a mounting or a declination turns all errors alike and says nothing of time), first on a grid, then by parabolas.
//! Near its minimum the mean square is `J0 + c d^2` with `c` the mean square of the rate across; its errors make `d` uncertain
//! by `sqrt(J0 / (c n))`, `n` independent errors.

use logs::{
    flight::{EstimatedStep, Flight},
    recording::{Row, attitude_at},
};
use nalgebra::Vector3;
use packets::magnitude;

/// \[s\] looked for at most, on either side.
const SPAN_S: f64 = 2.0;
/// \[s\] step of the grid: a turn at 2 rad/s has moved by 5 deg.
const GRID_S: f64 = 0.04;
/// Estimates that are looked at: more say nothing more.
const LOOKED_AT: usize = 1_500;
/// Estimates with an independent error, of those: the filter's errors last for seconds.
const INDEPENDENT: f64 = 50.0;
/// Share of the mean square that must go before an offset is worth a word.
const WORTH: f64 = 0.1;
/// Sigmas by which it must differ from none.
const SIGMAS: f64 = 3.0;

/// An offset that fits better than the one that was told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offset {
    /// \[s\] by which the reference should come later than it does.
    pub later_s: f64,
    /// \[s\] its sigma.
    pub sigma_s: f64,
    /// \[deg\] root mean square error about its mean, as told and with it.
    pub rms_deg: [f64; 2],
}

/// The offset, if there is one worth a word.
pub fn offset(flight: &Flight, reference: &[Row]) -> Option<Offset> {
    let sampled: Vec<&EstimatedStep> = (flight.estimates.iter())
        .step_by(flight.estimates.len() / LOOKED_AT + 1)
        .collect();
    let most_s = magnitude::median(flight.estimates.windows(2).map(|pair| pair[1].t_s - pair[0].t_s))?;
    let cost = |later_s: f64| scatter(&sampled, reference, later_s, most_s);
    let (told, all) = cost(0.0)?;
    let enough = |later_s: f64| {
        cost(later_s)
            .filter(|(_, count)| 5 * count > 4 * all)
            .map(|(cost, _)| cost)
    };
    let half = (SPAN_S / GRID_S) as i32;
    let mut best = (-half..=half)
        .filter_map(|k| Some((f64::from(k) * GRID_S, enough(f64::from(k) * GRID_S)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let (mut step_s, mut bend) = (GRID_S, 0.0);
    for _ in 0..3 {
        let (low, high) = (enough(best.0 - step_s)?, enough(best.0 + step_s)?);
        bend = (low - 2.0 * best.1 + high) / (2.0 * step_s * step_s);
        if bend <= 0.0 {
            return None;
        }
        let moved = best.0 + ((low - high) / (4.0 * bend * step_s * step_s)).clamp(-1.0, 1.0) * step_s;
        best = [(moved, enough(moved)?), best]
            .into_iter()
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        step_s /= 4.0;
    }
    let found = Offset {
        later_s: best.0,
        sigma_s: (best.1 / (bend * INDEPENDENT)).sqrt(),
        rms_deg: [told, best.1].map(|square| square.sqrt().to_degrees()),
    };
    (best.1 < (1.0 - WORTH) * told && found.later_s.abs() > SIGMAS * found.sigma_s).then_some(found)
}

/// \[rad2\] mean square of the error about its mean, and how many errors; the reference later by `later_s`. The error is taken in
/// b, where a mounting is constant, or in n, where a declination is, whichever has less of it.
fn scatter(sampled: &[&EstimatedStep], reference: &[Row], later_s: f64, most_s: f64) -> Option<(f64, usize)> {
    let error = |estimate: &&EstimatedStep| {
        let reference_nb = attitude_at(reference, estimate.t_s - later_s, most_s)?;
        let in_b = (reference_nb.inverse() * estimate.q_nb).scaled_axis();
        Some((in_b, (estimate.q_nb * reference_nb.inverse()).scaled_axis()))
    };
    let (in_b, in_n): (Vec<_>, Vec<_>) = sampled.iter().filter_map(error).unzip();
    let count = in_b.len();
    let about_mean = |errors: &[Vector3<f64>]| {
        let mean = errors.iter().sum::<Vector3<f64>>() / count as f64;
        errors.iter().map(|error| (error - mean).norm_squared()).sum::<f64>() / count as f64
    };
    (count >= 20).then(|| (about_mean(&in_b).min(about_mean(&in_n)), count))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, UnitQuaternion};

    use super::*;

    fn attitude(t_s: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(0.8 * (0.9 * t_s).sin(), 0.5 * (0.7 * t_s).cos(), 0.3 * t_s)
    }

    /// A minute at 5 Hz that errs by half a degree, turned by a declination.
    fn flight() -> Flight {
        let estimate = |k: u32| {
            let t_s = 0.2 * f64::from(k);
            let error = Vector3::new((1.7 * t_s).sin(), (2.3 * t_s).cos(), 0.0) * 0.5_f64.to_radians();
            EstimatedStep {
                t_s,
                q_nb: UnitQuaternion::from_euler_angles(0.0, 0.0, 0.1) * attitude(t_s) * UnitQuaternion::new(error),
                triad_nb: None,
                covariance_n: Matrix3::zeros(),
                bias_b: Vector3::zeros(),
                force_b: None,
                field_b_ut: None,
                innovations: Vec::new(),
            }
        };
        Flight {
            estimates: (0..300).map(estimate).collect(),
            ..Flight::default()
        }
    }

    fn reference(early_s: f64) -> Vec<Row> {
        let row = |k: u32| {
            let t_s = 0.01 * f64::from(k);
            Row {
                t_s: t_s - early_s,
                rate_b: Vector3::zeros(),
                acc_b: None,
                mag_b: None,
                reference_nb: Some(attitude(t_s)),
                scored: true,
            }
        };
        (0..6_000).map(row).collect()
    }

    #[test]
    fn a_reference_that_comes_too_early_is_found_so_with_its_sigma() {
        let found = offset(&flight(), &reference(0.3361)).expect("an offset");
        assert!(
            (found.later_s - 0.3361).abs() < 3.0 * found.sigma_s + 0.002,
            "{found:?}"
        );
        assert!(
            found.sigma_s < 0.01 && found.rms_deg[0] > 5.0 && found.rms_deg[1] < 1.0,
            "{found:?}"
        );
    }

    #[test]
    fn a_reference_on_the_logs_clock_gives_no_word() {
        assert_eq!(offset(&flight(), &reference(0.0)), None);
    }
}
