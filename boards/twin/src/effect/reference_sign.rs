//! Reference sign: a command, a row or an axis of the reference has the wrong sign.
//!
//! Of a reference that tells attitudes it may be a component of the quaternion (all three: it is told the other way round,
//! from n to b). With `S` the diagonal of the signs of x, y, z and `w` the rate against n: where an even number is reversed
//! the true attitude is `S C S`, whose rate is `S w_b`; where an odd number is, it is the transpose, whose rate is `S w_n`.
//! Force and field are known in n whatever the attitude, and are felt in the true one.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::{Effect, Nature, Page, Scope, Site};
use crate::channel::{Chain, Feel, Kind};
use crate::environment::Environment;

/// `reference-sign`.
pub struct ReferenceSign;

/// Which components change sign: bits 0, 1, 2 are x, y, z.
const SIGNS: core::ops::Range<u32> = 1..8;
/// A log of at most this many rows is a table, whose rows may be wrong one by one: variants are then `8 row + signs`, rows
/// counted from one. Of a longer one the attitude may be: `-signs`.
pub(super) const MOST_ROWS: usize = 64;

const PAGE: Page = Page {
    name: "reference-sign",
    physics: "The reference has the wrong sign: of a commanded rate in one row, of an axis throughout, or of the attitude.",
    equation: "w_b with the sign of x, y or z reversed, on all rows or on one; or q_nb",
    source: "Thesis 000, Table 7.3: rows 7, 8, 11, 12 and 15; thesis 002, Table 4.1",
    excited_by: "rates of both signs",
    siblings: &["mag-axis-order", "gyro-misalignment", "plate-rotation"],
    confirm_by: "Turn by hand and watch both signs.",
    nature: Nature::Discrete,
    scope: Scope::Unit,
    sensors: &[Kind::Gyro, Kind::Accelerometer, Kind::Magnetometer],
    ..Page::SMOOTH
};

fn signs(bits: u32) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| if bits >> axis & 1 == 1 { -1.0 } else { 1.0 })
}

/// What is felt in the true attitude, given what would be in the one told. `earth_n` is the Earth's rate.
fn truly(feel: &Feel, signs: Vector3<f64>, earth_n: Vector3<f64>) -> Feel {
    let told = feel.q_nb;
    let vector = told.vector().component_mul(&signs);
    let q_nb = UnitQuaternion::new_unchecked(Quaternion::from_parts(told.scalar(), vector));
    let turning = |v_b: Vector3<f64>| signs.component_mul(&if signs.product() > 0.0 { v_b } else { told * v_b });
    Feel {
        q_nb,
        rate_b: turning(feel.rate_b - feel.to_b(earth_n)) + q_nb.inverse() * earth_n,
        rate_dot_b: turning(feel.rate_dot_b),
        force_b: q_nb.inverse() * (told * feel.force_b),
        field_b_ut: q_nb.inverse() * (told * feel.field_b_ut),
        ..*feel
    }
}

impl Effect for ReferenceSign {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, _theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        if variant < 0.0 {
            let (signs, aim, earth_n) = (signs(-variant as u32), chain.aim, site.environment.earth_rate_n());
            chain.add_gross(move |feel| aim.input(&truly(feel, signs, earth_n)) - aim.input(feel));
            return;
        }
        if site.channel.sensor != Kind::Gyro {
            return;
        }
        let (signs, row) = (signs(variant as u32 % 8), (variant / 8.0).floor());
        if row == 0.0 {
            chain.aim.axis_b.component_mul_assign(&signs);
            return;
        }
        // The rows of a table stand at 0, 1, 2 s.
        let row_s = row - 1.0;
        let axis_b = chain.aim.axis_b;
        let slot_s = site.channel.slot_s;
        chain.add(move |feel, input| match (feel.t_s - slot_s - row_s).abs() < 0.5 {
            true => axis_b.component_mul(&signs).dot(&feel.rate_b) - input,
            false => 0.0,
        });
    }

    fn retold(&self, variant: f64, feel: &Feel, environment: &Environment) -> Option<Feel> {
        (variant < 0.0).then(|| truly(feel, signs(-variant as u32), environment.earth_rate_n()))
    }

    fn told(&self, variant: f64) -> Option<String> {
        let number = variant.abs() as u32;
        let axes = ["x", "y", "z"].into_iter().enumerate();
        let axes: Vec<&str> = axes
            .filter(|(axis, _)| number >> axis & 1 == 1)
            .map(|(_, name)| name)
            .collect();
        let of = if variant < 0.0 {
            "of the attitude's quaternion"
        } else {
            "of the rate"
        };
        let row = if variant >= 8.0 {
            format!(", in row {}", (variant / 8.0).floor())
        } else {
            String::new()
        };
        Some(format!("{} {of}{row}", axes.join(" and ")))
    }

    /// Signs of the rate on all rows; then, in a table, on each, and elsewhere signs of the attitude.
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        let of_rates = SIGNS.map(f64::from);
        if starts_s.len() > MOST_ROWS {
            return of_rates.chain(SIGNS.map(|signs| -f64::from(signs))).collect();
        }
        let rows = starts_s.iter().map(|start_s| start_s.round() + 1.0);
        let of_rows = rows.flat_map(|row| SIGNS.map(move |signs| 8.0 * row + f64::from(signs)));
        of_rates.chain(of_rows).collect()
    }
}
