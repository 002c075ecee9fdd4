//! What the superblock keeps of what a launch crew told: the rail and the site that the unit's next start begins with.
//!
//! In: the pages of an image, in order. Out: [`NewestSave`]: epoch, rail and site of the newest save, and whether the unit would believe it.
//! A unit that finds one copy of its newest save alone, or a torn page beside it, starts without rail and site, because a newer save may
//! have said otherwise (`FlightLog::mount`). Saves of firmware older than a word have zeros in its place, as those have that were told
//! nothing. A dump has no superblock.

use core::fmt;

use emems::{
    command::{Command, word_of},
    flight_log::{LOG_START, superblock::Superblock},
    nand::PageAddress,
    rail::Rail,
    site::{self, Site},
};

/// Pages of a save: two in a row hold the same.
const COPIES: usize = 2;

/// The newest save, as far as a crew's words go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NewestSave {
    /// How often the log was erased.
    pub epoch: u16,
    /// The launch rail; zeros where there is none.
    pub rail: Rail,
    /// The launch site; zeros where it is the one that is compiled in.
    pub site: site::Told,
    /// Both copies are whole, and no page beside them is torn.
    pub is_sure: bool,
}

/// What there is of a superblock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InSuperblock {
    /// A dump has none.
    #[default]
    Dump,
    /// An image in which none is whole.
    Lost,
    /// The newest save of an image.
    Save(NewestSave),
}

impl InSuperblock {
    /// What the unit's next start begins with, in lines, with the sigmas that were told.
    pub fn lines(&self) -> Vec<String> {
        let kept = match self {
            InSuperblock::Dump => {
                return vec![
                    "kept       no superblock is in a dump: which launch rail and site the next start begins with stands in an image of the chip"
                        .into(),
                ];
            }
            InSuperblock::Lost => {
                return vec![
                    "kept       no superblock is whole: the next start begins without launch rail and site".into(),
                ];
            }
            InSuperblock::Save(kept) => kept,
        };
        let NewestSave { rail, site, .. } = kept;
        let rail_line = line(rail.is_none(), rail, rail.fault(), word_of(Command::Rail(*rail)));
        let site_line = line(site.is_none(), site, site.fault(), word_of(Command::Site(*site)));
        let mut lines = vec![
            format!("kept       launch rail: {rail_line}"),
            format!("           launch site: {site_line}"),
        ];
        if !kept.is_sure {
            lines.push("           a newer save may be lost: the next start begins without them".into());
        }
        lines
    }

    /// The same for programs; null where there is no save.
    pub fn json(&self) -> serde_json::Value {
        let InSuperblock::Save(kept) = self else {
            return serde_json::Value::Null;
        };
        let NewestSave { rail, site, .. } = kept;
        let parts = |number: u16, parts: f64| f64::from(number) / parts;
        let rail_json = (!rail.is_none()).then(|| {
            serde_json::json!({
                "azimuth_deg": parts(rail.azimuth, 100.0),
                "elevation_deg": parts(rail.elevation, 100.0),
                "azimuth_sigma_deg": parts(rail.azimuth_sd.into(), 10.0),
                "elevation_sigma_deg": parts(rail.elevation_sd.into(), 10.0),
                "fault": rail.fault(),
            })
        });
        // Numbers of at most three decimals, which an f32 does not have.
        let told = |number: f32| (1e3 * f64::from(number)).round() / 1e3;
        let place = site.site(&Site::LABORATORY);
        let site_json = place.launch.filter(|_| !site.is_none()).map(|launch| {
            serde_json::json!({
                "gravity_m_s2": told(place.gravity),
                "latitude_deg": told(place.latitude_deg),
                "declination_deg": told(place.declination_deg),
                "dip_deg": told(launch.dip_deg),
                "field_sigma_deg": told(launch.sd_deg),
                "field_ut": told(launch.norm_ut),
                "iron_sigma_ut": told(launch.iron_sd_ut),
                "bias_per_g_sigma_deg_s": told(launch.bias_per_g_deg_s),
                "fault": site.fault(),
            })
        });
        serde_json::json!({ "rail": rail_json, "site": site_json, "sure": kept.is_sure })
    }
}

/// What is told in words. The unit takes no impossible number from its memory, either.
fn line(is_none: bool, told: impl fmt::Display, fault: Option<&str>, word: &[u8]) -> String {
    match fault {
        _ if is_none => format!(
            "none; none was told, or the firmware is older than the word {}",
            String::from_utf8_lossy(word)
        ),
        Some(fault) => format!("{told}; the unit does not take it: {fault}"),
        None => told.to_string(),
    }
}

/// The saves of an image while it is read.
#[derive(Debug, Default)]
pub struct Saves {
    newest: Option<Superblock>,
    /// Pages of the superblock's blocks up to the first blank one of each: the unit reads no other.
    read: [u8; LOG_START as usize],
    /// Of those, the whole ones of the newest save.
    copies: usize,
    /// Of those, the blocks of any that hold no whole save, or not in its place.
    torn: Vec<u16>,
}

impl Saves {
    /// Takes a page that is not blank, with the save that is whole in it; `is_tagged` as a page of the superblock.
    pub fn take(&mut self, at: PageAddress, save: Option<Superblock>, is_tagged: bool) {
        let next = self.read.get_mut(usize::from(at.block));
        let is_read = next.is_some_and(|next| {
            let is_next = *next == at.page;
            *next += u8::from(is_next);
            is_next
        });
        if is_read && !(is_tagged && save.is_some()) {
            self.torn.push(at.block);
        }
        let Some(save) = save else { return };
        let newest = self.newest.as_ref().map(|newest| newest.number);
        if newest.is_none_or(|number| number < save.number) {
            (self.newest, self.copies) = (Some(save), usize::from(is_read));
        } else if newest == Some(save.number) {
            self.copies += usize::from(is_read);
        }
    }

    /// The newest one, where there is any.
    pub fn newest(self) -> Option<NewestSave> {
        let newest = self.newest?;
        // What a retired block holds is no news.
        let is_torn = self.torn.iter().any(|block| !newest.bad.contains(*block));
        Some(NewestSave {
            epoch: newest.epoch,
            rail: newest.rail,
            site: newest.site,
            is_sure: self.copies >= COPIES && !is_torn,
        })
    }
}

#[cfg(test)]
mod tests;
