//! A case folder from a seed, and its answer.
//!
//! In: ring and seed. Out: `CASE/{case.toml, unit.toml, measured.txt.gz, motion.csv.gz}` after the case format, and
//! the [`Answer`]. The unit is flown twice at the same noise, with and without what is wrong, to learn how strong that
//! is; the strength is then set so that the marginal signal to noise ratio is what the draw asked for, unless no part is
//! so bad.

mod written;

use std::{
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use emems::sample::Reading;
use nalgebra::Vector3;
use packets::channel::CHANNELS;
use twin::{
    environment::Environment,
    motion::SoundingRocket,
    plant::{Plant, Quality},
};

use self::written::{About, attitudes, write};
use crate::{
    answer::{Answer, Cause, Size},
    deck::{Card, Ring},
    disturbance::{self, Disturbance, novel},
    draw::Draw,
    flight,
    followed::{Followed, Follower},
    injected::recording::RecordingError,
    loose::Loose,
    motion::{Style, Wander},
    scene::{DURATION_S, Scene},
    sensitivity::{
        self, Told,
        consequence::{Consequence, consequence},
        withheld::{self, Ratios},
    },
    strength,
};

/// \[s\] where a case's fit window ends and its hold window begins.
const FIT_S: f64 = 300.0;

/// Marginal signal to noise ratios dealt, least and most.
pub(crate) const SNR: (f64, f64) = (8.0, 100.0);

/// The one of a case whose disturbance is given: plain, but not by its mere size.
const GIVEN_SNR: f64 = 30.0;

/// Largest strength of what has a name, in typical sizes: no part of its kind is worse, and the priors of a diagnosis say so.
const LARGEST: f64 = 5.0;

/// The same of what has none: beyond it is a motion that hardly brings it out, and what was counted is rounding.
const LARGEST_NOVEL: f64 = 20.0;

/// Of the cases whose motion is withheld, those with nothing wrong, and those of a rocket.
const HEALTHY: f64 = 0.3;
const ROCKETS: f64 = 0.2;

/// \[s\] a rocket waits on the pad.
const PAD_S: f64 = 30.0;

/// A case was not dealt.
#[derive(Debug, thiserror::Error)]
pub enum DealError {
    /// A file cannot be written.
    #[error("{path}: {source}")]
    Write {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// There is nothing to inject into.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The unit sent no derived frames.
    #[error("the unit of seed {0} sent no derived frames: its sampling instants cannot be learnt")]
    NoInstants(u64),
}

/// Deals the case `name` of a card into `folder/name`.
///
/// # Errors
/// When a file cannot be written.
pub fn deal(folder: &Path, name: &str, card: Card, seed: u64) -> Result<Answer, DealError> {
    let Card { ring, given } = card;
    let mut draw = Draw::new(seed).stream(ring as u64);
    let chosen = given.map_or_else(|| choose(ring, &mut draw), |disturbance| vec![disturbance]);
    let style = [Style::Positions, Style::Table, Style::Hand][draw.below(3)];
    let warm = chosen.iter().any(|disturbance| disturbance.warm) || draw.chance(0.3);
    let is_withheld = ring == Ring::R8;
    let is_rocket = is_withheld && draw.chance(ROCKETS);
    let site = match is_rocket {
        true => Environment::alcantara(),
        false => Environment {
            field_n_ut: Vector3::new(17.0, -6.9, -14.2) + 2.0 * draw.vector(),
            ..Environment::laboratory()
        },
    };
    let instants = flight::instants(seed).ok_or(DealError::NoInstants(seed))?;
    let moved: Arc<dyn Followed> = match is_rocket {
        true => Arc::new(Follower::new(
            Arc::new(SoundingRocket::new(PAD_S, site.gravity)),
            DURATION_S + 2.0,
        )),
        false => Arc::new(Wander::draw(style, warm, DURATION_S + 2.0, &mut draw.stream(1))),
    };
    let loose = (ring == Ring::R0m).then(|| Loose::draw(&mut draw.stream(20)));
    let fly = |struck: &[(usize, f64)], flight: u64| {
        let mut scene = Scene::moved(moved.clone(), site, &mut draw.stream(2));
        let struck = struck.iter().map(|(index, strength)| {
            let touched = (chosen[*index].apply)(&mut scene, &mut draw.stream(3 + *index as u64), *strength);
            (touched, std::mem::take(&mut scene.sizes))
        });
        let touched: Vec<(Vec<usize>, Vec<Size>)> = struck.collect();
        if let Some(loose) = &loose {
            loose.apply(&mut scene, &mut draw.stream(21));
        }
        let quality = Quality {
            flight,
            ..Quality::NOMINAL
        };
        let plant = Plant::seeing(&scene.views, scene.source.clone(), seed, quality);
        let mut readings = flight::fly(plant, DURATION_S + 1.0);
        for transit in &scene.transit {
            transit(&mut readings);
        }
        Flown {
            readings,
            scene,
            touched,
        }
    };
    let quiet = [0, 1].map(|flight| fly(&[], flight));
    let struck = |struck: &[(usize, f64)]| [0, 1].map(|flight| fly(struck, flight));
    let withheld = |strengths: &[(usize, f64)]| {
        let Ratios { parity, course } = beside(&struck(strengths), &quiet, |flights| {
            withheld::ratios(flights, &instants, FIT_S, !is_rocket)
        });
        (parity, course)
    };
    let snr = |strengths: &[(usize, f64)], random: bool| {
        beside(&struck(strengths), &quiet, |flights| {
            sensitivity::marginal_snr(flights, &instants, FIT_S, random)
        })
    };
    let matters = |strength: (usize, f64), random: bool| {
        beside(&struck(&[strength]), &quiet, |flights| {
            consequence(flights, &instants, FIT_S, random)
        })
    };
    let mut sizes = draw.stream(9);
    let mut strengths = Vec::new();
    let mut ratios = Vec::new();
    for (index, disturbance) in chosen.iter().enumerate() {
        let wanted = given.map_or_else(|| sizes.log_uniform(SNR.0, SNR.1), |_| GIVEN_SNR);
        let at = |strength: f64| snr(&[(index, strength)], disturbance.random);
        let (strength, reached) = match disturbance.graded {
            false => (1.0, at(1.0)),
            true => {
                let largest = if ring == Ring::R3 { LARGEST_NOVEL } else { LARGEST };
                // The ratio of a variance goes with the square of its strength.
                strength::sized(wanted, if disturbance.random { 2.0 } else { 1.0 }, largest, at)
            }
        };
        ratios.push(reached);
        strengths.push((index, strength));
    }
    let flown = fly(&strengths, 0);
    let about = match (is_withheld, is_rocket) {
        (true, true) => About::Rocket,
        (true, false) => About::Withheld(style),
        _ => About::Seen(style),
    };
    write(&folder.join(name), name, about, &flown, &instants, loose.as_ref())?;
    let attitudes = match is_withheld {
        true => attitudes(&flown.scene, &instants),
        false => Vec::new(),
    };
    let effects = (chosen.iter().zip(&flown.touched).zip(strengths.iter().zip(&ratios)))
        .map(|((disturbance, (touched, sizes)), (strength, ratio))| {
            let Consequence { attitude_deg, growth } = matters(*strength, disturbance.random);
            Cause {
                effect: disturbance.name.into(),
                in_library: ring != Ring::R3,
                channels: touched.iter().map(|index| CHANNELS[*index].name.into()).collect(),
                strength: strength.1,
                snr_marginal: Some(*ratio),
                sizes: sizes.clone(),
                snr_withheld: is_withheld.then(|| withheld(&strengths)),
                attitude_deg: Some(attitude_deg),
                gap_growth: Some(growth),
            }
        })
        .collect();
    Ok(Answer {
        case: name.into(),
        ring: format!("{ring:?}"),
        seed,
        effects,
        snr_marginal: ratios.iter().copied().fold(0.0, f64::hypot),
        attitudes,
        source: None,
    })
}

/// A flight of a scene.
struct Flown {
    readings: Vec<Reading>,
    scene: Scene,
    touched: Vec<(Vec<usize>, Vec<Size>)>,
}

impl Flown {
    fn told(&self) -> Told<'_> {
        Told {
            readings: &self.readings,
            record: &self.scene.record,
            claimed: &self.scene.claimed,
        }
    }
}

/// Measures what was struck beside what was not, each flown twice.
fn beside<T>(struck: &[Flown; 2], quiet: &[Flown; 2], measure: impl FnOnce([[&Told; 2]; 2]) -> T) -> T {
    let [struck, quiet] = [struck, quiet].map(|flights| flights.each_ref().map(Flown::told));
    measure([[&struck[0], &quiet[0]], [&struck[1], &quiet[1]]])
}

fn choose(ring: Ring, draw: &mut Draw) -> Vec<Disturbance> {
    let named = disturbance::named();
    let one = |all: &[Disturbance], draw: &mut Draw| all[draw.below(all.len())];
    let count = match ring {
        Ring::R0 | Ring::R0m | Ring::R7 => return Vec::new(),
        Ring::R8 if draw.chance(HEALTHY) => return Vec::new(),
        Ring::R8 => {
            // What a reference does is nothing where there is none, and what scatters has no shape.
            let shaped: Vec<Disturbance> = named
                .into_iter()
                .filter(|own| !own.random && !own.name.starts_with("reference"))
                .collect();
            return vec![one(&shaped, draw)];
        }
        Ring::R1 => return vec![one(&named, draw)],
        Ring::R3 => return vec![one(novel::ALL, draw)],
        Ring::R4 => 2,
        Ring::R6 => 3 + draw.below(2),
    };
    let mut graded: Vec<Disturbance> = named.into_iter().filter(|disturbance| disturbance.graded).collect();
    (0..count)
        .map(|_| {
            let chosen = one(&graded, draw);
            graded.retain(|other| other.name != chosen.name);
            chosen
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disturb(disturbances: &[Disturbance]) {
        /// \[s\] long enough for what happens once to have happened.
        const LONG_S: f64 = 250.0;
        let site = Environment::laboratory();
        let instants = flight::instants(3).expect("derived frames");
        let fly = |struck: Option<Disturbance>| {
            let wander = Wander::draw(Style::Hand, true, LONG_S + 2.0, &mut Draw::new(11));
            let mut scene = Scene::new(wander, site, &mut Draw::new(12));
            let touched = struck.map(|disturbance| {
                let touched = (disturbance.apply)(&mut scene, &mut Draw::new(13), 10.0);
                (touched, Vec::new())
            });
            let plant = Plant::seeing(&scene.views, scene.source.clone(), 3, Quality::NOMINAL);
            let mut readings = flight::fly(plant, LONG_S + 1.0);
            scene.transit.iter().for_each(|transit| transit(&mut readings));
            Flown {
                readings,
                scene,
                touched: touched.into_iter().collect(),
            }
        };
        let quiet = fly(None);
        let snr = |flown: &Flown, random| {
            let (flown, quiet) = (flown.told(), quiet.told());
            sensitivity::marginal_snr([[&flown, &quiet]; 2], &instants, LONG_S, random)
        };
        assert!(snr(&quiet, false) < 1e-6);
        for disturbance in disturbances.iter().copied() {
            let flown = fly(Some(disturbance));
            let snr = snr(&flown, disturbance.random);
            // A fiftieth of a gyro's noise is lost in four minutes: what is counted of it is mostly the rounding of codes.
            let is_plain = disturbance.name != "earth-rate";
            assert!(snr > if is_plain { 5.0 } else { 0.1 }, "{}: {snr}", disturbance.name);
            let touched = &flown.touched[0].0;
            for (index, channel) in CHANNELS
                .iter()
                .enumerate()
                .filter(|(index, _)| !touched.contains(index))
            {
                let same = (flown.readings.iter().zip(&quiet.readings))
                    .all(|(one, other)| packets::channel::counts(one)[index] == packets::channel::counts(other)[index]);
                assert!(
                    same || disturbance.name == "packet-loss",
                    "{} touches {}",
                    disturbance.name,
                    channel.name
                );
            }
        }
    }

    /// What takes more than six seconds of a core.
    mod long {
        use std::fs;

        use super::*;

        #[test]
        #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
        fn every_effect_disturbs_what_it_says_it_touches() {
            let named = disturbance::named();
            let (one, other) = named.split_at(named.len() / 2);
            // Minutes of one core: side by side.
            std::thread::scope(|scope| {
                scope.spawn(|| disturb(one));
                disturb(other);
            });
        }

        #[test]
        #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
        fn a_seed_is_a_case() {
            let folder = tempfile::tempdir().expect("a folder");
            let card = Card {
                ring: Ring::R1,
                given: None,
            };
            let [one, same] = ["A", "B"].map(|name| deal(folder.path(), name, card, 5).expect("dealt"));
            assert_eq!((one.effects, one.snr_marginal), (same.effects, same.snr_marginal));
            let read = |case: &str, file: &str| fs::read(folder.path().join(case).join(file)).expect(file);
            for file in ["measured.txt.gz", "motion.csv.gz", "unit.toml"] {
                assert_eq!(read("A", file), read("B", file), "{file}");
            }
        }

        #[test]
        #[ignore = "takes more than six seconds: cargo host-test-long runs it"]
        fn everything_novel_disturbs_what_it_says_it_touches() {
            disturb(novel::ALL);
        }
    }
}
