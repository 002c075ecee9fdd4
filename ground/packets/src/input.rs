//! A file as it is or packed: gzip is told by its first two bytes, not by its name.
//!
//! In: a path or a reader. Out: its bytes, unpacked within the limits of [`packed`]. A gzip stream that ends early is an error of
//! its reader, never an end.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

use packed::{Limits, Unpacked};

/// Bytes that tell what a file is.
pub const HEAD_BYTES: usize = 64 * 1024;

/// Opens a file.
///
/// # Errors
/// When it cannot be read, or is a folder.
pub fn open(path: &Path) -> io::Result<Box<dyn Read>> {
    if path.is_dir() {
        return Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "is a folder; name a file in it",
        ));
    }
    unpacked(File::open(path)?)
}

/// What a reader has, unpacked: a stream may be of any length, a gzip bomb ends in an error.
///
/// # Errors
/// When its first bytes cannot be read.
pub fn unpacked(bytes: impl Read + 'static) -> io::Result<Box<dyn Read>> {
    Ok(Box::new(Unpacked::new(bytes, Limits::most(u64::MAX))?))
}

/// What bytes that are not what they should be look like, for people: empty, a web page, an archive, a picture, text or
/// neither.
pub fn looks_like(head: &[u8]) -> &'static str {
    let begins = |mark: &[u8]| head.starts_with(mark);
    let text = head.trim_ascii_start();
    let text_begins = |mark: &str| {
        text.get(..mark.len())
            .is_some_and(|head| head.eq_ignore_ascii_case(mark.as_bytes()))
    };
    if head.is_empty() {
        "it is empty"
    } else if text_begins("<!doctype") || text_begins("<html") {
        "it looks like a web page: download the file itself"
    } else if begins(b"PK\x03\x04")
        || begins(b"\xFD7zXZ")
        || begins(b"BZh")
        || begins(b"\x28\xB5\x2F\xFD")
        || begins(b"7z\xBC\xAF")
    {
        "it looks like an archive: unpack it first"
    } else if begins(b"PAR1") {
        "it looks like a Parquet table"
    } else if head
        .iter()
        .all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace())
    {
        match text.iter().take_while(|byte| **byte != b'\n').any(|byte| *byte == b',') {
            true => "it looks like a table",
            false => "it looks like other text",
        }
    } else {
        "its bytes are no text"
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::{Compression, write::GzEncoder};

    use super::*;

    #[test]
    fn a_packed_file_is_unpacked_whatever_its_name_and_a_cut_one_is_an_error() {
        let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
        packed.write_all(b"@0001").expect("packed");
        let packed = packed.finish().expect("packed");
        let read = |bytes: Vec<u8>| {
            let mut text = String::new();
            unpacked(io::Cursor::new(bytes))?
                .read_to_string(&mut text)
                .map(|_| text)
        };
        assert_eq!(read(packed.clone()).expect("whole"), "@0001");
        assert_eq!(read(b"@0001".to_vec()).expect("plain"), "@0001");
        assert!(read(packed[..packed.len() - 4].to_vec()).is_err());
    }

    #[test]
    fn what_a_file_looks_like_is_said() {
        assert_eq!(looks_like(b""), "it is empty");
        assert!(looks_like(b"\n<!DOCTYPE html><p>").contains("web page"));
        assert!(looks_like(b"PK\x03\x04..").contains("archive"));
        assert!(looks_like(b"t_s,counter,a1x\n0,1,2\n").contains("table"));
        assert!(looks_like(b"hello").contains("other text"));
        assert!(looks_like(&[0xFF, 0, 1]).contains("no text"));
    }
}
