//! In which phase an effect shows.
//!
//! In: what a named effect does to the readings, in units of noise, and the phases. Out: [`Alone`] where all but a twentieth
//! ([`CHANCE`]) of its energy `sum d^2` lies in one kind of phase, and that is not all of the log anyway.
//!
//! Spin lies across the others and is looked at last: what shows in a coast that spins shows in the coast.

use crate::{
    null::problem::{Component, Problem},
    parity::phases::{Phase, Stretch},
    thresholds::CHANCE,
};

/// One phase, and what lies in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alone {
    /// Which.
    pub phase: Phase,
    /// Of the energy.
    pub share: f64,
    /// Of the samples that the effect touches.
    pub of_samples: f64,
}

impl Alone {
    /// In words.
    pub fn told(&self) -> String {
        format!(
            "shows in {} alone: {:.0} % of what it does to the readings, in {:.0} % of them",
            self.phase.word(),
            100.0 * self.share,
            100.0 * self.of_samples
        )
    }
}

/// The phase in which one effect of a model shows alone; none where it shows in several.
pub fn only_in(problem: &Problem, model: &[Component], at: usize, stretches: &[Stretch]) -> Option<Alone> {
    let added = problem.contribution(model, &[at]);
    let starts_s = problem.twin.starts_s();
    let samples: Vec<(f64, f64)> = added
        .iter()
        .flat_map(|(channel, values)| {
            let rows = problem.frames[*channel].series.rows.iter();
            rows.zip(values.iter())
                .map(|(row, value)| (starts_s[*row as usize], value * value))
        })
        .collect();
    of_samples(&samples, stretches)
}

/// The same of instants \[s\] with their energies.
fn of_samples(samples: &[(f64, f64)], stretches: &[Stretch]) -> Option<Alone> {
    let whole: f64 = samples.iter().map(|(_, energy)| energy).sum();
    let phases = [
        Phase::Rest,
        Phase::Thrust,
        Phase::Coast,
        Phase::Entry,
        Phase::Parachute,
        Phase::Landed,
        Phase::Spin,
    ];
    phases.into_iter().find_map(|phase| {
        let own: Vec<&Stretch> = stretches.iter().filter(|own| own.phase == phase).collect();
        let is_in = |t_s: f64| own.iter().any(|own| (own.from_s..own.to_s).contains(&t_s));
        let (mut energy, mut count) = (0.0, 0.0);
        for (_, own) in samples.iter().filter(|(t_s, _)| is_in(*t_s)) {
            energy += own;
            count += 1.0;
        }
        let alone = Alone {
            phase,
            share: energy / whole,
            of_samples: count / samples.len() as f64,
        };
        (alone.share >= 1.0 - CHANCE && alone.of_samples < 1.0 - CHANCE).then_some(alone)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn stretch(phase: Phase, from_s: f64, to_s: f64) -> Stretch {
        Stretch { phase, from_s, to_s }
    }

    const FLIGHT: [Stretch; 4] = [
        stretch(Phase::Rest, 0.0, 20.0),
        stretch(Phase::Thrust, 20.0, 30.0),
        stretch(Phase::Coast, 30.0, 100.0),
        stretch(Phase::Spin, 25.0, 60.0),
    ];

    /// A second apart, with this energy while in a span.
    fn samples(energy: f64, (from_s, to_s): (f64, f64)) -> Vec<(f64, f64)> {
        let all = (0..100).map(|second| f64::from(second) + 0.5);
        all.map(|t_s| (t_s, if (from_s..to_s).contains(&t_s) { energy } else { 0.1 }))
            .collect()
    }

    #[test]
    fn what_acts_while_a_motor_pushes_shows_in_thrust_alone() {
        let alone = of_samples(&samples(30.0, (20.0, 30.0)), &FLIGHT).expect("shows in one");
        assert_eq!(alone.phase, Phase::Thrust);
        assert!((alone.of_samples - 0.1).abs() < 1e-9 && alone.share > 0.96);
        assert!(alone.told().contains("thrust alone: 97 %"), "{}", alone.told());
    }

    #[test]
    fn what_acts_throughout_or_in_two_phases_shows_in_none_alone() {
        assert_eq!(of_samples(&samples(0.1, (0.0, 0.0)), &FLIGHT), None);
        assert_eq!(of_samples(&samples(30.0, (20.0, 40.0)), &FLIGHT), None);
        assert_eq!(
            of_samples(&samples(0.1, (0.0, 0.0)), &[stretch(Phase::Coast, 0.0, 99.0)]),
            None
        );
        assert_eq!(of_samples(&[], &FLIGHT), None);
    }

    #[test]
    fn what_acts_in_a_spin_that_lies_across_shows_there() {
        let alone = of_samples(&samples(30.0, (25.0, 60.0)), &FLIGHT).expect("shows in one");
        assert_eq!(alone.phase, Phase::Spin);
    }
}
