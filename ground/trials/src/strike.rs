//! A disturbance as it is asked for: which, how large, where, when.
//!
//! In: words such as `hard-iron`, `gyro-scale=0.01@g2`, `vibration@20s..80s`, and a [`Scene`]. Out: the scene with it in, and
//! what was done ([`Struck`]). The physics is [`crate::disturbance`]'s, whose typical sizes and places are drawn; what is asked
//! for stands in place of a draw.
//!
//! ```text
//! NAME[=SIZE][@SENSOR][@FROM..TO]
//! ```
//!
//! `SIZE` is a number in SI (field in uT): of one number, that number; of several along axes, their length. Or a multiple of what
//! was drawn as typical, `3x`. `SENSOR` is `a2`, `m1`, `g4`, or a plate, `p3`. `FROM..TO` are seconds of the flight.
//!
//! Refused: an unknown name (with the nearest known one), a size for what is there or not, a size in SI of what has none, a
//! sensor that it does not strike, a time for what happens at instants of its own or to what the case states.

use std::{fmt, str::FromStr, sync::Arc};

use packets::channel::{CHANNELS, Quantity};
use twin::{part::Input, plant::Views};

use crate::{
    answer::Size,
    disturbance::{self, Disturbance},
    draw::{Asked, Draw},
    flight::CYCLE_S,
    scene::Scene,
};

/// How large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Large {
    /// In SI, field in uT.
    Si(f64),
    /// So many times the typical size.
    Times(f64),
}

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Wish {
    /// Its name in verdicts.
    pub name: &'static str,
    /// How large; drawn as typical where absent.
    pub large: Option<Large>,
    /// Where; drawn where absent.
    pub place: Option<Asked>,
    /// \[s\] of the flight, from and to; always where absent.
    pub during_s: Option<[f64; 2]>,
}

/// What was done to a scene.
#[derive(Clone, Debug)]
pub struct Struck {
    /// Its name in verdicts.
    pub name: &'static str,
    /// The channels it touches.
    pub channels: Vec<&'static str>,
    /// In typical sizes.
    pub strength: f64,
    /// Its sizes that verdicts state too.
    pub sizes: Vec<Size>,
    /// \[s\] from and to; always where absent.
    pub during_s: Option<[f64; 2]>,
    /// What it is done to.
    pub acts_on: ActsOn,
}

/// What a disturbance is done to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActsOn {
    /// What the parts convert into their registers.
    Registers,
    /// The codes of the packets on their way to the file.
    Packets,
    /// What the truth instrument writes, or the case states of the place.
    Reference,
}

impl fmt::Display for ActsOn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ActsOn::Registers => "registers",
            ActsOn::Packets => "packets",
            ActsOn::Reference => "reference",
        })
    }
}

/// Why a wish is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refused {
    /// No such effect.
    #[error("no effect is called {name}{meant}; `ground effects` lists them")]
    Name {
        /// As written.
        name: String,
        /// The nearest one there is.
        meant: String,
    },
    /// An effect of the library that this unit cannot have.
    #[error("{0} cannot be flown: it is the law of fibre-optic gyros, which this unit has not")]
    NoLaw(&'static str),
    /// Not of the form.
    #[error("{0}: write it like hard-iron, gyro-scale=0.01@g2, gyro-bias=3x or vibration@20s..80s")]
    Form(String),
    /// There or not.
    #[error("{0} is there or not: give no size")]
    NoSize(&'static str),
    /// No single size.
    #[error("{0} has no size in SI: give a multiple of what is typical, such as {0}=3x")]
    NoSi(&'static str),
    /// Elsewhere.
    #[error("{name} strikes {strikes}; it cannot be at {place} alone")]
    Place {
        /// Which.
        name: &'static str,
        /// What it touches.
        strikes: String,
        /// Where it is asked for.
        place: String,
    },
    /// Not for a while.
    #[error("{0} {1}: give no time")]
    Time(&'static str, &'static str),
}

/// An effect of the library that no unit with registers has.
const NO_LAW: &str = "gyro-sine-response";

impl FromStr for Wish {
    type Err = Refused;

    fn from_str(text: &str) -> Result<Self, Refused> {
        let form = || Refused::Form(text.to_owned());
        let mut words = text.split('@');
        let first = words.next().unwrap_or_default();
        let (name, size) = match first.split_once('=') {
            Some((name, size)) => (name, Some(size)),
            None => (first, None),
        };
        let disturbance = named(name)?;
        let large = match size {
            None => None,
            Some(size) => {
                let (digits, is_times) = size.strip_suffix('x').map_or((size, false), |digits| (digits, true));
                let value: f64 = digits
                    .parse()
                    .ok()
                    .filter(|value: &f64| value.is_finite())
                    .ok_or_else(form)?;
                if !disturbance.graded {
                    return Err(Refused::NoSize(disturbance.name));
                }
                Some(if is_times {
                    Large::Times(value)
                } else {
                    Large::Si(value)
                })
            }
        };
        let mut wish = Wish {
            name: disturbance.name,
            large,
            place: None,
            during_s: None,
        };
        for word in words {
            match word.split_once("..") {
                Some((from, to)) if wish.during_s.is_none() => {
                    let second = |text: &str| {
                        text.strip_suffix('s')
                            .unwrap_or(text)
                            .parse::<f64>()
                            .map_err(|_| form())
                    };
                    let (from, to) = (second(from)?, second(to)?);
                    if !(from >= 0.0 && to > from && to.is_finite()) {
                        return Err(form());
                    }
                    wish.during_s = Some([from, to]);
                }
                None if wish.place.is_none() => wish.place = Some(place(word).ok_or_else(form)?),
                _ => return Err(form()),
            }
        }
        Ok(wish)
    }
}

fn named(name: &str) -> Result<Disturbance, Refused> {
    let all = disturbance::named();
    let found = all.iter().find(|one| one.name == name).copied();
    found.ok_or_else(|| {
        if name == NO_LAW {
            return Refused::NoLaw(NO_LAW);
        }
        let near = all.iter().map(|one| (strsim::jaro_winkler(name, one.name), one.name));
        let meant = near
            .max_by(|one, other| one.0.total_cmp(&other.0))
            .filter(|(near, _)| *near > 0.8);
        Refused::Name {
            name: name.to_owned(),
            meant: meant.map_or(String::new(), |(_, meant)| format!(" (is {meant} meant?)")),
        }
    })
}

/// `a2`, `m1`, `g4` or `p3`.
fn place(word: &str) -> Option<Asked> {
    let (kind, number) = word.split_at_checked(1)?;
    let plate = number.parse::<usize>().ok().filter(|number| (1..=4).contains(number))? - 1;
    let quantity = match kind {
        "a" => Some(Quantity::SpecificForce),
        "m" => Some(Quantity::Field),
        "g" => Some(Quantity::Rate),
        "p" => None,
        _ => return None,
    };
    Some(Asked { plate, quantity })
}

fn place_text(asked: Asked) -> String {
    let kind = match asked.quantity {
        Some(Quantity::SpecificForce) => "a",
        Some(Quantity::Field) => "m",
        Some(Quantity::Rate) => "g",
        _ => "p",
    };
    format!("{kind}{}", asked.plate + 1)
}

/// What a disturbance does at its typical size is done to; what `ground effects` says of it.
pub fn acts_on(name: &str, scene: &dyn Fn() -> Scene) -> Option<ActsOn> {
    let disturbance = named(name).ok()?;
    let mut scene = scene();
    Some(apply(&mut scene, disturbance, &mut Draw::new(1), 1.0).1)
}

/// Whether a disturbance needs a temperature that changes.
pub fn is_warm(name: &str) -> bool {
    named(name).is_ok_and(|disturbance| disturbance.warm)
}

/// Applies; tells the channels it touches, and what it was done to.
fn apply(scene: &mut Scene, disturbance: Disturbance, draw: &mut Draw, strength: f64) -> (Vec<usize>, ActsOn) {
    let (transits, record, claimed) = (scene.transit.len(), scene.record.clone(), scene.claimed);
    scene.sizes.clear();
    scene.magnitude = None;
    let touched = (disturbance.apply)(scene, draw, strength);
    let acts_on = if scene.transit.len() > transits {
        ActsOn::Packets
    } else if !Arc::ptr_eq(&record, &scene.record) || claimed != scene.claimed {
        ActsOn::Reference
    } else {
        ActsOn::Registers
    };
    (touched, acts_on)
}

/// What of one number or along the axes of one part is stated: the number, or its length.
fn magnitude(scene: &Scene) -> Option<f64> {
    let Some(first) = scene.sizes.first() else {
        return scene.magnitude;
    };
    // Channels of a part differ in their last letter.
    let part = |size: &Size| {
        size.channel
            .as_ref()
            .map(|name| name.chars().take(2).collect::<String>())
    };
    let own: Vec<f64> = (scene.sizes.iter())
        .filter(|size| part(size) == part(first))
        .map(|size| size.value)
        .collect();
    match own.as_slice() {
        [one] => Some(*one),
        several => Some(several.iter().map(|value| value * value).sum::<f64>().sqrt()),
    }
}

/// Strikes a scene; `spare` makes another like it, to measure on; what is not asked for is drawn.
///
/// # Errors
/// When it cannot be as asked for.
pub fn strike(scene: &mut Scene, wish: &Wish, spare: &dyn Fn() -> Scene, draw: &Draw) -> Result<Struck, Refused> {
    let disturbance = named(wish.name)?;
    let draw = draw.clone().asking(wish.place);
    let strength = match wish.large {
        None => 1.0,
        Some(Large::Times(times)) => times,
        Some(Large::Si(size)) => {
            let mut scratch = spare();
            apply(&mut scratch, disturbance, &mut draw.clone(), 1.0);
            let typical = magnitude(&scratch).filter(|typical| *typical != 0.0);
            size / typical.ok_or(Refused::NoSi(disturbance.name))?
        }
    };
    let (before, record, claimed) = (scene.views.clone(), scene.record.clone(), scene.claimed);
    let transits = scene.transit.len();
    let (touched, acts_on) = apply(scene, disturbance, &mut draw.clone(), strength);
    if let Some(asked) = wish.place {
        let is_there = |index: &usize| {
            let channel = CHANNELS[*index];
            channel.plate == asked.plate && asked.quantity.is_none_or(|quantity| channel.quantity == quantity)
        };
        // Two plates that are exchanged are named by one of them.
        if !touched.iter().all(is_there) && disturbance.name != "plate-swap" {
            return Err(Refused::Place {
                name: disturbance.name,
                strikes: names(&touched).join(" "),
                place: place_text(asked),
            });
        }
    }
    if let Some([from_s, to_s]) = wish.during_s {
        let refused = |why| Err(Refused::Time(disturbance.name, why));
        if claimed != scene.claimed {
            return refused("is what the case states of the place, once");
        }
        if disturbance.name == "packet-loss" {
            return refused("happens at instants of its own");
        }
        let is_on = move |t_s: f64| (from_s..to_s).contains(&t_s);
        scene.views = views_while(&before, &scene.views, is_on);
        let (off, on) = (record, scene.record.clone());
        scene.record = Arc::new(move |t_s| if is_on(t_s) { on(t_s) } else { off(t_s) });
        for transit in scene.transit.split_off(transits) {
            scene.transit.push(Box::new(move |readings| {
                let before = readings.clone();
                transit(readings);
                for (now, before) in readings.iter_mut().zip(before) {
                    if !is_on(CYCLE_S * f64::from(before.counter)) {
                        *now = before;
                    }
                }
            }));
        }
    }
    Ok(Struck {
        name: disturbance.name,
        channels: names(&touched),
        strength,
        sizes: std::mem::take(&mut scene.sizes),
        during_s: wish.during_s,
        acts_on,
    })
}

fn names(channels: &[usize]) -> Vec<&'static str> {
    channels.iter().map(|index| CHANNELS[*index].name).collect()
}

/// These views while something is on, else those.
fn views_while(off: &Views, on: &Views, is_on: impl Fn(f64) -> bool + Copy + Send + Sync + 'static) -> Views {
    Views {
        force_p: std::array::from_fn(|plate| either(&off.force_p[plate], &on.force_p[plate], is_on)),
        field_p_ut: std::array::from_fn(|plate| either(&off.field_p_ut[plate], &on.field_p_ut[plate], is_on)),
        rate: std::array::from_fn(|plate| either(&off.rate[plate], &on.rate[plate], is_on)),
        temperature_c: std::array::from_fn(|plate| either(&off.temperature_c[plate], &on.temperature_c[plate], is_on)),
        gyro_temperature_c: std::array::from_fn(|plate| {
            either(&off.gyro_temperature_c[plate], &on.gyro_temperature_c[plate], is_on)
        }),
    }
}

fn either<T: 'static>(off: &Input<T>, on: &Input<T>, is_on: impl Fn(f64) -> bool + Send + Sync + 'static) -> Input<T> {
    let (off, on) = (off.clone(), on.clone());
    Arc::new(move |t_s| if is_on(t_s) { on(t_s) } else { off(t_s) })
}

#[cfg(test)]
mod tests {
    use twin::{environment::Environment, motion::Tumble, truth::TruthSource};

    use super::*;
    use crate::followed::Follower;

    fn scene() -> Scene {
        let site = Environment::laboratory();
        let motion = Arc::new(Follower::new(Arc::new(Tumble::new()), 60.0));
        let source: Arc<dyn TruthSource> = Arc::new(twin::environment::World {
            motion: Tumble::new(),
            environment: site,
        });
        Scene::of(motion, 60.0, site, Views::of(&source))
    }

    fn struck(words: &str) -> (Scene, Struck) {
        let mut scene = scene();
        let wish: Wish = words.parse().expect(words);
        let struck = strike(&mut scene, &wish, &self::scene, &Draw::new(5)).expect(words);
        (scene, struck)
    }

    fn refusal(words: &str) -> String {
        let refused = match words.parse::<Wish>() {
            Ok(wish) => strike(&mut scene(), &wish, &scene, &Draw::new(5)).map(drop),
            Err(refused) => Err(refused),
        };
        refused.expect_err(words).to_string()
    }

    #[test]
    fn a_size_at_a_sensor_is_that_size_at_that_sensor() {
        let (scene, struck) = struck("gyro-scale=0.01@g2");
        assert_eq!(
            (struck.channels.as_slice(), struck.acts_on),
            (["g2"].as_slice(), ActsOn::Registers)
        );
        let nominal = self::scene();
        for t_s in [20.0, 31.7, 44.4] {
            assert!((scene.views.rate[1](t_s) / nominal.views.rate[1](t_s) - 1.01).abs() < 1e-9);
            assert_eq!(scene.views.rate[0](t_s), nominal.views.rate[0](t_s));
        }
        let (_, struck) = self::struck("hard-iron=5");
        assert!(struck.strength > 1.0);
    }

    #[test]
    fn during_a_time_is_then_and_not_otherwise() {
        let (scene, _) = struck("accel-bias=0.5@a3@20s..30s");
        let nominal = self::scene();
        let apart = |t_s| (scene.views.force_p[2](t_s) - nominal.views.force_p[2](t_s)).norm();
        assert_eq!((apart(19.9), apart(30.0)), (0.0, 0.0));
        assert!((apart(25.0) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn every_effect_that_has_a_law_can_be_asked_for_by_name() {
        for disturbance in disturbance::named() {
            let (_, struck) = struck(disturbance.name);
            assert!(!struck.channels.is_empty(), "{}", disturbance.name);
        }
    }

    #[test]
    fn what_cannot_be_is_refused_with_what_can() {
        let check = |words, expected: &str| {
            let refusal = refusal(words);
            assert!(refusal.contains(expected), "{refusal}");
        };
        check("gyro-scal", "is gyro-scale meant?");
        check("gyro-sine-response", "fibre-optic");
        check("hard-iron=much", "write it like");
        check("accel-range=2", "there or not");
        check("hard-iron@g2", "cannot be at g2 alone");
        check("gravity-value@3s..4s", "give no time");
        check("packet-loss@3s..4s", "instants of its own");
        check("gyro-bias@40s..20s", "write it like");
    }
}
