//! The I2C parts of the four plates, behind the multiplexer: one sensor at a time, whichever part it is.

use embedded_hal_async::i2c::I2c;

use super::Settings;
use crate::{
    geometry::PLATES,
    sample::{Kind, NOT_READ, Reading, Sensor},
    sensor::{
        Error,
        hmc5883l::{self, Hmc5883l},
        lis331hh::{self, Lis331hh},
        tca9548a::{self, Channel, Switch},
        tmp102::{self, Tmp102},
    },
};

/// Why an I2C part failed.
pub type PlateError<I2C> = Error<tca9548a::Error<<I2C as embedded_hal_async::i2c::ErrorType>::Error>>;

/// What a part gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Taken {
    /// \[counts\] x, y, z, or the temperature in x.
    pub counts: [i16; 3],
    /// The part had not given it before.
    pub fresh: bool,
    /// A magnetometer axis overflowed.
    pub overflow: bool,
}

impl Taken {
    /// Puts the counts where a reading has them.
    pub fn put(&self, sensor: Sensor, reading: &mut Reading) {
        match sensor.kind {
            Kind::Accelerometer => put(&mut reading.acc_p, sensor.plate, self.counts),
            Kind::Magnetometer => put(&mut reading.mag_p, sensor.plate, self.counts),
            Kind::Thermometer => put(&mut reading.temperature, sensor.plate, self.counts[0]),
            Kind::Gyro => {}
        }
    }
}

/// Puts a value at its place, if there is one.
pub fn put<T>(places: &mut [T], at: usize, value: T) {
    if let Some(place) = places.get_mut(at) {
        *place = value;
    }
}

/// The I2C parts of a plate.
struct Plate<'a, I2C> {
    accelerometer: Lis331hh<Channel<'a, I2C>>,
    magnetometer: Hmc5883l<Channel<'a, I2C>>,
    thermometer: Tmp102<Channel<'a, I2C>>,
}

/// The accelerometers, magnetometers and thermometers of plates 1 to 4.
pub struct Plates<'a, I2C> {
    plates: [Plate<'a, I2C>; PLATES],
    acceleration: lis331hh::Config,
    field: hmc5883l::Config,
    temperature: tmp102::Rate,
}

impl<'a, I2C: I2c> Plates<'a, I2C> {
    /// The parts behind a multiplexer, plate 1 on channel 0.
    pub fn new(switch: &'a Switch<I2C>, settings: Settings) -> Self {
        let plate = |channel| Plate {
            accelerometer: Lis331hh::new(switch.channel(channel)),
            magnetometer: Hmc5883l::new(switch.channel(channel)),
            thermometer: Tmp102::new(switch.channel(channel)),
        };
        Plates {
            plates: [0, 1, 2, 3].map(plate),
            acceleration: settings.accelerometer(),
            field: settings.magnetometer(),
            temperature: tmp102::Rate::default(),
        }
    }

    /// Identifies and configures a part; nothing for what is none of these.
    pub async fn configure(&mut self, sensor: Sensor) -> Result<(), PlateError<I2C>> {
        let Some(plate) = self.plates.get_mut(sensor.plate) else {
            return Ok(());
        };
        match sensor.kind {
            Kind::Accelerometer => plate.accelerometer.configure(self.acceleration).await,
            Kind::Magnetometer => plate.magnetometer.configure(self.field).await,
            Kind::Thermometer => plate.thermometer.configure(self.temperature).await,
            Kind::Gyro => Ok(()),
        }
    }

    /// Finds a part that has lost its settings.
    pub async fn verify(&mut self, sensor: Sensor) -> Result<(), PlateError<I2C>> {
        let Some(plate) = self.plates.get_mut(sensor.plate) else {
            return Ok(());
        };
        match sensor.kind {
            Kind::Accelerometer => plate.accelerometer.verify(self.acceleration).await,
            Kind::Magnetometer => plate.magnetometer.verify(self.field).await,
            Kind::Thermometer => plate.thermometer.verify(self.temperature).await,
            Kind::Gyro => Ok(()),
        }
    }

    /// Asks a plate's magnetometer for a measurement.
    pub fn ask_field(&mut self, plate: usize) -> Option<impl Future<Output = Result<(), PlateError<I2C>>>> {
        self.plates.get_mut(plate).map(|plate| plate.magnetometer.measure())
    }

    /// Takes a part's newest sample.
    pub async fn read(&mut self, sensor: Sensor) -> Result<Taken, PlateError<I2C>> {
        let none = Taken {
            counts: [NOT_READ; 3],
            fresh: false,
            overflow: false,
        };
        let Some(plate) = self.plates.get_mut(sensor.plate) else {
            return Ok(none);
        };
        match sensor.kind {
            Kind::Accelerometer => {
                let sample = plate.accelerometer.read().await?;
                Ok(Taken {
                    counts: sample.counts,
                    fresh: sample.fresh,
                    overflow: false,
                })
            }
            Kind::Magnetometer => Ok(match plate.magnetometer.read().await? {
                Some(sample) => Taken {
                    counts: sample.counts,
                    fresh: sample.ready,
                    overflow: sample.overflow.contains(&true),
                },
                None => none,
            }),
            Kind::Thermometer => {
                let counts = plate.thermometer.read().await?;
                Ok(Taken {
                    counts: [counts, NOT_READ, NOT_READ],
                    fresh: true,
                    overflow: false,
                })
            }
            Kind::Gyro => Ok(none),
        }
    }
}
