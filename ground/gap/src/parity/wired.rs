//! Sensors that look elsewhere than described: plates that are exchanged, axes in another order.
//!
//! In: a [`Flight`], and what its codes say. Out: a [`Finding`] with where its channels look, if with that nothing is left.
//!
//! Such an effect is there or not, and where it is, half of what a motion is made of is wrong: nothing is linear about that motion, and
//! neither evidence nor ratio about it says anything. So the motion is made anew with it, and what is left decides: more than noise
//! and calibration as described, no more than those with it ([`PARITY_GAP`]), in the fit windows and in the held-out ones.
//!
//! Hundreds of orders and pairs are possible; which is tried, the readings tell without a motion. With `A` the axes of the channels of a
//! kind over their noise and `M = sum y y'` of what they read in each packet, over their noise, no vector explains
//!
//! ```text
//! tr M - tr Q' M Q,   A = Q R
//! ```
//!
//! of it. The one that leaves least is tried, if it leaves less than the axes as described. All signs of a kind reversed leave as
//! much: those are told apart by force and field, whose product is that of gravity and field in n.

use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};
use twin::{
    effect::{Active, Cause, LIBRARY, Nature, Site},
    environment::Environment,
    predict::{Chain, Kind, UnitDescription},
};

use crate::{
    input::{case::CaseError, log::Log},
    parity::{
        codes::{Finding, Look},
        flight::Flight,
        followed::{Beforehand, Followed},
        space::gap,
        taken_out::taken_out,
    },
    thresholds::PARITY_GAP,
};

/// Part of what is left by which two that do the same differ: numbers are rounded.
const SAME: f64 = 1e-9;

/// Kinds with axes.
const KINDS: [Kind; 3] = [Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer];

/// What is found beside what codes say.
///
/// # Errors
/// When the unit's description names an effect there is not.
pub fn look(flight: &Flight, coded: &[Finding], withheld: &[String]) -> Result<Option<Finding>, CaseError> {
    let (mut log, mut unit) = (flight.log.clone(), flight.unit.clone());
    taken_out(&mut log, &mut unit, coded);
    let read = KINDS.map(|kind| Read::of(&log, &unit, kind));
    let Some((cause, looks)) = likeliest(&unit, &flight.environment, &log, &read, withheld) else {
        return Ok(None);
    };
    let finding = |what: String| Finding {
        effect: cause.effect.page().name,
        channels: looks.iter().map(|own| own.channel).collect(),
        what,
        step: None,
        looks: looks.clone(),
        losses: Vec::new(),
    };
    let with: Vec<Finding> = coded.iter().cloned().chain([finding(String::new())]).collect();
    let left = |log: &Log, found: &[Finding]| -> Result<f64, CaseError> {
        let followed = Followed::of(flight, log, &Beforehand::found(found));
        Ok(gap(&followed.kept_by_packets()?))
    };
    let before = left(&flight.log, coded)?;
    let after = left(&flight.log, &with)?;
    let held = match &flight.held {
        Some(log) => left(log, &with)?,
        None => after,
    };
    let told = cause.effect.told(cause.variant).unwrap_or_default();
    Ok((before > PARITY_GAP && after.max(held) <= PARITY_GAP)
        .then(|| finding(format!("{told}; with it {after:.2} sigma are left of {before:.2}"))))
}

/// What the channels of a kind read.
struct Read {
    channels: Vec<usize>,
    sigmas: DVector<f64>,
    /// Rows of the packets that have all of them.
    rows: Vec<usize>,
    /// A column for each of these, over their noise.
    values: DMatrix<f64>,
    moments: DMatrix<f64>,
}

impl Read {
    fn of(log: &Log, unit: &UnitDescription, kind: Kind) -> Self {
        let is_own = |index: &usize| unit.channels[*index].sensor == kind && !log.channels[*index].rows.is_empty();
        let channels: Vec<usize> = (0..unit.channels.len()).filter(is_own).collect();
        let at = |channel: usize, row: usize| {
            let series = &log.channels[channel];
            let at = series.rows.binary_search(&(row as u32)).ok()?;
            let own = &unit.channels[channel];
            Some((series.values[at] - own.bias) / own.sigma())
        };
        let packets = (0..log.start_s.len()).filter_map(|row| {
            let all: Option<Vec<f64>> = channels.iter().map(|channel| at(*channel, row)).collect();
            Some((row, DVector::from_vec(all?)))
        });
        let (rows, packets): (Vec<usize>, Vec<DVector<f64>>) = packets.unzip();
        let values = match packets.is_empty() {
            true => DMatrix::zeros(channels.len(), 0),
            false => DMatrix::from_columns(&packets),
        };
        Self {
            sigmas: DVector::from_iterator(channels.len(), channels.iter().map(|at| unit.channels[*at].sigma())),
            moments: &values * values.transpose(),
            channels,
            rows,
            values,
        }
    }

    /// Axes over noise.
    fn axes(&self, axis_b: &dyn Fn(usize) -> Vector3<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(self.channels.len(), 3, |row, column| {
            axis_b(self.channels[row])[column] / self.sigmas[row]
        })
    }

    /// What no vector explains; nothing of three channels or fewer.
    fn left(&self, axis_b: &dyn Fn(usize) -> Vector3<f64>) -> f64 {
        if self.channels.len() <= 3 {
            return 0.0;
        }
        let q = self.axes(axis_b).qr().q();
        self.moments.trace() - q.tr_mul(&(&self.moments * &q)).trace()
    }

    /// The vector of each packet.
    fn vectors(&self, axis_b: &dyn Fn(usize) -> Vector3<f64>) -> Option<Matrix3xX<f64>> {
        let inverse = self.axes(axis_b).pseudo_inverse(f64::EPSILON).ok()?;
        Some(Matrix3xX::from_columns(
            &(inverse * &self.values)
                .column_iter()
                .map(|own| Vector3::new(own[0], own[1], own[2]))
                .collect::<Vec<_>>(),
        ))
    }
}

/// The one that leaves least, and where the channels that it moves look; none that leaves less than the axes as described.
fn likeliest(
    unit: &UnitDescription,
    environment: &Environment,
    log: &Log,
    read: &[Read; 3],
    withheld: &[String],
) -> Option<(Cause, Vec<Look>)> {
    let log_s = (*log.start_s.first()?, *log.start_s.last()?);
    let left = |looks: &[Look]| {
        read.iter()
            .map(|own| own.left(&|channel| axis_of(unit, looks, channel)))
            .sum::<f64>()
    };
    let as_described = left(&[]);
    let mut best: Vec<(f64, Cause, Vec<Look>)> = Vec::new();
    for effect in LIBRARY.iter().filter(|effect| effect.page().nature == Nature::Discrete) {
        if withheld.iter().any(|name| name == effect.page().name) {
            continue;
        }
        for locality in effect.localities(unit) {
            for variant in effect.variants(&log.start_s) {
                let cause = Cause {
                    effect: *effect,
                    locality: locality.clone(),
                    variant,
                };
                let looks = looks(unit, environment, log_s, &cause);
                if looks.is_empty() {
                    continue;
                }
                let own = left(&looks);
                let least = best.first().map_or(as_described, |(least, ..)| *least);
                let apart = SAME * as_described;
                if own < least - apart {
                    best.clear();
                }
                if own < as_described - apart && own <= least + apart {
                    best.push((own, cause, looks));
                }
            }
        }
    }
    let expected = -environment.gravity_n().dot(&environment.field_n_ut);
    let off = |looks: &[Look]| (force_and_field(unit, read, looks).unwrap_or(0.0) - expected).abs();
    let best = best
        .into_iter()
        .min_by(|one, other| off(&one.2).total_cmp(&off(&other.2)));
    best.map(|(_, cause, looks)| (cause, looks))
}

/// Mean product of force and field over the packets that have both.
fn force_and_field(unit: &UnitDescription, [force, _, field]: &[Read; 3], looks: &[Look]) -> Option<f64> {
    let vectors = |of: &Read| of.vectors(&|channel| axis_of(unit, looks, channel));
    let (forces, fields) = (vectors(force)?, vectors(field)?);
    let product = |(at, row): (usize, &usize)| {
        let beside = field.rows.binary_search(row).ok()?;
        Some(forces.column(at).dot(&fields.column(beside)))
    };
    let products: Vec<f64> = force.rows.iter().enumerate().filter_map(product).collect();
    (!products.is_empty()).then(|| products.iter().sum::<f64>() / products.len() as f64)
}

fn axis_of(unit: &UnitDescription, looks: &[Look], channel: usize) -> Vector3<f64> {
    let own = looks.iter().find(|own| own.channel == channel);
    own.map_or(unit.channels[channel].axis_b, |own| own.axis_b)
}

/// Where the channels look that a cause moves.
fn looks(unit: &UnitDescription, environment: &Environment, log_s: (f64, f64), cause: &Cause) -> Vec<Look> {
    let active = Active {
        cause: cause.clone(),
        theta: Vec::new(),
    };
    let look = |(index, channel)| {
        let site = Site {
            unit,
            index,
            channel,
            environment,
            log_s,
        };
        let mut chain = Chain::of(channel);
        active.act(&site, &mut chain);
        let is_moved = chain.aim.axis_b != channel.axis_b || chain.aim.lever_m != channel.lever_m;
        is_moved.then_some(Look {
            channel: index,
            axis_b: chain.aim.axis_b,
            lever_m: chain.aim.lever_m,
        })
    };
    unit.channels.iter().enumerate().filter_map(look).collect()
}
