//! The filter of the spin in f64: dense matrices, `F P F' + Q`, the full Joseph form, equations of force by the null space of the axes.
//!
//! The model of `emems::spin`, from its equations, with its adaptive noises and its gates; of what it knows at the end only the
//! attitude, its covariance, the rate and the gyros' biases are said. It takes counts through the unit's own calibration: those
//! numbers are what is measured.

mod forces;
mod lasting;

use emems::{
    calibration::{Axis, Measured, Set},
    increments::{Increments, Slice, slices::BEYOND},
    sample::{Kind, NO_SLOT, NOT_READ, Sample},
    spin::Start,
};
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, UnitQuaternion, Vector3};

use self::lasting::{Lasting, least_along};

/// Error states: attitude in n, spin and its derivative, rate across and its derivative, biases, what gyros see of the spin, iron, lever,
/// biases by load; and what is considered and never corrected, the field's error about two axes across it, over its deviation.
const N: usize = 27;
const FIELD: usize = 25;
const SPIN: usize = 3;
const SPIN_UP: usize = 4;
const ACROSS: usize = 5;
const ACROSS_UP: usize = 7;
const BIAS: usize = 9;
const SEES: usize = 13;
const IRON: usize = 17;
const LEVER: usize = 20;
const BY_LOAD: usize = 21;

const GATE: f64 = 25.0;

/// State, covariance and noises.
pub struct Spin {
    start: Start<'static>,
    at_us: u64,
    /// Attitude.
    pub q_nb: UnitQuaternion<f64>,
    /// Covariance of all error states.
    pub p: SMatrix<f64, N, N>,
    /// Error that the scalars since the latest correction found.
    error: SVector<f64, N>,
    spin: f64,
    spin_up: f64,
    phase: f64,
    across: [f64; 2],
    across_up: [f64; 2],
    /// [rad/s] of each gyro.
    pub bias: [f64; 4],
    sees: [f64; 4],
    by_load: [f64; 4],
    iron_b: Vector3<f64>,
    lever: f64,
    rough: f64,
    usual: f64,
    seen: bool,
    surprised_s: f64,
    refused: u8,
    force: Option<(u64, Vector3<f64>)>,
    changed_b: Option<Vector3<f64>>,
    shaken: f64,
    lasting: Lasting,
}

enum Event {
    Slice(Slice),
    Force([[i16; 3]; 4]),
    Field(usize),
}

fn square(x: f64) -> f64 {
    x * x
}

fn value(axis: &Axis, counts: f32, above_c: f32) -> f64 {
    f64::from(axis.scale_at(above_c) * (counts - axis.bias_counts_at(above_c)))
}

/// Axes across the field about which its direction may be off: level, and the one above the other.
fn off_n(field_n: Vector3<f64>) -> [Vector3<f64>; 2] {
    let level_n = Vector3::z().cross(&field_n).normalize();
    [level_n, field_n.cross(&level_n).normalize()]
}

fn axis_b(axis: &Axis) -> Vector3<f64> {
    axis.axis_b.cast()
}

impl Spin {
    /// From what the unit's own filter begins with, without a pad.
    pub fn begin(start: &Start<'static>, set: &Set) -> Self {
        let [_, _, of_gyro] = set.uncertainty;
        let mut variances = [0.0; N];
        variances[FIELD..].fill(1.0);
        variances[SPIN] = square(start.rate_sd.into());
        variances[SPIN_UP] = 9.0;
        for axis in 0..2 {
            variances[ACROSS + axis] = square(start.rate_sd.into());
            variances[ACROSS_UP + axis] = 0.25;
        }
        for k in 0..4 {
            variances[BIAS + k] = start.bias_variance.into();
            let along = axis_b(&set.gyro[k]).x;
            variances[SEES + k] = square(f64::from(of_gyro.scale) * along) + square(of_gyro.direction.into());
            variances[BY_LOAD + k] = square(start.surroundings.bias_per_g.into());
        }
        let shortest = set.place_b.iter().map(|place| place.norm()).fold(f32::MAX, f32::min);
        variances[LEVER] = square(f64::from(set.place_sigma) / f64::from(shortest));
        let mut p = SMatrix::from_diagonal(&SVector::from(variances));
        p.fixed_view_mut::<3, 3>(0, 0).copy_from(&start.covariance_n.cast());
        p.fixed_view_mut::<3, 3>(IRON, IRON)
            .copy_from(&start.iron_covariance.cast());
        // The heading's error is that of the field by the part that the field alone has in it.
        let surroundings = &start.surroundings;
        let (field_sd, level) = (
            f64::from(surroundings.field_sd),
            off_n(surroundings.field_n_ut.cast())[1].z,
        );
        let iron = f64::from(start.iron_covariance.trace()) / 3.0 / f64::from(surroundings.field_n_ut.norm_squared());
        let from_field = (p[(2, 2)] * square(level) / (square(field_sd) + iron)).min(1.0);
        p[(2, FIELD + 1)] = from_field * field_sd / level;
        p[(FIELD + 1, 2)] = p[(2, FIELD + 1)];
        let rate_b: Vector3<f64> = start.rate_b.cast();
        Spin {
            at_us: start.at_us,
            q_nb: UnitQuaternion::new_normalize(start.q_nb.into_inner().cast()),
            p,
            error: SVector::zeros(),
            spin: rate_b.x,
            spin_up: 0.0,
            phase: 0.0,
            across: [rate_b.y, rate_b.z],
            across_up: [0.0; 2],
            bias: set.gyro.map(|axis| axis_b(&axis).dot(&start.bias_b.cast())),
            sees: [0.0; 4],
            by_load: [0.0; 4],
            iron_b: start.iron_b.cast(),
            lever: 0.0,
            rough: 1e-4,
            usual: 10.0,
            seen: true,
            surprised_s: 0.0,
            refused: 0,
            force: None,
            changed_b: None,
            shaken: 0.0,
            lasting: Lasting::NONE,
            start: start.clone(),
        }
    }

    /// [rad/s] the rate in b.
    pub fn rate_b(&self) -> Vector3<f64> {
        Vector3::new(self.spin, 0.0, 0.0) + self.turning_b(self.across)
    }

    /// \[rad2\] covariance of the attitude.
    pub fn covariance_n(&self) -> Matrix3<f64> {
        self.p.fixed_view::<3, 3>(0, 0).into_owned()
    }

    /// Attitude at an instant.
    pub fn attitude_at(&self, at_us: u64) -> UnitQuaternion<f64> {
        self.carried((at_us as f64 - self.at_us as f64) * 1e-6).0
    }

    fn across_b(&self) -> [Vector3<f64>; 2] {
        let (sin, cos) = self.phase.sin_cos();
        [Vector3::new(0.0, cos, -sin), Vector3::new(0.0, sin, cos)]
    }

    fn turning_b(&self, across: [f64; 2]) -> Vector3<f64> {
        let [y_b, z_b] = self.across_b();
        y_b * across[0] + z_b * across[1]
    }

    fn nose_n(&self) -> Vector3<f64> {
        self.q_nb * Vector3::x()
    }

    fn load(&self) -> f64 {
        let pad = f64::from(self.start.pad.along_x);
        self.force.map_or(0.0, |(_, force_b)| (force_b.x - pad) / 9.806_65)
    }

    /// Takes a cycle.
    pub fn take(&mut self, set: &Set, sample: &Sample, measured: &Measured, increments: &Increments) {
        let delays = self.start.surroundings.delays;
        let late_us = |late_s: f32| (late_s * 1e6) as u64;
        let mut events = Vec::new();
        for slice in increments.slices.iter().filter(|slice| !slice.is_none()) {
            let middle_us = increments.end_us - u64::from(slice.before_us) - u64::from(slice.lasts_us) / 2;
            events.push((middle_us - late_us(delays.gyro_s), Event::Slice(*slice)));
        }
        let began_us = increments.end_us - u64::from(increments.covered_us);
        for force in increments.forces.iter().filter(|force| !force.is_none()) {
            let at_us = began_us + u64::from(force.covered_us) + u64::from(force.after_us);
            events.push((at_us - late_us(delays.acc_s), Event::Force(force.acc_p)));
        }
        let slots = sample.slots_of(Kind::Accelerometer);
        let mean_us = slots.iter().map(|slot| u64::from(*slot)).sum::<u64>() / slots.len() as u64;
        let at_us = sample.start_us + mean_us - late_us(delays.acc_s);
        events.push((at_us, Event::Force(sample.reading.acc_p)));
        for (plate, slot) in sample.slots_of(Kind::Magnetometer).iter().enumerate() {
            assert_ne!(*slot, NO_SLOT);
            let at_us = sample.start_us + u64::from(*slot) - late_us(delays.mag_s);
            events.push((at_us, Event::Field(plate)));
        }
        events.sort_by_key(|(at_us, _)| *at_us);
        let mut of_field = [0, 0];
        for (at_us, event) in events {
            self.carry(at_us);
            match event {
                Event::Slice(slice) => self.take_slice(set, measured, &slice),
                Event::Force(acc_p) => self.take_force(set, &acc_p),
                Event::Field(plate) => of_field[usize::from(self.take_field(set, measured, plate))] += 1,
            }
            self.correct();
        }
        self.give_back(set);
        self.mind_the_gate(of_field);
    }

    fn carried(&self, dt_s: f64) -> (UnitQuaternion<f64>, f64) {
        let across = [0, 1].map(|k| (self.across[k] + 0.5 * dt_s * self.across_up[k]) * dt_s);
        let spun = (self.spin + 0.5 * dt_s * self.spin_up) * dt_s;
        let earth_n: Vector3<f64> = self.start.surroundings.earth_rate_n.cast();
        let turned = UnitQuaternion::from_scaled_axis(self.turning_b(across))
            * UnitQuaternion::from_scaled_axis(Vector3::x() * spun);
        (
            UnitQuaternion::from_scaled_axis(earth_n * -dt_s) * self.q_nb * turned,
            spun,
        )
    }

    fn carry(&mut self, at_us: u64) {
        let all_s = (at_us as f64 - self.at_us as f64) * 1e-6;
        self.at_us = at_us;
        let steps = (all_s.abs() / 0.03) as u32 + 1;
        let dt_s = all_s / f64::from(steps);
        for _ in 0..if all_s == 0.0 { 0 } else { steps } {
            let [y_b, z_b] = self.across_b();
            let mut f = SMatrix::<f64, N, N>::identity();
            let sources = [
                (SPIN, SPIN_UP, Vector3::x()),
                (ACROSS, ACROSS_UP, y_b),
                (ACROSS + 1, ACROSS_UP + 1, z_b),
            ];
            for (rate, up, along_b) in sources {
                let along_n = self.q_nb * along_b;
                f.fixed_view_mut::<3, 1>(0, rate).copy_from(&(along_n * dt_s));
                f.fixed_view_mut::<3, 1>(0, up)
                    .copy_from(&(along_n * (0.5 * dt_s * dt_s)));
                f[(rate, up)] = dt_s;
            }
            let surprised = self.surprised_s > 0.0;
            let mut walks = SVector::<f64, N>::zeros();
            walks.fixed_rows_mut::<3>(0).fill(1e-4);
            walks[SPIN_UP] = if surprised { 60.0 } else { 2.0 };
            walks
                .fixed_rows_mut::<2>(ACROSS_UP)
                .fill(if surprised { 1.0 } else { 0.2 });
            walks.fixed_rows_mut::<4>(BIAS).fill(1.5e-6);
            walks.fixed_rows_mut::<3>(IRON).fill(0.01);
            let q = SMatrix::from_diagonal(&walks.map(|walk| walk * walk * dt_s.abs()));
            self.p = f * self.p * f.transpose() + q;
            let (q_nb, spun) = self.carried(dt_s);
            self.q_nb = q_nb;
            self.phase += spun;
            self.spin += self.spin_up * dt_s;
            for axis in 0..2 {
                self.across[axis] += self.across_up[axis] * dt_s;
            }
            self.surprised_s -= dt_s;
        }
    }

    fn row(of: &[(usize, f64)]) -> SVector<f64, N> {
        let mut row = SVector::zeros();
        for (state, part) in of {
            row[*state] += part;
        }
        row
    }

    /// Variance of what is seen, and what is left of the residual.
    fn look(&self, h: &SVector<f64, N>, residual: f64) -> (f64, f64) {
        (h.dot(&(self.p * h)), residual - h.dot(&self.error))
    }

    fn update(&mut self, h: &SVector<f64, N>, residual: f64, r: f64, gate: f64) -> f64 {
        let (of_state, left) = self.look(h, residual);
        let off = left * left / (of_state + r);
        if off > gate {
            return off;
        }
        let mut gain = self.p * h / (of_state + r);
        // Considered: the form below holds for any gain.
        gain.fixed_rows_mut::<{ N - FIELD }>(FIELD).fill(0.0);
        self.error += gain * left;
        let left_over = SMatrix::<f64, N, N>::identity() - gain * h.transpose();
        self.p = left_over * self.p * left_over.transpose() + gain * r * gain.transpose();
        off
    }

    fn correct(&mut self) {
        let error = std::mem::replace(&mut self.error, SVector::zeros());
        self.q_nb = UnitQuaternion::from_scaled_axis(error.fixed_rows::<3>(0).into_owned()) * self.q_nb;
        self.spin += error[SPIN];
        self.spin_up += error[SPIN_UP];
        for axis in 0..2 {
            self.across[axis] += error[ACROSS + axis];
            self.across_up[axis] += error[ACROSS_UP + axis];
        }
        for k in 0..4 {
            self.bias[k] += error[BIAS + k];
            self.sees[k] += error[SEES + k];
            self.by_load[k] += error[BY_LOAD + k];
        }
        self.iron_b += error.fixed_rows::<3>(IRON);
        self.lever += error[LEVER];
    }

    fn take_slice(&mut self, set: &Set, measured: &Measured, slice: &Slice) {
        let lasts_s = 1e-6 * f64::from(slice.lasts_us);
        let [y_b, z_b] = self.across_b();
        let turning_b = self.turning_b(self.across);
        let left = 0.5 * (1.0 + (0.5 * self.spin * lasts_s).cos()) / (1.0 + square(0.0125 * self.spin)).sqrt();
        let (load, spin) = (self.load(), self.spin);
        let at_stop = |quarters: i16| quarters.unsigned_abs() == BEYOND.unsigned_abs();
        let gives = |quarters: &&i16| **quarters != NOT_READ && !at_stop(**quarters);
        self.seen = slice.quarters.iter().filter(gives).count() >= 3;
        self.lasting.told_s += lasts_s;
        let heard = least_along(set);
        // Each gyro's row and what is believed of it are of before the slice.
        let (bias, by_load) = (self.bias, self.by_load);
        for k in 0..4 {
            let (quarters, axis) = (slice.quarters[k], &set.gyro[k]);
            if quarters == NOT_READ {
                continue;
            }
            let n_b = axis_b(axis);
            let sees = n_b.x + self.sees[k];
            let h = Self::row(&[
                (SPIN, sees),
                (ACROSS, left * n_b.dot(&y_b)),
                (ACROSS + 1, left * n_b.dot(&z_b)),
                (BIAS + k, 1.0),
                (SEES + k, spin),
                (BY_LOAD + k, load),
            ]);
            let believed = sees * spin + left * n_b.dot(&turning_b) + bias[k] + by_load[k] * load;
            let above_c = measured.gyros_above_c[k];
            if at_stop(quarters) {
                let stop = value(axis, if quarters > 0 { 4368.0 } else { -4368.0 }, above_c);
                if (stop - believed > 0.0) == (quarters > 0) {
                    self.update(&h, stop - believed, 0.04, f64::MAX);
                }
                continue;
            }
            let residual = value(axis, 0.25 * f32::from(quarters), above_c) - believed;
            let r = self.rough.max(0.5 * square(axis.noise.into()));
            let (of_state, left_over) = self.look(&h, residual);
            if of_state < r {
                let shown = (left_over * left_over - of_state).min(GATE * r);
                self.rough += (shown - self.rough) / 150.0;
            }
            let r = r.max(left_over * left_over / 9.0 - of_state);
            if k == heard {
                self.lasting
                    .hear(left_over / (of_state + r).sqrt(), spin, self.phase, lasts_s);
            }
            self.lasting.told += 0.5 * left * left * (1.0 - n_b.x * n_b.x) / r;
            self.update(&h, residual, r, f64::MAX);
        }
    }

    fn take_field(&mut self, set: &Set, measured: &Measured, plate: usize) -> bool {
        let dcm = Rotation3::from(self.q_nb).into_inner();
        let field_n: Vector3<f64> = self.start.surroundings.field_n_ut.cast();
        let field_b = dcm.transpose() * field_n;
        let mut residual_b = Vector3::zeros();
        let mut noise = 0.0_f64;
        for k in 3 * plate..3 * plate + 3 {
            let axis = &set.mag[k];
            let n_b = axis_b(axis);
            residual_b += n_b * (f64::from(measured.mag[k]) - n_b.dot(&(field_b + self.iron_b)));
            noise = noise.max(axis.noise.into());
        }
        let white = square(noise) + square(0.12);
        let way_b = self.rate_b().cross(&field_b);
        let speed = way_b.norm();
        let (along_b, other_b) = if speed > 1.0 {
            (way_b / speed, (way_b / speed).cross(&field_b).normalize())
        } else {
            (Vector3::x(), Vector3::y())
        };
        let mut all = true;
        for (n_b, r) in [(along_b, white + square(0.0002 * speed)), (other_b, white)] {
            let seen_n = (dcm * n_b).cross(&field_n);
            let mut h = SVector::<f64, N>::zeros();
            h.fixed_rows_mut::<3>(0).copy_from(&seen_n);
            h.fixed_rows_mut::<3>(IRON).copy_from(&n_b);
            for (k, off_n) in off_n(field_n).iter().enumerate() {
                let turned = n_b.dot(&dcm.tr_mul(&off_n.cross(&field_n)));
                h[FIELD + k] = turned * f64::from(self.start.surroundings.field_sd);
            }
            all &= self.update(&h, n_b.dot(&residual_b), r, GATE) <= GATE;
        }
        all
    }

    fn mind_the_gate(&mut self, [refused, taken]: [u8; 2]) {
        if taken >= refused {
            self.refused = 0;
            return;
        }
        self.refused += 1;
        let open = |p: &mut SMatrix<f64, N, N>, more: Matrix3<f64>| {
            let opened = p.fixed_view::<3, 3>(0, 0) + more;
            p.fixed_view_mut::<3, 3>(0, 0).copy_from(&opened);
        };
        let roll = if self.surprised_s > 0.0 { 1 } else { 3 };
        if self.refused.is_multiple_of(roll) {
            let nose_n = self.nose_n();
            open(&mut self.p, nose_n * nose_n.transpose());
            self.p[(SPIN, SPIN)] += 0.25;
        }
        if self.refused >= 10 {
            self.refused = 0;
            open(&mut self.p, Matrix3::from_diagonal_element(0.09));
        }
    }
}
