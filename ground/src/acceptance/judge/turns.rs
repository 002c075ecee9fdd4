//! Six turns: which axis every gyro feels and with which sign, its scale, and whether the four agree.

use nalgebra::Vector3;
use packets::channel::{GYRO_LSB, Quantity};
use twin::geometry::gyro_axis_b;

use super::{Finding, Outcome};
use crate::acceptance::{
    evidence::{Evidence, Stage, Stretch, channel, spread},
    fit::{self, GyroFit},
    limits,
    pose::TURNS,
};

/// What the four gyros integrated in a turn \[rad\], at their nominal scale and less their bias; `None` where one was not sampled.
fn integrated(evidence: &Evidence, stretch: &Stretch, bias: &[Option<(f64, f64)>; 4]) -> [Option<f64>; 4] {
    let within = stretch.from_s..=stretch.to_s;
    let frames: Vec<_> = evidence
        .frames
        .iter()
        .filter(|frame| within.contains(&frame.at_s))
        .collect();
    [0, 1, 2, 3].map(|plate| {
        let (bias, _) = bias[plate]?;
        let mut sum = 0.0;
        for frame in &frames {
            let increments = &frame.derived.increments;
            let gyro = &increments.gyro[plate];
            if gyro.count == 0 {
                return None;
            }
            sum += f64::from(gyro.integral_counts_s) * GYRO_LSB - bias * f64::from(increments.covered_us) * 1e-6;
        }
        (!frames.is_empty()).then_some(sum)
    })
}

/// All of it.
pub fn judge(evidence: &Evidence, outcome: &mut Outcome) {
    let rest = evidence.stretch(Stage::Rest);
    let bias = [0, 1, 2, 3].map(|plate| {
        let counts = evidence.counts(rest?, channel(Quantity::Rate, plate, 0));
        spread(&counts).map(|(mean, sd)| (mean * GYRO_LSB, sd * GYRO_LSB / (counts.len() as f64).sqrt()))
    });
    let turns: Vec<(Vector3<f64>, [Option<f64>; 4])> = (evidence.stretches.iter())
        .filter_map(|stretch| match stretch.stage {
            Stage::Turn(turn) => Some((TURNS[turn].angle_b(), integrated(evidence, stretch, &bias))),
            _ => None,
        })
        .collect();
    let fits = [0, 1, 2, 3].map(|plate| {
        let whole = turns
            .iter()
            .filter_map(|(angle_b, read)| read[plate].map(|read| (*angle_b, read)));
        let (angles_b, read): (Vec<_>, Vec<_>) = whole.unzip();
        let bias = bias[plate].ok_or("not read")?;
        fit::gyro(plate, &angles_b, &read, bias)
    });
    for (plate, fit) in fits.iter().enumerate() {
        gyro(plate, fit, &fits, outcome);
    }
    parity(&turns, outcome);
    outcome.gyros = fits.map(Result::ok);
}

type Fitted = Result<GyroFit, fit::Unfitted>;

fn gyro(plate: usize, fit: &Fitted, all: &[Fitted; 4], outcome: &mut Outcome) {
    let part = format!("gyro {}", plate + 1);
    let (measured, good, check) = match fit {
        Err(why) => (
            (*why).to_owned(),
            false,
            "see its self-test; then do the turns again".to_owned(),
        ),
        Ok(fit) if fit.plate != plate => {
            let other = fit.plate;
            let back = all[other].as_ref().is_ok_and(|fit| fit.plate == plate);
            let check = match back {
                true => format!(
                    "gyros {} and {} are exchanged: their chip selects PC{plate} and PC{other} are crossed; or was it turned the other way round?",
                    plate + 1,
                    other + 1
                ),
                false => format!("the chip select PC{plate} leads to another plate"),
            };
            (format!("feels the axis of gyro {}", other + 1), false, check)
        }
        Ok(fit) if fit.inverted => (
            "inverted".into(),
            false,
            "was it turned the way round that was asked for? Then it is soldered on the other side of the plate, or is a part with the other sign".into(),
        ),
        Ok(fit) => (
            format!("as drawn, {:.1} deg off", fit.off_deg),
            fit.off_deg <= limits::AXIS_DEG,
            "was it turned about the axis that was asked for? Then the plate is not seated".into(),
        ),
    };
    outcome.findings.push(Finding {
        part: part.clone(),
        what: "axis",
        measured,
        limit: format!("as drawn, within {} deg", limits::AXIS_DEG),
        good,
        check,
    });
    let Ok(fit) = fit else { return };
    let scale = fit.sensitivity_b.norm();
    outcome.findings.push(Finding {
        part,
        what: "scale",
        measured: format!("{scale:.4} of nominal"),
        limit: format!("1 within {:.0} %", 100.0 * limits::GYRO_SCALE),
        good: (scale - 1.0).abs() <= limits::GYRO_SCALE,
        check: "did every turn end where it began? Then its range setting; then replace it".into(),
    });
}

/// Four gyros and three rates: what is left of `v . gyro`, where `v` is across all the axes of the drawing.
fn parity(turns: &[(Vector3<f64>, [Option<f64>; 4])], outcome: &mut Outcome) {
    // v^T G = 0 of the tetrahedron: three equal sides, and the base as much as their common part along z.
    let z = gyro_axis_b(0).z;
    let across = nalgebra::Vector4::new(1.0, 1.0, 1.0, -3.0 * z).normalize();
    let left = |(angle_b, read): &(Vector3<f64>, [Option<f64>; 4])| {
        let sum: Option<f64> = (0..4).map(|plate| read[plate].map(|read| read * across[plate])).sum();
        sum.map(|sum| sum.abs() / angle_b.norm())
    };
    let worst = turns.iter().filter_map(left).fold(None, |most: Option<f64>, left| {
        Some(most.map_or(left, |most| most.max(left)))
    });
    let limit = limits::GYRO_SCALE.hypot(limits::AXIS_DEG.to_radians());
    outcome.findings.push(Finding {
        part: "gyros".into(),
        what: "parity of the four",
        measured: worst.map_or("not measured: one is missing".into(), |worst| {
            format!("{:.2} % of the turn", 100.0 * worst)
        }),
        limit: format!("{:.1} %", 100.0 * limit),
        good: worst.is_some_and(|worst| worst <= limit),
        check: "scale and axes above: one gyro does not belong to the other three".into(),
    });
}
