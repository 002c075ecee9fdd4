//! The filter against the textbook, and its covariance against the errors it makes.

use emems::kalman::{Filter, Params, Quantity, Reference, Rest, Sampled, Step};
use host_tests::reference::mekf::Mekf;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

const GRAVITY: f64 = 9.806_65;
const NORM_UT: f64 = 40.0;
const DIP: f64 = 1.0;
const STEP_S: f64 = 0.1;
const STEPS_PER_WINDOW: usize = 10;

/// What the simulated flights are made of, and what the filter is told.
fn params() -> Params {
    Params {
        angle_noise: 0.0,
        turn_noise: 0.0,
        bias_walk: 0.0,
        gyro_matrix_walk: 0.0,
        velocity_sd: 0.2,
        velocity_per_spread_s: 0.0,
        velocity_lasts_s: 0.0,
        acc_scale_error: 0.0,
        acc_excess: 0.0,
        heading_sd: 0.05,
        dip_sd: 0.03,
        field_lasts_s: 0.0,
        disturbance: 0.0,
        field_spread: 0.0,
        field_gate: 1.0,
        iron_sd_ut: 0.0,
        // Rest would measure the bias once more, and slow turns with it.
        rest: Rest {
            rate: 0.0,
            ..Params::ROOM.rest
        },
        field: Reference::known(NORM_UT as f32, DIP as f32, 0.0),
        ..Params::ROOM
    }
}

/// [rad/sqrt(s)] of the gyros, [m/s2] and \[uT\] of a sample.
const ANGLE_NOISE: f64 = 1e-3;
const ACC_NOISE: f64 = 0.045;
const MAG_NOISE: f64 = 0.2;
/// \[rad\] of the attitude at the start, about each axis.
const START_SD: f64 = 0.03;

#[derive(Clone, Copy, Debug)]
enum Motion {
    Still,
    /// 0.06 deg/s about the right axis, as once round the Earth.
    Orbit,
    /// Turns about all axes, up to 60 deg/s.
    Tumble,
    /// A rate table: 90 deg/s to one side, then to the other.
    Table,
}

impl Motion {
    fn rate_b(self, t_s: f64) -> Vector3<f64> {
        match self {
            Motion::Still => Vector3::zeros(),
            Motion::Orbit => Vector3::new(0.0, 0.06_f64.to_radians(), 0.0),
            Motion::Tumble => Vector3::new(
                (0.7 * t_s).sin(),
                0.6 * (0.45 * t_s).cos(),
                0.5 * (0.3 * t_s + 1.0).sin(),
            ),
            Motion::Table => Vector3::new(0.0, 0.0, if t_s % 20.0 < 10.0 { 1.57 } else { -1.57 }),
        }
    }
}

struct Flight {
    random: Xoshiro256PlusPlus,
    motion: Motion,
    q_nb: UnitQuaternion<f64>,
    bias_b: Vector3<f64>,
    matrix: Matrix3<f64>,
    velocity_n: Vector3<f64>,
    /// [m/s] by which the velocity changes in this window, and [m/s2] what is wrong with specific force meanwhile.
    sway_n: Vector3<f64>,
    wrong_n: Vector3<f64>,
    field_n: Vector3<f64>,
    step: usize,
}

impl Flight {
    fn new(motion: Motion, seed: u64) -> Self {
        let params = params();
        let mut flight = Flight {
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            motion,
            q_nb: UnitQuaternion::from_euler_angles(0.3, -0.4, 1.0),
            bias_b: Vector3::zeros(),
            matrix: Matrix3::zeros(),
            velocity_n: Vector3::zeros(),
            sway_n: Vector3::zeros(),
            wrong_n: Vector3::zeros(),
            field_n: Vector3::zeros(),
            step: 0,
        };
        flight.bias_b = flight.normal3(params.bias_sd.into());
        flight.matrix = Matrix3::from_fn(|_, _| flight.normal(params.gyro_matrix_sd.into()));
        let north_east = flight.normal3(params.velocity_sd.into());
        flight.velocity_n = Vector3::new(north_east.x, north_east.y, 0.0);
        flight
    }

    fn normal(&mut self, sd: f64) -> f64 {
        let unit: f64 = StandardNormal.sample(&mut self.random);
        unit * sd
    }

    fn normal3(&mut self, sd: f64) -> Vector3<f64> {
        Vector3::new(self.normal(sd), self.normal(sd), self.normal(sd))
    }

    /// What does not change within a window: the sway from one velocity to the next, an accelerometer error, and a
    /// field that is not quite the reference.
    fn begin_window(&mut self) {
        let params = params();
        let (north, east) = (
            self.normal(params.velocity_sd.into()),
            self.normal(params.velocity_sd.into()),
        );
        let next = Vector3::new(north, east, 0.0);
        self.sway_n = next - self.velocity_n;
        self.wrong_n = self.normal3(params.acc_error.into());
        self.velocity_n = next;
        let heading = self.normal(params.heading_sd.into());
        let dip = DIP + self.normal(params.dip_sd.into());
        self.field_n = Vector3::new(dip.cos() * heading.cos(), dip.cos() * heading.sin(), dip.sin()) * NORM_UT;
    }

    /// [1/s] acceleration over the change of velocity that it makes in a window: half a wave, nothing at either end.
    fn sway(&self) -> f64 {
        let wave = |step: usize| (std::f64::consts::PI * step as f64 / STEPS_PER_WINDOW as f64).sin();
        let whole: f64 = (1..STEPS_PER_WINDOW).map(wave).sum();
        wave((self.step - 1) % STEPS_PER_WINDOW + 1) / (whole * STEP_S)
    }

    fn next(&mut self) -> Step {
        if self.step.is_multiple_of(STEPS_PER_WINDOW) {
            self.begin_window();
        }
        let rate_b = self.motion.rate_b((self.step as f64 + 0.5) * STEP_S);
        self.step += 1;
        self.q_nb *= UnitQuaternion::from_scaled_axis(rate_b * STEP_S);
        let at_us = 1_000_000 + (self.step as f64 * STEP_S * 1e6).round() as u64;
        // turned = (1 - matrix) gyro - bias dt, solved for what the gyros give.
        let exact = (Matrix3::identity() - self.matrix).try_inverse().expect("small") * (rate_b + self.bias_b) * STEP_S;
        let angle_b = exact + self.normal3(ANGLE_NOISE * STEP_S.sqrt());
        let force_n = self.sway_n * self.sway() + self.wrong_n - Vector3::z() * GRAVITY;
        let acc_b = self.q_nb.inverse_transform_vector(&force_n) + self.normal3(ACC_NOISE);
        let mag_b = self.q_nb.inverse_transform_vector(&self.field_n) + self.normal3(MAG_NOISE);
        let sampled = |value_b: Vector3<f64>, sd: f64| {
            Some(Sampled {
                value_b: value_b.cast(),
                variance: (sd * sd) as f32,
                scatter: 0.0,
                at_us,
            })
        };
        Step {
            at_us,
            covered_s: STEP_S as f32,
            angle_b: angle_b.cast(),
            angle_variance: (ANGLE_NOISE * ANGLE_NOISE * STEP_S) as f32,
            rate_b: (exact / STEP_S).cast(),
            saturated: false,
            acc: sampled(acc_b, ACC_NOISE),
            mag: sampled(mag_b, MAG_NOISE),
            lift_off: false,
        }
    }

    /// A filter whose attitude is off by what its covariance says.
    fn filter(&mut self) -> Filter {
        let wrong = UnitQuaternion::from_scaled_axis(self.normal3(START_SD)) * self.q_nb;
        Filter::resumed(
            params(),
            wrong.cast(),
            Matrix3::from_diagonal_element((START_SD * START_SD) as f32),
        )
    }
}

const FLIGHTS: usize = 500;
const WINDOWS: usize = 120;

/// For each window: mean NEES of the attitude, 3 degrees of freedom, and mean NIS of a scalar, over all flights.
fn consistency(motion: Motion) -> Vec<(f64, f64)> {
    let mut sums = vec![(0.0, 0.0); WINDOWS];
    for seed in 0..FLIGHTS as u64 {
        let mut flight = Flight::new(motion, seed);
        let mut filter = flight.filter();
        for sum in &mut sums {
            let mut nis = (0.0, 0.0);
            for _ in 0..STEPS_PER_WINDOW {
                for record in filter.step(&flight.next()).innovations {
                    assert!(record.accepted, "{motion:?}, seed {seed}: {record:?}");
                    assert_ne!(record.quantity, Quantity::Bias);
                    nis.0 += f64::from(record.residual * record.residual / record.variance);
                    nis.1 += 1.0;
                }
            }
            let error = (flight.q_nb * filter.q_nb.cast().inverse()).scaled_axis();
            let p: Matrix3<f64> = filter.attitude_covariance_n().cast();
            sum.0 += error.dot(&(p.try_inverse().expect("definite") * error)) / FLIGHTS as f64;
            sum.1 += nis.0 / nis.1 / FLIGHTS as f64;
        }
    }
    sums
}

/// Half-width of the 95 % band of a mean of `count` chi-squares of one degree of freedom each: 1.96 sqrt(2/count).
fn half_band(count: f64) -> f64 {
    1.96 * (2.0 / count).sqrt()
}

fn is_honest(motion: Motion) {
    let windows = consistency(motion);
    let inside = |within: &dyn Fn(&(f64, f64)) -> bool| {
        windows.iter().filter(|window| within(window)).count() as f64 / WINDOWS as f64
    };
    let nees = inside(&|(nees, _)| (nees / 3.0 - 1.0).abs() < half_band(3.0 * FLIGHTS as f64));
    let nis = inside(&|(_, nis)| (nis - 1.0).abs() < half_band(4.0 * FLIGHTS as f64));
    let mean = |part: fn(&(f64, f64)) -> f64| windows.iter().map(part).sum::<f64>() / WINDOWS as f64;
    let (mean_nees, mean_nis) = (mean(|window| window.0 / 3.0), mean(|window| window.1));
    println!(
        "{motion:?}: NEES in band {nees:.3} (mean {mean_nees:.3} of 1), NIS in band {nis:.3} (mean {mean_nis:.3} of 1)"
    );
    // The acceptance figure.
    assert!(
        nees >= 0.93 && nis >= 0.93,
        "{motion:?}: NEES {nees} mean {mean_nees}, NIS {nis} mean {mean_nis}"
    );
}

#[test]
fn the_covariance_is_honest_at_rest() {
    is_honest(Motion::Still);
}

#[test]
fn the_covariance_is_honest_in_an_orbit() {
    is_honest(Motion::Orbit);
}

#[test]
fn the_covariance_is_honest_in_a_tumble() {
    is_honest(Motion::Tumble);
}

#[test]
fn the_covariance_is_honest_on_a_rate_table() {
    is_honest(Motion::Table);
}

#[test]
fn a_million_steps_in_f32_stay_with_f64() {
    // After the transient, as the acceptance figure has it.
    const TRANSIENT: usize = 2_000;
    const MOST_DEG: f64 = 1e-3;
    let mut params = params();
    // Over a day, constants that may walk.
    params.bias_walk = 1e-6;
    params.gyro_matrix_walk = 1e-6;
    params.angle_noise = 1e-4;
    let mut flight = Flight::new(Motion::Tumble, 1);
    let start = UnitQuaternion::from_scaled_axis(Vector3::new(0.02, -0.03, 0.01)) * flight.q_nb;
    let variance = START_SD * START_SD;
    let mut filter = Filter::resumed(params, start.cast(), Matrix3::from_diagonal_element(variance as f32));
    let mut reference = Mekf::new(params, start, variance);
    let (mut most, mut least_ratio) = (0.0_f64, f32::MAX);
    for step in 0..1_000_000 {
        let input = flight.next();
        filter.step(&input);
        reference.step(&input);
        if step > TRANSIENT && step % STEPS_PER_WINDOW == STEPS_PER_WINDOW - 1 {
            most = most.max(filter.q_nb.cast().angle_to(&reference.q_nb).to_degrees());
        }
        if step % 10_000 == 9 {
            // Scaled to unit diagonal, so that radians and metres compare.
            let p = filter.covariance().matrix();
            let scaled = p.map_with_location(|row, column, value| value / (p[(row, row)] * p[(column, column)]).sqrt());
            least_ratio = least_ratio.min(scaled.symmetric_eigenvalues().min());
        }
    }
    println!("f32 against f64 over 1e6 steps: at most {most:.2e} deg, least eigenvalue {least_ratio:.2e}");
    assert!(least_ratio > 0.0, "{least_ratio}");
    assert!(most < MOST_DEG, "{most}");
}

/// N12: ten hours. What a step costs depends on the path it takes, and on nothing else: the FPU of a Cortex-M4 takes the same cycles for
/// whatever operands (Arm 100166, table 7-1), and the state holds no denormal number, for which other processors take hundreds. The path is
/// told by what each window compares: in the tenth hour as much as in the first.
#[test]
fn ten_hours_leave_the_same_work_in_each_window_and_no_denormal_number() {
    const HOUR: usize = 36_000;
    let is_denormal = |number: &f32| *number != 0.0 && number.abs() < f32::MIN_POSITIVE;
    for motion in [Motion::Still, Motion::Tumble] {
        let mut params = params();
        (params.bias_walk, params.gyro_matrix_walk, params.angle_noise) = (1e-6, 1e-6, 1e-4);
        let mut flight = Flight::new(motion, 3);
        let variance = (START_SD * START_SD) as f32;
        let mut filter = Filter::resumed(params, flight.q_nb.cast(), Matrix3::from_diagonal_element(variance));
        let (mut compared, mut steps_that_compare, mut norm_off) = ([0_u64; 10], [0_u64; 10], 0.0_f32);
        for step in 0..10 * HOUR {
            let outcome = filter.step(&flight.next());
            assert_eq!((outcome.refusal, outcome.aligned), (None, false), "{motion:?} {step}");
            compared[step / HOUR] += outcome.innovations.len() as u64;
            steps_that_compare[step / HOUR] += u64::from(!outcome.innovations.is_empty());
            norm_off = norm_off.max((filter.q_nb.norm() - 1.0).abs());
            if step % 977 == 0 {
                let p = filter.covariance().matrix();
                let state = filter
                    .q_nb
                    .as_vector()
                    .iter()
                    .chain(&filter.bias_b)
                    .chain(&filter.gyro_matrix);
                assert!(!p.iter().chain(state).any(is_denormal), "{motion:?} {step}");
            }
        }
        println!(
            "{motion:?}: scalars an hour {compared:?}, in {steps_that_compare:?} steps, |q| off by {norm_off:.1e}"
        );
        let within = |counts: &[u64; 10]| counts.iter().all(|count| count.abs_diff(counts[0]) * 10 <= counts[0]);
        assert!(compared[0] > 3 * HOUR as u64 / 10 && within(&compared) && within(&steps_that_compare));
        assert!(norm_off < 1e-6, "{motion:?}: {norm_off}");
    }
}
