//! Whether numbers can be in the unit that they are said to be in.
//!
//! In: what was observed (a median, a largest value, a step), the unit it is declared to be in, and what is possible: the
//! part's range, gravity at rest, the Earth's field, or the scale of a unit's description. Out: nothing, or a [`Doubt`] that
//! says what was observed and expected, and in which other unit the numbers would be right. A wrong unit is off by a known
//! factor (57.3 for deg/s, 9.81 for g, 100 for gauss, 1000 for ms and nT); so all readers ask the same two questions:
//!
//! - [`judge`]: is a value within its limits, and if not, in which unit would it be?
//! - [`likely`]: two scales that should agree do not; is their ratio that of two units?
//!
//! What a doubt means is the caller's business: readers refuse, unless they were told the unit on the command line.

use std::{fmt, ops::RangeInclusive};

/// [m/s2] a gram-force (3rd CGPM, 1901).
pub const G: f64 = emems::sensor::lis331hh::STANDARD_GRAVITY_F64;

/// A unit: its name on the command line and what one of it is in the base unit (s, rad/s, m/s2, uT).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// As written.
    pub name: &'static str,
    /// In the base unit.
    pub size: f64,
}

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Times \[s\].
    Time,
    /// Angular rates \[rad/s\].
    Rate,
    /// Specific force \[m/s2\].
    Force,
    /// Magnetic field \[uT\].
    Field,
}

const fn unit(name: &'static str, size: f64) -> Unit {
    Unit { name, size }
}

/// Base unit first, then by how often they are met.
const TIMES: [Unit; 4] = [unit("s", 1.0), unit("ms", 1e-3), unit("us", 1e-6), unit("ns", 1e-9)];
const RATES: [Unit; 4] = [
    unit("rad/s", 1.0),
    unit("deg/s", std::f64::consts::PI / 180.0),
    unit("mdeg/s", std::f64::consts::PI / 180e3),
    unit("deg/h", std::f64::consts::PI / 648e3),
];
const FORCES: [Unit; 3] = [unit("m/s2", 1.0), unit("g", G), unit("mg", 1e-3 * G)];
const FIELDS: [Unit; 5] = [
    unit("uT", 1.0),
    unit("gauss", 100.0),
    unit("nT", 1e-3),
    unit("mgauss", 0.1),
    unit("T", 1e6),
];

impl Kind {
    /// The base unit first.
    pub fn units(self) -> &'static [Unit] {
        match self {
            Kind::Time => &TIMES,
            Kind::Rate => &RATES,
            Kind::Force => &FORCES,
            Kind::Field => &FIELDS,
        }
    }

    /// The base unit.
    pub fn base(self) -> Unit {
        self.units()[0]
    }

    /// The option by which a command is told the unit.
    pub fn option(self) -> &'static str {
        match self {
            Kind::Time => "--times",
            Kind::Rate => "--rates",
            Kind::Force => "--forces",
            Kind::Field => "--fields",
        }
    }

    /// A unit by its name.
    ///
    /// # Errors
    /// When there is none, with those there are.
    pub fn unit(self, name: &str) -> Result<Unit, String> {
        let found = self.units().iter().find(|unit| unit.name.eq_ignore_ascii_case(name));
        found.copied().ok_or_else(|| {
            let names: Vec<&str> = self.units().iter().map(|unit| unit.name).collect();
            format!("no unit {name:?}; there are {}", names.join(", "))
        })
    }

    /// What is possible in the base unit, whatever the part: `None` for what has no least or no typical size.
    ///
    /// Force at rest is near one g: half to twice, so that a scale error or a push does not matter, and no other unit of the
    /// list falls within. The field is the Earth's (22 to 67 uT, IGRF-13) with iron of a building or a unit around it. Rates
    /// reach 2,000 deg/s with common parts. A step of more than half a second carries no attitude; 100 kHz is no log.
    pub fn possible(self) -> RangeInclusive<f64> {
        match self {
            Kind::Time => 1e-5..=0.5,
            Kind::Rate => 0.0..=2_100_f64.to_radians(),
            Kind::Force => 0.5 * G..=2.0 * G,
            Kind::Field => 8.0..=200.0,
        }
    }
}

/// Two scales whose ratio is this near to that of two units are taken to differ by them: between the nearest units of a
/// list lies a factor of 9.8.
const SAME_RATIO: f64 = 1.5;

/// Numbers that can hardly be in the unit that was said.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubt {
    /// What was looked at, as a sentence's beginning.
    pub what: String,
    /// What it is about.
    pub kind: Kind,
    /// The unit it is declared to be in.
    pub declared: Unit,
    /// Observed, in the declared unit.
    pub observed: f64,
    /// Possible, in the declared unit.
    pub possible: (f64, f64),
    /// In which unit it would be right.
    pub likely: Option<Unit>,
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (unit, (low, high)) = (self.declared.name, self.possible);
        write!(f, "{} is {} {unit}, ", self.what, digits(self.observed))?;
        if low > 0.0 {
            write!(f, "where {} to {} is possible", digits(low), digits(high))?;
        } else {
            write!(f, "where at most {} is possible", digits(high))?;
        }
        let option = self.kind.option();
        match self.likely {
            Some(likely) => write!(
                f,
                "; it looks like {name}: say {option} {name} if it is, {option} {unit} if not",
                name = likely.name
            ),
            None => write!(f, "; say {option} with the unit it is in"),
        }
    }
}

impl std::error::Error for Doubt {}

/// Is a value, declared to be in a unit, within what is possible (in the base unit)?
///
/// # Errors
/// With the unit in which it would be, if there is one.
pub fn judge(
    what: &str,
    kind: Kind,
    declared: Unit,
    observed: f64,
    possible: RangeInclusive<f64>,
) -> Result<(), Doubt> {
    let within = |unit: Unit| possible.contains(&(observed * unit.size));
    if within(declared) {
        return Ok(());
    }
    Err(Doubt {
        what: what.into(),
        kind,
        declared,
        observed,
        possible: (possible.start() / declared.size, possible.end() / declared.size),
        likely: kind
            .units()
            .iter()
            .copied()
            .find(|unit| *unit != declared && within(*unit)),
    })
}

/// What a ratio that should be 1 says of the units: which of them is another, when the ratio is near to that of the two.
/// The ratio is true over assumed: numbers in deg/s that are taken for rad/s give 0.0175.
pub fn likely(ratio: f64, declared: &[(Kind, Unit)]) -> Option<(Kind, Unit)> {
    let all = declared.iter().flat_map(|(kind, declared)| {
        let others = kind.units().iter().filter(move |unit| *unit != declared);
        others.map(move |unit| (*kind, *unit, unit.size / declared.size))
    });
    let off = |factor: f64| (ratio / factor).ln().abs();
    all.filter(|(_, _, factor)| off(*factor) < SAME_RATIO.ln())
        .min_by(|a, b| off(a.2).total_cmp(&off(b.2)))
        .map(|(kind, unit, _)| (kind, unit))
}

/// Four significant digits, without the zeros nobody reads.
pub fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let exponent = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&exponent) {
        return format!("{value:.3e}");
    }
    let text = format!("{value:.decimals$}", decimals = (3.0 - exponent).max(0.0) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}

/// The median; `None` of nothing.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looks_like(kind: Kind, observed: f64) -> Option<&'static str> {
        let doubt = judge("it", kind, kind.base(), observed, kind.possible()).err()?;
        Some(doubt.likely.map_or("nothing known", |unit| unit.name))
    }

    #[test]
    fn a_unit_that_is_off_by_a_known_factor_is_named() {
        assert_eq!(looks_like(Kind::Force, 1.0), Some("g"));
        assert_eq!(looks_like(Kind::Force, 1000.0), Some("mg"));
        assert_eq!(looks_like(Kind::Field, 0.232), Some("gauss"));
        assert_eq!(looks_like(Kind::Field, 23_200.0), Some("nT"));
        assert_eq!(looks_like(Kind::Rate, 200.0), Some("deg/s"));
        assert_eq!(looks_like(Kind::Time, 3.5), Some("ms"));
        assert_eq!(looks_like(Kind::Time, 3500.0), Some("us"));
    }

    #[test]
    fn what_is_right_is_not_doubted_and_what_nothing_explains_says_so() {
        for (kind, observed) in [
            (Kind::Force, 9.79),
            (Kind::Field, 23.2),
            (Kind::Field, 65.0),
            (Kind::Rate, 5.6),
            (Kind::Time, 0.2),
            (Kind::Time, 1.0 / 285.7),
        ] {
            assert_eq!(looks_like(kind, observed), None, "{kind:?} {observed}");
        }
        assert_eq!(looks_like(Kind::Force, 0.0), Some("nothing known"));
    }

    #[test]
    fn a_doubt_says_what_to_do() {
        let doubt = judge(
            "force at rest",
            Kind::Force,
            Kind::Force.base(),
            1.0,
            Kind::Force.possible(),
        );
        assert_eq!(
            doubt.expect_err("g").to_string(),
            "force at rest is 1 m/s2, where 4.903 to 19.61 is possible; it looks like g: say --forces g if it is, \
             --forces m/s2 if not"
        );
    }

    #[test]
    fn a_ratio_of_two_scales_names_the_unit_that_is_another() {
        let rates = [(Kind::Rate, Kind::Rate.base()), (Kind::Time, Kind::Time.base())];
        let name = |ratio: f64| likely(ratio, &rates).map(|(_, unit)| unit.name);
        assert_eq!(name(13.69 / 782.0), Some("deg/s"));
        assert_eq!(name(1.1e-3), Some("ms"));
        assert_eq!((name(0.5), name(1.0)), (None, None));
        let degrees = [(Kind::Rate, RATES[1])];
        assert_eq!(
            likely(44_944.0 / 782.0, &degrees).map(|(_, unit)| unit.name),
            Some("rad/s")
        );
    }

    #[test]
    fn numbers_are_short_and_the_median_is_not_moved_by_a_wild_one() {
        assert_eq!(
            [1.0, 0.01745, 57.2958, 23_200.0, 1e-6, 0.0].map(digits),
            ["1", "0.01745", "57.3", "23200", "1.000e-6", "0"]
        );
        assert_eq!(median([1.0, 2.0, 1e9, f64::NAN]), Some(2.0));
        assert_eq!(median([]), None);
    }
}
