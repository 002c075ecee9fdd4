//! What is said to the unit before it flies, as a launch crew would.
//!
//! In: the command line and the source. Out: words for the umbilical: derived frames where they were asked for, and at a launch site
//! the rail, as the motion has the nose at its start, with the sigmas of a crew with a theodolite and a level.

use emems::{
    command::{Command, word_of},
    rail::Rail,
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
    if let (Some(world), Some(_)) = (&source.world, &source.site.launch) {
        let nose_n = world.motion.at(0.0).attitude.q_nb * Vector3::x();
        words.extend(said(&rail(&nose_n)));
    }
    words
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

/// The words that set it.
fn said(rail: &Rail) -> Vec<u8> {
    let digits: String = rail.bytes().iter().map(|byte| format!("{byte:02X}")).collect();
    let word = word_of(Command::Rail(*rail));
    [&word[..], digits.as_bytes(), word_of(Command::ConfirmSet)].concat()
}

#[cfg(test)]
mod tests {
    use twin::motion::SoundingRocket;

    use super::*;

    #[test]
    fn the_rail_of_the_rocket_is_where_its_nose_points() {
        let nose_n = SoundingRocket::new(30.0, 9.78).at(0.0).attitude.q_nb * Vector3::x();
        assert_eq!(said(&rail(&nose_n)), b"G_RA1B5821340503G_CK");
        assert_eq!(rail(&Vector3::new(1.0, -1e-9, 0.0)).azimuth, 0);
    }
}
