//! Several chips rigidly joined on one body: where each lies seen from the first, and how its axes differ.
//!
//! In: a unit with two groups or more that have three gyros each, and its log. Out: [`Beside`], one for every chip after the first. Nothing of the
//! motion is needed: two chips on one body feel the same rate, and their forces differ by `w' x r + w x (w x r)` alone. Which of two chips is
//! off, their difference does not tell; and a place is known no better than twice the scale that all gyros share.
//!
//! | step | file | gives |
//! |---|---|---|
//! | 1 | this one | which channels are a chip, and rows that all of them have whole |
//! | 2 | [`joined`] | the difference of two chips, as linear in what may make it |
//! | 3 | [`regression`] | the fit, robust, with sigmas that hold for coloured noise |
//! | 4 | [`text`] | how it is told |

pub mod joined;
pub mod regression;
pub mod text;

use nalgebra::{Matrix3, Vector3};
use packets::magnitude::median;
use twin::predict::{Kind, UnitDescription};

use crate::{
    input::log::Log,
    parity::chips::joined::{Joined, Readings},
};

/// Rows to either side of one with a sample missing, clipped most often, that are left out: what clips is quick, and low-passes remember it.
const BESIDE_MISSING: usize = 2;

/// Part of a step by which the instants of two chips may differ.
const TOGETHER: f64 = 0.1;

/// Three gyros, and accelerometers and magnetometers where it has three of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chip {
    /// Its group.
    pub name: String,
    gyros: [usize; 3],
    accelerometers: Option<[usize; 3]>,
    magnetometers: Option<[usize; 3]>,
}

/// A chip beside the first.
#[derive(Clone, Debug)]
pub struct Beside {
    /// Which.
    pub name: String,
    /// The first.
    pub first: String,
    /// Rows that were used.
    pub rows: usize,
    /// What differs.
    pub joined: Joined,
}

/// All chips of a unit, in the order of its channels.
pub fn chips(unit: &UnitDescription) -> Vec<Chip> {
    let mut names: Vec<&str> = unit.channels.iter().map(|channel| channel.group.as_str()).collect();
    names.dedup();
    let of = |name: &str| -> Option<Chip> {
        let three = |kind: Kind| -> Option<[usize; 3]> {
            let all = unit.channels.iter().enumerate();
            let own = all.filter(|(_, channel)| channel.group == name && channel.sensor == kind);
            let three: [usize; 3] = own.map(|(at, _)| at).collect::<Vec<_>>().try_into().ok()?;
            directions(unit, three).try_inverse().map(|_| three)
        };
        Some(Chip {
            name: name.to_owned(),
            gyros: three(Kind::Gyro)?,
            accelerometers: three(Kind::Accelerometer),
            magnetometers: three(Kind::Magnetometer),
        })
    };
    let mut chips: Vec<Chip> = Vec::new();
    for name in names {
        chips.extend(of(name).filter(|chip| chips.iter().all(|own| own.name != chip.name)));
    }
    chips
}

/// Every chip beside the first; none of a unit that has no two, that reads them at different instants, or whose log does not determine it.
pub fn look(unit: &UnitDescription, log: &Log) -> Vec<Beside> {
    let chips = chips(unit);
    let Some((first, others)) = chips.split_first() else {
        return Vec::new();
    };
    let all: Vec<usize> = chips.iter().flat_map(Chip::channels).collect();
    let rows = whole(log, &all);
    let t_s: Vec<f64> = rows.iter().map(|row| log.start_s[*row]).collect();
    let step_s = median(log.start_s.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(0.0);
    let is_together = |chip: &Chip| (chip.slot_s(unit) - first.slot_s(unit)).abs() <= TOGETHER * step_s;
    let readings: Vec<Readings> = chips.iter().map(|chip| chip.readings(unit, log, &rows)).collect();
    let mean = |at: usize| readings.iter().map(|own| own.rates[at]).sum::<Vector3<f64>>() / readings.len() as f64;
    let rates: Vec<Vector3<f64>> = (0..rows.len()).map(mean).collect();
    let beside = |(chip, own): (&Chip, &Readings)| {
        let mut joined = Joined::of(&t_s, &rates, &readings[0], own);
        joined.rates.as_ref()?;
        if let Some([place, sigma]) = &mut joined.place_m {
            *place += chip.lever_m(unit) - first.lever_m(unit);
            // All gyros may read too much of a rate together, and the place goes with its square.
            let shared = 2.0 * first.scale_sigma(unit) / (chips.len() as f64).sqrt();
            *sigma = sigma.zip_map(place, |sigma, place| sigma.hypot(shared * place));
        }
        Some(Beside {
            name: chip.name.clone(),
            first: first.name.clone(),
            rows: rows.len(),
            joined,
        })
    };
    let others = others.iter().zip(&readings[1..]);
    others
        .filter(|(chip, _)| is_together(chip))
        .filter_map(beside)
        .collect()
}

impl Chip {
    fn channels(&self) -> Vec<usize> {
        let beside = [self.accelerometers, self.magnetometers].into_iter().flatten();
        [self.gyros].into_iter().chain(beside).flatten().collect()
    }

    fn slot_s(&self, unit: &UnitDescription) -> f64 {
        self.gyros.iter().map(|at| unit.channels[*at].slot_s).sum::<f64>() / 3.0
    }

    fn lever_m(&self, unit: &UnitDescription) -> Vector3<f64> {
        let own = self.accelerometers.iter().flatten();
        own.map(|at| unit.channels[*at].lever_m).sum::<Vector3<f64>>() / 3.0
    }

    fn scale_sigma(&self, unit: &UnitDescription) -> f64 {
        self.gyros
            .iter()
            .map(|at| unit.channels[*at].scale_sigma)
            .fold(0.0, f64::max)
    }

    /// What it reads in rows that have all of its channels, what its described lever arms add taken off the forces.
    fn readings(&self, unit: &UnitDescription, log: &Log, rows: &[usize]) -> Readings {
        let triad = |own: [usize; 3]| -> Vec<Vector3<f64>> {
            let Some(inverse) = directions(unit, own).try_inverse() else {
                return Vec::new();
            };
            let columns = own.map(|at| dense(log, at));
            let reading = |row: &usize| Vector3::from_fn(|axis, _| columns[axis][*row] - unit.channels[own[axis]].bias);
            rows.iter().map(|row| inverse * reading(row)).collect()
        };
        Readings {
            rates: triad(self.gyros),
            forces: self.accelerometers.map(triad).unwrap_or_default(),
            fields: self.magnetometers.map(triad).unwrap_or_default(),
        }
    }
}

/// Directions of three channels, one a row.
pub fn directions(unit: &UnitDescription, own: [usize; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| unit.channels[own[row]].axis_b[column])
}

/// A channel at every row of the log, NaN where it has no sample.
fn dense(log: &Log, channel: usize) -> Vec<f64> {
    let mut values = vec![f64::NAN; log.start_s.len()];
    let series = &log.channels[channel];
    (series.rows.iter().zip(&series.values)).for_each(|(row, value)| values[*row as usize] = *value);
    values
}

/// Rows in which, and beside which, all of these channels have a sample.
fn whole(log: &Log, channels: &[usize]) -> Vec<usize> {
    let mut seen = vec![0; log.start_s.len()];
    for channel in channels {
        log.channels[*channel]
            .rows
            .iter()
            .for_each(|row| seen[*row as usize] += 1);
    }
    let is_whole = |row: usize| {
        let from = row.saturating_sub(BESIDE_MISSING);
        let to = (row + BESIDE_MISSING + 1).min(seen.len());
        seen[from..to].iter().all(|own| *own == channels.len())
    };
    (0..seen.len()).filter(|row| is_whole(*row)).collect()
}
