//! What is said of an aspect, and how it is to be read.

/// Ending of what is said of calibrations.
pub const OF_CALIBRATION: &str = "a calibration beyond its sigmas";

/// What a sum is of.
#[derive(Clone, Debug)]
pub struct Label {
    /// In words.
    pub what: String,
    /// The channels that it is of.
    pub channels: Vec<usize>,
    /// The named effect whose law it is of, where it is of one.
    pub effect: Option<String>,
    /// Whether a named effect claims as much: then less speaks against it too.
    pub is_claimed: bool,
    /// Whether it is a mean over what may not be there at all, and then is zero.
    pub may_be_none: bool,
}

impl Label {
    /// Of some channels, claimed by nothing.
    pub fn of(what: String, channels: Vec<usize>) -> Self {
        Label {
            what,
            channels,
            effect: None,
            is_claimed: false,
            may_be_none: false,
        }
    }

    /// The same, claimed by an effect on the scatter.
    pub fn claimed(self) -> Self {
        Label {
            is_claimed: true,
            ..self
        }
    }

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
