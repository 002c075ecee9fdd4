//! The launch site over the umbilical: G_SI with G_CK.
//!
//! A site in use lasts over a reset, in retained memory, and over a power cut, in the recorder's superblock: that one is taken at the
//! first mount after power-on and never after a command. The estimation begins afresh with it, as with another calibration set:
//! attitude, bias and field were found by gravity, north and field of the site before, and a pad has the second that it takes to find them
//! again. A unit in flight is never changed: a site that comes too late for WAIT is taken in the next one, or where there is no
//! attitude to lose. The log keeps the numbers, and with which cycle it began.

use super::shared::Shared;
use crate::{
    board::Retained,
    mode::Cause,
    retained::SITE,
    site::{Told, told::SITE_BYTES},
};

/// Has the estimation take a site, whose numbers were looked at when it was armed.
pub fn set(shared: &Shared, site: Told) {
    shared.site_known.set(true);
    shared.site_told.set(Some(site));
    shared.say(format_args!("G_SI ok: {site}"));
}

/// Uses the site that was in use before a reset, from the first cycle on.
pub fn recall(shared: &Shared, memory: &impl Retained) {
    let mut bytes = [0; SITE_BYTES];
    if SITE.recall(memory, &mut bytes).map(<[u8]>::len) == Some(SITE_BYTES) {
        shared.site_known.set(true);
        begin(shared, Told::of_bytes(bytes), 0);
    }
}

/// Has the estimation take the site that was in use before a power cut, unless another is known.
pub fn found(shared: &Shared, site: Told) {
    if shared.site_known.replace(true) || site.is_none() || site.fault().is_some() {
        return;
    }
    shared.site_told.set(Some(site));
    shared.say(format_args!("site as before the power cut"));
    shared.say(format_args!("site {site}"));
}

/// Whether the estimation begins afresh at another site with the cycle that began at `start_us`; `may_begin`: there is no attitude to lose.
pub fn take(shared: &Shared, memory: &impl Retained, may_begin: bool, start_us: u64) -> bool {
    let Some(site) = shared.site_told.get().filter(|_| may_begin) else {
        return false;
    };
    shared.site_told.set(None);
    SITE.keep(memory, site.bytes());
    begin(shared, site, start_us);
    true
}

fn begin(shared: &Shared, site: Told, start_us: u64) {
    shared.site_in_use.set(site);
    shared.note_at(start_us, Cause::SiteTaken(site));
    shared.say(format_args!("site taken"));
}
