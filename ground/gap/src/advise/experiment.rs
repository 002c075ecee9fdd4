//! The next experiment: which motion, how long, tells apart what this log could not.
//!
//! In: the cause and its likeliest rival, with the sizes found. Out: of a catalogue of motions the one that separates them
//! most a minute, and the error of a decision between the two before and after it. The twin flies each motion with the
//! unit's own channels; two effects differ there by `m` nats ([`crate::advise::confusion`]) and are confused with probability
//! `Q(sqrt(m/2))`.

use nalgebra::DVector;
use twin::{
    effect::{Active, Cause, by_name},
    motion::{Motion, RateTable, RotationTest, Still, Tumble},
    predict::{Scene, Twin},
};

use crate::{
    advise::confusion::{Pair, error},
    input::{case::Subject, log::Series, reference::Reference, windows::Fit},
    library::{column::Column, products::Products},
    null::problem::Problem,
    thresholds::TOLD_APART,
};

/// \[s\] of every motion of the catalogue that counts: comparable between them, and no longer than a shift.
const LONGEST_S: f64 = 600.0;

/// \[s\] step at which a motion is tabulated.
const STEP_S: f64 = 0.01;

/// A motion that can be ordered.
struct Experiment {
    name: &'static str,
    motion: fn() -> Box<dyn Motion>,
}

const CATALOGUE: [Experiment; 5] = [
    Experiment {
        name: "rest in one attitude (the twin's motion \"still\")",
        motion: || Box::new(Still::level()),
    },
    Experiment {
        name: "steady rates of both signs about many axes (\"rate-table\")",
        motion: || Box::new(RateTable::calibration()),
    },
    Experiment {
        name: "turning about all axes at once (\"tumble\")",
        motion: || Box::new(Tumble::new()),
    },
    Experiment {
        name: "steps about one axis at a time (\"rotation-1\")",
        motion: || Box::new(RotationTest::first()),
    },
    Experiment {
        name: "combined attitude steps (\"rotation-2\")",
        motion: || Box::new(RotationTest::second()),
    },
];

/// What to do about what no effect explains.
const REPEAT: &str = "Repeat this log: what the library does not know shows whether it returns with the motion, the temperature or the clock.";

/// Advice in words: how to tell a pair apart, or how to `confirm` the first cause, or what to do where the gap `is_unknown`.
pub fn advice(subject: &Subject, rivals: Option<&Pair>, confirm: Option<&str>, is_unknown: bool) -> String {
    let Some(pair) = rivals else {
        return match confirm {
            Some(confirm) => format!("Nothing is left to tell apart. To be sure: {confirm}"),
            None if is_unknown => REPEAT.to_owned(),
            None => {
                "None is needed for what this log can show; for what it cannot, see its detection limits.".to_owned()
            }
        };
    };
    let names = (pair.own.0.effect.page().name, pair.rival.effect.page().name);
    let before = error(pair.nats);
    if pair.nats > TOLD_APART {
        let next = match confirm {
            None if is_unknown => sentence("", Some(REPEAT)),
            _ => sentence(" To be sure:", confirm),
        };
        let errs = match before {
            ..1e-6 => "less than 1 in 1,000,000".to_owned(),
            _ => format!("{:.4} %", 100.0 * before),
        };
        return format!(
            "{} and {} are apart already: of decisions between them {errs} err.{next}",
            names.0, names.1
        );
    }
    let tried = CATALOGUE.iter().filter_map(|experiment| {
        let (nats, minutes) = separation(subject, pair, (experiment.motion)().as_ref())?;
        Some((nats / minutes, nats, minutes, experiment.name))
    });
    let best = tried.max_by(|one, other| one.0.total_cmp(&other.0));
    match best {
        Some((_, nats, minutes, name)) if nats > pair.nats.max(1.0) => format!(
            "To tell {} from {}: {name}, {minutes:.0} min; a decision between them errs with {:.1} % instead of {:.1} %.",
            names.0,
            names.1,
            100.0 * error(nats),
            100.0 * before
        ),
        _ => {
            let other = by_name(names.1).map(|effect| effect.page().confirm_by);
            // What is there to do for the first of them is alone where nothing is known for the other.
            let words = [
                sentence(" Change something else:", confirm.or(other)),
                match confirm {
                    Some(_) => sentence(" Or:", other),
                    None => String::new(),
                },
            ];
            format!("No motion tells {} from {}.{}", names.0, names.1, words.concat())
        }
    }
}

/// A sentence with its beginning; nothing where there is nothing to say.
fn sentence(begin: &str, rest: Option<&str>) -> String {
    rest.filter(|rest| !rest.is_empty())
        .map_or(String::new(), |rest| format!("{begin} {rest}"))
}

/// Nats between the two on a motion, and its minutes; `None` where one of them cannot be there.
fn separation(subject: &Subject, pair: &Pair, motion: &dyn Motion) -> Option<(f64, f64)> {
    let unit = subject.twin.unit().clone();
    let cycle_s = unit.cycle_s.unwrap_or(0.1);
    let to_s = motion.duration_s().unwrap_or(LONGEST_S).min(LONGEST_S);
    let starts_s: Vec<f64> = (0..(to_s / cycle_s) as usize).map(|row| row as f64 * cycle_s).collect();
    let rows = starts_s.len();
    let environment = *subject.twin.environment();
    let scene = Scene::new(motion, &environment, 0.0, to_s, STEP_S);
    let channels = unit.channels.len();
    let twin = Twin::new(unit, environment, scene, starts_s).ok()?;
    let all = Series {
        rows: (0..rows as u32).collect(),
        values: vec![0.0; rows],
    };
    let fit = Fit {
        channels: vec![all; channels],
    };
    let exact = Reference::default();
    let problem = Problem::new(&twin, &fit, &exact);
    let mut products = Products::default();
    let mut sigmas = Vec::new();
    let mut add = |cause: &Cause| -> Vec<usize> {
        let width = cause.parameters(twin.unit()).len();
        let zero = Active {
            cause: cause.clone(),
            theta: vec![0.0; width],
        };
        let columns = twin.jacobian(&[zero], 0);
        columns
            .iter()
            .map(|column| {
                sigmas.push(column.sigma);
                products.push(&problem, Column::of(problem.in_noise(column, None)))
            })
            .collect()
    };
    let (own, rival) = (add(&pair.own.0), add(&pair.rival));
    let places: Vec<usize> = own.iter().chain(&rival).copied().collect();
    let screen = products.screen(&places, &vec![0.0; places.len()], &sigmas);
    let theta = DVector::from_vec(pair.own.1.clone());
    let (share, energy) = screen.imitation(&own, &theta, &rival)?;
    Some((0.5 * energy * (1.0 - share), to_s / 60.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_there_is_nothing_to_say_no_sentence_begins() {
        assert_eq!(sentence(" Or:", Some("turn it.")), " Or: turn it.");
        assert_eq!(
            (sentence(" Or:", Some("")), sentence(" Or:", None)),
            (String::new(), String::new())
        );
    }

    #[test]
    fn eleven_nats_are_one_percent_and_three_are_eleven() {
        assert!((error(11.0) - 0.0095).abs() < 2e-4, "{}", error(11.0));
        assert!((error(3.0) - 0.110).abs() < 2e-3, "{}", error(3.0));
        assert!((error(0.0) - 0.5).abs() < 1e-6);
    }
}
