//! Six poses: where every accelerometer and magnetometer is, its offset and scale, and whether the plates agree.

use nalgebra::{Matrix3, Vector3};
use packets::{channel::Quantity, magnitude::G};
use twin::geometry::dcm_bp;

use super::{Finding, Outcome, Place};
use crate::acceptance::{
    evidence::{Evidence, Stage, channel, spread},
    fit::{self, TriadFit},
    limits,
    pose::POSES,
};

/// A magnetometer whose poses are off by more than this part of the field is not as drawn, or was not held as asked: poses by
/// hand are good to 10 deg, which is 0.17; a wrong axis leaves 0.5 and more.
const FIELD_MISFIT: f64 = 0.3;

/// A standard gravity in milli-g, for offsets.
const MG: f64 = 1e-3 * G;

/// The readings of a triad in every pose that was taken: pose and mean, in nominal units.
fn taken(evidence: &Evidence, quantity: Quantity, plate: usize) -> Vec<(usize, Vector3<f64>)> {
    let stretches = evidence.stretches.iter().filter_map(|stretch| match stretch.stage {
        Stage::Pose(pose) => Some((pose, stretch)),
        _ => None,
    });
    stretches
        .filter_map(|(pose, stretch)| {
            let mean = |axis| spread(&evidence.counts(stretch, channel(quantity, plate, axis))).map(|(mean, _)| mean);
            Some((pose, Vector3::new(mean(0)?, mean(1)?, mean(2)?) * quantity.scale().0))
        })
        .collect()
}

fn to_b(pose: usize) -> Matrix3<f64> {
    POSES[pose].q_tb().inverse().to_rotation_matrix().into_inner()
}

/// All of it.
pub fn judge(evidence: &Evidence, place: Place, outcome: &mut Outcome) {
    let gravity_t = Vector3::new(0.0, 0.0, -place.gravity);
    let forces = [0, 1, 2, 3].map(|plate| taken(evidence, Quantity::SpecificForce, plate));
    let fields = [0, 1, 2, 3].map(|plate| taken(evidence, Quantity::Field, plate));
    let accelerometers = [0, 1, 2, 3].map(|plate| fitted(plate, &forces[plate], &gravity_t));
    let field_t = field_of_table(&fields, &accelerometers);
    // A field measured on the spot says how large it is; otherwise the parts' own scale does.
    let field_t = field_t.map(|field| place.field_ut.map_or(field, |strength| field.normalize() * strength));
    let magnetometers = [0, 1, 2, 3].map(|plate| match &field_t {
        Some(field) => fitted(plate, &fields[plate], field),
        None => Err("no two magnetometers agree on a field: were all poses held with the x arrow away from you?"),
    });
    plates(&accelerometers, &magnetometers, outcome);
    for (name, fits, kind) in [
        ("accelerometer", &accelerometers, &ACC),
        ("magnetometer", &magnetometers, &MAG),
    ] {
        for (plate, fit) in fits.iter().enumerate() {
            let part = format!("{name} {}", plate + 1);
            wiring(&part, plate, fit, outcome);
            numbers(&part, fit, kind, outcome);
        }
    }
    parity(
        "accelerometers",
        &forces,
        limits::ACC_OFFSET_MG * MG + limits::ACC_SCALE * place.gravity,
        "m/s2",
        outcome,
    );
    if let Some(field) = field_t {
        let strength = field.norm();
        outcome.findings.push(Finding {
            part: "field".into(),
            what: "strength at the table",
            measured: format!("{strength:.1} uT"),
            limit: "22 to 67 uT".into(),
            good: (22.0..=67.0).contains(&strength),
            check: "iron, magnets or currents at the table: the Earth's field is 22 to 67 uT (IGRF-13)".into(),
        });
        parity(
            "magnetometers",
            &fields,
            limits::MAG_OFFSET_UT + limits::MAG_SCALE * strength,
            "uT",
            outcome,
        );
        outcome.field_t_ut = Some(field.into());
    }
    outcome.accelerometers = accelerometers.map(Result::ok);
    outcome.magnetometers = magnetometers.map(Result::ok);
}

type Fitted = Result<TriadFit, fit::Unfitted>;

fn fitted(plate: usize, taken: &[(usize, Vector3<f64>)], vector_t: &Vector3<f64>) -> Fitted {
    if taken.is_empty() {
        return Err("not read");
    }
    let felt_b: Vec<_> = taken.iter().map(|(pose, _)| POSES[*pose].in_b(vector_t)).collect();
    let read: Vec<_> = taken.iter().map(|(_, read)| *read).collect();
    fit::triad(plate, &felt_b, &read)
}

/// The field that those magnetometers agree on that do not contradict themselves: as drawn, or else where the accelerometers say
/// that their plates are.
fn field_of_table(fields: &[Vec<(usize, Vector3<f64>)>; 4], accelerometers: &[Fitted; 4]) -> Option<Vector3<f64>> {
    let as_plates = |of: &dyn Fn(usize) -> usize| -> Vec<Vector3<f64>> {
        let one = |plate: usize| {
            let turned: Vec<_> = fields[plate].iter().map(|(pose, _)| to_b(*pose)).collect();
            let read: Vec<_> = fields[plate].iter().map(|(_, read)| *read).collect();
            fit::field_t(of(plate), &turned, &read).filter(|(_, misfit)| *misfit <= FIELD_MISFIT)
        };
        (0..4).filter_map(one).map(|(field, _)| field).collect()
    };
    let drawn = as_plates(&|plate| plate);
    let found = if drawn.is_empty() {
        as_plates(&|plate| accelerometers[plate].as_ref().map_or(plate, |fit| fit.seat.plate))
    } else {
        drawn
    };
    // The median of each component: a triad with all three axes inverted does not contradict itself, but the others.
    let median = |axis: usize| {
        let mut values: Vec<f64> = found.iter().map(|field| field[axis]).collect();
        values.sort_by(f64::total_cmp);
        let middle = values.len() / 2;
        match values.len() {
            0 => 0.0,
            odd if odd % 2 == 1 => values[middle],
            _ => 0.5 * (values[middle - 1] + values[middle]),
        }
    };
    (!found.is_empty()).then(|| Vector3::new(median(0), median(1), median(2)))
}

/// Which plate each channel of the multiplexer leads to.
fn plates(accelerometers: &[Fitted; 4], magnetometers: &[Fitted; 4], outcome: &mut Outcome) {
    for plate in 0..4 {
        let feel: Vec<usize> = [&accelerometers[plate], &magnetometers[plate]]
            .into_iter()
            .filter_map(|fit| fit.as_ref().ok().map(|fit| fit.seat.plate))
            .collect();
        let number = plate + 1;
        // One triad alone that feels like another plate is a wrong part; both are a wrong channel.
        let other = feel
            .iter()
            .find(|felt| **felt != plate && feel.iter().all(|all| all == *felt));
        let measured = match (other, feel.is_empty()) {
            (Some(other), _) => format!("leads to plate {}", other + 1),
            (None, true) => "not measured".into(),
            (None, false) => format!("leads to plate {number}"),
        };
        let check = match other {
            Some(other) => format!(
                "plates {number} and {} are exchanged: the cables at SC{plate}, SD{plate} and SC{other}, SD{other} of the multiplexer",
                other + 1
            ),
            None => "see the self-tests of the plate's parts".into(),
        };
        outcome.findings.push(Finding {
            part: format!("multiplexer channel {plate}"),
            what: "wiring",
            measured,
            limit: format!("leads to plate {number}"),
            good: other.is_none() && !feel.is_empty(),
            check,
        });
    }
}

fn wiring(part: &str, plate: usize, fit: &Fitted, outcome: &mut Outcome) {
    let (measured, good, check) = match fit {
        Err(why) => (
            (*why).to_owned(),
            false,
            "see its self-test; then do the poses again".to_owned(),
        ),
        Ok(fit) if !fit.seat.is_drawn(plate) => {
            let check = match fit.seat.plate == plate {
                true => format!("{part} is soldered turned, or is another part with other axes"),
                false => {
                    "the plate's channel of the multiplexer (above); if that is right, the part is soldered turned"
                        .into()
                }
            };
            (fit.seat.words(plate), false, check)
        }
        Ok(fit) => (
            format!("as drawn, {:.1} deg off", fit.off_deg),
            fit.off_deg <= limits::AXIS_DEG,
            "was it held square in every pose? Then the plate is not seated, or the part is soldered crooked".into(),
        ),
    };
    outcome.findings.push(Finding {
        part: part.into(),
        what: "axes",
        measured,
        limit: format!("as drawn, within {} deg", limits::AXIS_DEG),
        good,
        check,
    });
}

/// How the numbers of a kind of triad are judged.
struct Kind {
    offset: f64,
    unit: (f64, &'static str),
    scale: f64,
    offset_check: &'static str,
    scale_check: &'static str,
}

const ACC: Kind = Kind {
    offset: limits::ACC_OFFSET_MG * MG,
    unit: (1.0 / MG, "mg"),
    scale: limits::ACC_SCALE,
    offset_check: "mechanical stress: solder joints of the part, screws of the plate; then replace it",
    scale_check: "three times nominal is a LIS331DLH (1 mg a digit), which has the same WHO_AM_I; else its full scale, then the part",
};

const MAG: Kind = Kind {
    offset: limits::MAG_OFFSET_UT,
    unit: (1.0, "uT"),
    scale: limits::MAG_SCALE,
    offset_check: "a magnet or magnetised iron on the plate: screws, battery, connector shells, a current beside it",
    scale_check: "its gain setting; soft iron beside it; a clone with another sensitivity",
};

fn numbers(part: &str, fit: &Fitted, kind: &Kind, outcome: &mut Outcome) {
    let Ok(fit) = fit else { return };
    let bias = fit
        .axes
        .iter()
        .map(|axis| axis.bias)
        .max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let scale = (fit.axes.iter().map(|axis| axis.sensitivity_b.norm()))
        .max_by(|a, b| (a - 1.0).abs().total_cmp(&(b - 1.0).abs()));
    let (factor, unit) = kind.unit;
    let (bias, scale) = (bias.unwrap_or_default(), scale.unwrap_or_default());
    outcome.findings.push(Finding {
        part: part.into(),
        what: "offset",
        measured: format!("{:+.1} {unit}", bias * factor),
        limit: format!("{:.0} {unit}", kind.offset * factor),
        good: bias.abs() <= kind.offset,
        check: kind.offset_check.into(),
    });
    outcome.findings.push(Finding {
        part: part.into(),
        what: "scale",
        measured: format!("{scale:.3} of nominal"),
        limit: format!("1 within {:.0} %", 100.0 * kind.scale),
        good: (scale - 1.0).abs() <= kind.scale,
        check: kind.scale_check.into(),
    });
}

/// The largest difference between a plate and the mean of all, in any pose, in b.
fn parity(part: &str, taken: &[Vec<(usize, Vector3<f64>)>; 4], limit: f64, unit: &str, outcome: &mut Outcome) {
    let poses = taken.iter().map(Vec::len).min().unwrap_or(0);
    let mut worst = (0.0, 0, 0);
    let poses_of = |k: usize| taken.each_ref().map(|plate| plate[k]);
    for poses in (0..poses).map(poses_of) {
        let vectors_b = [0, 1, 2, 3].map(|plate: usize| dcm_bp(plate) * poses[plate].1);
        let mean_b = vectors_b.iter().sum::<Vector3<f64>>() / 4.0;
        for (plate, vector_b) in vectors_b.iter().enumerate() {
            let off = (vector_b - mean_b).norm();
            if off > worst.0 {
                worst = (off, plate, poses[plate].0);
            }
        }
    }
    let (off, plate, pose) = worst;
    outcome.findings.push(Finding {
        part: part.into(),
        what: "parity of the plates",
        measured: if poses == 0 {
            "not measured: a plate is missing".into()
        } else {
            format!("{off:.2} {unit} (plate {}, {})", plate + 1, POSES[pose].name)
        },
        limit: format!("{limit:.2} {unit}"),
        good: poses > 0 && off <= limit,
        check: format!("plate {}: wiring, offset and scale above", plate + 1),
    });
}
