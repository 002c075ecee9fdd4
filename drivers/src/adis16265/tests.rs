extern crate std;
use std::{vec, vec::Vec};

use embassy_futures::block_on;
use embedded_hal_async::spi::{ErrorKind, ErrorType, Operation};
use embedded_hal_mock::eh1::delay::{CheckedDelay, NoopDelay, Transaction as Wait};
use embedded_hal_mock::eh1::spi::{Mock, Transaction as T};

use super::*;

/// Frames as (sent, answered). Runs `act` on a part of which nothing is known.
pub(super) fn with<R>(frames: &[(u16, u16)], act: impl AsyncFnOnce(&mut Adis16265<Mock<u16>, NoopDelay>) -> R) -> R {
    let frame = |&(sent, answered)| {
        let transfer = T::transfer_in_place(vec![sent], vec![answered]);
        [T::transaction_start(), transfer, T::transaction_end()]
    };
    let mut mock = Mock::new(&frames.iter().flat_map(frame).collect::<Vec<_>>());
    let result = block_on(act(&mut Adis16265::new(mock.clone(), NoopDelay::new())));
    mock.done();
    result
}

pub(super) const ID: u16 = 0x3F89;

fn not_a_gyro<T>(read: u16) -> Result<T, Error<ErrorKind>> {
    Err(Error::WrongIdentity {
        register: PROD_ID,
        expected: ID,
        read,
    })
}

#[test]
fn outputs_are_sign_extended_and_their_flags_told() {
    let check = |output: Output, counts, fresh, alarm| {
        assert_eq!(output, Output { counts, fresh, alarm });
    };
    check(Output::rate(0x9FFF), 8191, true, false);
    check(Output::rate(0xA000), -8192, true, false);
    check(Output::rate(0x7FFF), -1, false, true);
    check(Output::rate(0x889B), 2203, true, false);
    check(Output::temperature(0x87FF), 2047, true, false);
    // Bits 13 and 12 of a 12-bit output are not defined.
    check(Output::temperature(0x3800), -2048, false, false);
    check(Output::temperature(0xCFFC), -4, true, true);
}

#[test]
fn the_answer_comes_one_frame_after_its_request() {
    let frames = [(0x0400, 0x1234), (0x0C00, 0x889B), (0x5600, 0x800C), (0x5600, ID)];
    let read = with(&frames, async |gyro| gyro.read_rate_and_temperature().await);
    assert_eq!(read, Ok((Output::rate(0x889B), Output::temperature(0x800C))));
}

#[test]
fn a_reading_checks_the_identity_that_the_one_before_asked_for() {
    let frames = [
        (0x0400, 0),
        (0x5600, 0x8001),
        (0x5600, ID),
        (0x0400, ID),
        (0x5600, 0x8002),
        (0x0400, 0x5555),
        // After a wrong identity the next reading proves itself.
        (0x0400, 0x8003),
        (0x5600, 0x8004),
        (0x5600, 0x5556),
    ];
    with(&frames, async |gyro| {
        assert_eq!(gyro.read_rate().await.map(|r| r.counts), Ok(1));
        assert_eq!(gyro.read_rate().await.map(|r| r.counts), Ok(2));
        assert_eq!(gyro.read_rate().await, not_a_gyro(0x5555));
        assert_eq!(gyro.read_rate().await, not_a_gyro(0x5556));
    });
}

#[test]
fn a_held_line_is_not_a_gyro_but_a_still_one_is() {
    let read_rate = |word, identity| {
        let frames = [(0x0400, word), (0x5600, word), (0x5600, identity)];
        with(&frames, async |gyro| gyro.read_rate().await)
    };
    assert_eq!(read_rate(0x0000, 0x0000), not_a_gyro(0x0000));
    assert_eq!(read_rate(0xFFFF, 0xFFFF), not_a_gyro(0xFFFF));
    assert_eq!(read_rate(0x0000, ID), Ok(Output::rate(0)));
    assert_eq!(read_rate(0xFFFF, ID), Ok(Output::rate(0xFFFF)));
}

#[test]
fn frames_can_be_pipelined_by_the_caller() {
    with(
        &[(0x0400, 0), (0x0400, 0x8001), (0x5600, 0x8002), (0x0400, ID)],
        async |gyro| {
            gyro.exchange(GYRO_OUT).await.unwrap();
            assert_eq!(gyro.exchange(GYRO_OUT).await, Ok(0x8001));
            assert_eq!(gyro.exchange(PROD_ID).await, Ok(0x8002));
            gyro.exchange(GYRO_OUT).await.unwrap();
        },
    );
}

#[test]
fn settings_are_written_bytewise_and_read_back() {
    let config = Config {
        range: Range::DegPerS160,
        sample_rate: SampleRate::Hz2048,
        narrow: true,
        taps_log2: 3,
    };
    let configure = |sens_avg| {
        let probe = [(0x5600, 0), (0x5600, ID)];
        let writes = [(0xB600, ID), (0xB902, 0), (0xB883, 0)];
        let reads = [(0x3600, 0), (0x5600, 0x0000), (0x3800, ID), (0x5600, sens_avg)];
        let frames = [&probe[..], &writes, &reads].concat();
        with(&frames, async |gyro| gyro.configure(config).await)
    };
    assert_eq!(configure(0x0283), Ok(()));
    let (register, wrote, read) = (SENS_AVG, 0x0283, 0x0402);
    assert_eq!(configure(0x0402), Err(Error::NotKept { register, wrote, read }));
    assert_eq!(Config::default().sens_avg(), 0x0400);
}

#[test]
fn a_probe_does_not_hold_an_older_answer_against_the_part() {
    let frames = [(0x5600, 0), (0x5600, ID), (0x5600, 0), (0x5600, ID)];
    with(&frames, async |gyro| {
        assert_eq!(gyro.probe().await, Ok(()));
        assert_eq!(gyro.probe().await, Ok(()));
    });
}

struct Dead;

impl ErrorType for Dead {
    type Error = ErrorKind;
}

impl SpiDevice<u16> for Dead {
    async fn transaction(&mut self, _: &mut [Operation<'_, u16>]) -> Result<(), ErrorKind> {
        Err(ErrorKind::Other)
    }
}

#[test]
fn the_stall_time_precedes_every_frame_and_a_bus_error_names_the_register() {
    let mut stall = CheckedDelay::new(&[Wait::async_delay_us(STALL_US)]);
    let read = block_on(Adis16265::new(Dead, stall.clone()).read_rate());
    assert_eq!(read, Err(Error::Bus(GYRO_OUT, ErrorKind::Other)));
    stall.done();
}
