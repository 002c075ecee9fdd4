//! The twin's parts as rigless' chips, and the two serial lines.
//!
//! In: what the STM32's peripherals clock, a byte or word at a time, with its instant. Out: what the parts answer.
//! All parts live in one [`Plant`], which the peers share, so that a fault applied to it is seen at once.
//! None of them can be kept in a rigless snapshot; every run starts from reset.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use rigless::{
    chip::{Timeline, i2c, parallel, spi, uart},
    device::DeviceContext,
    snapshot::Store,
    soc::Width,
    time::VirtualNanos,
};
use twin::{
    part::{Nanos, SpiPart},
    plant::Plant,
};

/// The parts of one unit, shared by everything on the board that reaches them.
#[derive(Clone)]
pub struct SharedPlant(Arc<Mutex<Plant>>);

impl SharedPlant {
    /// The parts of this plant.
    pub fn new(plant: Plant) -> Self {
        SharedPlant(Arc::new(Mutex::new(plant)))
    }

    /// The core's thread alone takes it, so it is never contended; a panic there ends the run anyway.
    pub fn lock(&self) -> MutexGuard<'_, Plant> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for SharedPlant {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("SharedPlant")
    }
}

/// Everything on I2C1: the multiplexer and, behind it, the twelve parts of the four plates.
#[derive(Debug)]
pub struct SensorBus(pub SharedPlant);

impl Store for SensorBus {}

impl i2c::Peer for SensorBus {
    fn start(&mut self, address: u8, read: bool, context: &mut Timeline<'_, '_>) -> bool {
        self.0.lock().i2c.start(address, read, context.now().0)
    }

    fn write(&mut self, byte: u8, context: &mut Timeline<'_, '_>) -> bool {
        self.0.lock().i2c.write(byte, context.now().0)
    }

    fn read(&mut self, _last: bool, context: &mut Timeline<'_, '_>) -> u8 {
        self.0.lock().i2c.read(context.now().0)
    }

    fn stop(&mut self, context: &mut Timeline<'_, '_>) {
        self.0.lock().i2c.stop(context.now().0);
    }
}

/// The gyro of one plate on SPI1.
#[derive(Debug)]
pub struct Gyro {
    pub plant: SharedPlant,
    pub plate: usize,
}

impl Gyro {
    fn part<T>(&self, act: impl FnOnce(&mut dyn SpiPart) -> T, silent: T) -> T {
        match self.plant.lock().gyro.get_mut(self.plate) {
            Some(part) => act(part),
            None => silent,
        }
    }
}

impl Store for Gyro {}

impl spi::Peer for Gyro {
    fn transfer(&mut self, mosi: u32, _bits: u8, context: &mut Timeline<'_, '_>) -> u32 {
        let now = context.now().0;
        // Sixteen-bit frames; a wider word cannot occur on this controller.
        u32::from(self.part(|part| part.transfer(mosi as u16, now), 0))
    }

    fn select(&mut self, context: &mut Timeline<'_, '_>) {
        let now = context.now().0;
        self.part(|part| part.select(now), ());
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        let now = context.now().0;
        self.part(|part| part.deselect(now), ());
    }
}

/// The NAND in the FSMC's bank 2: command latch on A16, address latch on A17. Its WP# comes through [`crate::wires`].
#[derive(Debug)]
pub struct Nand(pub SharedPlant);

/// Offset bit of the command latch.
const CLE: u64 = 1 << 16;
/// Offset bit of the address latch.
const ALE: u64 = 1 << 17;

impl Store for Nand {}

impl parallel::Peer for Nand {
    fn read(&mut self, _offset: u64, _width: Width, context: &mut DeviceContext<'_>) -> u64 {
        u64::from(self.0.lock().nand.read(context.now().0))
    }

    fn write(&mut self, offset: u64, _width: Width, value: u64, context: &mut DeviceContext<'_>) {
        let (byte, now) = (value as u8, context.now().0);
        let nand = &mut self.0.lock().nand;
        match offset & (CLE | ALE) {
            CLE => nand.command(byte, now),
            ALE => nand.address(byte, now),
            _ => nand.write(byte, now),
        }
    }
}

/// The far end of a serial line: keeps what it hears with the instant of each stop bit, says what it was given.
#[derive(Debug, Default)]
pub struct Line {
    heard: Vec<(Nanos, u8)>,
    to_say: VecDeque<(Nanos, u8)>,
    /// The wire is held low: frames of zeros without a stop bit, one after the other.
    held_low: bool,
    sent: u64,
}

impl Line {
    /// What was heard since the last call, oldest first.
    pub fn take_heard(&mut self) -> Vec<(Nanos, u8)> {
        std::mem::take(&mut self.heard)
    }

    /// Puts `bytes` on the line from `at` on, as fast as it carries them, after whatever is still to be said.
    pub fn say(&mut self, at: Nanos, bytes: &[u8]) {
        self.to_say.extend(bytes.iter().map(|&byte| (at, byte)));
    }

    /// When the next byte is due.
    pub fn next_due(&self) -> Option<Nanos> {
        self.to_say.front().map(|&(at, _)| at)
    }

    /// Holds the wire low from `at` on, or lets it go. What is said meanwhile is lost.
    pub fn hold_low(&mut self, at: Nanos, held_low: bool) {
        self.held_low = held_low;
        self.to_say.clear();
        if held_low {
            self.say(at, &[0]);
        }
    }

    /// Frames put on the line so far.
    pub fn sent(&self) -> u64 {
        self.sent
    }
}

impl Store for Line {}

impl uart::Peer for Line {
    fn receive(&mut self, word: u16, context: &mut Timeline<'_, '_>) {
        self.heard.push((context.now().0, word as u8));
    }

    fn transmit(&mut self, now: VirtualNanos) -> Option<u16> {
        let &(due, byte) = self.to_say.front()?;
        if due > now.0 {
            return None;
        }
        self.sent += 1;
        if self.held_low {
            // The frame after it begins where this one ends.
            self.to_say.truncate(1);
            return Some(0);
        }
        self.to_say.pop_front();
        Some(u16::from(byte))
    }
}

#[cfg(test)]
mod tests {
    use rigless::chip::uart::Peer as _;

    use super::*;

    #[test]
    fn a_line_says_a_byte_at_its_instant_and_not_before() {
        let mut line = Line::default();
        line.say(2_000, b"G_");
        assert_eq!(line.next_due(), Some(2_000));
        assert_eq!(line.transmit(VirtualNanos(1_999)), None);
        assert_eq!(line.transmit(VirtualNanos(2_000)), Some(u16::from(b'G')));
        assert_eq!(line.transmit(VirtualNanos(2_000)), Some(u16::from(b'_')));
        assert_eq!(line.transmit(VirtualNanos(9_000)), None);
        assert_eq!(line.next_due(), None);
    }
}
