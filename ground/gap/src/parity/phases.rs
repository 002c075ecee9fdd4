//! What a flight does when: rest, thrust, coast, spin, entry, parachute, landed.
//!
//! In: a log ([`found()`]), or `[phases]` of `case.toml` ([`told`]), which is taken instead. Out: [`Stretch`]es in the order of time; those of spin lie
//! across the others. Which phase an effect shows in alone is [`shown`]'s.

mod found;
pub mod shown;

use std::{fmt::Write, path::Path};

use serde::Serialize;

use crate::input::case::{CaseError, PhasePairs};

pub use found::{BIN_S, found};

/// What it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// Before a flight, or of a unit that does not fly.
    Rest,
    /// A motor pushes.
    Thrust,
    /// Or free fall: nothing but drag.
    Coast,
    /// Fast, across others.
    Spin,
    /// The air brakes harder than gravity pulls.
    Entry,
    /// It hangs.
    Parachute,
    /// At rest after a flight.
    Landed,
}

impl Phase {
    /// As case.toml has it.
    pub fn word(self) -> &'static str {
        match self {
            Phase::Rest => "rest",
            Phase::Thrust => "thrust",
            Phase::Coast => "coast",
            Phase::Spin => "spin",
            Phase::Entry => "entry",
            Phase::Parachute => "parachute",
            Phase::Landed => "landed",
        }
    }

    /// Whether the unit is under way.
    pub fn is_flight(self) -> bool {
        !matches!(self, Phase::Rest | Phase::Landed | Phase::Spin)
    }

    /// What may come next.
    fn may_be_followed_by(self, next: Phase) -> bool {
        use Phase::{Coast, Entry, Landed, Parachute, Rest, Thrust};
        match self {
            Rest => matches!(next, Rest | Thrust),
            Thrust => matches!(next, Coast | Thrust),
            Coast => matches!(next, Thrust | Coast | Entry | Parachute | Landed),
            Entry => matches!(next, Entry | Parachute | Landed),
            Parachute => matches!(next, Parachute | Landed),
            Landed => next == Landed,
            Phase::Spin => true,
        }
    }
}

/// A phase from an instant to another \[s\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stretch {
    /// Which.
    pub phase: Phase,
    /// From (in).
    pub from_s: f64,
    /// To (out).
    pub to_s: f64,
}

/// `[phases]` as stretches in the order of time.
///
/// # Errors
/// When one is empty or backwards, two overlap, or one comes where no flight has it, naming both.
pub fn told(pairs: &PhasePairs, file: &Path) -> Result<Vec<Stretch>, CaseError> {
    let of = |phase: Phase, own: &[[f64; 2]]| -> Vec<Stretch> {
        let stretch = |[from_s, to_s]: &[f64; 2]| Stretch {
            phase,
            from_s: *from_s,
            to_s: *to_s,
        };
        own.iter().map(stretch).collect()
    };
    let mut all: Vec<Stretch> = [
        of(Phase::Rest, &pairs.rest),
        of(Phase::Thrust, &pairs.thrust),
        of(Phase::Coast, &pairs.coast),
        of(Phase::Spin, &pairs.spin),
        of(Phase::Entry, &pairs.entry),
        of(Phase::Parachute, &pairs.parachute),
        of(Phase::Landed, &pairs.landed),
    ]
    .concat();
    for own in &all {
        if !(own.from_s.is_finite() && own.to_s.is_finite() && own.from_s < own.to_s) {
            let problem = format!(
                "[{}, {}] has no length; from must be less than to",
                own.from_s, own.to_s
            );
            return Err(CaseError::key(file, format!("phases.{}", own.phase.word()), problem));
        }
    }
    all.sort_by(|one, other| one.from_s.total_cmp(&other.from_s));
    let along: Vec<&Stretch> = all.iter().filter(|own| own.phase != Phase::Spin).collect();
    for pair in along.windows(2) {
        let (one, next) = (pair[0], pair[1]);
        let place = |own: &Stretch| format!("{} [{}, {}]", own.phase.word(), own.from_s, own.to_s);
        let problem = if one.to_s > next.from_s {
            format!(
                "overlaps {}; but for spin, one phase ends before the next begins",
                place(one)
            )
        } else if !one.phase.may_be_followed_by(next.phase) {
            format!(
                "follows {}; a flight goes rest, thrust, coast, entry, parachute, landed, and only stages push again",
                place(one)
            )
        } else {
            continue;
        };
        return Err(CaseError::key(
            file,
            format!("phases.{}", next.phase.word()),
            format!("[{}, {}] {problem}", next.from_s, next.to_s),
        ));
    }
    Ok(all)
}

/// \[s\] spans in which nothing moves.
pub fn still(stretches: &[Stretch]) -> Vec<(f64, f64)> {
    let own = stretches
        .iter()
        .filter(|own| matches!(own.phase, Phase::Rest | Phase::Landed));
    own.map(|own| (own.from_s, own.to_s)).collect()
}

/// Whether the unit is under way then, or within [`BIN_S`] of it: no phase is known more finely.
pub fn flies(stretches: &[Stretch], t_s: f64) -> bool {
    stretches
        .iter()
        .any(|own| own.phase.is_flight() && (own.from_s - BIN_S..own.to_s + BIN_S).contains(&t_s))
}

/// To a thousandth of a second, for a file.
pub fn rounded(stretches: &[Stretch]) -> Vec<Stretch> {
    let own = |time_s: f64| (1e3 * time_s).round() / 1e3;
    let each = stretches.iter().map(|stretch| Stretch {
        phase: stretch.phase,
        from_s: own(stretch.from_s),
        to_s: own(stretch.to_s),
    });
    each.collect()
}

/// By what phases are known, for a file.
pub fn told_by(are_told: bool) -> &'static str {
    if are_told { "case.toml" } else { "found" }
}

/// Whether the first phase of a flight that the log has is one under way: it began before the log did.
pub fn is_begun_in_flight(stretches: &[Stretch], first_s: f64) -> bool {
    let first = stretches.iter().find(|own| own.phase.is_flight());
    first.is_some_and(|own| own.from_s <= first_s + BIN_S || own.phase != Phase::Thrust)
}

/// A line, and one more where the log begins in flight.
pub fn line(stretches: &[Stretch], are_told: bool, first_s: f64) -> String {
    let each: Vec<String> = (stretches.iter())
        .map(|own| format!("{} {:.1} to {:.1} s", own.phase.word(), own.from_s, own.to_s))
        .collect();
    let mut out = format!("PHASES  {}: ", if are_told { "of case.toml" } else { "found" });
    out += &if each.is_empty() {
        "none".to_owned()
    } else {
        each.join(", ")
    };
    if !are_told {
        out += "; correct them by [phases] in case.toml";
    }
    out += "\n";
    if is_begun_in_flight(stretches, first_s) {
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "BEGIN   the log begins in flight, or within half a second of it: no rest before tells zeros and attitude; cut it earlier if there is more"
        );
    }
    out
}
