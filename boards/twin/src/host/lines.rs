//! UARTs, discrete inputs, watchdog and retained memory of the host board.

use std::{
    cell::{Cell, RefCell},
    collections::VecDeque,
    convert::Infallible,
    future::{pending, poll_fn},
    rc::Rc,
    task::Poll,
};

use embassy_time::{Duration, Timer};
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use emems::{
    board::{Discretes, Retained, Supply, Watchdog},
    retained::RETAINED_BYTES,
};

use super::{
    clock,
    plight::Plight,
    timing::{UART_BYTE, UART_START},
};
use crate::{part::Nanos, plant::Plant, run::End};

/// What a transmitter sent and nobody has heard yet.
pub type Sent = Rc<RefCell<Vec<(Nanos, Vec<u8>)>>>;

/// A transmitter: bytes are heard when the last of a write is complete.
pub struct Transmitter {
    sent: Sent,
    end: End,
    plight: Rc<Plight>,
}

impl Transmitter {
    /// The transmitter at this end of the processor.
    pub fn new(sent: Sent, end: End, plight: Rc<Plight>) -> Self {
        Transmitter { sent, end, plight }
    }
}

/// A write under way. If it is given up, what has left by then is heard, and no more: the DMA stops between two bytes.
struct OnTheLine<'a> {
    sent: &'a Sent,
    bytes: &'a [u8],
    /// \[ns\] when the first byte begins.
    first: Nanos,
    byte_ns: Nanos,
}

impl Drop for OnTheLine<'_> {
    fn drop(&mut self) {
        let now = clock::since_power_on();
        let left = now.saturating_sub(self.first) / self.byte_ns;
        let left = &self.bytes[..self.bytes.len().min(left as usize)];
        if !left.is_empty() {
            self.sent.borrow_mut().push((now, left.to_vec()));
        }
    }
}

impl ErrorType for Transmitter {
    type Error = Infallible;
}

impl Write for Transmitter {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.plight.serve(self.end);
        if self.plight.is_stuck(self.end) {
            pending::<()>().await;
        }
        let byte_ns = UART_BYTE * self.plight.slowness();
        let mut on_the_line = OnTheLine {
            sent: &self.sent,
            bytes,
            first: clock::since_power_on() + UART_START,
            byte_ns,
        };
        let taken = UART_START + bytes.len() as Nanos * byte_ns;
        Timer::after(Duration::from_micros(taken / 1000)).await;
        on_the_line.bytes = &[];
        self.sent.borrow_mut().push((clock::since_power_on(), bytes.to_vec()));
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// What the ground said and the unit has not read yet.
pub type Spoken = Rc<RefCell<VecDeque<u8>>>;

/// A receiver.
pub struct Receiver(pub Spoken, pub Rc<Plight>);

/// A byte came with an error.
#[derive(Clone, Copy, Debug)]
pub struct Damaged;

impl std::fmt::Display for Damaged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a byte on the umbilical came with an error")
    }
}

impl std::error::Error for Damaged {}

impl embedded_io_async::Error for Damaged {
    fn kind(&self) -> ErrorKind {
        ErrorKind::InvalidData
    }
}

impl ErrorType for Receiver {
    type Error = Damaged;
}

impl Read for Receiver {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Damaged> {
        if self.1.is_held_low() {
            Timer::after(Duration::from_micros(UART_BYTE / 1000)).await;
            self.1.strike("umbilical-break");
            self.0.borrow_mut().clear();
            return Err(Damaged);
        }
        // No waker is kept: the run polls everything again whenever the ground has spoken.
        poll_fn(|_| {
            let mut spoken = self.0.borrow_mut();
            if spoken.is_empty() && !self.1.is_held_low() {
                return Poll::Pending;
            }
            self.1.serve(End::UmbilicalIn);
            if spoken.is_empty() || self.1.is_noisy() {
                spoken.pop_front();
                return Poll::Ready(Err(Damaged));
            }
            let count = bytes.len().min(spoken.len());
            bytes
                .iter_mut()
                .zip(spoken.drain(..count))
                .for_each(|(slot, byte)| *slot = byte);
            Poll::Ready(Ok(count))
        })
        .await
    }
}

/// The discrete inputs.
pub struct Inputs(pub Rc<RefCell<Plant>>, pub Rc<Plight>);

impl Discretes for Inputs {
    fn lift_off(&mut self) -> bool {
        self.1.serve(End::Discretes);
        self.0.borrow_mut().discretes(clock::since_power_on()).0
    }

    fn micro_g(&mut self) -> bool {
        self.0.borrow_mut().discretes(clock::since_power_on()).1
    }
}

/// What watches the supply.
pub struct Watched {
    plant: Rc<RefCell<Plant>>,
    /// Dips before this start.
    before: u16,
}

impl Watched {
    /// It counts from now on.
    pub fn new(plant: &Rc<RefCell<Plant>>) -> Self {
        Watched {
            plant: plant.clone(),
            before: plant.borrow().supply_dips(),
        }
    }
}

impl Supply for Watched {
    fn dips(&self) -> u16 {
        self.plant.borrow().supply_dips().saturating_sub(self.before)
    }
}

/// The watchdog: when it was last fed.
#[derive(Clone, Default)]
pub struct Fed(pub Rc<Cell<Nanos>>);

impl Watchdog for Fed {
    fn feed(&mut self) {
        self.0.set(clock::since_power_on());
    }
}

/// Memory that survives a reset of the host board.
#[derive(Clone)]
pub struct Kept(Rc<RefCell<[u8; RETAINED_BYTES]>>);

impl Default for Kept {
    fn default() -> Self {
        Kept(Rc::new(RefCell::new([0; RETAINED_BYTES])))
    }
}

impl Kept {
    /// A bit flips, counted round the bytes that are kept.
    pub fn flip(&self, bit: u32) {
        let bit = bit as usize % (8 * RETAINED_BYTES);
        self.0.borrow_mut()[bit / 8] ^= 1 << (bit % 8);
    }

    /// What a power cut leaves.
    pub fn lose(&self) {
        self.0.borrow_mut().fill(0);
    }
}

impl Retained for Kept {
    fn read(&self, at: usize, bytes: &mut [u8]) {
        bytes.copy_from_slice(&self.0.borrow()[at..at + bytes.len()]);
    }

    fn write(&self, at: usize, bytes: &[u8]) {
        self.0.borrow_mut()[at..at + bytes.len()].copy_from_slice(bytes);
    }
}
