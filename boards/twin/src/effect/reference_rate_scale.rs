//! Reference rate scale: the table turns faster than it says.
//!
//! Of a table that is told rates, all rates are off by one ratio: the gyros feel it, and the lever arms with the square, which
//! is too little to see; the Earth's share is not the table's. Of a record of attitudes the angle gone about the vertical is:
//! what it tells is turned further, `q_nb = Rz(s heading) q_told`, and gravity and field, known in n, are felt there.

use nalgebra::{UnitQuaternion, Vector3};

use super::reference_sign::MOST_ROWS;
use super::{Effect, Page, Scope, Site, Symbol};
use crate::channel::{Chain, Feel, Kind};

/// `reference-rate-scale`.
pub struct ReferenceRateScale;

/// The variants: of rates, or of the angle about the vertical.
const OF_RATES: f64 = 0.0;
const OF_ATTITUDES: f64 = 1.0;

const PAGE: Page = Page {
    name: "reference-rate-scale",
    physics: "The rate of the table is not what it reports: all gyros are off by one ratio, and the angle gone with them.",
    equation: "y = n.(w + s w_table); of attitudes, q_nb = Rz(s heading) q_told",
    source: "Rate tables: 0.1 to 1 %; better ones 10 ppm",
    excited_by: "rates",
    siblings: &["gyro-scale"],
    confirm_by: "Whole turns against a stopwatch and an index mark.",
    scope: Scope::Unit,
    sensors: &[Kind::Gyro, Kind::Accelerometer, Kind::Magnetometer],
    parameters: &[Symbol::signed("s", "1", 5e-3)],
    ..Page::SMOOTH
};

/// What is felt when the heading, its rate and that one's rate are greater by `scale` than told.
fn truly(feel: &Feel, scale: f64) -> Feel {
    let further = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), scale * feel.heading);
    let q_nb = further * feel.q_nb;
    let to_true_b = |v_b: Vector3<f64>| q_nb.inverse() * (feel.q_nb * v_b);
    let down_b = feel.to_b(Vector3::z());
    let more_b = scale * feel.heading_rate * down_b;
    Feel {
        rate_b: feel.rate_b + more_b,
        rate_dot_b: feel.rate_dot_b + scale * feel.heading_acc * down_b - feel.rate_b.cross(&more_b),
        force_b: to_true_b(feel.force_b),
        field_b_ut: to_true_b(feel.field_b_ut),
        q_nb,
        ..*feel
    }
}

impl Effect for ReferenceRateScale {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn act<'a>(&self, theta: &'a [f64], variant: f64, site: &Site<'a>, chain: &mut Chain<'a>) {
        let scale = theta[0];
        if variant == OF_ATTITUDES {
            let aim = chain.aim;
            chain.add(move |feel, _| aim.input(&truly(feel, scale)) - aim.input(feel));
        } else if site.channel.sensor == Kind::Gyro {
            let (axis_b, earth_n) = (site.channel.axis_b, site.environment.earth_rate_n());
            chain.add(move |feel, input| scale * (input - axis_b.dot(&feel.to_b(earth_n))));
        }
    }

    fn told(&self, variant: f64) -> Option<String> {
        let of = if variant == OF_ATTITUDES {
            "angle about the vertical"
        } else {
            "rates"
        };
        Some(format!("of the {of}"))
    }

    /// A table tells no attitudes.
    fn variants(&self, starts_s: &[f64]) -> Vec<f64> {
        match starts_s.len() <= MOST_ROWS {
            true => vec![OF_RATES],
            false => vec![OF_RATES, OF_ATTITUDES],
        }
    }
}
