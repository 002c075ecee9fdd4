//! Where a recorded motion took place, and what a launch crew there tells the unit of it.
//!
//! In: gravity, latitude, field and temperature, each or none, of the command line and of the case beside the motion. Out: an
//! [`Environment`]; what neither names is the laboratory's. And the [`Site`] that a crew with a model of that field tells ([`told`]).
//! Refuses what no place on Earth has: a typing error would otherwise fly as a strange unit.

use std::ops::RangeInclusive;

use emems::site::{self, Launch, Site};
use twin::environment::Environment;

use crate::case::text::PlaceBeside;

/// [m/s2] none in free fall, and no more than anywhere on Earth by far.
const GRAVITY: RangeInclusive<f64> = 0.0..=10.0;
/// \[deg\]
const LATITUDE: RangeInclusive<f64> = -90.0..=90.0;
/// \[uT\] the strongest field at the surface is 67.
const FIELD: RangeInclusive<f64> = -100.0..=100.0;
/// \[degC\] what the parts are specified for (LIS331HH datasheet: -40 to 85).
const TEMPERATURE: RangeInclusive<f64> = -40.0..=85.0;

/// The place of a recorded motion.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(
    next_help_heading = "Where a --motion-file took place [default: as the case.toml beside it says, else the laboratory]"
)]
pub struct SiteArguments {
    /// Latitude, north positive [default: -23.2111]
    #[arg(long, value_name = "DEG", requires = "motion_file", conflicts_with_all = ["motion", "recording"], allow_negative_numbers = true,
        value_parser = |text: &str| number(text, LATITUDE))]
    pub latitude_deg: Option<f64>,
    /// Local gravity; 0 for a motion in free fall [default: 9.7864]
    #[arg(long, value_name = "M/S2", requires = "motion_file", conflicts_with_all = ["motion", "recording"], value_parser = |text: &str| number(text, GRAVITY))]
    pub gravity_m_s2: Option<f64>,
    /// Magnetic field north, east, down [default: 17.0,-6.9,-14.2]
    #[arg(long, value_name = "N,E,D", requires = "motion_file", conflicts_with_all = ["motion", "recording"], allow_hyphen_values = true, value_parser = field)]
    pub field_n_ut: Option<[f64; 3]>,
    /// Temperature, where the file has none [default: 25]
    #[arg(long, value_name = "DEGC", requires = "motion_file", conflicts_with_all = ["motion", "recording"], allow_negative_numbers = true,
        value_parser = |text: &str| number(text, TEMPERATURE))]
    pub temperature_c: Option<f64>,
}

impl SiteArguments {
    /// The place of a motion with this said beside it.
    pub fn environment(&self, beside: &PlaceBeside) -> Environment {
        let laboratory = Environment::laboratory();
        let latitude_deg = self.latitude_deg.or(beside.latitude_deg);
        let field_n_ut = self.field_n_ut.or(beside.field_n_ut);
        let temperature_c = self.temperature_c.or(beside.temperature_c);
        Environment {
            gravity: self.gravity_m_s2.or(beside.gravity_m_s2).unwrap_or(laboratory.gravity),
            latitude: latitude_deg.map_or(laboratory.latitude, f64::to_radians),
            field_n_ut: field_n_ut.map_or(laboratory.field_n_ut, Into::into),
            temperature_c: temperature_c.unwrap_or(laboratory.temperature_c),
        }
    }
}

/// A place in words.
pub fn about(environment: &Environment) -> String {
    let Environment {
        gravity,
        latitude,
        field_n_ut: field,
        temperature_c,
    } = environment;
    format!(
        "{:.4}° N, {gravity} m/s², field {}, {}, {} µT north, east, down, {temperature_c} °C",
        latitude.to_degrees(),
        field.x,
        field.y,
        field.z
    )
}

/// What a crew with a model of the field tells the unit of a place, with the sigmas of Alcantara's crew. The laboratory is compiled in,
/// and not told.
///
/// # Errors
/// Why such a place cannot be told: the unit would refuse the word.
pub fn told(environment: &Environment) -> Result<Site, &'static str> {
    let (here, laboratory) = (of(environment), of(&Environment::laboratory()));
    let here_told = site::Told::of(&here).unwrap_or_default();
    if Some(here_told) == site::Told::of(&laboratory) {
        return Ok(Site::LABORATORY);
    }
    here_told.fault().map_or(Ok(here), Err)
}

fn of(environment: &Environment) -> Site {
    let field = &environment.field_n_ut;
    let across = field.x.hypot(field.y);
    let crew = Site::ALCANTARA.launch;
    Site {
        gravity: environment.gravity as f32,
        latitude_deg: environment.latitude.to_degrees() as f32,
        declination_deg: field.y.atan2(field.x).to_degrees() as f32,
        launch: crew.map(|crew| Launch {
            norm_ut: field.norm() as f32,
            dip_deg: field.z.atan2(across).to_degrees() as f32,
            ..crew
        }),
    }
}

fn number(text: &str, allowed: RangeInclusive<f64>) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| format!("{text} is no number"))?;
    // NaN is in no range.
    if allowed.contains(&number) {
        Ok(number)
    } else {
        Err(format!(
            "{text} is not between {} and {}",
            allowed.start(),
            allowed.end()
        ))
    }
}

/// A magnetic field \[uT\] of a command line: north, east, down, with commas between.
///
/// # Errors
/// When it is not three numbers, or none of a field on Earth.
pub fn field(text: &str) -> Result<[f64; 3], String> {
    let axes = text
        .split(',')
        .map(|axis| number(axis, FIELD))
        .collect::<Result<Vec<_>, _>>()?;
    axes.try_into()
        .map_err(|axes: Vec<_>| format!("{} numbers; write north, east, down, like 17.0,-6.9,-14.2", axes.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_named_is_the_cases_and_else_the_laboratorys() {
        let nowhere = PlaceBeside::default();
        assert_eq!(
            SiteArguments::default().environment(&nowhere),
            Environment::laboratory()
        );
        let asked = SiteArguments {
            latitude_deg: Some(-2.3733),
            field_n_ut: Some([26.0, -9.0, -5.5]),
            ..SiteArguments::default()
        };
        let environment = asked.environment(&nowhere);
        assert_eq!(environment.gravity, Environment::laboratory().gravity);
        assert_eq!(environment.latitude, (-2.3733_f64).to_radians());
        assert_eq!(environment.field_n_ut.as_slice(), [26.0, -9.0, -5.5]);
        let beside = PlaceBeside {
            gravity_m_s2: Some(9.81),
            latitude_deg: Some(50.0),
            field_n_ut: Some([20.0, 1.0, 44.0]),
            temperature_c: Some(5.0),
        };
        let both = asked.environment(&beside);
        assert_eq!(
            (both.gravity, both.latitude, both.temperature_c),
            (9.81, environment.latitude, 5.0)
        );
        assert_eq!(both.field_n_ut, environment.field_n_ut);
    }

    /// What is told of Alcantara's environment is the site that the rocket's crew tells.
    #[test]
    fn a_place_is_told_as_its_crew_would_and_the_laboratory_is_not() {
        assert_eq!(told(&Environment::laboratory()), Ok(Site::LABORATORY));
        let alcantara = told(&Environment::alcantara()).expect("can be told");
        assert_eq!(site::Told::of(&alcantara), site::Told::of(&Site::ALCANTARA));
        let environment = |change: fn(&mut Environment)| {
            let mut environment = Environment::alcantara();
            change(&mut environment);
            environment
        };
        for (elsewhere, why) in [
            (environment(|place| place.gravity = 0.0), "gravity"),
            (environment(|place| place.field_n_ut *= 0.1), "field is not"),
            (environment(|place| place.field_n_ut = [0.0, 1.0, 60.0].into()), "dip"),
        ] {
            assert!(
                told(&elsewhere).is_err_and(|fault| fault.contains(why)),
                "{elsewhere:?}"
            );
        }
    }

    #[test]
    fn no_place_on_earth_is_refused() {
        for text in ["NaN", "inf", "91", "-90.1", "south", ""] {
            assert!(number(text, LATITUDE).is_err(), "{text}");
        }
        assert_eq!(number("9.81", GRAVITY), Ok(9.81));
        assert!(number("98.1", GRAVITY).is_err_and(|why| why == "98.1 is not between 0 and 10"));
        assert!(field("17,-6.9").is_err_and(|why| why.starts_with("2 numbers")));
        assert!(field("17000,-6900,-14200").is_err(), "nanotesla");
        assert_eq!(field("17.0, -6.9,-14.2"), Ok([17.0, -6.9, -14.2]));
    }
}
