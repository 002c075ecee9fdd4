//! Readings to attitude: the unit's own TRIAD and Kalman filter, on any readings of any unit.
//!
//! In: readings of every channel, row by row, and how each channel responds ([`Response`]). Out: a [`Track`]: specific
//! force, rate and field in b by weighted least squares over the channels that are there, TRIAD's attitude of each row, and
//! the filter's. TRIAD and filter are `emems::triad` and `emems::kalman`, the code that flies, in f32; the filter is told
//! the site of the case and the low-passes of the unit's description, and is otherwise the one for a unit in a room.
//!
//! Channels are read one after another and through low-passes, so each looks at another instant. Directions that stand still
//! in n are carried to one instant, that of the first accelerometer, by turning the channel's sensitivity with the rate:
//! `S.v(t + s) = (exp(w s) S).v(t)`.
//!
//! A response is inverted as `(1 + k dT) S.v + b + b' dT = y`, `S.(w' x r + w x (w x r))` taken off for an accelerometer at
//! `r`. Rates between rows are integrated as the mean of two: at 5 Hz that is what limits the filter, before and after any
//! effect alike.
//!
//! Refuses nothing: a kind without three independent channels in a row has no vector there, and a row without force and
//! field no TRIAD.

use emems::{
    kalman::{Delays, Filter, Params, Reference, Sampled, Step},
    triad::{Sighting, triad},
};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use twin::predict::{Channel, Feel, Kind, Twin};

/// What makes a vector, in the order of [`Track::vectors`].
pub const KINDS: [Kind; 3] = [Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer];

/// Part of one g by which specific force may differ and still be taken for the vertical by TRIAD, as on board.
const NEAR_ONE_G: f64 = 0.1;

/// Least over largest eigenvalue of `S'S` from which three axes count as independent: axes within 6 deg of a plane do not.
const INDEPENDENT: f64 = 0.01;

/// \[s\] put before all times: the filter's clock has no negative times.
const EPOCH_S: f64 = 1e4;

/// \[s\] a longer hole is no increment but a gap.
const LONGEST_STEP_S: f64 = 1.0;

/// How a channel answers to what it feels.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Reading per unit felt, along b.
    pub sensitivity_b: Vector3<f64>,
    /// Physical units, at the environment's temperature.
    pub bias: f64,
    /// Physical units per kelvin.
    pub bias_per_k: f64,
    /// Physical units per kelvin squared.
    pub bias_per_k2: f64,
    /// Relative change of the sensitivity per kelvin.
    pub scale_per_k: f64,
    /// \[s\] how much older a reading is than described.
    pub delay_s: f64,
    /// \[m\] place in b.
    pub lever_m: Vector3<f64>,
}

impl Response {
    /// As described.
    pub fn nominal(channel: &Channel) -> Self {
        Response {
            sensitivity_b: channel.axis_b,
            bias: channel.bias,
            bias_per_k: 0.0,
            bias_per_k2: 0.0,
            scale_per_k: 0.0,
            delay_s: 0.0,
            lever_m: channel.lever_m,
        }
    }
}

/// What readings say, one entry a row.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Force [m/s2], rate [rad/s], field \[uT\] in b.
    pub vectors: [Vec<Option<Vector3<f64>>>; 3],
    /// TRIAD's attitude.
    pub triad: Vec<Option<UnitQuaternion<f64>>>,
    /// The filter's.
    pub filter: Vec<Option<UnitQuaternion<f64>>>,
}

/// What a motion and a unit are to the estimation, made once for all readings of a log.
pub struct Estimation<'a> {
    twin: &'a Twin,
    /// The channel whose instants count: the first accelerometer.
    first: usize,
    /// What is felt at them.
    feels: Vec<Feel>,
    /// Rows to estimate.
    rows: Vec<usize>,
}

impl<'a> Estimation<'a> {
    /// Of these rows of the twin's log, rising.
    pub fn new(twin: &'a Twin, rows: Vec<usize>) -> Self {
        let first = twin
            .unit()
            .channels
            .iter()
            .position(|channel| channel.sensor == Kind::Accelerometer);
        let first = first.unwrap_or(0);
        Estimation {
            twin,
            first,
            feels: twin.feels(first),
            rows,
        }
    }

    /// Rows it estimates.
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// The reference's attitude at the rows.
    pub fn reference(&self) -> Vec<UnitQuaternion<f64>> {
        self.rows.iter().map(|row| self.feels[*row].q_nb).collect()
    }

    /// Estimates from `readings[channel][row of the log]`; one that is not finite is absent.
    pub fn track(&self, readings: &[Vec<f64>], responses: &[Response]) -> Track {
        let mut track = Track::default();
        let turning = self.vectors(Kind::Gyro, readings, responses, None);
        track.vectors[0] = self.vectors(Kind::Accelerometer, readings, responses, Some(&turning));
        track.vectors[2] = self.vectors(Kind::Magnetometer, readings, responses, Some(&turning));
        track.vectors[1] = turning;
        track.triad = (0..self.rows.len()).map(|at| self.triad(&track, at)).collect();
        track.filter = self.filter(&track, self.mean(Kind::Gyro, |index| responses[index].delay_s));
        track
    }

    /// Mean of something over the channels of a kind.
    fn mean(&self, kind: Kind, of: impl Fn(usize) -> f64) -> f64 {
        let channels = self.twin.unit().channels.iter().enumerate();
        let own: Vec<f64> = channels
            .filter(|(_, channel)| channel.sensor == kind)
            .map(|(index, _)| of(index))
            .collect();
        own.iter().sum::<f64>() / own.len().max(1) as f64
    }

    fn vectors(
        &self,
        kind: Kind,
        readings: &[Vec<f64>],
        responses: &[Response],
        turning: Option<&[Option<Vector3<f64>>]>,
    ) -> Vec<Option<Vector3<f64>>> {
        let own: Vec<(usize, f64)> = (self.twin.unit().channels.iter().enumerate())
            .filter(|(_, channel)| channel.sensor == kind)
            .map(|(index, channel)| (index, channel.sigma().powi(-2)))
            .collect();
        let starts_s = self.twin.starts_s();
        let standard_c = self.twin.environment().temperature_c;
        let channels = &self.twin.unit().channels;
        let at_s = channels.get(self.first).map_or(0.0, |channel| channel.slot_s);
        let vector = |(at, row): (usize, &usize)| {
            let above_k = self.feels[*row].temperature_c - standard_c;
            // What a rate is at another instant no rate tells: gyros are not carried.
            let rate_b = turning.and_then(|turning| turning[at]).unwrap_or_default();
            let rate_dot_b = turning.map_or_else(Vector3::zeros, |turning| {
                slope(turning, &self.rows, starts_s, at).unwrap_or_default()
            });
            let (mut matrix, mut pull) = (Matrix3::zeros(), Vector3::zeros());
            for (index, weight) in &own {
                let (reading, response) = (readings[*index][*row], &responses[*index]);
                if !reading.is_finite() {
                    continue;
                }
                let channel = &channels[*index];
                let later_s = channel.slot_s - channel.tau_s() - response.delay_s - at_s;
                let seen_b = UnitQuaternion::from_scaled_axis(rate_b * later_s) * response.sensitivity_b;
                let carried = rate_dot_b.cross(&response.lever_m) + rate_b.cross(&rate_b.cross(&response.lever_m));
                let of_warmth = (response.bias_per_k + response.bias_per_k2 * above_k) * above_k;
                let along = (reading - response.bias - of_warmth) / (1.0 + response.scale_per_k * above_k)
                    - response.sensitivity_b.dot(&carried);
                matrix += seen_b * seen_b.transpose() * *weight;
                pull += seen_b * (along * weight);
            }
            let eigenvalues = matrix.symmetric_eigenvalues();
            let is_whole = eigenvalues.min() > INDEPENDENT * eigenvalues.max();
            if is_whole {
                matrix.try_inverse().map(|inverse| inverse * pull)
            } else {
                None
            }
        };
        self.rows.iter().enumerate().map(vector).collect()
    }

    fn triad(&self, track: &Track, at: usize) -> Option<UnitQuaternion<f64>> {
        let environment = self.twin.environment();
        let (force_b, field_b) = (track.vectors[0][at]?, track.vectors[2][at]?);
        let is_near = (force_b.norm() - environment.gravity).abs() < NEAR_ONE_G * environment.gravity;
        let sighting = |seen_b: Vector3<f64>, known_n: Vector3<f64>| Sighting {
            seen_b: seen_b.cast(),
            known_n: known_n.cast(),
            seen_sd: 0.01,
            known_sd: 0.0,
        };
        let (down, field) = (
            sighting(-force_b, Vector3::z()),
            sighting(field_b, environment.field_n_ut),
        );
        let found = is_near.then(|| triad(&down, &field).ok()).flatten();
        found.map(|found| found.q_nb.cast())
    }

    fn filter(&self, track: &Track, gyro_delay_s: f64) -> Vec<Option<UnitQuaternion<f64>>> {
        let channels = &self.twin.unit().channels;
        let mut filter = Filter::new(self.params(gyro_delay_s));
        let starts_s = self.twin.starts_s();
        let gyro_slot_s = self.mean(Kind::Gyro, |index| channels[index].slot_s);
        let at_s = channels.get(self.first).map_or(0.0, |channel| channel.slot_s);
        let variances = KINDS.map(|kind| {
            let count = channels.iter().filter(|channel| channel.sensor == kind).count().max(1);
            // Axes all round: each tells a third of a component.
            3.0 * self.mean(kind, |index| channels[index].sigma().powi(2)) / count as f64
        });
        let micros = |t_s: f64| ((t_s + EPOCH_S).max(0.0) * 1e6).round() as u64;
        let mut before: Option<(f64, Vector3<f64>)> = None;
        let mut attitudes = Vec::new();
        for (at, row) in self.rows.iter().enumerate() {
            let start_s = starts_s[*row];
            let Some(rate_b) = track.vectors[1][at] else {
                attitudes.push(None);
                continue;
            };
            let (before_s, rate_before_b) = before.replace((start_s, rate_b)).unwrap_or((start_s, rate_b));
            let since_s = start_s - before_s;
            let covered_s = if since_s < LONGEST_STEP_S { since_s } else { 0.0 };
            let sampled = |kind: usize| {
                track.vectors[kind][at].map(|value_b| Sampled {
                    value_b: value_b.cast(),
                    variance: variances[kind] as f32,
                    scatter: 0.0,
                    at_us: micros(start_s + at_s),
                })
            };
            filter.step(&Step {
                at_us: micros(start_s + gyro_slot_s),
                covered_s: covered_s as f32,
                angle_b: ((rate_b + rate_before_b) * (0.5 * covered_s)).cast(),
                angle_variance: (variances[1] * covered_s * covered_s) as f32,
                rate_b: rate_b.cast(),
                saturated: false,
                acc: sampled(0),
                mag: sampled(2),
                lift_off: false,
            });
            attitudes.push(filter.aligned.then(|| filter.attitude().cast()));
        }
        attitudes
    }

    fn params(&self, gyro_delay_s: f64) -> Params {
        let environment = self.twin.environment();
        let channels = &self.twin.unit().channels;
        let tau_s = self.mean(Kind::Gyro, |index| channels[index].tau_s());
        let field_n = environment.field_n_ut;
        let level = field_n.x.hypot(field_n.y);
        Params {
            gravity: environment.gravity as f32,
            earth_rate_n: environment.earth_rate_n().cast(),
            field: Reference::known(
                field_n.norm() as f32,
                field_n.z.atan2(level) as f32,
                field_n.y.atan2(field_n.x) as f32,
            ),
            delays: Delays {
                gyro_s: (tau_s + gyro_delay_s) as f32,
                // They are carried to their stamp already.
                acc_s: 0.0,
                mag_s: 0.0,
            },
            ..Params::ROOM
        }
    }
}

/// Difference quotient of a vector about a row; one-sided at an end, `None` beside a hole.
fn slope(values: &[Option<Vector3<f64>>], rows: &[usize], starts_s: &[f64], at: usize) -> Option<Vector3<f64>> {
    let (before, after) = (at.saturating_sub(1), (at + 1).min(values.len().saturating_sub(1)));
    let over_s = starts_s[rows[after]] - starts_s[rows[before]];
    let change = values[after]? - values[before]?;
    (over_s > 0.0 && over_s < LONGEST_STEP_S).then(|| change / over_s)
}

#[cfg(test)]
mod tests;
