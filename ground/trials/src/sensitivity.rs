//! How much of a disturbance calibration errors cannot imitate.
//!
//! In: twice two flights of the same parts with the same noise, one of them disturbed, each with its record and stated
//! environment. Out: the marginal signal to noise ratio, sqrt(d' (I + N L N')^-1 d) over standardised differences d of
//! "measured minus what the record says", where N holds for each channel a bias, a scale and two axis errors, and for each part,
//! which converts all of its channels at once, the instant of sampling, with the sigmas of the unit's description: the measure in
//! which the diagnosis' targets are stated.
//!
//! One d is of the first two flights and the other of the second two, which have another noise: below a count the difference
//! of two codes is mostly rounding, which the square would count and this product does not.
//!
//! What is random from sample to sample has no shape that could be matched, only a variance: of it the ratio is that of the
//! best test of a variance, sqrt(sum of E^2 / 2n) over stretches of n samples whose energy is E.

pub mod consequence;
pub mod withheld;

use std::collections::BTreeMap;

use emems::sample::Reading;
use nalgebra::{DMatrix, DVector, Vector3, Vector4};
use packets::channel::{self, CHANNELS, Quantity};
use twin::{environment::Environment, geometry};

use crate::{
    flight::{CYCLE_S, Instants},
    scene::Record,
    unit::{axis_b, kind},
};

/// \[s\] half the step with which the record is differentiated.
const STEP_S: f64 = 0.01;

/// A flight and what is said about it.
pub struct Told<'a> {
    /// Readings; the packet's counter is its time.
    pub readings: &'a [Reading],
    /// What the truth instrument wrote, against time since power-on.
    pub record: &'a Record,
    /// The stated environment.
    pub claimed: &'a Environment,
}

/// Errors that a channel has for itself.
const OWN: usize = 4;

/// Samples of a stretch in which a variance is taken as one: four seconds.
const STRETCH: usize = 20;

/// Of flights "disturbed, undisturbed", over packets whose time is below `until_s`; `random` if it is so from sample to sample.
pub fn marginal_snr(flights: [[&Told; 2]; 2], instants: &Instants, until_s: f64, random: bool) -> f64 {
    let mut parts: BTreeMap<(&str, usize), Vec<[Differences; 2]>> = BTreeMap::new();
    for (index, channel) in CHANNELS.iter().enumerate() {
        let [first, second] = flights.map(|flown| Differences::of(index, flown, instants, until_s));
        let part = (kind(channel.quantity).sensor, channel.plate);
        let own = first.zip(second).map(|(first, second)| [first, second]);
        parts.entry(part).or_default().extend(own);
    }
    let energy: f64 = match random {
        true => parts.values().flatten().map(in_variance).sum(),
        false => parts.values().map(|part| in_shape(part)).sum(),
    };
    energy.max(0.0).sqrt()
}

/// Of the channels of a part. With `M = I + N N'` of a channel's own errors and `t` what its instant does, a common instant of
/// sigma 1 takes off `(sum t'M^-1 d1) (sum t'M^-1 d2) / (1 + sum t'M^-1 t)`.
fn in_shape(part: &[[Differences; 2]]) -> f64 {
    let sums: Vector4<f64> = part.iter().map(products).sum();
    sums.x - sums.y * sums.z / (1.0 + sums.w)
}

/// `d1'M^-1 d2`, `t'M^-1 d1`, `t'M^-1 d2` and `t'M^-1 t` over the samples that both flights have.
fn products([first, second]: &[Differences; 2]) -> Vector4<f64> {
    let rows = both(first, second);
    let nuisance = DMatrix::from_fn(rows.len(), OWN, |row, column| first.nuisance[(rows[row].0, column)]);
    // Woodbury: (I + N N')^-1 = I - N (I + N'N)^-1 N'.
    let inner = (nuisance.tr_mul(&nuisance) + DMatrix::identity(OWN, OWN)).cholesky();
    let product = |one: &DVector<f64>, other: &DVector<f64>| {
        let [left, right] = [one, other].map(|column| nuisance.tr_mul(column));
        let imitated = inner.as_ref().map_or(0.0, |inner| left.dot(&inner.solve(&right)));
        one.dot(other) - imitated
    };
    let of = |values: &DVector<f64>, place: fn(&(usize, usize)) -> usize| {
        DVector::from_iterator(rows.len(), rows.iter().map(|row| values[place(row)]))
    };
    let (d1, d2) = (of(&first.difference, |row| row.0), of(&second.difference, |row| row.1));
    let t = of(&first.aged, |row| row.0);
    Vector4::new(product(&d1, &d2), product(&t, &d1), product(&t, &d2), product(&t, &t))
}

/// Of one channel. The square of a sum of squares of noise is too large; the product of those of every other sample with those
/// between them is not.
fn in_variance([first, second]: &[Differences; 2]) -> f64 {
    let rows = both(first, second);
    let squares: Vec<f64> = (rows.iter())
        .map(|(one, other)| first.difference[*one] * second.difference[*other])
        .collect();
    let of_stretch = |squares: &[f64]| {
        let every_other = |from: usize| squares.iter().skip(from).step_by(2).sum::<f64>();
        4.0 * every_other(0) * every_other(1) / (2.0 * squares.len() as f64)
    };
    squares.chunks(STRETCH).map(of_stretch).sum()
}

/// Places of the samples that both flights have.
fn both(first: &Differences, second: &Differences) -> Vec<(usize, usize)> {
    (first.rows.iter().enumerate())
        .filter_map(|(at, row)| Some((at, second.rows.binary_search(row).ok()?)))
        .collect()
}

/// Noise of a sample, that of its counts included.
fn sigma(quantity: Quantity) -> f64 {
    let (lsb, _) = quantity.scale();
    (kind(quantity).noise.powi(2) + lsb * lsb / 12.0).sqrt()
}

/// What a disturbance changes in a channel, in units of noise.
struct Differences {
    /// Packets it is of, ascending.
    rows: Vec<u16>,
    difference: DVector<f64>,
    /// What its own calibration errors may do, times their sigmas.
    nuisance: DMatrix<f64>,
    /// What the instant of its part may do.
    aged: DVector<f64>,
}

impl Differences {
    /// `None` for a channel without an axis.
    fn of(index: usize, [disturbed, undisturbed]: [&Told; 2], instants: &Instants, until_s: f64) -> Option<Self> {
        let channel = CHANNELS[index];
        let facts = kind(channel.quantity);
        let (lsb, _) = channel.quantity.scale();
        let sigma = sigma(channel.quantity);
        let axis_b = axis_b(channel)?;
        let aside = if axis_b.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let across = axis_b.cross(&aside).normalize();
        let code = |reading: &Reading| channel::counts(reading)[index].map(f64::from);
        let same_packet = |reading: &Reading| {
            let first = undisturbed.readings.first()?.counter;
            undisturbed
                .readings
                .get(usize::from(reading.counter.checked_sub(first)?))
        };
        let (mut rows, mut nuisances, mut differences, mut aged) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for reading in disturbed.readings {
            let time_s = CYCLE_S * f64::from(reading.counter);
            if time_s >= until_s {
                break;
            }
            let Some((code, quiet)) = code(reading).zip(same_packet(reading).and_then(code)) else {
                continue;
            };
            let at_s = instants.zero_s + time_s + instants.slots_s[index];
            let [felt, told] = [undisturbed, disturbed].map(|told| felt(told, channel, at_s));
            differences.push(((code - quiet) * lsb - axis_b.dot(&(told - felt))) / sigma);
            let [earlier, later] = [-STEP_S, STEP_S].map(|step_s| self::felt(undisturbed, channel, at_s + step_s));
            aged.push(facts.instant_sigma_s * axis_b.dot(&(later - earlier)) / (2.0 * STEP_S) / sigma);
            rows.push(reading.counter);
            nuisances.push(
                Vector4::new(
                    facts.bias,
                    facts.scale * axis_b.dot(&felt),
                    facts.axis_rad * across.dot(&felt),
                    facts.axis_rad * axis_b.cross(&across).dot(&felt),
                ) / sigma,
            );
        }
        Some(Differences {
            nuisance: DMatrix::from_fn(rows.len(), OWN, |row, column| nuisances[row][column]),
            rows,
            difference: DVector::from_vec(differences),
            aged: DVector::from_vec(aged),
        })
    }
}

/// What an ideal part of this channel's kind would feel at its place, in b, if record and environment are right.
fn felt(told: &Told, channel: channel::Channel, t_s: f64) -> Vector3<f64> {
    let [before, now, after] = [t_s - STEP_S, t_s, t_s + STEP_S].map(|t| (told.record)(t));
    let to_b = now.0.inverse();
    let rate = |from: &nalgebra::UnitQuaternion<f64>, to: &nalgebra::UnitQuaternion<f64>| {
        (from.inverse() * to).scaled_axis() / STEP_S
    };
    match channel.quantity {
        Quantity::Field => to_b * told.claimed.field_n_ut,
        Quantity::Rate => 0.5 * (rate(&before.0, &now.0) + rate(&now.0, &after.0)) + to_b * told.claimed.earth_rate_n(),
        _ => {
            let (early, late) = (rate(&before.0, &now.0), rate(&now.0, &after.0));
            let (rate_b, rate_dot_b) = (0.5 * (early + late), (late - early) / STEP_S);
            let acc_n = (after.1 - 2.0 * now.1 + before.1) / (STEP_S * STEP_S);
            let place_b = geometry::accelerometer_place_b(channel.plate);
            to_b * (acc_n - told.claimed.gravity_n())
                + rate_dot_b.cross(&place_b)
                + rate_b.cross(&rate_b.cross(&place_b))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::UnitQuaternion;
    use twin::plant::{Plant, Quality};

    use super::*;
    use crate::{
        draw::Draw,
        flight::{fly, instants},
        motion::{Style, Wander},
        scene::Scene,
    };

    fn told<'a>(readings: &'a [Reading], record: &'a Record, claimed: &'a Environment) -> Told<'a> {
        Told {
            readings,
            record,
            claimed,
        }
    }

    #[test]
    fn a_bias_within_the_calibration_is_imitated_and_a_step_is_not() {
        let instants = instants(1).expect("derived frames");
        let still: Record = Arc::new(|_| (UnitQuaternion::identity(), Vector3::zeros()));
        let site = Environment::laboratory();
        let reading = |counter: u16, code| {
            let mut reading = Reading::unread(counter);
            reading.gyro = [code, 0, 0, 0];
            reading
        };
        let quiet: Vec<Reading> = (0..400).map(|counter| reading(counter, 0)).collect();
        let biased: Vec<Reading> = (0..400).map(|counter| reading(counter, 1)).collect();
        let stepped: Vec<Reading> = (0..400)
            .map(|counter| reading(counter, i16::from(counter >= 200)))
            .collect();
        let snr = |readings: &[Reading]| {
            let (disturbed, quiet) = (told(readings, &still, &site), told(&quiet, &still, &site));
            marginal_snr([[&disturbed, &quiet]; 2], &instants, 80.0, false)
        };
        // One count is 0.85 of a calibration's sigma and 0.37 of the noise's: over 400 packets 7.4 sigmas in all.
        assert!(snr(&biased) < 1.0, "{}", snr(&biased));
        // Half of the packets, minus their mean: 0.37 sqrt(400) / 2.
        assert!((snr(&stepped) - 3.7).abs() < 0.3, "{}", snr(&stepped));
    }

    #[test]
    fn a_part_is_late_as_a_whole() {
        let mut random = Draw::new(3);
        let mut column = |size: f64| DVector::from_fn(500, |_, _| size * random.normal());
        let aged: Vec<DVector<f64>> = (0..3).map(|_| column(0.5)).collect();
        let late = |signs: [f64; 3]| {
            let channel = |(aged, sign): (&DVector<f64>, f64)| {
                [(); 2].map(|()| Differences {
                    rows: (0..aged.len() as u16).collect(),
                    difference: aged * (sign * 2.0),
                    nuisance: DMatrix::zeros(aged.len(), OWN),
                    aged: aged.clone(),
                })
            };
            let part: Vec<[Differences; 2]> = aged.iter().zip(signs).map(channel).collect();
            in_shape(&part)
        };
        // Two sigmas late are a surprise of four; axes that are late by different times are no lateness of the part: of an energy
        // of 1500 in all a ninth is along a common one.
        assert!((late([1.0; 3]) - 4.0).abs() < 0.1, "{}", late([1.0; 3]));
        assert!(late([1.0, -1.0, 1.0]) > 1200.0, "{}", late([1.0, -1.0, 1.0]));
    }

    #[test]
    fn a_record_that_is_wrong_counts_like_a_unit_that_is() {
        let instants = instants(1).expect("derived frames");
        let site = Environment::laboratory();
        let still: Record = Arc::new(|_| (UnitQuaternion::identity(), Vector3::zeros()));
        let tilted: Record = Arc::new(|t| {
            (
                UnitQuaternion::from_euler_angles(0.01 * (0.3 * t).sin(), 0.0, 0.0),
                Vector3::zeros(),
            )
        });
        let readings: Vec<Reading> = (0..400)
            .map(|counter| {
                let mut reading = Reading::unread(counter);
                reading.acc_p = [[0; 3]; 4];
                reading
            })
            .collect();
        let (wrong, right) = (told(&readings, &tilted, &site), told(&readings, &still, &site));
        let snr = marginal_snr([[&wrong, &right]; 2], &instants, 80.0, false);
        // Four plates feel 9.8 m/s2 * 0.01 rad * sin in all: rms 0.069 over 0.0458 noise, 400 packets, four plates.
        assert!((snr - 60.0).abs() < 6.0, "{snr}");
    }

    #[test]
    fn louder_noise_is_as_plain_as_the_best_test_of_a_variance_finds_it() {
        // A variance of 0.3 beside one, 15,000 samples: the energy of all of them lies 4,500 above the 15,000 it should be,
        // give or take sqrt(30,000).
        let mut random = Draw::new(5);
        let difference = DVector::from_fn(15_000, |_, _| 0.3f64.sqrt() * random.normal());
        let snr = |difference: DVector<f64>| {
            let nuisance = DMatrix::zeros(difference.len(), OWN);
            let aged = DVector::zeros(difference.len());
            let differences = [(); 2].map(|()| Differences {
                rows: (0..difference.len() as u16).collect(),
                difference: difference.clone(),
                nuisance: nuisance.clone(),
                aged: aged.clone(),
            });
            in_variance(&differences).sqrt()
        };
        assert!((snr(difference.clone()) - 4500.0 / 30_000f64.sqrt()).abs() < 1.0);
        // All of it in a tenth of the time is plainer by the root of ten.
        let bursts = DVector::from_fn(15_000, |row, _| {
            if row % 200 < 20 {
                10f64.sqrt() * difference[row]
            } else {
                0.0
            }
        });
        assert!((snr(bursts) / snr(difference) - 10f64.sqrt()).abs() < 0.5);
    }

    #[test]
    fn a_delay_within_the_clock_of_a_part_is_no_disturbance() {
        const LONG_S: f64 = 60.0;
        let instants = instants(3).expect("derived frames");
        let flown = |delay_s: f64, flight: u64| {
            let wander = Wander::draw(Style::Hand, true, LONG_S + 2.0, &mut Draw::new(11));
            let mut scene = Scene::new(wander, Environment::laboratory(), &mut Draw::new(12));
            for view in &mut scene.views.field_p_ut {
                let prompt = view.clone();
                *view = Arc::new(move |t_s| prompt(t_s - delay_s));
            }
            let quality = Quality {
                flight,
                ..Quality::NOMINAL
            };
            let plant = Plant::seeing(&scene.views, scene.source.clone(), 3, quality);
            (fly(plant, LONG_S + 1.0), scene)
        };
        let flights = [0, 1].map(|flight| [0.002, 0.0].map(|delay_s| flown(delay_s, flight)));
        let snr = |second: usize| {
            let told = |flight: usize| {
                [0, 1].map(|which| {
                    let (readings, scene) = &flights[flight][which];
                    told(readings, &scene.record, &scene.claimed)
                })
            };
            let told = [told(0), told(second)];
            marginal_snr(told.each_ref().map(|told| told.each_ref()), &instants, LONG_S, false)
        };
        // Half of a sigma of each of four clocks. Squared, the rounding of codes is most of it.
        assert!(snr(1) < 2.5, "{}", snr(1));
        assert!(snr(0) > 5.0, "{}", snr(0));
    }
}
