//! What is written about an effect: its name, its physics, its parameters, what it is mistaken for.

use super::sine_response::TURNS_OVER_RAD_S;
use crate::channel::{Kind, UnitDescription};

/// How an effect is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nature {
    /// The readings are smooth in its parameters.
    Smooth,
    /// It is there or not, whatever its parameters: its variants are tried.
    Discrete,
    /// It changes how readings scatter, not what they are.
    Spread,
}

/// How a unit's own calibration corrects an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CorrectedAs {
    /// As what it does to the channel's chain: bias, axis, scale or place.
    Chain,
    /// As a bias per kelvin.
    BiasPerKelvin,
    /// As a scale per kelvin.
    ScalePerKelvin,
    /// As a delay, the same for every channel touched.
    Delay,
    /// As a delay that grows with the place in the reading order.
    Skew,
}

/// What an effect on the scatter looks like to a test that does not ask for its law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Texture {
    /// White noise that is louder: nothing but its size is another.
    Louder,
    /// White noise of which every sample has its own size. A reference that errs makes the same.
    Shapeless,
    /// White noise with a few samples far out.
    Outliers,
    /// A line in the spectrum, of which neither energy nor neighbours say anything.
    Line,
    /// A walk: slow, of no shape in particular.
    Walk,
    /// Its own: nothing else looks like it.
    Own,
}

impl Texture {
    /// Whether every sample only scatters more: errors of a reference do so too.
    pub fn is_shapeless(self) -> bool {
        matches!(self, Texture::Louder | Texture::Shapeless)
    }

    /// Whether it stands for white noise, for its outliers, or for errors of each sample's own.
    pub fn is_white(self) -> bool {
        self.is_shapeless() || self == Texture::Outliers
    }
}

/// What a unit must have, or an effect cannot be in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// A gyro of light: one that sends codes of its own is a vibrating one, whose answer has no Sagnac phase, and one whose range goes
    /// beyond where a sine of the usual size turns over has no such sine.
    Light,
    /// Cycles of one length, counted: rows that bring their own time leave a hole when they are lost, and nothing late.
    Counter,
}

impl Needs {
    /// Whether a unit has it.
    pub fn is_met(self, unit: &UnitDescription) -> bool {
        let may_be_of_light = |range: [f64; 2]| range[0].abs().max(range[1].abs()) <= TURNS_OVER_RAD_S;
        match self {
            Needs::Light => (unit.channels.iter()).any(|channel| {
                channel.sensor == Kind::Gyro && channel.bits.is_none() && may_be_of_light(channel.range)
            }),
            Needs::Counter => unit.cycle_s.is_some(),
        }
    }
}

/// What shares one block of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// A channel.
    Channel,
    /// The channels of a group: a plate, a chip.
    Plate,
    /// The whole unit, or the reference.
    Unit,
}

/// A parameter of one block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Symbol {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Prior standard deviation, in its unit.
    pub prior_sigma: f64,
    /// Whether it can be negative. A fit that wants it to be sees something else.
    pub signed: bool,
}

impl Symbol {
    /// One that may have either sign.
    pub(super) const fn signed(name: &'static str, unit: &'static str, prior_sigma: f64) -> Self {
        Self {
            name,
            unit,
            prior_sigma,
            signed: true,
        }
    }

    /// One that is physically zero or above.
    pub(super) const fn positive(name: &'static str, unit: &'static str, prior_sigma: f64) -> Self {
        Self {
            signed: false,
            ..Self::signed(name, unit, prior_sigma)
        }
    }
}

/// The page of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Page {
    /// As verdicts spell it.
    pub name: &'static str,
    /// What happens physically, in a sentence.
    pub physics: &'static str,
    /// What is done to the reading.
    pub equation: &'static str,
    /// Where equation and sizes come from.
    pub source: &'static str,
    /// What brings it out.
    pub excited_by: &'static str,
    /// Names it is mistaken for. One page of the two need say so ([`super::kin`]).
    pub siblings: &'static [&'static str],
    /// What to do to be sure.
    pub confirm_by: &'static str,
    /// How it is found.
    pub nature: Nature,
    /// What shares parameters.
    pub scope: Scope,
    /// Whether all channels (or plates) may share one block, as when one cause is behind them all.
    pub common: bool,
    /// The kinds of sensor it acts on.
    pub sensors: &'static [Kind],
    /// The parameters of one block.
    pub parameters: &'static [Symbol],
    /// Whether its cause is brought, taken away or switched, so that it may be there for a part of a log. A lag or a
    /// warm-up is a property of its sensor and always there: a stretch of it is the shape of something else.
    pub passes: bool,
    /// [prior sigmas] size beyond which it more likely stands for something else; a unit that was badly calibrated is off by
    /// ten times the usual, a thing that is not this effect at all by any number.
    pub largest: f64,
    /// How the unit's own calibration corrects it; `None` for what is not the unit's to correct.
    pub corrected_as: Option<CorrectedAs>,
    /// What it looks like, of an effect on the scatter.
    pub texture: Texture,
    /// What a unit must have for it.
    pub needs: Option<Needs>,
}

impl Page {
    /// What most pages begin with: smooth, a block a channel.
    pub(super) const SMOOTH: Page = Page {
        name: "",
        physics: "",
        equation: "",
        source: "",
        excited_by: "",
        siblings: &[],
        confirm_by: "",
        nature: Nature::Smooth,
        scope: Scope::Channel,
        common: false,
        sensors: &[],
        parameters: &[],
        passes: false,
        largest: 20.0,
        corrected_as: None,
        texture: Texture::Own,
        needs: None,
    };
}
