//! What is said of an aspect, and how it is to be read.

/// Ending of what is said of calibrations.
pub const OF_CALIBRATION: &str = "a calibration beyond its sigmas";

/// What a sum is of.
#[derive(Clone, Debug)]
pub struct Label {
    /// In words.
    pub what: String,
    /// The channel it belongs to, where there is one.
    pub channel: Option<usize>,
    /// Whether a named effect claims as much: then less speaks against it too.
    pub is_claimed: bool,
    /// Whether it is a mean over what may not be there at all, and then is zero.
    pub may_be_none: bool,
}

impl Label {
    /// Whether it is an energy that a named effect claims.
    pub fn is_energy_claimed(&self) -> bool {
        self.is_claimed && !self.may_be_none
    }

    /// Whether it is how far the fitted calibration is off.
    pub fn is_of_calibration(&self) -> bool {
        self.what.ends_with(OF_CALIBRATION)
    }
}

/// A kind of sensors in words.
pub fn name_of(kind: usize) -> &'static str {
    const NAMES: [&str; 4] = ["accelerometers", "gyros", "magnetometers", "thermometers"];
    NAMES.get(kind).copied().unwrap_or("sensors")
}
