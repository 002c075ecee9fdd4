//! TOML files: a unit's description, a calibration set, a bench's nominal unit. Each is refused, or comes back the same
//! after it was written and read again; a set that fits the unit is one that the unit accepts.

use bench::{nominal::Nominal, set};
use emems::{
    calibration::{self, Ranges},
    unit::Settings,
};
use twin::predict::UnitDescription;

/// The target.
pub fn toml(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    match UnitDescription::read(text, "fuzz.toml") {
        Ok(unit) => {
            let again = UnitDescription::read(&unit.text(), "again.toml").expect("its own text");
            assert_eq!(unit, again);
        }
        Err(error) => assert!(error.to_string().starts_with("fuzz.toml"), "{error}"),
    }
    if let Ok(nominal) = Nominal::parse(text) {
        assert!(nominal.channels.iter().all(|channel| channel.lsb > 0.0));
    }
    if let Ok(set) = set::Set::parse(text) {
        let again = set::Set::parse(&set.text().expect("text")).expect("its own text");
        assert_eq!(set, again);
        let ranges = Ranges::of(&Settings::NOMINAL);
        if let Ok(image) = set::image::image(&set, ranges) {
            let loaded = calibration::Set::load(&image.set.encode(), ranges, image.set.identity.unit);
            assert_eq!(loaded, Ok(image.set));
        }
    }
}
