extern crate std;
use std::{vec, vec::Vec};

use embassy_futures::block_on;
use embedded_hal_async::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::{
    delay::NoopDelay,
    i2c::{Mock, Transaction},
};

use super::*;

const FAST_24G: Config = Config {
    full_scale: FullScale::G24,
    rate: Rate::Hz1000,
};

fn with<T>(expected: &[Transaction], act: impl AsyncFnOnce(&mut Lis331hh<Mock>) -> T) -> T {
    let mut mock = Mock::new(expected);
    let result = block_on(act(&mut Lis331hh::new(mock.clone())));
    mock.done();
    result
}

fn whoami(answer: u8) -> Transaction {
    Transaction::write_read(0x18, vec![0x8F], vec![answer])
}

fn settings(kept: [u8; 5]) -> Transaction {
    Transaction::write_read(0x18, vec![0xA0], kept.to_vec())
}

fn sample(bytes: [u8; 7]) -> Transaction {
    Transaction::write_read(0x18, vec![0xA7], bytes.to_vec())
}

fn configuration(wrote: [u8; 5], kept: [u8; 5]) -> Vec<Transaction> {
    let write = Transaction::write(0x18, [&[0xA0][..], &wrote].concat());
    vec![whoami(0x32), write, settings(kept)]
}

#[test]
fn settings_are_written_in_one_transaction_and_read_back() {
    let check = |config, wrote| {
        let result = with(&configuration(wrote, wrote), async |part| part.configure(config).await);
        assert_eq!(result, Ok(()));
    };
    check(Config::default(), [0x27, 0, 0, 0x80, 0]);
    check(FAST_24G, [0x3F, 0, 0, 0xB0, 0]);
}

#[test]
fn a_high_pass_filter_left_on_is_an_error() {
    let expected = configuration([0x27, 0, 0, 0x80, 0], [0x27, 0x10, 0, 0x80, 0]);
    let error = with(&expected, async |part| part.configure(Config::default()).await).unwrap_err();
    let (register, wrote, read) = (CTRL_REG2, 0, 0x10);
    assert_eq!(error, Error::NotKept { register, wrote, read });
}

#[test]
fn verify_finds_a_part_that_restarted() {
    // Power-on values (datasheet section 6): power-down, 50 Hz, axes on.
    let power_on = settings([0x07, 0, 0, 0, 0]);
    let error = with(&[power_on], async |part| part.verify(FAST_24G).await).unwrap_err();
    let (register, wrote, read) = (CTRL_REG1, 0x3F, 0x07);
    assert_eq!(error, Error::NotKept { register, wrote, read });
}

#[test]
fn another_part_is_refused_by_its_identity_and_not_written_to() {
    let error = with(&[whoami(0x33)], async |part| part.configure(FAST_24G).await).unwrap_err();
    let wrong = Error::WrongIdentity {
        register: WHO_AM_I,
        expected: 0x32,
        read: 0x33,
    };
    assert_eq!(error, wrong);
}

#[test]
fn a_sample_is_right_justified_and_keeps_its_sign() {
    let check = |bytes, counts, fresh, overrun| {
        let read = with(&[sample(bytes)], async |part| part.read().await).unwrap();
        assert_eq!((read.counts, read.fresh, read.overrun), (counts, fresh, overrun));
    };
    // The first row of thesis table 4.7, plate 1: -315, 2, -98.
    check([0x0F, 0x50, 0xEC, 0x20, 0x00, 0xE0, 0xF9], [-315, 2, -98], true, false);
    check(
        [0xFF, 0x00, 0x80, 0xF0, 0x7F, 0xF0, 0xFF],
        [-2048, 2047, -1],
        true,
        true,
    );
    check([0x00, 0, 0, 0, 0, 0, 0], [0, 0, 0], false, false);
    // The flags of single axes do not stand for the set.
    check([0x77, 0x10, 0, 0, 0, 0, 0], [1, 0, 0], false, false);
}

#[test]
fn a_word_with_low_bits_set_is_garbage() {
    let check = |bytes, register, read| {
        let error = with(&[sample(bytes)], async |part| part.read().await).unwrap_err();
        assert_eq!(error, Error::Garbage { register, read });
    };
    check([0xFF; 7], OUT_X, 0xFFFF);
    check([0x0F, 0x50, 0xEC, 0x21, 0x00, 0xE0, 0xF9], OUT_Y, 0x0021);
    check([0x0F, 0x50, 0xEC, 0x20, 0x00, 0xE8, 0xF9], OUT_Z, 0xF9E8);
}

#[test]
fn a_part_that_does_not_acknowledge_is_a_bus_error() {
    let nack = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    let silent = sample([0; 7]).with_error(nack);
    let error = with(&[silent], async |part| part.read().await).unwrap_err();
    assert_eq!(error, Error::Bus(STATUS_REG, nack));
}

/// Self-test of a part that a user of it measured (157, 96, 455 counts), with z as given.
fn self_test(z: i16) -> Result<[i16; 3], Error<ErrorKind>> {
    let bytes = |counts: [i16; 3]| {
        let [[xl, xh], [yl, yh], [zl, zh]] = counts.map(|c| (c << 4).to_le_bytes());
        sample([0x0F, xl, xh, yl, yh, zl, zh])
    };
    let mut expected = vec![
        Transaction::write(0x18, vec![0x23, 0x80]),
        bytes([20, 35, 373]),
        Transaction::write(0x18, vec![0x23, 0x82]),
        bytes([177, 131, 373 + z]),
    ];
    expected.extend(configuration([0x3F, 0, 0, 0xB0, 0], [0x3F, 0, 0, 0xB0, 0]));
    let mut delay = NoopDelay::new();
    with(&expected, async |part| part.self_test(FAST_24G, &mut delay).await)
}

#[test]
fn self_test_judges_each_axis_and_restores_the_settings() {
    assert_eq!(self_test(300), Ok([157, 96, 300]));
    let too_far = Error::SelfTest {
        register: OUT_Z,
        change: 455,
        limits: (220, 370),
    };
    assert_eq!(self_test(455), Err(too_far));
}
