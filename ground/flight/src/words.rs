//! What is said to the unit before it flies, as a launch crew would.
//!
//! In: the command line and the source. Out: words for the umbilical: derived frames where they were asked for, and at a launch site
//! that site and the rail, as the motion has the nose at its start, with the sigmas of a crew with a theodolite and a level.

use emems::{
    command::{Command, word_of},
    rail::Rail,
    site::{self, Site},
};
use nalgebra::Vector3;
use twin::motion::Motion as _;

use crate::{plan::FlyArguments, source::Source};

/// [0.1 deg] of azimuth and elevation, standard deviation: marks along a rail of some metres, a bubble.
const CREW_SD: [u8; 2] = [5, 3];

/// Before a flight.
pub fn before(arguments: &FlyArguments, source: &Source) -> Vec<u8> {
    let mut words = Vec::new();
    if arguments.derived {
        words.extend(word_of(Command::DerivedOn));
    }
    if let (Some(world), Some(site)) = (&source.world, site::Told::of(&source.site)) {
        let nose_n = world.motion.at(0.0).attitude.q_nb * Vector3::x();
        let rail = rail(&nose_n);
        words.extend(said(Command::Site(site), site.bytes()));
        words.extend(said(Command::Rail(rail), &rail.bytes()));
    }
    words
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
fn said(command: Command, bytes: &[u8]) -> Vec<u8> {
    let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    [word_of(command), digits.as_bytes(), word_of(Command::ConfirmSet)].concat()
}

#[cfg(test)]
mod tests {
    use twin::motion::{LIST, SoundingRocket};

    use super::*;

    #[test]
    fn the_rail_of_the_rocket_is_where_its_nose_points() {
        let nose_n = SoundingRocket::new(30.0, 9.78).at(0.0).attitude.q_nb * Vector3::x();
        let rail_of_rocket = rail(&nose_n);
        let said = said(Command::Rail(rail_of_rocket), &rail_of_rocket.bytes());
        assert_eq!(said, b"G_RA1B5821340503G_CK");
        assert_eq!(rail(&Vector3::new(1.0, -1e-9, 0.0)).azimuth, 0);
    }

    /// Every launch site that may be flown from can be told, and is told to half a digit.
    #[test]
    fn the_sites_of_the_rockets_are_told() {
        let named = |name: &str| LIST.iter().find(|named| named.name == name).expect(name).site;
        let told = site::Told::of(&named("rocket")).expect("a launch site");
        assert_eq!(
            said(Command::Site(told), told.bytes()),
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
