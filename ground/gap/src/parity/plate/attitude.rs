//! The attitude of one plate in the form that every log without a reference has.

use crate::parity::{
    plate::{Findings, filter::At},
    smooth::told::{Attitude, Told},
};

/// The attitude in the form of [`Told`]; nothing in it where there is none.
pub fn attitude(findings: &Findings) -> Told {
    let one = |at: &At| Attitude {
        t_s: at.t_s,
        q_nb: at.q_nb,
        sigmas_b_deg: at.sigmas_b().map(f64::to_degrees),
    };
    Told {
        attitudes: findings.attitude.iter().flatten().map(one).collect(),
        rests: rests(&findings.field),
        ..Told::default()
    }
}

/// \[s\] spans of rest.
fn rests(nodes: &[At]) -> Vec<(f64, f64)> {
    let mut spans: Vec<(f64, f64)> = Vec::new();
    let mut was = false;
    for pair in nodes.windows(2) {
        let is_rest = pair[1].is_rest;
        match spans.last_mut().filter(|_| was && is_rest) {
            Some(last) => last.1 = pair[1].t_s,
            None if is_rest => spans.push((pair[0].t_s, pair[1].t_s)),
            None => {}
        }
        was = is_rest;
    }
    spans
}
