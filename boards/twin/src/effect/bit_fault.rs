//! Bit faults: one bit of the code is stuck, or the two bytes come in the wrong order.

use super::spread::{Beneath, IMPOSSIBLE, View, mixed, unusual_part};
use super::{Effect, Nature, Page};
use crate::channel::Kind;
use crate::part::signal::Noise;

/// The variant of exchanged bytes: one after bit 11, the highest a 12-bit code has apart from its sign.
const EXCHANGED: i16 = 24;

/// What the fault makes of a code.
fn forced(code: i16, variant: i16) -> i16 {
    match variant {
        EXCHANGED => code.swap_bytes(),
        _ if variant % 2 == 0 => code & !(1 << (variant / 2)),
        _ => code | 1 << (variant / 2),
    }
}

/// The codes that the fault makes this one of.
fn origins(code: i16, variant: i16) -> [Option<i16>; 2] {
    if variant == EXCHANGED {
        return [Some(code.swap_bytes()), None];
    }
    let possible = forced(code, variant) == code;
    [code, code ^ 1 << (variant / 2)].map(|origin| possible.then_some(origin))
}

/// ln probability that the sensor gave `origin` where `code` was logged with this residual.
fn of_origin(view: &View, code: i16, origin: i16, residual: f64) -> f64 {
    let lsb = view.channel.lsb;
    let from = residual + f64::from(i32::from(origin) - i32::from(code)) * lsb;
    view.within(from - 0.5 * lsb, from + 0.5 * lsb)
}

/// `bit-fault`.
pub struct BitFault;

const PAGE: Page = Page {
    name: "bit-fault",
    physics: "A bit of the count is stuck at 0 or 1, or its two bytes are exchanged.",
    equation: "y = code with bit k forced, or bytes exchanged",
    source: "A line of a bus or a wrong register order",
    excited_by: "any",
    siblings: &["coarse-quantisation", "packet-corruption"],
    confirm_by: "A histogram of the codes: a comb of gaps 2^k wide.",
    nature: Nature::Spread,
    common: true,
    sensors: &[Kind::Accelerometer, Kind::Gyro, Kind::Magnetometer, Kind::Thermometer],
    ..Page::SMOOTH
};

impl Effect for BitFault {
    fn page(&self) -> &'static Page {
        &PAGE
    }

    fn log_likelihood(&self, theta: &[f64], variant: f64, views: &[View]) -> f64 {
        let _ = theta;
        let of = |view: &View| -> f64 {
            if view.channel.bits.is_none() {
                return IMPOSSIBLE * view.measured.len() as f64;
            }
            let lsb = view.channel.lsb;
            let sample = |(k, residual): (usize, f64)| {
                let code = (view.measured[k] / lsb).round() as i16;
                // What it must have been: one code, or, where the stuck bit hides it, two.
                let mass = |origin: i16| of_origin(view, code, origin, residual);
                let fault = match origins(code, variant as i16) {
                    [None, None] => IMPOSSIBLE,
                    [Some(one), None] | [None, Some(one)] => mass(one),
                    [Some(one), Some(other)] => mixed(0.5, mass(one), mass(other)) + 2.0_f64.ln(),
                };
                view.explained(fault, residual)
            };
            view.residuals().map(sample).sum()
        };
        views.iter().map(of).sum()
    }

    fn disturb(&self, theta: &[f64], variant: f64, views: &[View], noise: Noise) -> Vec<Vec<f64>> {
        let _ = (theta, noise);
        let faulty = |view: &View| {
            let fault =
                |measured: &f64| f64::from(forced((measured / view.channel.lsb).round() as i16, variant as i16));
            view.measured
                .iter()
                .map(|measured| fault(measured) * view.channel.lsb)
                .collect()
        };
        views.iter().map(faulty).collect()
    }

    fn beneath(&self, _theta: &[f64], variant: f64, views: &[View]) -> Vec<Vec<Beneath>> {
        let of = |view: &View| -> Vec<Beneath> {
            let lsb = view.channel.lsb;
            let sample = |logged: Beneath, predicted: f64| {
                let (code, residual) = ((logged.value / lsb).round() as i16, logged.value - predicted);
                let away = |origin: i16| f64::from(i32::from(origin) - i32::from(code)) * lsb;
                let added = match origins(code, variant as i16) {
                    [None, None] => return Beneath { worth: 0.0, ..logged },
                    [Some(one), None] | [None, Some(one)] => away(one),
                    [Some(one), Some(other)] => {
                        let mass = |origin: i16| of_origin(view, code, origin, residual);
                        let part = unusual_part(0.5, mass(one), mass(other));
                        away(one) * (1.0 - part) + away(other) * part
                    }
                };
                Beneath {
                    value: logged.value + added,
                    ..logged
                }
            };
            let pairs = view.as_logged().into_iter().zip(view.predicted);
            pairs.map(|(logged, predicted)| sample(logged, *predicted)).collect()
        };
        views.iter().map(of).collect()
    }

    fn expected(&self, variant: f64, view: &View) -> Vec<f64> {
        view.mean_of_codes(|code| f64::from(forced(code as i16, variant as i16)))
    }

    fn told(&self, variant: f64) -> Option<String> {
        Some(match variant as i16 {
            EXCHANGED => "the bytes are exchanged".to_owned(),
            number => format!("bit {} is always {}", number / 2, number % 2),
        })
    }

    /// `2 bit` for stuck at 0, `2 bit + 1` for stuck at 1, then exchanged bytes.
    fn variants(&self, _starts_s: &[f64]) -> Vec<f64> {
        (0..=EXCHANGED).map(f64::from).collect()
    }
}
