//! The calibration set over the umbilical: taken word by word, used when whole and sound, read back.
//!
//! A set in use is that of this unit and these ranges, or the one compiled in; any error leaves it as it was. The
//! estimation begins afresh with it in the next cycle, the log names it from its next record on. It lasts until the next
//! start. Words that are taken are not answered: 284 answers would only lengthen the line's queue, and what
//! was lost is named when the set is to be used.

use core::fmt::{self, Write as _};

use super::shared::Shared;
use crate::{
    calibration::{Ranges, Set},
    command::Command,
    flight_log::record::Name,
};

/// Bytes a line of the set read back.
const LINE_BYTES: usize = 32;

/// Carries out a calibration command.
pub async fn answer(shared: &Shared, command: Command) {
    match command {
        Command::SetWord { place, bytes } => {
            if !shared.arriving.borrow_mut().take(place, bytes) {
                shared.say(format_args!("G_CW no: a set has no place {place:04X}"));
            }
        }
        Command::LoadSet => load(shared),
        _ => {
            let bytes = shared.calibration.borrow().encode();
            for (line, bytes) in bytes.chunks(LINE_BYTES).enumerate() {
                let place = line * LINE_BYTES / 4;
                shared.tell(format_args!("G_CR {place:04X} {}", Hex(bytes))).await;
            }
        }
    }
}

fn load(shared: &Shared) {
    let unit = shared.calibration.borrow().identity.unit;
    let sent = shared.arriving.borrow().set(Ranges::of(&shared.settings), unit);
    match sent {
        Ok(set) => {
            *shared.calibration.borrow_mut() = set;
            *shared.set_name.borrow_mut() = name(&set);
            shared.set_loaded.set(true);
            shared.arriving.take();
            shared.say(format_args!(
                "G_CL ok: set {} of unit {}",
                set.identity.set, set.identity.unit
            ));
        }
        Err(why) => shared.say(format_args!("G_CL no: {why}")),
    }
}

/// Number and checksum, which tell sets apart that were given one number.
fn name(set: &Set) -> Name {
    let mut name = Name::new();
    // A number of more than seven digits leaves no room for the whole checksum.
    let _ = write!(name, "{}:{:08X}", set.identity.set, set.checksum());
    name
}

struct Hex<'a>(&'a [u8]);

impl fmt::Display for Hex<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}
