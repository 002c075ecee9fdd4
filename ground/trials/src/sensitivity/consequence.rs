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

use super::{Differences, Told, both, in_shape};
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
    // Sums of S'd of both flights and how many packets, by stretch; a packet that lacks a channel is in none.
    let mut packets: BTreeMap<u16, ([Vector3<f64>; 2], usize)> = BTreeMap::new();
    for (index, [first, second]) in channels {
        let quantity = CHANNELS[*index].quantity;
        let (noise, lsb) = (kind(quantity).noise, quantity.scale().0);
        let sigma = (noise * noise + lsb * lsb / 12.0).sqrt();
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

    /// All accelerometers of a unit that stands still read `counts` more along x of b every other ten seconds, for 80 s.
    fn leaning(counts: f64) -> Consequence {
        let instants = instants(1).expect("derived frames");
        let still: Record = Arc::new(|_| (UnitQuaternion::identity(), Vector3::zeros()));
        let site = Environment::laboratory();
        let reading = |counter: u16, size: f64| {
            let mut reading = Reading::unread(counter);
            for (plate, axes) in reading.acc_p.iter_mut().enumerate() {
                let of_axis = twin::geometry::dcm_bp(plate).transpose() * Vector3::new(size, 0.0, 0.0);
                (axes.iter_mut().zip(of_axis.iter())).for_each(|(code, part)| *code = 16 * (part.round() as i16));
            }
            reading
        };
        let flown = |size: f64| -> Vec<Reading> {
            let is_on = |counter: u16| (counter / 50) % 2 == 1;
            (0..400)
                .map(|counter| reading(counter, if is_on(counter) { size } else { 0.0 }))
                .collect()
        };
        let (struck, quiet) = (flown(counts), flown(0.0));
        let told = |readings| Told {
            readings,
            record: &still,
            claimed: &site,
        };
        let (struck, quiet) = (told(&struck), told(&quiet));
        consequence([[&struck, &quiet]; 2], &instants, 80.0, false)
    }

    #[test]
    fn what_all_accelerometers_have_in_common_for_seconds_turns_the_attitude_and_opens_the_gap() {
        let lsb = Quantity::SpecificForce.scale().0;
        let own = leaning(20.0);
        // Half of the time, one axis of three.
        let turned = (20.0 * 16.0 * lsb / 9.8 / 6f64.sqrt()).to_degrees();
        assert!((own.attitude_deg / turned - 1.0).abs() < 0.1, "{own:?} {turned}");
        assert!(own.growth > 1.0, "{own:?}");
        assert_eq!(leaning(0.0), Consequence::default());
    }
}
