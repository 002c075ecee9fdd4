//! A log that tests make: the unit of the theses, tumbling.
//!
//! In: instants, and the value of each row. Out: a twin of which no effect is named, and a log in which every channel reads these values at every
//! instant, all fitted.

use twin::{
    environment::Environment,
    motion::Tumble,
    predict::{Scene, Twin, emems},
};

use crate::input::{log::Series, windows::Fit};

/// \[s\] between rows.
pub const PERIOD_S: f64 = 0.2;

/// The twin over so many rows.
pub fn twin(rows: u32) -> Twin {
    let environment = Environment::laboratory();
    let starts_s: Vec<f64> = (0..rows).map(|row| PERIOD_S * f64::from(row)).collect();
    let scene = Scene::new(&Tumble::new(), &environment, 0.0, PERIOD_S * f64::from(rows), 0.01);
    Twin::new(emems(|_| 0.0), environment, scene, starts_s).expect("no effect is named")
}

/// Its log.
pub fn log(twin: &Twin, value: impl Fn(u32) -> f64) -> Fit {
    let rows = 0..twin.starts_s().len() as u32;
    let all = Series {
        rows: rows.clone().collect(),
        values: rows.map(value).collect(),
    };
    Fit {
        channels: vec![all; twin.unit().channels.len()],
    }
}
