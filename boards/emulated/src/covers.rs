//! Two defects of rigless 0.4.0, and what the stand does about each just before the model sees an access or event.
//!
//! In: register files. Out: the same with what the silicon would have there. Tests switch each cover off and show what
//! goes wrong: here for the timer's flags, with the image for bytes and packets.

use rigless::{
    device::RegisterFile,
    soc::stm32f427::generated::{dma2, i2c3, tim5},
};

/// `DR` of I2C1 (RM0090 table 1 and 27.6.5), by which a DMA stream is known to serve it.
const I2C1_DR: u64 = 0x4000_5410;

/// Which of the emulator's two defects are covered. Both are by default; a run without one is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Covers {
    /// rigless stores `I2C_CR2.LAST` and does not act on it (its i2c.rs says so): the controller clocks one byte too
    /// many, and every later DMA read is shifted by one byte.
    pub i2c_last: bool,
    /// rigless raises `CC1IF` to `CC4IF` when `EGR.UG` reinitialises a stopped timer whose compare registers are 0;
    /// embassy's time driver then counts half a period (32768 ticks) that did not happen.
    pub timer_update: bool,
}

impl Default for Covers {
    fn default() -> Self {
        Covers {
            i2c_last: true,
            timer_update: true,
        }
    }
}

/// Whether the byte on the wire is the last that a DMA stream takes, and is to be refused an acknowledge.
pub fn one_byte_is_left(i2c1: &RegisterFile, dma1: &RegisterFile) -> bool {
    let control = i2c1.get(i2c3::Register::Cr2);
    i2c3::cr2::LAST.is_set(control)
        && i2c3::cr2::DMAEN.is_set(control)
        && STREAMS.iter().any(|stream| stream.serves_last_byte(dma1))
}

/// Clears the matches of a timer whose counter stands still.
pub fn forget_spurious_matches(timer: &mut RegisterFile) {
    if !tim5::cr1::CEN.is_set(timer.get(tim5::Register::Cr1)) {
        // CC1IF to CC4IF, RM0090 18.4.5.
        let status = timer.get(tim5::Register::Sr) & !0b1_1110;
        timer.set(tim5::Register::Sr, status);
    }
}

/// The registers of one stream of a DMA controller.
struct Stream {
    control: dma2::Register,
    count: dma2::Register,
    peripheral: dma2::Register,
}

impl Stream {
    fn serves_last_byte(&self, registers: &RegisterFile) -> bool {
        // S0CR.EN is bit 0 of every stream's control register, RM0090 10.5.5.
        registers.get(self.control) & 1 == 1
            && registers.get(self.peripheral) == I2C1_DR
            && registers.get(self.count) == 1
    }
}

/// The two streams a request of I2C1_RX can reach, RM0090 table 42: 0 and 5 of DMA1, channel 1.
const STREAMS: [Stream; 2] = [
    Stream {
        control: dma2::Register::S0cr,
        count: dma2::Register::S0ndtr,
        peripheral: dma2::Register::S0par,
    },
    Stream {
        control: dma2::Register::S5cr,
        count: dma2::Register::S5ndtr,
        peripheral: dma2::Register::S5par,
    },
];

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rigless::{mcu::Operate, soc::Width, time::VirtualNanos};
    use twin::{motion, plant::Plant};

    use super::Covers;
    use crate::{chips::SharedPlant, stand::Stand};

    const NOW: VirtualNanos = VirtualNanos(1_000);
    const RCC_APB1ENR: u64 = 0x4002_3840;
    const TIM5_EGR: u64 = 0x4000_0C14;
    const TIM5_SR: u64 = 0x4000_0C10;
    /// CC1IF to CC4IF.
    const MATCHES: u64 = 0x1E;

    fn matches_after_update(covers: Covers) -> u64 {
        let still = motion::by_name("still").expect("the twin has it");
        let plant = SharedPlant::new(Plant::ideal(Arc::from(still)));
        let mut mcu = Stand::new(plant, covers).expect("rigless' own description").mcu;
        for (address, value) in [(RCC_APB1ENR, 1 << 3), (TIM5_EGR, 1)] {
            mcu.write(NOW, address, Width::W32, value)
                .expect("a register of the part");
        }
        mcu.read(NOW, TIM5_SR, Width::W32).expect("a register of the part") & MATCHES
    }

    #[test]
    fn a_stopped_timer_that_is_updated_has_matched_nothing() {
        assert_eq!(matches_after_update(Covers::default()), 0);
    }

    #[test]
    fn without_the_cover_it_has_matched_all_four() {
        let bare = Covers {
            timer_update: false,
            ..Covers::default()
        };
        assert_eq!(matches_after_update(bare), MATCHES);
    }
}
