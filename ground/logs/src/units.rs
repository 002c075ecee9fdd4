//! The units that a command is told its file is in.
//!
//! Every reader of numbers checks their size ([`packets::magnitude`]) and refuses what can hardly be in its unit. These
//! options say the unit; then nothing is doubted.

use std::ops::RangeInclusive;

use packets::magnitude::{self, Doubt, Kind, Unit};

/// Units of a file's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, clap::Args)]
pub struct Units {
    /// Unit of the times, where it is not s: ms, us, ns
    #[arg(long, value_name = "UNIT", value_parser = |name: &str| Kind::Time.unit(name))]
    pub times: Option<Unit>,
    /// Unit of the rates, where it is not rad/s: deg/s, mdeg/s, deg/h
    #[arg(long, value_name = "UNIT", value_parser = |name: &str| Kind::Rate.unit(name))]
    pub rates: Option<Unit>,
    /// Unit of the specific forces, where it is not m/s2: g, mg
    #[arg(long, value_name = "UNIT", value_parser = |name: &str| Kind::Force.unit(name))]
    pub forces: Option<Unit>,
    /// Unit of the fields, where it is not uT: gauss, mgauss, nT, T
    #[arg(long, value_name = "UNIT", value_parser = |name: &str| Kind::Field.unit(name))]
    pub fields: Option<Unit>,
}

impl Units {
    /// What was said of a kind of number.
    pub fn told(&self, kind: Kind) -> Option<Unit> {
        match kind {
            Kind::Time => self.times,
            Kind::Rate => self.rates,
            Kind::Force => self.forces,
            Kind::Field => self.fields,
        }
    }

    /// The base units in one of the file's.
    pub fn size(&self, kind: Kind) -> f64 {
        self.told(kind).map_or(1.0, |unit| unit.size)
    }

    /// As [`magnitude::judge`], of numbers in the base unit unless another was said; what was said is believed.
    ///
    /// # Errors
    /// When nothing was said and the number can hardly be in the base unit.
    pub fn judge(&self, what: &str, kind: Kind, observed: f64, possible: RangeInclusive<f64>) -> Result<(), Doubt> {
        match self.told(kind) {
            Some(_) => Ok(()),
            None => magnitude::judge(what, kind, kind.base(), observed, possible),
        }
    }
}
