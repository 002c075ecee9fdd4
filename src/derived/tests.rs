extern crate std;

use super::*;
use crate::{packet, sample::NOT_READ};

fn derived() -> Derived {
    let channel = |count| GyroCycle {
        integral_counts_s: -1.25,
        least: -300,
        most: 12,
        count,
    };
    let mut slots_us = core::array::from_fn(|slot| 225 * slot as u32);
    slots_us[7] = NO_SLOT;
    Derived {
        counter: 0xBEEF,
        start_us: 86_400_000_000,
        mode: Mode::Flight,
        health: Health(0x80).with(Health::RECORDING),
        start: Some(Start {
            reset: ResetCause::Watchdog,
            crash: Some(CrashCause::HardFault),
            starts: 0x0102,
        }),
        cycle_us: 3_700,
        slots_us,
        estimate_us: 240,
        estimate: Estimate {
            force_b: [0.1, 0.0, -9.8],
            field_b_ut: [17.0, -6.9, -14.2],
            rate_b: [-0.0, 1e-3, 2.0],
            sensors: SensorHealth(0x8400_0001),
            triad_nb: None,
            q_nb: Some([0.5, -0.5, 0.5, -0.5]),
            covariance_n: [1e-5, -1e-7, 0.0, 2e-5, 3e-7, 4e-4],
            bias_b: [1e-3, -2e-3, 0.0],
            bias_sd: [1e-4, 1e-4, 2e-4],
        },
        increments: Increments {
            angle_b: [0.1, -0.2, 1.0e-7],
            covered_us: 200_000,
            end_us: 86_399_995_100,
            gyro: [channel(20), channel(19), channel(0), channel(255)],
            forces: [
                Force {
                    acc_p: [[-2048, 0, 2047], [1, -1, 300], [NOT_READ; 3], [12, -12, 0]],
                    angle_b: [0.05, -0.1, -0.0],
                    covered_us: 60_000,
                    after_us: 7_100,
                },
                Force::NONE,
            ],
            slices: core::array::from_fn(|k| Slice {
                before_us: 20_000 * k as u32,
                lasts_us: 20_000 + k as u16,
                quarters: [4 * 4367, -1, NOT_READ, -i16::MAX],
            }),
        },
    }
}

#[test]
fn a_frame_says_what_it_was_given() {
    assert_eq!(decode(&encode(&derived())), Ok(derived()));
    assert_eq!(DERIVED_BYTES, 902);
}

/// Both times had sixteen digits, and nothing was said of the start.
#[test]
fn a_frame_of_version_4_is_read() {
    let frame = encode(&derived());
    let mut older = [
        &b"$04"[..],
        &frame[3..7],
        &b"0000"[..],
        &frame[7..28],
        &frame[36..127],
        &b"0000"[..],
        &frame[127..],
    ]
    .concat();
    let crc = CRC.checksum(&older[1..1 + FIELD_DIGITS]);
    older.truncate(2 + FIELD_DIGITS);
    older.extend(std::format!("{crc:04X}\n").into_bytes());
    let expected = Derived {
        start: None,
        ..derived()
    };
    assert_eq!(decode(&older), Ok(expected));
    older[2] = b'2';
    let crc = CRC.checksum(&older[1..1 + FIELD_DIGITS]);
    older.truncate(2 + FIELD_DIGITS);
    older.extend(std::format!("{crc:04X}\n").into_bytes());
    assert_eq!(decode(&older), Err(DerivedError::Version(2)));
}

#[test]
fn the_checksum_is_ccitt_false() {
    assert_eq!(CRC.checksum(b"123456789"), 0x29B1);
}

#[test]
fn a_reader_of_packets_never_sees_one_begin_or_end_in_it() {
    assert!(
        !encode(&derived())
            .iter()
            .any(|byte| matches!(*byte, packet::START | packet::END))
    );
}

#[test]
fn every_one_bit_error_is_refused() {
    for bit in 0..8 * DERIVED_BYTES {
        let mut frame = encode(&derived());
        frame[bit / 8] ^= 1 << (bit % 8);
        assert!(decode(&frame).is_err(), "bit {bit}");
    }
    assert_eq!(decode(b"$"), Err(DerivedError::Length(1)));
}

#[test]
fn what_is_wrong_with_a_frame_is_said_with_its_bytes() {
    use std::string::ToString;

    let wrong = DerivedError::Checksum {
        sent: 0xA0,
        computed: 0xB1,
    };
    assert_eq!(
        DerivedError::Length(1).to_string(),
        std::format!("1 bytes where a derived frame has {DERIVED_BYTES}")
    );
    assert_eq!(DerivedError::Byte(7).to_string(), "byte 7 belongs to no derived frame");
    assert_eq!(wrong.to_string(), "checksum 00A0 was sent, the fields give 00B1");
    assert!(DerivedError::Version(9).to_string().starts_with("version 9; "));
}
