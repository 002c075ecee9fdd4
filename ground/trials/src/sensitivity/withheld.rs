//! How much of a disturbance is left to see where nobody knows the motion.
//!
//! In: the flights of [`super::marginal_snr`], of which the dealer knows the motion. Out: [`Ratios`]: the same measure with the motion free as
//! well. Each sample has a row `a` of what an unknown motion changes in it, and a difference `d`; with `C` what calibration, instants and the
//! exact nulls may do, for a prior sigma each, and the motion's normal matrix `N = A'A + P`:
//!
//! ```text
//! <u, v> = u'v - (A'u)' N^-1 (A'v),      ratio^2 = <d1, d2> - <d1, C> (I + <C, C>)^-1 <C, d2>
//! ```
//!
//! Twice, with two motions:
//! - by parity: in each packet alone rate, force and field are free, and the derivatives of rate and force within what the true motion's change
//!   from packet to packet;
//! - as one course: a turn and an acceleration are cubic B-splines with a knot a packet, which resolves every motion of the trials (none has a
//!   tone above 0.5 Hz; a rocket's boost has, and gets no such ratio). The field is known in n, gravity too, and the acceleration is none within its
//!   own root mean square. How fast the motion changes is not known beforehand.
//!
//! Exact nulls are of the physics of a body: what all sensors of a kind share as a bias, a scale, a rotation or a delay, and a common lever arm.

mod motion;

use nalgebra::{DMatrix, SVector, Vector3};
use packets::channel::{CHANNELS, Channel, Quantity};
use twin::geometry;

use self::motion::{by_course, by_packet, cross};
use super::{Differences, OWN, STEP_S, Told, both};
use crate::{
    flight::{CYCLE_S, Instants},
    unit::{axis_b, kind},
};

/// Ratios without a motion that is known.
#[derive(Clone, Copy, Debug)]
pub struct Ratios {
    /// Each packet by itself.
    pub parity: f64,
    /// As one course; none of a motion that the knots do not resolve.
    pub course: Option<f64>,
}

/// Columns: two differences, own errors of 28 channels, instants of 12 parts, nulls.
const CHANNELS_WITH_AXIS: usize = 28;
const PARTS: usize = 12;
const NULLS: usize = 27;
const INSTANTS: usize = 2 + OWN * CHANNELS_WITH_AXIS;
const COLUMNS: usize = INSTANTS + PARTS + NULLS;

/// What a null may be: bias, scale, angle, delay, lever arm; so large that none of it is held.
const FREE_RATE: f64 = 0.05;
const FREE_FORCE: f64 = 1.0;
const FREE_FIELD_UT: f64 = 5.0;
const FREE_SCALE: f64 = 0.2;
const FREE_RAD: f64 = 0.2;
const FREE_S: f64 = 0.2;
const FREE_M: f64 = 0.3;

/// The motion at an instant, in b.
#[derive(Clone, Copy)]
struct Felt {
    rate: Vector3<f64>,
    rate_dot: Vector3<f64>,
    /// Specific force at the centre.
    force: Vector3<f64>,
    force_dot: Vector3<f64>,
    field: Vector3<f64>,
    acceleration: Vector3<f64>,
}

impl Felt {
    fn of(told: &Told, t_s: f64) -> Self {
        let [before, now, after] = [t_s - STEP_S, t_s, t_s + STEP_S].map(|t| (told.record)(t));
        let to_b = now.0.inverse();
        let turn = |from: &nalgebra::UnitQuaternion<f64>, to: &nalgebra::UnitQuaternion<f64>| {
            (from.inverse() * to).scaled_axis() / STEP_S
        };
        let (early, late) = (turn(&before.0, &now.0), turn(&now.0, &after.0));
        let acc_n = (after.1 - 2.0 * now.1 + before.1) / (STEP_S * STEP_S);
        let [earlier, later] = [-STEP_S, STEP_S].map(|step_s| force(told, t_s + step_s));
        Self {
            rate: 0.5 * (early + late) + to_b * told.claimed.earth_rate_n(),
            rate_dot: (late - early) / STEP_S,
            force: to_b * (acc_n - told.claimed.gravity_n()),
            force_dot: (later - earlier) / (2.0 * STEP_S),
            field: to_b * told.claimed.field_n_ut,
            acceleration: to_b * acc_n,
        }
    }
}

/// Specific force at the centre, in b.
fn force(told: &Told, t_s: f64) -> Vector3<f64> {
    let [before, now, after] = [t_s - STEP_S, t_s, t_s + STEP_S].map(|t| (told.record)(t));
    let acc_n = (after.1 - 2.0 * now.1 + before.1) / (STEP_S * STEP_S);
    now.0.inverse() * (acc_n - told.claimed.gravity_n())
}

/// A sample of two pairs of flights.
struct Sample {
    quantity: Quantity,
    axis: Vector3<f64>,
    lever: Vector3<f64>,
    sigma: f64,
    /// \[s\] after the packet's time.
    slot_s: f64,
    felt: Felt,
    /// Nonzero columns.
    columns: Vec<(usize, f64)>,
}

/// Ratios of flights as [`super::marginal_snr`] takes them; `is_resolved` if knots resolve the motion.
pub fn ratios(flights: [[&Told; 2]; 2], instants: &Instants, until_s: f64, is_resolved: bool) -> Ratios {
    let packets = (until_s / CYCLE_S).ceil() as usize;
    let samples = samples(flights, instants, until_s, packets);
    let mut plain = DMatrix::zeros(COLUMNS, COLUMNS);
    for sample in samples.iter().flatten() {
        for (row, one) in &sample.columns {
            for (column, other) in &sample.columns {
                plain[(*row, *column)] += one * other;
            }
        }
    }
    Ratios {
        parity: left(plain.clone() - by_packet(&samples)),
        course: is_resolved.then(|| left(plain - by_course(&samples))),
    }
}

/// The ratio, of products past a motion.
fn left(products: DMatrix<f64>) -> f64 {
    let open = COLUMNS - 2;
    let inner = DMatrix::identity(open, open) + products.view((2, 2), (open, open));
    let [one, other] = [0, 1].map(|at| products.view((2, at), (open, 1)).column(0).into_owned());
    let imitated = inner.cholesky().map_or(0.0, |inner| one.dot(&inner.solve(&other)));
    (products[(0, 1)] - imitated).max(0.0).sqrt()
}

fn samples(flights: [[&Told; 2]; 2], instants: &Instants, until_s: f64, packets: usize) -> Vec<Vec<Sample>> {
    let mut samples: Vec<Vec<Sample>> = (0..packets).map(|_| Vec::new()).collect();
    let undisturbed = flights[0][1];
    let mut own_of = 0;
    for (index, channel) in CHANNELS.iter().enumerate() {
        let [first, second] = flights.map(|flown| Differences::of(index, flown, instants, until_s));
        let (Some(first), Some(second), Some(axis)) = (first, second, axis_b(*channel)) else {
            continue;
        };
        let facts = kind(channel.quantity);
        let (lsb, _) = channel.quantity.scale();
        let sigma = (facts.noise * facts.noise + lsb * lsb / 12.0).sqrt();
        for (row, other) in both(&first, &second) {
            let packet = usize::from(first.rows[row]);
            let slot_s = instants.slots_s[index];
            let felt = Felt::of(undisturbed, instants.zero_s + CYCLE_S * packet as f64 + slot_s);
            let mut columns = vec![(0, first.difference[row]), (1, second.difference[other])];
            columns.extend((0..OWN).map(|own| (2 + OWN * own_of + own, first.nuisance[(row, own)])));
            columns.push((INSTANTS + part(*channel), first.aged[row]));
            let mut sample = Sample {
                quantity: channel.quantity,
                axis,
                lever: lever(*channel),
                sigma,
                slot_s,
                felt,
                columns,
            };
            let nulls = nulls(&sample);
            sample
                .columns
                .extend((0..NULLS).map(|at| (INSTANTS + PARTS + at, nulls[at])));
            if let Some(own) = samples.get_mut(packet) {
                own.push(sample);
            }
        }
        own_of += 1;
    }
    samples
}

fn lever(channel: Channel) -> Vector3<f64> {
    match channel.quantity {
        Quantity::SpecificForce => geometry::accelerometer_place_b(channel.plate),
        _ => Vector3::zeros(),
    }
}

fn part(channel: Channel) -> usize {
    let kind = match channel.quantity {
        Quantity::SpecificForce => 0,
        Quantity::Field => 1,
        _ => 2,
    };
    4 * kind + channel.plate
}

/// What each null does to a sample, for what it may be.
fn nulls(sample: &Sample) -> SVector<f64, NULLS> {
    let Felt {
        rate,
        rate_dot,
        force,
        force_dot,
        field,
        ..
    } = sample.felt;
    let (axis, arm) = (sample.axis, sample.lever);
    let mut nulls = SVector::<f64, NULLS>::zeros();
    let mut put = |from: usize, values: [f64; 8]| (0..8).for_each(|at| nulls[from + at] = values[at]);
    let of = |bias: f64, value: Vector3<f64>, slope: Vector3<f64>| {
        let turned = axis.cross(&value) * FREE_RAD;
        [
            bias * axis.x,
            bias * axis.y,
            bias * axis.z,
            FREE_SCALE * axis.dot(&value),
            turned.x,
            turned.y,
            turned.z,
            FREE_S * axis.dot(&slope),
        ]
    };
    match sample.quantity {
        Quantity::SpecificForce => {
            let own = force + rate_dot.cross(&arm) + rate.cross(&rate.cross(&arm));
            put(0, of(FREE_FORCE, own, force_dot));
        }
        Quantity::Field => put(8, of(FREE_FIELD_UT, field, -rate.cross(&field))),
        _ => put(16, of(FREE_RATE, rate, rate_dot)),
    }
    if sample.quantity == Quantity::SpecificForce {
        let arms = cross(&axis, |e| rate_dot.cross(&e) + rate.cross(&rate.cross(&e))) * FREE_M;
        (0..3).for_each(|at| nulls[24 + at] = arms[at]);
    }
    nulls / sample.sigma
}

#[cfg(test)]
mod tests {

    use twin::{
        environment::Environment,
        plant::{Plant, Quality},
    };

    use super::*;
    use crate::{
        draw::Draw,
        flight::{self, fly},
        motion::{Style, Wander},
        scene::{Scene, changed, shifted},
        sensitivity::marginal_snr,
    };

    /// \[s\] of a flight.
    const LONG_S: f64 = 60.0;

    /// With the motion known, by parity, as one course: of what this does to a scene.
    fn seen(disturb: &dyn Fn(&mut Scene)) -> [f64; 3] {
        let instants = flight::instants(3).expect("derived frames");
        let flown = |is_disturbed: bool, flight: u64| {
            let wander = Wander::draw(Style::Hand, true, LONG_S + 2.0, &mut Draw::new(11));
            let mut scene = Scene::new(wander, Environment::laboratory(), &mut Draw::new(12));
            if is_disturbed {
                disturb(&mut scene);
            }
            let quality = Quality {
                flight,
                ..Quality::NOMINAL
            };
            let plant = Plant::seeing(&scene.views, scene.source.clone(), 3, quality);
            (fly(plant, LONG_S + 1.0), scene)
        };
        let flights = [0, 1].map(|flight| [true, false].map(|is_disturbed| flown(is_disturbed, flight)));
        let told = flights.each_ref().map(|pair| {
            pair.each_ref().map(|(readings, scene)| Told {
                readings,
                record: &scene.record,
                claimed: &scene.claimed,
            })
        });
        let told = told.each_ref().map(|pair| pair.each_ref());
        let Ratios { parity, course } = ratios(told, &instants, LONG_S, true);
        let course = course.expect("asked for");
        [marginal_snr(told, &instants, LONG_S, false), parity, course]
    }

    #[test]
    fn a_delay_of_all_sensors_is_another_motion() {
        let [known, parity, course] = seen(&|scene| {
            let late = |t_s: f64| t_s - 0.02;
            for plate in 0..4 {
                scene.views.force_p[plate] = shifted(&scene.views.force_p[plate], late);
                scene.views.field_p_ut[plate] = shifted(&scene.views.field_p_ut[plate], late);
                scene.views.rate[plate] = shifted(&scene.views.rate[plate], late);
            }
        });
        assert!(
            known > 30.0 && parity < 0.05 * known && course < 0.05 * known,
            "{known} {parity} {course}"
        );
    }

    #[test]
    fn iron_of_one_plate_is_seen_by_the_others_and_that_of_all_by_nobody() {
        let iron = |plates: std::ops::Range<usize>| {
            move |scene: &mut Scene| {
                for plate in plates.clone() {
                    let own_p = geometry::dcm_bp(plate).transpose() * Vector3::new(2.0, -1.0, 0.5);
                    scene.views.field_p_ut[plate] =
                        changed(&scene.views.field_p_ut[plate], move |_, field_p| field_p + own_p);
                }
            }
        };
        let [known, parity, course] = seen(&iron(0..1));
        // Three quarters of its energy are left by three others that are as good: a root of 0.87.
        assert!(
            (parity / known - 0.87).abs() < 0.05 && course >= 0.99 * parity,
            "{known} {parity} {course}"
        );
        let [known, parity, course] = seen(&iron(0..4));
        assert!(
            parity < 0.05 * known && course < 0.2 * known,
            "{known} {parity} {course}"
        );
    }

    #[test]
    fn a_scale_of_all_fields_that_comes_and_goes_is_seen_along_the_course_alone() {
        let [known, parity, course] = seen(&|scene| {
            let swing = |t_s: f64| 1.0 + 0.02 * (0.3 * t_s).sin();
            for view in &mut scene.views.field_p_ut {
                *view = changed(view, move |t_s, field_p| field_p * swing(t_s));
            }
        });
        assert!(
            known > 8.0 && parity < 0.1 * known && course > 0.5 * known,
            "{known} {parity} {course}"
        );
    }
}
