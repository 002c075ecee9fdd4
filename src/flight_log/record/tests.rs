extern crate std;

use super::*;

/// Kept to a sixteen-bit fraction.
const QUATERNION_TOLERANCE: f32 = 0.51 / 32_767.0;
/// Kept to eight significant bits, cut.
const SIGMA_TOLERANCE: f32 = 1.0 / 128.0;

const KEY: Key = Key {
    epoch: 3,
    boot: 0x0102_0304,
    seq: 70_000,
};

fn entry() -> Entry {
    let mut slots_us = core::array::from_fn(|slot| 260 * slot as u32);
    slots_us[5] = NO_SLOT;
    Entry {
        start_us: 86_400_000_123,
        packet: core::array::from_fn(|at| at as u8),
        slots_us,
        flight: true,
        health: Health(0x20).with(Health::RECORDING),
        estimate: None,
    }
}

#[test]
fn a_packet_record_says_what_it_was_given() {
    assert_eq!(
        decode(&encode_entry(KEY, &entry())),
        Ok((KEY, Content::Packet(entry())))
    );
}

#[test]
fn the_packet_stands_verbatim_where_the_page_says() {
    let bytes = encode_entry(KEY, &entry());
    assert_eq!(bytes[24..180], entry().packet);
    assert_eq!(bytes[..4], [0xE7, 0x4D, 1, 1]);
    assert_eq!(bytes[4..14], [0x70, 0x11, 0x01, 0, 4, 3, 2, 1, 3, 0]);
}

#[test]
fn an_estimate_is_kept_to_its_resolution() {
    let given = Estimate {
        q_nb: [0.5, -0.5, 0.707, -1.0],
        bias_b: [1e-3, -2.5e-4, 0.0],
        sigma: [0.01, 0.02, 0.5, 1e-5, 2e-5, 3e-5],
        sensors: SensorHealth(0x8000_0007),
    };
    let with_estimate = Entry {
        estimate: Some(given),
        ..entry()
    };
    let Ok((
        _,
        Content::Packet(Entry {
            estimate: Some(got), ..
        }),
    )) = decode(&encode_entry(KEY, &with_estimate))
    else {
        panic!("no estimate came back");
    };
    assert_eq!((got.bias_b, got.sensors), (given.bias_b, given.sensors));
    for axis in 0..4 {
        assert!(
            (got.q_nb[axis] - given.q_nb[axis]).abs() <= QUATERNION_TOLERANCE,
            "{got:?}"
        );
    }
    for axis in 0..6 {
        let cut = (given.sigma[axis] - got.sigma[axis]) / given.sigma[axis];
        assert!((0.0..=SIGMA_TOLERANCE).contains(&cut), "{got:?}");
    }
}

#[test]
fn slot_times_beyond_the_field_stay_times() {
    let mut late = entry();
    late.slots_us[0] = 400_000;
    let Ok((_, Content::Packet(got))) = decode(&encode_entry(KEY, &late)) else {
        panic!("no packet came back");
    };
    assert_eq!(got.slots_us[0], 4 * (u32::from(u16::MAX) - 1));
}

#[test]
fn a_header_says_what_it_was_given_and_describes_the_log() {
    let name = |text: &str| Name::try_from(text).expect("a short name");
    let header = BootHeader {
        opened_us: 77,
        firmware: name("0.1.0"),
        unit: name("FM-2"),
        calibration: name("sixteen-letters!"),
        period_us: 20_000,
        start: None,
    };
    let crash = CrashRecord::new(
        CrashCause::HardFault,
        0x0800_1234,
        0x0800_5678,
        0x0002_0000,
        90_000_000,
        "unit/acquire.rs",
    );
    let start = |crash| {
        Some(Start {
            reset: ResetCause::Software,
            starts: 300,
            crash,
        })
    };
    for start in [None, start(None), start(Some(crash))] {
        let header = BootHeader {
            start,
            ..header.clone()
        };
        let bytes = encode_header(KEY, &header);
        assert_eq!(decode(&bytes), Ok((KEY, Content::Header(header))));
        let text = std::string::String::from_utf8_lossy(&bytes[76..216]).into_owned();
        assert!(text.trim_end_matches('\0').ends_with("crc32@252"), "{text}");
    }
}

/// Until then the description went on to where the start stands now. Its flag decides, also where those bytes would pass for
/// a start.
#[test]
fn a_header_of_older_firmware_says_nothing_of_its_start() {
    assert!(ResetCause::of_code(1).is_some());
    for byte in [b'x', 1] {
        let mut bytes = begin(KEY, HEADER, 0, 5);
        put(&mut bytes, at::DESCRIPTION, &[byte; CHECKED - at::DESCRIPTION]);
        seal(&mut bytes);
        let Ok((_, Content::Header(header))) = decode(&bytes) else {
            panic!("no header");
        };
        assert_eq!((header.opened_us, header.start), (5, None));
    }
}

/// Readers that others write take the flags bit by bit: of a header only the third may be set.
#[test]
fn a_header_has_no_flag_but_that_of_its_start() {
    assert_eq!(flags(&encode_header(KEY, &BootHeader::default())), 0);
    let start = Start {
        reset: ResetCause::Software,
        starts: 1,
        crash: None,
    };
    let told = BootHeader {
        start: Some(start),
        ..BootHeader::default()
    };
    assert_eq!(flags(&encode_header(KEY, &told)), 4);
}

/// The file and the line of a panic stand at the end of its place: they must outlast the room there is.
#[test]
fn of_a_long_place_of_a_crash_the_end_is_kept() {
    let long = "src/flight_log/record.rs:289";
    let start = Start {
        reset: ResetCause::Software,
        starts: 1,
        crash: Some(CrashRecord::new(CrashCause::Panic, 1, 2, 3, 4_000, long)),
    };
    let header = BootHeader {
        start: Some(start),
        ..BootHeader::default()
    };
    let Ok((_, Content::Header(header))) = decode(&encode_header(KEY, &header)) else {
        panic!("no header");
    };
    let place = header.start.and_then(|start| start.crash).map(|crash| crash.place);
    assert_eq!(place.as_deref(), Some("og/record.rs:289"));
}

/// What stops a dump must say whether the ground or the log is to blame.
#[test]
fn an_error_names_what_does_not_fit_and_the_version_that_is_known() {
    use std::string::ToString;
    assert!(
        RecordError::Newer(2)
            .to_string()
            .contains("version 2; this reader knows 1")
    );
    assert!(RecordError::Type(9).to_string().contains("type 9"));
    assert!(RecordError::Magic.to_string().contains("E7 4D"));
    assert!(RecordError::Checksum.to_string().contains("CRC-32"));
}

#[test]
fn a_change_of_mode_says_what_it_was_given() {
    for (mode, recording, cause) in [
        (Mode::Flight, true, Cause::LiftOff),
        (Mode::Wait, false, Cause::Command),
        (Mode::Flight, false, Cause::Log),
        (Mode::Wait, false, Cause::EraseArmed),
        (Mode::Wait, true, Cause::Erased),
        (Mode::Wait, false, Cause::Rail),
        (
            Mode::Wait,
            true,
            Cause::RailTaken(Rail::of_bytes([0x1B, 0x58, 0x21, 0x34, 0x05, 0x03])),
        ),
        (
            Mode::Wait,
            false,
            Cause::SiteTaken(site::Told::of_bytes(core::array::from_fn(|place| place as u8 + 1))),
        ),
    ] {
        let change = Change {
            at_us: 5_000_000_000,
            mode,
            recording,
            cause,
        };
        let bytes = encode_change(KEY, &change);
        assert_eq!(decode(&bytes), Ok((KEY, Content::Change(change))));
        assert!(!is_packet(&bytes));
    }
}

#[test]
fn every_one_bit_error_is_refused() {
    for bit in 0..8 * RECORD_BYTES {
        let mut bytes = encode_entry(KEY, &entry());
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(decode(&bytes).is_err(), "bit {bit}");
    }
}

#[test]
fn a_newer_version_is_named_and_erased_bytes_are_no_record() {
    let mut bytes = encode_entry(KEY, &entry());
    bytes[2] = 2;
    seal(&mut bytes);
    assert_eq!(key(&bytes), Err(RecordError::Newer(2)));
    assert_eq!(key(&[0xFF; RECORD_BYTES]), Err(RecordError::Magic));
    assert_eq!(key(&[0; RECORD_BYTES]), Err(RecordError::Magic));
    let mut bytes = encode_entry(KEY, &entry());
    bytes[3] = 9;
    seal(&mut bytes);
    assert_eq!(decode(&bytes), Err(RecordError::Type(9)));
}
