//! The calibration set over the umbilical: taken word by word, used when whole and sound, read back.
//!
//! A set in use is that of this unit and these ranges, or the one compiled in; any error leaves it as it was. G_CL with
//! G_CK makes it last: over a reset it stands in retained memory, over a power cut the recorder keeps it; G_CX with G_CK goes
//! back to the one compiled in. The estimation begins afresh with it in the next cycle, the log names it from its next record on.
//! Words that are taken are not answered: 284 answers would only lengthen the line's queue, and what
//! was lost is named when the set is to be used.

use core::fmt::{self, Write as _};

use super::shared::Shared;
use crate::{
    board::Retained,
    calibration::{
        ENCODED_BYTES, Ranges, Set,
        load::{Arriving, NotLoaded, WORDS},
    },
    command::Command,
    flight_log::record::Name,
    retained::SET,
};

/// Bytes a line of the set read back.
const LINE_BYTES: usize = 32;

/// Carries out a calibration command.
pub async fn answer(shared: &Shared, memory: &impl Retained, arriving: &mut Arriving, command: Command) {
    match command {
        Command::SetWord { place, bytes } => {
            if !arriving.take(place, bytes) {
                shared.say(format_args!("G_CW no: a set has no place {place:04X}"));
            }
        }
        Command::LoadSet => load(shared, memory, arriving),
        Command::ForgetSet => forget(shared, memory),
        _ => {
            let bytes = shared.calibration.get().encode();
            for (place, bytes) in (0..WORDS).step_by(LINE_BYTES / 4).zip(bytes.chunks(LINE_BYTES)) {
                shared.tell(format_args!("G_CR {place:04X} {}", Hex(bytes))).await;
            }
        }
    }
}

/// The set that was sent, if it may be used.
pub fn sent(shared: &Shared, arriving: &Arriving) -> Result<Set, NotLoaded> {
    let unit = shared.calibration.get().identity.unit;
    arriving.set(Ranges::of(&shared.settings), unit)
}

fn load(shared: &Shared, memory: &impl Retained, arriving: &mut Arriving) {
    match sent(shared, arriving) {
        Ok(set) => {
            shared.use_set(&set, name(&set));
            shared.set_to_keep.set(true);
            *arriving = Arriving::default();
            SET.keep(memory, &set.encode());
            shared.say(format_args!(
                "G_CL ok: set {} of unit {}",
                set.identity.set, set.identity.unit
            ));
        }
        Err(why) => shared.say(format_args!("G_CL no: {why}")),
    }
}

fn forget(shared: &Shared, memory: &impl Retained) {
    let set = Set::compiled_in(Ranges::of(&shared.settings));
    shared.use_set(&set, compiled_name(shared));
    shared.set_to_keep.set(true);
    SET.keep(memory, &[]);
    shared.say(format_args!("G_CX ok: set {} as compiled in", set.identity.set));
}

fn compiled_name(shared: &Shared) -> Name {
    shared.settings.calibration.chars().take(16).collect()
}

/// Takes the set that was in use before a reset.
pub fn recall(shared: &Shared, memory: &impl Retained) {
    let mut bytes = [0; ENCODED_BYTES];
    match SET.recall(memory, &mut bytes) {
        Some([]) => shared.set_known.set(true),
        Some(kept) => take_kept(shared, kept),
        None => {}
    }
}

/// Takes a set that was kept, unless it is not this unit's any more: then the one compiled in goes on, and it is said.
pub fn take_kept(shared: &Shared, kept: &[u8]) {
    let unit = shared.calibration.get().identity.unit;
    match Set::load(kept, Ranges::of(&shared.settings), unit) {
        Ok(set) => shared.use_set(&set, name(&set)),
        Err(why) => shared.say(format_args!("calibration kept is not used: {why}")),
    }
}

/// The set in use as the recorder is to keep it: `None` for the one compiled in.
pub fn to_keep(shared: &Shared) -> Option<[u8; ENCODED_BYTES]> {
    let loaded = shared.set_name() != compiled_name(shared);
    loaded.then(|| shared.calibration.get().encode())
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
