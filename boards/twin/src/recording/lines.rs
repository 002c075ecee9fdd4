//! A reader that refuses a line of too many bytes.
//!
//! A CSV reader gathers a line before it looks at it. Beyond the limit the error is of kind [`ErrorKind::FileTooLarge`],
//! which neither a file nor gzip gives of its own.

use std::io::{Error, ErrorKind, Read, Result};

/// Most bytes in a line.
const MAX_LINE: usize = 64 * 1024;

/// `source`, within the limit.
pub struct BoundedLines<R> {
    source: R,
    in_line: usize,
}

impl<R: Read> BoundedLines<R> {
    /// Reads `source`.
    pub fn new(source: R) -> Self {
        Self { source, in_line: 0 }
    }
}

impl<R: Read> Read for BoundedLines<R> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        let count = self.source.read(into)?;
        let fresh = into.get(..count).unwrap_or_default();
        self.in_line = match fresh.iter().rposition(|&byte| byte == b'\n') {
            Some(end) => count - end - 1,
            None => self.in_line + count,
        };
        if self.in_line > MAX_LINE {
            Err(Error::from(ErrorKind::FileTooLarge))
        } else {
            Ok(count)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{repeat, sink};

    use super::*;

    fn refusal(source: impl Read) -> Option<ErrorKind> {
        std::io::copy(&mut BoundedLines::new(source), &mut sink())
            .err()
            .map(|error| error.kind())
    }

    #[test]
    fn a_line_without_end_is_refused() {
        assert_eq!(refusal(repeat(b'7')), Some(ErrorKind::FileTooLarge));
    }

    #[test]
    fn many_short_lines_are_not_one_long_line() {
        assert_eq!(refusal(repeat(b'\n').take(1 << 20)), None);
    }
}
