//! A file, gzip or not, or standard input, read once from its beginning, with its offset at hand for whoever complains.

use std::{
    io::{self, Read},
    path::{Path, PathBuf},
};

use super::DecodeError;

/// Bytes read at once.
const PIECE: usize = 64 * 1024;

/// A file being read, unpacked, and how far.
pub struct Input {
    pub path: PathBuf,
    bytes: Box<dyn Read>,
    offset: u64,
}

impl Input {
    pub fn open(path: &Path) -> Result<Self, DecodeError> {
        let bytes: Box<dyn Read> = if path == Path::new("-") {
            packets::input::unpacked(io::stdin().lock()).map_err(|source| fail(path, 0, source))?
        } else {
            packets::input::open(path).map_err(|source| fail(path, 0, source))?
        };
        Ok(Input {
            path: path.into(),
            bytes,
            offset: 0,
        })
    }

    /// As many bytes, or all there are.
    pub fn first(&mut self, count: u64) -> Result<Vec<u8>, DecodeError> {
        let mut first = Vec::new();
        let read = self.bytes.by_ref().take(count).read_to_end(&mut first);
        let offset = self.offset + first.len() as u64;
        self.offset = offset;
        read.map_err(|source| fail(&self.path, offset, source))?;
        Ok(first)
    }

    /// The same, with what was read of it put back.
    pub fn after(self, head: Vec<u8>) -> Input {
        Input {
            offset: self.offset - head.len() as u64,
            bytes: Box::new(io::Cursor::new(head).chain(self.bytes)),
            path: self.path,
        }
    }

    /// Reads to the end, piece by piece.
    pub fn read(mut self, mut take: impl FnMut(&[u8]) -> Result<(), DecodeError>) -> Result<(), DecodeError> {
        let mut piece = vec![0; PIECE];
        loop {
            match self.bytes.read(&mut piece) {
                Ok(0) => return Ok(()),
                Ok(length) => {
                    take(piece.get(..length).unwrap_or_default())?;
                    self.offset += length as u64;
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(fail(&self.path, self.offset, error)),
            }
        }
    }
}

fn fail(path: &Path, offset: u64, source: io::Error) -> DecodeError {
    DecodeError::Read {
        path: path.into(),
        offset,
        source,
    }
}

#[cfg(test)]
mod tests {
    use flate2::{Compression, write::GzEncoder};

    use super::*;

    #[test]
    fn a_file_that_is_cut_or_missing_is_named_with_its_offset() {
        let place = tempfile::tempdir().expect("temporary folder");
        let missing = Input::open(&place.path().join("none.txt")).err().expect("missing");
        assert!(
            missing.to_string().contains("none.txt cannot be read at byte 0"),
            "{missing}"
        );
        let cut = place.path().join("cut.gz");
        std::fs::write(&cut, b"\x1f\x8b\x08\x00").expect("write");
        assert!(Input::open(&cut).and_then(|input| input.read(|_| Ok(()))).is_err());
    }

    /// 512 MiB in 0.5 MB; members of a gzip file follow each other, so one of 8 MiB is packed once.
    #[test]
    fn a_gzip_bomb_is_refused_by_name_with_what_to_do() {
        let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
        io::copy(&mut io::repeat(b'@').take(8 << 20), &mut gzip).expect("packed");
        let place = tempfile::tempdir().expect("temporary folder");
        let bomb = place.path().join("bomb.txt.gz");
        std::fs::write(&bomb, gzip.finish().expect("packed").repeat(64)).expect("write");
        let mut given = 0;
        let read = Input::open(&bomb).and_then(|input| {
            input.read(|piece| {
                given += piece.len();
                Ok(())
            })
        });
        let error = read.expect_err("a bomb").to_string();
        assert!(error.contains("bomb.txt.gz cannot be read at byte 734"), "{error}");
        assert!(
            error.contains("200 times its size") && error.contains("gzip -d"),
            "{error}"
        );
        assert!(
            given <= packed::Limits::most(0).floor as usize,
            "{given} bytes unpacked"
        );
    }
}
