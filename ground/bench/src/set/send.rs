//! A set over the umbilical: sent, used, read back.
//!
//! In: a line to the unit and the bytes the unit carries. Out: what the unit says of the set it now uses, which was read
//! back and is the same. Words of four bytes (`G_CW`), an order to use and keep them (`G_CL`, confirmed by `G_CK`) and to read
//! (`G_CR`). Lost and damaged words are sent again, the whole at most [`TRIES`] times; packets and other lines in between are
//! passed over.
//!
//! Refuses what the unit refuses, in its words; a silent line; a set that reads back differently.

use std::io::{self, Read, Write};

use emems::{
    calibration::{ENCODED_BYTES, load::WORDS},
    command::{Command, word_of},
};

/// How often the whole is sent, or asked for.
pub const TRIES: usize = 3;

/// Reads without a byte after which the line counts as silent; with a serial port's 200 ms, 3 s.
const SILENT_READS: usize = 15;
/// Bytes passed over in search of an answer: half a minute of packets.
const MOST_BYTES: usize = 65_536;
/// Longest line of the unit.
const LONGEST_LINE: usize = 160;

/// Why the unit does not use the set.
#[derive(Debug, thiserror::Error)]
pub enum SendError {
    /// The line failed.
    #[error("the line failed: {0}")]
    Line(#[from] io::Error),
    /// No answer.
    #[error("no answer to {0}: is it the umbilical of a unit that runs?")]
    Silent(&'static str),
    /// The unit says no.
    #[error("the unit says: {0}")]
    Refused(String),
    /// It could not be read back, or is another.
    #[error("what was read back differs from byte {0} on: apply it again, and do not fly")]
    Differs(usize),
}

/// Sends a set and reads it back.
///
/// # Errors
/// When the unit does not answer, refuses, or has something else afterwards.
pub fn send<L: Read + Write>(line: &mut L, set: &[u8; ENCODED_BYTES]) -> Result<String, SendError> {
    let said = load(line, set)?;
    let mut read = [None; WORDS];
    for _ in 0..TRIES {
        line.write_all(word_of(Command::ReadSet))?;
        let whole = replies(line, |reply| {
            take(reply, &mut read);
            read.iter().all(Option::is_some).then_some(())
        });
        if whole?.is_some() {
            break;
        }
    }
    let words = set.as_chunks::<4>().0;
    match read.iter().zip(words).position(|(read, sent)| *read != Some(*sent)) {
        Some(word) => Err(SendError::Differs(4 * word)),
        None => Ok(said),
    }
}

/// Sends it until the unit uses it.
fn load<L: Read + Write>(line: &mut L, set: &[u8; ENCODED_BYTES]) -> Result<String, SendError> {
    let mut said = None;
    for _ in 0..TRIES {
        for (place, bytes) in set.as_chunks::<4>().0.iter().enumerate() {
            write!(line, "G_CW{place:04X}{:08X}", u32::from_be_bytes(*bytes))?;
        }
        line.write_all(word_of(Command::LoadSet))?;
        said = replies(line, |reply| reply.starts_with("G_CL").then(|| reply.to_owned()))?;
        if said.as_ref().is_some_and(|reply| reply.starts_with("G_CL: send ")) {
            line.write_all(word_of(Command::ConfirmSet))?;
            said = replies(line, |reply| {
                let answers = reply.starts_with("G_CL ") || reply.starts_with("G_CK ");
                answers.then(|| reply.to_owned())
            })?;
        }
        match &said {
            Some(reply) if reply.starts_with("G_CL ok") => return Ok(reply.clone()),
            // Damaged on the way: once more.
            Some(reply) if reply.contains("missing") || reply.contains("checksum") => {}
            Some(reply) => return Err(SendError::Refused(reply.clone())),
            None => {}
        }
    }
    Err(said.map_or(SendError::Silent("G_CL"), SendError::Refused))
}

/// Reads the unit's lines until one is what is looked for; `None` after silence, or too much else.
fn replies<L: Read, T>(line: &mut L, mut look: impl FnMut(&str) -> Option<T>) -> Result<Option<T>, SendError> {
    let (mut held, mut silent, mut passed) = (Vec::new(), 0, 0);
    let mut piece = [0; 512];
    while silent < SILENT_READS && passed < MOST_BYTES {
        let count = match line.read(&mut piece) {
            Ok(count) => count,
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => 0,
            Err(error) => return Err(error.into()),
        };
        (silent, passed) = (if count == 0 { silent + 1 } else { 0 }, passed + count);
        for byte in piece.iter().take(count) {
            match byte {
                b'>' => held = vec![b'>'],
                b'\r' | b'\n' => {
                    if let Some(found) = std::str::from_utf8(&held)
                        .ok()
                        .and_then(|text| look(text.strip_prefix('>')?))
                    {
                        return Ok(Some(found));
                    }
                    held.clear();
                }
                _ if !held.is_empty() && held.len() < LONGEST_LINE => held.push(*byte),
                _ => held.clear(),
            }
        }
    }
    Ok(None)
}

/// Words of a line read back: `G_CR pppp` and the bytes.
fn take(reply: &str, read: &mut [Option<[u8; 4]>; WORDS]) {
    let Some((place, bytes)) = reply.strip_prefix("G_CR ").and_then(|rest| rest.split_once(' ')) else {
        return;
    };
    let Ok(place) = usize::from_str_radix(place, 16) else {
        return;
    };
    for (k, digits) in bytes.as_bytes().chunks(8).enumerate() {
        let word = std::str::from_utf8(digits).ok().filter(|digits| digits.len() == 8);
        let word = word.and_then(|digits| u32::from_str_radix(digits, 16).ok());
        if let (Some(slot), Some(word)) = (read.get_mut(place + k), word) {
            *slot = Some(word.to_be_bytes());
        }
    }
}

#[cfg(test)]
mod tests;
