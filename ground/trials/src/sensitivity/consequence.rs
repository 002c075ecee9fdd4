//! How much a disturbance of a simulated unit matters, in the two measures of what a case cares about.
//!
//! In: the flights of [`super::marginal_snr`], disturbed and not. Out: [`Consequence`].
//!
//! - Attitude \[deg\]: of each kind the vector `v = (S'S)^-1 S'd` that its channels with axes `S` have in common, averaged over two
//!   seconds; a slow force over gravity, a slow field over its horizontal part, a slow rate over ten seconds of a filter. The kind that
//!   moves it most counts, root mean square of an axis.
//! - Growth of the gap: of the part that shows it most `sqrt(1 + E/n) - 1`, with `E` what is left of its `n` samples in squares of noise
//!   once the calibration is fitted: a healthy unit's gap is one.
//!
//! Products are of two flights with another noise, as in [`super`], for rounding is most of a difference below a count. Ring R7 measures
//! the same of a recording ([`crate::injected`]).

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use packets::channel::{CHANNELS, Quantity};

use super::{Differences, Told, both, in_shape, sigma};
use crate::{
    flight::Instants,
    unit::{axis_b, kind},
};

/// Packets that are one slow value: two seconds.
const SLOW: usize = 10;

/// \[s\] over which a filter believes a gyro.
pub const FILTER_S: f64 = 10.0;

/// How much a disturbance matters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Consequence {
    /// \[deg\] what it does to an attitude.
    pub attitude_deg: f64,
    /// By which the gap of the part that shows it most grows, of what it was.
    pub growth: f64,
}

/// Of flights "disturbed, undisturbed", over packets whose time is below `until_s`; `random` if it is so from sample to sample.
pub fn consequence(flights: [[&Told; 2]; 2], instants: &Instants, until_s: f64, random: bool) -> Consequence {
    let both_flights = |index: usize| {
        let [first, second] = flights.map(|flown| Differences::of(index, flown, instants, until_s));
        Some([first?, second?])
    };
    let channels: Vec<(usize, [Differences; 2])> = (0..CHANNELS.len())
        .filter_map(|index| Some((index, both_flights(index)?)))
        .collect();
    let claimed = flights[0][1].claimed;
    let attitude = |quantity: Quantity| {
        let own = channels
            .iter()
            .filter(|(index, _)| CHANNELS[*index].quantity == quantity);
        let slow = slow(&own.collect::<Vec<_>>());
        match quantity {
            Quantity::Rate => slow * FILTER_S,
            Quantity::SpecificForce => slow / claimed.gravity,
            _ => slow / claimed.field_n_ut.xy().norm().max(1.0),
        }
    };
    let kinds = [Quantity::SpecificForce, Quantity::Field, Quantity::Rate];
    let attitude_deg = kinds.into_iter().map(attitude).fold(0.0, f64::max).to_degrees();
    let mut parts: BTreeMap<(&str, usize), Vec<[Differences; 2]>> = BTreeMap::new();
    for (index, own) in channels {
        let channel = CHANNELS[index];
        let part = (kind(channel.quantity).sensor, channel.plate);
        parts.entry(part).or_default().push(own);
    }
    let growth = |part: &Vec<[Differences; 2]>| {
        let samples: usize = part.iter().map(|[first, second]| both(first, second).len()).sum();
        let energy = match random {
            true => part.iter().map(products).sum(),
            false => in_shape(part),
        };
        (1.0 + energy.max(0.0) / samples.max(1) as f64).sqrt() - 1.0
    };
    Consequence {
        attitude_deg,
        growth: parts.values().map(growth).fold(0.0, f64::max),
    }
}

/// `d1'd2` over the samples that both flights have.
fn products([first, second]: &[Differences; 2]) -> f64 {
    let rows = both(first, second).into_iter();
    rows.map(|(one, other)| first.difference[one] * second.difference[other])
        .sum()
}

/// Root mean square of an axis of the vector that channels of a kind have in common, in means over [`SLOW`] packets, in its unit.
fn slow(channels: &[&(usize, [Differences; 2])]) -> f64 {
    let axis = |index: usize| axis_b(CHANNELS[index]).unwrap_or_else(Vector3::zeros);
    let square: Matrix3<f64> = channels
        .iter()
        .map(|(index, _)| axis(*index) * axis(*index).transpose())
        .sum();
    let Some(inverse) = square.try_inverse() else {
        return 0.0;
    };
    // By packet: S'd of both flights, and how many channels are in it. One that lacks a channel is left out.
    let mut packets: BTreeMap<u16, ([Vector3<f64>; 2], usize)> = BTreeMap::new();
    for (index, [first, second]) in channels {
        let sigma = sigma(CHANNELS[*index].quantity);
        for (one, other) in both(first, second) {
            let (sums, count) = packets.entry(first.rows[one]).or_default();
            sums[0] += axis(*index) * (sigma * first.difference[one]);
            sums[1] += axis(*index) * (sigma * second.difference[other]);
            *count += 1;
        }
    }
    let whole: Vec<[Vector3<f64>; 2]> = (packets.into_values())
        .filter(|(_, count)| *count == channels.len())
        .map(|(sums, _)| sums.map(|sum| inverse * sum))
        .collect();
    let product = |stretch: &[[Vector3<f64>; 2]]| {
        let [one, other] = [0, 1].map(|flight| stretch.iter().map(|both| both[flight]).sum::<Vector3<f64>>());
        one.dot(&other) / (3 * stretch.len() * stretch.len()) as f64
    };
    let stretches = whole.chunks(SLOW);
    let count = stretches.len().max(1) as f64;
    (stretches.map(product).sum::<f64>() / count).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use emems::sample::Reading;
    use nalgebra::UnitQuaternion;
    use twin::environment::Environment;

    use super::*;
    use crate::{flight::instants, scene::Record};

    /// Of a unit that stands still for 80 s and reads this every other ten seconds, and zeros between.
    fn of(read: impl Fn(&mut Reading), random: bool) -> Consequence {
        let instants = instants(1).expect("derived frames");
        let still: Record = Arc::new(|_| (UnitQuaternion::identity(), Vector3::zeros()));
        let site = Environment::laboratory();
        let flown = |is_struck: bool| -> Vec<Reading> {
            let reading = |counter: u16| {
                let mut reading = Reading::unread(counter);
                (reading.acc_p, reading.gyro) = ([[0; 3]; 4], [0; 4]);
                if is_struck && (counter / 50) % 2 == 1 {
                    read(&mut reading);
                }
                reading
            };
            (0..400).map(reading).collect()
        };
        let (struck, quiet) = (flown(true), flown(false));
        let told = |readings| Told {
            readings,
            record: &still,
            claimed: &site,
        };
        let (struck, quiet) = (told(&struck), told(&quiet));
        consequence([[&struck, &quiet]; 2], &instants, 80.0, random)
    }

    #[test]
    fn what_all_accelerometers_have_in_common_for_seconds_turns_the_attitude_and_opens_the_gap() {
        let counts = 320.0;
        let leaning = |reading: &mut Reading| {
            for (plate, axes) in reading.acc_p.iter_mut().enumerate() {
                let of_axis = twin::geometry::dcm_bp(plate).transpose() * Vector3::new(counts, 0.0, 0.0);
                (axes.iter_mut().zip(of_axis.iter())).for_each(|(code, part)| *code = part.round() as i16);
            }
        };
        let own = of(leaning, false);
        // Half of the time, one axis of three.
        let turned = (counts * Quantity::SpecificForce.scale().0 / 9.8 / 6f64.sqrt()).to_degrees();
        assert!((own.attitude_deg / turned - 1.0).abs() < 0.1, "{own:?} {turned}");
        assert!(own.growth > 1.0, "{own:?}");
        assert_eq!(of(|_| (), false), Consequence::default());
    }

    /// One of four gyros is a part, and its rate counts for ten seconds. As a shape its zero takes up what it may of it; as scatter nothing does.
    #[test]
    fn a_gyro_turns_the_attitude_by_what_it_weighs_among_the_others() {
        let counts = 10.0;
        let [shape, scatter] = [false, true].map(|random| of(|reading| reading.gyro[0] = counts as i16, random));
        let rate = counts * Quantity::Rate.scale().0;
        let axes: [Vector3<f64>; 4] = std::array::from_fn(twin::geometry::gyro_axis_b);
        let square: Matrix3<f64> = axes.iter().map(|axis| axis * axis.transpose()).sum();
        let weight = (square.try_inverse().expect("four axes") * axes[0]).norm();
        let turned = (rate * weight * FILTER_S / 6f64.sqrt()).to_degrees();
        assert!((shape.attitude_deg / turned - 1.0).abs() < 1e-6, "{shape:?} {turned}");
        let louder = (1.0 + 0.5 * (rate / sigma(Quantity::Rate)).powi(2)).sqrt() - 1.0;
        assert!((scatter.growth / louder - 1.0).abs() < 1e-6, "{scatter:?} {louder}");
        assert!(shape.growth < 0.9 * scatter.growth, "{shape:?} {scatter:?}");
    }
}
