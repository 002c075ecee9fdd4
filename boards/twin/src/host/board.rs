//! The host board's parts.

use std::{
    cell::{Cell, RefCell},
    rc::Rc,
};

use emems::board::{Board, BrownOut, Oscillator, Parts, ResetCause, StackUse};

use super::{
    bus::{Gyro, SensorBus},
    lines::{Fed, Inputs, Kept, Receiver, Sent, Spoken, Transmitter},
    nand::NandPins,
};
use crate::plant::Plant;

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
    /// The sensor bus' DMA stands still.
    pub dma_hung: Rc<Cell<bool>>,
}

/// The parts of a unit that starts because of `reset`.
pub fn parts(plant: &Rc<RefCell<Plant>>, ends: &Ends, reset: ResetCause) -> Parts<Host> {
    Parts {
        sensor_bus: SensorBus::new(plant.clone(), ends.dma_hung.clone()),
        gyros: [0, 1, 2, 3].map(|plate| Gyro::new(plant.clone(), plate)),
        telemetry: Transmitter(ends.telemetry.clone()),
        umbilical_tx: Transmitter(ends.umbilical.clone()),
        umbilical_rx: Receiver(ends.spoken.clone()),
        discretes: Inputs(plant.clone()),
        watchdog: ends.fed.clone(),
        retained: ends.kept.clone(),
        nand: NandPins(plant.clone()),
        reset,
        oscillator: Oscillator::Crystal,
        brown_out: BrownOut {
            set_mv: 2700,
            asked_mv: 2700,
        },
        stack_use: StackUse::default,
    }
}
