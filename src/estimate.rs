//! A cycle to an attitude: calibration, redundancy and fault isolation, TRIAD, Kalman filter. The whole step.
//!
//! In: a [`Sample`] and its [`Increments`], which is what a packet and its derived frame hold between them. Out: an
//! [`Estimate`]. In this order:
//!
//! ```text
//! counts --calibration--> along 28 axes --faults--> force_b, field_b, rate_b, health --triad--> attitude of this cycle
//! increments --turn--> rotation through the same calibration -----------.
//! force_b and field_b at the mean slot times of the sensors used --------+--kalman--> attitude, bias, covariance
//! (force: the mean of this and of what was read between cycles) ---------'
//!                                             faults <--- gyro bias ----'
//! ```
//!
//! Where a rocket spins ([`boost`]), another filter takes the cycle in place of the lower half: [`crate::spin`].
//!
//! The step is a function of the state and its arguments, in f32, with the arithmetic of `libm` alone: a host that is given
//! the same cycles from the start computes the same bits as the unit did.
//!
//! Refuses nothing. A cycle that repeats or goes back in time gives vectors and TRIAD, and the filter leaves it out; see
//! [`kalman`] for gaps.

mod boost;
mod force;
mod params;
mod sampled;
#[cfg(test)]
mod tests;
mod turn;

use boost::Boost;
use force::Averager;
use nalgebra::{ComplexField, Matrix3, UnitQuaternion, Vector3};

use crate::{
    attitude::{self, dcm_bn},
    board::Board,
    calibration::{Ranges, Set, Temperatures},
    faults::{Monitor, SensorHealth, Vectors},
    flight_log::record,
    increments::{Force, Increments},
    kalman::{self, Filter, Nose, Outage, Outcome, Step, seconds},
    redundancy::Known,
    sample::{Kind, Sample},
    settings::Settings,
    site::Site,
    spin, triad,
};

/// What a cycle says of the attitude.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Estimate {
    /// [m/s2] calibrated specific force at the centre of rotation, in b.
    pub force_b: [f32; 3],
    /// \[uT\] calibrated field, in b.
    pub field_b_ut: [f32; 3],
    /// [rad/s] calibrated inertial rate, in b; the filter's bias is not taken off.
    pub rate_b: [f32; 3],
    /// Which axes were not used, and what is not isolable.
    pub sensors: SensorHealth,
    /// TRIAD's q_nb of this cycle, scalar first; `None` unless both vectors are whole and force is near one g.
    pub triad_nb: Option<[f32; 4]>,
    /// The filter's q_nb at [`Increments::end_us`], scalar first; `None` until it has aligned itself.
    pub q_nb: Option<[f32; 4]>,
    /// \[rad2\] covariance of its error as a rotation vector in n: NN, NE, ND, EE, ED, DD. As of the latest window of the
    /// filter whose work on it is done, which is some cycles after its measurements have corrected the attitude.
    pub covariance_n: [f32; 6],
    /// [rad/s] gyro bias in b.
    pub bias_b: [f32; 3],
    /// [rad/s] standard deviation of each of its components.
    pub bias_sd: [f32; 3],
}

impl Estimate {
    /// Of a cycle of which nothing is known.
    pub const NOTHING: Estimate = Estimate {
        force_b: [0.0; 3],
        field_b_ut: [0.0; 3],
        rate_b: [0.0; 3],
        sensors: SensorHealth(0),
        triad_nb: None,
        q_nb: None,
        covariance_n: [0.0; 6],
        bias_b: [0.0; 3],
        bias_sd: [0.0; 3],
    };

    /// What the flight log keeps of it; `None` without an attitude.
    pub fn kept(&self) -> Option<record::Estimate> {
        let q_nb = self.q_nb?;
        let [nn, ne, nd, ee, ed, dd] = self.covariance_n;
        let covariance_n = Matrix3::new(nn, ne, nd, ne, ee, ed, nd, ed, dd);
        let dcm = dcm_bn(&attitude::from_parts(q_nb)?);
        let covariance_b = dcm * covariance_n * dcm.transpose();
        let variances: [f32; 3] = covariance_b.diagonal().into();
        let [x, y, z] = variances.map(|variance| ComplexField::sqrt(variance.max(0.0)));
        let [bias_x, bias_y, bias_z] = self.bias_sd;
        Some(record::Estimate {
            q_nb,
            bias_b: self.bias_b,
            sigma: [x, y, z, bias_x, bias_y, bias_z],
            sensors: self.sensors,
        })
    }
}

/// Force within this part of one g is taken for the vertical by TRIAD: 0.9 to 1.1 g, as by the filter after lift-off.
const NEAR_ONE_G: f32 = 0.1;

/// \[s\] a cycle whose increment covers less of it by this much has a gap: more than two fast samples.
const LARGEST_GAP_S: f32 = 0.03;

/// Bytes that are kept of it for after a reset.
pub const KEPT_BYTES: usize = kalman::KEPT_BYTES + spin::kept::KEPT_BYTES;

const _: () = assert!(KEPT_BYTES <= crate::retained::ATTITUDE.fits());

/// Everything the step remembers.
#[derive(Clone, Debug)]
pub struct Estimator {
    set: Set,
    temperatures: Temperatures,
    monitor: Monitor,
    filter: Filter,
    turn_solver: turn::Solver,
    averager: Averager,
    boost: Boost,
    /// White variance of a component of force, in (m/s2)^2, and of field, in uT2, by all axes.
    white: [f32; 2],
    /// The step before completed a window of the filter.
    closed: bool,
    /// An attitude was found that no rail was held against.
    found: bool,
    /// What TRIAD knows.
    axes_n: Option<Matrix3<f32>>,
    last_us: Option<u64>,
    /// Of the filter's covariance when it was last looked at, with what is said of it.
    settlements: Option<u8>,
    covariance_n: [f32; 6],
    bias_sd: [f32; 3],
}

impl Estimator {
    /// With a parameter set, at a site. A new set makes a new estimator: what was learnt was learnt through the old one.
    #[inline(never)]
    pub fn new(set: Set, site: &Site) -> Self {
        Estimator {
            temperatures: Temperatures::default(),
            monitor: Monitor::new(&set),
            filter: filter(&set, site),
            turn_solver: turn::Solver::default(),
            averager: Averager::EMPTY,
            boost: Boost::WAITING,
            closed: false,
            white: sampled::whites(&set),
            found: false,
            axes_n: axes_n(site),
            last_us: None,
            settlements: None,
            covariance_n: [0.0; 6],
            bias_sd: [0.0; 3],
            set,
        }
    }

    /// Begins afresh with another set, in place: two estimators are more than the unit's stack should hold.
    #[inline(never)]
    pub fn renew(&mut self, set: &Set, site: &Site) {
        self.set = *set;
        self.temperatures = Temperatures::default();
        self.monitor = Monitor::new(set);
        self.filter = filter(set, site);
        self.turn_solver = turn::Solver::default();
        self.averager = Averager::EMPTY;
        self.boost = Boost::WAITING;
        self.closed = false;
        self.found = false;
        self.white = sampled::whites(set);
        self.axes_n = axes_n(site);
        self.last_us = None;
        self.settlements = None;
    }

    /// Begins afresh at another site, with the same set.
    pub fn begin_at(&mut self, site: &Site) {
        let set = self.set;
        self.renew(&set, site);
    }

    /// A checksum of all that it keeps from one step to the next, and of `kept`, by which a bit of the RAM that flipped is found. Its
    /// set is left out, which has a copy, and the readings of force between two cycles, which are still coming and are each held
    /// against the others.
    #[inline(never)]
    pub fn ram_sum<B: Board>(&self, kept: &[u8; KEPT_BYTES]) -> u32 {
        // By their names: a field that is added is in the sum, or said to be left out.
        let Self {
            set: _,
            averager: _,
            temperatures,
            monitor,
            filter,
            turn_solver,
            boost,
            white,
            closed,
            found,
            axes_n,
            last_us,
            settlements,
            covariance_n,
            bias_sd,
        } = self;
        let sum = B::ram_sum(kept, 0);
        let sum = B::ram_sum(temperatures, sum);
        let sum = B::ram_sum(monitor, sum);
        let sum = B::ram_sum(filter, sum);
        let sum = B::ram_sum(turn_solver, sum);
        let sum = B::ram_sum(boost, sum);
        let sum = B::ram_sum(white, sum);
        let sum = B::ram_sum(closed, sum);
        let sum = B::ram_sum(found, sum);
        let sum = B::ram_sum(axes_n, sum);
        let sum = B::ram_sum(last_us, sum);
        let sum = B::ram_sum(settlements, sum);
        let sum = B::ram_sum(covariance_n, sum);
        B::ram_sum(bias_sd, sum)
    }

    /// Begins afresh where a bit of it has flipped, and goes on from what was kept after the latest step, if that is still whole.
    #[inline(never)]
    pub fn restore(&mut self, set: &Set, site: &Site, kept: Option<&[u8; KEPT_BYTES]>) {
        self.renew(set, site);
        if let Some(kept) = kept {
            let outage = Outage {
                ended_us: Estimator::kept_at_us(kept),
                ..Outage::default()
            };
            self.resume(kept, outage);
        }
    }

    /// Puts right its set, or the other copy of it, where a flipped bit makes them differ; whether it did. Right is the one that
    /// the checksum fits.
    #[inline(never)]
    pub fn mend_set(&mut self, copy: &mut Set, checksum: u32) -> bool {
        if self.set == *copy {
            return false;
        }
        if self.set.checksum() == checksum {
            *copy = self.set;
        } else {
            self.set = *copy;
        }
        true
    }

    /// Of a unit with these settings and the compiled-in parameters.
    ///
    /// Not inlined, as the others here: what they build on the way would lie on the stack under all that the unit does.
    #[inline(never)]
    pub fn of(settings: &Settings) -> Self {
        Estimator::new(Set::compiled_in(Ranges::of(settings)), &settings.site)
    }

    /// Keeps the filter for after a reset, and that of the spin while it is on; `false` where there is no attitude to keep.
    pub fn keep(&mut self, bytes: &mut [u8; KEPT_BYTES]) -> bool {
        let Some((of_filter, of_spin)) = bytes.split_first_chunk_mut() else {
            return false;
        };
        let is_known = self.filter.keep(of_filter);
        self.boost.keep(of_filter, of_spin);
        is_known
    }

    /// \[us\] when what is in these bytes was kept, in its own clock.
    pub fn kept_at_us(bytes: &[u8; KEPT_BYTES]) -> u64 {
        bytes.first_chunk().map_or(0, Filter::kept_at_us)
    }

    /// Goes on, after a reset, from what was kept.
    #[inline(never)]
    pub fn resume(&mut self, bytes: &[u8; KEPT_BYTES], outage: Outage) {
        if let Some((of_filter, of_spin)) = bytes.split_first_chunk() {
            self.filter.resume(of_filter, outage);
            self.resume_boost(of_spin, outage);
        }
    }

    /// Goes on, after a power cut, from the newest record, unless there is an attitude, or the first window finds one.
    #[inline(never)]
    pub fn resume_near(&mut self, kept: &record::Estimate, outage: Outage) {
        let Some(q_nb) = attitude::from_parts(kept.q_nb).filter(|_| !self.filter.aligned) else {
            return;
        };
        let [x, y, z, bias_x, bias_y, bias_z] = kept.sigma;
        let dcm = dcm_bn(&q_nb).transpose();
        let covariance_n = dcm * Matrix3::from_diagonal(&Vector3::new(x * x, y * y, z * z)) * dcm.transpose();
        let bias = (Vector3::from(kept.bias_b), [bias_x, bias_y, bias_z]);
        self.filter.resume_near(q_nb, covariance_n, bias, outage);
    }

    /// The filter as it stands.
    pub fn filter(&self) -> &Filter {
        &self.filter
    }

    /// Takes a reading of the accelerometers before the packet with this counter, so that the step has less to do. A caller that has the
    /// readings only with the cycle leaves this out: the step takes the readings that were not taken here.
    #[inline(never)]
    pub fn take_force(&mut self, counter: u16, force: &Force) {
        self.averager.take(counter, force, &self.set);
    }

    /// Takes the direction of the nose as it is known from outside, if that is new, or if an attitude was found since. `None` if it did not;
    /// by which angle \[rad\] they contradict each other, if they do.
    pub fn know_nose(&mut self, nose: &Nose, is_new: bool) -> Option<Result<(), f32>> {
        let is_due = self.filter.may_know_nose() && !self.boost.is_on() && (is_new || self.found);
        self.found &= !is_due;
        is_due.then(|| self.filter.know_nose(nose))
    }

    /// Takes a cycle.
    pub fn step(&mut self, sample: &Sample, increments: &Increments) -> Estimate {
        self.take(sample, increments, &mut Outcome::default())
    }

    /// Takes a cycle; the filter's records of it too.
    pub fn step_in_full(&mut self, sample: &Sample, increments: &Increments) -> (Estimate, Outcome) {
        let mut outcome = Outcome::default();
        (self.take(sample, increments, &mut outcome), outcome)
    }

    #[inline(never)]
    fn take(&mut self, sample: &Sample, increments: &Increments, outcome: &mut Outcome) -> Estimate {
        let reading = &sample.reading;
        self.temperatures.note(reading);
        let measured = self.set.apply(reading, &self.temperatures);
        let since_us = self.last_us.map(|last_us| sample.start_us.saturating_sub(last_us));
        self.last_us = Some(sample.start_us);
        // Zero is a gap to the monitor: there is no cycle before the first.
        let dt_s = since_us.map_or(0.0, seconds);
        // The step that completes a window leaves what can wait to the next one, and that leaves its own to the one after.
        let closes = self.filter.closes_at(increments.end_us);
        let closed = core::mem::replace(&mut self.closed, closes);
        if closed {
            self.filter.spare();
        }
        let vectors = self.monitor.take(&self.set, reading, &measured, dt_s, closes);
        if self.boost.is_on() {
            return self.go_on_in_boost(sample, &measured, increments, &vectors);
        }
        let believed = vectors.rate_b.used | measured.saturated.of(Kind::Gyro);
        let turned = turn::turn(
            &self.set,
            &measured.gyros_above_c,
            increments,
            believed,
            &mut self.turn_solver,
        );
        let mut force = self.sampled(sample, Kind::Accelerometer, &vectors.force_b);
        self.averager.complete(reading.counter, &increments.forces, &self.set);
        if let Some(force) = &mut force {
            // With a gap the rotation up to a reading is not known. Zero is the gap before the first cycle.
            let is_whole = dt_s > 0.0 && dt_s < turned.covered_s + LARGEST_GAP_S;
            if is_whole && !turned.saturated {
                let lag_us = force.at_us.wrapping_sub(increments.end_us) as i32;
                let turn = force::Turn {
                    calibrated_b: turned.angle_b - self.filter.bias_b * turned.covered_s,
                    nominal_b: increments.angle_b,
                    since_b: vectors.rate_b.vector_b * (lag_us as f32 * 1e-6),
                    covered_s: turned.covered_s,
                };
                self.averager.average(force, vectors.force_b.used, &turn);
            }
        }
        self.averager.begin(&reading.acc_p, &vectors.force_b, &self.set);
        let field = self.sampled(sample, Kind::Magnetometer, &vectors.field_b_ut);
        let step = Step {
            // Without a fast sample since the cycle before, the cycle itself is when the rotation is missing.
            at_us: if turned.covered_s > 0.0 {
                increments.end_us
            } else {
                sample.start_us
            },
            covered_s: turned.covered_s,
            angle_b: turned.angle_b,
            angle_variance: turned.variance,
            rate_b: vectors.rate_b.vector_b,
            saturated: turned.saturated,
            acc: force,
            mag: field,
            lift_off: reading.lift_off,
        };
        self.filter.take(&step, outcome);
        self.found |= outcome.aligned;
        self.look_at_the_covariance();
        if !(closes || closed || sample.reading.lift_off) {
            self.learn_on_pad(sample, &measured, increments, &vectors);
        }
        self.see_about_boost(sample.reading.lift_off, increments, &vectors);
        self.estimate(&vectors)
    }

    /// Keeps what is said of the filter's covariance, once a window's work on it is done.
    fn look_at_the_covariance(&mut self) {
        let Some((covariance, settlements)) = self.filter.settled() else {
            return;
        };
        if self.settlements.replace(settlements) == Some(settlements) {
            return;
        }
        let (p, bias) = (covariance.attitude(), covariance.bias());
        self.covariance_n = [p.m11, p.m12, p.m13, p.m22, p.m23, p.m33 + self.filter.doubt()];
        self.bias_sd = [bias.m11, bias.m22, bias.m33].map(|variance| ComplexField::sqrt(variance.max(0.0)));
        if self.filter.aligned {
            let sd = ComplexField::sqrt(bias.trace() / 3.0);
            self.monitor.know_bias(self.filter.bias_b, sd);
        }
    }

    fn estimate(&self, vectors: &Vectors) -> Estimate {
        let aligned = self.filter.aligned.then(|| parts(self.filter.attitude()));
        self.estimate_with(vectors, aligned, self.filter.bias_b)
    }

    fn estimate_with(&self, vectors: &Vectors, q_nb: Option<[f32; 4]>, bias_b: Vector3<f32>) -> Estimate {
        Estimate {
            force_b: vectors.force_b.vector_b.into(),
            field_b_ut: vectors.field_b_ut.vector_b.into(),
            rate_b: vectors.rate_b.vector_b.into(),
            sensors: vectors.health,
            triad_nb: self.triad(vectors).map(parts),
            q_nb,
            covariance_n: self.covariance_n,
            bias_b: bias_b.into(),
            bias_sd: self.bias_sd,
        }
    }

    fn triad(&self, vectors: &Vectors) -> Option<UnitQuaternion<f32>> {
        let Vectors {
            force_b, field_b_ut, ..
        } = vectors;
        if force_b.known != Known::All || field_b_ut.known != Known::All {
            return None;
        }
        let gravity = self.filter.params.gravity;
        let (least, most) = ((1.0 - NEAR_ONE_G) * gravity, (1.0 + NEAR_ONE_G) * gravity);
        let squared = force_b.vector_b.norm_squared();
        // A comparison with NaN is false.
        let near = squared > least * least && squared < most * most;
        if !near {
            return None;
        }
        triad::attitude(-force_b.vector_b, field_b_ut.vector_b, self.axes_n.as_ref()?).ok()
    }
}

/// A filter that knows nothing yet but what the set says of the gyros.
#[inline(never)]
fn filter(set: &Set, site: &Site) -> Filter {
    let mut filter = Filter::new(params::params(site, set));
    let axes_b = set.gyro.map(|axis| axis.axis_b);
    let [_, _, gyro] = set.uncertainty;
    if let Some((least_squares, _)) = crate::redundancy::matrix(&axes_b, 0b1111) {
        filter.know_gyros(&least_squares, &axes_b, [gyro.scale, gyro.direction]);
    }
    filter
}

/// The axes that the vertical and the field of a site span, which are never collinear.
#[inline(never)]
fn axes_n(site: &Site) -> Option<Matrix3<f32>> {
    let (sin, cos) = attitude::sin_cos(site.declination_deg.to_radians());
    triad::known_axes(Vector3::z(), Vector3::new(cos, sin, 0.0)).ok()
}

/// Scalar first.
fn parts(q: UnitQuaternion<f32>) -> [f32; 4] {
    [q.w, q.i, q.j, q.k]
}
