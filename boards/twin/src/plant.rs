//! The plant: four plates of parts in a world, as the controller's pins find them.
//!
//! Truth in, register bytes and line levels out. Each part sees truth from its own place: turned into its plate's
//! frame, and for the accelerometer carried along the lever arm, f + w' x r + w x (w x r). Parts differ by a seed:
//! the phase of their clocks, their biases, their noise; the same seed is the same unit, to the last bit.
//!
//! Noise is that of the thesis' unit (sections 4.1 and 4.2: 1.53 LSB, 2.68 LSB) and of the datasheets, bias what
//! is left after calibration. Scale and misalignment are nominal.

pub mod assembly;
mod gyro;
mod sensor_bus;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use emems::{
    board::{BrownOut, OptionBytes},
    nand::K9F1208_BLOCKS,
    sample::{Kind, SENSORS},
};

use nalgebra::Vector3;

pub use self::{gyro::Gyro, sensor_bus::SensorBus};
use crate::{
    fault::Struck,
    geometry::{self, PLATES},
    part::{
        I2cPart, Input, Nanos, SpiPart,
        adis16265::{Adis16265, Measurand},
        hmc5883l::{self, Hmc5883l},
        lis331hh::{self, Lis331hh},
        nand::{Cells, latch::K9f1208},
        signal::{Noise, Specimen},
        tca9548a::Tca9548a,
        tmp102::{self, Tmp102},
    },
    run::{Fault, Level},
    truth::{Truth, TruthSource},
};

/// Standard deviations of a channel: of its white noise, and of its bias from unit to unit.
struct Spread {
    noise: f64,
    bias: f64,
}

/// [m/s2] 650 ug/rtHz in 50 Hz.
const ACCELEROMETER: Spread = Spread {
    noise: 0.045,
    bias: 0.02,
};
/// \[uT\] 2 mG.
const MAGNETOMETER: Spread = Spread { noise: 0.2, bias: 0.1 };
/// [rad/s] 0.044 deg/s/rtHz in 20 Hz.
const GYRO: Spread = Spread {
    noise: 0.00344,
    bias: 0.0015,
};
/// \[degC\] thermometer in the gyro.
const GYRO_THERMOMETER: Spread = Spread {
    noise: 0.12,
    bias: 0.06,
};
/// \[degC\] TMP102.
const THERMOMETER: Spread = Spread {
    noise: 0.05,
    bias: 0.03,
};

/// How good the parts are, as factors on their nominal spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// On the noise.
    pub noise: f64,
    /// On the biases.
    pub bias: f64,
    /// Which flight of these parts: they are the same in each, and their noise is another.
    pub flight: u64,
    /// \[1\] by what part the periods of their clocks are off, standard deviation.
    pub clock: f64,
}

impl Quality {
    /// As the parts are.
    pub const NOMINAL: Quality = Quality {
        noise: 1.0,
        bias: 1.0,
        flight: 0,
        clock: 0.0,
    };
    /// As the parts are, and each with its own clock: the data sheet of the ADIS16265 gives its sample rate to 3 % (Table 1),
    /// those of the others give none. Over minutes every age passes between two conversions.
    pub const FREE_CLOCKS: Quality = Quality {
        clock: 0.01,
        ..Quality::NOMINAL
    };
    /// Parts without noise or bias, for tests of everything else.
    pub const IDEAL: Quality = Quality {
        noise: 0.0,
        bias: 0.0,
        flight: 0,
        clock: 0.0,
    };

    fn draw<const N: usize>(self, spread: Spread, stream: Noise) -> Specimen<N> {
        let specimen = Specimen::draw(stream, spread.noise * self.noise, spread.bias * self.bias, self.flight);
        specimen.off_pace(stream, self.clock)
    }
}

/// The four plates, the vehicle's two lines, and what befalls them.
pub struct Plant {
    /// The plates' I2C parts.
    pub i2c: SensorBus,
    /// The plates' gyros.
    pub gyro: [Gyro; PLATES],
    /// The recorder's memory.
    pub nand: K9f1208,
    /// What the processor's option bytes say: from the start as for a flight.
    pub options: OptionBytes,
    /// The supply is above what the NAND needs.
    supply_good: bool,
    /// How often it fell below that.
    dips: u16,
    /// What drives the vehicle's two lines.
    lift_off: Level,
    micro_g: Level,
    /// How often a failing supply was noticed, and polls of each line that found another level than the world's.
    struck: [u64; 3],
    source: Arc<dyn TruthSource>,
}

impl Plant {
    /// The unit of this seed in this world, powered at time 0.
    pub fn new(source: Arc<dyn TruthSource>, seed: u64) -> Self {
        Plant::with(source, seed, Quality::NOMINAL)
    }

    /// A unit without noise or bias.
    pub fn ideal(source: Arc<dyn TruthSource>) -> Self {
        Plant::with(source, 0, Quality::IDEAL)
    }

    /// The unit of this seed, better or worse than nominal.
    pub fn with(source: Arc<dyn TruthSource>, seed: u64, quality: Quality) -> Self {
        Plant::seeing(&Views::of(&source), source, seed, quality)
    }

    /// The unit of this seed whose parts see this; `source` still drives the vehicle's two lines.
    pub fn seeing(views: &Views, source: Arc<dyn TruthSource>, seed: u64, quality: Quality) -> Self {
        let seeds = Noise::new(seed);
        let plates = (0..PLATES).map(|plate| views.i2c_parts(plate, seeds.stream(plate as u64), quality));
        Plant {
            i2c: SensorBus::new(Tca9548a::new(plates)),
            gyro: core::array::from_fn(|plate| views.gyro(plate, seeds.stream((PLATES + plate) as u64), quality)),
            nand: K9f1208::new(Cells::formatted(K9F1208_BLOCKS, seed)),
            options: OptionBytes {
                brown_out: BrownOut {
                    set_mv: 2700,
                    asked_mv: 2700,
                },
                read_out: 1,
            },
            supply_good: true,
            dips: 0,
            lift_off: Level::World,
            micro_g: Level::World,
            struck: [0; 3],
            source,
        }
    }

    /// The vehicle's lines at `now`, `true` = asserted: lift-off, micro-gravity.
    pub fn discretes(&mut self, now: Nanos) -> (bool, bool) {
        let truth = self.source.at(now as f64 * 1e-9);
        let lines = (
            self.lift_off.at(now, truth.lift_off),
            self.micro_g.at(now, truth.micro_g),
        );
        self.struck[1] += u64::from(lines.0 != truth.lift_off);
        self.struck[2] += u64::from(lines.1 != truth.micro_g);
        lines
    }

    /// Whether the supply is above what the NAND needs.
    pub fn power_good(&mut self) -> bool {
        self.struck[0] += u64::from(!self.supply_good);
        self.supply_good
    }

    /// How often the supply fell below that, since the plant was made.
    pub fn supply_dips(&self) -> u16 {
        self.dips
    }

    /// How often each fault did something since power-on, by its name.
    pub fn struck(&self) -> Struck {
        let mut struck = Struck::new();
        let [held, stuck, gone, misplaced] = self.i2c.struck;
        let [supply, lift_off, micro_g] = self.struck;
        let own = [
            ("sda-held", held),
            ("bus-stuck", stuck),
            ("mux-silent", gone),
            ("stop-misplaced", misplaced),
            ("supply", supply),
            ("lift-off", lift_off),
            ("micro-g", micro_g),
            ("nand-torn", self.nand.cells.torn),
            ("nand-flips", self.nand.cells.flipped),
            ("nand-dead", self.nand.dead),
            ("nand-absent", self.nand.absent),
        ];
        let gyros = self.gyro.iter().flat_map(Gyro::struck);
        for (name, times) in own.into_iter().chain(gyros).chain(self.i2c.switch.struck()) {
            if times > 0 {
                *struck.entry(name).or_default() += times;
            }
        }
        struck
    }

    /// Whether SDA is low with nobody sending.
    pub fn sda_held(&self) -> bool {
        self.i2c.is_held()
    }

    /// The same, to be asked before a START.
    pub fn sda_in_the_way(&mut self) -> bool {
        self.i2c.is_in_the_way()
    }

    /// One pulse on SCL outside a transfer.
    pub fn clock_pulse(&mut self) {
        self.i2c.clock_pulse();
    }

    /// Whether the controller sends no START, to be asked before one.
    pub fn start_is_refused(&mut self) -> bool {
        self.i2c.start_is_refused()
    }

    /// The controller is reset.
    pub fn controller_reset(&mut self) {
        self.i2c.controller_reset();
    }

    /// Until when a part holds SCL low; `now` or earlier if none does.
    pub fn scl_held_until(&self) -> Nanos {
        self.i2c.switch.scl_held_until()
    }

    /// Lets a fault strike. A slot or plate the unit does not have is left alone, and so are the faults of the controller
    /// and its recorder.
    pub fn apply(&mut self, fault: Fault, now: Nanos) {
        match fault {
            Fault::Silent(slot) => self.silence(slot, true, now),
            Fault::Restored(slot) => self.silence(slot, false, now),
            Fault::MuxSilent(silent) => self.i2c.silence(silent),
            Fault::SdaHeld(pulses) => self.i2c.hold_sda(pulses),
            Fault::BusStuck(stuck) => self.i2c.stick(stuck),
            Fault::StopMisplaced => self.i2c.misplace_stop(),
            Fault::Bridged(plate, bridged) => self.i2c.switch.bridge(plate, bridged),
            Fault::Garbage(slot, babbling) => self.befall(
                slot,
                |gyro| gyro.babble(babbling),
                |switch, channel, address| switch.babble_part(channel, address, babbling),
            ),
            Fault::Frozen(slot, frozen) => self.befall(
                slot,
                |gyro| gyro.freeze(frozen),
                |switch, channel, address| switch.freeze_part(channel, address, frozen),
            ),
            Fault::Nack(slot, byte) => self.befall(
                slot,
                |_| {},
                |switch, channel, address| switch.refuse_part(channel, address, byte),
            ),
            Fault::NandDead(dead) => self.nand.cells.befalls.dead = dead,
            Fault::NandAbsent => self.nand.cells.befalls.absent = true,
            Fault::NandFlips(per_thousand) => self.nand.cells.befalls.flips_per_thousand = per_thousand,
            Fault::LiftOff(level) => self.lift_off = level,
            Fault::MicroG(level) => self.micro_g = level,
            Fault::SupplyFailing(failing) => {
                self.dips = self.dips.saturating_add(u16::from(failing && self.supply_good));
                self.supply_good = !failing;
            }
            Fault::PowerCut(tear) => {
                self.nand.power_cut(now, tear);
                self.supply_good = true;
                self.i2c.power_on(now);
                self.gyro.iter_mut().for_each(|gyro| gyro.power_on(now));
            }
            Fault::Stretching(slot, duration) => self.befall(
                slot,
                |_| {},
                |switch, channel, address| switch.stretch_part(channel, address, duration),
            ),
            Fault::DmaHung
            | Fault::Busy(_)
            | Fault::Hang(_)
            | Fault::ClockSteps(_)
            | Fault::TelemetryStuck(_)
            | Fault::UmbilicalStuck(_)
            | Fault::LinesSlow(_)
            | Fault::UmbilicalNoise(_)
            | Fault::UmbilicalBreak(_)
            | Fault::KeptFlip(_)
            | Fault::RamFlip(_)
            | Fault::ImageFlip(_)
            | Fault::CrystalLost
            | Fault::Panic
            | Fault::Reset => {}
        }
    }

    fn silence(&mut self, slot: usize, silent: bool, now: Nanos) {
        let Some(sensor) = SENSORS.get(slot) else {
            return;
        };
        match i2c_address(sensor.kind) {
            Some(address) => self.i2c.switch.silence_part(sensor.plate, address, silent, now),
            None => self.gyro[sensor.plate].silence(silent, now),
        }
    }

    /// Lets something befall the sensor in this slot, whichever bus it is on.
    fn befall(
        &mut self,
        slot: usize,
        a_gyro: impl FnOnce(&mut Gyro),
        an_i2c_part: impl FnOnce(&mut Tca9548a, usize, u8),
    ) {
        let Some(sensor) = SENSORS.get(slot) else {
            return;
        };
        match i2c_address(sensor.kind) {
            Some(address) => an_i2c_part(&mut self.i2c.switch, sensor.plate, address),
            None => a_gyro(&mut self.gyro[sensor.plate]),
        }
    }
}

/// Where a kind of sensor is on its plate's I2C bus.
fn i2c_address(kind: Kind) -> Option<u8> {
    match kind {
        Kind::Gyro => None,
        Kind::Accelerometer => Some(lis331hh::ADDRESS),
        Kind::Magnetometer => Some(hmc5883l::ADDRESS),
        Kind::Thermometer => Some(tmp102::ADDRESS),
    }
}

/// What the parts of each plate see of the truth, each from its own place: the seam between the world and the unit.
///
/// [`Views::of`] is the nominal unit in a nominal world. Whoever wants a part that is turned, late, warm or beside a
/// magnet puts another function in place of one of these.
#[derive(Clone)]
pub struct Views {
    /// [m/s2] specific force at each accelerometer, in its plate's frame.
    pub force_p: [Input<Vector3<f64>>; PLATES],
    /// \[uT\] field at each magnetometer, in its plate's frame.
    pub field_p_ut: [Input<Vector3<f64>>; PLATES],
    /// [rad/s] rate about each gyro's sense axis.
    pub rate: [Input<f64>; PLATES],
    /// \[degC\] of each plate's thermometer.
    pub temperature_c: [Input<f64>; PLATES],
    /// \[degC\] of each gyro.
    pub gyro_temperature_c: [Input<f64>; PLATES],
}

impl Views {
    /// Nominal places and axes.
    pub fn of(source: &Arc<dyn TruthSource>) -> Self {
        let force_p = |plate| {
            let dcm_pb = geometry::dcm_bp(plate).transpose();
            let place_b = geometry::accelerometer_place_b(plate);
            seen(source, move |truth| {
                let Truth {
                    rate_b,
                    rate_dot_b,
                    force_b,
                    ..
                } = truth;
                dcm_pb * (force_b + rate_dot_b.cross(&place_b) + rate_b.cross(&rate_b.cross(&place_b)))
            })
        };
        let field_p_ut = |plate| {
            let dcm_pb = geometry::dcm_bp(plate).transpose();
            seen(source, move |truth| dcm_pb * truth.field_b_ut)
        };
        let rate = |plate| {
            let axis_b = geometry::gyro_axis_b(plate);
            seen(source, move |truth| axis_b.dot(&truth.rate_b))
        };
        Views {
            force_p: core::array::from_fn(force_p),
            field_p_ut: core::array::from_fn(field_p_ut),
            rate: core::array::from_fn(rate),
            temperature_c: core::array::from_fn(|_| seen(source, |truth| truth.temperature_c)),
            gyro_temperature_c: core::array::from_fn(|_| seen(source, |truth| truth.temperature_c)),
        }
    }

    fn i2c_parts(&self, plate: usize, seeds: Noise, quality: Quality) -> Vec<Box<dyn I2cPart>> {
        vec![
            Box::new(Lis331hh::new(
                self.force_p[plate].clone(),
                quality.draw(ACCELEROMETER, seeds.stream(0)),
            )),
            Box::new(Hmc5883l::new(
                self.field_p_ut[plate].clone(),
                quality.draw(MAGNETOMETER, seeds.stream(1)),
            )),
            Box::new(Tmp102::new(
                self.temperature_c[plate].clone(),
                quality.draw(THERMOMETER, seeds.stream(2)),
            )),
        ]
    }

    fn gyro(&self, plate: usize, seeds: Noise, quality: Quality) -> Gyro {
        let measurand = Measurand {
            rate: self.rate[plate].clone(),
            temperature_c: self.gyro_temperature_c[plate].clone(),
            rate_specimen: quality.draw(GYRO, seeds.stream(0)),
            temperature_specimen: quality.draw(GYRO_THERMOMETER, seeds.stream(1)),
        };
        Gyro::new(Adis16265::new(measurand), seeds.stream(2))
    }
}

/// What a part sees of the truth.
fn seen<T>(source: &Arc<dyn TruthSource>, view: impl Fn(Truth) -> T + Send + Sync + 'static) -> Input<T> {
    let source = Arc::clone(source);
    Arc::new(move |t_s| view(source.at(t_s)))
}
