//! Shares of what the map shows: of the energy above noise, by channel and by plate.
//!
//! In: the gap of each channel in each stretch of the fit windows, 1 being noise alone. Out: the share that each channel has of
//! the energy above that, most first. WHERE, its table and the map are of these same numbers, so that what is said first is
//! what is darkest.

use crate::{diagnose::Diagnosis, input::case::Subject};

/// Shares by name, most first.
pub type Shares = Vec<(String, f64)>;

/// By channel.
pub fn channels(diagnosis: &Diagnosis) -> Shares {
    shares(
        diagnosis
            .cells
            .iter()
            .map(|(name, gaps)| (name.clone(), above_noise(gaps)))
            .collect(),
    )
}

/// By plate or group.
pub fn groups(subject: &Subject, diagnosis: &Diagnosis) -> Shares {
    let unit = subject.twin.unit();
    let of = |group: &str| {
        let own = unit
            .channels
            .iter()
            .zip(&diagnosis.cells)
            .filter(|(channel, _)| channel.group == group);
        own.map(|(_, (_, gaps))| above_noise(gaps)).sum()
    };
    shares(
        unit.groups()
            .into_iter()
            .map(|group| (group.to_owned(), of(group)))
            .collect(),
    )
}

/// A stretch without samples, or quieter than described, takes nothing off the others.
fn above_noise(gaps: &[f64]) -> f64 {
    let above = gaps.iter().map(|gap| gap * gap - 1.0);
    above.filter(|above| *above > 0.0).sum()
}

fn shares(mut parts: Shares) -> Shares {
    let whole: f64 = parts.iter().map(|(_, part)| part).sum();
    for (_, part) in &mut parts {
        *part = if whole > 0.0 { *part / whole } else { 0.0 };
    }
    parts.sort_by(|one, other| other.1.total_cmp(&one.1));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_darkest_in_the_map_has_the_largest_share() {
        let part = |name: &str, gaps: &[f64]| (name.to_owned(), above_noise(gaps));
        let found = shares(vec![
            part("tg3", &[1.2, 1.0, 0.5]),
            part("m2x", &[1.0, 8.0, f64::NAN]),
            part("g1", &[0.9, 0.8, 0.7]),
        ]);
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["m2x", "tg3", "g1"]);
        assert!(found[0].1 > 0.99 && found[2].1 == 0.0);
        assert!((found.iter().map(|(_, part)| part).sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
