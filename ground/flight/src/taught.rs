//! `--unit FILE`: a unit as a `unit.toml` describes it, flown as parts.
//!
//! In: the description, with the effects it is known to have, and the world. Out: what its parts see ([`Views`]): the nominal
//! view of every part, and on each channel what the description predicts beyond the nominal one, without the part's own low-pass,
//! rounding and range, which the part adds. So the twin itself flies as registers, and its prediction and its flight can be held
//! against each other.
//!
//! ```text
//! view(t) = nominal(t) + lsb0/lsb predicted(t) - predicted0(t)        0: the unit as designed
//! ```
//!
//! Predictions stand every [`STEP_S`] and are straight between. Effects on the scatter have no prediction: they are named, so that
//! nobody takes them for flown. Refused: a channel that packets do not have, an effect that is not in the library, a flight
//! longer than [`LONGEST_S`].

use std::sync::Arc;

use packets::channel::{CHANNELS, Quantity};
use twin::{
    effect::{self, Nature, UnknownEffect},
    environment::Environment,
    motion::Motion,
    part::Input,
    plant::Views,
    predict::{Scene, Twin, UnitDescription, UnitError, emems},
};

/// \[s\] between predictions: the difference of two predictions of one motion has nothing above some hertz.
const STEP_S: f64 = 0.01;

/// \[s\] of a flight at most: 36 channels of it are 70 MB.
const LONGEST_S: f64 = 1200.0;

/// Why a description cannot be flown.
#[derive(Debug, thiserror::Error)]
pub enum TaughtError {
    /// It cannot be read.
    #[error(transparent)]
    Unit(#[from] UnitError),
    /// It names an effect there is not.
    #[error(transparent)]
    Effect(#[from] UnknownEffect),
    /// Not a channel of this unit.
    #[error(
        "--unit: channel {0} is none of the unit's: packets have a1x to a4z, m1x to m4z, g1 to g4, tg1 to tg4, t1 to t4"
    )]
    Channel(String),
    /// Too long to be tabulated.
    #[error("--unit flies {LONGEST_S} s at most, not {0:.0} s; give --duration")]
    TooLong(f64),
}

/// Effects of a description that change how readings scatter, not what they are: these are not flown.
pub fn not_flown(unit: &UnitDescription) -> Vec<&str> {
    let is_spread = |name: &str| effect::by_name(name).is_some_and(|effect| effect.page().nature == Nature::Spread);
    let names = unit.effects.iter().map(|known| known.effect.as_str());
    names.filter(|name| is_spread(name)).collect()
}

/// What the parts of a described unit see.
///
/// # Errors
/// When it cannot be flown.
pub fn views(
    nominal: &Views,
    unit: &UnitDescription,
    motion: &dyn Motion,
    site: Environment,
    to_s: f64,
) -> Result<Views, TaughtError> {
    if to_s > LONGEST_S {
        return Err(TaughtError::TooLong(to_s));
    }
    let steps = (to_s / STEP_S).ceil() as usize + 2;
    let starts_s: Vec<f64> = (0..steps).map(|step| STEP_S * step as f64).collect();
    let scene = Scene::new(motion, &site, -1.0, to_s + 1.0, STEP_S);
    let twin = |unit| Twin::new(unit, site, scene.clone(), starts_s.clone());
    let designed = bare(emems(|_| 0.0), unit);
    let described = bare(unit.clone(), unit);
    let (plain, taught) = (twin(designed.clone())?, twin(described)?);
    let mut views = nominal.clone();
    for (index, channel) in unit.channels.iter().enumerate() {
        let place = CHANNELS.iter().position(|known| known.name == channel.name);
        let place = place.ok_or_else(|| TaughtError::Channel(channel.name.clone()))?;
        let of_plain = designed
            .channel(&channel.name)
            .ok_or_else(|| TaughtError::Channel(channel.name.clone()))?;
        let counts = designed.channels[of_plain].lsb / channel.lsb;
        let pairs = taught
            .channel(index, &[])
            .iter()
            .zip(plain.channel(of_plain, &[]).iter())
            .map(|(taught, plain)| counts * taught - plain)
            .collect::<Vec<f64>>();
        if pairs.iter().any(|more| *more != 0.0) {
            add(&mut views, place, table(pairs, channel.slot_s));
        }
    }
    Ok(views)
}

/// Without what the part does itself, read when `like` is.
fn bare(mut unit: UnitDescription, like: &UnitDescription) -> UnitDescription {
    for channel in &mut unit.channels {
        channel.bandwidth_hz = None;
        channel.bits = None;
        channel.range = [f64::MIN, f64::MAX];
        channel.slot_s = like
            .channel(&channel.name)
            .map_or(0.0, |index| like.channels[index].slot_s);
    }
    unit
}

/// What is added at any instant.
fn table(values: Vec<f64>, slot_s: f64) -> Input<f64> {
    let last = values.len() - 1;
    Arc::new(move |t_s| {
        let place = ((t_s - slot_s) / STEP_S).clamp(0.0, last as f64);
        let at = (place as usize).min(last - 1);
        values[at] + (values[at + 1] - values[at]) * (place - at as f64)
    })
}

fn add(views: &mut Views, place: usize, more: Input<f64>) {
    let channel = CHANNELS[place];
    let axis = "xyz".find(channel.name.chars().last().unwrap_or_default()).unwrap_or(0);
    let plate = channel.plate;
    let of_three = |view: &mut Input<nalgebra::Vector3<f64>>| {
        let (seen, more) = (view.clone(), more.clone());
        *view = Arc::new(move |t_s| {
            let mut vector = seen(t_s);
            vector[axis] += more(t_s);
            vector
        });
    };
    let of_one = |view: &mut Input<f64>| {
        let (seen, more) = (view.clone(), more.clone());
        *view = Arc::new(move |t_s| seen(t_s) + more(t_s));
    };
    match channel.quantity {
        Quantity::SpecificForce => of_three(&mut views.force_p[plate]),
        Quantity::Field => of_three(&mut views.field_p_ut[plate]),
        Quantity::Rate => of_one(&mut views.rate[plate]),
        Quantity::GyroTemperature => of_one(&mut views.gyro_temperature_c[plate]),
        Quantity::Temperature => of_one(&mut views.temperature_c[plate]),
    }
}

#[cfg(test)]
mod tests {
    use twin::{environment::World, motion::Tumble, predict::KnownEffect, truth::TruthSource};

    use super::*;

    #[test]
    fn a_known_scale_error_is_seen_by_its_gyro_and_by_no_other_part() {
        let site = Environment::laboratory();
        let source: Arc<dyn TruthSource> = Arc::new(World {
            motion: Tumble::new(),
            environment: site,
        });
        let nominal = Views::of(&source);
        let mut unit = emems(|slot| 1e-3 * slot as f64);
        unit.effects.push(KnownEffect {
            effect: "gyro-scale".into(),
            locality: "g2".into(),
            variant: 0.0,
            theta: vec![0.02],
        });
        let taught = views(&nominal, &unit, &Tumble::new(), site, 60.0).expect("flown");
        for t_s in [16.0, 23.456, 51.2] {
            assert!(
                (taught.rate[1](t_s) / nominal.rate[1](t_s) - 1.02).abs() < 1e-4,
                "{t_s}"
            );
            assert_eq!(taught.rate[0](t_s), nominal.rate[0](t_s));
            assert_eq!(taught.force_p[1](t_s), nominal.force_p[1](t_s));
        }
        assert!(matches!(
            views(&nominal, &unit, &Tumble::new(), site, 1e4),
            Err(TaughtError::TooLong(_))
        ));
    }
}
