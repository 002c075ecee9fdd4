//! A parameter set as bytes: what the umbilical carries and the memory keeps.
//!
//! Little endian, numbers of 32 bits IEEE 754, in this order:
//!
//! | bytes | what |
//! |---|---|
//! | 0..4 | `eMCS` |
//! | 4..6 | version, 1 |
//! | 6..8 | bytes in all, checksum included |
//! | 8..12, 12..16 | serial number of the unit, number of the set |
//! | 16..19 | method of accelerometers, magnetometers, gyros: 0 MT, 1 LMS EC, 2 MV SEC |
//! | 19..22 | full scale FS (0, 1, 3), gain GN (0 to 7), range (1, 2, 4) as the parts' registers have them |
//! | 22..24 | 0 |
//! | 24..36 | reference, lowest, highest temperature \[degC\] |
//! | 36..72 | bias [unit], scale \[1\], direction \[rad\] uncertainty of accelerometers, magnetometers, gyros |
//! | 72..124 | four places x, y, z \[m\], their standard deviation \[m\] |
//! | 124..1132 | 28 axes of nine numbers: direction x, y, z, scale, bias, its two temperature terms, the scale's, noise |
//! | 1132..1136 | CRC-32 (ISO-HDLC) over everything before |
//!
//! Refuses another length, beginning or version, a checksum that does not fit, and codes that mean nothing.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use nalgebra::Vector3;

use super::{Axis, CHANNELS, Identity, Method, Ranges, Refusal, Set, Uncertainty};
use crate::sensor::{adis16265::Range, hmc5883l::Gain, lis331hh::FullScale};

/// Bytes of a set.
pub const ENCODED_BYTES: usize = HEADER + 4 * NUMBERS + 4;

const MARK: [u8; 4] = *b"eMCS";
const VERSION: u16 = 1;
/// Bytes before the first number.
const HEADER: usize = 24;
const NUMBERS: usize = 3 + 9 + 13 + 9 * CHANNELS;

/// Without a table: a set is checked once, and a table costs a kilobyte of flash.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

const METHODS: [Method; 3] = [Method::Mt, Method::LmsEc, Method::MvSec];
const FULL_SCALES: [FullScale; 3] = [FullScale::G6, FullScale::G12, FullScale::G24];
const RANGES: [Range; 3] = [Range::DegPerS80, Range::DegPerS160, Range::DegPerS320];

pub(super) fn encode(set: &Set) -> [u8; ENCODED_BYTES] {
    let mut bytes = [0; ENCODED_BYTES];
    bytes[0..4].copy_from_slice(&MARK);
    bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
    bytes[6..8].copy_from_slice(&(ENCODED_BYTES as u16).to_le_bytes());
    bytes[8..12].copy_from_slice(&set.identity.unit.to_le_bytes());
    bytes[12..16].copy_from_slice(&set.identity.set.to_le_bytes());
    let [acc, mag, gyro] = set.identity.methods.map(|method| method as u8);
    let ranges = set.ranges;
    let codes = [
        acc,
        mag,
        gyro,
        ranges.acceleration as u8,
        ranges.field as u8,
        ranges.rate as u8,
    ];
    bytes[16..22].copy_from_slice(&codes);

    let temperatures = [set.reference_c, set.lowest_c, set.highest_c];
    let spreads = set.uncertainty.iter().flat_map(|u| [u.bias, u.scale, u.direction]);
    let places = set.place_b.iter().flat_map(|place| [place.x, place.y, place.z]);
    let axes = set.channels().flat_map(|(_, axis)| axis.numbers());
    let numbers = temperatures
        .into_iter()
        .chain(spreads)
        .chain(places)
        .chain([set.place_sigma])
        .chain(axes);
    for (slot, number) in bytes[HEADER..].as_chunks_mut::<4>().0.iter_mut().zip(numbers) {
        *slot = number.to_le_bytes();
    }
    let crc = CRC.checksum(&bytes[..ENCODED_BYTES - 4]);
    bytes[ENCODED_BYTES - 4..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// Whether the checksum at the end fits what stands before it: together they leave a constant.
pub(super) const fn is_intact(bytes: &[u8]) -> bool {
    CRC.checksum(bytes) == CRC_32_ISO_HDLC.residue ^ CRC_32_ISO_HDLC.xorout
}

/// The set in `bytes`, not yet checked for sense.
pub(super) fn decode(bytes: &[u8]) -> Result<Set, Refusal> {
    let bytes: &[u8; ENCODED_BYTES] = bytes.try_into().map_err(|_| Refusal::Length(bytes.len()))?;
    let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    if bytes[0..4] != MARK {
        return Err(Refusal::NotASet);
    }
    let (written, computed) = (word(ENCODED_BYTES - 4), CRC.checksum(&bytes[..ENCODED_BYTES - 4]));
    if written != computed {
        return Err(Refusal::Checksum { written, computed });
    }
    if half(4) != VERSION {
        return Err(Refusal::Version(half(4)));
    }
    if usize::from(half(6)) != ENCODED_BYTES {
        return Err(Refusal::Length(usize::from(half(6))));
    }
    if half(22) != 0 {
        return Err(Refusal::Code(22));
    }
    let mut words = bytes[HEADER..ENCODED_BYTES - 4].as_chunks::<4>().0.iter();
    let mut number = || words.next().map_or(f32::NAN, |word| f32::from_le_bytes(*word));
    Ok(Set {
        identity: Identity {
            unit: word(8),
            set: word(12),
            methods: [
                code(bytes, 16, &METHODS)?,
                code(bytes, 17, &METHODS)?,
                code(bytes, 18, &METHODS)?,
            ],
        },
        ranges: Ranges {
            acceleration: code(bytes, 19, &FULL_SCALES)?,
            field: code(bytes, 20, &Gain::ALL)?,
            rate: code(bytes, 21, &RANGES)?,
        },
        reference_c: number(),
        lowest_c: number(),
        highest_c: number(),
        uncertainty: core::array::from_fn(|_| Uncertainty {
            bias: number(),
            scale: number(),
            direction: number(),
        }),
        place_b: core::array::from_fn(|_| Vector3::new(number(), number(), number())),
        place_sigma: number(),
        acc: core::array::from_fn(|_| Axis::of_numbers(core::array::from_fn(|_| number()))),
        mag: core::array::from_fn(|_| Axis::of_numbers(core::array::from_fn(|_| number()))),
        gyro: core::array::from_fn(|_| Axis::of_numbers(core::array::from_fn(|_| number()))),
    })
}

/// What the byte at `at` stands for.
fn code<T: Copy + Encoded>(bytes: &[u8; ENCODED_BYTES], at: usize, all: &[T]) -> Result<T, Refusal> {
    let found = all.iter().find(|value| value.code() == bytes[at]);
    found.copied().ok_or(Refusal::Code(at))
}

trait Encoded {
    fn code(&self) -> u8;
}

macro_rules! encoded {
    ($($kind:ty),*) => {
        $(impl Encoded for $kind {
            fn code(&self) -> u8 {
                *self as u8
            }
        })*
    };
}

encoded!(Method, FullScale, Gain, Range);
