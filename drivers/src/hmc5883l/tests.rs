extern crate std;
use std::{vec, vec::Vec};

use embassy_futures::block_on;
use embedded_hal_async::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::i2c::{Mock, Transaction as T};

use super::*;

/// Runs `act` on a part whose settings were in force before.
pub(super) fn with<R>(expected: &[Vec<T>], act: impl AsyncFnOnce(&mut Hmc5883l<Mock>) -> R) -> R {
    let mut mock = Mock::new(&expected.concat());
    let mut part = Hmc5883l::new(mock.clone());
    part.withhold = false;
    let result = block_on(act(&mut part));
    mock.done();
    result
}

fn reads(first: u8, bytes: &[u8], data: [u8; 6]) -> Vec<T> {
    vec![
        T::transaction_start(0x1E),
        T::write(0x1E, vec![first]),
        T::read(0x1E, bytes.to_vec()),
        T::write(0x1E, vec![0x03]),
        T::read(0x1E, data.to_vec()),
        T::transaction_end(0x1E),
    ]
}

pub(super) fn set(status: u8, data: [u8; 6]) -> Vec<T> {
    reads(0x09, &[status], data)
}

fn identity(bytes: &[u8; 3]) -> Vec<T> {
    vec![T::write_read(0x1E, vec![0x0A], bytes.to_vec())]
}

pub(super) fn writes([a, b, mode]: [u8; 3]) -> Vec<T> {
    vec![
        T::transaction_start(0x1E),
        T::write(0x1E, vec![0x00, a, b, mode]),
        T::transaction_end(0x1E),
    ]
}

pub(super) fn configuration(wrote: [u8; 3], kept: [u8; 3]) -> Vec<T> {
    [identity(b"H43"), writes(wrote), reads(0x00, &kept, [0; 6])].concat()
}

#[test]
fn registers_come_as_x_z_y_and_leave_as_x_y_z() {
    let check = |data, counts, overflow| {
        let sample = with(&[set(0x01, data)], async |part| part.read().await);
        let ready = true;
        assert_eq!(
            sample,
            Ok(Some(Sample {
                counts,
                overflow,
                ready
            }))
        );
    };
    check([0x00, 0x78, 0xFF, 0x2E, 0xFF, 0xDD], [120, -35, -210], [false; 3]);
    check([0xF8, 0x00, 0x07, 0xFF, 0xFF, 0xFF], [-2048, -1, 2047], [false; 3]);
    check(
        [0x00, 0x01, 0xF0, 0x00, 0x00, 0x02],
        [1, 2, -4096],
        [false, false, true],
    );
}

#[test]
fn a_code_beyond_twelve_bits_is_garbage() {
    let garbage = set(0x01, [0x00, 0x01, 0x00, 0x01, 0x08, 0x00]);
    let (register, read) = (DATA_Y, 0x0800);
    let result = with(&[garbage], async |part| part.read().await);
    assert_eq!(result, Err(Error::Garbage { register, read }));
}

#[test]
fn a_lock_left_by_a_partial_reading_is_opened_and_the_held_set_not_used() {
    let (held, new) = ([0, 1, 0, 1, 0, 1], [0, 2, 0, 2, 0, 2]);
    let sample = with(&[set(0x03, held), set(0x00, new)], async |part| part.read().await);
    let sample = sample.unwrap().unwrap();
    assert_eq!((sample.counts, sample.ready), ([2; 3], false));

    let stuck = with(&[set(0x03, held), set(0x03, held)], async |part| part.read().await);
    let (register, read) = (STATUS, 3);
    assert_eq!(stuck, Err(Error::Stuck { register, read }));
}

#[test]
fn the_first_set_after_configuring_is_withheld() {
    let wrote = [0x78, 0xA0, 0x00];
    let (gain, rate, average) = (Gain::PerGauss390, Rate::Hz75, Average::Of8);
    let config = Config {
        gain,
        rate,
        average,
        ..Config::default()
    };
    let expected = [configuration(wrote, wrote), set(0x01, [0; 6]), set(0x01, [0; 6])];
    with(&expected, async |part| {
        part.configure(config).await.unwrap();
        assert_eq!(part.read().await, Ok(None));
        assert!(part.read().await.unwrap().is_some());
    });
}

fn asked() -> Config {
    let mode = Mode::Asked;
    Config {
        mode,
        ..Config::default()
    }
}

/// Its outputs show the newest measurement until the next one: a second reading before that has the same set, which is as good.
/// The same goes for one that was asked before and measures by itself now.
#[test]
fn a_part_that_measures_by_itself_is_ready_as_often_as_it_is_read() {
    let (first, then) = ([0x18, 0x20, 0x01], [0x18, 0x20, 0x00]);
    let sets = || vec![set(0x01, [0; 6]); 3].concat();
    let expected = [configuration(first, first), configuration(then, then), sets()];
    with(&expected, async |part| {
        part.configure(asked()).await.unwrap();
        part.configure(Config::default()).await.unwrap();
        assert_eq!(part.read().await, Ok(None));
        for _ in 0..2 {
            assert!(part.read().await.unwrap().unwrap().ready);
        }
    });
}

/// The measurement that comes with its configuration is a set of the settings before; after it the part is idle until asked.
#[test]
fn a_part_that_is_asked_has_nothing_new_before_the_first_question() {
    let wrote = [0x18, 0x20, 0x01];
    let sets = || vec![set(0x01, [0; 6]); 2].concat();
    with(&[configuration(wrote, wrote), sets()], async |part| {
        part.configure(asked()).await.unwrap();
        assert_eq!(part.read().await, Ok(None));
        assert!(!part.read().await.unwrap().unwrap().ready, "the same set again");
    });
}

#[test]
fn a_part_that_restarted_is_found_and_its_outputs_are_unlocked() {
    // Power-on values: 15 Hz, 1090 counts a gauss, single measurement.
    let power_on = reads(0x00, &[0x10, 0x20, 0x01], [0; 6]);
    let result = with(&[power_on], async |part| part.verify(Config::default()).await);
    let (register, wrote, read) = (CONFIGURATION_A, 0x18, 0x10);
    assert_eq!(result, Err(Error::NotKept { register, wrote, read }));
}

#[test]
fn a_part_that_is_asked_has_a_new_set_for_each_question() {
    let nack = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    let ask = || vec![T::write(0x1E, vec![0x02, 0x01])];
    let refused = vec![ask().remove(0).with_error(nack)];
    let config = Config {
        mode: Mode::Asked,
        ..Config::default()
    };
    let wrote = [0x18, 0x20, 0x01];
    let expected = [
        // It may be done already with the measurement that comes with its configuration, and idle reads as one of two codes.
        configuration(wrote, [0x18, 0x20, 0x02]),
        set(0x01, [0; 6]),
        ask(),
        reads(0x00, &[0x18, 0x20, 0x03], [0; 6]),
        set(0x01, [0; 6]),
        set(0x01, [0; 6]),
        refused,
        set(0x01, [0; 6]),
        // Asked before that measurement is done, it makes the next one with the settings before.
        configuration(wrote, wrote),
        set(0x00, [0; 6]),
        ask(),
        set(0x01, [0; 6]),
    ];
    with(&expected, async |part| {
        let ready = async |part: &mut Hmc5883l<Mock>| part.read().await.unwrap().unwrap().ready;
        part.configure(config).await.unwrap();
        part.measure().await.unwrap();
        assert_eq!(part.verify(config).await, Ok(()));
        assert!(ready(part).await);
        assert!(!ready(part).await, "the same set again");
        assert_eq!(part.measure().await, Err(Error::Bus(MODE, nack)));
        assert!(!ready(part).await, "a part that did not hear the question");
        part.configure(config).await.unwrap();
        part.measure().await.unwrap();
        assert_eq!(part.read().await, Ok(None), "of the settings before");
    });
    // Each that measures as the other should has lost its settings.
    for (mode, wrote, read) in [(Mode::Continuous, 0, 3), (Mode::Asked, 1, 0)] {
        let kept = reads(0x00, &[0x18, 0x20, read], [0; 6]);
        let config = Config { mode, ..config };
        let lost = with(&[kept], async |part| part.verify(config).await);
        let (register, read) = (MODE, read.into());
        assert_eq!(lost, Err(Error::NotKept { register, wrote, read }));
    }
}

#[test]
fn another_part_or_none_is_refused() {
    let result = with(&[identity(b"H53")], async |part| part.probe().await);
    let wrong = Error::WrongIdentity {
        register: IDENTIFICATION_B,
        expected: b'4'.into(),
        read: b'5'.into(),
    };
    assert_eq!(result, Err(wrong));

    let nack = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    let silent = vec![identity(b"H43").remove(0).with_error(nack)];
    let result = with(&[silent], async |part| part.configure(Config::default()).await);
    assert_eq!(result, Err(Error::Bus(IDENTIFICATION_A, nack)));
}
