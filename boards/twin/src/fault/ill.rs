//! What may befall the values of an axis or a sensor, whatever the bus does: the faults that campaigns on readings and logs
//! share.
//!
//! Channels count as in `emems::calibration`: twelve axes of accelerometers, twelve of magnetometers, four gyros.

use emems::calibration::Channel;

/// What befalls values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ill {
    /// Added to an axis \[SI\].
    Bias(Channel, f64),
    /// Added to an axis, growing by so much a second [SI/s].
    Ramp(Channel, f64),
    /// The axis' value is so many times what it should be; -1 is a reversed sign.
    Scale(Channel, f64),
    /// The axis' noise is so many times what it was.
    Noise(Channel, f64),
    /// Two axes have changed places.
    Exchanged(Channel, Channel),
    /// The sensor of this channel repeats its counts.
    Frozen(Channel),
    /// The sensor of this channel sends random words.
    Garbage(Channel),
}

impl Ill {
    /// Its name: that of the word, where the boards can make it too.
    pub fn name(self) -> &'static str {
        match self {
            Ill::Bias(..) => "bias",
            Ill::Ramp(..) => "ramp",
            Ill::Scale(..) => "scale",
            Ill::Noise(..) => "noise",
            Ill::Exchanged(..) => "exchanged",
            Ill::Frozen(_) => "frozen",
            Ill::Garbage(_) => "garbage",
        }
    }
}
