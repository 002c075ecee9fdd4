//! An effect at a place: which channels it touches, and which parameters hold for which.
//!
//! In: an effect, a [`Locality`] and the unit. Out: blocks of channels, each with its own copy of the effect's parameters,
//! concatenated to `theta` in the order of the blocks.

use core::fmt;

use thiserror::Error;

use super::{Effect, Page, Scope, Site, by_name};
use crate::channel::{Chain, KnownEffect, UnitDescription};

/// Where an effect is.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Locality {
    /// In the unit as a whole, or in its reference.
    Unit,
    /// In all channels (or plates) alike: they share one block of parameters.
    Common,
    /// In all channels (or plates), each with parameters of its own.
    All,
    /// In one plate.
    Group(String),
    /// In one channel.
    Channel(String),
}

impl fmt::Display for Locality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Locality::Unit => "unit",
            Locality::Common => "common",
            Locality::All => "all",
            Locality::Group(name) | Locality::Channel(name) => name,
        })
    }
}

/// A parameter of a cause.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name on the page, and the channel or group where there are several.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Prior standard deviation.
    pub prior_sigma: f64,
    /// Whether it can be negative.
    pub signed: bool,
}

/// Channels that share a block of parameters.
struct Block {
    label: String,
    channels: Vec<usize>,
}

/// An effect of the library at a place.
#[derive(Clone)]
pub struct Cause {
    /// Which.
    pub effect: &'static dyn Effect,
    /// Where.
    pub locality: Locality,
    /// Which of the effect's variants.
    pub variant: f64,
}

impl fmt::Debug for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} at {} ({})", self.effect.page().name, self.locality, self.variant)
    }
}

impl Cause {
    /// The parameters, in the order of `theta`.
    pub fn parameters(&self, unit: &UnitDescription) -> Vec<Parameter> {
        let page = self.effect.page();
        let blocks = blocks(page, &self.locality, unit);
        let one = blocks.len() == 1;
        let named = |block: &Block| {
            let label = if one {
                String::new()
            } else {
                format!("_{}", block.label.replace(' ', "_"))
            };
            page.parameters.iter().map(move |symbol| Parameter {
                name: format!("{}{label}", symbol.name),
                unit: symbol.unit,
                prior_sigma: symbol.prior_sigma,
                signed: symbol.signed,
            })
        };
        blocks.iter().flat_map(named).collect()
    }

    /// The channels it touches, ascending.
    pub fn channels(&self, unit: &UnitDescription) -> Vec<usize> {
        let mut channels: Vec<usize> = blocks(self.effect.page(), &self.locality, unit)
            .into_iter()
            .flat_map(|block| block.channels)
            .collect();
        channels.sort_unstable();
        channels
    }

    /// The channels that parameter `index` of `theta` touches.
    pub fn touched_by(&self, index: usize, unit: &UnitDescription) -> Vec<usize> {
        let page = self.effect.page();
        let block = index / page.parameters.len().max(1);
        let mut blocks = blocks(page, &self.locality, unit);
        if block < blocks.len() {
            blocks.swap_remove(block).channels
        } else {
            Vec::new()
        }
    }
}

/// A cause with its parameters.
#[derive(Clone, Debug)]
pub struct Active {
    /// What and where.
    pub cause: Cause,
    /// Its parameters, as [`Cause::parameters`] lists them. One that is missing is zero.
    pub theta: Vec<f64>,
}

/// A `unit.toml` or a caller names an effect or place that there is not.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum UnknownEffect {
    /// No such effect.
    #[error("effect \"{0}\" is not in the library; see the list of effects")]
    Effect(String),
    /// Not there.
    #[error("effect {effect} cannot be at \"{locality}\" in this unit; it can be at {can}")]
    Locality {
        /// Which.
        effect: &'static str,
        /// Where not.
        locality: String,
        /// Where.
        can: String,
    },
    /// Not this many.
    #[error("effect {effect} at {locality} has {expected} parameters, theta has {found}")]
    Parameters {
        /// Which.
        effect: &'static str,
        /// Where.
        locality: String,
        /// As many as it has.
        expected: usize,
        /// As many as were given.
        found: usize,
    },
}

impl Active {
    /// What a `unit.toml` says the unit has.
    pub fn known(known: &KnownEffect, unit: &UnitDescription) -> Result<Self, UnknownEffect> {
        let effect = by_name(&known.effect).ok_or_else(|| UnknownEffect::Effect(known.effect.clone()))?;
        let localities = effect.localities(unit);
        let name = effect.page().name;
        let Some(locality) = localities
            .iter()
            .find(|locality| locality.to_string() == known.locality)
        else {
            return Err(UnknownEffect::Locality {
                effect: name,
                locality: known.locality.clone(),
                can: localities
                    .iter()
                    .map(Locality::to_string)
                    .collect::<Vec<_>>()
                    .join(", "),
            });
        };
        let cause = Cause {
            effect,
            locality: locality.clone(),
            variant: known.variant,
        };
        let expected = cause.parameters(unit).len();
        if expected != known.theta.len() {
            return Err(UnknownEffect::Parameters {
                effect: name,
                locality: known.locality.clone(),
                expected,
                found: known.theta.len(),
            });
        }
        Ok(Self {
            cause,
            theta: known.theta.clone(),
        })
    }

    /// The entry of a `unit.toml` that says so.
    pub fn to_known(&self) -> KnownEffect {
        KnownEffect {
            effect: self.cause.effect.page().name.to_owned(),
            locality: self.cause.locality.to_string(),
            variant: self.cause.variant,
            theta: self.theta.clone(),
        }
    }

    /// Whether it changes this channel.
    pub fn touches(&self, channel: usize, unit: &UnitDescription) -> bool {
        let page = self.cause.effect.page();
        page.sensors.contains(&unit.channels[channel].sensor) && self.block_of(channel, unit).is_some()
    }

    /// Acts on the chain of a channel, if it touches it.
    pub fn act<'a>(&'a self, site: &Site<'a>, chain: &mut Chain<'a>) {
        let width = self.cause.effect.page().parameters.len();
        if let Some(block) = self.block_of(site.index, site.unit)
            && let Some(theta) = self.theta.get(block * width..(block + 1) * width)
        {
            self.cause.effect.act(theta, self.cause.variant, site, chain);
        }
    }

    fn block_of(&self, channel: usize, unit: &UnitDescription) -> Option<usize> {
        blocks(self.cause.effect.page(), &self.cause.locality, unit)
            .iter()
            .position(|block| block.channels.contains(&channel))
    }
}

/// The channels in question, by what shares parameters.
fn blocks(page: &Page, locality: &Locality, unit: &UnitDescription) -> Vec<Block> {
    let concerned = |wanted: &dyn Fn(usize) -> bool| -> Vec<usize> {
        let all = 0..unit.channels.len();
        all.filter(|&i| page.sensors.contains(&unit.channels[i].sensor) && wanted(i))
            .collect()
    };
    let each = |channels: Vec<usize>| -> Vec<Block> {
        let block = |i: usize| Block {
            label: unit.channels[i].name.clone(),
            channels: vec![i],
        };
        channels.into_iter().map(block).collect()
    };
    let group = |name: &str| Block {
        label: name.to_owned(),
        channels: concerned(&|i| unit.channels[i].group == name),
    };
    let blocks = match (locality, page.scope) {
        (Locality::Unit | Locality::Common, _) => vec![Block {
            label: String::new(),
            channels: concerned(&|_| true),
        }],
        (Locality::All, Scope::Channel) => each(concerned(&|_| true)),
        (Locality::All, _) => unit.groups().into_iter().map(group).collect(),
        (Locality::Group(name), Scope::Channel) => each(group(name).channels),
        (Locality::Group(name), _) => vec![group(name)],
        (Locality::Channel(name), _) => each(concerned(&|i| unit.channels[i].name == *name)),
    };
    blocks.into_iter().filter(|block| !block.channels.is_empty()).collect()
}

/// Where an effect of this page can be: no two of these places are the same.
pub(super) fn localities(page: &Page, unit: &UnitDescription) -> Vec<Locality> {
    if page.scope == Scope::Unit {
        let all = blocks(page, &Locality::Unit, unit);
        return if all.is_empty() {
            Vec::new()
        } else {
            vec![Locality::Unit]
        };
    }
    let mut localities = Vec::new();
    let channels = blocks(page, &Locality::Common, unit)
        .into_iter()
        .flat_map(|block| block.channels);
    let channels: Vec<usize> = channels.collect();
    if page.scope == Scope::Channel {
        localities.extend(
            channels
                .iter()
                .map(|&i| Locality::Channel(unit.channels[i].name.clone())),
        );
    }
    let groups: Vec<&str> = unit.groups();
    let size = |name: &str| channels.iter().filter(|&&i| unit.channels[i].group == name).count();
    let smallest = if page.scope == Scope::Channel { 2 } else { 1 };
    let peopled: Vec<&str> = groups.into_iter().filter(|name| size(name) > 0).collect();
    let offered = peopled.iter().filter(|name| size(name) >= smallest);
    localities.extend(offered.map(|name| Locality::Group((*name).to_owned())));
    let several = channels.len() > 1;
    if several && peopled.len() > 1 {
        localities.push(Locality::All);
    }
    if page.common && several && (page.scope == Scope::Channel || peopled.len() > 1) {
        localities.push(Locality::Common);
    }
    localities
}
