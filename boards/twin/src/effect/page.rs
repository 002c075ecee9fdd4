//! What is written about an effect: its name, its physics, its parameters, what it is mistaken for.

use crate::predict::Kind;

/// How an effect is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nature {
    /// The readings are smooth in its parameters.
    Smooth,
    /// It has no parameters, only variants to try.
    Discrete,
    /// It changes how readings scatter, not what they are.
    Spread,
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
    };
}
