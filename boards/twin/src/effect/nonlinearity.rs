//! Nonlinearity of the answer: what is left when the best straight line is taken away.

use super::{Effect, Page, Site, Symbol};
use crate::channel::{Chain, Kind};

/// `gyro-nonlinearity`.
pub struct GyroNonlinearity;

impl Effect for GyroNonlinearity {
    fn page(&self) -> &'static Page {
        &GYRO
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let (cubic, asymmetry) = (theta[0], theta[1]);
        chain.add(move |_, input| cubic * input.powi(3) + asymmetry * input.abs());
    }
}

const GYRO: Page = Page {
    name: "gyro-nonlinearity",
    physics: "The gyro's answer bends at high rates, or differs between the two senses of rotation.",
    equation: "y = u + a u^3 + c abs(u), u = n.w",
    source: "ADIS16265 data sheet: 0.1 % of full scale",
    excited_by: "five rates of each sign",
    siblings: &[
        "gyro-saturation",
        "gyro-sine-response",
        "gyro-scale",
        "gyro-scale-temperature",
    ],
    confirm_by: "A staircase of rates up to the range: the residual goes with the cube of the rate.",
    common: true,
    sensors: &[Kind::Gyro],
    parameters: &[Symbol::signed("a", "s^2/rad^2", 1e-3), Symbol::signed("c", "1", 2e-3)],
    ..Page::SMOOTH
};

/// `accel-nonlinearity`.
pub struct AccelNonlinearity;

impl Effect for AccelNonlinearity {
    fn page(&self) -> &'static Page {
        &ACCEL
    }

    fn act<'a>(&self, theta: &'a [f64], _variant: f64, _site: &Site<'a>, chain: &mut Chain<'a>) {
        let quadratic = theta[0];
        chain.add(move |_, input| quadratic * input * input);
    }
}

const ACCEL: Page = Page {
    name: "accel-nonlinearity",
    physics: "The accelerometer's answer bends: the proof mass is sprung more softly to one side.",
    equation: "y = u + a u^2, u = n.f",
    source: "Capacitive accelerometers: 0.1 to 0.5 % of full scale",
    excited_by: "one g and more than one g",
    siblings: &["accel-bias", "accel-scale", "lever-arm", "plate-flexing"],
    confirm_by: "A centrifuge at several rates; with one g alone it is a bias and a scale.",
    common: false,
    sensors: &[Kind::Accelerometer],
    parameters: &[Symbol::signed("a", "s^2/m", 1e-3)],
    ..Page::SMOOTH
};
