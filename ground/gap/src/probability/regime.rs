//! When the gap is there: the regime of the motion that holds most of its energy in the least of the time.
//!
//! In: for each row what the unit does, and the energy of the gap there. Out: a sentence such as "|rate about y| above
//! 62 deg/s: 81 % of the energy in 30 % of the time", or "throughout".

use crate::thresholds::REGIME_TIME;
use twin::predict::Feel;

/// A quantity of the motion: name, unit, value.
type Quantity = (&'static str, &'static str, fn(&Feel) -> f64);

const QUANTITIES: [Quantity; 9] = [
    ("|rate about x|", "deg/s", |feel| feel.rate_b.x.abs().to_degrees()),
    ("|rate about y|", "deg/s", |feel| feel.rate_b.y.abs().to_degrees()),
    ("|rate about z|", "deg/s", |feel| feel.rate_b.z.abs().to_degrees()),
    ("rate", "deg/s", |feel| feel.rate_b.norm().to_degrees()),
    ("angular acceleration", "deg/s2", |feel| {
        feel.rate_dot_b.norm().to_degrees()
    }),
    ("specific force", "m/s2", |feel| feel.force_b.norm()),
    ("temperature", "degC", |feel| feel.temperature_c),
    ("temperature rate", "degC/s", |feel| feel.temperature_rate.abs()),
    ("time", "s", |feel| feel.t_s),
];

/// In words, when the energy is there.
pub fn when(feels: &[Feel], energy: &[f64]) -> String {
    let total: f64 = energy.iter().sum();
    let wanted = (feels.len() as f64 * REGIME_TIME) as usize;
    if total <= 0.0 || wanted == 0 {
        return "throughout".to_owned();
    }
    // Twice what evenly spread energy has there.
    let mut best = (2.0 * REGIME_TIME, "throughout".to_owned());
    for (name, unit, value) in QUANTITIES {
        let values: Vec<f64> = feels.iter().map(value).collect();
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|one, other| values[*other].total_cmp(&values[*one]));
        let spread = values[order[0]] - values[order[order.len() - 1]];
        if spread <= 1e-9 {
            continue;
        }
        for (side, rows) in [("above", &order[..wanted]), ("below", &order[order.len() - wanted..])] {
            let share = rows.iter().map(|row| energy[*row]).sum::<f64>() / total;
            let edge = if side == "above" { rows[rows.len() - 1] } else { rows[0] };
            if share > best.0 {
                let words = format!(
                    "{name} {side} {:.3} {unit}: {:.0} % of the energy in {:.0} % of the time",
                    values[edge],
                    100.0 * share,
                    100.0 * REGIME_TIME
                );
                best = (share, words);
            }
        }
    }
    best.1
}
