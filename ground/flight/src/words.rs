//! What is said to the unit before it flies, as a launch crew would.
//!
//! In: the command line and the source. Out: words for the umbilical: derived frames where they were asked for, and at a launch site
//! that site and the rail, as the motion has the nose at its start, with the sigmas of a crew with a theodolite and a level. A nose that
//! moves is on no rail. What was told, and why something was not, is in the summary.

use emems::{
    command::{Command, word_of},
    rail::Rail,
    site::{self, Site},
};
use nalgebra::Vector3;
use twin::motion::Motion as _;

use crate::{board::Remark, plan::FlyArguments, source::Source};

/// [0.1 deg] of azimuth and elevation, standard deviation: marks along a rail of some metres, a bubble.
const CREW_SD: [u8; 2] = [5, 3];

/// \[s\] for which a nose that a crew measures stands still: the attitude is there a second after the unit took its site, and takes the rail
/// then.
const STILL_S: f64 = 5.0;
/// \[s\] between two looks at it.
const LOOK_S: f64 = 0.1;

/// What is said to a unit, and the rows of the summary that tell it.
#[derive(Debug, Default)]
pub struct Briefing {
    /// Words for the umbilical.
    pub words: Vec<u8>,
    /// Of site and rail: what was told, or why it was not.
    pub rows: Vec<Remark>,
}

/// Before a flight.
pub fn before(arguments: &FlyArguments, source: &Source) -> Briefing {
    let mut said = Briefing::default();
    if arguments.derived {
        said.words.extend(word_of(Command::DerivedOn));
    }
    said.rows.extend(source.untold.iter().map(|why| (SITE, why.clone())));
    let (Some(world), Some(site)) = (&source.world, site::Told::of(&source.site)) else {
        return said;
    };
    said.words.extend(words(Command::Site(site), site.bytes()));
    said.rows.push((SITE, format!("told, {site}")));
    let nose_n = |t_s: f64| world.motion.at(t_s).attitude.q_nb * Vector3::x();
    if is_still(&nose_n) {
        let rail = rail(&nose_n(0.0));
        said.words.extend(words(Command::Rail(rail), &rail.bytes()));
        said.rows.push((RAIL, format!("told, {rail}")));
    } else {
        let why = format!("not told: the nose moves within the first {STILL_S} s");
        said.rows.push((RAIL, why));
    }
    said
}

/// Names of the rows.
const SITE: &str = "launch site";
const RAIL: &str = "launch rail";

/// Whether the nose stays where it is, within what a crew measures, until the rail is taken.
fn is_still(nose_n: &impl Fn(f64) -> Vector3<f64>) -> bool {
    let most_rad = (f64::from(CREW_SD[1]) / 10.0).to_radians();
    let looks = (1..=(STILL_S / LOOK_S) as u32).map(|look| nose_n(LOOK_S * f64::from(look)));
    let first = nose_n(0.0);
    looks.into_iter().all(|nose| nose.angle(&first) < most_rad)
}

/// The site as the unit is told it, in whole digits; as it is where none is told.
pub fn site(site: &Site) -> Site {
    site::Told::of(site).map_or(*site, |told| told.site(site))
}

/// The rail along which the nose points.
fn rail(nose_n: &Vector3<f64>) -> Rail {
    let hundredths = |angle: f64| (100.0 * angle.to_degrees()).round() as u16;
    let azimuth = nose_n.y.atan2(nose_n.x).rem_euclid(std::f64::consts::TAU);
    let [azimuth_sd, elevation_sd] = CREW_SD;
    Rail {
        azimuth: hundredths(azimuth) % 36_000,
        elevation: hundredths((-nose_n.z).atan2(nose_n.xy().norm())),
        azimuth_sd,
        elevation_sd,
    }
}

/// The words that set what these bytes tell.
fn words(command: Command, bytes: &[u8]) -> Vec<u8> {
    let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    [word_of(command), digits.as_bytes(), word_of(Command::ConfirmSet)].concat()
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use clap::Parser;
    use twin::motion::{LIST, SoundingRocket};

    use super::*;
    use crate::source;

    #[derive(Parser)]
    struct Words {
        #[command(flatten)]
        arguments: FlyArguments,
    }

    /// What is said before a flight of a level motion that turns to the right at so many deg/s.
    fn said_of(rate_deg_s: f64, place: &[&str]) -> (String, Vec<Remark>) {
        let folder = tempfile::tempdir().expect("temporary folder");
        let file = folder.path().join("turns.csv");
        let mut text = String::from("t_s,qw,qx,qy,qz\n");
        for k in 0..100 {
            let half = 0.5 * (rate_deg_s * 0.1 * f64::from(k)).to_radians();
            writeln!(text, "{},{},0,0,{}", 0.1 * f64::from(k), half.cos(), half.sin()).expect("a string");
        }
        std::fs::write(&file, text).expect("written");
        let file = file.to_string_lossy();
        let asked = Words::try_parse_from([&["fly", "--motion-file", &file], place].concat()).expect("arguments");
        let source = source::open(&asked.arguments).expect("a source");
        let Briefing { words, rows } = before(&asked.arguments, &source);
        (String::from_utf8(words).expect("text"), rows)
    }

    #[test]
    fn a_recorded_motion_tells_the_place_that_is_named_and_the_rail_it_stands_on() {
        let elsewhere = [
            "--latitude-deg=-2.32",
            "--gravity-m-s2=9.7804",
            "--field-n-ut=24.23,-9.22,-4.07",
        ];
        let (words, rows) = said_of(0.04, &elsewhere);
        assert_eq!(words, "G_SI2634FF18F7DDFC84020A400F00G_CKG_RA000000000503G_CK");
        assert!(
            rows[0].1.starts_with("told, gravity 9.780") && rows[1].1.starts_with("told, azimuth 0.00"),
            "{rows:?}"
        );
        // Half a degree in five seconds.
        let (words, rows) = said_of(0.1, &elsewhere);
        assert_eq!(words, "G_SI2634FF18F7DDFC84020A400F00G_CK");
        assert!(rows[1].1.starts_with("not told: the nose moves"), "{rows:?}");
    }

    #[test]
    fn a_recorded_motion_of_no_place_or_of_one_that_cannot_be_told_says_so() {
        let (words, rows) = said_of(0.0, &[]);
        assert!(
            words.is_empty() && rows[0].1.contains("--latitude-deg"),
            "{words} {rows:?}"
        );
        let (words, rows) = said_of(0.0, &["--gravity-m-s2", "0"]);
        assert!(
            words.is_empty() && rows[0].1.starts_with("not told, since gravity is not"),
            "{words} {rows:?}"
        );
    }

    #[test]
    fn the_rail_of_the_rocket_is_where_its_nose_points() {
        let nose_n = SoundingRocket::new(30.0, 9.78).at(0.0).attitude.q_nb * Vector3::x();
        let rail_of_rocket = rail(&nose_n);
        let said = words(Command::Rail(rail_of_rocket), &rail_of_rocket.bytes());
        assert_eq!(said, b"G_RA1B5821340503G_CK");
        assert_eq!(rail(&Vector3::new(1.0, -1e-9, 0.0)).azimuth, 0);
    }

    /// Every launch site that may be flown from can be told, and is told to half a digit.
    #[test]
    fn the_sites_of_the_rockets_are_told() {
        let named = |name: &str| LIST.iter().find(|named| named.name == name).expect(name).site;
        let told = site::Told::of(&named("rocket")).expect("a launch site");
        assert_eq!(
            words(Command::Site(told), told.bytes()),
            b"G_SI2634FF18F7DDFC84020A400F00G_CK"
        );
        for name in ["rocket", "rocket-rough"] {
            let told = site::Told::of(&named(name)).expect("a launch site");
            assert_eq!(told.fault(), None, "{name}");
            assert_eq!(site::Told::of(&super::site(&named(name))), Some(told), "{name}");
        }
        assert_eq!(super::site(&named("tumble")), Site::LABORATORY);
    }
}
