//! Ctrl-C ends a flight, not the program: what was flown is kept whole, with its page and its summary.
//!
//! In: the interrupt, or the request to terminate, from the operating system. Out: an [`Interrupt`] that the watcher looks
//! at. A second one ends the program at once, for a flight that does not come to its next step.

use std::{
    process,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

/// What a shell reports of a program that an interrupt ended: 128 + SIGINT.
const EXIT_CODE: i32 = 130;

/// Whether the flight is to end.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Listens from now on.
    ///
    /// # Errors
    /// When the operating system lets nobody listen, or somebody listens already.
    pub fn listen() -> Result<Self, ctrlc::Error> {
        let interrupt = Interrupt::default();
        let heard = interrupt.clone();
        ctrlc::set_handler(move || {
            if heard.raise() {
                process::exit(EXIT_CODE);
            }
        })?;
        Ok(interrupt)
    }

    /// Ends the flight; whether that was asked for before.
    pub fn raise(&self) -> bool {
        self.0.swap(true, Ordering::Relaxed)
    }

    /// Whether the flight is to end.
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
