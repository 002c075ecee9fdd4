//! Where a log was made, as far as the log and its reference tell.
//!
//! In: a log, the unit, and a reference on about the log's clock. Out: which way the reference's attitudes are to be read
//! ([`settled`]), gravity and field by the log's own sensors at them, and the environment of the case. The attitude is body to
//! navigation if specific force, turned by it, stands still in navigation; navigation's axes are those in which it points up and
//! the field north.
//!
//! What the command line gives comes first, then the launch site that the unit's flight log says, then the log's sensors.
//!
//! Refused: forces and fields that are not of their unit, with the one they look like ([`check_units`]); attitudes at which
//! nothing points up; a gravity that no place on Earth has; a flight log of a unit that was told no site.

use attitude::told;
use emems::site;
use gap::input::log::Log;
use nalgebra::{UnitQuaternion, Vector3};
use twin::{
    environment::Environment,
    predict::{Kind, UnitDescription},
};

use super::{
    clock,
    made::{MadeError, NewCaseArguments},
    reference::{Axes, ReferenceRecord},
};

/// [m/s2] what a place on Earth has, and the accelerometers may be off by.
const GRAVITY: std::ops::Range<f64> = 9.5..10.1;

/// \[uT\] by which the field of a place differs from a model's: what the rocks add that no model has (0.1 to 0.3 uT, P. Alken et al., Earth
/// Planets Space 73:49, 2021).
pub const MODEL_SIGMA_UT: f64 = 0.3;

/// Median of the norms of one kind's vectors, by plate or whole.
fn norm_of(log: &Log, unit: &UnitDescription, kind: Kind) -> Option<f64> {
    let mut norms: Vec<f64> = vectors(log, unit, kind)
        .into_iter()
        .map(|(_, vector)| vector.norm())
        .collect();
    norms.sort_by(f64::total_cmp);
    norms.get(norms.len() / 2).copied()
}

/// Vectors in b of one kind, row by row, by least squares.
fn vectors(log: &Log, unit: &UnitDescription, kind: Kind) -> Vec<(f64, Vector3<f64>)> {
    let mut only = unit.clone();
    for channel in &mut only.channels {
        // The least squares are those of the gyros.
        channel.sensor = if channel.sensor == kind {
            Kind::Gyro
        } else {
            Kind::Thermometer
        };
    }
    clock::rates(log, &only)
}

/// Physical values must be of their unit.
///
/// # Errors
/// When they are not.
pub fn check_units(log: &Log, unit: &UnitDescription, name: &str) -> Result<(), MadeError> {
    let guess = |value: f64, units: &[(&str, std::ops::Range<f64>)]| {
        units
            .iter()
            .find(|(_, range)| range.contains(&value))
            .map(|(unit, _)| (*unit).to_owned())
    };
    let wrong = |what: &str, value: f64, unit: &str, meant: Option<String>| {
        let meant = meant.map_or(String::new(), |meant| {
            format!("; it looks like {meant}: multiply the columns")
        });
        Err(MadeError::Wrong(format!(
            "{name}: {what} are {value:.3} {unit} on the median{meant}"
        )))
    };
    if let Some(force) = norm_of(log, unit, Kind::Accelerometer).filter(|force| !(5.0..20.0).contains(force)) {
        return wrong(
            "specific forces",
            force,
            "m/s2",
            guess(force, &[("g", 0.8..1.2), ("milli-g", 800.0..1200.0)]),
        );
    }
    if let Some(field) = norm_of(log, unit, Kind::Magnetometer).filter(|field| !(10.0..120.0).contains(field)) {
        return wrong(
            "fields",
            field,
            "uT",
            guess(
                field,
                &[
                    ("gauss", 0.15..0.8),
                    ("milligauss", 150.0..800.0),
                    ("nanotesla", 15_000.0..80_000.0),
                ],
            ),
        );
    }
    Ok(())
}

/// What the log says of the place.
pub struct Place {
    /// [m/s2]
    pub gravity: f64,
    /// \[uT\]
    pub field_n_ut: Vector3<f64>,
    /// \[uT\] of that mean.
    pub field_sigma_ut: f64,
}

/// Which way the reference is to be read, and the place by it.
///
/// # Errors
/// When nothing points up.
pub fn settled(
    told: &ReferenceRecord,
    log: &Log,
    unit: &UnitDescription,
    offset_s: f64,
    rates: &[(f64, Vector3<f64>)],
) -> Result<(Axes, bool, Place), MadeError> {
    let forces = vectors(log, unit, Kind::Accelerometer);
    let fields = vectors(log, unit, Kind::Magnetometer);
    let attitude = |t_s: f64| -> Option<UnitQuaternion<f64>> {
        let at = told.rows.partition_point(|row| row.t_s < t_s + offset_s);
        Some(told.rows.get(at)?.q)
    };
    let mean_n = |vectors: &[(f64, Vector3<f64>)], axes: Axes, is_inverse: bool| {
        let turned = vectors
            .iter()
            .filter_map(|(t_s, vector)| Some(ReferenceRecord::turned(attitude(*t_s)?, axes, is_inverse) * vector));
        let all: Vec<Vector3<f64>> = turned.collect();
        let mean = all.iter().sum::<Vector3<f64>>() / all.len().max(1) as f64;
        let spread = all.iter().map(|one| (one - mean).norm_squared()).sum::<f64>() / all.len().max(1) as f64;
        (mean, spread.sqrt())
    };
    // Which way it turns does not hang on the axes: the mean force is longest, and straight up, where it is read rightly.
    let rated = [false, true].map(|is_inverse| (mean_n(&forces, Axes::Ned, is_inverse).1, is_inverse));
    let is_inverse = if rated[1].0 < 0.7 * rated[0].0 && !rates.is_empty() {
        rated[1].1
    } else {
        rated[0].1
    };
    let found = Axes::ALL.into_iter().find(|axes| {
        let (force_n, _) = mean_n(&forces, *axes, is_inverse);
        // The mean force points up, which is -z in north, east, down.
        -force_n.z > 0.9 * force_n.norm()
    });
    let Some(mut axes) = found else {
        return Err(MadeError::Wrong(
            "the reference's attitudes do not turn the accelerometers' mean upright in any convention known (north-east-down, \
             east-north-up, north-west-up): are log and reference of one unit, mounted alike?"
                .into(),
        ));
    };
    let (force_n, _) = mean_n(&forces, axes, is_inverse);
    let (mut field_n_ut, mut field_sigma_ut) = mean_n(&fields, axes, is_inverse);
    // Of the two that count upwards, the one whose field points north: the other has it east.
    if axes == Axes::Enu && field_n_ut.x < field_n_ut.y.abs() {
        let (other, sigma) = mean_n(&fields, Axes::Nwu, is_inverse);
        if other.x > other.y.abs() {
            (axes, field_n_ut, field_sigma_ut) = (Axes::Nwu, other, sigma);
        }
    }
    Ok((
        axes,
        is_inverse,
        Place {
            gravity: force_n.norm(),
            field_n_ut,
            field_sigma_ut: (field_sigma_ut / (fields.len().max(1) as f64).sqrt()).max(0.1),
        },
    ))
}

/// The launch site that a unit was told, as an environment has it.
pub struct SiteTold {
    /// [m/s2]
    pub gravity: f64,
    /// \[deg\] north positive.
    pub latitude_deg: f64,
    /// \[uT\] north, east, down.
    pub field_n_ut: Vector3<f64>,
    /// \[uT\] of that field on each axis.
    pub field_sigma_ut: f64,
}

impl SiteTold {
    /// Of the numbers of a G_SI; `None` for the site that is compiled in.
    fn of(told: &site::Told) -> Option<Self> {
        let site = told.site(&site::Site::LABORATORY);
        let launch = site.launch.filter(|_| !told.is_none())?;
        let [norm_ut, sd_deg] = [launch.norm_ut, launch.sd_deg].map(f64::from);
        let [dip, declination] = [launch.dip_deg, site.declination_deg].map(|angle| f64::from(angle).to_radians());
        let toward_n = Vector3::new(dip.cos() * declination.cos(), dip.cos() * declination.sin(), dip.sin());
        Some(SiteTold {
            gravity: site.gravity.into(),
            latitude_deg: site.latitude_deg.into(),
            field_n_ut: norm_ut * toward_n,
            field_sigma_ut: (norm_ut * sd_deg.to_radians()).max(MODEL_SIGMA_UT),
        })
    }
}

/// The launch site of the flight log, if one was given.
///
/// # Errors
/// When it is no flight log, or of a unit that was told no site.
pub fn site_told(arguments: &NewCaseArguments) -> Result<Option<SiteTold>, MadeError> {
    let Some(file) = &arguments.flight_log else {
        return Ok(None);
    };
    let log = told::open(file)?;
    let Some(told) = told::site(&log) else {
        return Err(MadeError::Wrong(format!(
            "{}: the unit was told no launch site (G_SI), and has the one that is compiled in; give --gravity-m-s2, --latitude-deg and \
             --field-n-ut instead of --flight-log",
            file.display()
        )));
    };
    Ok(SiteTold::of(&told))
}

/// The place as given, else as the flight log says, else as the log tells.
///
/// # Errors
/// When there is no such place.
pub fn environment(
    arguments: &NewCaseArguments,
    site: Option<&SiteTold>,
    place: &Place,
    said: &mut Vec<String>,
) -> Result<Environment, MadeError> {
    let mut say = |text: String| {
        let name = if said.iter().any(|line| line.starts_with("place ")) {
            ""
        } else {
            "place"
        };
        said.push(format!("{name:<11}{text}"));
    };
    if site.is_some() {
        say("by the launch site of the flight log where it is not given".into());
    }
    let gravity = match (arguments.gravity_m_s2, site) {
        (Some(gravity), _) => gravity,
        (None, Some(site)) => {
            say(format!("gravity {:.4} m/s2", site.gravity));
            site.gravity
        }
        (None, None) => {
            say(format!(
                "gravity {:.4} m/s2 by the accelerometers; give --gravity-m-s2 where it is known",
                place.gravity
            ));
            place.gravity
        }
    };
    if !GRAVITY.contains(&gravity) {
        return Err(MadeError::Wrong(format!(
            "gravity is {gravity:.3} m/s2, which no place on Earth has; give --gravity-m-s2, and look at the accelerometers' scale"
        )));
    }
    let field_text = |field: &Vector3<f64>| {
        format!(
            "field {:.2}, {:.2}, {:.2} uT north, east, down",
            field.x, field.y, field.z
        )
    };
    let field_n_ut = match (arguments.field_n_ut, site) {
        (Some(field_n_ut), _) => field_n_ut.into(),
        (None, Some(site)) => {
            say(format!(
                "{}, sigma {:.2} uT",
                field_text(&site.field_n_ut),
                site.field_sigma_ut
            ));
            site.field_n_ut
        }
        (None, None) => {
            say(format!(
                "{} by the magnetometers; give --field-n-ut where it is known",
                field_text(&place.field_n_ut)
            ));
            place.field_n_ut
        }
    };
    let latitude_deg = match (arguments.latitude_deg, site) {
        (Some(latitude_deg), _) => latitude_deg,
        (None, Some(site)) => {
            say(format!("latitude {:.2} deg", site.latitude_deg));
            site.latitude_deg
        }
        (None, None) => {
            say("latitude taken for 0: the Earth's rate is a fiftieth of a gyro's noise; give --latitude-deg".into());
            0.0
        }
    };
    Ok(Environment {
        gravity,
        latitude: latitude_deg.to_radians(),
        field_n_ut,
        temperature_c: 25.0,
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use emems::site::{Site, Told as Words};

    use super::*;

    #[derive(Parser)]
    struct New {
        #[command(flatten)]
        arguments: NewCaseArguments,
    }

    fn asked(options: &[&str]) -> NewCaseArguments {
        let words = [&["new", "--log", "l", "--reference", "r", "--out", "o"], options].concat();
        New::try_parse_from(words).expect("arguments").arguments
    }

    #[test]
    fn what_is_given_comes_before_the_told_site_and_that_before_the_sensors() {
        let place = Place {
            gravity: 9.8,
            field_n_ut: Vector3::new(20.0, 0.0, 30.0),
            field_sigma_ut: 1.0,
        };
        let told = Words::of(&Site::ALCANTARA)
            .and_then(|told| SiteTold::of(&told))
            .expect("a site");
        let alcantara = Environment::alcantara();
        // The word has hundredths of a microtesla and of a degree.
        assert!(
            (told.field_n_ut - alcantara.field_n_ut).norm() < 0.01,
            "{}",
            told.field_n_ut
        );
        assert_eq!(told.field_sigma_ut, MODEL_SIGMA_UT);
        let made = |options: &[&str], site: Option<&SiteTold>| {
            let mut said = Vec::new();
            let made = environment(&asked(options), site, &place, &mut said).expect("a place");
            (
                [made.gravity, made.latitude.to_degrees(), made.field_n_ut.x],
                said.join("\n"),
            )
        };
        let near = |found: [f64; 3], expected: [f64; 3]| {
            let all = found.iter().zip(expected);
            assert!(
                all.into_iter().all(|(found, expected)| (found - expected).abs() < 1e-3),
                "{found:?}"
            );
        };
        let (found, said) = made(&[], Some(&told));
        near(found, [9.78, -2.32, told.field_n_ut.x]);
        assert!(
            said.starts_with("place      by the launch site of the flight log"),
            "{said}"
        );
        assert!(!said.contains("give --"), "{said}");
        let (found, _) = made(
            &["--gravity-m-s2=9.81", "--latitude-deg=48", "--field-n-ut=21,1,43"],
            Some(&told),
        );
        near(found, [9.81, 48.0, 21.0]);
        let (found, said) = made(&[], None);
        near(found, [9.8, 0.0, 20.0]);
        assert!(
            said.starts_with("place      gravity 9.8000 m/s2 by the accelerometers")
                && said.matches("place ").count() == 1,
            "{said}"
        );
        assert!(SiteTold::of(&Words::default()).is_none());
    }

    #[test]
    fn a_field_that_is_told_with_a_large_sigma_keeps_it() {
        let mut bytes = *Words::of(&Site::ALCANTARA).expect("a site").bytes();
        bytes[8] = 20;
        let told = SiteTold::of(&Words::of_bytes(bytes)).expect("a site");
        assert!(
            (told.field_sigma_ut - 26.24 * 2_f64.to_radians()).abs() < 1e-3,
            "{}",
            told.field_sigma_ut
        );
    }
}
