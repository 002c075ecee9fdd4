//! The firmware's log: defmt frames out of its RTT up-channel 0, as a probe reads them.
//!
//! In: guest memory at a stop, then the drained bytes. Out: text lines. An image without RTT or without defmt data has
//! no log, which is not an error. Layout: SEGGER RTT control block, channel 0 at +24 (name, buffer, size, write, read).

use defmt_decoder::{DecodeError, StreamDecoder, Table};
use rigless::{emulator::Host, soc::Width};

const BUFFER: u64 = 28;
const SIZE: u64 = 32;
const WRITE: u64 = 36;
const READ: u64 = 40;
/// "SEGG", the first word of a control block the firmware has set up.
const MAGIC: u64 = 0x4747_4553;
/// A control block with a larger buffer than all of RAM is not one.
const LARGEST: u64 = 192 * 1024;

/// Reads what the firmware wrote since the last call, and makes room by writing the read offset back.
pub fn drain(host: &mut dyn Host, block: u64) -> Vec<u8> {
    drained(host, block).unwrap_or_default()
}

fn drained(host: &mut dyn Host, block: u64) -> Option<Vec<u8>> {
    let mut word = |at: u64| host.read(block + at, Width::W32).ok();
    let (write, mut read) = (word(WRITE)?, word(READ)?);
    if write == read || word(0)? != MAGIC {
        return None;
    }
    let (buffer, size) = (word(BUFFER)?, word(SIZE)?);
    if size > LARGEST || write >= size || read >= size {
        return None;
    }
    let mut bytes = Vec::new();
    while read != write {
        bytes.push(host.read(buffer + read, Width::W8).ok()? as u8);
        read = (read + 1) % size;
    }
    host.write(block + READ, Width::W32, read).ok()?;
    Some(bytes)
}

/// Turns drained bytes into lines.
pub struct Decoder<'t> {
    table: &'t Table,
    stream: Box<dyn StreamDecoder + Send + Sync + 't>,
}

impl<'t> Decoder<'t> {
    /// A decoder at the start of a stream.
    pub fn new(table: &'t Table) -> Self {
        Decoder {
            table,
            stream: table.new_stream_decoder(),
        }
    }

    /// The lines completed by `bytes`. A damaged frame is a line that says so; the stream goes on after it.
    pub fn lines(&mut self, bytes: &[u8]) -> Vec<String> {
        self.stream.received(bytes);
        let mut lines = Vec::new();
        loop {
            match self.stream.decode() {
                Ok(frame) => lines.push(frame.display(false).to_string()),
                Err(DecodeError::UnexpectedEof) => return lines,
                Err(DecodeError::Malformed) => {
                    lines.push("(a damaged log frame)".into());
                    if !self.table.encoding().can_recover() {
                        self.stream = self.table.new_stream_decoder();
                        return lines;
                    }
                }
            }
        }
    }
}
