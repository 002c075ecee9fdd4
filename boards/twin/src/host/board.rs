//! The host board's parts.

use std::{cell::RefCell, rc::Rc};

use emems::board::{Board, Oscillator, Parts, ResetCause, StackUse};

use super::{
    bus::{Gyro, SensorBus},
    lines::{Fed, Inputs, Kept, Receiver, Sent, Spoken, Transmitter, Watched},
    nand::NandPins,
    plight::{self, Plight},
};
use crate::{plant::Plant, run::End};

/// The type that names the host board's parts.
pub struct Host;

impl Board for Host {
    type SensorBus = SensorBus;
    type Gyro = Gyro;
    type Telemetry = Transmitter;
    type UmbilicalTx = Transmitter;
    type UmbilicalRx = Receiver;
    type Discretes = Inputs;
    type Watchdog = Fed;
    type Retained = Kept;
    type Nand = NandPins;
    type Supply = Watched;

    fn ram_sum<T>(_: &T, before: u32) -> u32 {
        before
    }
}

/// The outside ends of the host board.
#[derive(Default)]
pub struct Ends {
    /// What telemetry sent.
    pub telemetry: Sent,
    /// What the umbilical sent.
    pub umbilical: Sent,
    /// What the ground says.
    pub spoken: Spoken,
    /// The watchdog.
    pub fed: Fed,
    /// Memory that survives a reset.
    pub kept: Kept,
    /// What befalls the processor and its ends.
    pub plight: Rc<Plight>,
}

/// The parts of a unit that starts because of `reset`.
pub fn parts(plant: &Rc<RefCell<Plant>>, ends: &Ends, reset: ResetCause) -> Parts<Host> {
    Parts {
        sensor_bus: SensorBus::new(plant.clone(), ends.plight.clone()),
        gyros: [0, 1, 2, 3].map(|plate| Gyro::new(plant.clone(), plate, ends.plight.clone())),
        telemetry: Transmitter::new(ends.telemetry.clone(), End::Telemetry, ends.plight.clone()),
        umbilical_tx: Transmitter::new(ends.umbilical.clone(), End::UmbilicalOut, ends.plight.clone()),
        umbilical_rx: Receiver(ends.spoken.clone(), ends.plight.clone()),
        discretes: Inputs(plant.clone(), ends.plight.clone()),
        watchdog: ends.fed.clone(),
        retained: ends.kept.clone(),
        nand: NandPins(plant.clone(), ends.plight.clone()),
        reset,
        oscillator: Oscillator::Crystal,
        options: plant.borrow().options,
        supply: Watched::new(plant),
        stack_use: StackUse::default,
        read_image: plight::read_image,
    }
}
