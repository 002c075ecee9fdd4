//! TCA9548A: one I2C bus shared by the plates, one channel a plate.
//!
//! In: transactions of a plate's parts. Out: the same transactions on the shared bus, after a write to the control
//! register wherever another channel, or none that is known, is selected. Source: Texas Instruments SCPS207, section
//! 8.5.4: one byte, bit `n` connects channel `n`; a channel is connected after the STOP of that write, so the selection
//! is a transaction of its own.
//!
//! What is selected is known only while every transaction succeeds: a failed or abandoned one makes it unknown, since the
//! part may have been reset, and the next transaction selects again.
//!
//! ```
//! use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
//! use emems_drivers::{tca9548a::{self, Switch}, tmp102::{self, Tmp102}};
//!
//! # embassy_futures::block_on(async {
//! let start = || Transaction::transaction_start(tmp102::ADDRESS);
//! let end = || Transaction::transaction_end(tmp102::ADDRESS);
//! // On a board this is the I2C of its HAL.
//! let mut bus = Mock::new(&[
//!     Transaction::write(tca9548a::ADDRESS, vec![1 << 3]),
//!     start(),
//!     Transaction::write(tmp102::ADDRESS, vec![0x00]),
//!     Transaction::read(tmp102::ADDRESS, vec![0x19, 0x00]),
//!     end(),
//! ]);
//! let switch = Switch::new(bus.clone());
//! // A channel is a bus of its own for every driver.
//! assert_eq!(Tmp102::new(switch.channel(3)).read().await, Ok(400));
//! # bus.done();
//! # });
//! ```

use core::fmt;

use embassy_sync::{blocking_mutex::raw::NoopRawMutex, mutex::Mutex};
use embedded_hal_async::i2c::{ErrorKind, ErrorType, I2c, Operation};

/// Bus address with A2, A1, A0 low.
pub const ADDRESS: u8 = 0x70;

/// Frees a bus on which a transfer was abandoned.
///
/// A dropped transfer leaves the STM32F4's I2C peripheral with a pending START and never recovers by itself
/// (RM0090 section 27.6.1, SWRST). After `recover` the peripheral is reset and configured
/// again, up to nine SCL pulses have freed a slave that held SDA (I2C specification UM10204, section 3.1.16), and the
/// TCA9548A's reset line has been pulsed, so no channel is selected.
#[allow(async_fn_in_trait)]
pub trait RecoverBus {
    /// Takes at most 1 ms; says whether both lines are high afterwards.
    async fn recover(&mut self) -> bool;
}

/// The bus and what is known of the control register.
struct Shared<I2C> {
    bus: I2C,
    /// Content of the control register; `None` when unknown.
    control: Option<u8>,
}

/// The multiplexer and the bus it sits on.
pub struct Switch<I2C> {
    shared: Mutex<NoopRawMutex, Shared<I2C>>,
}

impl<I2C> Switch<I2C> {
    /// Takes the bus. Nothing is sent; which channel is selected is unknown.
    pub fn new(bus: I2C) -> Self {
        Switch {
            shared: Mutex::new(Shared { bus, control: None }),
        }
    }

    /// The bus behind channel `number` (0 to 7; higher ones wrap), as if its parts were alone.
    pub fn channel(&self, number: u8) -> Channel<'_, I2C> {
        Channel {
            switch: self,
            control: 1 << (number & 7),
        }
    }

    /// Whether a transaction or a recovery is under way.
    pub fn is_held(&self) -> bool {
        self.shared.try_lock().is_err()
    }

    /// Makes the next transaction select its channel again: to be called when something else has reset the part.
    pub async fn forget(&self) {
        self.shared.lock().await.control = None;
    }
}

impl<I2C: I2c> Switch<I2C> {
    /// Reads the control register. A part that answers, but not with what was selected last, has been reset: that is an
    /// error once, and from then on the selection is unknown.
    pub async fn probe(&self) -> Result<(), Error<I2C::Error>> {
        let mut shared = self.shared.lock().await;
        let known = shared.control.take();
        let mut control = [0];
        shared.bus.read(ADDRESS, &mut control).await.map_err(Error::Select)?;
        match known {
            Some(wrote) if wrote != control[0] => Err(Error::NotKept {
                wrote,
                read: control[0],
            }),
            _ => {
                shared.control = known;
                Ok(())
            }
        }
    }
}

impl<I2C: RecoverBus> Switch<I2C> {
    /// Frees the bus ([`RecoverBus::recover`]), which also resets this part; says whether both lines are high afterwards.
    pub async fn recover(&self) -> bool {
        let mut shared = self.shared.lock().await;
        shared.control = None;
        shared.bus.recover().await
    }
}

/// One channel of a [`Switch`]: an I2C bus of its own.
pub struct Channel<'a, I2C> {
    switch: &'a Switch<I2C>,
    control: u8,
}

impl<I2C: ErrorType> ErrorType for Channel<'_, I2C> {
    type Error = Error<I2C::Error>;
}

impl<I2C: I2c> I2c for Channel<'_, I2C> {
    async fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), Self::Error> {
        let mut shared = self.switch.shared.lock().await;
        // Taken, not read: if this future is dropped at an await below, the selection stays unknown.
        if shared.control.take() != Some(self.control) {
            shared
                .bus
                .write(ADDRESS, &[self.control])
                .await
                .map_err(Error::Select)?;
        }
        shared.bus.transaction(address, operations).await.map_err(Error::Part)?;
        shared.control = Some(self.control);
        Ok(())
    }
}

/// Why a transaction through the multiplexer failed.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Error<E> {
    /// The multiplexer itself did not answer: no part of any plate can be reached.
    Select(E),
    /// The part behind the selected channel failed.
    Part(E),
    /// The control register had lost its content.
    NotKept {
        /// Selected last.
        wrote: u8,
        /// Found.
        read: u8,
    },
}

/// By hand, in the words of a derived one: that would bring core's pretty printer into the image, which is a kilobyte.
impl<E: fmt::Debug> fmt::Debug for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Select(e) => write!(f, "Select({e:?})"),
            Error::Part(e) => write!(f, "Part({e:?})"),
            Error::NotKept { wrote, read } => write!(f, "NotKept {{ wrote: {wrote}, read: {read} }}"),
        }
    }
}

impl<E: embedded_hal_async::i2c::Error> embedded_hal_async::i2c::Error for Error<E> {
    fn kind(&self) -> ErrorKind {
        match self {
            Error::Select(e) | Error::Part(e) => e.kind(),
            Error::NotKept { .. } => ErrorKind::Other,
        }
    }
}

impl<E: fmt::Debug> fmt::Display for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Select(e) => write!(
                f,
                "TCA9548A at 0x{ADDRESS:02X}: bus error {e:?}; no plate can be reached: check its supply, RESET and the bus"
            ),
            Error::Part(e) => write!(f, "behind the TCA9548A: {e:?}"),
            Error::NotKept { wrote, read } => write!(
                f,
                "TCA9548A: control register holds 0x{read:02X}, selected was 0x{wrote:02X}: it was reset; selecting again"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use core::{
        future::{Future, pending},
        pin::pin,
        task::{Context, Waker},
    };
    use std::{string::ToString, vec};

    use embassy_futures::block_on;
    use embedded_hal_async::i2c::{Error as _, NoAcknowledgeSource};
    use embedded_hal_mock::eh1::i2c::{Mock, Transaction};

    use super::*;

    const NACK: ErrorKind = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);

    /// A write of one byte as [`Channel`] passes it on: a transaction of one operation.
    fn part_write(byte: u8) -> [Transaction; 3] {
        [
            Transaction::transaction_start(0x18),
            Transaction::write(0x18, vec![byte]),
            Transaction::transaction_end(0x18),
        ]
    }

    fn select(control: u8) -> Transaction {
        Transaction::write(0x70, vec![control])
    }

    #[test]
    fn the_control_register_is_written_only_when_the_channel_changes() {
        let expected = [
            &[select(0b0001)][..],
            &part_write(1),
            &part_write(2),
            &[select(0b1000)],
            &part_write(3),
            &[select(0b0001)],
            &part_write(4),
        ]
        .concat();
        let mut mock = Mock::new(&expected);
        let switch = Switch::new(mock.clone());
        let (mut first, mut last) = (switch.channel(0), switch.channel(3));
        block_on(async {
            first.write(0x18, &[1]).await.unwrap();
            first.write(0x18, &[2]).await.unwrap();
            last.write(0x18, &[3]).await.unwrap();
            first.write(0x18, &[4]).await.unwrap();
        });
        mock.done();
    }

    #[test]
    fn a_failed_select_is_told_apart_and_the_part_is_not_addressed() {
        let expected = [&[select(4).with_error(NACK), select(4)][..], &part_write(1)].concat();
        let mut mock = Mock::new(&expected);
        let switch = Switch::new(mock.clone());
        let mut plate = switch.channel(2);
        let error = block_on(plate.write(0x18, &[1])).unwrap_err();
        assert_eq!(error, Error::Select(NACK));
        assert_eq!(error.kind(), NACK);
        assert!(error.to_string().starts_with("TCA9548A at 0x70: "), "{error}");
        block_on(plate.write(0x18, &[1])).unwrap();
        mock.done();
    }

    #[test]
    fn forgetting_makes_the_next_transaction_select_again() {
        let expected = [&[select(1)][..], &part_write(1), &[select(1)], &part_write(2)].concat();
        let mut mock = Mock::new(&expected);
        let switch = Switch::new(mock.clone());
        let mut plate = switch.channel(0);
        block_on(async {
            plate.write(0x18, &[1]).await.unwrap();
            switch.forget().await;
            plate.write(0x18, &[2]).await.unwrap();
        });
        mock.done();
    }

    #[test]
    fn a_probe_finds_a_multiplexer_that_was_reset() {
        let expected = [
            &[Transaction::read(0x70, vec![0x80]), select(1)][..],
            &part_write(1),
            &[Transaction::read(0x70, vec![1]), Transaction::read(0x70, vec![0])],
            &[select(1)],
            &part_write(2),
        ]
        .concat();
        let mut mock = Mock::new(&expected);
        let switch = Switch::new(mock.clone());
        let mut plate = switch.channel(0);
        block_on(async {
            assert_eq!(
                switch.probe().await,
                Ok(()),
                "nothing was selected yet, so any content will do"
            );
            plate.write(0x18, &[1]).await.unwrap();
            assert_eq!(switch.probe().await, Ok(()));
            let error = switch.probe().await.unwrap_err();
            assert_eq!(error, Error::NotKept { wrote: 1, read: 0 });
            assert!(error.to_string().contains("holds 0x00, selected was 0x01"), "{error}");
            plate.write(0x18, &[2]).await.unwrap();
        });
        mock.done();
    }

    /// A bus that counts selections, fails the transaction with part 0x19 and never finishes the one with 0x1E.
    #[derive(Default)]
    struct Faulty {
        selections: usize,
        recoveries: usize,
    }

    impl ErrorType for Faulty {
        type Error = ErrorKind;
    }

    impl I2c for Faulty {
        async fn transaction(&mut self, address: u8, _: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
            match address {
                ADDRESS => self.selections += 1,
                0x19 => return Err(NACK),
                0x1E => pending().await,
                _ => {}
            }
            Ok(())
        }
    }

    impl RecoverBus for Faulty {
        async fn recover(&mut self) -> bool {
            self.recoveries += 1;
            true
        }
    }

    #[test]
    fn a_failed_or_abandoned_transaction_or_a_recovery_makes_the_next_one_select_again() {
        let switch = Switch::new(Faulty::default());
        let mut plate = switch.channel(0);
        let selections_after_a_good_one = || {
            block_on(switch.channel(0).write(0x18, &[0])).unwrap();
            block_on(switch.shared.lock()).bus.selections
        };
        assert_eq!(selections_after_a_good_one(), 1);
        assert_eq!(selections_after_a_good_one(), 1);

        assert_eq!(block_on(plate.write(0x19, &[0])), Err(Error::Part(NACK)));
        assert_eq!(selections_after_a_good_one(), 2);

        {
            let mut timed_out = pin!(plate.write(0x1E, &[0]));
            let mut context = Context::from_waker(Waker::noop());
            assert!(timed_out.as_mut().poll(&mut context).is_pending());
        }
        assert_eq!(selections_after_a_good_one(), 3);

        assert!(block_on(switch.recover()));
        assert_eq!(selections_after_a_good_one(), 4);
        assert_eq!(block_on(switch.shared.lock()).bus.recoveries, 1);
    }
}
