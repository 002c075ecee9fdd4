//! Bytes of a file, gzip or not, within limits.
//!
//! In: a file or a stream, and the most bytes that it may hold. Out: its bytes, unpacked where it begins as a gzip file
//! does (RFC 1952, 2.3.1), whatever its name; all members of it. Refused, with an error of kind
//! [`io::ErrorKind::FileTooLarge`] that carries a [`TooLarge`]: more bytes than that, and a gzip file that grows by more
//! than [`Limits::ratio`] when it is unpacked. Deflate packs up to 1032 to 1 (zlib's technical details), so a file of 2 MB
//! can hold 2 GiB: the reader stops at the first byte beyond the limit and has unpacked no more than that.
//!
//! ```
//! let bytes = packed::read("../data/motion/warmup-a.csv.gz".as_ref(), 1 << 26)?;
//! assert!(bytes.starts_with(b"t_s,qw,"));
//! assert!(packed::read("../data/motion/warmup-a.csv.gz".as_ref(), 100).is_err());
//! # Ok::<(), std::io::Error>(())
//! ```

#![forbid(unsafe_code)]

use std::{
    fs::File,
    io::{self, BufReader, Chain, Cursor, ErrorKind, Read},
    path::Path,
};

use flate2::bufread::MultiGzDecoder;

/// The first two bytes of every gzip file (RFC 1952, 2.3.1).
const MAGIC: [u8; 2] = [0x1F, 0x8B];

/// How much is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// \[bytes\] most that is given, unpacked.
    pub most: u64,
    /// \[bytes\] as many are unpacked whatever the ratio: a blank K9F1208 (69,206,016 bytes) packs 1028 to 1.
    pub floor: u64,
    /// Beyond the floor, the most unpacked bytes for one packed byte. Packets of a unit whose sensors are all silent pack
    /// 58 to 1, a table of constants 31 to 1; nothing that this program reads packs better, but for a blank chip.
    pub ratio: u64,
}

impl Limits {
    /// At most so many bytes.
    pub fn most(most: u64) -> Self {
        Limits {
            most,
            floor: 70 << 20,
            ratio: 200,
        }
    }
}

/// Why the rest is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TooLarge {
    /// More bytes than may be.
    #[error("it holds more than {0} bytes; cut it into parts")]
    Long(u64),
    /// A gzip file that grows more than any log or table does.
    #[error(
        "it unpacks to more than {ratio} times its size, as no log or table does; if it is one, unpack it with gzip -d \
         and give what comes out"
    )]
    Ratio {
        /// The limit.
        ratio: u64,
    },
}

impl TooLarge {
    /// What is said by an error of this crate; `None` for any other.
    pub fn of(error: &io::Error) -> Option<TooLarge> {
        error.get_ref()?.downcast_ref().copied()
    }
}

impl From<TooLarge> for io::Error {
    fn from(why: TooLarge) -> Self {
        io::Error::new(ErrorKind::FileTooLarge, why)
    }
}

/// A source that counts what is taken from it.
struct Counted<R> {
    source: R,
    count: u64,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(into)?;
        self.count += count as u64;
        Ok(count)
    }
}

type Whole<R> = BufReader<Counted<Chain<Cursor<Vec<u8>>, R>>>;

enum Source<R: Read> {
    Plain(Whole<R>),
    Gzip(MultiGzDecoder<Whole<R>>),
}

/// The bytes of a source, unpacked.
pub struct Unpacked<R: Read> {
    source: Source<R>,
    limits: Limits,
    given: u64,
}

impl<R: Read> Unpacked<R> {
    /// Reads the first two bytes, which say whether it is packed.
    ///
    /// # Errors
    /// When the source cannot be read.
    pub fn new(mut source: R, limits: Limits) -> io::Result<Self> {
        let mut head = Vec::new();
        source.by_ref().take(MAGIC.len() as u64).read_to_end(&mut head)?;
        let gzip = head == MAGIC;
        let whole = BufReader::new(Counted {
            source: Cursor::new(head).chain(source),
            count: 0,
        });
        let source = if gzip {
            Source::Gzip(MultiGzDecoder::new(whole))
        } else {
            Source::Plain(whole)
        };
        Ok(Unpacked {
            source,
            limits,
            given: 0,
        })
    }

    /// Whether the source is a gzip file.
    pub fn is_gzip(&self) -> bool {
        matches!(self.source, Source::Gzip(_))
    }
}

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let Limits { most, floor, ratio } = self.limits;
        let (count, packed) = match &mut self.source {
            Source::Plain(plain) => (plain.read(into)?, None),
            Source::Gzip(gzip) => (gzip.read(into)?, Some(gzip.get_ref().get_ref().count)),
        };
        self.given += count as u64;
        if packed.is_some_and(|packed| self.given > floor && self.given > packed.saturating_mul(ratio)) {
            return Err(TooLarge::Ratio { ratio }.into());
        }
        if self.given > most {
            return Err(TooLarge::Long(most).into());
        }
        Ok(count)
    }
}

/// The bytes of a file one after another.
///
/// # Errors
/// When it cannot be read.
pub fn open(file: &Path, most: u64) -> io::Result<Unpacked<File>> {
    Unpacked::new(File::open(file)?, Limits::most(most))
}

/// All bytes of a file.
///
/// # Errors
/// When it cannot be read or holds more than may be.
pub fn read(file: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(file, most)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::io::{Write, repeat, sink};

    use flate2::{Compression, write::GzEncoder};

    use super::*;

    const LIMITS: Limits = Limits {
        most: 10_000,
        floor: 1_000,
        ratio: 50,
    };

    fn packed(bytes: &[u8]) -> Vec<u8> {
        let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
        gzip.write_all(bytes).expect("packed");
        gzip.finish().expect("packed")
    }

    fn unpacked(bytes: &[u8], limits: Limits) -> Result<Vec<u8>, TooLarge> {
        let mut out = Vec::new();
        let mut source = Unpacked::new(bytes, limits).expect("a source");
        match source.read_to_end(&mut out) {
            Ok(_) => Ok(out),
            Err(error) => {
                assert_eq!(error.kind(), ErrorKind::FileTooLarge);
                Err(TooLarge::of(&error).expect("ours"))
            }
        }
    }

    #[test]
    fn a_file_is_known_by_its_bytes_and_all_its_members_are_read() {
        let two = [packed(b"one, "), packed(b"two")].concat();
        assert_eq!(unpacked(&two, LIMITS), Ok(b"one, two".to_vec()));
        for plain in [&b"one"[..], b"", b"\x1F", b"\x8B\x1F"] {
            assert_eq!(unpacked(plain, LIMITS), Ok(plain.to_vec()));
        }
    }

    #[test]
    fn the_last_allowed_byte_is_read_and_the_next_is_not() {
        let mixed: Vec<u8> = (0..10_001_u32)
            .map(|at| (at.wrapping_mul(2_654_435_761) >> 24) as u8)
            .collect();
        for pack in [<[u8]>::to_vec, packed] {
            assert_eq!(unpacked(&pack(&mixed[..10_000]), LIMITS), Ok(mixed[..10_000].to_vec()));
            assert_eq!(unpacked(&pack(&mixed), LIMITS), Err(TooLarge::Long(10_000)));
        }
    }

    #[test]
    fn what_unpacks_to_too_many_times_its_size_is_refused_beyond_the_floor() {
        let blank = [0xFF; 9_000];
        assert_eq!(unpacked(&packed(&blank), LIMITS), Err(TooLarge::Ratio { ratio: 50 }));
        assert_eq!(unpacked(&packed(&blank[..1_000]), LIMITS), Ok(blank[..1_000].to_vec()));
        assert_eq!(unpacked(&blank, LIMITS), Ok(blank.to_vec()));
    }

    /// A bomb of 1 GiB in 1 MB: no more is unpacked than the floor and one piece.
    #[test]
    fn a_bomb_is_not_unpacked_to_its_end() {
        let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
        io::copy(&mut repeat(0).take(8 << 20), &mut gzip).expect("packed");
        let bomb = gzip.finish().expect("packed").repeat(128);
        let limits = Limits {
            floor: 1 << 20,
            ..Limits::most(u64::MAX)
        };
        let mut source = Unpacked::new(bomb.as_slice(), limits).expect("a source");
        let error = io::copy(&mut source, &mut sink()).expect_err("a bomb");
        assert!(error.to_string().contains("200 times its size"), "{error}");
        assert!(source.given < 2 << 20, "{} bytes unpacked", source.given);
    }

    #[test]
    fn a_file_is_read_whole_or_not_at_all() {
        let place = tempfile::tempdir().expect("temporary folder");
        let file = place.path().join("table.csv");
        std::fs::write(&file, packed(b"t_s,a\n")).expect("write");
        assert_eq!(read(&file, 6).expect("read"), b"t_s,a\n");
        let error = read(&file, 5).expect_err("one byte too many");
        assert_eq!(error.to_string(), "it holds more than 5 bytes; cut it into parts");
        std::fs::write(&file, &packed(b"t_s,a\n")[..15]).expect("write");
        assert_eq!(TooLarge::of(&read(&file, 6).expect_err("cut off")), None);
    }
}
