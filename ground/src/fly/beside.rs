//! The console at the umbilical of a flying unit.
//!
//! In: a flight that is ready. Out: what was seen of it; it flies in a thread of its own while the user has the terminal, and ends
//! when both do.

use std::{io, path::Path, thread, time::Duration};

use flight::{
    FlyError, TakeOff,
    board::{Remark, Trouble},
    plan::FlyArguments,
    watch::{Seen, Umbilical},
};

use crate::console::{
    self,
    line::{self, UnitEnd},
};

/// Why a flight could not be watched from a console.
#[derive(Debug, thiserror::Error)]
enum Apart {
    /// The thread of the flight.
    #[error("the flight cannot be run beside the console: {0}")]
    Thread(io::Error),
    /// A fault of this program, which has said more on standard error.
    #[error("the flight broke down; please report what is printed above")]
    Broken,
}

impl Umbilical for UnitEnd {
    fn hears(&self, at: Duration, bytes: &[u8]) -> bool {
        self.send(at, bytes).is_ok()
    }

    fn commands(&self) -> Vec<u8> {
        UnitEnd::commands(self)
    }
}

/// Flies while the console talks to the unit; what the unit says is kept in the folder.
///
/// # Errors
/// Those of the flight, then those of the console.
pub fn console(arguments: &FlyArguments, folder: &Path, take_off: TakeOff) -> Result<(Seen, Vec<Remark>), FlyError> {
    let trouble = |why: Trouble| FlyError::Board(why);
    let (line, unit) = line::channel("the flying unit");
    // With an input that ends, a flight whose length was asked for goes on to its end.
    let options = console::Options {
        listen: arguments.duration,
        ..console::Options::default()
    };
    let flying = thread::Builder::new()
        .name("flight".into())
        .spawn(move || take_off(Some(Box::new(unit))))
        .map_err(|error| trouble(Apart::Thread(error).into()))?;
    let talked = console::run(line, &folder.join("umbilical.txt"), options);
    let seen = flying.join().map_err(|_| trouble(Apart::Broken.into()))??;
    talked.map_err(|error| trouble(error.into()))?;
    Ok(seen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::console::line::{Heard, Line};

    #[test]
    fn a_console_hears_the_umbilical_speaks_and_may_be_closed() {
        let (mut line, unit) = line::channel("flying");
        let unit: Box<dyn Umbilical> = Box::new(unit);
        let at = Duration::from_millis(7);
        assert!(unit.hears(at, b">up\n"));
        let heard = line.hear(Duration::ZERO);
        assert!(matches!(heard, Heard::Bytes { bytes, .. } if bytes == b">up\n"));
        line.say(b"G_ST").expect("say");
        assert_eq!(unit.commands(), b"G_ST");
        assert!(unit.hears(at, b""));
        drop(line);
        assert!(!unit.hears(at, b""));
    }
}
