//! What may go wrong when a unit is soldered and wired, so that its acceptance test can be tried.
//!
//! In: words such as `exchanged-plates:1,2`, `inverted:a1x`, `bias:g3=20`. Out: a [`Plant`] with those defects. Plates count from
//! 1, as on the board. A defect is there from power-on; what strikes later is a [fault](crate::fault), and those lasting words
//! (`silent:a2@0s`) are faults of a part that never worked.
//!
//! | word | what |
//! |---|---|
//! | `exchanged-plates:I,J` | the wires of two channels of the multiplexer are exchanged: all I2C parts of both plates |
//! | `crossed-selects:I,J` | the chip selects of two gyros |
//! | `inverted:CHANNEL` | an axis of an accelerometer or magnetometer (a1x, m2z), or a gyro soldered upside down (g3), reads with the other sign |
//! | `turned:SENSOR` | an accelerometer or magnetometer (a1, m2) soldered a quarter turn about its z: its x is the plate's y |
//! | `scale:SENSOR=F` | reads F times what it should: another part of the family, another range |
//! | `bias:SENSOR=B` | reads B more on its first axis [m/s2, uT, deg/s] |
//! | `noise:SENSOR=S` | has a noise of S beside its own [m/s2, uT, deg/s] |
//! | `clone:mN` | a QMC5883L in place of the HMC5883L: another address, other registers |
//! | `other:SENSOR` | another I2C part at the address, which acknowledges and whose registers are all zero |
//! | `slow-bus=US` | every part of the bus lets SCL rise so much later \[us\] each time it is called: pull-ups that are too weak |
//!
//! Refuses words it does not know, with those it does.

use std::{str::FromStr, sync::Arc};

use emems::sample::{Kind, SENSORS};
use nalgebra::Vector3;

use super::{Plant, Quality, Views, i2c_address};
use crate::{
    fault::SENSOR_NAMES,
    geometry::PLATES,
    part::{I2cPart, Input, Nanos, signal::Noise},
    truth::TruthSource,
};

/// Address of a QMC5883L (QST data sheet, section 5.4).
const QMC5883L_ADDRESS: u8 = 0x0D;

/// One defect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Defect {
    /// Channels of the multiplexer of two plates, from 0.
    ExchangedPlates(usize, usize),
    /// Chip selects of two gyros, from 0.
    CrossedSelects(usize, usize),
    /// Slot of the reading order, and the axis.
    Inverted(usize, usize),
    /// Slot of an accelerometer or magnetometer.
    Turned(usize),
    /// Slot and factor.
    Scale(usize, f64),
    /// Slot and what it reads more [m/s2, uT, rad/s].
    Bias(usize, f64),
    /// Slot and standard deviation [m/s2, uT, rad/s].
    Noise(usize, f64),
    /// Plate of the magnetometer.
    Clone(usize),
    /// Slot of an I2C part.
    Other(usize),
    /// \[ns\] each time a part is called.
    SlowBus(Nanos),
}

/// Words and what follows them, for messages.
const WORDS: &str = "exchanged-plates:I,J crossed-selects:I,J inverted:CHANNEL turned:SENSOR scale:SENSOR=F bias:SENSOR=B \
                     noise:SENSOR=S clone:mN other:SENSOR slow-bus=US";

impl FromStr for Defect {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (what, size) = text
            .split_once('=')
            .map_or((text, None), |(what, size)| (what, Some(size)));
        let (name, target) = what.split_once(':').unwrap_or((what, ""));
        let size = || -> Result<f64, String> {
            let size = size.ok_or_else(|| format!("{text}: say how much, as in {name}:{target}=1.5"))?;
            let number = size.parse().ok().filter(|size: &f64| size.is_finite());
            number.ok_or_else(|| format!("{text}: \"{size}\" is no number"))
        };
        let slot = |name: &str| {
            let slot = SENSOR_NAMES.iter().position(|known| *known == name);
            slot.ok_or_else(|| format!("{text}: {name} is none of {}", SENSOR_NAMES.join(" ")))
        };
        let pair = || {
            let plate = |digit: &str| digit.trim().parse().ok().filter(|plate| (1..=PLATES).contains(plate));
            let plates = target.split_once(',').map(|(a, b)| (plate(a), plate(b)));
            match plates {
                Some((Some(a), Some(b))) if a != b => Ok((a - 1, b - 1)),
                _ => Err(format!("{text}: name two plates of 1 to {PLATES}, as in {name}:1,2")),
            }
        };
        let unit = |slot: usize| match SENSORS[slot].kind {
            Kind::Gyro => 1_f64.to_radians(),
            _ => 1.0,
        };
        let triad = |slot: usize| match SENSORS[slot].kind {
            Kind::Accelerometer | Kind::Magnetometer => Ok(slot),
            _ => Err(format!(
                "{text}: only accelerometers (a1) and magnetometers (m1) have three axes"
            )),
        };
        Ok(match name {
            "exchanged-plates" => pair().map(|(a, b)| Defect::ExchangedPlates(a, b))?,
            "crossed-selects" => pair().map(|(a, b)| Defect::CrossedSelects(a, b))?,
            "inverted" => match target.find(['x', 'y', 'z']).map(|at| target.split_at(at)) {
                None if target.starts_with('g') => Defect::Inverted(slot(target)?, 0),
                Some((sensor, axis)) if axis.len() == 1 => {
                    let number = ["x", "y", "z"].iter().position(|name| *name == axis);
                    Defect::Inverted(triad(slot(sensor)?)?, number.unwrap_or_default())
                }
                _ => return Err(format!("{text}: name an axis such as a1x or m2z, or a gyro such as g3")),
            },
            "turned" => Defect::Turned(triad(slot(target)?)?),
            "scale" => Defect::Scale(slot(target)?, size()?),
            "bias" => slot(target).and_then(|slot| Ok(Defect::Bias(slot, size()? * unit(slot))))?,
            "noise" => slot(target).and_then(|slot| Ok(Defect::Noise(slot, size()? * unit(slot))))?,
            "clone" => match SENSORS[slot(target)?] {
                sensor if sensor.kind == Kind::Magnetometer => Defect::Clone(sensor.plate),
                _ => return Err(format!("{text}: only a magnetometer (m1 to m4) has clones")),
            },
            "other" => match slot(target)? {
                slot if SENSORS[slot].kind != Kind::Gyro => Defect::Other(slot),
                _ => {
                    return Err(format!(
                        "{text}: a gyro is not on the I2C bus; silent:{target}@0s is one that is not there"
                    ));
                }
            },
            "slow-bus" => Defect::SlowBus((size()?.max(0.0) * 1e3) as Nanos),
            _ => return Err(format!("no defect is called {name}; there are {WORDS}")),
        })
    }
}

impl Defect {
    /// What the parts see of the world because of it.
    fn seen(self, views: &mut Views, noise: Noise) {
        match self {
            Defect::Inverted(slot, axis) => change(views, slot, move |_, value| {
                let mut value = value;
                value[axis] = -value[axis];
                value
            }),
            Defect::Turned(slot) => change(views, slot, |_, v| Vector3::new(v.y, -v.x, v.z)),
            Defect::Scale(slot, factor) => change(views, slot, move |_, value| value * factor),
            Defect::Bias(slot, bias) => change(views, slot, move |_, value| value + Vector3::x() * bias),
            Defect::Noise(slot, sigma) => change(views, slot, move |t_s, value| {
                let axis = |axis: u64| sigma * noise.stream(axis).normal(t_s.to_bits());
                value + Vector3::new(axis(0), axis(1), axis(2))
            }),
            _ => {}
        }
    }

    fn built(self, plant: &mut Plant) {
        match self {
            Defect::ExchangedPlates(a, b) => plant.i2c.switch.exchange(a, b),
            Defect::CrossedSelects(a, b) => plant.gyro.swap(a, b),
            Defect::Clone(plate) => {
                let address = i2c_address(Kind::Magnetometer).unwrap_or_default();
                plant.i2c.switch.replace(plate, address, Stranger(QMC5883L_ADDRESS));
            }
            Defect::Other(slot) => {
                let sensor = SENSORS[slot];
                let address = i2c_address(sensor.kind).unwrap_or_default();
                plant.i2c.switch.replace(sensor.plate, address, Stranger(address));
            }
            Defect::SlowBus(late) => {
                for sensor in SENSORS {
                    if let Some(address) = i2c_address(sensor.kind) {
                        plant.i2c.switch.stretch_part(sensor.plate, address, late);
                    }
                }
            }
            _ => {}
        }
    }
}

/// Changes what the sensor of a slot sees, at a time \[s\]; a gyro and a thermometer have the first axis only.
fn change(views: &mut Views, slot: usize, act: impl Fn(f64, Vector3<f64>) -> Vector3<f64> + Send + Sync + 'static) {
    let sensor = SENSORS[slot];
    let plate = sensor.plate;
    let vector = match sensor.kind {
        Kind::Accelerometer => &mut views.force_p[plate],
        Kind::Magnetometer => &mut views.field_p_ut[plate],
        Kind::Gyro => {
            let before = views.rate[plate].clone();
            views.rate[plate] = scalar(before, act);
            return;
        }
        Kind::Thermometer => {
            let before = views.temperature_c[plate].clone();
            views.temperature_c[plate] = scalar(before, act);
            return;
        }
    };
    let before = vector.clone();
    *vector = Arc::new(move |t_s| act(t_s, before(t_s)));
}

fn scalar(before: Input<f64>, act: impl Fn(f64, Vector3<f64>) -> Vector3<f64> + Send + Sync + 'static) -> Input<f64> {
    Arc::new(move |t_s| act(t_s, Vector3::new(before(t_s), 0.0, 0.0)).x)
}

impl Plant {
    /// The unit of this seed with these defects.
    pub fn assembled(source: Arc<dyn TruthSource>, seed: u64, quality: Quality, defects: &[Defect]) -> Self {
        let mut views = Views::of(&source);
        for (number, defect) in defects.iter().enumerate() {
            defect.seen(&mut views, Noise::new(seed).stream(number as u64 ^ 0xDEFEC7));
        }
        let mut plant = Plant::seeing(&views, source, seed, quality);
        defects.iter().for_each(|defect| defect.built(&mut plant));
        plant
    }
}

/// A part that nobody asked for: acknowledges at its address, and all its registers are zero.
struct Stranger(u8);

impl I2cPart for Stranger {
    fn address(&self) -> u8 {
        self.0
    }
    fn start(&mut self, _read: bool, _now: Nanos) -> bool {
        true
    }
    fn write(&mut self, _byte: u8, _now: Nanos) -> bool {
        true
    }
    fn read(&mut self, _now: Nanos) -> u8 {
        0
    }
    fn stop(&mut self, _now: Nanos) {}
    fn power_on(&mut self, _now: Nanos) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_and_what_is_none_is_refused_with_those_that_are() {
        let read = |text: &str| text.parse::<Defect>();
        assert_eq!(read("exchanged-plates:1,2"), Ok(Defect::ExchangedPlates(0, 1)));
        assert_eq!(read("inverted:m2z"), Ok(Defect::Inverted(5, 2)));
        assert_eq!(read("inverted:g3"), Ok(Defect::Inverted(10, 0)));
        assert_eq!(read("bias:g1=180"), Ok(Defect::Bias(8, std::f64::consts::PI)));
        assert_eq!(read("slow-bus=100"), Ok(Defect::SlowBus(100_000)));
        for wrong in [
            "exchanged-plates:1,1",
            "inverted:t1x",
            "turned:g1",
            "scale:a1",
            "clone:a1",
            "other:g1",
            "swapped",
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
        assert!(read("swapped").is_err_and(|error| error.contains("exchanged-plates")));
    }
}
