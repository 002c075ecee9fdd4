//! A reader that refuses what would exhaust memory or patience: too many bytes, or too many without a line end.
//!
//! A gzip file of a few kilobytes can hold gigabytes, and a CSV reader gathers a line before it looks at it. Beyond a
//! limit the error is of kind [`ErrorKind::FileTooLarge`], which neither a file nor gzip gives of its own.

use std::io::{Error, ErrorKind, Read, Result};

/// Most bytes in a line.
const MAX_LINE: usize = 64 * 1024;

/// `source`, within the limits.
pub struct Bounded<R> {
    source: R,
    left: u64,
    in_line: usize,
}

impl<R: Read> Bounded<R> {
    /// At most `bytes` of `source`.
    pub fn new(source: R, bytes: u64) -> Self {
        Self {
            source,
            left: bytes,
            in_line: 0,
        }
    }
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        let count = self.source.read(into)?;
        let fresh = into.get(..count).unwrap_or_default();
        self.in_line = match fresh.iter().rposition(|&byte| byte == b'\n') {
            Some(end) => count - end - 1,
            None => self.in_line + count,
        };
        self.left = self.left.checked_sub(count as u64).ok_or(ErrorKind::FileTooLarge)?;
        if self.in_line > MAX_LINE {
            Err(Error::from(ErrorKind::FileTooLarge))
        } else {
            Ok(count)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, repeat, sink};

    use super::*;

    fn refusal(source: impl Read, bytes: u64) -> Option<ErrorKind> {
        std::io::copy(&mut Bounded::new(source, bytes), &mut sink())
            .err()
            .map(|error| error.kind())
    }

    #[test]
    fn the_last_allowed_byte_passes_and_the_next_does_not() {
        assert_eq!(refusal(Cursor::new("a\nb\n"), 4), None);
        assert_eq!(refusal(Cursor::new("a\nb\nc"), 4), Some(ErrorKind::FileTooLarge));
    }

    #[test]
    fn a_line_without_end_is_refused_long_before_the_file_limit() {
        assert_eq!(refusal(repeat(b'7'), u64::MAX), Some(ErrorKind::FileTooLarge));
    }

    #[test]
    fn many_short_lines_are_not_one_long_line() {
        assert_eq!(refusal(repeat(b'\n').take(1 << 20), u64::MAX), None);
    }
}
