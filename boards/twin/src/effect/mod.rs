//! The physical effects a unit may have and its nominal twin lacks: one file a piece of physics, one trait.
//!
//! The same entry of [`LIBRARY`] injects an effect into a prediction, is fitted to a log, and is what the report prints.
//! An [`Effect`] says on its [`Page`] what it is, and in [`Effect::act`] what it does to the [`Chain`] of one channel, given
//! the parameters of its block. A [`Cause`] is an effect at a [`Locality`] (and, for an effect with a parameter that is not
//! smooth, at one [`Effect::variants`] of it); an [`Active`] is a cause with its parameters. In use:
//!
//! ```text
//! for effect in LIBRARY
//!   for locality in effect.localities(unit)          one sensor, one plate, each its own, all alike, the unit
//!     for variant in effect.variants(log_s)          usually one: 0
//!       cause = Cause { effect, locality, variant }
//!       cause.parameters(unit)                       names, units, prior sigmas; theta = 0 is "no effect"
//!       twin.predict(&[Active { cause, theta }])     readings of every channel
//!       twin.jacobian(&[Active { cause, theta }], 0) derivatives, only of the channels it touches
//! ```
//!
//! [`Nature`] tells how an effect is found: a `Smooth` one by its Jacobian; a `Discrete` one by trying its variants (it has
//! no parameters); a `Spread` one by the likelihood of the residual ([`Effect::log_likelihood`]), for it changes how readings
//! scatter and not what they are.

mod bias;
mod cause;
mod lever_arm;
mod page;
mod scale;

pub use cause::{Active, Cause, Locality, Parameter, UnknownEffect};
pub use page::{Nature, Page, Scope, Symbol};

use crate::environment::Environment;
use crate::predict::{Chain, Channel, UnitDescription};

/// All effects, in the order of their pages.
pub const LIBRARY: &[&dyn Effect] = &[&bias::GyroBias, &scale::GyroScale, &lever_arm::LeverArm];

/// The effect of that name.
pub fn by_name(name: &str) -> Option<&'static dyn Effect> {
    LIBRARY.iter().copied().find(|effect| effect.page().name == name)
}

/// Where an effect acts when it acts on one channel.
#[derive(Clone, Copy)]
pub struct Site<'a> {
    /// The unit.
    pub unit: &'a UnitDescription,
    /// Index of the channel.
    pub index: usize,
    /// The channel.
    pub channel: &'a Channel,
    /// Where the unit is.
    pub environment: &'a Environment,
    /// [s] first and last cycle of the log.
    pub log_s: (f64, f64),
}

/// A physical effect.
pub trait Effect: Sync {
    /// What it is.
    fn page(&self) -> &'static Page;

    /// Changes the chain of one channel. `theta` is the block of parameters that holds for this channel, in the order of
    /// the page; zero is no effect.
    fn act<'a>(&self, theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>);

    /// The values to try of a parameter in which the effect is not smooth (an onset, a time constant, a choice), for a log
    /// from the first to the second instant [s].
    fn variants(&self, _log_s: (f64, f64)) -> Vec<f64> {
        vec![0.0]
    }

    /// Where it can be in this unit.
    fn localities(&self, unit: &UnitDescription) -> Vec<Locality> {
        cause::localities(self.page(), unit)
    }
}
