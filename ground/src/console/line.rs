//! A line to the unit: bytes in with their arrival time, bytes out, gone and back again.
//!
//! In: what the unit says. Out: [`Heard`], one piece at a time, and the words said to it. Time is the line's own: the
//! computer's for a real port, the unit's virtual time for one that flies in another thread, so that rates and plots
//! mean the same on both. Nothing here interprets a byte.
//!
//! [`channel`] is the line to a unit in another thread of this program.

use std::{
    io,
    sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, SyncSender},
    time::Duration,
};

/// What a line has to tell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Heard {
    /// Bytes, and when the last of them arrived.
    Bytes {
        /// Arrival on the line's clock.
        at: Duration,
        /// The bytes, in order; never empty.
        bytes: Vec<u8>,
    },
    /// Nothing within the time waited.
    Silence,
    /// The unit is no longer there; the line goes on looking for it. Told once.
    Unplugged(String),
    /// It is there (again). Told once.
    Plugged,
    /// It will never be there again: the run is over.
    Ended,
}

/// A byte pipe to the unit.
pub trait Line {
    /// What the user knows it by.
    fn name(&self) -> &str;
    /// The line's clock: since it was opened or since the unit started.
    fn now(&self) -> Duration;
    /// Waits at most about `wait` for something to tell. Failing is no error but [`Heard::Unplugged`].
    fn hear(&mut self, wait: Duration) -> Heard;
    /// Says `bytes` to the unit.
    ///
    /// # Errors
    /// When they cannot be said now; they are not kept for later, since a command must not act long after it was typed.
    fn say(&mut self, bytes: &[u8]) -> io::Result<()>;
}

/// Pieces the unit may be ahead of its listener: bounds the memory and paces a unit faster than the screen.
const AHEAD: usize = 256;

/// A line to a unit in another thread: the listener's end and the unit's.
pub fn channel(name: &str) -> (ChannelLine, UnitEnd) {
    let (to_listener, from_unit) = mpsc::sync_channel(AHEAD);
    let (to_unit, from_listener) = mpsc::channel();
    let line = ChannelLine {
        name: name.to_owned(),
        now: Duration::ZERO,
        plugged: true,
        from_unit,
        to_unit,
    };
    let unit = UnitEnd {
        to_listener,
        from_listener,
    };
    (line, unit)
}

/// The listener's end of a [`channel`].
pub struct ChannelLine {
    name: String,
    now: Duration,
    plugged: bool,
    from_unit: Receiver<(Duration, Heard)>,
    to_unit: Sender<Vec<u8>>,
}

impl Line for ChannelLine {
    fn name(&self) -> &str {
        &self.name
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn hear(&mut self, wait: Duration) -> Heard {
        match self.from_unit.recv_timeout(wait) {
            Ok((at, heard)) => {
                self.now = at;
                match heard {
                    Heard::Unplugged(_) => self.plugged = false,
                    Heard::Plugged => self.plugged = true,
                    _ => {}
                }
                heard
            }
            Err(RecvTimeoutError::Timeout) => Heard::Silence,
            Err(RecvTimeoutError::Disconnected) => {
                // A closed channel answers at once: without the wait its listener would spin.
                std::thread::sleep(wait);
                Heard::Ended
            }
        }
    }

    fn say(&mut self, bytes: &[u8]) -> io::Result<()> {
        if !self.plugged {
            return Err(io::Error::new(io::ErrorKind::NotConnected, "unplugged"));
        }
        let gone = |_| io::Error::new(io::ErrorKind::BrokenPipe, "the run has ended");
        self.to_unit.send(bytes.to_vec()).map_err(gone)
    }
}

/// The listener is gone: the unit may stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the console was closed")]
pub struct Closed;

/// The unit's end of a [`channel`]. Every `at` is the unit's time, which also moves the listener's clock.
pub struct UnitEnd {
    to_listener: SyncSender<(Duration, Heard)>,
    from_listener: Receiver<Vec<u8>>,
}

impl UnitEnd {
    /// Sends what the unit said; waits while the listener is too far behind. No bytes only move the clock.
    ///
    /// # Errors
    /// [`Closed`] when nobody listens any more.
    pub fn send(&self, at: Duration, bytes: &[u8]) -> Result<(), Closed> {
        let heard = match bytes {
            [] => Heard::Silence,
            _ => Heard::Bytes {
                at,
                bytes: bytes.to_vec(),
            },
        };
        self.tell(at, heard)
    }

    /// Pulls the plug.
    ///
    /// # Errors
    /// [`Closed`] when nobody listens any more.
    pub fn unplug(&self, at: Duration, why: &str) -> Result<(), Closed> {
        self.tell(at, Heard::Unplugged(why.to_owned()))
    }

    /// Puts it back.
    ///
    /// # Errors
    /// [`Closed`] when nobody listens any more.
    pub fn plug(&self, at: Duration) -> Result<(), Closed> {
        self.tell(at, Heard::Plugged)
    }

    /// What was said to the unit since the last call; never waits.
    pub fn commands(&self) -> Vec<u8> {
        self.from_listener.try_iter().flatten().collect()
    }

    fn tell(&self, at: Duration, heard: Heard) -> Result<(), Closed> {
        self.to_listener.send((at, heard)).map_err(|_| Closed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: Duration = Duration::from_millis(200);

    #[test]
    fn bytes_arrive_with_the_units_time_and_words_reach_the_unit() {
        let (mut line, unit) = channel("flying");
        assert_eq!(line.hear(Duration::ZERO), Heard::Silence);
        assert_eq!(unit.send(AT, b">ok\r\n"), Ok(()));
        let bytes = b">ok\r\n".to_vec();
        assert_eq!(line.hear(Duration::ZERO), Heard::Bytes { at: AT, bytes });
        assert_eq!(line.now(), AT);
        assert!(line.say(b"G_ST").is_ok());
        assert_eq!(unit.commands(), b"G_ST");
        assert_eq!(unit.commands(), b"");
    }

    #[test]
    fn no_bytes_only_move_the_clock() {
        let (mut line, unit) = channel("flying");
        assert_eq!(unit.send(AT, b""), Ok(()));
        assert_eq!(line.hear(Duration::ZERO), Heard::Silence);
        assert_eq!(line.now(), AT);
    }

    #[test]
    fn words_said_while_unplugged_are_refused_and_never_arrive_late() {
        let (mut line, unit) = channel("flying");
        assert_eq!(unit.unplug(AT, "pulled"), Ok(()));
        assert_eq!(line.hear(Duration::ZERO), Heard::Unplugged("pulled".into()));
        assert!(line.say(b"G_MV").is_err());
        assert_eq!(unit.plug(AT), Ok(()));
        assert_eq!(line.hear(Duration::ZERO), Heard::Plugged);
        assert!(line.say(b"G_ST").is_ok());
        assert_eq!(unit.commands(), b"G_ST");
    }

    #[test]
    fn each_end_learns_that_the_other_is_gone() {
        let (mut line, unit) = channel("flying");
        drop(unit);
        assert_eq!(line.hear(Duration::ZERO), Heard::Ended);
        assert!(line.say(b"G_ST").is_err());
        let (line, unit) = channel("flying");
        drop(line);
        assert_eq!(unit.send(AT, b"x"), Err(Closed));
    }
}
