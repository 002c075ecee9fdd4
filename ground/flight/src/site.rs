//! Where a recorded motion took place, as asked for on the command line.
//!
//! In: gravity, latitude, field and temperature, each or none. Out: an [`Environment`]; what is not named is the
//! laboratory's. Refuses what no place on Earth has: a typing error would otherwise fly as a strange unit.

use std::ops::RangeInclusive;

use twin::environment::Environment;

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
#[command(next_help_heading = "Where a --motion-file took place [default: the laboratory]")]
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
    /// The place.
    pub fn environment(&self) -> Environment {
        let laboratory = Environment::laboratory();
        Environment {
            gravity: self.gravity_m_s2.unwrap_or(laboratory.gravity),
            latitude: self.latitude_deg.map_or(laboratory.latitude, f64::to_radians),
            field_n_ut: self.field_n_ut.map_or(laboratory.field_n_ut, Into::into),
            temperature_c: self.temperature_c.unwrap_or(laboratory.temperature_c),
        }
    }

    /// The place in words.
    pub fn about(&self) -> String {
        let Environment {
            gravity,
            latitude,
            field_n_ut: field,
            temperature_c,
        } = self.environment();
        format!(
            "{:.4}° N, {gravity} m/s², field {}, {}, {} µT north, east, down, {temperature_c} °C",
            latitude.to_degrees(),
            field.x,
            field.y,
            field.z
        )
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

fn field(text: &str) -> Result<[f64; 3], String> {
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
    fn what_is_not_named_is_the_laboratorys() {
        assert_eq!(SiteArguments::default().environment(), Environment::laboratory());
        let place = SiteArguments {
            latitude_deg: Some(-2.3733),
            field_n_ut: Some([26.0, -9.0, -5.5]),
            ..SiteArguments::default()
        };
        let environment = place.environment();
        assert_eq!(environment.gravity, Environment::laboratory().gravity);
        assert_eq!(environment.latitude, (-2.3733_f64).to_radians());
        assert_eq!(environment.field_n_ut.as_slice(), [26.0, -9.0, -5.5]);
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
