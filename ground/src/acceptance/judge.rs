//! Evidence to findings: every line of the acceptance test against its limit, and what to check on the board when it fails.
//!
//! In: [`Evidence`]. Out: [`Finding`]s in the order of the test, and the fits that a first calibration set is made of. One subject a
//! file. What was not measured is a finding too, and not a good one.

mod poses;
mod rest;
mod said;
mod timing;
mod turns;

pub use timing::arrivals;

use super::{
    evidence::Evidence,
    fit::{GyroFit, TriadFit},
};

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Which part of the unit.
    pub part: String,
    /// What of it.
    pub what: &'static str,
    /// As measured.
    pub measured: String,
    /// What it may be.
    pub limit: String,
    /// Whether it is.
    pub good: bool,
    /// What to check on the board if not.
    pub check: String,
}

impl Finding {
    /// In one sentence.
    pub fn text(&self) -> String {
        let Finding {
            part,
            what,
            measured,
            limit,
            check,
            ..
        } = self;
        format!("{part}, {what}: {measured}, where {limit} is asked for; {check}")
    }
}

/// What is known of the place.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// [m/s2] gravity.
    pub gravity: f64,
    /// \[uT\] strength of the field, where somebody measured it.
    pub field_ut: Option<f64>,
}

/// What came out.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Every line.
    pub findings: Vec<Finding>,
    /// Accelerometers, where they could be fitted.
    pub accelerometers: [Option<TriadFit>; 4],
    /// Magnetometers.
    pub magnetometers: [Option<TriadFit>; 4],
    /// Gyros.
    pub gyros: [Option<GyroFit>; 4],
    /// \[uT\] the field in the frame of the table, where the magnetometers agree on one.
    pub field_t_ut: Option<[f64; 3]>,
}

impl Outcome {
    /// Whether every line is good.
    pub fn is_good(&self) -> bool {
        self.findings.iter().all(|finding| finding.good)
    }
}

/// Judges.
pub fn judge(evidence: &Evidence, place: Place) -> Outcome {
    let mut outcome = Outcome::default();
    outcome.findings.extend(said::unit(evidence));
    if evidence.packets.is_empty() {
        return outcome;
    }
    outcome.findings.extend(said::sensors(evidence));
    outcome.findings.extend(timing::packets(evidence));
    outcome.findings.extend(timing::bus(evidence));
    outcome.findings.extend(rest::rest(evidence));
    poses::judge(evidence, place, &mut outcome);
    turns::judge(evidence, &mut outcome);
    outcome.findings.extend(said::memory(evidence));
    outcome.findings.extend(said::lines(evidence));
    outcome
}
