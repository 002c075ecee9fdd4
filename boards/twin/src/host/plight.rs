//! What befalls the processor and its ends on the host board, and how often it did.

use std::cell::{Cell, RefCell};

use super::clock;
use crate::{
    fault::Struck,
    run::{End, Fault},
};

/// Bytes of the firmware's image, which is no more than something to read.
const IMAGE_BYTES: usize = 4096;

thread_local! {
    static IMAGE: RefCell<[u8; IMAGE_BYTES]> = const { RefCell::new([0; IMAGE_BYTES]) };
}

/// Reads a piece of the image.
pub fn read_image(at: usize, piece: &mut [u8]) -> usize {
    IMAGE.with_borrow(|image| {
        let there = image.get(at..).unwrap_or_default();
        let count = there.len().min(piece.len());
        piece[..count].copy_from_slice(&there[..count]);
        count
    })
}

/// The state the ends are in.
#[derive(Default)]
pub struct Plight {
    dma_hung: Cell<bool>,
    hang: Cell<Option<End>>,
    telemetry_stuck: Cell<bool>,
    umbilical_stuck: Cell<bool>,
    slow: Cell<u32>,
    umbilical_noise: Cell<bool>,
    umbilical_break: Cell<bool>,
    struck: RefCell<Struck>,
}

impl Plight {
    /// Takes a fault of the processor or its ends; whether it was one.
    pub fn apply(&self, fault: Fault) -> bool {
        match fault {
            Fault::DmaHung => self.dma_hung.set(true),
            Fault::Hang(end) => self.hang.set(Some(end)),
            Fault::TelemetryStuck(stuck) => self.telemetry_stuck.set(stuck),
            Fault::UmbilicalStuck(stuck) => self.umbilical_stuck.set(stuck),
            Fault::LinesSlow(times) => self.slow.set(times),
            Fault::UmbilicalNoise(noise) => self.umbilical_noise.set(noise),
            Fault::UmbilicalBreak(held) => self.umbilical_break.set(held),
            Fault::ImageFlip(bit) => {
                let bit = bit as usize % (8 * IMAGE_BYTES);
                IMAGE.with_borrow_mut(|image| image[bit / 8] ^= 1 << (bit % 8));
                self.strike("image-flip");
            }
            Fault::Busy(duration) => {
                clock::spend(duration);
                self.strike("busy");
            }
            Fault::ClockSteps(by_us) => {
                clock::step(by_us);
                self.strike("clock-step");
            }
            _ => return false,
        }
        true
    }

    /// Flashes the image anew.
    pub fn flash(&self) {
        IMAGE.with_borrow_mut(|image| image.fill(0xA5));
    }

    /// A reset frees the processor.
    pub fn reset(&self) {
        self.dma_hung.set(false);
        self.hang.set(None);
    }

    /// The processor serves an end.
    pub fn serve(&self, end: End) {
        if self.hang.get() == Some(end) {
            self.strike("hang");
            clock::hang();
        }
    }

    /// Whether the sensor bus' DMA stands still, asked by a transfer.
    pub fn dma_hangs(&self) -> bool {
        if self.dma_hung.get() {
            self.strike("dma-hung");
        }
        self.dma_hung.get()
    }

    /// Whether a line takes no byte.
    pub fn is_stuck(&self, end: End) -> bool {
        let (stuck, name) = match end {
            End::Telemetry => (self.telemetry_stuck.get(), "telemetry-stuck"),
            _ => (self.umbilical_stuck.get(), "umbilical-stuck"),
        };
        if stuck {
            self.strike(name);
        }
        stuck
    }

    /// How many times as long a byte takes on a line.
    pub fn slowness(&self) -> u64 {
        if self.slow.get() > 1 {
            self.strike("lines-slow");
        }
        self.slow.get().max(1).into()
    }

    /// Whether a byte that arrives on the umbilical is damaged.
    pub fn is_noisy(&self) -> bool {
        if self.umbilical_noise.get() {
            self.strike("umbilical-noise");
        }
        self.umbilical_noise.get()
    }

    /// Whether the umbilical towards the unit is held low.
    pub fn is_held_low(&self) -> bool {
        self.umbilical_break.get()
    }

    /// Counts a strike.
    pub fn strike(&self, name: &'static str) {
        *self.struck.borrow_mut().entry(name).or_default() += 1;
    }

    /// How often each fault did something.
    pub fn struck(&self) -> Struck {
        self.struck.borrow().clone()
    }
}
